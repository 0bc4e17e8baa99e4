//! The model file of a robot.

use super::parts::{Closure, JointType, Robot, RobotJoint};
use super::tree::{RigidPart, RobotTree};
use crate::model_file::expression::check_name;
use crate::model_file::toml_string;
use nalgebra::{Isometry3, Vector3};
use std::collections::HashSet;
use std::fmt::Write;

/// Velocity below which Coulomb friction fades, in m/s or rad/s.
const SPEED: f64 = 0.01;

/// Valid and unique names of the parts of a model.
#[derive(Default)]
struct PartNames {
    used: HashSet<String>,
}

impl PartNames {
    /// A valid name near `wanted` that no other part has.
    fn unique(&mut self, wanted: &str) -> String {
        let kept = wanted.chars().take(48).map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
        let mut name: String = kept.collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
            name.insert(0, 'n');
        }
        let mut count = 1;
        let mut candidate = name.clone();
        while self.used.contains(&candidate) || check_name(&candidate, 0..0).is_err() {
            count += 1;
            candidate = format!("{name}_{count}");
        }
        self.used.insert(candidate.clone());
        candidate
    }
}

/// Writes the model file of a robot that was read from the file `source`.
pub fn write(robot: &Robot, tree: &RobotTree, source: &str) -> String {
    let mut names = PartNames::default();
    let links: Vec<String> = robot.links.iter().map(|link| names.unique(&link.name)).collect();
    let joints: Vec<String> = robot
        .joints
        .iter()
        .map(|joint| {
            let is_used = names.used.contains(&joint.name);
            names.unique(&if is_used { format!("{}_joint", joint.name) } else { joint.name.clone() })
        })
        .collect();
    let mut text = String::new();
    let out = &mut text;
    line(out, &format!("# Made from {} by `linkwright import`.", comment(source)));
    robot.left_out.iter().for_each(|sentence| line(out, &format!("# * {}", comment(sentence))));
    line(out, "version = 2\nspace = 3");
    line(out, &format!("title = {}", toml_string(&comment(&robot.name))));
    line(out, &format!("gravity = {}", exact(robot.gravity)));
    line(out, "\n[time]\nto = 1\npoints = 101\n\n[analysis]\nkind = \"dynamics\"");
    for part in &tree.parts {
        body_with_points(out, part, (robot, tree), &links);
    }
    let frame = |link: usize| {
        let (part, place) = &tree.places[link];
        let name = if tree.parts[*part].is_ground { "ground" } else { &*links[tree.parts[*part].link] };
        (name, place)
    };
    for (joint, name) in robot.joints.iter().zip(&joints) {
        connect(out, joint, name, frame(joint.parent), frame(joint.child).0);
    }
    for closure in &robot.closures {
        let name = names.unique(&closure.name);
        close(out, closure, &name, closure.ends.map(|(link, _)| frame(link)));
    }
    for (k, joint) in robot.joints.iter().enumerate() {
        joint_forces(out, joint, &joints[k], &mut names);
        gears_of_mimic(out, robot, k, (&joints, &mut names));
    }
    for (k, joint) in robot.joints.iter().enumerate() {
        if let Some(own) = coordinate(joint, &joints[k]) {
            let unit = if joint.kind == JointType::Prismatic { "m" } else { "rad" };
            let name = names.unique(&format!("{}_position", joints[k]));
            line(out, &format!("\n[[output]]\nname = \"{name}\"\nvalue = \"{own}\"\nunit = \"{unit}\""));
        }
    }
    text
}

/// A rigid part as a body, and its other links as points of it.
fn body_with_points(out: &mut String, part: &RigidPart, (robot, tree): (&Robot, &RobotTree), links: &[String]) {
    let name = if part.is_ground { "ground" } else { &*links[part.link] };
    if !part.is_ground {
        body(out, name, part);
    }
    let root = part.is_ground.then_some(&part.link);
    for &link in root.into_iter().chain(&part.others) {
        let (_, place) = &tree.places[link];
        renamed(out, "link", &robot.links[link].name, &links[link]);
        line(out, &format!("[[point]]\nname = \"{}\"", links[link]));
        if !part.is_ground {
            line(out, &format!("body = \"{name}\""));
        }
        line(out, &format!("at = {}", vector(place.translation.vector)));
        orientation(out, place);
    }
}

