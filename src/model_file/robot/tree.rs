//! The tree of links: rigid parts, their masses, and poses at the start.

use super::inertia::MassData;
use super::parts::{JointType, Robot};
use crate::{Error, Result};
use nalgebra::Isometry3;

/// Support of the first link of a robot in a URDF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// It is part of the ground.
    Fixed,
    /// It is a body that moves freely.
    Free,
}

/// Links that do not move relative to each other.
pub struct RigidPart {
    /// The link whose frame is that of the part.
    pub link: usize,
    /// The other links.
    pub others: Vec<usize>,
    /// The joint that moves it.
    pub joint: Option<usize>,
    pub is_ground: bool,
    pub mass: Option<MassData>,
    /// Pose in the world at the start.
    pub pose: Isometry3<f64>,
}

/// A robot as a tree of rigid parts, parents first.
pub struct RobotTree {
    pub parts: Vec<RigidPart>,
    /// Part of each link, and the pose of the link in it.
    pub places: Vec<(usize, Isometry3<f64>)>,
    /// Positions of the joints at the start.
    pub start: Vec<f64>,
}

impl RobotTree {
    /// The tree of a robot. Adds what had to be changed to the list of the robot.
    pub fn of(robot: &mut Robot, base: Base) -> Result<Self> {
        let joints = ordered(robot)?;
        let start = start(robot)?;
        let root = robot.joints.get(joints.first().copied().unwrap_or(0)).map_or(0, |joint| joint.parent);
        let still = Isometry3::identity();
        let first = RigidPart {
            link: root,
            others: vec![],
            joint: None,
            is_ground: base == Base::Fixed,
            mass: robot.links[root].mass,
            pose: still,
        };
        let mut tree = Self { parts: vec![first], places: vec![(0, still); robot.links.len()], start };
        for k in joints {
            let joint = &robot.joints[k];
            let (part, place) = tree.places[joint.parent];
            let mass = robot.links[joint.child].mass;
            if joint.kind == JointType::Fixed {
                let place = place * joint.origin;
                let own = &mut tree.parts[part];
                own.others.push(joint.child);
                let moved = mass.map(|mass| mass.in_frame(&place));
                own.mass = match (own.mass, moved) {
                    (Some(a), Some(b)) => Some(a.and(&b)),
                    (a, b) => a.or(b),
                };
                tree.places[joint.child] = (part, place);
            } else {
                let pose = tree.parts[part].pose * place * joint.pose(tree.start[k]);
                tree.places[joint.child] = (tree.parts.len(), still);
                let part =
                    RigidPart { link: joint.child, others: vec![], joint: Some(k), is_ground: false, mass, pose };
                tree.parts.push(part);
            }
        }
        if tree.parts.iter().all(|part| part.is_ground) {
            let remedy = "let a joint move, or let the first link move freely (--free-base)";
            return Err(Error::definition(format!("robot `{}`", robot.name), "nothing moves", remedy));
        }
        tree.check_masses(robot)?;
        Ok(tree)
    }

    /// Checks that every moving part has a mass, and corrects inertia matrices that are impossible by rounding only.
    fn check_masses(&mut self, robot: &mut Robot) -> Result<()> {
        let mut carries: Vec<bool> = self.parts.iter().map(|part| part.mass.is_some()).collect();
        for k in (1..self.parts.len()).rev() {
            if let Some(joint) = self.parts[k].joint
                && carries[k]
            {
                carries[self.places[robot.joints[joint].parent].0] = true;
            }
        }
        for (k, part) in self.parts.iter_mut().enumerate().filter(|(_, part)| !part.is_ground) {
            let (name, joint) = (&robot.links[part.link].name, part.joint.map(|joint| &robot.joints[joint]));
            let what = joint.map_or(format!("link `{name}`"), |joint| format!("joint `{}`", joint.name));
            let is_free = joint.is_none_or(|joint| joint.kind == JointType::Floating);
            let Some(mass) = &mut part.mass else {
                if is_free || !carries[k] {
                    let why = if is_free {
                        format!("link `{name}` moves freely and has no mass")
                    } else {
                        format!("it moves link `{name}`, which has no mass and carries none")
                    };
                    let remedy = "give the link an <inertial>, or make its joint fixed";
                    return Err(Error::definition(what, why, remedy));
                }
                continue;
            };
            let with = if part.others.is_empty() { "" } else { " with what is fixed to it" };
            if let Some((why, remedy)) = mass.mistake() {
                let what = if is_free && joint.is_none() { what } else { format!("{what}, link `{name}`") };
                return Err(Error::definition(what + with, why, remedy));
            }
            let single = std::iter::once(&part.link).chain(&part.others).filter(|_| !part.others.is_empty());
            for link in single.map(|&link| &robot.links[link]) {
                robot.left_out.extend(link.mass.and_then(|mass| mass.mistake()).map(|(why, _)| {
                    format!(
                        "no body has the inertia of link `{}`, but the part to which it is fixed is possible: {why}",
                        link.name
                    )
                }));
            }
            if let Some(added) = mass.complete() {
                robot.left_out.push(format!(
                    "the largest moment of inertia of `{name}` is the sum of the others or exceeds it by rounding: all three \
                     were raised by {added:.1e} kg·m²"
                ));
            }
        }
        Ok(())
    }
}

