//! Masses of shapes: spheres, capsules, cylinders, ellipsoids and boxes.

use super::settings::{MjcfSettings, along};
use crate::Result;
use crate::model_file::robot::inertia::MassData;
use crate::model_file::robot::xml::XmlElement;
use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};
use std::f64::consts::PI;

/// Density of shapes without one, in kg/m³.
const DENSITY: f64 = 1000.0;

/// Mass, centre and inertia of a shape in the frame of its body; `None` if it has no mass.
pub fn mass(geom: &XmlElement, settings: &MjcfSettings, what: &str) -> Result<Option<MassData>> {
    let kind = geom.attribute("type").unwrap_or(if geom.attribute("mesh").is_some() { "mesh" } else { "sphere" });
    let group = geom.number(what, "group")?.unwrap_or(0.0);
    let given = geom.number(what, "mass")?;
    let density = geom.number(what, "density")?.unwrap_or(DENSITY);
    let is_counted = (settings.groups[0]..=settings.groups[1]).contains(&group);
    if matches!(kind, "plane" | "hfield") || !is_counted || given.unwrap_or(density) == 0.0 {
        return Ok(None);
    }
    if given.unwrap_or(density) < 0.0 {
        return Err(geom.bad(what, "its mass or density is negative", "give a positive one"));
    }
    if geom.attribute("mesh").is_some() || !matches!(kind, "sphere" | "capsule" | "cylinder" | "ellipsoid" | "box") {
        let remedy = "give the body an <inertial>, such as that which MuJoCo computes";
        return Err(geom.bad(what, &format!("the mass of a shape of type `{kind}` is not known"), remedy));
    }
    if geom.attribute("shellinertia") == Some("true") {
        return Err(geom.bad(what, "its mass is in its surface (`shellinertia`)", "give the body an <inertial>"));
    }
    let text = geom.attribute("size").unwrap_or_default();
    let mut size = geom.numbers(what, "size", text)?;
    let mut pose = settings.pose(geom, what)?;
    if let Some(text) = geom.attribute("fromto").filter(|_| kind != "sphere") {
        let [a, b, c, d, e, f] = geom.exactly(what, "fromto", text)?;
        let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
        let length = (from - to).norm();
        if !(length > 1e-12) {
            return Err(geom.bad(what, "`fromto` has length zero", "give two points"));
        }
        pose = Isometry3::from_parts(Translation3::from((from + to) * 0.5), along((from - to) / length));
        size.truncate(1);
        if matches!(kind, "ellipsoid" | "box") {
            size.extend(size.first().copied());
        }
        size.push(0.5 * length);
    }
    let count = match kind {
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        _ => 3,
    };
    if size.len() < count || size[..count].iter().any(|size| !(*size > 0.0)) {
        let why = format!("a {kind} has {count} positive sizes, and `size` is `{text}`");
        return Err(geom.bad(what, &why, "give them"));
    }
    let (volume, unit) = unit_inertia(kind, &size);
    let mass = given.unwrap_or(density * volume);
    let own = MassData { mass, centre: Vector3::zeros(), inertia: Matrix3::from_diagonal(&unit) * mass };
    Ok(Some(own.in_frame(&pose)))
}

/// Volume, and principal moments of inertia of a shape of the mass 1 about its centre.
///
/// # Sources
/// Beer & Johnston, *Vector Mechanics for Engineers* (2004), Appendix; a capsule is a cylinder and two half spheres.
fn unit_inertia(kind: &str, size: &[f64]) -> (f64, Vector3<f64>) {
    match *size {
        [r, ..] if kind == "sphere" => (4.0 / 3.0 * PI * r.powi(3), Vector3::repeat(0.4 * r * r)),
        [r, h, ..] if kind == "cylinder" => {
            let across = r * r / 4.0 + h * h / 3.0;
            (2.0 * PI * r * r * h, Vector3::new(across, across, 0.5 * r * r))
        }
        [r, h, ..] if kind == "capsule" => {
            let [middle, ends] = [2.0 * PI * r * r * h, 4.0 / 3.0 * PI * r.powi(3)];
            let volume = middle + ends;
            let across = middle * (r * r / 4.0 + h * h / 3.0) + ends * (0.4 * r * r + h * h + 0.75 * r * h);
            let along = middle * 0.5 * r * r + ends * 0.4 * r * r;
            (volume, Vector3::new(across, across, along) / volume)
        }
        [a, b, c, ..] => {
            let squares = Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b);
            if kind == "box" { (8.0 * a * b * c, squares / 3.0) } else { (4.0 / 3.0 * PI * a * b * c, squares / 5.0) }
        }
        _ => (0.0, Vector3::zeros()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capsule_is_between_a_cylinder_and_a_longer_one_and_ends_at_a_sphere() {
        let (volume, unit) = unit_inertia("capsule", &[0.1, 1e-9]);
        let (ball, sphere) = unit_inertia("sphere", &[0.1]);
        assert!((volume / ball - 1.0).abs() < 1e-7 && (unit - sphere).norm() < 1e-9);
        let [short, long] = [0.5, 0.6].map(|h| unit_inertia("cylinder", &[0.1, h]).1.x);
        let own = unit_inertia("capsule", &[0.1, 0.5]).1.x;
        assert!(short < own && own < long);
        // By integration over discs.
        let (mut mass, mut across) = (0.0, 0.0);
        let count = 200_000;
        for k in 0..count {
            let z = -0.6 + 1.2 * (f64::from(k) + 0.5) / f64::from(count);
            let beyond = (z.abs() - 0.5f64).max(0.0);
            let square = 0.01 - beyond * beyond;
            mass += PI * square * 1.2 / f64::from(count);
            across += PI * square * 1.2 / f64::from(count) * (square / 4.0 + z * z);
        }
        let (volume, unit) = unit_inertia("capsule", &[0.1, 0.5]);
        assert!((mass / volume - 1.0).abs() < 1e-8 && (across / mass / unit.x - 1.0).abs() < 1e-8);
    }
}
