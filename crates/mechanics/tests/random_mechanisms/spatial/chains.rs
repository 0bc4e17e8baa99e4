//! Chains, trees and loops in space, and what acts on them.

use crate::random::{Class, Profile, Random, random_motion};
use crate::spatial::{
    Action, Frame, Joint, JointMotion, MechanismPart, RandomMechanism3, difference, distance, orientation, point,
    random_pose,
};
use linkwright_mechanics::elements::spatial::LoadKind3;
use linkwright_mechanics::mechanism::Rotation;

/// Joints that bodies are joined by; hinges are the most frequent.
const JOINTS: [Joint; 14] = [
    Joint::Revolute,
    Joint::Revolute,
    Joint::Revolute,
    Joint::Revolute,
    Joint::Prismatic,
    Joint::Prismatic,
    Joint::Cylindrical,
    Joint::Screw,
    Joint::Planar,
    Joint::Fixed,
    Joint::Spherical,
    Joint::Spherical,
    Joint::Universal,
    Joint::Universal,
];

impl RandomMechanism3 {
    /// Chains and loops of joints with forces.
    pub(super) fn chains(&mut self, random: &mut Random) {
        let has_drives = matches!(self.class, Class::Rigid | Class::Contact | Class::Flexible);
        let is_floating = self.class == Class::Floating;
        for _ in 0..1 + random.below(3) {
            let pose = random_pose(random);
            let body = self.add_body(random, pose);
            let parent = match body {
                0 if is_floating => continue,
                0 => None,
                _ if !is_floating && random.chance(0.3) => None,
                count => Some(random.below(count)),
            };
            let joint = JOINTS[random.below(JOINTS.len())];
            self.join(random, joint, [parent, Some(body)]);
            if self.class == Class::Static {
                self.bushing(random, [parent, Some(body)]);
            }
        }
        let mut count = self.poses.len();
        if random.chance(0.3) {
            self.hang(random);
            // A point mass does not turn: a lever on it would hold it, and change the angular momentum.
            count += usize::from(!is_floating);
        }
        for along in self.coordinates.clone() {
            if self.class == Class::Static || random.chance(0.4) {
                self.on(random, along, Action::Spring);
            }
        }
        let other = |random: &mut Random, a: usize| match random.below(count) {
            b if b != a => Some(Some(b)),
            _ => (!is_floating).then_some(None),
        };
        if random.chance(0.5) {
            let a = random.below(count);
            if let Some(b) = other(random, a) {
                self.close(random, [b, Some(a)]);
            }
        }
        if has_drives && random.chance(0.6) && !self.coordinates.is_empty() {
            let (along, start) = self.coordinates[random.below(self.coordinates.len())];
            self.drive(random, along, start);
        }
        if self.class == Class::Contact && !self.coordinates.is_empty() {
            let along = self.coordinates[random.below(self.coordinates.len())];
            self.on(random, along, Action::Stop);
        }
        if self.class == Class::Contact {
            let a = random.below(count);
            match other(random, a) {
                Some(b) if random.chance(0.6) => self.sphere_contact(random, [b, Some(a)]),
                Some(b) => self.rope(random, [b, Some(a)]),
                None => {}
            }
        }
        if self.class == Class::Flexible {
            let body = random.below(count);
            let at = self.add_numbers(&point(random).map(|x| 0.2 * x));
            self.add_numbers(&[random.between(0.3, 0.6), random.between(-0.1, 0.1), 0.03, 0.02]);
            self.parts.push(MechanismPart::Beam { body, elements: 2 + random.below(2), at });
        }
        for _ in 0..1 + random.below(3) {
            let a = random.below(count);
            if let Some(b) = other(random, a) {
                self.force(random, [b, Some(a)]);
            }
        }
    }

    /// Hangs a point mass on a body by a rod, or guides it along a line or plane of a body.
    fn hang(&mut self, random: &mut Random) {
        let parent = Some(random.below(self.poses.len()));
        let end = point(random);
        let mass = self.add_point_mass(random, end);
        let frames = [parent, Some(mass)];
        match random.below(3) {
            0 => self.join(random, Joint::PointOnLine, frames),
            1 => self.join(random, Joint::PointOnPlane, frames),
            _ => {
                let start = point(random);
                self.distance_constraint(frames, [start, end]);
            }
        }
        if self.class == Class::Static {
            let start = point(random);
            self.spring(random, frames, [start, end]);
            self.bushing_between(random, frames, end);
        }
    }

