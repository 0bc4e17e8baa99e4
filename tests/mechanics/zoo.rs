//! Mechanisms of many elements, every parameter of which is a design variable.

use crate::table::Label;
use linkwright::Result;
use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::dynamics::Dynamics;
use linkwright::mechanics::elements::{BeamSection, Shear, StateFunction};
use linkwright::mechanics::integrators::generalized_alpha::Newton;
use linkwright::mechanics::mechanism::{Coordinate, Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::{ConstantSpeed, Fixed, Harmonic, Motion, Ramp, StartUp, TabulatedMotion};

/// Fixed steps of `h` seconds whose equations are solved to rounding, for comparisons with differences.
pub fn fixed(h: f64) -> Dynamics {
    Dynamics { newton: Newton { tolerance: 1e-12, iterations: 30 }, ..Dynamics::fixed(h) }
}

/// Displacement of the impact absorber: ÿ + c ẏ + k y = 0 with y(0) = 0, ẏ(0) = 1 and b = (k, c).
pub fn absorber_displacement<S: Scalar>(b: &[S], t: f64) -> S {
    let w = (b[0] - b[1] * b[1] * 0.25).sqrt();
    (b[1] * (-0.5 * t)).exp() * (w * t).sin() / w
}

/// A brake whose force jumps at rest: no step has a solution, however short.
pub struct Brake;

impl StateFunction for Brake {
    fn generalized_force<T: Scalar>(&self, p: &[T], _t: T, _q: &[T], v: &[T]) -> T {
        if v[0].re() == 0.0 { p[0] * (1.0 / 3.0) } else { -p[0] * v[0].re().signum() }
    }
}

/// A pendulum with every force element.
pub struct Forces;

impl Forces {
    pub const DESIGN: [f64; 44] = [
        1.3, 0.2, 0.4, 9.81, // mass, inertia, lever, gravity
        40.0, 0.5, 0.9, 30.0, // spring
        3.0, 0.1, 0.2, 0.5, // torsion spring
        0.3, 0.4, 0.02, // friction
        0.5, 2.0, 9.0, 0.3, 0.7, // point force: mean, amplitude, frequency, phase, direction
        1.0, 0.5, 7.0, 0.1, // actuator
        60.0, 0.4, -0.05, // stop
        200.0, 300.0, 2.0, 1.0, 2.0, 0.05, // bushing
        0.7, 0.03, // second body
        0.8, -0.2, // initial velocity, angle
        0.3, 1.1, 5.0, // motor: mean, amplitude, frequency
        10.0, 0.2, 0.4, 1.5, // wall: stiffness, damping, height, direction of its normal
    ];
}

impl Forces {
    pub const LABELS: [Label; 15] = [
        ("rigid body", "mass, inertia", &[0, 1, 33, 34]),
        ("markers of bodies", "position on the body", &[2]),
        ("gravity", "acceleration", &[3]),
        ("spring and damper", "k, c, unloaded length, k₃", &[4, 5, 6, 7]),
        ("torsion spring", "k, c, unloaded angle, k₃", &[8, 9, 10, 11]),
        ("friction", "Coulomb moment, transition speed, viscosity", &[12, 13, 14]),
        ("force on a point", "mean, amplitude, frequency, phase, direction", &[15, 16, 17, 18, 19]),
        ("actuator", "mean, amplitude, frequency, phase", &[20, 21, 22, 23]),
        ("bump stop", "stiffness, damping, limit", &[24, 25, 26]),
        ("bushing", "stiffnesses", &[27, 28, 29]),
        ("bushing", "dampings", &[30, 31, 32]),
        ("initial state", "velocity", &[35]),
        ("initial state", "position", &[36]),
        ("motor or load", "mean, amplitude, frequency", &[37, 38, 39]),
        ("wall contact", "stiffness, damping, place, direction", &[40, 41, 42, 43]),
    ];
}

impl ParametricMechanism for Forces {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[3]);
        let ground = m.ground();
        let (sin, cos) = b[36].sin_cos();
        let body = m.body("pendulum", b[0], b[1], Pose { x: b[2] * cos, y: b[2] * sin, theta: b[36] });
        m.set_velocity(body.theta, b[35]);
        m.set_velocity(body.x, -b[35] * b[2] * sin);
        m.set_velocity(body.y, b[35] * b[2] * cos);
        m.revolute("pin", ground.origin(), body.at(-b[2], zero));
        let spring = m.nonlinear_spring(
            "spring",
            ground.at(S::from(0.3), S::from(0.8)),
            body.at(b[2], zero),
            [b[4], b[5], b[6], b[7]],
        );
        m.coordinate_spring("torsion", ground.theta, body.theta, [b[8], b[9], b[10], b[11]]);
        m.friction("friction", ground.theta, body.theta, [b[12], b[13], b[14]]);
        m.force("push", body.at(b[2] * 0.5, S::from(0.1)), b[19], Harmonic, &b[15..19]);
        m.actuator(
            "actuator",
            ground.at(S::from(-0.5), S::from(-0.6)),
            body.at(zero, S::from(-0.05)),
            Harmonic,
            &b[20..24],
        );
        m.bump_stop("stop", ground.theta, body.theta, [b[24], b[25], b[26]]);
        let tip = [b[2] * 2.0 * cos, b[2] * 2.0 * sin];
        let bob = m.body("bob", b[33], b[34], Pose { x: tip[0], y: tip[1], theta: b[36] });
        m.set_velocity(bob.theta, b[35] * 0.5);
        let bushing =
            m.bushing("bushing", body.at(b[2], zero), bob.origin(), [b[27], b[28], b[29]], [b[30], b[31], b[32]]);
        m.load("motor", ground.theta, bob.theta, Harmonic, &[b[37], b[38], b[39], zero]);
        m.wall_contact("wall", bob.origin(), [zero, b[42]], b[43], [b[40], b[41]]);
        let sensor = m.sensor("bob", bob.at(S::from(0.1), zero));
        for name in ["x", "y", "theta", "vx", "ay", "alpha"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        let terms = [m.measure(spring, "tension")?, m.measure(bushing, "force_y")?];
        m.output("spring", &terms[..1]);
        m.output("bushing", &terms[1..]);
        m.output("energy", &[m.kinetic_energy(), m.potential_energy()]);
        Ok(m)
    }
}

