//! Random mechanisms whose positions assemble: open and closed chains of all joints, drives, forces and beams.

use crate::random::{Accelerated, Class, Profile, Random, RandomModel, prescribe, random_motion};
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::simulate;
use linkwright_mechanics::constraint_rank::redundant_constraints;
use linkwright_mechanics::elements::{BeamSection, Shear};
use linkwright_mechanics::events::Action;
use linkwright_mechanics::mechanism::{
    Body, Coordinate, ElementIndex, Formula, Marker, Mechanism, ParametricMechanism, Pose, WeightedQuantity,
};
use linkwright_mechanics::motion::{Harmonic, StartUp};
use linkwright_mechanics::system::System;
use linkwright_mechanics::system::state::State;
use linkwright_mechanics::{Dynamics, Error, Result};

/// Group of the seeds, in eights, whose mechanisms have friction in their joints.
const RUBBING: u64 = 5;

/// Group of the seeds, in eights, whose mechanisms in motion have events.
const EVENTFUL: u64 = 2;

/// A body, by number; `None` is the ground.
type Frame = Option<usize>;

/// Parts of a mechanism. `at` is the index of the first of their numbers.
#[derive(Clone, Debug)]
enum MechanismPart {
    Body {
        at: usize,
    },
    /// A node whose x is driven.
    Cart {
        at: usize,
        profile: Profile,
    },
    Revolute {
        frames: [Frame; 2],
        at: usize,
    },
    Prismatic {
        frames: [Frame; 2],
        at: usize,
    },
    Slot {
        frames: [Frame; 2],
        at: usize,
    },
    Rod {
        frames: [Frame; 2],
        at: usize,
    },
    Fixed {
        frames: [Frame; 2],
        at: usize,
    },
    Gears {
        wheels: [usize; 2],
        carrier: Frame,
        at: usize,
    },
    Rack {
        rack: usize,
        pinion: usize,
        at: usize,
    },
    Cam {
        frames: [Frame; 2],
        at: usize,
    },
    Drive {
        body: usize,
        profile: Profile,
        at: usize,
    },
    RelativeDrive {
        frames: [Frame; 2],
        profile: Profile,
        at: usize,
    },
    LengthDrive {
        frames: [Frame; 2],
        at: usize,
    },
    Spring {
        frames: [Frame; 2],
        at: usize,
    },
    Torsion {
        frames: [Frame; 2],
        at: usize,
    },
    Bushing {
        frames: [Frame; 2],
        at: usize,
    },
    Friction {
        frames: [Frame; 2],
        at: usize,
    },
    /// Friction of the joint that is part number `joint`, from its reaction.
    JointFriction {
        joint: usize,
        at: usize,
    },
    Load {
        frames: [Frame; 2],
        at: usize,
    },
    Force {
        body: usize,
        at: usize,
    },
    Actuator {
        frames: [Frame; 2],
        at: usize,
    },
    Stop {
        body: usize,
        at: usize,
    },
    Wall {
        body: usize,
        at: usize,
    },
    /// An ellipse on the ground that a point of a body touches.
    Ellipse {
        body: usize,
        at: usize,
    },
    Beam {
        body: usize,
        elements: usize,
        at: usize,
    },
    /// A crank of the common length with number `length` between the ground and the first body.
    Crank {
        length: usize,
        at: usize,
    },
}

impl MechanismPart {
    /// True for a joint that an event can release.
    fn is_joint(&self) -> bool {
        matches!(
            self,
            Self::Revolute { .. } | Self::Prismatic { .. } | Self::Slot { .. } | Self::Rod { .. } | Self::Fixed { .. }
        )
    }

    /// True for a force that an event can begin or end.
    fn is_force(&self) -> bool {
        matches!(
            self,
            Self::Spring { .. }
                | Self::Torsion { .. }
                | Self::Bushing { .. }
                | Self::Load { .. }
                | Self::Force { .. }
                | Self::Actuator { .. }
        )
    }
}

/// An event in which an output passes a limit: a force begins or ends, or a joint is released.
#[derive(Clone, Copy, Debug)]
struct OutputEvent {
    output: usize,
    limit: f64,
    /// 1 if the output increases to the limit, −1 if it decreases.
    sign: f64,
    /// Number of the part that changes.
    part: usize,
    /// True if the part ends.
    ends: bool,
}

impl Formula for OutputEvent {
    fn value<T: Scalar>(&self, _t: T, x: &[T]) -> T {
        (x[0] - self.limit) * self.sign
    }
}

/// A random mechanism. Design variables are some of its numbers.
#[derive(Clone, Debug)]
pub struct RandomMechanism {
    class: Class,
    parts: Vec<MechanismPart>,
    events: Vec<OutputEvent>,
    numbers: Vec<f64>,
    /// Indices of the numbers that are design variables.
    variables: Vec<usize>,
    /// World poses of the bodies.
    poses: Vec<[f64; 3]>,
}

