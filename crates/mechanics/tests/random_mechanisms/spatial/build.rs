//! The mechanism of a random list of parts.

use crate::random::{Class, prescribe};
use crate::spatial::{Action, Joint, JointMotion, MechanismPart, RandomMechanism3};
use autodiff::Scalar;
use linkwright_mechanics::elements::Shear;
use linkwright_mechanics::elements::spatial::{BeamSection3, MassProperties3};
use linkwright_mechanics::mechanism::{
    Body3, Coordinate, ElementIndex, EulerSequence, Formula, Marker3, Mechanism, ParametricMechanism, Pose3, Rotation,
};
use linkwright_mechanics::motion::Harmonic;
use linkwright_mechanics::{Error, Result};

/// |e|² of some Euler parameters.
struct Square;

impl Formula for Square {
    fn value<T: Scalar>(&self, _: T, x: &[T]) -> T {
        x.iter().map(|&x| x * x).sum()
    }
}

/// A component of the angular momentum about the origin. Of each body: centre of mass, momentum, products of the rows of the
/// inertia matrix and the own angular velocity, Euler parameters.
struct AngularMomentum(usize);

impl Formula for AngularMomentum {
    fn value<T: Scalar>(&self, _: T, x: &[T]) -> T {
        let (i, j) = ((self.0 + 1) % 3, (self.0 + 2) % 3);
        let of = |x: &[T]| {
            let spin = [0, 1, 2].map(|k| x[6 + 3 * k] + x[7 + 3 * k] + x[8 + 3 * k]);
            let own = Rotation::euler_parameters([x[15], x[16], x[17], x[18]]).rotate(spin);
            x[i] * x[3 + j] - x[j] * x[3 + i] + own[self.0]
        };
        x.chunks(19).map(of).sum()
    }
}

/// A mechanism that is being built.
struct Builder<S> {
    m: Mechanism<S>,
    bodies: Vec<Body3>,
    masses: Vec<MassProperties3<S>>,
    /// Initial velocities and angular velocities of the bodies.
    velocities: Vec<[[S; 3]; 2]>,
    joints: Vec<ElementIndex>,
    coordinates: Vec<(JointMotion, Coordinate)>,
    /// Elements and their measures that may become outputs.
    reactions: Vec<(ElementIndex, &'static str)>,
}

impl<S: Scalar> Builder<S> {
    fn frame(&mut self, frame: Option<usize>) -> Body3 {
        frame.map_or_else(|| self.m.ground3(), |k| self.bodies[k])
    }

    /// The points of two frames with the given body-fixed coordinates.
    fn points(&mut self, frames: [Option<usize>; 2], p: &[S]) -> [Marker3<S>; 2] {
        [0, 1].map(|k| self.frame(frames[k]).at(triple(p, 3 * k)))
    }

    /// The markers of two frames.
    fn markers(&mut self, frames: [Option<usize>; 2], p: &[S]) -> [Marker3<S>; 2] {
        [0, 1].map(|k| self.marker(frames[k], &p[6 * k..]))
    }

    fn marker(&mut self, frame: Option<usize>, p: &[S]) -> Marker3<S> {
        self.frame(frame).at(triple(p, 0)).turned(euler(p, 3))
    }

    fn coordinate(&self, along: JointMotion) -> Result<Coordinate> {
        let found = self.coordinates.iter().find(|(own, _)| *own == along);
        let why = || Error::definition("random mechanism", "a joint has no such coordinate", "take another seed");
        found.map(|(_, coordinate)| *coordinate).ok_or_else(why)
    }

    fn join(&mut self, name: &str, joint: Joint, frames: [Option<usize>; 2], p: &[S]) {
        let [a, b] = self.markers(frames, p);
        let number = self.joints.len();
        let m = &mut self.m;
        let screw = |m: &mut Mechanism<S>, own: &mut Vec<(JointMotion, Coordinate)>| {
            let [angle, displacement] = m.screw(name, a, b, p[12]);
            own.extend([(JointMotion::Angle(number), angle), (JointMotion::Displacement(number), displacement)]);
        };
        let index = match joint {
            Joint::Revolute => m.revolute3(name, a, b),
            Joint::Prismatic => m.prismatic3(name, a, b),
            Joint::Cylindrical => m.cylindrical(name, a, b),
            Joint::Screw => {
                screw(m, &mut self.coordinates);
                m.sensor3(&format!("{name} nut"), b)
            }
            Joint::Planar => m.planar_joint(name, a, b),
            Joint::Fixed => m.fixed_joint3(name, a, b),
            Joint::Spherical => m.spherical(name, a, b),
            Joint::Universal => m.universal(name, a, b),
            Joint::PointOnLine => m.point_on_line3(name, a, b),
            Joint::PointOnPlane => m.point_on_plane(name, a, b),
        };
        self.joints.push(index);
        if matches!(joint, Joint::Revolute | Joint::Cylindrical | Joint::Planar) {
            self.coordinates.push((JointMotion::Angle(number), m.joint_angle(&format!("{name} angle"), a, b)));
        }
        if matches!(joint, Joint::Prismatic | Joint::Cylindrical) {
            self.coordinates
                .push((JointMotion::Displacement(number), m.joint_displacement(&format!("{name} way"), a, b)));
        }
        if joint != Joint::Screw {
            self.reactions.push((index, if number.is_multiple_of(2) { "force" } else { "torque" }));
        }
    }

