//! Random mechanisms in space whose positions assemble: open and closed chains of all joints with turned markers, drives,
//! forces, stops, contacts of spheres and beams.

mod build;
mod chains;
mod redundant;

use crate::random::{Class, Profile, Random, RandomModel};
use linkwright_mechanics::constraint_rank::redundant_constraints;
use linkwright_mechanics::elements::spatial::LoadKind3;
use linkwright_mechanics::mechanism::{EulerSequence, ParametricMechanism, Pose3, Rotation};
use linkwright_mechanics::system::System;
use linkwright_mechanics::system::state::State;

/// A body, by number; `None` is the ground.
type Frame = Option<usize>;

/// Joints of two markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Joint {
    Revolute,
    Prismatic,
    Cylindrical,
    Screw,
    Planar,
    Fixed,
    Spherical,
    Universal,
    PointOnLine,
    PointOnPlane,
}

/// The angle or the displacement of the joint with this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum JointMotion {
    Angle(usize),
    Displacement(usize),
}

/// Element that acts on the coordinate of a joint.
#[derive(Clone, Copy, Debug)]
enum Action {
    Spring,
    Friction,
    Load,
    Stop,
    Drive(Profile),
}

/// Parts of a mechanism. `at` is the index of the first of their numbers; a marker has a point and three Euler angles.
#[derive(Clone, Debug)]
enum MechanismPart {
    Body { at: usize },
    PointMass { at: usize },
    Joint { joint: Joint, frames: [Frame; 2], at: usize },
    On { along: JointMotion, action: Action, at: usize },
    Gears { along: [JointMotion; 2], at: usize },
    Rod { frames: [Frame; 2], at: usize },
    LengthDrive { frames: [Frame; 2], at: usize },
    Spring { frames: [Frame; 2], at: usize },
    Rope { frames: [Frame; 2], at: usize },
    Bushing { frames: [Frame; 2], at: usize },
    SpherePlane { frames: [Frame; 2], at: usize },
    SphereSphere { frames: [Frame; 2], at: usize },
    Load { kind: LoadKind3, body: usize, at: usize },
    Beam { body: usize, elements: usize, at: usize },
}

/// A random mechanism in space. Design variables are some of its numbers.
#[derive(Clone, Debug)]
pub struct RandomMechanism3 {
    class: Class,
    parts: Vec<MechanismPart>,
    numbers: Vec<f64>,
    /// Indices of the numbers that are design variables.
    variables: Vec<usize>,
    /// Indices of the numbers that do not contradict redundant constraints.
    harmless: Vec<usize>,
    /// World poses of the bodies.
    poses: Vec<Pose3<f64>>,
    /// Number of joints.
    joints: usize,
    /// Coordinates of joints and their initial values, and those of them that move by themselves.
    coordinates: Vec<(JointMotion, f64)>,
    driven: Vec<JointMotion>,
}

impl RandomModel for RandomMechanism3 {
    fn random(class: Class, seed: u64) -> Option<Self> {
        let mut random = Random(seed.wrapping_mul(0x9fb2_1c65_1e98_df25) ^ class as u64);
        (0..20).find_map(|_| Self::attempt(class, &mut random))
    }

    fn class(&self) -> Class {
        self.class
    }

    fn design(&self) -> Vec<f64> {
        self.variables.iter().map(|&i| self.numbers[i]).collect()
    }

    /// Every second mechanism: they are larger than those in the plane.
    fn is_for_scheme(&self, number: usize) -> bool {
        (self.numbers.len() + self.variables[0] + number).is_multiple_of(2)
    }
}

impl RandomMechanism3 {
    fn attempt(class: Class, random: &mut Random) -> Option<Self> {
        let mut mechanism = Self {
            class,
            parts: vec![],
            numbers: vec![],
            variables: vec![],
            harmless: vec![],
            poses: vec![],
            joints: 0,
            coordinates: vec![],
            driven: vec![],
        };
        let g = if class == Class::Floating { 0.0 } else { -9.81 };
        mechanism.add_numbers(&[0.0, 0.0, g]);
        match class {
            Class::Redundant => mechanism.redundant(random),
            Class::Driven => mechanism.driven_chain(random),
            _ => mechanism.chains(random),
        }
        mechanism.variables = mechanism.choose_variables(random);
        let plain = mechanism.build(&mechanism.design()).ok()?;
        let system = System::new(&plain).ok()?;
        let state = State::built(&plain, 0.0);
        let redundant = redundant_constraints(&system, &plain, &state).len();
        let fits = if class == Class::Redundant { redundant > 0 } else { redundant == 0 };
        (fits && !mechanism.variables.is_empty()).then_some(mechanism)
    }

