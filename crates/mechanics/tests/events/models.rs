//! Mechanisms with impacts, switched forces and released joints.

use autodiff::Scalar;
use linkwright_mechanics::elements::Revolute;
use linkwright_mechanics::events::Action;
use linkwright_mechanics::mechanism::Formula;
use linkwright_mechanics::motion::{Fixed, Harmonic};
use linkwright_mechanics::{Coordinate, Mechanism, ParametricMechanism, Pose, Result};

/// A weighted sum of quantities and of the time: Σ wᵢ xᵢ + w t.
pub struct Linear(pub Vec<f64>, pub f64);

impl Formula for Linear {
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T {
        x.iter().zip(&self.0).fold(t * self.1, |sum, (x, w)| sum + *x * *w)
    }
}

/// A quantity less a limit.
pub struct Above(pub f64);

impl Formula for Above {
    fn value<T: Scalar>(&self, _t: T, x: &[T]) -> T {
        x[0] - self.0
    }
}

/// A mass of 1 kg on a spring of the stiffness b₀, let go at b₁, that bounces on a rigid stop at b₂ with the restitution b₃.
pub struct Bouncing;

pub const BOUNCING: [f64; 4] = [9.0, 1.0, 0.35, 0.8];

impl ParametricMechanism for Bouncing {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", S::from(1.0), b[1], zero);
        let ground = m.ground();
        m.coordinate_spring("spring", ground.x, mass.x, [b[0], zero, zero, zero]);
        m.rigid_stop("stop", ground.x, mass.x, b[2], b[3]);
        outputs(&mut m, mass.x)?;
        Ok(m)
    }
}

/// Position and velocity of the mass at the time `t`, between its first and its second impact.
pub fn bouncing<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let rate = b[0].sqrt();
    let side = (b[1] * b[1] - b[2] * b[2]).sqrt();
    let angle = rate * t - side.atan2(b[2]);
    let (sin, cos) = angle.sin_cos();
    [b[2] * cos + b[3] * side * sin, rate * (b[3] * side * cos - b[2] * sin)]
}

/// A mass of 1 kg on a spring of the stiffness b₀, let go at b₁, that the force b₃ pushes from its passage of b₂ on.
pub struct Pushed;

pub const PUSHED: [f64; 4] = [9.0, 1.0, 0.35, -4.0];

impl ParametricMechanism for Pushed {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Ok(mass_and_push(b)?.0)
    }
}

/// The mechanism of [`Pushed`] and the coordinate of its mass.
fn mass_and_push<S: Scalar>(b: &[S]) -> Result<(Mechanism<S>, Coordinate)> {
    let zero = S::from(0.0);
    let mut m = Mechanism::new();
    let mass = m.point_mass("mass", S::from(1.0), b[1], zero).x;
    let ground = m.ground().x;
    m.coordinate_spring("spring", ground, mass, [b[0], zero, zero, zero]);
    push_from(&mut m, mass, ["push", "begin"], [b[2], b[3]])?;
    outputs(&mut m, mass)?;
    Ok((m, mass))
}

/// A force on `mass` from its passage of a place on; the `names` are those of the force and of the event.
fn push_from<S: Scalar>(m: &mut Mechanism<S>, mass: Coordinate, names: [&str; 2], [x, force]: [S; 2]) -> Result<()> {
    let ground = m.ground();
    let push = m.load(names[0], ground.x, mass, Fixed, &[force]);
    let motion = m.coordinate_sensor("motion", ground.x, mass);
    let place = m.sensor("place", ground.at(x, S::from(0.0)));
    let terms = [m.measure(place, "x")?, m.measure(motion, "position")?];
    m.when(names[1], Linear(vec![1.0, -1.0], 0.0), &terms, &[Action::Activate(push)])?;
    Ok(())
}

pub fn outputs<S: Scalar>(m: &mut Mechanism<S>, coordinate: Coordinate) -> Result<()> {
    let ground = m.ground().x;
    let sensor = m.coordinate_sensor("mass", ground, coordinate);
    for what in ["position", "velocity"] {
        let term = m.measure(sensor, what)?;
        m.output(what, &[term]);
    }
    Ok(())
}

/// Position and velocity of the mass at the time `t` after the passage.
pub fn pushed<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let rate = b[0].sqrt();
    let side = (b[1] * b[1] - b[2] * b[2]).sqrt();
    let (sin, cos) = (rate * t - side.atan2(b[2])).sin_cos();
    let shift = b[3] / b[0];
    [shift + (b[2] - shift) * cos - side * sin, -rate * ((b[2] - shift) * sin + side * cos)]
}