/// A driven mechanism with most joints; `length_driver` replaces a distance constraint by a drive.
pub struct Joints {
    pub length_driver: bool,
}

impl Joints {
    pub const LABELS: [Label; 12] = [
        ("rigid body", "mass, inertia, in joints", &[0, 1, 2, 3, 4, 5, 6, 7, 8]),
        ("point mass", "mass", &[9]),
        ("prismatic joint", "point and angle of its line", &[10, 11, 12]),
        ("revolute joint", "positions on both bodies", &[13, 30]),
        ("fixed joint", "position, angle", &[14, 15]),
        ("gear pair", "radii, offset", &[16, 17, 22]),
        ("distance constraint", "length", &[18]),
        ("drive between coordinates", "amplitude, frequency", &[19, 20]),
        ("initial state", "angle, made consistent with the joints", &[21]),
        ("rack and pinion", "radius, direction, offset", &[23, 24, 25]),
        ("pin in a slot", "angle of the slot", &[26]),
        ("pin in a slot", "position of the slot", &[27]),
    ];
    pub const DESIGN: [f64; 31] = [
        0.8, 0.05, 1.1, 0.06, 0.4, 0.02, 0.5, 0.03, 0.3, 0.2, // masses and inertias
        0.1, -0.05, 0.2, // slide: point and angle
        0.35, 0.15, 0.3, // link: half length, bob offset, bob turn
        0.12, 0.18, // gear radii
        0.6,  // rod
        0.02, 6.0, // drive: amplitude, frequency
        0.4, // link angle at the start
        0.072, 0.12, 0.02, 0.01, // gear offset; rack: radius, direction, offset
        0.05, 0.02, // slot: angle, position
        0.01, 4.0,  // linear drive: amplitude, frequency
        -0.5, // axis of the wheel
    ];
}