    fn is_conservative(&self) -> bool {
        matches!(self.class, Class::Conservative | Class::Floating)
    }

    fn add_numbers(&mut self, values: &[f64]) -> usize {
        self.numbers.extend_from_slice(values);
        self.numbers.len() - values.len()
    }

    /// Up to three numbers that are not zero.
    fn choose_variables(&self, random: &mut Random) -> Vec<usize> {
        let all =
            if self.class == Class::Redundant { self.harmless.clone() } else { (0..self.numbers.len()).collect() };
        let candidates: Vec<usize> = all.into_iter().filter(|&i| self.numbers[i].abs() > 1e-3).collect();
        let mut chosen: Vec<usize> = (0..3).map(|_| candidates[random.below(candidates.len())]).collect();
        chosen.sort_unstable();
        chosen.dedup();
        chosen
    }

    fn pose(&self, frame: Frame) -> Pose3<f64> {
        frame.map_or(Pose3::at([0.0; 3]), |k| self.poses[k])
    }

    /// Body-fixed coordinates of a point of the world.
    fn local(&self, frame: Frame, point: [f64; 3]) -> [f64; 3] {
        let pose = self.pose(frame);
        pose.orientation.inverse().rotate([0, 1, 2].map(|k| point[k] - pose.position[k]))
    }

    /// Numbers of the marker of a frame that is at a point of the world with the given orientation.
    fn marker(&self, frame: Frame, point: [f64; 3], orientation: Rotation<f64>) -> [f64; 6] {
        let [x, y, z] = self.local(frame, point);
        let [a, b, c] = angles(self.pose(frame).orientation.inverse().then(orientation));
        [x, y, z, a, b, c]
    }

    /// Numbers of two points of frames that are the given points of the world.
    fn points(&self, frames: [Frame; 2], points: [[f64; 3]; 2]) -> Vec<f64> {
        (0..2).flat_map(|k| self.local(frames[k], points[k])).collect()
    }

    /// Adds a body: mass, moments and products of inertia, centre of mass, pose, velocity and angular velocity.
    fn add_body(&mut self, random: &mut Random, pose: Pose3<f64>) -> usize {
        // Sums of squares of lengths fulfil the triangle inequality.
        let [a, b, c] = [0; 3].map(|_| random.between(0.02, 0.15));
        let [p, q, r] = [0; 3].map(|_| random.between(-0.005, 0.005));
        let centre = [0; 3].map(|_| random.between(-0.1, 0.1));
        let velocity = [0; 6].map(|_| random.between(-1.0, 1.0));
        let mass = random.between(0.5, 2.0);
        let at = self.add_numbers(&[mass, b + c, a + c, a + b, p, q, r]);
        self.add_numbers(&centre);
        self.add_numbers(&pose.position);
        self.add_numbers(&angles(pose.orientation));
        self.add_numbers(&velocity);
        self.parts.push(MechanismPart::Body { at });
        self.poses.push(pose);
        self.poses.len() - 1
    }

    fn add_point_mass(&mut self, random: &mut Random, position: [f64; 3]) -> usize {
        let at = self.add_numbers(&[random.between(0.5, 2.0)]);
        self.add_numbers(&position);
        self.add_numbers(&[0; 3].map(|_| random.between(-1.0, 1.0)));
        self.parts.push(MechanismPart::PointMass { at });
        self.poses.push(Pose3::at(position));
        self.poses.len() - 1
    }
}

/// Euler angles of a rotation, as numbers of a mechanism have them.
fn angles(rotation: Rotation<f64>) -> [f64; 3] {
    EulerSequence::Zyx.angles(&rotation.matrix())
}

fn point(random: &mut Random) -> [f64; 3] {
    [0; 3].map(|_| random.between(-0.7, 0.7))
}

fn orientation(random: &mut Random) -> Rotation<f64> {
    let angles = [random.between(-2.5, 2.5), random.between(-1.2, 1.2), random.between(-2.5, 2.5)];
    Rotation::euler_angles(EulerSequence::Zyx, angles)
}

fn random_pose(random: &mut Random) -> Pose3<f64> {
    Pose3::new(point(random), orientation(random))
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| b[k] - a[k])
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    difference(a, b).map(|x| x * x).iter().sum::<f64>().sqrt()
}
