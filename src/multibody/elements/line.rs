//! The straight line between two points of two bodies, and what acts along it.

use crate::multibody::element::{Element, Energy, Local};
use crate::multibody::frame::{Frame, add_force, point_velocity};
use crate::multibody::mechanism::{Coordinate, Marker, Mechanism, Part};
use crate::multibody::motion::Motion;
use crate::scalar::Scalar;

/// Distance of two points, its rate, and how a pull along it acts.
struct Line<T> {
    length: T,
    rate: T,
    direction: [T; 2],
    lever_a: [T; 2],
    lever_b: [T; 2],
}

impl<T: Scalar> Line<T> {
    /// Between the points with body-fixed coordinates p\[0..2\] and p\[2..4\].
    #[inline]
    fn of(x: &Local<'_, T>) -> Self {
        let (a, b) = (Frame::of(x, 0), Frame::of(x, 3));
        let (lever_a, lever_b) = (a.turned(x.p[0], x.p[1]), b.turned(x.p[2], x.p[3]));
        let (pa, pb) = (a.point(lever_a), b.point(lever_b));
        let (va, vb) = (point_velocity(x, 0, lever_a), point_velocity(x, 3, lever_b));
        let gap = [pb[0] - pa[0], pb[1] - pa[1]];
        let length = (gap[0] * gap[0] + gap[1] * gap[1]).sqrt();
        let inverse = length.recip();
        let direction = [gap[0] * inverse, gap[1] * inverse];
        let rate = (vb[0] - va[0]) * direction[0] + (vb[1] - va[1]) * direction[1];
        Self { length, rate, direction, lever_a, lever_b }
    }

    /// A tension `f` (positive pulls the points together) as rows inertia − force.
    #[inline]
    fn pull(&self, f: T, balance: &mut [T]) {
        let [ux, uy] = self.direction;
        add_force(balance, 0, self.lever_a, [-f * ux, -f * uy]);
        add_force(balance, 3, self.lever_b, [f * ux, f * uy]);
    }
}

fn ends<S: Scalar>(a: Marker<S>, b: Marker<S>) -> ([Coordinate; 6], [S; 4]) {
    let ([ax, ay, at], [bx, by, bt]) = (a.body.coordinates(), b.body.coordinates());
    ([ax, ay, at, bx, by, bt], [a.x, a.y, b.x, b.y])
}

/// A massless rod: two points keep their distance, Φ = |r_B − r_A| − L.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, L (m). λ is the tension in N.
///
/// **Source.** Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct Rod;

impl Element for Rod {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        let line = Line::of(x);
        closure[0] = line.length - x.p[4];
        line.pull(x.l[0], balance);
    }

    fn closures(&self) -> usize {
        1
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tension"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }

    fn complaint(&self, p: &[f64]) -> Option<String> {
        (!(p[4] > 0.0)).then(|| format!("its length is {} m", p[4]))
    }
}

/// A spring and damper between two points: tension k (L − L₀) + k₃ (L − L₀)³ + c L̇.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, k (N/m), c (N·s/m), L₀ (m), k₃ (N/m³).
/// The points must not coincide.
#[derive(Clone, Copy, Debug)]
pub struct SpringDamper;

impl SpringDamper {
    fn tension<T: Scalar>(x: &Local<'_, T>, line: &Line<T>) -> T {
        let stretch = line.length - x.p[6];
        x.p[4] * stretch + x.p[7] * stretch.powi(3) + x.p[5] * line.rate
    }
}

impl Element for SpringDamper {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let line = Line::of(x);
        line.pull(Self::tension(x, &line), balance);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tension", "length", "rate"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (Self::tension(x, &line), line.length, line.rate);
    }

    fn energy<T: Scalar>(&self, x: &Local<'_, T>) -> Energy<T> {
        let stretch = Line::of(x).length - x.p[6];
        let potential = x.p[4] * stretch.powi(2) * 0.5 + x.p[7] * stretch.powi(4) * 0.25;
        Energy { kinetic: T::zero(), potential }
    }
}

/// A linear actuator: a tension that is a function of time.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, then those of the function.
#[derive(Clone, Copy, Debug)]
pub struct Actuator<F>(pub F);

impl<F: Motion> Element for Actuator<F> {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        Line::of(x).pull(self.0.position(&x.p[4..], x.t), balance);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tension", "length", "rate"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (self.0.position(&x.p[4..], x.t), line.length, line.rate);
    }
}

/// A linear drive: the distance of two points is a function of time.
///
/// Coordinates and parameters as [`Actuator`]. λ is the tension in N.
#[derive(Clone, Copy, Debug)]
pub struct LengthDriver<F>(pub F);

impl<F: Motion> Element for LengthDriver<F> {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        let line = Line::of(x);
        closure[0] = line.length - self.0.position(&x.p[4..], x.t);
        line.pull(x.l[0], balance);
    }

    fn closures(&self) -> usize {
        1
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tension", "length"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (x.l[0], Line::of(x).length);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps the points `a` and `b` at the distance `length` (m).
    pub fn rod(&mut self, name: &str, a: Marker<S>, b: Marker<S>, length: S) -> Part {
        let (coordinates, p) = ends(a, b);
        self.add(name, Rod, &coordinates, &[&p[..], &[length]].concat())
    }

    /// Puts a linear spring and damper between two points.
    pub fn spring_damper(&mut self, name: &str, a: Marker<S>, b: Marker<S>, [k, c, rest]: [S; 3]) -> Part {
        self.nonlinear_spring(name, a, b, [k, c, rest, S::from(0.0)])
    }

    /// Puts a spring with a cubic part and a damper between two points: k, c, rest length, k₃.
    pub fn nonlinear_spring(&mut self, name: &str, a: Marker<S>, b: Marker<S>, parameters: [S; 4]) -> Part {
        let (coordinates, p) = ends(a, b);
        self.add(name, SpringDamper, &coordinates, &[&p[..], &parameters[..]].concat())
    }

    /// Pulls two points together with a tension (N) that is a function of time.
    pub fn actuator(&mut self, name: &str, a: Marker<S>, b: Marker<S>, tension: impl Motion, parameters: &[S]) -> Part {
        let (coordinates, p) = ends(a, b);
        self.add(name, Actuator(tension), &coordinates, &[&p[..], parameters].concat())
    }

    /// Prescribes the distance (m) of two points as a function of time.
    pub fn drive_length(
        &mut self,
        name: &str,
        a: Marker<S>,
        b: Marker<S>,
        length: impl Motion,
        parameters: &[S],
    ) -> Part {
        let (coordinates, p) = ends(a, b);
        self.add(name, LengthDriver(length), &coordinates, &[&p[..], parameters].concat())
    }
}