impl RandomModel for RandomMechanism {
    fn random(class: Class, seed: u64) -> Option<Self> {
        let mut random = Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ class as u64);
        (0..20).find_map(|_| Self::attempt(class, &mut random, seed / 8 % 8))
    }

    fn class(&self) -> Class {
        self.class
    }

    fn design(&self) -> Vec<f64> {
        self.variables.iter().map(|&i| self.numbers[i]).collect()
    }

    fn has_events(&self) -> bool {
        !self.events.is_empty()
    }
}

impl RandomMechanism {
    fn attempt(class: Class, random: &mut Random, group: u64) -> Option<Self> {
        let mut mechanism =
            Self { class, parts: vec![], events: vec![], numbers: vec![], variables: vec![], poses: vec![] };
        let g = if matches!(class, Class::Floating) { 0.0 } else { -9.81 };
        mechanism.add_numbers(&[0.0, g]);
        match class {
            Class::Redundant => mechanism.redundant(random),
            Class::Driven => mechanism.driven(random),
            _ => mechanism.chains(random),
        }
        if class == Class::Flexible {
            let body = random.below(mechanism.poses.len());
            let at = mechanism.add_numbers(&[0.1, 0.05, random.between(0.3, 0.6), 0.01, 0.004]);
            mechanism.parts.push(MechanismPart::Beam { body, elements: 2 + random.below(2), at });
        }
        if group == RUBBING {
            mechanism.rub(random);
        }
        mechanism.variables = mechanism.choose_variables(random);
        if group == EVENTFUL && matches!(class, Class::Rigid | Class::Contact | Class::Flexible) {
            mechanism.add_events(random)?;
        }
        let plain = mechanism.build(&mechanism.design()).ok()?;
        let system = System::new(&plain).ok()?;
        let state = State::built(&plain, 0.0);
        let redundant = redundant_constraints(&system, &plain, &state).len();
        let fits = if class == Class::Redundant { redundant > 0 } else { redundant == 0 };
        (fits && !mechanism.variables.is_empty()).then_some(mechanism)
    }

    fn add_numbers(&mut self, values: &[f64]) -> usize {
        self.numbers.extend_from_slice(values);
        self.numbers.len() - values.len()
    }

    /// Adds friction to the joints that can have it.
    fn rub(&mut self, random: &mut Random) {
        if self.is_conservative() || self.class == Class::Redundant {
            return;
        }
        if self.class == Class::Contact {
            let body = random.below(self.poses.len());
            let ([x, y, _], axes) = (self.poses[body], [random.between(0.3, 0.8), random.between(0.3, 0.6)]);
            let depth = random.between(-0.05, 0.01);
            let at = self.add_numbers(&[x, y - axes[1] + depth, axes[0], axes[1], random.between(200.0, 2000.0), 0.1]);
            self.parts.push(MechanismPart::Ellipse { body, at });
        }
        for joint in 0..self.parts.len() {
            let size = match self.parts[joint] {
                MechanismPart::Revolute { .. } => random.between(0.01, 0.1), // radius of the pin
                MechanismPart::Prismatic { .. } => random.between(0.3, 1.0), // distance of the contact points
                MechanismPart::Slot { .. } => 0.0,
                _ => continue,
            };
            let at = self.add_numbers(&[random.between(0.05, 0.3), size, random.between(0.1, 0.5), 0.5]);
            self.parts.push(MechanismPart::JointFriction { joint, at });
        }
    }

    /// Adds events in which parts change where an output passes a value of the motion: one, two at one time, or two in turn.
    fn add_events(&mut self, random: &mut Random) -> Option<()> {
        let can_change = |part: &MechanismPart| part.is_joint() || part.is_force();
        let mut parts: Vec<usize> = (0..self.parts.len()).filter(|&k| can_change(&self.parts[k])).collect();
        let times: Vec<f64> = (0..=40).map(|k| 4e-3 * f64::from(k)).collect();
        for number in 0..1 + random.below(2) {
            if parts.is_empty() {
                break;
            }
            let part = parts.swap_remove(random.below(parts.len()));
            let ends = self.parts[part].is_joint() || random.chance(0.5);
            let previous = self.events.last().copied().filter(|_| random.chance(0.5));
            self.events.push(OutputEvent { output: 0, limit: 1e9, sign: 1.0, part, ends });
            if let Some(previous) = previous {
                self.events[number] = OutputEvent { part, ends, ..previous };
                continue;
            }
            let history = simulate(&self.build(&self.design()).ok()?, &Dynamics::fixed(4e-3), &times).ok()?;
            let output = random.below(history.values.len() - 1); // not the energy
            let (values, k) = (&history.values[output], 5 + random.below(30));
            let (limit, change) = (values[k], values[k + 1] - values[k - 1]);
            let event = OutputEvent { output, limit, sign: change.signum(), part, ends };
            let range = values[..=k].iter().map(|x| (x - limit).abs()).fold(0.0, f64::max);
            // The first passage, not nearly tangential.
            if change.abs() < 0.05 * range + 1e-4 || values[..k].iter().any(|x| (x - limit) * event.sign >= 0.0) {
                return None;
            }
            self.events[number] = event;
        }
        (!self.events.is_empty()).then_some(())
    }

