//! Elements on single coordinates, or on the difference of two: inertia, springs, drives, friction, stops.

use crate::multibody::element::{Element, Energy, Local};
use crate::multibody::mechanism::{Coordinate, Mechanism, Part};
use crate::multibody::motion::Motion;
use crate::scalar::Scalar;

/// Inertia of one coordinate: m a. Parameters m (kg or kg·m²).
#[derive(Clone, Copy, Debug)]
pub struct Inertia;

impl Element for Inertia {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        balance[0] = x.p[0] * x.a[0];
    }

    fn linear(&self) -> &'static [usize] {
        &[0]
    }

    fn energy<T: Scalar>(&self, x: &Local<'_, T>) -> Energy<T> {
        Energy { kinetic: x.p[0] * x.v[0] * x.v[0] * 0.5, potential: T::zero() }
    }

    fn complaint(&self, p: &[f64]) -> Option<String> {
        (!(p[0] > 0.0)).then(|| format!("its inertia is {}", p[0]))
    }
}

/// A spring and damper on the difference u = q_B − q_A − u₀ of two coordinates: k u + k₃ u³ + c u̇.
///
/// On two rotations it is a torsion spring. Coordinates q_A, q_B; parameters k, c, u₀, k₃.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateSpring;

impl CoordinateSpring {
    fn effort<T: Scalar>(x: &Local<'_, T>) -> T {
        let u = x.q[1] - x.q[0] - x.p[2];
        x.p[0] * u + x.p[3] * u.powi(3) + x.p[1] * (x.v[1] - x.v[0])
    }
}

impl Element for CoordinateSpring {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let effort = Self::effort(x);
        (balance[0], balance[1]) = (-effort, effort);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["effort", "stretch", "rate"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (Self::effort(x), x.q[1] - x.q[0] - x.p[2], x.v[1] - x.v[0]);
    }

    fn energy<T: Scalar>(&self, x: &Local<'_, T>) -> Energy<T> {
        let u = x.q[1] - x.q[0] - x.p[2];
        Energy { kinetic: T::zero(), potential: x.p[0] * u * u * 0.5 + x.p[3] * u.powi(4) * 0.25 }
    }
}

/// An effort between two coordinates that is a function of time: a motor on two rotations, a load on one coordinate.
///
/// Coordinates q_A, q_B (driven forward); parameters those of the function (N or N·m).
#[derive(Clone, Copy, Debug)]
pub struct Load<F>(pub F);

impl<F: Motion> Element for Load<F> {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let effort = self.0.position(x.p, x.t);
        (balance[0], balance[1]) = (effort, -effort);
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["effort", "power"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = self.0.position(x.p, x.t);
        out[1] = out[0] * (x.v[1] - x.v[0]);
    }
}

/// A drive: the difference of two coordinates is a function of time, Φ = q_B − q_A − f(t).
///
/// Coordinates q_A, q_B; parameters those of the function. Measures the effort that the drive needs, and its power.
#[derive(Clone, Copy, Debug)]
pub struct Driver<F>(pub F);

impl<F: Motion> Element for Driver<F> {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        closure[0] = x.q[1] - x.q[0] - self.0.position(x.p, x.t);
        (balance[0], balance[1]) = (-x.l[0], x.l[0]);
    }

    fn closures(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["effort", "power"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (-x.l[0], -x.l[0] * (x.v[1] - x.v[0]));
    }
}

/// A pair of gears: r₁ (θ₁ − θ_c) + r₂ (θ₂ − θ_c) = u₀, for external teeth; r₂ < 0 for a ring gear.
///
/// Coordinates θ₁, θ₂ and θ_c of the carrier of both axes; parameters r₁, r₂, u₀ (m). λ is the tooth force in N.
///
/// **Source.** Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct GearPair;

impl Element for GearPair {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        let (one, two) = (x.p[0], x.p[1]);
        closure[0] = one * (x.q[0] - x.q[2]) + two * (x.q[1] - x.q[2]) - x.p[2];
        (balance[0], balance[1], balance[2]) = (one * x.l[0], two * x.l[0], -(one + two) * x.l[0]);
    }

    fn closures(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tooth_force"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }
}