    fn beam(&mut self, name: &str, body: usize, elements: usize, p: &[S]) {
        let pose = self.m.pose3(self.bodies[body]);
        let zero = S::from(0.0);
        // A beam with an initial curvature, clamped to a point of the body where the body is built.
        let along = |k: usize| {
            let x = p[3] * (k as f64 / elements as f64);
            pose.point([p[0] + x, p[1] + x * x * p[4], p[2]])
        };
        let points: Vec<[S; 3]> = (0..=elements).map(along).collect();
        let section = BeamSection3::rectangular([p[5], p[6]], 1e6, 0.3, 300.0);
        let up = pose.orientation.rotate([zero, zero, S::from(1.0)]);
        let (nodes, _) = self.m.beam3(name, &points, up, [Some(self.bodies[body]), None], &section, Shear::Flexible);
        // The nodes start with the motion of the body.
        let [v, omega] = self.velocities[body];
        for (node, point) in nodes.iter().zip(&points).skip(1) {
            let r = [0, 1, 2].map(|k| point[k] - pose.position[k]);
            let turn = [1, 2, 0].map(|i| omega[i] * r[(i + 1) % 3] - omega[(i + 1) % 3] * r[i]);
            self.m.set_velocity3(*node, [0, 1, 2].map(|k| v[k] + turn[k]), omega);
        }
        self.bodies.push(nodes[elements]);
    }