impl ParametricMechanism for Joints {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let c = S::from;
        let mut m = Mechanism::with_gravity(zero, c(-9.81));
        let ground = m.ground();
        let slider = m.body("slider", b[0], b[1], Pose { x: b[10], y: b[11], theta: zero });
        m.prismatic("slide", ground.at(b[10], b[11]), b[12], slider.origin(), zero);
        m.driver("drive", ground.x, slider.x, Harmonic, &[b[10], b[19], b[20], zero]);
        let (sin, cos) = b[21].sin_cos();
        let link = m.body("link", b[2], b[3], Pose { x: b[10] + b[13] * cos, y: b[11] + b[13] * sin, theta: b[21] });
        m.revolute("pin", slider.origin(), link.at(-b[13], zero));
        let bob = m.body("bob", b[4], b[5], Pose { x: b[10] + cos, y: b[11] + sin, theta: b[21] + b[15] });
        m.fixed_joint("fixed joint", link.at(b[13], zero), bob.at(-b[14], zero), b[15]);
        let wheel = m.body("wheel", b[6], b[7], Pose { x: b[30], y: zero, theta: zero });
        let axis = m.revolute("axis", ground.at(b[30], zero), wheel.origin());
        m.gear_pair("gears", [wheel.theta, link.theta], ground.theta, [b[16], b[17], b[22]]);
        let rack = m.body("rack", b[8], c(0.01), Pose { x: c(-0.5), y: c(0.12), theta: zero });
        m.prismatic("guide", ground.at(zero, c(0.12)), zero, rack.origin(), zero);
        m.rack("rack", rack, wheel, [b[23], b[24], b[25]]);
        let pin = m.point_mass("pin", b[9], b[10] + 0.25, b[11] + 0.1);
        let slot = m.point_on_line("slot", link.at(zero, b[27]), b[26], pin.origin());
        let far = ground.at(c(0.5), c(-0.5));
        let rod = if self.length_driver {
            m.drive_length("rod", far, pin.origin(), Harmonic, &[b[18], b[28], b[29], zero])
        } else {
            m.distance_constraint("rod", far, pin.origin(), b[18])
        };
        let sensor = m.sensor("bob", bob.at(c(0.1), c(0.1)));
        for (element, name) in [
            (sensor, "x"),
            (sensor, "vy"),
            (sensor, "ax"),
            (axis, "force"),
            (slot, "force"),
            (slot, "position"),
            (rod, "tension"),
        ] {
            let term = m.measure(element, name)?;
            m.output(format!("{} {name}", m.output_names().len()), &[term]);
        }
        Ok(m)
    }
}

/// A rotating cam with a vertical follower on a spring.
pub struct Cam;

impl Cam {
    pub const LABELS: [Label; 1] =
        [("cam and follower", "base radius, lift, angle of the smallest radius", &[0, 1, 2])];
    pub const DESIGN: [f64; 4] = [
        0.3, 0.1, 0.4, // cam: base radius, lift, angle of the smallest radius
        5.0, // initial angular velocity
    ];
}

