//! Links and joints of a URDF file.
//!
//! # Sources
//! The specification of URDF: <https://wiki.ros.org/urdf/XML>.

use super::inertia::MassData;
use super::parts::{JointType, Link, Mimic, Robot, RobotJoint, changed, motion};
use super::xml::{Counts, XmlElement, shortened};
use crate::{Error, Result};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use std::collections::HashMap;

/// Types of joints by their words.
const TYPES: [(&str, JointType); 6] = [
    ("revolute", JointType::Revolute),
    ("continuous", JointType::Continuous),
    ("prismatic", JointType::Prismatic),
    ("planar", JointType::Planar),
    ("floating", JointType::Floating),
    ("fixed", JointType::Fixed),
];

/// Parts of links and joints that are read.
const KNOWN: [&str; 8] = ["inertial", "origin", "parent", "child", "axis", "limit", "dynamics", "mimic"];

/// Reads the outermost element of a file.
pub fn read(file: &str, root: &XmlElement) -> Result<Robot> {
    let is_macro = |element: &&XmlElement| element.namespace.as_ref().is_some_and(|space| space.contains("xacro"));
    if let Some(element) = root.descendants().find(is_macro) {
        let why = format!("{} is a xacro macro", element.place());
        return Err(Error::definition(file, why, "expand it first: xacro FILE > robot.urdf"));
    }
    let mut counts = Counts::default();
    let mut links = vec![];
    let mut numbers = HashMap::new();
    for node in root.all("link") {
        let name = node.text("link", "name")?.to_owned();
        insert_once(&mut numbers, node, &name, links.len())?;
        counts.add_all(node.children.iter().filter(|child| !KNOWN.contains(&&*child.name)));
        links.push(Link { mass: mass(node, &name)?, name });
    }
    let mut joints = vec![];
    let mut mimics = vec![];
    let mut by_name = HashMap::new();
    for node in root.all("joint") {
        let name = node.text("joint", "name")?.to_owned();
        insert_once(&mut by_name, node, &name, joints.len())?;
        counts.add_all(node.children.iter().filter(|child| !KNOWN.contains(&&*child.name)));
        mimics.extend(node.first("mimic").map(|mimic| (joints.len(), mimic)));
        joints.push(joint(node, name, &numbers, &links)?);
    }
    for (k, node) in mimics {
        let what = format!("`mimic` of joint `{}`", joints[k].name);
        let other = node.text(&what, "joint")?;
        let Some(&joint) = by_name.get(other) else {
            let error = Error::unknown("joint", other, joints.iter().map(|joint| &*joint.name));
            return Err(node.bad(&what, &error.to_string(), "name a joint of this file"));
        };
        let multiplier = node.number(&what, "multiplier")?.unwrap_or(1.0);
        if joint == k || multiplier == 0.0 {
            let why = format!("it follows joint `{other}` with the multiplier {multiplier}");
            let remedy = "let it follow another joint with a multiplier that is not zero, or fix it";
            return Err(node.bad(&what, &why, remedy));
        }
        let offset = node.number(&what, "offset")?.unwrap_or(0.0);
        joints[k].mimic = Some(Mimic { joint, multiplier, offset });
    }
    let held = hold(&mut joints);
    if links.is_empty() {
        return Err(Error::definition(file, "the robot has no link", "give a URDF file with links and joints"));
    }
    counts.add_all(root.children.iter().filter(|child| !matches!(&*child.name, "link" | "joint")));
    let name = root.attribute("name").unwrap_or("robot").to_owned();
    let left_out = counts.sentences().into_iter().chain(held).chain(changed(&joints)).collect();
    Ok(Robot { name, gravity: Vector3::new(0.0, 0.0, -9.81), links, joints, closures: vec![], left_out })
}

/// Fixes joints that follow fixed ones, and ignores `mimic` of joints that have no position. Returns what was changed.
fn hold(joints: &mut [RobotJoint]) -> Vec<String> {
    let mut sentences = vec![];
    // A joint that is fixed here may be followed by others.
    while let Some(k) = joints.iter().position(|joint| {
        joint
            .mimic
            .as_ref()
            .is_some_and(|mimic| !joint.kind.has_coordinate() || !joints[mimic.joint].kind.has_coordinate())
    }) {
        let Some(mimic) = joints[k].mimic.take() else { break };
        let (other, joint) = (joints[mimic.joint].name.clone(), &mut joints[k]);
        if joint.kind.has_coordinate() {
            sentences.push(format!("joint `{}` follows `{other}`, which has no position, and is fixed", joint.name));
            joint.origin *= motion(joint.kind, joint.axis, mimic.offset);
            joint.kind = JointType::Fixed;
        } else {
            sentences.push(format!("`mimic` of joint `{}`, which has no position, was left out", joint.name));
        }
    }
    sentences
}

