//! Equality constraints: connected points, welded bodies, and joints that follow each other.

use super::bodies::{Bodies, WORLD};
use crate::model_file::robot::parts::{Closure, Mimic};
use crate::model_file::robot::xml::XmlElement;
use crate::{Error, Result};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::collections::HashMap;

/// Adds the constraints of an element `equality` to the joints of `bodies`. Returns those that close loops; others are named
/// in `left_out`.
pub fn read(section: &XmlElement, bodies: &mut Bodies<'_>, left_out: &mut Vec<String>) -> Result<Vec<Closure>> {
    let mut closures = vec![];
    for (k, element) in section.children.iter().enumerate() {
        let name = element.attribute("name").map_or_else(|| format!("{}_{}", element.name, k + 1), str::to_owned);
        let what = format!("equality `{name}`");
        if element.attribute("active") == Some("false") {
            left_out.push(format!("{what}, which is not active, was left out"));
            continue;
        }
        match &*element.name {
            "connect" | "weld" => closures.push(closing_joint(element, name, &what, bodies)?),
            "joint" => left_out.extend(follow(element, &what, bodies)?),
            _ => left_out.push(format!("{what}, a <{}>, was left out", element.name)),
        }
    }
    Ok(closures)
}

fn named(element: &XmlElement, what: &str, key: &str, known: &HashMap<String, usize>) -> Result<Option<usize>> {
    let Some(name) = element.attribute(key) else { return Ok(None) };
    let error = || {
        let kind = key.trim_end_matches(|c: char| c.is_ascii_digit());
        let unknown = Error::unknown(kind, name, known.keys().map(String::as_str));
        element.bad(what, &unknown.to_string(), "name one of this file")
    };
    known.get(name).copied().map(Some).ok_or_else(error)
}

fn closing_joint(element: &XmlElement, name: String, what: &str, bodies: &Bodies<'_>) -> Result<Closure> {
    let is_fixed = element.name == "weld";
    let sites = [named(element, what, "site1", &bodies.sites)?, named(element, what, "site2", &bodies.sites)?];
    if let [Some(a), Some(b)] = sites {
        return Ok(Closure { name, is_fixed, ends: [(a, Isometry3::identity()), (b, Isometry3::identity())] });
    }
    let Some(first) = named(element, what, "body1", &bodies.bodies)? else {
        return Err(element.bad(what, "it has no attribute `body1`", "name a body"));
    };
    let second = named(element, what, "body2", &bodies.bodies)?.unwrap_or(WORLD);
    let apart = bodies.poses[first].inv_mul(&bodies.poses[second]);
    let anchor = Isometry3::from(Translation3::from(element.triple(what, "anchor")?.unwrap_or_else(Vector3::zeros)));
    let ends = if is_fixed {
        let pose = match element.attribute("relpose") {
            Some(text) => {
                let [x, y, z, w, i, j, k] = element.exactly(what, "relpose", text)?;
                let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-12);
                rotation.map(|rotation| Isometry3::from_parts(Translation3::new(x, y, z), rotation))
            }
            None => None,
        };
        // The anchor is a point of the second body. `relpose` places this point, and not the second body.
        [(first, pose.unwrap_or(apart * anchor)), (second, anchor)]
    } else {
        [(first, anchor), (second, apart.inv_mul(&anchor))]
    };
    Ok(Closure { name, is_fixed, ends })
}

/// Lets a joint follow another one. Returns a sentence if that is not possible.
fn follow(element: &XmlElement, what: &str, bodies: &mut Bodies<'_>) -> Result<Option<String>> {
    let Some(own) = named(element, what, "joint1", &bodies.joint_names)? else {
        return Err(element.bad(what, "it has no attribute `joint1`", "name a joint"));
    };
    let other = named(element, what, "joint2", &bodies.joint_names)?;
    let text = element.attribute("polycoef").unwrap_or("0 1 0 0 0");
    let all = element.numbers(what, "polycoef", text)?;
    let coefficient = |k: usize| all.get(k).copied().unwrap_or(if k == 1 { 1.0 } else { 0.0 });
    let (offset, multiplier) = (coefficient(0), coefficient(1));
    let is_linear = multiplier != 0.0 && all.iter().skip(2).all(|c| *c == 0.0);
    let has_coordinates = |joint: usize| bodies.joints[joint].kind.has_coordinate();
    match other {
        Some(joint) if is_linear && joint != own && has_coordinates(own) && has_coordinates(joint) => {
            let twice = bodies.joints[own].mimic.replace(Mimic { joint, multiplier, offset }).is_some();
            Ok(twice.then(|| format!("an earlier constraint of joint `{}` was left out", bodies.joints[own].name)))
        }
        _ => Ok(Some(format!("{what}, which is no linear function of another joint, was left out"))),
    }
}