    /// Three or four numbers that are not zero.
    fn choose_variables(&self, random: &mut Random) -> Vec<usize> {
        let candidates: Vec<usize> = (0..self.numbers.len()).filter(|&i| self.numbers[i].abs() > 1e-3).collect();
        let mut chosen: Vec<usize> = (0..4).map(|_| candidates[random.below(candidates.len())]).collect();
        if self.class == Class::Redundant {
            // Other numbers would contradict the redundant constraints.
            chosen.retain(|i| self.is_harmless(*i));
        }
        chosen.sort_unstable();
        chosen.dedup();
        chosen
    }

    /// Returns whether a number of a redundant mechanism keeps the constraints consistent.
    fn is_harmless(&self, number: usize) -> bool {
        let owner = self.parts.iter().rev().find_map(|part| match part {
            MechanismPart::Body { at } if *at <= number => Some((*at, true)),
            MechanismPart::Spring { at, .. } | MechanismPart::Torsion { at, .. } if *at <= number => Some((*at, true)),
            MechanismPart::Crank { length, at } if *at <= number || *length == number => Some((*at, *length == number)),
            MechanismPart::Gears { at, .. } | MechanismPart::Revolute { at, .. } if *at <= number => Some((*at, false)),
            _ => None,
        });
        let is_crank_length =
            self.parts.iter().any(|p| matches!(p, MechanismPart::Crank { length, .. } if *length == number));
        match owner {
            _ if is_crank_length => true,
            // Mass, inertia and velocity of a body; not its position.
            Some((at, true)) => {
                let is_body = self.parts.iter().any(|p| matches!(p, MechanismPart::Body { at: a } if *a == at));
                !is_body || !(2..5).contains(&(number - at))
            }
            _ => false,
        }
    }

    fn pose(&self, frame: Frame) -> [f64; 3] {
        frame.map_or([0.0; 3], |k| self.poses[k])
    }

    /// Body-fixed coordinates of a point of the plane.
    fn local(&self, frame: Frame, [px, py]: [f64; 2]) -> [f64; 2] {
        let [x, y, theta] = self.pose(frame);
        let (sin, cos) = theta.sin_cos();
        let (dx, dy) = (px - x, py - y);
        [cos * dx + sin * dy, cos * dy - sin * dx]
    }

    /// Numbers of two points of frames that are the given points of the plane.
    fn markers(&self, frames: [Frame; 2], points: [[f64; 2]; 2]) -> Vec<f64> {
        (0..2).flat_map(|k| self.local(frames[k], points[k])).collect()
    }

    fn add_body(&mut self, random: &mut Random, pose: [f64; 3]) -> usize {
        let velocity = [0, 1, 2].map(|_| random.between(-1.0, 1.0));
        let (mass, inertia) = (random.between(0.5, 2.0), random.between(0.03, 0.3));
        let at = self.add_numbers(&[mass, inertia, pose[0], pose[1], pose[2], velocity[0], velocity[1], velocity[2]]);
        self.parts.push(MechanismPart::Body { at });
        self.poses.push(pose);
        self.poses.len() - 1
    }

    fn random_pose(random: &mut Random) -> [f64; 3] {
        [random.between(-0.8, 0.8), random.between(-0.8, 0.8), random.between(-2.5, 2.5)]
    }

    /// Chains and loops of joints with forces.
    fn chains(&mut self, random: &mut Random) {
        let has_drives = matches!(self.class, Class::Rigid | Class::Contact | Class::Flexible);
        let is_floating = self.class == Class::Floating;
        if has_drives && random.chance(0.4) {
            let (profile, numbers) = random_motion(random, 0.2, 0.2);
            let at = self.add_numbers(&[0.2, random.between(-0.4, 0.4)]);
            self.add_numbers(&numbers);
            self.parts.push(MechanismPart::Cart { at, profile });
            self.poses.push([0.2, self.numbers[at + 1], 0.0]);
        }
        let first = self.poses.len();
        for _ in 0..1 + random.below(3) {
            let pose = Self::random_pose(random);
            let body = self.add_body(random, pose);
            let others: Vec<Frame> = (0..body).map(Some).collect();
            let parent = match others.len() {
                0 if is_floating => continue,
                0 => None,
                _ if !is_floating && random.chance(0.3) => None,
                count => others[random.below(count)],
            };
            self.join(random, [parent, Some(body)]);
            if matches!(self.class, Class::Static) || random.chance(0.3) {
                self.torsion(random, [parent, Some(body)]);
            }
        }
        let bodies: Vec<usize> = (first..self.poses.len()).collect();
        let any = |random: &mut Random| bodies[random.below(bodies.len())];
        if random.chance(0.5) && (!is_floating || bodies.len() > 1) {
            let (a, b) = (any(random), any(random));
            let other = if a != b {
                Some(b)
            } else if is_floating {
                return;
            } else {
                None
            };
            self.close(random, [other, Some(a)]);
        }
        if has_drives && random.chance(0.6) {
            let body = any(random);
            self.drive(random, body);
        }
        for _ in 0..1 + random.below(3) {
            let (a, b) = (any(random), any(random));
            let other = if a == b && !is_floating { None } else { Some(b) };
            if other != Some(a) {
                self.force(random, [other, Some(a)]);
            }
        }
        if self.class == Class::Contact {
            let body = any(random);
            self.contact(random, body);
        }
    }

