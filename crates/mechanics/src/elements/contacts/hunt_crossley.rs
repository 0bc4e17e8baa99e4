//! Contact force from the depth of penetration and its rate.

use crate::mechanism::element::{Energy, SwitchSides};
use autodiff::Scalar;

/// Contact force of Hunt and Crossley: k δ^{3/2} (1 + 1.5 c δ̇) for δ > 0, never negative.
///
/// * `stiffness` k in N/m^{3/2}, `damping` c in s/m, `depth` δ in m, `rate` δ̇ in m/s, `sides` of [`switching_functions`].
///
/// For small c the coefficient of restitution is 1 − c v with the impact velocity v. The force and its first derivatives are
/// continuous at the beginning of contact.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
pub fn contact_force<T: Scalar>(stiffness: T, damping: T, depth: T, rate: T, sides: SwitchSides) -> T {
    let factor = damping * rate * 1.5 + 1.0;
    let pushes = sides.is_positive(0, depth.re()) && sides.is_positive(1, factor.re());
    // On the side of contact the force and its derivative are zero at depth zero, and there is no force beyond it.
    if pushes && depth.re() > 0.0 { stiffness * depth * depth.sqrt() * factor } else { T::zero() }
}

/// Energy stored in the contact: ⅖ k δ^{5/2} in J, the work of the force without damping.
pub fn stored_energy<T: Scalar>(stiffness: T, depth: T, sides: SwitchSides) -> Energy<T> {
    let touches = sides.is_positive(0, depth.re()) && depth.re() > 0.0;
    let potential = if touches { stiffness * depth * depth * depth.sqrt() * 0.4 } else { T::zero() };
    Energy { kinetic: T::zero(), potential }
}

/// Describes a negative stiffness or damping.
pub fn validate(stiffness: f64, damping: f64) -> Option<String> {
    let values = [("stiffness", stiffness, "N/m^1.5"), ("damping", damping, "s/m")];
    let negative = values.into_iter().find(|(_, value, _)| !(*value >= 0.0))?;
    Some(format!("its {} is {} {}", negative.0, negative.1, negative.2))
}

/// Writes the functions at whose zeros the force is not smooth: the depth, and the factor 1 + 1.5 c δ̇, below whose zero the
/// force would be negative.
pub fn switching_functions<T: Scalar>(damping: T, depth: T, rate: T, out: &mut Vec<T>) {
    out.push(depth);
    out.push(if depth.re() > 0.0 { damping * rate * 1.5 + 1.0 } else { T::from(1.0) });
}

/// Number of [`switching_functions`].
pub const SWITCHING_FUNCTIONS: usize = 2;

/// Number of the first [`switching_functions`] that occur in the force with a non-integer power: the depth.
pub const FRACTIONAL_POWERS: usize = 1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contact_force_is_zero_without_contact_and_never_negative() {
        assert_eq!(contact_force(1000.0, 0.2, 0.04, 0.5, SwitchSides::default()), 1000.0 * 0.008 * 1.15);
        assert_eq!(contact_force(1000.0, 0.2, -0.04, 5.0, SwitchSides::default()), 0.0);
        assert_eq!(contact_force(1000.0, 0.2, 0.04, -5.0, SwitchSides::default()), 0.0);
    }

    #[test]
    fn the_stored_energy_is_the_work_of_the_elastic_force() {
        let energy = |depth: f64| stored_energy(1000.0, depth, SwitchSides::default()).potential;
        assert_eq!([energy(0.0), energy(-0.01)], [0.0, 0.0]);
        let slope = (energy(0.04 + 1e-6) - energy(0.04 - 1e-6)) / 2e-6;
        assert!((slope - contact_force(1000.0, 0.0, 0.04, 0.0, SwitchSides::default())).abs() < 1e-8);
    }
}
