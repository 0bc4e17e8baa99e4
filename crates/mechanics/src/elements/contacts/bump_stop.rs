//! A bump stop between two coordinates.

use crate::elements::contacts::hunt_crossley::contact_force;
use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// A stop: once q_B − q_A falls below u₀ by δ it pushes back with k δ^{3/2} (1 + 1.5 c δ̇), never pulling.
///
/// Coordinates q_A, q_B; parameters k (N/m^{3/2}), c (s/m), u₀.
///
/// **Source.** Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct BumpStop;

impl BumpStop {
    fn contact_force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        contact_force(x.p[0], x.p[1], x.p[2] - (x.q[1] - x.q[0]), x.v[0] - x.v[1])
    }
}

impl Element for BumpStop {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        let contact_force = Self::contact_force(x);
        (dynamics[0], dynamics[1]) = (contact_force, -contact_force);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["contact_force"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = Self::contact_force(x);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps `b` − `a` above a limit by a smooth push: stiffness, damping, limit.
    pub fn bump_stop(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 3]) -> ElementIndex {
        self.add(name, BumpStop, &[a, b], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving, rows};

    #[test]
    fn four_centimetres_deep_and_closing() {
        // 1000 · 0.04^1.5 · (1 + 1.5 · 0.2 · 0.5) = 9.2 N.
        let x = moving(&[1000.0, 0.2, 0.1], &[0.0, 0.06], &[0.0, -0.5], &[]);
        close(&rows(&BumpStop, &x).0, &[9.2, -9.2]);
        close(&rows(&BumpStop, &moving(&[1000.0, 0.2, 0.1], &[0.0, 0.11], &[0.0, -0.5], &[])).0, &[0.0, 0.0]);
    }
}