impl ParametricMechanism for Cam {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let ground = m.ground();
        let cam = m.body("cam", S::from(1.0), S::from(0.05), Pose { x: zero, y: zero, theta: zero });
        m.revolute("axis", ground.origin(), cam.origin());
        m.set_velocity(cam.theta, b[3]);
        let height = b[0] + b[1] * 0.5 * (-b[2].sin() + 1.0);
        let follower = m.point_mass("follower", S::from(0.3), zero, height);
        m.fix(follower.x);
        m.coordinate_spring("spring", ground.y, follower.y, [40.0, 1.0, 0.0, 0.0].map(S::from));
        let profile = m.cam_follower("profile", cam.origin(), follower.origin(), [b[0], b[1], b[2]]);
        let rotation = m.coordinate_sensor("rotation", ground.theta, cam.theta);
        for (element, name) in [(profile, "force"), (profile, "lift"), (rotation, "position")] {
            let term = m.measure(element, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

/// A driven crank that moves a slider and a pin in a slot, with friction in bearings, guide and slot from their reactions.
pub struct JointFriction;

impl JointFriction {
    pub const LABELS: [Label; 4] = [
        ("friction in a revolute joint", "coefficient, radius, transition speed, transition force", &[0, 1, 2, 3]),
        ("friction in a guide", "coefficient, transition speed, length, transition force", &[4, 5, 6, 7]),
        ("friction of a pin in a slot", "coefficient, transition speed, transition force", &[8, 9, 10]),
        ("joints with friction", "positions on the bodies, angle of the slot, masses", &[11, 12, 13, 14, 15, 16]),
    ];
    pub const DESIGN: [f64; 19] = [
        0.3, 0.05, 1.5, 2.0, // pin: coefficient, radius, transition speed and force
        0.2, 0.4, 0.15, 3.0, // guide: coefficient, transition speed, length, transition force
        0.25, 0.3, 1.5, // slot: coefficient, transition speed and force
        0.15, 0.4, 0.3, // crank, rod, angle of the slot
        0.8, 0.6, 0.4, // masses: rod, slider, pin
        0.5, 3.0, // start of the crank, its speed
    ];
}

impl ParametricMechanism for JointFriction {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, c) = (S::from(0.0), S::from);
        let mut m = Mechanism::with_gravity(zero, c(-9.81));
        let ground = m.ground();
        let (sin, cos) = b[17].sin_cos();
        let crank = m.body("crank", c(0.5), c(0.02), Pose { x: zero, y: zero, theta: b[17] });
        m.set_velocity(crank.theta, b[18]);
        let axis = m.revolute("axis", ground.origin(), crank.origin());
        let tilt = -(b[11] * sin / b[12]).asin();
        let wrist = [b[11] * cos + b[12] * tilt.cos(), zero];
        let middle = [(b[11] * cos + wrist[0]) * 0.5, b[11] * sin * 0.5];
        let rod = m.body("rod", b[14], c(0.02), Pose { x: middle[0], y: middle[1], theta: tilt });
        let slider = m.body("slider", b[15], c(0.01), Pose { x: wrist[0], y: zero, theta: zero });
        let pin = m.revolute("pin", crank.at(b[11], zero), rod.at(b[12] * -0.5, zero));
        m.revolute("wrist", rod.at(b[12] * 0.5, zero), slider.origin());
        let guide = m.prismatic("guide", ground.at(zero, c(-0.02)), zero, slider.at(zero, c(-0.02)), zero);
        let reach = c(0.2);
        let [along, across] = [reach * b[13].cos(), reach * b[13].sin()];
        let bead = m.point_mass("bead", b[16], cos * along - sin * across, sin * along + cos * across);
        let slot = m.point_on_line("slot", crank.origin(), b[13], bead.origin());
        m.nonlinear_spring("spring", ground.at(zero, c(0.5)), bead.origin(), [30.0, 1.0, 0.4, 0.0].map(S::from));
        m.coordinate_spring("drive", ground.theta, crank.theta, [3.0, 0.1, 1.2, 0.0].map(S::from));
        let frictions = [
            m.revolute_friction("friction of the axis", axis, [b[0], b[1], b[2], b[3]])?,
            m.revolute_friction("friction of the pin", pin, [b[0], b[1], b[2], b[3]])?,
            m.guide_friction("friction of the guide", guide, [b[4], b[5], b[6], b[7]])?,
            m.guide_friction("friction of the slot", slot, [b[8], b[9], zero, b[10]])?,
        ];
        let sensor = m.sensor("slider", slider.origin());
        let measured = [(frictions[0], "moment"), (frictions[1], "moment"), (frictions[2], "force")];
        let rest = [
            (frictions[3], "force"),
            (frictions[2], "normal_force"),
            (sensor, "x"),
            (sensor, "vx"),
            (slot, "position"),
        ];
        for (element, name) in measured.into_iter().chain(rest) {
            let term = m.measure(element, name)?;
            m.output(format!("{} {name}", m.output_names().len()), &[term]);
        }
        Ok(m)
    }
}

/// A flexible arm, clamped to a hub that starts to turn, with a tip mass.
pub struct Arm {
    pub elements: usize,
}

impl Arm {
    pub const DESIGN: [f64; 8] = [0.02, 0.005, 0.8, 0.05, 2.0, 3.0, 0.15, 9.81];
}

impl ParametricMechanism for Arm {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[7]);
        let section = BeamSection::rectangular(b[0], b[1], 7e10, 0.3, 2700.0);
        let (nodes, elements) =
            m.beam("arm", [[zero, zero], [b[2], zero]], [None, None], self.elements, &section, Shear::Flexible);
        m.fix(nodes[0].x);
        m.fix(nodes[0].y);
        m.drive(nodes[0].theta, StartUp::Cycloid, &[zero, b[5], b[6]]);
        let tip = nodes[self.elements];
        let mass = m.body("tip", b[3], b[3] * 1e-3, Pose { x: b[2], y: zero, theta: zero });
        m.fixed_joint("clamp", tip.origin(), mass.origin(), zero);
        m.load("drag", m.ground().theta, tip.theta, ConstantSpeed, &[zero, b[4] * -0.1]);
        let sensor = m.sensor("tip", tip.origin());
        let root = m.measure(elements[0], "moment_i")?;
        m.output("root moment", &[root]);
        for name in ["x", "y", "vy"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        m.output("hub torque", &[m.driving_force(nodes[0].theta)]);
        Ok(m)
    }
}