fn joint(node: &XmlElement, name: String, numbers: &HashMap<String, usize>, links: &[Link]) -> Result<RobotJoint> {
    let what = format!("joint `{name}`");
    let word = node.text(&what, "type")?;
    let Some((_, kind)) = TYPES.into_iter().find(|(known, _)| *known == word) else {
        let known = TYPES.map(|(known, _)| known).join(", ");
        return Err(node.bad(&what, &format!("its type is `{}`", shortened(word, 40)), &format!("use one of {known}")));
    };
    let link = |end: &'static str| {
        let Some(inner) = node.first(end) else {
            return Err(node.bad(&what, &format!("it has no <{end}>"), "name the link"));
        };
        let link = inner.text(&what, "link")?;
        numbers.get(link).copied().ok_or_else(|| {
            let error = Error::unknown("link", link, links.iter().map(|link| &*link.name));
            inner.bad(&what, &error.to_string(), "name a link of this file")
        })
    };
    let (parent, own) = (link("parent")?, link("child")?);
    let axis = match node.first("axis") {
        Some(inner) => inner.triple(&what, "xyz")?.unwrap_or_else(Vector3::x),
        None => Vector3::x(),
    };
    let has_axis = !matches!(kind, JointType::Fixed | JointType::Floating);
    if has_axis && !(axis.norm() > 1e-9) {
        let why = format!("its axis {:?} has length zero", axis.as_slice());
        return Err(node.bad(&what, &why, "give a direction such as xyz=\"0 0 1\""));
    }
    let of = |element: &'static str, key: &str| node.first(element).map_or(Ok(None), |inner| inner.number(&what, key));
    let bounds = [of("limit", "lower")?, of("limit", "upper")?];
    let is_limited = matches!(kind, JointType::Revolute | JointType::Prismatic);
    let range = (is_limited && node.first("limit").is_some()).then(|| bounds.map(|bound| bound.unwrap_or(0.0)));
    if let Some([lower, upper]) = range
        && lower > upper
    {
        let why = format!("its lower limit {lower} is above the upper one {upper}");
        return Err(node.bad(&what, &why, "exchange them"));
    }
    let [damping, friction] = ["damping", "friction"].map(|key| of("dynamics", key));
    let (damping, friction) = (damping?.unwrap_or(0.0), friction?.unwrap_or(0.0));
    if damping < 0.0 || friction < 0.0 {
        let why = format!("its damping is {damping} and its friction {friction}");
        return Err(node.bad(&what, &why, "give numbers that are not negative"));
    }
    let start = range.map_or(0.0, |[lower, upper]: [f64; 2]| 0.0f64.max(lower).min(upper));
    let strength = [of("limit", "effort")?, of("limit", "velocity")?];
    let axis = if has_axis { axis.normalize() } else { Vector3::z() };
    let joint = RobotJoint::new(name, kind, [parent, own], pose(node, &what)?);
    Ok(RobotJoint { axis, start, range, strength, damping, friction, ..joint })
}

/// Mass, centre of mass and inertia of a link, in its frame.
fn mass(node: &XmlElement, name: &str) -> Result<Option<MassData>> {
    let what = format!("link `{name}`");
    let Some(inertial) = node.first("inertial") else { return Ok(None) };
    let Some(mass) = inertial.first("mass").map_or(Ok(None), |inner| inner.number(&what, "value"))? else {
        return Err(inertial.bad(&what, "its <inertial> has no mass", "add <mass value=\"…\"/> in kg"));
    };
    let entry = |key: &str| inertial.first("inertia").map_or(Ok(None), |inner| inner.number(&what, key));
    let [xx, yy, zz, xy, xz, yz] = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"].map(entry);
    let [xx, yy, zz, xy, xz, yz] = [xx?, yy?, zz?, xy?, xz?, yz?].map(|entry| entry.unwrap_or(0.0));
    let own = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    if mass == 0.0 {
        // A common way to declare a frame.
        return Ok(None);
    }
    if !(mass > 0.0) {
        let why = format!("its mass is {mass} kg");
        return Err(inertial.bad(&what, &why, "give a positive mass, or remove <inertial> if it is a frame"));
    }
    let frame = pose(inertial, &what)?;
    let rotation = frame.rotation.to_rotation_matrix();
    let (centre, rotation) = (frame.translation.vector, rotation.matrix());
    Ok(Some(MassData { mass, centre, inertia: rotation * own * rotation.transpose() }))
}

/// The pose in <origin>: a translation, and rotations about the fixed axes x, y, z.
fn pose(node: &XmlElement, what: &str) -> Result<Isometry3<f64>> {
    let Some(origin) = node.first("origin") else { return Ok(Isometry3::identity()) };
    let at = origin.triple(what, "xyz")?.unwrap_or_else(Vector3::zeros);
    let angles = origin.triple(what, "rpy")?.unwrap_or_else(Vector3::zeros);
    let rotation = UnitQuaternion::from_euler_angles(angles.x, angles.y, angles.z);
    Ok(Isometry3::from_parts(Translation3::from(at), rotation))
}

/// Stores the number of a link or joint under its name, which must be new.
fn insert_once(numbers: &mut HashMap<String, usize>, node: &XmlElement, name: &str, number: usize) -> Result<()> {
    let kind = &node.name;
    let why = format!("there are two {kind}s of this name");
    match numbers.insert(name.to_owned(), number) {
        Some(_) => Err(node.bad(&format!("{kind} `{name}`"), &why, "rename one")),
        None => Ok(()),
    }
}