    /// Connects two bodies, which may be anywhere.
    fn join(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let point = |random: &mut Random| [random.between(-0.8, 0.8), random.between(-0.8, 0.8)];
        let (p, q) = (point(random), point(random));
        let [theta_a, theta_b] = frames.map(|frame| self.pose(frame)[2]);
        match random.below(20) {
            0..=9 => {
                let at = self.markers(frames, [p, p]);
                let at = self.add_numbers(&at);
                self.parts.push(MechanismPart::Revolute { frames, at });
            }
            10..=12 => {
                let mut numbers = self.markers(frames, [p, q]);
                let line = (q[1] - p[1]).atan2(q[0] - p[0]) - theta_a;
                numbers.insert(2, line);
                numbers.push(theta_b - theta_a);
                let at = self.add_numbers(&numbers);
                self.parts.push(MechanismPart::Prismatic { frames, at });
            }
            13..=14 => self.slot(frames, p, q),
            15..=16 => self.distance_constraint(frames, p, q),
            17 => {
                let mut numbers = self.markers(frames, [p, p]);
                numbers.push(theta_b - theta_a);
                let at = self.add_numbers(&numbers);
                self.parts.push(MechanismPart::Fixed { frames, at });
            }
            _ => self.bushing(random, frames),
        }
    }

    fn slot(&mut self, frames: [Frame; 2], p: [f64; 2], q: [f64; 2]) {
        let mut numbers = self.markers(frames, [p, q]);
        numbers.insert(2, (q[1] - p[1]).atan2(q[0] - p[0]) - self.pose(frames[0])[2]);
        let at = self.add_numbers(&numbers);
        self.parts.push(MechanismPart::Slot { frames, at });
    }

    fn distance_constraint(&mut self, frames: [Frame; 2], p: [f64; 2], q: [f64; 2]) {
        let mut numbers = self.markers(frames, [p, q]);
        numbers.push((q[0] - p[0]).hypot(q[1] - p[1]));
        let at = self.add_numbers(&numbers);
        self.parts.push(MechanismPart::Rod { frames, at });
    }

    fn bushing(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let p = [random.between(-0.5, 0.5), random.between(-0.5, 0.5)];
        let mut numbers = self.markers(frames, [p, p]);
        numbers.extend([0, 1, 2].map(|k| random.between(20.0, 200.0) * if k == 2 { 0.1 } else { 1.0 }));
        let damping = if self.is_conservative() { 0.0 } else { 1.0 };
        numbers.extend([0, 1, 2].map(|_| damping * random.between(0.1, 1.0)));
        let at = self.add_numbers(&numbers);
        self.parts.push(MechanismPart::Bushing { frames, at });
    }

    fn is_conservative(&self) -> bool {
        matches!(self.class, Class::Conservative | Class::Floating)
    }

    /// Adds one constraint that closes a loop.
    fn close(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let point = |random: &mut Random| [random.between(-0.8, 0.8), random.between(-0.8, 0.8)];
        let (p, q) = (point(random), point(random));
        let is_floating = self.class == Class::Floating;
        match (random.below(6), frames) {
            (0, _) => self.slot(frames, p, q),
            (1, [Some(a), Some(b)]) => {
                let radii = [random.between(0.1, 0.3), random.between(0.1, 0.3)];
                let offset = radii[0] * self.poses[a][2] + radii[1] * self.poses[b][2];
                let at = self.add_numbers(&[radii[0], radii[1], offset]);
                if is_floating {
                    return self.distance_constraint(frames, p, q);
                }
                self.parts.push(MechanismPart::Gears { wheels: [a, b], carrier: None, at });
            }
            (2, [Some(a), Some(b)]) if !is_floating => {
                let (radius, direction) = (random.between(0.1, 0.3), random.between(-1.0, 1.0));
                let (u, v) = (self.poses[a], self.poses[b]);
                let (sin, cos) = f64::sin_cos(direction);
                let offset = (u[0] - v[0]) * cos + (u[1] - v[1]) * sin - radius * v[2];
                let at = self.add_numbers(&[radius, direction, offset]);
                self.parts.push(MechanismPart::Rack { rack: a, pinion: b, at });
            }
            (3, _) => {
                // The cam is the first frame; the follower is at the distance that the profile has there.
                let mut numbers = self.markers(frames, [p, q]);
                let distance = (q[0] - p[0]).hypot(q[1] - p[1]);
                if distance > 0.2 {
                    let psi = (q[1] - p[1]).atan2(q[0] - p[0]) - self.pose(frames[0])[2];
                    let (lift, phase) = (0.1, random.between(-1.0, 1.0));
                    let base = distance - lift * 0.5 * (1.0 - (psi - phase).cos());
                    numbers.extend([base, lift, phase]);
                    let at = self.add_numbers(&numbers);
                    self.parts.push(MechanismPart::Cam { frames, at });
                }
            }
            (4, _) if matches!(self.class, Class::Rigid | Class::Contact) => {
                let mut numbers = self.markers(frames, [p, q]);
                let distance = (q[0] - p[0]).hypot(q[1] - p[1]);
                let (amplitude, phase) = (0.1 * distance, random.between(0.2, 1.2));
                numbers.extend([distance - amplitude * f64::sin(phase), amplitude, random.between(2.0, 6.0), phase]);
                let at = self.add_numbers(&numbers);
                self.parts.push(MechanismPart::LengthDrive { frames, at });
            }
            _ => self.distance_constraint(frames, p, q),
        }
    }