/// Carts that are pulled along by springs, each from a coordinate that is driven in another way; and a controlled cart.
pub struct Drives;

/// A motion from outside the crate: a chirp.
struct Chirp;

impl Motion for Chirp {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] * (p[1] * t * t).sin()
    }
}

/// A controller: stiffness and damping against a reference that oscillates.
struct Control;

impl StateFunction for Control {
    fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
        p[0] * ((p[2] * t).sin() - q[0]) - p[1] * v[0]
    }
}

impl Drives {
    pub const LABELS: [Label; 9] = [
        ("inertia of a coordinate", "mass", &[0]),
        ("fixed coordinate", "position", &[1]),
        ("constant speed", "position, speed", &[2, 3]),
        ("smooth start-ups", "position, speed, duration", &[4, 5, 6]),
        ("harmonic drive", "mean, amplitude, frequency, phase", &[7, 8, 9, 10]),
        ("ramp", "from, to, begin, duration", &[11, 12, 13, 14]),
        ("table by a spline", "scale", &[15]),
        ("function of the user", "amplitude, rate", &[16, 17]),
        ("load by time and state", "stiffness, damping, frequency", &[18, 19, 20]),
    ];
    pub const DESIGN: [f64; 21] = [
        0.7, // mass
        0.2, 0.1, 2.0, // fixed, constant speed
        0.1, 3.0, 0.305, // start-up
        0.1, 0.5, 6.0, 0.4, // harmonic
        0.1, 0.6, 0.105, 0.3, // ramp
        0.8, 0.3, 9.0, // table, chirp
        60.0, 2.0, 5.0, // controller
    ];
}

impl ParametricMechanism for Drives {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let knots: Vec<f64> = (0..=8).map(|k| 0.095 * f64::from(k)).collect();
        let table = TabulatedMotion::new(&knots, &knots.iter().map(|t| (5.0 * t).sin()).collect::<Vec<_>>())?;
        let mut m = Mechanism::new();
        let mut pulled = |drive: &dyn Fn(&mut Mechanism<S>, Coordinate)| -> Result<()> {
            let [lead, cart] = [m.coordinate("lead", zero, zero), m.coordinate("cart", zero, zero)];
            drive(&mut m, lead);
            m.inertia("mass", cart, b[0]);
            let spring = m.coordinate_spring("spring", lead, cart, [40.0, 1.0, 0.0, 0.0].map(S::from));
            for name in ["generalized_force", "elongation"] {
                let term = m.measure(spring, name)?;
                m.output(name, &[term]);
            }
            m.output("drive", &[m.driving_force(lead)]);
            Ok(())
        };
        pulled(&|m, lead| m.drive(lead, Fixed, &b[1..2]))?;
        pulled(&|m, lead| m.drive(lead, ConstantSpeed, &b[2..4]))?;
        for profile in [StartUp::Linear, StartUp::Cubic, StartUp::HalfCosine, StartUp::Cycloid, StartUp::Polynomial] {
            pulled(&|m, lead| m.drive(lead, profile, &b[4..7]))?;
        }
        pulled(&|m, lead| m.drive(lead, Harmonic, &b[7..11]))?;
        pulled(&|m, lead| m.drive(lead, Ramp::Smooth, &b[11..15]))?;
        pulled(&|m, lead| m.drive(lead, table.clone(), &b[15..16]))?;
        pulled(&|m, lead| m.drive(lead, Chirp, &b[16..18]))?;
        let cart = m.coordinate("controlled cart", S::from(0.1), zero);
        m.inertia("controlled mass", cart, b[0]);
        let control = m.feedback_force("control", cart, &[cart], Control, &b[18..21]);
        let sensor = m.coordinate_sensor("controlled motion", m.ground().x, cart);
        for (element, name) in [(control, "generalized_force"), (sensor, "position"), (sensor, "velocity")] {
            let term = m.measure(element, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}