    fn outputs(&mut self, class: Class) -> Result<()> {
        let m = &mut self.m;
        for (k, &body) in self.bodies.iter().rev().take(2).enumerate() {
            let sensor = m.sensor3(&format!("sensor {k}"), body.at([0.1, 0.05, -0.1].map(S::from)));
            for name in ["x", "z", "vy", "omega_z", "ax"] {
                let term = m.measure(sensor, name)?;
                m.output(format!("{name}{k}"), &[term]);
            }
        }
        if class != Class::Redundant {
            let choice = self.reactions.iter().find_map(|&(element, name)| m.measure(element, name).ok());
            choice.into_iter().for_each(|term| m.output("reaction", &[term]));
        }
        let (kinetic, potential) = (m.kinetic_energy(), m.potential_energy());
        m.output("energy", &[kinetic, potential]);
        let still = m.ground().x;
        let mut momenta: Vec<_> = Vec::new();
        for (k, (&body, properties)) in self.bodies.iter().zip(&self.masses).enumerate() {
            let mut e = Vec::new();
            for (i, coordinate) in body.e.into_iter().enumerate() {
                let sensor = m.coordinate_sensor(&format!("e{i} of {k}"), still, coordinate);
                e.push(m.measure(sensor, "position")?);
            }
            m.output_formula(format!("norm{k}"), Square, &e);
            if class != Class::Floating {
                continue;
            }
            let sensor = m.sensor3(&format!("centre {k}"), body.at(properties.centre));
            let [[a, b, c], [p, q, r]] = [properties.moments, properties.products];
            for name in ["x", "y", "z"] {
                momenta.push(m.measure(sensor, name)?);
            }
            for name in ["vx", "vy", "vz"] {
                momenta.push(m.measure(sensor, name)?.times(properties.mass));
            }
            for row in [[a, p, r], [p, b, q], [r, q, c]] {
                for (name, entry) in ["own_omega_x", "own_omega_y", "own_omega_z"].into_iter().zip(row) {
                    momenta.push(m.measure(sensor, name)?.times(entry));
                }
            }
            momenta.extend(e);
        }
        if class == Class::Floating {
            for k in 0..3 {
                let linear: Vec<_> = momenta.chunks(19).map(|of| of[3 + k]).collect();
                m.output(format!("momentum{k}"), &linear);
                m.output_formula(format!("momentum{}", 3 + k), AngularMomentum(k), &momenta);
            }
        }
        Ok(())
    }
}

fn triple<S: Scalar>(p: &[S], at: usize) -> [S; 3] {
    [p[at], p[at + 1], p[at + 2]]
}

fn euler<S: Scalar>(p: &[S], at: usize) -> Rotation<S> {
    Rotation::euler_angles(EulerSequence::Zyx, triple(p, at))
}

fn six<S: Scalar>(p: &[S]) -> [S; 6] {
    [p[0], p[1], p[2], p[3], p[4], p[5]]
}

impl ParametricMechanism for RandomMechanism3 {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut values: Vec<S> = self.numbers.iter().map(|&x| S::from(x)).collect();
        self.variables.iter().zip(b).for_each(|(&i, &x)| values[i] = x);
        let m = Mechanism::with_gravity3(triple(&values, 0));
        let mut x = Builder {
            m,
            bodies: vec![],
            masses: vec![],
            velocities: vec![],
            joints: vec![],
            coordinates: vec![],
            reactions: vec![],
        };
        let still = x.m.ground().theta;
        for (k, part) in self.parts.iter().enumerate() {
            let name = format!("part {k}");
            match *part {
                MechanismPart::Body { at } => {
                    let p = &values[at..];
                    let properties = MassProperties3 {
                        mass: p[0],
                        centre: triple(p, 7),
                        moments: triple(p, 1),
                        products: triple(p, 4),
                    };
                    let body = x.m.body3(&name, properties, Pose3::new(triple(p, 10), euler(p, 13)));
                    x.m.set_velocity3(body, triple(p, 16), triple(p, 19));
                    x.velocities.push([triple(p, 16), triple(p, 19)]);
                    x.bodies.push(body);
                    x.masses.push(properties);
                }
                MechanismPart::PointMass { at } => {
                    let p = &values[at..];
                    let body = x.m.point_mass3(&name, p[0], triple(p, 1));
                    x.m.set_velocity3(body, triple(p, 4), [S::from(0.0); 3]);
                    x.velocities.push([triple(p, 4), [S::from(0.0); 3]]);
                    x.bodies.push(body);
                    x.masses.push(MassProperties3::principal(p[0], [S::from(0.0); 3]));
                }
                MechanismPart::Joint { joint, frames, at } => x.join(&name, joint, frames, &values[at..]),
                MechanismPart::On { along, action, at } => {
                    let (on, p) = (x.coordinate(along)?, &values[at..]);
                    match action {
                        Action::Spring => {
                            x.m.coordinate_spring(&name, still, on, [p[0], p[1], p[2], p[3]]);
                        }
                        Action::Friction => {
                            x.m.friction(&name, still, on, [p[0], p[1], p[2]]);
                        }
                        Action::Load => {
                            x.m.load(&name, still, on, Harmonic, &p[..4]);
                        }
                        Action::Stop => {
                            x.m.bump_stop(&name, still, on, [p[0], p[1], p[2]]);
                        }
                        Action::Drive(profile) => prescribe(&mut x.m, on, profile, p),
                    }
                }
                MechanismPart::Gears { along: [a, b], at } => {
                    let (wheels, p) = ([x.coordinate(a)?, x.coordinate(b)?], &values[at..]);
                    x.m.gear_pair(&name, wheels, still, [p[0], p[1], p[2]]);
                }
                MechanismPart::Rod { frames, at } => {
                    let [a, b] = x.points(frames, &values[at..]);
                    let index = x.m.distance_constraint3(&name, a, b, values[at + 6]);
                    x.reactions.push((index, "tension"));
                }
                MechanismPart::LengthDrive { frames, at } => {
                    let [a, b] = x.points(frames, &values[at..]);
                    x.m.drive_distance(&name, a, b, Harmonic, &values[at + 6..at + 10]);
                }
                MechanismPart::Spring { frames, at } => {
                    let ([a, b], p) = (x.points(frames, &values[at..]), &values[at + 6..]);
                    x.m.nonlinear_spring3(&name, a, b, [p[0], p[1], p[2], p[3]]);
                }
                MechanismPart::Rope { frames, at } => {
                    let ([a, b], p) = (x.points(frames, &values[at..]), &values[at + 6..]);
                    x.m.rope3(&name, a, b, [p[0], p[1], p[2]]);
                }
                MechanismPart::Bushing { frames, at } => {
                    let ([a, b], p) = (x.markers(frames, &values[at..]), &values[at + 12..]);
                    x.m.bushing3(&name, a, b, six(p), six(&p[6..]));
                }
                MechanismPart::SpherePlane { frames, at } => {
                    let ([a, b], p) = (x.markers(frames, &values[at..]), &values[at + 12..]);
                    x.m.sphere_plane3(&name, a, b, p[0], [p[1], p[2], p[3], p[4]]);
                }
                MechanismPart::SphereSphere { frames, at } => {
                    let ([a, b], p) = (x.markers(frames, &values[at..]), &values[at + 12..]);
                    x.m.sphere_sphere3(&name, a, b, [p[5], p[0]], [p[1], p[2], p[3], p[4]]);
                }
                MechanismPart::Load { kind, body, at } => {
                    let (marker, p) = (x.marker(Some(body), &values[at..]), &values[at + 6..]);
                    x.m.load3(&name, kind, marker, triple(p, 0), Harmonic, &p[3..7]);
                }
                MechanismPart::Beam { body, elements, at } => x.beam(&name, body, elements, &values[at..]),
            }
        }
        x.outputs(self.class)?;
        Ok(x.m)
    }
}
