//! A bump stop between two coordinates.

use crate::elements::contacts::hunt_crossley::push;
use crate::elements::element::{Element, Local};
use crate::mechanism::{Coordinate, Mechanism, Part};
use autodiff::Scalar;

/// A stop: once q_B − q_A falls below u₀ by δ it pushes back with k δ^{3/2} (1 + 1.5 c δ̇), never pulling.
///
/// Coordinates q_A, q_B; parameters k (N/m^{3/2}), c (s/m), u₀.
///
/// **Source.** Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct Stop;

impl Stop {
    fn push<T: Scalar>(x: &Local<'_, T>) -> T {
        push(x.p[0], x.p[1], x.p[2] - (x.q[1] - x.q[0]), x.v[0] - x.v[1])
    }
}

impl Element for Stop {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let push = Self::push(x);
        (balance[0], balance[1]) = (push, -push);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["push"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = Self::push(x);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps `b` − `a` above a limit by a smooth push: stiffness, damping, limit.
    pub fn stop(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 3]) -> Part {
        self.add(name, Stop, &[a, b], &parameters)
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
        close(&rows(&Stop, &x).0, &[9.2, -9.2]);
        close(&rows(&Stop, &moving(&[1000.0, 0.2, 0.1], &[0.0, 0.11], &[0.0, -0.5], &[])).0, &[0.0, 0.0]);
    }
}