    /// Joins two bodies by markers that coincide, or that are apart along the axis of the joint.
    pub(super) fn join(&mut self, random: &mut Random, joint: Joint, frames: [Frame; 2]) {
        let a = point(random);
        let is_mass = frames[1].is_some_and(|k| self.is_point_mass(k));
        let mut b = if is_mass { self.poses[frames[1].unwrap_or(0)].position } else { point(random) };
        let apart = difference(a, b);
        let hint = [0; 3].map(|_| random.between(-1.0, 1.0));
        let axes = match joint {
            Joint::Planar | Joint::PointOnPlane => {
                // The axis z is normal to the line between the points.
                let Some(x) = (distance(a, b) > 0.1).then_some(apart) else { return };
                Rotation::from_x_z(x, hint)
            }
            Joint::Prismatic | Joint::Cylindrical | Joint::Screw | Joint::PointOnLine => {
                if distance(a, b) < 0.1 {
                    return;
                }
                Rotation::from_z_x(apart, hint)
            }
            _ => {
                b = a;
                orientation(random)
            }
        };
        let twist = match joint {
            Joint::Revolute | Joint::Cylindrical | Joint::Screw | Joint::Planar => random.between(-1.0, 1.0),
            _ => 0.0,
        };
        let other = match joint {
            Joint::Universal => axes.then(Rotation::about_x(std::f64::consts::FRAC_PI_2)),
            Joint::Spherical | Joint::PointOnLine | Joint::PointOnPlane => orientation(random),
            _ => axes.then(Rotation::about_z(twist)),
        };
        let at = self.add_numbers(&self.marker(frames[0], a, axes));
        self.add_numbers(&self.marker(frames[1], b, other));
        if joint == Joint::Screw {
            self.add_numbers(&[random.between(0.05, 0.3)]);
        }
        let number = self.joints;
        self.joints += 1;
        self.parts.push(MechanismPart::Joint { joint, frames, at });
        let (angle, displacement) =
            ((JointMotion::Angle(number), twist), (JointMotion::Displacement(number), distance(a, b)));
        match joint {
            Joint::Revolute | Joint::Planar => self.coordinates.push(angle),
            Joint::Prismatic => self.coordinates.push(displacement),
            Joint::Cylindrical => self.coordinates.extend([angle, displacement]),
            Joint::Screw => self.coordinates.push(if random.chance(0.5) { angle } else { displacement }),
            _ => {}
        }
    }

    fn is_point_mass(&self, body: usize) -> bool {
        let mut bodies = self
            .parts
            .iter()
            .filter(|part| matches!(part, MechanismPart::Body { .. } | MechanismPart::PointMass { .. }));
        matches!(bodies.nth(body), Some(MechanismPart::PointMass { .. }))
    }

    fn distance_constraint(&mut self, frames: [Frame; 2], [p, q]: [[f64; 3]; 2]) {
        let at = self.add_numbers(&self.points(frames, [p, q]));
        self.add_numbers(&[distance(p, q)]);
        self.parts.push(MechanismPart::Rod { frames, at });
    }

    /// Adds one or two constraints that close a loop.
    fn close(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let ends = [point(random), point(random)];
        match random.below(6) {
            0 => self.join(random, Joint::PointOnPlane, frames),
            1 => self.join(random, Joint::PointOnLine, frames),
            2 if !self.is_conservative() && self.coordinates.len() > 1 => {
                let (i, j) = (random.below(self.coordinates.len()), random.below(self.coordinates.len()));
                let ((a, p), (b, q)) = (self.coordinates[i], self.coordinates[j]);
                if a == b {
                    return;
                }
                let radii = [random.between(0.1, 0.3), random.between(0.1, 0.3)];
                let at = self.add_numbers(&[radii[0], radii[1], radii[0] * p + radii[1] * q]);
                self.parts.push(MechanismPart::Gears { along: [a, b], at });
            }
            3 if matches!(self.class, Class::Rigid | Class::Contact) => {
                let at = self.add_numbers(&self.points(frames, ends));
                let (length, phase) = (distance(ends[0], ends[1]), random.between(0.2, 1.2));
                let amplitude = 0.1 * length;
                self.add_numbers(&[length - amplitude * f64::sin(phase), amplitude, random.between(2.0, 6.0), phase]);
                self.parts.push(MechanismPart::LengthDrive { frames, at });
            }
            4 => self.join(random, Joint::Spherical, frames),
            _ => self.distance_constraint(frames, ends),
        }
    }

