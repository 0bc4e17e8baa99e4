//! Contact force from the depth of penetration and its rate.

use autodiff::Scalar;

/// Contact force of Hunt and Crossley: k δ^{3/2} (1 + 1.5 c δ̇) for δ > 0, never negative.
///
/// * `stiffness` k in N/m^{3/2}, `damping` c in s/m, `depth` δ in m, `rate` δ̇ in m/s.
///
/// For small c the coefficient of restitution is 1 − c v with the impact velocity v. The force and its first derivatives are
/// continuous at the beginning of contact.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
pub fn contact_force<T: Scalar>(stiffness: T, damping: T, depth: T, rate: T) -> T {
    if depth.re() <= 0.0 {
        return T::zero();
    }
    let contact_force = stiffness * depth * depth.sqrt() * (damping * rate * 1.5 + 1.0);
    if contact_force.re() > 0.0 { contact_force } else { T::zero() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pushes_in_contact_only_and_never_pulls() {
        assert_eq!(contact_force(1000.0, 0.2, 0.04, 0.5), 1000.0 * 0.008 * 1.15);
        assert_eq!(contact_force(1000.0, 0.2, -0.04, 5.0), 0.0);
        assert_eq!(contact_force(1000.0, 0.2, 0.04, -5.0), 0.0);
    }
}