    /// Drives the rotation of a body, absolute or relative to another one.
    fn drive(&mut self, random: &mut Random, body: usize) {
        if body > 0 && random.chance(0.4) {
            let other = random.below(body);
            let (profile, numbers) = random_motion(random, self.poses[body][2] - self.poses[other][2], 1.0);
            let at = self.add_numbers(&numbers);
            self.parts.push(MechanismPart::RelativeDrive { frames: [Some(other), Some(body)], profile, at });
        } else {
            let (profile, numbers) = random_motion(random, self.poses[body][2], 1.0);
            let at = self.add_numbers(&numbers);
            self.parts.push(MechanismPart::Drive { body, profile, at });
        }
    }

    fn torsion(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let [theta_a, theta_b] = frames.map(|frame| self.pose(frame)[2]);
        let damping = if self.is_conservative() { 0.0 } else { random.between(0.05, 0.5) };
        let scale = if self.class == Class::Static { 10.0 } else { 1.0 };
        let rest = theta_b - theta_a + random.between(-0.3, 0.3);
        let at = self.add_numbers(&[scale * random.between(2.0, 10.0), damping, rest, random.between(0.1, 1.0)]);
        self.parts.push(MechanismPart::Torsion { frames, at });
    }

    fn force(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let point = |random: &mut Random| [random.between(-0.8, 0.8), random.between(-0.8, 0.8)];
        let (p, q) = (point(random), point(random));
        let distance = (q[0] - p[0]).hypot(q[1] - p[1]);
        if distance < 0.2 {
            return self.torsion(random, frames);
        }
        let conservative = self.is_conservative();
        let kind = if conservative || self.class == Class::Static { random.below(2) } else { random.below(7) };
        let body = frames[1].expect("the second frame is a body");
        match kind {
            0 => {
                let mut numbers = self.markers(frames, [p, q]);
                let damping = if conservative { 0.0 } else { random.between(0.1, 2.0) };
                numbers.extend([random.between(5.0, 80.0), damping, distance * random.between(0.5, 1.1)]);
                numbers.push(random.between(0.5, 5.0));
                let at = self.add_numbers(&numbers);
                self.parts.push(MechanismPart::Spring { frames, at });
            }
            1 => self.torsion(random, frames),
            2 => {
                let at =
                    self.add_numbers(&[random.between(0.2, 1.0), random.between(0.3, 1.0), random.between(0.1, 0.5)]);
                self.parts.push(MechanismPart::Friction { frames, at });
            }
            3 => {
                let at = self.add_numbers(&[0.5, random.between(0.5, 2.0), random.between(2.0, 9.0), 0.3]);
                self.parts.push(MechanismPart::Load { frames, at });
            }
            4 => {
                let [x, y] = self.local(Some(body), p);
                let at = self.add_numbers(&[x, y, random.between(-2.0, 2.0), 0.5, 2.0, random.between(2.0, 9.0), 0.3]);
                self.parts.push(MechanismPart::Force { body, at });
            }
            5 => {
                let mut numbers = self.markers(frames, [p, q]);
                numbers.extend([0.7, random.between(1.0, 4.0), random.between(2.0, 9.0), 0.4]);
                let at = self.add_numbers(&numbers);
                self.parts.push(MechanismPart::Actuator { frames, at });
            }
            _ => self.bushing(random, frames),
        }
    }

    fn contact(&mut self, random: &mut Random, body: usize) {
        let [x, y, theta] = self.poses[body];
        if random.chance(0.5) {
            // Closed at the start by a little, or about to close.
            let at = self.add_numbers(&[
                random.between(200.0, 2000.0),
                random.between(0.05, 0.3),
                theta + random.between(-0.05, 0.02),
            ]);
            self.parts.push(MechanismPart::Stop { body, at });
        } else {
            let height = y + random.between(-0.08, 0.01);
            let at = self.add_numbers(&[
                0.01,
                0.02,
                x,
                height,
                std::f64::consts::FRAC_PI_2 + random.between(-0.2, 0.2),
                random.between(200.0, 3000.0),
                random.between(0.05, 0.3),
            ]);
            self.parts.push(MechanismPart::Wall { body, at });
        }
    }