/// A rack on a pinion: (x_R − x_P) cos φ + (y_R − y_P) sin φ − r θ_P = u₀, with φ the direction of the rack.
///
/// Coordinates x, y of the rack and x, y, θ of the pinion; parameters r (m), φ (rad), u₀ (m). λ is the tooth force.
#[derive(Clone, Copy, Debug)]
pub struct Rack;

impl Element for Rack {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        let (sin, cos) = x.p[1].sin_cos();
        let l = x.l[0];
        closure[0] = (x.q[0] - x.q[2]) * cos + (x.q[1] - x.q[3]) * sin - x.p[0] * x.q[4] - x.p[2];
        (balance[0], balance[1]) = (l * cos, l * sin);
        (balance[2], balance[3], balance[4]) = (-l * cos, -l * sin, -l * x.p[0]);
    }

    fn closures(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2, 3, 4]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tooth_force"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }
}

/// Friction between two coordinates, smooth through zero: F_c tanh(v / v_s) + c v.
///
/// Coordinates q_A, q_B; parameters F_c (N or N·m), v_s (m/s or rad/s), c.
///
/// **Source.** Andersson, Söderberg & Björklund, *Tribol. Int.* 40 (2007) 580–587.
#[derive(Clone, Copy, Debug)]
pub struct Friction;

impl Friction {
    fn effort<T: Scalar>(x: &Local<'_, T>) -> T {
        let rate = x.v[1] - x.v[0];
        x.p[0] * (rate / x.p[1]).tanh() + x.p[2] * rate
    }
}

impl Element for Friction {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let effort = Self::effort(x);
        (balance[0], balance[1]) = (-effort, effort);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["effort"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = Self::effort(x);
    }

    fn complaint(&self, p: &[f64]) -> Option<String> {
        (!(p[1] > 0.0)).then(|| format!("its transition velocity is {}", p[1]))
    }
}

/// A stop: once q_B − q_A falls below u₀ by δ it pushes back with k δ^{3/2} (1 + 1.5 c δ̇), never pulling.
///
/// Coordinates q_A, q_B; parameters k (N/m^{3/2}), c (s/m), u₀.
///
/// **Source.** Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct Stop;

impl Stop {
    fn push<T: Scalar>(x: &Local<'_, T>) -> T {
        let depth = x.p[2] - (x.q[1] - x.q[0]);
        if depth.re() <= 0.0 {
            return T::zero();
        }
        let push = x.p[0] * depth * depth.sqrt() * (x.p[1] * (x.v[0] - x.v[1]) * 1.5 + 1.0);
        if push.re() > 0.0 { push } else { T::zero() }
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

/// Measures position, velocity and acceleration of a coordinate relative to another.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateSensor;

impl Element for CoordinateSensor {
    fn residual<T: Scalar>(&self, _x: &Local<'_, T>, _balance: &mut [T], _closure: &mut [T]) {}

    fn is_sensor(&self) -> bool {
        true
    }

    fn measures(&self) -> &'static [&'static str] {
        &["position", "velocity", "acceleration"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (x.q[1] - x.q[0], x.v[1] - x.v[0], x.a[1] - x.a[0]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Gives a coordinate inertia (kg or kg·m²).
    pub fn inertia(&mut self, name: &str, coordinate: Coordinate, inertia: S) -> Part {
        self.add(name, Inertia, &[coordinate], &[inertia])
    }

    /// Puts a spring and damper on `b` − `a`: stiffness, damping, unloaded difference, cubic stiffness.
    pub fn coordinate_spring(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 4]) -> Part {
        self.add(name, CoordinateSpring, &[a, b], &parameters)
    }

    /// Drives `b` against `a` by an effort that is a function of time.
    pub fn load(&mut self, name: &str, a: Coordinate, b: Coordinate, effort: impl Motion, parameters: &[S]) -> Part {
        self.add(name, Load(effort), &[a, b], parameters)
    }

    /// Prescribes `b` − `a` as a function of time.
    pub fn driver(&mut self, name: &str, a: Coordinate, b: Coordinate, motion: impl Motion, parameters: &[S]) -> Part {
        self.add(name, Driver(motion), &[a, b], parameters)
    }

    /// Measures `b` − `a` and its rates.
    pub fn coordinate_sensor(&mut self, name: &str, a: Coordinate, b: Coordinate) -> Part {
        self.add(name, CoordinateSensor, &[a, b], &[])
    }
}