/// [`Pushed`], with a second force b₅ from its passage of b₄ on, shortly after the first.
pub struct PushedTwice;

pub const PUSHED_TWICE: [f64; 6] = [9.0, 1.0, 0.35, -4.0, 0.35 - 1e-9, 3.0];

impl ParametricMechanism for PushedTwice {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (mut m, mass) = mass_and_push(b)?;
        push_from(&mut m, mass, ["second push", "second begin"], [b[4], b[5]])?;
        Ok(m)
    }
}

/// Position and velocity of the mass at the time `t` after the second passage.
pub fn pushed_twice<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let rate = b[0].sqrt();
    let side = (b[1] * b[1] - b[2] * b[2]).sqrt();
    let shift = b[3] / b[0];
    let amplitude = ((b[2] - shift) * (b[2] - shift) + side * side).sqrt();
    let second_side = (amplitude * amplitude - (b[4] - shift) * (b[4] - shift)).sqrt();
    let phase = side.atan2(b[2]) + second_side.atan2(b[4] - shift) - side.atan2(b[2] - shift);
    let (sin, cos) = (rate * t - phase).sin_cos();
    let shift = (b[3] + b[5]) / b[0];
    [shift + (b[4] - shift) * cos - second_side * sin, -rate * ((b[4] - shift) * sin + second_side * cos)]
}

/// A mass of 1 kg that falls from rest under the gravity b₀, on an elastic rope of the length b₁ and stiffness b₂ from the place
/// where it starts.
pub struct OnRope;

pub const ROPE: [f64; 3] = [9.81, 0.7, 60.0];

impl ParametricMechanism for OnRope {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[0]);
        let mass = m.point_mass("mass", S::from(1.0), zero, S::from(-1e-2));
        let ground = m.ground();
        m.rope("rope", ground.origin(), mass.origin(), [b[2], zero, b[1]]);
        outputs(&mut m, mass.y)?;
        Ok(m)
    }
}

/// Position and velocity of the mass at the time `t`, between the time at which the rope becomes taut and that at which it
/// becomes slack.
pub fn on_rope<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let taut = ((b[1] - 1e-2) * 2.0 / b[0]).sqrt();
    let (speed, rate, lowest) = (b[0] * taut, b[2].sqrt(), b[0] / b[2]);
    let (sin, cos) = (rate * (-taut + t)).sin_cos();
    let depth = b[1] + lowest - lowest * cos + speed / rate * sin;
    [-depth, -(lowest * rate * sin + speed * cos)]
}

/// A bob of 2 kg on a string of the length b₀ that starts at rest at the angle b₁ from the vertical, under the gravity b₂. The
/// string lets go where the bob is b₃ to the right of the pivot. The motion ends b₄ below the pivot.
pub struct Sling;

pub const SLING: [f64; 5] = [1.3, -1.2, 9.81, 0.6, 2.1];

impl ParametricMechanism for Sling {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[2]);
        let (sin, cos) = b[1].sin_cos();
        let bob = m.point_mass("bob", S::from(2.0), b[0] * sin, -b[0] * cos);
        let ground = m.ground();
        let string = m.distance_constraint("string", ground.origin(), bob.origin(), b[0]);
        let sensor = m.sensor("motion", bob.origin());
        let [x, y] = [m.measure(sensor, "x")?, m.measure(sensor, "y")?];
        let fixed = m.sensor("limits", ground.at(b[3], b[4]));
        let [right, low] = [m.measure(fixed, "x")?, m.measure(fixed, "y")?];
        let let_go = m.when("release", Linear(vec![1.0, -1.0], 0.0), &[x, right], &[Action::Deactivate(string)])?;
        let landing = m.when("landing", Linear(vec![-1.0, -1.0], 0.0), &[y, low], &[Action::Terminate])?;
        m.output("x", &[x]);
        m.output_formula("duration", Linear(vec![], 1.0), &[]);
        m.hold_output(landing);
        m.output("release height", &[y]);
        m.hold_output(let_go);
        let tension = m.measure(string, "tension")?;
        m.output("tension", &[tension]);
        let (kinetic, potential) = (m.kinetic_energy(), m.potential_energy());
        m.output("energy", &[kinetic, potential]);
        Ok(m)
    }
}

