//! Joints and forces whose keys contradict each other, or have no effect.

use super::element_kinds::shared_keys;
use super::element_spec::{ElementSpec, InputSpec};
use super::markers::cosine;
use super::parts::{Axes, CoordinateRef, Direction, FrameRef, MarkerSpec, Parts, Vector};
use super::section::{Read, Section};
use mechanics::elements::Family;

/// Joints in space whose axes z are parallel.
const PARALLEL: &[&str] = &["revolute", "cylindrical", "planar", "prismatic", "fixed"];

/// The joint in space whose axes z are perpendicular.
const PERPENDICULAR: &str = "universal";

/// The end of a joint: the part to which it is attached.
#[derive(PartialEq)]
enum End {
    Frame(FrameRef),
    Coordinate(CoordinateRef),
}

/// Loads in space that are pure torques.
const TORQUES: &[&str] = &["torque", "follower-torque"];

/// Checks an element that has been read from `section`.
pub fn check(element: &ElementSpec, section: &Section<'_>, parts: &Parts) -> Read<()> {
    check_ends(element, section)?;
    check_torque(element, section, parts)?;
    let markers: Vec<&MarkerSpec> = element.inputs.iter().filter_map(marker).collect();
    match markers[..] {
        [a, b] if !shared_keys(element.kind.descriptor).is_empty() => {
            check_effects(section, [a, b])?;
            check_axes(element.kind.descriptor.kind, section, [a, b])
        }
        _ => Ok(()),
    }
}

fn marker(input: &InputSpec) -> Option<&MarkerSpec> {
    match input {
        InputSpec::Marker(marker) => Some(marker),
        _ => None,
    }
}

/// Checks that a joint does not join a part to itself.
fn check_ends(element: &ElementSpec, section: &Section<'_>) -> Read<()> {
    let descriptor = element.kind.descriptor;
    let end = |name: &str| {
        let k = descriptor.inputs.iter().position(|input| input.name == name)?;
        match element.inputs.get(k)? {
            InputSpec::Point(point) => Some(End::Frame(point.frame)),
            InputSpec::Marker(marker) => Some(End::Frame(marker.frame)),
            InputSpec::Coordinate(coordinate) => Some(End::Coordinate(*coordinate)),
            _ => None,
        }
    };
    let is_same = || end("a").zip(end("b")).is_some_and(|(a, b)| a == b);
    if descriptor.family != Family::Joint || !is_same() {
        return Ok(());
    }
    let message = format!("`a` and `b` of {} are the same part, which cannot move relative to itself", section.title);
    Err(section
        .error_at("b", message)
        .label("the same as `a`")
        .help("name the other body, or \"ground\"; or remove this joint"))
}

/// Checks that a torque does not act on a point mass.
fn check_torque(element: &ElementSpec, section: &Section<'_>, parts: &Parts) -> Read<()> {
    let is_point = |marker: &MarkerSpec| match marker.frame {
        FrameRef::Body(body) => parts.without_rotation.contains(&body),
        _ => false,
    };
    if !TORQUES.contains(&element.kind.descriptor.kind) || !element.inputs.iter().filter_map(marker).any(is_point) {
        return Ok(());
    }
    let message = format!("{} has no effect: a body of kind `point` does not turn", section.title);
    Err(section.error_at("at", message).help("let it act on a body of kind `rigid`, or remove it"))
}

/// Checks that each key for both points has an effect on at least one of them.
fn check_effects(section: &Section<'_>, [a, b]: [&MarkerSpec; 2]) -> Read<()> {
    let has_axis_b = section.has("axis_b");
    let keys = [
        ("at", a.is_world_place || b.is_world_place),
        ("axis", a.is_world_axes || (b.is_world_axes && !has_axis_b)),
        ("axis_b", b.is_world_axes),
        ("x", a.is_world_axes || b.is_world_axes),
    ];
    match keys.into_iter().find(|(key, has_effect)| section.has(key) && !has_effect) {
        Some((key, _)) => {
            let message = format!("`{key}` has no effect: the points that it is for have their own");
            Err(section.error_at(key, message).help(format!("remove `{key}`, or name a body only")))
        }
        None => Ok(()),
    }
}

/// The axis z, if it is given by its components.
fn given_z(axes: &Axes) -> Option<&Vector> {
    match axes {
        Axes::Z(Direction::Components(z), _) | Axes::Bent(_, Direction::Components(z)) => Some(z),
        _ => None,
    }
}

/// Tolerance for axes that are rounded in the file: cosine of their angle where it should be right, sine where it should be zero.
const ROUNDED: f64 = 1e-3;

/// Checks the angle between two axes that are given in world axes: with a wrong angle, the assembly would rotate a body.
fn check_axes(kind: &str, section: &Section<'_>, [a, b]: [&MarkerSpec; 2]) -> Read<()> {
    if !(a.is_world_axes && b.is_world_axes && section.has("axis")) {
        return Ok(());
    }
    let refused = |key: &str, message: &str, help: &str| {
        Err(section.error_at(key, format!("{}: {message}", section.title)).help(help.to_owned()))
    };
    if kind == PERPENDICULAR && !section.has("axis_b") {
        let message = "`axis_b` is missing: a universal joint has two axes, which are perpendicular";
        return refused("axis", message, "give the axis of `b` as `axis_b`");
    }
    let (Some(a), Some(b)) = (given_z(&a.axes), given_z(&b.axes)) else { return Ok(()) };
    let Some(cosine) = cosine(a, b) else { return Ok(()) };
    if kind == PERPENDICULAR && cosine.abs() > ROUNDED {
        let angle = cosine.abs().acos().to_degrees();
        let message = format!("the angle between its axes is {angle:.1}°, and that of a universal joint is 90°");
        return refused("axis_b", &message, "make `axis` and `axis_b` perpendicular");
    }
    if PARALLEL.contains(&kind) && 1.0 - cosine * cosine > ROUNDED * ROUNDED {
        let message = format!("the axes of `a` and `b` are the same in a {kind} joint");
        return refused("axis_b", &message, "remove `axis_b`");
    }
    Ok(())
}
