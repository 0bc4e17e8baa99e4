//! Smooth friction between two coordinates.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// Friction between two coordinates, smooth through zero: F_c tanh(v / v_s) + c v.
///
/// Coordinates q_A, q_B; parameters F_c (N or N·m), v_s (m/s or rad/s), c.
///
/// **Source.** Andersson, Söderberg & Björklund, *Tribol. Int.* 40 (2007) 580–587.
#[derive(Clone, Copy, Debug)]
pub struct Friction;

impl Friction {
    fn generalized_force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        let rate = x.v[1] - x.v[0];
        x.p[0] * (rate / x.p[1]).tanh() + x.p[2] * rate
    }
}

impl Element for Friction {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        let effort = Self::generalized_force(x);
        (dynamics[0], dynamics[1]) = (-effort, effort);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["generalized_force"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = Self::generalized_force(x);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (!(p[1] > 0.0)).then(|| format!("its transition velocity is {}", p[1]))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets `b` rub on `a`: Coulomb effort, transition velocity, viscous coefficient.
    pub fn friction(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 3]) -> ElementIndex {
        self.add(name, Friction, &[a, b], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving, rows};

    #[test]
    fn from_rest_to_sliding() {
        let effort = |v: f64| rows(&Friction, &moving(&[5.0, 0.01, 2.0], &[0.0; 2], &[0.0, v], &[])).0[1];
        close(&[effort(0.0)], &[0.0]);
        close(&[effort(0.01)], &[5.0 * 1f64.tanh() + 0.02]);
        close(&[effort(1.0), effort(-1.0)], &[7.0, -7.0]);
        assert!(Friction.validate_parameters(&[5.0, 0.0, 0.0]).is_some());
    }
}
