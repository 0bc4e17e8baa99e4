//! Mechanisms in space whose constraints depend on each other.

use crate::random::Random;
use crate::spatial::{Action, Joint, JointMotion, MechanismPart, RandomMechanism3, orientation, point};
use linkwright_mechanics::mechanism::{Pose3, Rotation};

impl RandomMechanism3 {
    /// A closed chain of bodies with parallel hinges, doors on two hinges, or a carriage on two guides.
    pub(super) fn redundant(&mut self, random: &mut Random) {
        let axes = orientation(random);
        let origin = point(random);
        match random.below(3) {
            0 => self.parallel_hinges(random, axes, origin),
            1 => self.pairs(random, Joint::Revolute, axes, origin),
            _ => self.pairs(random, Joint::Prismatic, axes, origin),
        }
        for along in self.coordinates.clone() {
            if random.chance(0.5) {
                let at = self.numbers.len();
                self.on(random, along, Action::Spring);
                self.harmless.extend(at..self.numbers.len());
            }
        }
        if random.chance(0.3) {
            let (along, start) = self.coordinates[0];
            let at = self.numbers.len();
            self.accelerate(random, along, start);
            self.harmless.extend(at..self.numbers.len());
        }
    }

    /// A body whose mass, centre and inertia may change.
    fn add_harmless_body(&mut self, random: &mut Random, pose: Pose3<f64>) -> usize {
        let at = self.numbers.len();
        let body = self.add_body(random, pose);
        self.harmless.extend(at..at + 10);
        body
    }

    /// Three to five bars in a loop, the last one fixed, with hinges along z of `axes`; lengths may change.
    fn parallel_hinges(&mut self, random: &mut Random, axes: Rotation<f64>, origin: [f64; 3]) {
        let count = 4 + random.below(2);
        let corners: Vec<[f64; 3]> = (0..count)
            .map(|k| {
                let angle = std::f64::consts::TAU * (k as f64 + random.between(-0.2, 0.2)) / count as f64;
                [0.5 * angle.cos(), random.between(0.3, 0.6) * angle.sin(), 0.0]
            })
            .collect();
        let plane = Pose3::new(origin, axes);
        let bars: Vec<_> = (0..count - 1)
            .map(|k| {
                let [a, b] = [corners[k], corners[k + 1]];
                let angle = (b[1] - a[1]).atan2(b[0] - a[0]);
                let turned = axes.then(Rotation::about_z(angle));
                (self.add_harmless_body(random, Pose3::new(plane.point(a), turned)), angle)
            })
            .collect();
        for k in 0..count {
            let frames = [k.checked_sub(1).map(|k| bars[k]), bars.get(k).copied()];
            let place = plane.point(corners[k]);
            let from = frames[0].map_or(0.0, |(_, angle)| angle);
            let to = frames[1].map_or(0.0, |(_, angle)| angle);
            let frames = frames.map(|frame| frame.map(|(body, _)| body));
            // The axes x of the markers are those of the bars; on the ground, that of the plane.
            let at = self.add_numbers(&self.marker(frames[0], place, axes.then(Rotation::about_z(from))));
            self.add_numbers(&self.marker(frames[1], place, axes.then(Rotation::about_z(to))));
            for (end, frame) in frames.into_iter().enumerate() {
                if frame.is_some() {
                    self.harmless.extend([at + 6 * end, at + 6 * end + 1]);
                }
            }
            self.coordinates.push((JointMotion::Angle(self.joints), to - from));
            self.joints += 1;
            self.parts.push(MechanismPart::Joint { joint: Joint::Revolute, frames, at });
        }
    }

    /// One or two bodies, each on two joints with a common axis.
    fn pairs(&mut self, random: &mut Random, joint: Joint, axes: Rotation<f64>, origin: [f64; 3]) {
        let mut parent = None;
        for _ in 0..1 + random.below(2) {
            let pair = Pose3::new(origin, axes.then(Rotation::about_x(random.between(-1.0, 1.0))));
            let pose = Pose3::new(point(random), orientation(random));
            let body = self.add_harmless_body(random, pose);
            for height in [0.0, random.between(0.3, 0.6)] {
                let place = pair.point([0.0, 0.0, height]);
                let at = self.add_numbers(&self.marker(parent, place, pair.orientation));
                self.add_numbers(&self.marker(Some(body), place, pair.orientation));
                let along = match joint {
                    Joint::Revolute => JointMotion::Angle(self.joints),
                    _ => JointMotion::Displacement(self.joints),
                };
                self.coordinates.push((along, 0.0));
                self.joints += 1;
                self.parts.push(MechanismPart::Joint { joint, frames: [parent, Some(body)], at });
            }
            parent = Some(body);
        }
    }
}
