//! Smooth friction between two coordinates.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::write_force_pair;
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Coulomb and viscous friction between two coordinates, smooth through zero: F_c tanh(v / v_s) + c v, with v = q̇_B − q̇_A.
///
/// # Sources
/// Andersson, Söderberg & Björklund, *Tribol. Int.* 40 (2007) 580–587.
#[derive(Clone, Copy, Debug)]
pub struct Friction;

as_object!(Friction);

element_inputs!(FrictionInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    coulomb_force: required("N or N·m", 1.5, "Coulomb force or torque"),
    speed: required("m/s or rad/s", 0.02, "transition velocity, over which the force rises"),
    viscous: optional("0", "N·s/m or N·m·s/rad", 1.0, "viscous coefficient"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "friction",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[Measure::new("generalized_force", "N or N·m", "force or torque, positive if b moves faster than a")],
    about: "Coulomb and viscous friction between a and b",
    law: "generalized_force = coulomb_force·tanh(v/speed) + viscous·v with v = ḃ − ȧ; it acts on b against v, and its opposite on a",
    symbol: Symbol::None,
};

impl Friction {
    fn force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        let (p, rate) = (FrictionInputs(x.p), x.v[1] - x.v[0]);
        p.coulomb_force() * (rate / p.speed()).tanh() + p.viscous() * rate
    }
}

impl Element for Friction {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        write_force_pair(dynamics, -Self::force(x));
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = Self::force(x);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let (speed, force) = (FrictionInputs(p).speed(), FrictionInputs(p).coulomb_force());
        if !(force >= 0.0) {
            return Some(format!("its Coulomb force is {force}"));
        }
        (!(speed > 0.0)).then(|| format!("its transition velocity is {speed}"))
    }
}

/// Magnitude of a force from its square, smooth where it vanishes: N²/√(N² + N₀²).
///
/// It is smaller than |N| by N₀²/(2 N).
pub(crate) fn smooth_magnitude<T: Scalar>(square: T, transition: T) -> T {
    square / (square + transition * transition).sqrt()
}

impl<S: Scalar> Mechanism<S> {
    /// Adds friction between `a` and `b`: Coulomb force or torque, transition velocity, viscous coefficient.
    pub fn friction(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 3]) -> ElementIndex {
        self.add_object(name.into(), Friction::object(), &[a, b], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving, rows};

    #[test]
    fn from_rest_to_sliding() {
        let force = |v: f64| rows(&Friction, &moving(&[5.0, 0.01, 2.0], &[0.0; 2], &[0.0, v], &[])).0[1];
        close(&[force(0.0)], &[0.0]);
        close(&[force(0.01)], &[5.0 * 1f64.tanh() + 0.02]);
        close(&[force(1.0), force(-1.0)], &[7.0, -7.0]);
        assert!(Friction.validate_parameters(&[5.0, 0.0, 0.0]).is_some());
    }
}