    fn drive(&mut self, random: &mut Random, along: JointMotion, start: f64) {
        if !self.driven.contains(&along) {
            let size = if matches!(along, JointMotion::Angle(_)) { 1.0 } else { 0.3 };
            let (profile, numbers) = random_motion(random, start, size);
            let at = self.add_numbers(&numbers);
            self.driven.push(along);
            self.parts.push(MechanismPart::On { along, action: Action::Drive(profile), at });
        }
    }

    /// Lets a spring, friction, a load or a stop act on the coordinate of a joint.
    pub(super) fn on(&mut self, random: &mut Random, (along, value): (JointMotion, f64), action: Action) {
        let scale = if matches!(along, JointMotion::Angle(_)) { 1.0 } else { 10.0 };
        let at = match action {
            Action::Spring => {
                let stiff = if self.class == Class::Static { 10.0 } else { 1.0 };
                let damping = if self.is_conservative() { 0.0 } else { random.between(0.05, 0.5) };
                let rest = value + random.between(-0.3, 0.3);
                self.add_numbers(&[scale * stiff * random.between(2.0, 10.0), damping, rest, random.between(0.1, 1.0)])
            }
            Action::Friction => {
                self.add_numbers(&[random.between(0.2, 1.0), random.between(0.3, 1.0), random.between(0.1, 0.5)])
            }
            Action::Load => self.add_numbers(&[0.5, random.between(0.5, 2.0), random.between(2.0, 9.0), 0.3]),
            Action::Stop => {
                let limit = value + random.between(-0.05, 0.02);
                self.add_numbers(&[scale * random.between(200.0, 2000.0), random.between(0.05, 0.3), limit])
            }
            Action::Drive(_) => return self.drive(random, along, value),
        };
        self.parts.push(MechanismPart::On { along, action, at });
    }

    /// A sphere on the second body that nearly touches, or presses on, a plane or a sphere of the first one.
    fn sphere_contact(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let (ends, axes) = ([point(random), point(random)], orientation(random));
        let (apart, depth) = (difference(ends[0], ends[1]), random.between(-0.05, 0.02));
        let normal = axes.rotate([0.0, 0.0, 1.0]);
        let above: f64 = (0..3).map(|k| apart[k] * normal[k]).sum();
        let at = self.add_numbers(&self.marker(frames[0], ends[0], axes));
        self.add_numbers(&self.marker(frames[1], ends[1], axes));
        let law =
            [random.between(2e3, 2e4), random.between(0.05, 0.3), random.between(0.1, 0.6), random.between(0.1, 0.5)];
        let radius = if above > 0.1 { above + depth } else { 0.5 * (distance(ends[0], ends[1]) + depth) };
        self.add_numbers(&[&[radius.max(0.02)], &law[..], &[radius.max(0.02)]].concat());
        self.parts.push(match above > 0.1 {
            true => MechanismPart::SpherePlane { frames, at },
            false => MechanismPart::SphereSphere { frames, at },
        });
    }

    fn bushing(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let place = point(random);
        self.bushing_between(random, frames, place);
    }

    fn bushing_between(&mut self, random: &mut Random, frames: [Frame; 2], place: [f64; 3]) {
        let axes = orientation(random);
        let at = self.add_numbers(&self.marker(frames[0], place, axes));
        self.add_numbers(&self.marker(frames[1], place, axes));
        let stiff = if self.class == Class::Static { 3.0 } else { 1.0 };
        self.add_numbers(&[0; 3].map(|_| stiff * random.between(20.0, 200.0)));
        self.add_numbers(&[0; 3].map(|_| stiff * random.between(2.0, 20.0)));
        let damping = if self.is_conservative() { 0.0 } else { 1.0 };
        self.add_numbers(&[0; 6].map(|_| damping * random.between(0.1, 1.0)));
        self.parts.push(MechanismPart::Bushing { frames, at });
    }