fn body(out: &mut String, name: &str, part: &RigidPart) {
    line(out, &format!("\n[[body]]\nname = \"{name}\""));
    match &part.mass {
        None => line(out, "kind = \"massless-node\""),
        Some(data) => {
            let j = data.inertia;
            line(out, &format!("mass = {}", number(data.mass)));
            line(out, &format!("centre = {}", vector(data.centre)));
            line(out, &format!("inertia = {}", vector(j.diagonal())));
            let products = Vector3::new(j[(0, 1)], j[(1, 2)], j[(2, 0)]);
            if products.norm() > 0.0 {
                line(out, &format!("products = {}", exact(products)));
            }
        }
    }
    line(out, &format!("position = {}", vector(part.pose.translation.vector)));
    orientation(out, &part.pose);
}

/// A comment with the name in the robot, if the part has another one.
fn renamed(out: &mut String, kind: &str, old: &str, new: &str) {
    line(out, "");
    if old != new {
        line(out, &format!("# {kind} {}", comment(old)));
    }
}

/// The joint between a frame on a part and the frame of its child.
fn connect(out: &mut String, joint: &RobotJoint, name: &str, (parent, place): (&str, &Isometry3<f64>), child: &str) {
    let kind = match joint.kind {
        JointType::Revolute | JointType::Continuous => "revolute",
        JointType::Prismatic => "prismatic",
        JointType::Planar => "planar",
        JointType::Spherical => "spherical",
        JointType::Floating | JointType::Fixed => return,
    };
    renamed(out, "joint", &joint.name, name);
    limits(out, joint);
    let place = place * joint.origin;
    let (z, x) = (joint.axis, across(joint.axis));
    let axes = |z: Vector3<f64>, x: Vector3<f64>| format!("z = {}, x = {}", vector(z), vector(x));
    let [of_parent, of_child] = [axes(place.rotation * z, place.rotation * x), axes(z, x)];
    line(out, &format!("[[joint]]\nname = \"{name}\"\nkind = \"{kind}\""));
    line(out, &format!("a = {{ body = \"{parent}\", at = {}, {of_parent} }}", vector(place.translation.vector)));
    let at = if joint.anchor == Vector3::zeros() { String::new() } else { format!("at = {}, ", vector(joint.anchor)) };
    line(out, &format!("b = {{ body = \"{child}\", {at}{of_child} }}"));
}

/// The joint that closes a loop between frames on two parts.
fn close(out: &mut String, closure: &Closure, name: &str, frames: [(&str, &Isometry3<f64>); 2]) {
    renamed(out, "equality", &closure.name, name);
    let kind = if closure.is_fixed { "fixed" } else { "spherical" };
    line(out, &format!("[[joint]]\nname = \"{name}\"\nkind = \"{kind}\""));
    for ((end, (_, own)), (body, place)) in ["a", "b"].into_iter().zip(&closure.ends).zip(frames) {
        let pose = place * own;
        let axes = turned(&pose).map_or(String::new(), |axes| format!(", orientation = {axes}"));
        line(out, &format!("{end} = {{ body = \"{body}\", at = {}{axes} }}", vector(pose.translation.vector)));
    }
}

/// A comment with the limits of a joint, which the model does not enforce.
fn limits(out: &mut String, joint: &RobotJoint) {
    let mut all = vec![];
    all.extend(joint.range.map(|[lower, upper]| format!("position from {} to {}", number(lower), number(upper))));
    let names = ["force or torque", "velocity"];
    all.extend(
        joint.strength.iter().zip(names).filter_map(|(value, name)| Some(format!("{name} {}", number((*value)?)))),
    );
    if !all.is_empty() {
        line(out, &format!("# Limits: {}.", all.join(", ")));
    }
}