    /// A platform on parallel cranks, or planets between two wheels.
    fn redundant(&mut self, random: &mut Random) {
        if random.chance(0.5) {
            let (length, angle) = (random.between(0.2, 0.5), random.between(0.4, 1.2));
            let pose = [length * angle.cos() + 0.4, length * angle.sin() + 0.1, 0.0];
            self.add_body(random, pose);
            let common = self.add_numbers(&[length]);
            for _ in 0..3 + random.below(2) {
                let foot = [random.between(-0.3, 1.0), random.between(-0.2, 0.2)];
                let centre = [foot[0] + 0.5 * length * angle.cos(), foot[1] + 0.5 * length * angle.sin(), angle];
                self.add_body(random, centre);
                let head = [foot[0] + length * angle.cos() - pose[0], foot[1] + length * angle.sin() - pose[1]];
                let at = self.add_numbers(&[foot[0], foot[1], head[0], head[1]]);
                self.parts.push(MechanismPart::Crank { length: common, at });
            }
            self.force(random, [None, Some(0)]);
        } else {
            // Sun, ring and carrier turn about the origin, planets about points of the carrier.
            let [sun, ring, carrier] = [0, 1, 2].map(|_| {
                let turn = random.between(-1.0, 1.0);
                let body = self.add_body(random, [0.0, 0.0, turn]);
                let at = self.add_numbers(&[0.0, 0.0, 0.0, 0.0]);
                self.parts.push(MechanismPart::Revolute { frames: [None, Some(body)], at });
                body
            });
            let [sun_radius, planet_radius] = [random.between(0.1, 0.3), random.between(0.05, 0.15)];
            let distance = sun_radius + planet_radius;
            for k in 0..3 {
                let place = self.poses[carrier][2] + f64::from(k) * 2.1;
                let at_carrier = [distance * place.cos(), distance * place.sin()];
                // The rotation of the planet follows from that of the sun; the ring's is consistent with the first planet.
                let turn = |radius: f64, theta: f64, carrier: f64| carrier - radius / planet_radius * (theta - carrier);
                let theta = turn(sun_radius, self.poses[sun][2], self.poses[carrier][2]);
                let planet = self.add_body(random, [at_carrier[0], at_carrier[1], theta]);
                let numbers = self.markers([Some(carrier), Some(planet)], [at_carrier, at_carrier]);
                let at = self.add_numbers(&numbers);
                self.parts.push(MechanismPart::Revolute { frames: [Some(carrier), Some(planet)], at });
                for (wheel, radius) in [(sun, sun_radius), (ring, -(sun_radius + 2.0 * planet_radius))] {
                    let relative = |body: usize| self.poses[body][2] - self.poses[carrier][2];
                    let offset = radius * relative(wheel) + planet_radius * relative(planet);
                    let at = self.add_numbers(&[radius, planet_radius, offset]);
                    self.parts.push(MechanismPart::Gears { wheels: [wheel, planet], carrier: Some(carrier), at });
                }
            }
            self.torsion(random, [None, Some(sun)]);
            self.torsion(random, [None, Some(carrier)]);
        }
    }

    /// A chain whose joints are all driven, and a crank that is driven and pulls a loop.
    fn driven(&mut self, random: &mut Random) {
        let mut parent = None;
        for _ in 0..1 + random.below(3) {
            let pose = Self::random_pose(random);
            let body = self.add_body(random, pose);
            let p = [random.between(-0.8, 0.8), random.between(-0.8, 0.8)];
            let numbers = self.markers([parent, Some(body)], [p, p]);
            let at = self.add_numbers(&numbers);
            self.parts.push(MechanismPart::Revolute { frames: [parent, Some(body)], at });
            let from = self.pose(parent)[2];
            let (profile, numbers) = random_motion(random, self.poses[body][2] - from, 1.0);
            let at = self.add_numbers(&numbers);
            self.parts.push(match parent {
                None if random.chance(0.5) => MechanismPart::Drive { body, profile, at },
                _ => MechanismPart::RelativeDrive { frames: [parent, Some(body)], profile, at },
            });
            if random.chance(0.5) {
                self.force(random, [parent, Some(body)]);
            }
            parent = Some(body);
        }
        if random.chance(0.6) {
            // A coupler and a slider in a fixed guide.
            let pose = Self::random_pose(random);
            let coupler = self.add_body(random, pose);
            let [p, q] = [0, 1].map(|_| [random.between(-0.8, 0.8), random.between(-0.8, 0.8)]);
            let numbers = self.markers([parent, Some(coupler)], [p, p]);
            let at = self.add_numbers(&numbers);
            self.parts.push(MechanismPart::Revolute { frames: [parent, Some(coupler)], at });
            let far = [q[0] + random.between(0.2, 0.5), q[1] + random.between(-0.3, 0.3)];
            self.slot([None, Some(coupler)], far, q);
        }
    }
}