    fn spring(&mut self, random: &mut Random, frames: [Frame; 2], ends: [[f64; 3]; 2]) {
        let at = self.add_numbers(&self.points(frames, ends));
        let damping = if self.is_conservative() { 0.0 } else { random.between(0.1, 2.0) };
        let rest = distance(ends[0], ends[1]) * random.between(0.5, 1.1);
        self.add_numbers(&[random.between(5.0, 80.0), damping, rest, random.between(0.5, 5.0)]);
        self.parts.push(MechanismPart::Spring { frames, at });
    }

    /// A rope that is taut or slack at the start.
    fn rope(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let ends = [point(random), point(random)];
        let at = self.add_numbers(&self.points(frames, ends));
        let length = distance(ends[0], ends[1]) * random.between(0.9, 1.1);
        self.add_numbers(&[random.between(50.0, 500.0), random.between(0.05, 0.3), length]);
        self.parts.push(MechanismPart::Rope { frames, at });
    }

    fn force(&mut self, random: &mut Random, frames: [Frame; 2]) {
        let ends = [point(random), point(random)];
        let conservative = self.is_conservative();
        let kind = if conservative || self.class == Class::Static { random.below(2) } else { random.below(6) };
        let along = match self.coordinates.len() {
            0 => None,
            count => Some(self.coordinates[random.below(count)]),
        };
        match (kind, along) {
            (0, _) if distance(ends[0], ends[1]) > 0.2 => self.spring(random, frames, ends),
            (2, Some(along)) => self.on(random, along, Action::Friction),
            (3, Some(along)) => self.on(random, along, Action::Load),
            (4 | 5, _) => {
                let kinds = [LoadKind3::Force, LoadKind3::FollowerForce, LoadKind3::Torque, LoadKind3::FollowerTorque];
                let body = frames[1].unwrap_or(0);
                let at = self.add_numbers(&self.marker(frames[1], ends[0], orientation(random)));
                self.add_numbers(&[0; 3].map(|_| random.between(0.2, 1.0)));
                self.add_numbers(&[0.5, random.between(0.5, 2.0), random.between(2.0, 9.0), 0.3]);
                self.parts.push(MechanismPart::Load { kind: kinds[random.below(4)], body, at });
            }
            _ => self.bushing(random, frames),
        }
    }

    /// A chain whose joints are all driven, with a mass on a guide that a rod pulls.
    pub(super) fn driven_chain(&mut self, random: &mut Random) {
        let joints =
            [Joint::Revolute, Joint::Revolute, Joint::Prismatic, Joint::Cylindrical, Joint::Screw, Joint::Fixed];
        let mut parent = None;
        for _ in 0..1 + random.below(3) {
            let pose = random_pose(random);
            let body = self.add_body(random, pose);
            let joint = joints[random.below(joints.len())];
            self.join(random, joint, [parent, Some(body)]);
            if random.chance(0.5) {
                self.force(random, [parent, Some(body)]);
            }
            parent = Some(body);
        }
        for (along, start) in self.coordinates.clone() {
            self.drive(random, along, start);
        }
        if random.chance(0.6) {
            let end = point(random);
            let mass = self.add_point_mass(random, end);
            self.join(random, Joint::PointOnLine, [None, Some(mass)]);
            let start = point(random);
            self.distance_constraint([parent, Some(mass)], [start, end]);
        }
    }

    /// A drive with an acceleration that begins at `start`.
    pub(super) fn accelerate(&mut self, random: &mut Random, along: JointMotion, start: f64) {
        let at = self.add_numbers(&[start, random.between(-1.0, 1.0), random.between(1.0, 5.0)]);
        self.parts.push(MechanismPart::On { along, action: Action::Drive(Profile::Accelerated), at });
    }
}