/// Spring, damping, friction and motor inertia of a joint.
fn joint_forces(out: &mut String, joint: &RobotJoint, name: &str, names: &mut PartNames) {
    let Some(coordinate) = coordinate(joint, name) else { return };
    let [stiffness, rest] = joint.spring;
    if joint.damping > 0.0 || stiffness > 0.0 {
        let own = names.unique(&format!("{name}_{}", if stiffness > 0.0 { "spring" } else { "damping" }));
        line(out, &format!("\n[[force]]\nname = \"{own}\"\nkind = \"coordinate-spring\"\nb = \"{coordinate}\""));
        line(out, &format!("stiffness = {}", number(stiffness)));
        if joint.damping > 0.0 {
            line(out, &format!("damping = {}", number(joint.damping)));
        }
        if stiffness > 0.0 && rest != 0.0 {
            line(out, &format!("unloaded = {}", number(rest)));
        }
    }
    if joint.armature > 0.0 {
        let own = names.unique(&format!("{name}_armature"));
        line(out, &format!("\n[[force]]\nname = \"{own}\"\nkind = \"inertia\"\ncoordinate = \"{coordinate}\""));
        line(out, &format!("inertia = {}", number(joint.armature)));
    }
    if joint.friction > 0.0 {
        let own = names.unique(&format!("{name}_friction"));
        line(out, &format!("\n[[force]]\nname = \"{own}\"\nkind = \"friction\"\nb = \"{coordinate}\""));
        line(out, &format!("coulomb_force = {}\nspeed = {}", number(joint.friction), number(SPEED)));
    }
}

/// Gears between joint number `k` and the one that it mimics, if there is one; `joints` are the names of all joints.
fn gears_of_mimic(out: &mut String, robot: &Robot, k: usize, (joints, names): (&[String], &mut PartNames)) {
    let joint = &robot.joints[k];
    let (Some(mimic), Some(own)) = (&joint.mimic, coordinate(joint, &joints[k])) else { return };
    let other = coordinate(&robot.joints[mimic.joint], &joints[mimic.joint]).unwrap_or_default();
    let name = names.unique(&format!("{}_mimic", joints[k]));
    line(out, &format!("\n[[joint]]\nname = \"{name}\"\nkind = \"gears\""));
    line(out, &format!("a = \"{own}\"\nb = \"{other}\""));
    let (radius, offset) = (number(-mimic.multiplier), number(mimic.offset));
    line(out, &format!("radius_a = 1\nradius_b = {radius}\noffset = {offset}"));
}

/// The coordinate of a joint with one degree of freedom.
fn coordinate(joint: &RobotJoint, name: &str) -> Option<String> {
    let measure = if joint.kind == JointType::Prismatic { "displacement" } else { "angle" };
    joint.kind.has_coordinate().then(|| format!("{name}.{measure}"))
}

/// A direction perpendicular to `z`, near the coordinate axis that is farthest from `z`.
fn across(z: Vector3<f64>) -> Vector3<f64> {
    let mut x = Vector3::zeros();
    x[z.iamin()] = 1.0;
    (x - z * z.dot(&x)).normalize()
}

fn orientation(out: &mut String, pose: &Isometry3<f64>) {
    if let Some(axes) = turned(pose) {
        line(out, &format!("orientation = {axes}"));
    }
}

/// The value of a key `orientation`; `None` for that of the world.
fn turned(pose: &Isometry3<f64>) -> Option<String> {
    let e = pose.rotation;
    let all = [e.w, e.i, e.j, e.k].map(number).join(", ");
    (e.angle() > 1e-15).then(|| format!("{{ euler_parameters = [{all}] }}"))
}

/// A vector with zeros in place of rounding errors.
fn vector(v: Vector3<f64>) -> String {
    exact(v.map(|x| if x.abs() <= 1e-15 * v.amax().max(1e-3) { 0.0 } else { x }))
}

fn exact(v: Vector3<f64>) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

fn number(x: f64) -> String {
    if x == 0.0 { "0".to_owned() } else { format!("{x:?}") }
}

fn comment(text: &str) -> String {
    text.chars().take(200).filter(|c| !c.is_control()).collect()
}

fn line(out: &mut String, text: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{text}");
}