impl ParametricMechanism for RandomMechanism {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut values: Vec<S> = self.numbers.iter().map(|&x| S::from(x)).collect();
        self.variables.iter().zip(b).for_each(|(&i, &x)| values[i] = x);
        let n = |at: usize, count: usize| -> &[S] { &values[at..at + count] };
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(values[0], values[1]);
        let mut bodies: Vec<Body> = Vec::new();
        let mut joints: Vec<(ElementIndex, &str)> = Vec::new();
        // The joints and forces among the parts.
        let mut elements: Vec<Option<ElementIndex>> = vec![None; self.parts.len()];
        let ground = m.ground();
        for (k, part) in self.parts.iter().enumerate() {
            let name = format!("part {k}");
            let of = |bodies: &[Body], frame: Frame| frame.map_or(ground, |k| bodies[k]);
            let ends = |bodies: &[Body], frames: [Frame; 2], at: usize| -> [Marker<S>; 2] {
                let [a, b] = frames.map(|frame| of(bodies, frame));
                [a.at(values[at], values[at + 1]), b.at(values[at + 2], values[at + 3])]
            };
            let turns = |bodies: &[Body], frames: [Frame; 2]| -> [Coordinate; 2] {
                frames.map(|frame| of(bodies, frame).theta)
            };
            match *part {
                MechanismPart::Body { at } => {
                    let p = n(at, 8);
                    let body = m.body(&name, p[0], p[1], Pose { x: p[2], y: p[3], theta: p[4] });
                    for (coordinate, velocity) in body.coordinates().into_iter().zip(&p[5..8]) {
                        m.set_velocity(coordinate, *velocity);
                    }
                    bodies.push(body);
                }
                MechanismPart::Cart { at, profile } => {
                    let body = m.massless_node(&name, Pose { x: values[at], y: values[at + 1], theta: zero });
                    prescribe(&mut m, body.x, profile, &values[at + 2..]);
                    m.fix(body.y);
                    m.fix(body.theta);
                    bodies.push(body);
                }
                MechanismPart::Revolute { frames, at } => {
                    let [a, b] = ends(&bodies, frames, at);
                    joints.push((m.revolute(&name, a, b), "force_x"));
                    elements[k] = Some(joints[joints.len() - 1].0);
                }
                MechanismPart::Prismatic { frames, at } => {
                    let (p, [a, b]) = (n(at, 6), frames.map(|frame| of(&bodies, frame)));
                    elements[k] = Some(m.prismatic(&name, a.at(p[0], p[1]), p[2], b.at(p[3], p[4]), p[5]));
                }
                MechanismPart::Slot { frames, at } => {
                    let (p, [a, b]) = (n(at, 5), frames.map(|frame| of(&bodies, frame)));
                    joints.push((m.point_on_line(&name, a.at(p[0], p[1]), p[2], b.at(p[3], p[4])), "force"));
                    elements[k] = Some(joints[joints.len() - 1].0);
                }
                MechanismPart::Rod { frames, at } => {
                    let [a, b] = ends(&bodies, frames, at);
                    joints.push((m.distance_constraint(&name, a, b, values[at + 4]), "tension"));
                    elements[k] = Some(joints[joints.len() - 1].0);
                }
                MechanismPart::Fixed { frames, at } => {
                    let [a, b] = ends(&bodies, frames, at);
                    elements[k] = Some(m.fixed_joint(&name, a, b, values[at + 4]));
                }
                MechanismPart::Gears { wheels, carrier, at } => {
                    let p = n(at, 3);
                    let wheels = wheels.map(|k| bodies[k].theta);
                    m.gear_pair(&name, wheels, of(&bodies, carrier).theta, [p[0], p[1], p[2]]);
                }
                MechanismPart::Rack { rack, pinion, at } => {
                    let p = n(at, 3);
                    m.rack(&name, bodies[rack], bodies[pinion], [p[0], p[1], p[2]]);
                }
                MechanismPart::Cam { frames, at } => {
                    let ([a, b], p) = (ends(&bodies, frames, at), n(at + 4, 3));
                    joints.push((m.cam_follower(&name, a, b, [p[0], p[1], p[2]]), "force"));
                }
                MechanismPart::Drive { body, profile, at } => {
                    let coordinate = bodies[body].theta;
                    prescribe(&mut m, coordinate, profile, &values[at..]);
                }
                MechanismPart::RelativeDrive { frames, profile, at } => {
                    let [a, b] = turns(&bodies, frames);
                    let index = match profile {
                        Profile::Harmonic => m.driver(&name, a, b, Harmonic, n(at, 4)),
                        Profile::Accelerated => m.driver(&name, a, b, Accelerated, n(at, 3)),
                        Profile::StartUp => m.driver(&name, a, b, StartUp::Polynomial, n(at, 3)),
                    };
                    joints.push((index, "driving_force"));
                }
                MechanismPart::LengthDrive { frames, at } => {
                    let [a, b] = ends(&bodies, frames, at);
                    m.drive_length(&name, a, b, Harmonic, n(at + 4, 4));
                }
                MechanismPart::Spring { frames, at } => {
                    let ([a, b], p) = (ends(&bodies, frames, at), n(at + 4, 4));
                    elements[k] = Some(m.nonlinear_spring(&name, a, b, [p[0], p[1], p[2], p[3]]));
                }
                MechanismPart::Torsion { frames, at } => {
                    let ([a, b], p) = (turns(&bodies, frames), n(at, 4));
                    elements[k] = Some(m.coordinate_spring(&name, a, b, [p[0], p[1], p[2], p[3]]));
                }
                MechanismPart::Bushing { frames, at } => {
                    let ([a, b], p) = (ends(&bodies, frames, at), n(at + 4, 6));
                    elements[k] = Some(m.bushing(&name, a, b, [p[0], p[1], p[2]], [p[3], p[4], p[5]]));
                }
                MechanismPart::Friction { frames, at } => {
                    let ([a, b], p) = (turns(&bodies, frames), n(at, 3));
                    m.friction(&name, a, b, [p[0], p[1], p[2]]);
                }
                MechanismPart::JointFriction { joint, at } => {
                    let (on, p) = (elements[joint].expect("such a joint was chosen"), n(at, 4));
                    match self.parts[joint] {
                        MechanismPart::Revolute { .. } => m.revolute_friction(&name, on, [p[0], p[1], p[2], p[3]])?,
                        _ => m.guide_friction(&name, on, [p[0], p[2], p[1], p[3]])?,
                    };
                }
                MechanismPart::Load { frames, at } => {
                    let [a, b] = turns(&bodies, frames);
                    elements[k] = Some(m.load(&name, a, b, Harmonic, n(at, 4)));
                }
                MechanismPart::Force { body, at } => {
                    let p = n(at, 7);
                    elements[k] = Some(m.force(&name, bodies[body].at(p[0], p[1]), p[2], Harmonic, &p[3..]));
                }
                MechanismPart::Actuator { frames, at } => {
                    let [a, b] = ends(&bodies, frames, at);
                    elements[k] = Some(m.actuator(&name, a, b, Harmonic, n(at + 4, 4)));
                }
                MechanismPart::Stop { body, at } => {
                    let p = n(at, 3);
                    m.bump_stop(&name, ground.theta, bodies[body].theta, [p[0], p[1], p[2]]);
                }
                MechanismPart::Wall { body, at } => {
                    let p = n(at, 7);
                    m.wall_contact(&name, bodies[body].at(p[0], p[1]), [p[2], p[3]], p[4], [p[5], p[6]]);
                }
                MechanismPart::Ellipse { body, at } => {
                    let p = n(at, 6);
                    let points: Vec<[S; 2]> = (0..16)
                        .map(|k| f64::from(k) * std::f64::consts::TAU / 16.0)
                        .map(|angle| [p[2] * angle.cos(), p[3] * angle.sin()])
                        .collect();
                    let origin = ground.at(p[0], p[1]);
                    m.profile_contact(&name, origin, bodies[body].origin(), [zero, p[4], p[5]], &points);
                }
                MechanismPart::Beam { body, elements, at } => {
                    let p = n(at, 5);
                    let section = BeamSection::rectangular(p[3], p[4], 2e9, 0.3, 1500.0);
                    // The beam is built where its body is: a gap would strain it.
                    let owners = self.parts.iter().filter_map(|part| match part {
                        MechanismPart::Body { at } => Some((true, *at)),
                        MechanismPart::Cart { at, .. } => Some((false, *at)),
                        _ => None,
                    });
                    let (x, y, theta) = match owners.collect::<Vec<_>>()[body] {
                        (true, at) => (values[at + 2], values[at + 3], values[at + 4]),
                        (false, at) => (values[at], values[at + 1], zero),
                    };
                    let (sin, cos) = theta.sin_cos();
                    let root = [x + p[0] * cos - p[1] * sin, y + p[0] * sin + p[1] * cos];
                    let tip = [root[0] + p[2] * cos, root[1] + p[2] * sin];
                    let (nodes, _) = m.beam(&name, [root, tip], [None, None], elements, &section, Shear::Flexible);
                    m.fixed_joint(&format!("{name} clamp"), bodies[body].at(p[0], p[1]), nodes[0].origin(), zero);
                    bodies.push(nodes[elements]);
                }
                MechanismPart::Crank { length, at } => {
                    let (p, l, body) = (n(at, 4), values[length], bodies[bodies.len() - 1]);
                    m.revolute(&format!("{name} foot"), ground.at(p[0], p[1]), body.at(l * -0.5, zero));
                    m.revolute(&format!("{name} head"), body.at(l * 0.5, zero), bodies[0].at(p[2], p[3]));
                }
            }
        }
        let mut terms: Vec<WeightedQuantity<S>> = Vec::new();
        for (k, body) in bodies.iter().rev().take(2).enumerate() {
            let sensor = m.sensor(&format!("sensor {k}"), body.at(S::from(0.1), S::from(0.05)));
            for name in ["x", "y", "vy", "theta", "ax"] {
                let term = m.measure(sensor, name)?;
                m.output(format!("{name}{k}"), &[term]);
                terms.push(term);
            }
        }
        if self.class != Class::Redundant {
            for (k, (joint, name)) in joints.into_iter().take(1).enumerate() {
                let term = m.measure(joint, name)?;
                m.output(format!("reaction{k}"), &[term]);
                terms.push(term);
            }
        }
        for (k, event) in self.events.iter().enumerate() {
            let part = elements[event.part].expect("such a part was chosen");
            let action = if event.ends { Action::Deactivate(part) } else { Action::Activate(part) };
            m.when(format!("event {k}"), *event, &[terms[event.output]], &[action])?;
        }
        let (kinetic, potential) = (m.kinetic_energy(), m.potential_energy());
        m.output("energy", &[kinetic, potential]);
        if self.parts.is_empty() {
            return Err(Error::definition("random mechanism", "it has no parts", "take another seed"));
        }
        Ok(m)
    }
}