/// Numbers of the joints, those nearest to the root first.
fn ordered(robot: &Robot) -> Result<Vec<usize>> {
    let mut above: Vec<Option<usize>> = vec![None; robot.links.len()];
    let mut below: Vec<Vec<usize>> = vec![vec![]; robot.links.len()];
    for (k, joint) in robot.joints.iter().enumerate() {
        if let Some(other) = above[joint.child] {
            let (name, other) = (&robot.links[joint.child].name, &robot.joints[other].name);
            let why = format!("link `{name}` is the child of joint `{other}`, too");
            let remedy = "robots are trees of links: remove one of the joints, and close the loop in the model file";
            return Err(Error::definition(format!("joint `{}`", joint.name), why, remedy));
        }
        above[joint.child] = Some(k);
        below[joint.parent].push(k);
    }
    let roots: Vec<usize> = (0..robot.links.len()).filter(|&link| above[link].is_none()).collect();
    if roots.len() > 1 {
        let names: Vec<String> = roots.iter().take(4).map(|&link| format!("`{}`", robot.links[link].name)).collect();
        let more = if roots.len() > 4 { ", …" } else { "" };
        let why = format!("{} of its links are no child of a joint: {}{more}", roots.len(), names.join(", "));
        let remedy = "connect them by joints, such as fixed or floating ones, to one tree";
        return Err(Error::definition(format!("robot `{}`", robot.name), why, remedy));
    }
    let mut order: Vec<usize> = roots.first().map_or(vec![], |&root| below[root].clone());
    let mut next = 0;
    while let Some(&joint) = order.get(next) {
        order.extend(&below[robot.joints[joint].child]);
        next += 1;
    }
    if order.len() < robot.joints.len() {
        let mut reached = vec![false; robot.joints.len()];
        order.iter().for_each(|&joint| reached[joint] = true);
        let first = reached.iter().position(|reached| !reached).unwrap_or(0);
        let what = format!("joint `{}`", robot.joints[first].name);
        let remedy = "robots are trees of links: remove a joint of the loop, and close it in the model file";
        return Err(Error::definition(what, "it belongs to a loop of links that is not connected to the root", remedy));
    }
    Ok(order)
}

/// Positions of the joints at the start: their own, or what `mimic` says.
fn start(robot: &Robot) -> Result<Vec<f64>> {
    let of = |first: usize| {
        let (mut k, mut scale, mut sum) = (first, 1.0, 0.0);
        for _ in 0..=robot.joints.len() {
            match &robot.joints[k].mimic {
                None => return Ok(sum + scale * robot.joints[k].start),
                Some(mimic) => {
                    sum += scale * mimic.offset;
                    scale *= mimic.multiplier;
                    k = mimic.joint;
                }
            }
        }
        let what = format!("`mimic` of joint `{}`", robot.joints[first].name);
        Err(Error::definition(what, "the joints follow each other in a circle", "let one of them move by itself"))
    };
    // Chains of joints that follow each other are short in practice; the work grows with the square of their length.
    let followers = robot.joints.iter().filter(|joint| joint.mimic.is_some()).count();
    if followers > 1000 {
        let why = format!("{followers} of its joints have `mimic`");
        return Err(Error::definition(format!("robot `{}`", robot.name), why, "write this model by hand"));
    }
    (0..robot.joints.len()).map(of).collect()
}