/// Range at the landing and height at the release in closed form.
pub fn sling<S: Scalar>(b: &[S]) -> [S; 2] {
    let sin = b[3] / b[0];
    let cos = (-(sin * sin) + 1.0).sqrt();
    let speed = (b[2] * b[0] * 2.0 * (cos - b[1].cos())).sqrt();
    let (vx, vy, height) = (speed * cos, speed * sin, -b[0] * cos);
    let drop = height + b[4];
    let flight = (vy + (vy * vy + b[2] * drop * 2.0).sqrt()) / b[2];
    [b[3] + vx * flight, height]
}

/// Two hinged bars hanging from a shaken pivot, the lower one near an inclined wall.
///
/// Design: mass, inertia and half length of both bars, position and angle of the wall, restitution, amplitude and frequency of
/// the pivot, gravity.
pub struct DoublePendulum;

pub const BARS: [f64; 9] = [1.2, 0.05, 0.35, -0.9, 1.45, 0.6, 0.06, 3.0, 9.81];

impl ParametricMechanism for DoublePendulum {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[8]);
        let pivot = m.massless_node("pivot", Pose { x: zero, y: zero, theta: zero });
        m.drive(pivot.x, Harmonic, &[zero, b[6], b[7], zero]);
        m.fix(pivot.y);
        m.fix(pivot.theta);
        let angle = S::from(-0.3);
        let (sin, cos) = angle.sin_cos();
        let upper = m.body("upper", b[0], b[1], Pose { x: b[2] * cos, y: b[2] * sin, theta: angle });
        let lower = m.body("lower", b[0], b[1], Pose { x: b[2] * cos * 3.0, y: b[2] * sin * 3.0, theta: angle });
        m.add("hinge", Revolute, &[pivot.coordinates(), upper.coordinates()].concat(), &[zero, zero, -b[2], zero]);
        let knee = m.revolute("knee", upper.at(b[2], zero), lower.at(-b[2], zero));
        let ground = m.ground();
        m.rigid_wall("wall", ground.at(b[3], zero), -b[4], lower.at(b[2], zero), b[5]);
        let sensor = m.coordinate_sensor("angle", ground.theta, lower.theta);
        let [position, velocity] = [m.measure(sensor, "position")?, m.measure(sensor, "velocity")?];
        m.output("angle", &[position]);
        m.output("velocity", &[velocity]);
        let reaction = m.measure(knee, "force_x")?;
        m.output("reaction", &[reaction]);
        let (kinetic, potential) = (m.kinetic_energy(), m.potential_energy());
        m.output("energy", &[kinetic, potential]);
        Ok(m)
    }
}

/// Two hinged bars that fall from an inclined position, with outputs at an event: the angle of the lower bar, or the vertical
/// velocity of its tip, passes a limit.
///
/// Design: mass, inertia and half length of both bars, gravity. Outputs: time, two velocities of the tip, an acceleration and a reaction.
pub struct FallingBars {
    pub by_velocity: bool,
}

pub const FALLING: [f64; 4] = [1.2, 0.05, 0.35, 9.81];

impl ParametricMechanism for FallingBars {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[3]);
        let angle = S::from(-0.3);
        let (sin, cos) = angle.sin_cos();
        let upper = m.body("upper", b[0], b[1], Pose { x: b[2] * cos, y: b[2] * sin, theta: angle });
        let lower = m.body("lower", b[0], b[1], Pose { x: b[2] * cos * 3.0, y: b[2] * sin * 3.0, theta: angle });
        let ground = m.ground();
        m.revolute("hinge", ground.at(zero, zero), upper.at(-b[2], zero));
        let knee = m.revolute("knee", upper.at(b[2], zero), lower.at(-b[2], zero));
        let (tip, turn) =
            (m.sensor("tip", lower.at(b[2], zero)), m.coordinate_sensor("turn", ground.theta, lower.theta));
        let (vy, theta) = (m.measure(tip, "vy")?, m.measure(turn, "position")?);
        let (of, limit) = if self.by_velocity { (vy, 3.0) } else { (theta, 1.3) };
        let event = m.when("event", Above(limit), &[of.times(S::from(-1.0))], &[])?;
        m.output_formula("time", Linear(vec![], 1.0), &[]);
        m.hold_output(event);
        for (name, element, measure) in
            [("vx", tip, "vx"), ("vy", tip, "vy"), ("ay", tip, "ay"), ("reaction", knee, "force_x")]
        {
            let quantity = m.measure(element, measure)?;
            m.output(name, &[quantity]);
            m.hold_output(event);
        }
        Ok(m)
    }
}
