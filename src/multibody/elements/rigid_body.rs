//! A rigid body in absolute coordinates.

use crate::multibody::element::{Element, Energy, Local};
use crate::multibody::mechanism::{Body, Mechanism, Pose};
use crate::scalar::Scalar;

/// A rigid body whose reference point is its centre of mass, in absolute coordinates x, y, θ.
///
/// $$ m(\ddot x - g_x) = F_x,\quad m(\ddot y - g_y) = F_y,\quad J\ddot\theta = M $$
///
/// Coordinates x, y, θ; parameters m (kg), J about the centre of mass (kg·m²), g_x, g_y (m/s²).
#[derive(Clone, Copy, Debug)]
pub struct RigidBody;

impl Element for RigidBody {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let (mass, inertia) = (x.p[0], x.p[1]);
        balance[0] = mass * (x.a[0] - x.p[2]);
        balance[1] = mass * (x.a[1] - x.p[3]);
        balance[2] = inertia * x.a[2];
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }

    fn energy<T: Scalar>(&self, x: &Local<'_, T>) -> Energy<T> {
        let (mass, inertia) = (x.p[0], x.p[1]);
        let speed = x.v[0] * x.v[0] + x.v[1] * x.v[1];
        Energy {
            kinetic: (mass * speed + inertia * x.v[2] * x.v[2]) * 0.5,
            potential: -mass * (x.p[2] * x.q[0] + x.p[3] * x.q[1]),
        }
    }

    fn complaint(&self, p: &[f64]) -> Option<String> {
        match p {
            [m, ..] if !(*m > 0.0) => Some(format!("mass is {m} kg")),
            [_, j, ..] if !(*j > 0.0) => Some(format!("moment of inertia is {j} kg·m²")),
            _ => None,
        }
    }
}

/// A point mass: a body without rotation. Coordinates x, y; parameters m (kg), g_x, g_y (m/s²).
#[derive(Clone, Copy, Debug)]
pub struct PointMass;

impl Element for PointMass {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        balance[0] = x.p[0] * (x.a[0] - x.p[1]);
        balance[1] = x.p[0] * (x.a[1] - x.p[2]);
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn energy<T: Scalar>(&self, x: &Local<'_, T>) -> Energy<T> {
        let kinetic = x.p[0] * (x.v[0] * x.v[0] + x.v[1] * x.v[1]) * 0.5;
        Energy { kinetic, potential: -x.p[0] * (x.p[1] * x.q[0] + x.p[2] * x.q[1]) }
    }

    fn complaint(&self, p: &[f64]) -> Option<String> {
        (!(p[0] > 0.0)).then(|| format!("mass is {} kg", p[0]))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a point mass; as a body it does not rotate.
    pub fn point_mass(&mut self, name: &str, mass: S, x: S, y: S) -> Body {
        let zero = S::from(0.0);
        let body = Body {
            x: self.coordinate(format!("{name}.x"), x, zero),
            y: self.coordinate(format!("{name}.y"), y, zero),
            theta: self.ground().theta,
        };
        let [gx, gy] = self.gravity;
        self.add(name, PointMass, &[body.x, body.y], &[mass, gx, gy]);
        body
    }

    /// Adds a rigid body with its centre of mass at `pose`.
    pub fn body(&mut self, name: &str, mass: S, inertia: S, pose: Pose<S>) -> Body {
        let body = self.frame(name, pose);
        let [gx, gy] = self.gravity;
        self.add(name, RigidBody, &body.coordinates(), &[mass, inertia, gx, gy]);
        body
    }
}
