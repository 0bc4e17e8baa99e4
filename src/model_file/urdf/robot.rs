//! Links and joints of a URDF file.

use super::inertia::MassData;
use crate::{Error, Result};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, HashMap};

/// A robot as its file describes it.
pub struct Robot {
    pub name: String,
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    /// Parts that the model will not have, one sentence each.
    pub left_out: Vec<String>,
}

/// A link: a rigid body, or a frame without mass.
pub struct Link {
    pub name: String,
    pub mass: Option<MassData>,
}

/// Type of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointType {
    Revolute,
    Continuous,
    Prismatic,
    Planar,
    Floating,
    Fixed,
}

impl JointType {
    const ALL: [(&'static str, Self); 6] = [
        ("revolute", Self::Revolute),
        ("continuous", Self::Continuous),
        ("prismatic", Self::Prismatic),
        ("planar", Self::Planar),
        ("floating", Self::Floating),
        ("fixed", Self::Fixed),
    ];

    /// True if it has one degree of freedom.
    pub fn has_coordinate(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous | Self::Prismatic)
    }
}

/// A joint. Its frame is that of the child where the joint is at zero.
pub struct Joint {
    pub name: String,
    pub kind: JointType,
    /// Links, by number.
    pub parent: usize,
    pub child: usize,
    /// Pose of the joint in the frame of the parent.
    pub origin: Isometry3<f64>,
    /// Unit vector in the frame of the joint.
    pub axis: Vector3<f64>,
    /// Smallest and largest position.
    pub range: Option<[f64; 2]>,
    /// Greatest force or torque, and velocity.
    pub strength: [Option<f64>; 2],
    pub damping: f64,
    pub friction: f64,
    pub mimic: Option<Mimic>,
}

/// Position of a joint as a linear function of that of another.
pub struct Mimic {
    /// The other joint, by number.
    pub joint: usize,
    pub multiplier: f64,
    pub offset: f64,
}

/// Parts of links and joints that are read.
const KNOWN: [&str; 8] = ["inertial", "origin", "parent", "child", "axis", "limit", "dynamics", "mimic"];

/// Reads a file.
pub fn read(file: &str, text: &str) -> Result<Robot> {
    let document = Document::parse(text).map_err(|error| {
        let remedy = match error {
            roxmltree::Error::DtdDetected => "remove the document type and write out its entities",
            _ => "repair the XML",
        };
        Error::definition(file, error.to_string(), remedy)
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        let why = format!("its outermost element is <{}>, and not <robot>", root.tag_name().name());
        return Err(Error::definition(file, why, "give a URDF file"));
    }
    let is_macro = |node: &Node<'_, '_>| node.tag_name().namespace().is_some_and(|space| space.contains("xacro"));
    if let Some(node) = root.descendants().find(is_macro) {
        let why = format!("line {} is a xacro macro", line(node));
        return Err(Error::definition(file, why, "expand it first: xacro FILE > robot.urdf"));
    }
    let mut counts = Counts::default();
    let mut links = vec![];
    let mut numbers = HashMap::new();
    for node in elements(root, "link") {
        let name = attribute(node, "link", "name")?.to_owned();
        insert_once(&mut numbers, node, &name, links.len())?;
        counts.of(node);
        links.push(Link { mass: mass(node, &name)?, name });
    }
    let mut joints = vec![];
    let mut mimics = vec![];
    let mut by_name = HashMap::new();
    for node in elements(root, "joint") {
        let name = attribute(node, "joint", "name")?.to_owned();
        insert_once(&mut by_name, node, &name, joints.len())?;
        counts.of(node);
        mimics.extend(child(node, "mimic").map(|mimic| (joints.len(), mimic)));
        joints.push(joint(node, name, &numbers, &links)?);
    }
    for (k, node) in mimics {
        let what = format!("`mimic` of joint `{}`", joints[k].name);
        let other = attribute(node, &what, "joint")?;
        let Some(&joint) = by_name.get(other) else {
            let error = Error::unknown("joint", other, joints.iter().map(|joint| &*joint.name));
            return Err(bad(node, &what, &error.to_string(), "name a joint of this file"));
        };
        let multiplier = number(node, &what, "multiplier")?.unwrap_or(1.0);
        if joint == k || multiplier == 0.0 {
            let why = format!("it follows joint `{other}` with the multiplier {multiplier}");
            let remedy = "let it follow another joint with a multiplier that is not zero, or fix it";
            return Err(bad(node, &what, &why, remedy));
        }
        let offset = number(node, &what, "offset")?.unwrap_or(0.0);
        joints[k].mimic = Some(Mimic { joint, multiplier, offset });
    }
    let held = hold(&mut joints);
    if links.is_empty() {
        return Err(Error::definition(file, "the robot has no link", "give a URDF file with links and joints"));
    }
    root.children().filter(Node::is_element).for_each(|node| match node.tag_name().name() {
        "link" | "joint" => {}
        _ => counts.add(node),
    });
    let name = root.attribute("name").unwrap_or("robot").to_owned();
    let left_out = counts.sentences().into_iter().chain(held).chain(changed(&joints)).collect();
    Ok(Robot { name, links, joints, left_out })
}

/// Fixes joints that follow fixed ones, and ignores `mimic` of joints that have no position. Returns what was changed.
fn hold(joints: &mut [Joint]) -> Vec<String> {
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

/// The motion of a joint at the position `q`.
pub fn motion(kind: JointType, axis: Vector3<f64>, q: f64) -> Isometry3<f64> {
    match kind {
        JointType::Prismatic => Isometry3::from_parts(Translation3::from(axis * q), UnitQuaternion::identity()),
        _ => Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(axis * q)),
    }
}

/// Sentences about what a model lacks, or has otherwise than the joints.
fn changed(joints: &[Joint]) -> Vec<String> {
    let count = |is: &dyn Fn(&Joint) -> bool| joints.iter().filter(|joint| is(joint)).count();
    let limits = count(&|joint| joint.range.is_some() || joint.strength.iter().any(Option::is_some));
    let rubbing = count(&|joint| joint.kind.has_coordinate() && joint.friction > 0.0);
    let has_many = |joint: &Joint| matches!(joint.kind, JointType::Planar | JointType::Floating);
    let lost = count(&|joint| has_many(joint) && (joint.damping > 0.0 || joint.friction > 0.0));
    let sentences = [
        (
            limits,
            "limits of joints ({}) are comments only: add forces of the kind `bump-stop` for positions that are reached",
        ),
        (rubbing, "Coulomb friction of joints ({}) fades below 0.01 rad/s or m/s, `speed` of the forces `friction`"),
        (lost, "damping and friction of planar and floating joints ({}) were left out"),
    ];
    let found = sentences.into_iter().filter(|(count, _)| *count > 0);
    found.map(|(count, text)| text.replace("{}", &count.to_string())).collect()
}

/// Numbers of the elements that are left out, by kind.
#[derive(Default)]
struct Counts(BTreeMap<String, usize>);

impl Counts {
    /// Counts the parts of a link or joint.
    fn of(&mut self, node: Node<'_, '_>) {
        let is_left_out = |name: &str| !KNOWN.contains(&name);
        node.children().filter(|n| n.is_element() && is_left_out(n.tag_name().name())).for_each(|n| self.add(n));
    }

    fn add(&mut self, node: Node<'_, '_>) {
        *self.0.entry(node.tag_name().name().to_owned()).or_default() += 1;
    }

    fn sentences(self) -> Vec<String> {
        self.0.into_iter().map(|(name, count)| format!("<{name}> ({count}) was left out")).collect()
    }
}

fn joint(node: Node<'_, '_>, name: String, numbers: &HashMap<String, usize>, links: &[Link]) -> Result<Joint> {
    let what = format!("joint `{name}`");
    let word = attribute(node, &what, "type")?;
    let Some((_, kind)) = JointType::ALL.into_iter().find(|(known, _)| *known == word) else {
        let known = JointType::ALL.map(|(known, _)| known).join(", ");
        return Err(bad(
            node,
            &what,
            &format!("its type is `{}`", shortened(word, 40)),
            &format!("take one of {known}"),
        ));
    };
    let link = |end: &'static str| {
        let Some(inner) = child(node, end) else {
            return Err(bad(node, &what, &format!("it has no <{end}>"), "name the link"));
        };
        let link = attribute(inner, &what, "link")?;
        numbers.get(link).copied().ok_or_else(|| {
            let error = Error::unknown("link", link, links.iter().map(|link| &*link.name));
            bad(inner, &what, &error.to_string(), "name a link of this file")
        })
    };
    let (parent, own) = (link("parent")?, link("child")?);
    let axis = match child(node, "axis") {
        Some(inner) => triple(inner, &what, "xyz")?.unwrap_or_else(Vector3::x),
        None => Vector3::x(),
    };
    let has_axis = !matches!(kind, JointType::Fixed | JointType::Floating);
    if has_axis && !(axis.norm() > 1e-9) {
        let why = format!("its axis {:?} has length zero", axis.as_slice());
        return Err(bad(node, &what, &why, "give a direction such as xyz=\"0 0 1\""));
    }
    let of =
        |element: &'static str, key: &str| child(node, element).map_or(Ok(None), |inner| number(inner, &what, key));
    let bounds = [of("limit", "lower")?, of("limit", "upper")?];
    let is_limited = matches!(kind, JointType::Revolute | JointType::Prismatic);
    let range = (is_limited && child(node, "limit").is_some()).then(|| bounds.map(|bound| bound.unwrap_or(0.0)));
    if let Some([lower, upper]) = range
        && lower > upper
    {
        let why = format!("its lower limit {lower} is above the upper one {upper}");
        return Err(bad(node, &what, &why, "exchange them"));
    }
    let [damping, friction] = ["damping", "friction"].map(|key| of("dynamics", key));
    let (damping, friction) = (damping?.unwrap_or(0.0), friction?.unwrap_or(0.0));
    if damping < 0.0 || friction < 0.0 {
        let why = format!("its damping is {damping} and its friction {friction}");
        return Err(bad(node, &what, &why, "give numbers that are not negative"));
    }
    Ok(Joint {
        kind,
        parent,
        child: own,
        origin: pose(node, &what)?,
        axis: if has_axis { axis.normalize() } else { Vector3::z() },
        range,
        strength: [of("limit", "effort")?, of("limit", "velocity")?],
        damping,
        friction,
        mimic: None,
        name,
    })
}

/// Mass, centre of mass and inertia of a link, in its frame.
fn mass(node: Node<'_, '_>, name: &str) -> Result<Option<MassData>> {
    let what = format!("link `{name}`");
    let Some(inertial) = child(node, "inertial") else { return Ok(None) };
    let Some(mass) = child(inertial, "mass").map_or(Ok(None), |inner| number(inner, &what, "value"))? else {
        return Err(bad(inertial, &what, "its <inertial> has no mass", "add <mass value=\"…\"/> in kg"));
    };
    let entry = |key: &str| child(inertial, "inertia").map_or(Ok(None), |inner| number(inner, &what, key));
    let [xx, yy, zz, xy, xz, yz] = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"].map(entry);
    let [xx, yy, zz, xy, xz, yz] = [xx?, yy?, zz?, xy?, xz?, yz?].map(|entry| entry.unwrap_or(0.0));
    let own = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    if mass == 0.0 {
        // A usual way to write a frame.
        return Ok(None);
    }
    if !(mass > 0.0) {
        let why = format!("its mass is {mass} kg");
        return Err(bad(inertial, &what, &why, "give a positive mass, or remove <inertial> if it is a frame"));
    }
    let frame = pose(inertial, &what)?;
    let rotation = frame.rotation.to_rotation_matrix();
    let (centre, rotation) = (frame.translation.vector, rotation.matrix());
    Ok(Some(MassData { mass, centre, inertia: rotation * own * rotation.transpose() }))
}

/// The pose in <origin>: a translation, and rotations about the fixed axes x, y, z.
fn pose(node: Node<'_, '_>, what: &str) -> Result<Isometry3<f64>> {
    let Some(origin) = child(node, "origin") else { return Ok(Isometry3::identity()) };
    let at = triple(origin, what, "xyz")?.unwrap_or_else(Vector3::zeros);
    let angles = triple(origin, what, "rpy")?.unwrap_or_else(Vector3::zeros);
    let rotation = UnitQuaternion::from_euler_angles(angles.x, angles.y, angles.z);
    Ok(Isometry3::from_parts(Translation3::from(at), rotation))
}

/// Stores the number of a link or joint under its name, which must be new.
fn insert_once(numbers: &mut HashMap<String, usize>, node: Node<'_, '_>, name: &str, number: usize) -> Result<()> {
    let kind = node.tag_name().name();
    let why = format!("there are two {kind}s of this name");
    match numbers.insert(name.to_owned(), number) {
        Some(_) => Err(bad(node, &format!("{kind} `{name}`"), &why, "rename one")),
        None => Ok(()),
    }
}

fn elements<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |node| node.is_element() && node.tag_name().name() == name)
}

fn child<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'static str) -> Option<Node<'a, 'i>> {
    elements(node, name).next()
}

fn attribute<'a>(node: Node<'a, '_>, what: &str, key: &str) -> Result<&'a str> {
    let why = || bad(node, what, &format!("it has no attribute `{key}`"), "add it");
    node.attribute(key).map(str::trim).filter(|text| !text.is_empty()).ok_or_else(why)
}

fn number(node: Node<'_, '_>, what: &str, key: &str) -> Result<Option<f64>> {
    node.attribute(key).map(|text| parsed(node, what, key, text)).transpose()
}

fn triple(node: Node<'_, '_>, what: &str, key: &str) -> Result<Option<Vector3<f64>>> {
    let Some(text) = node.attribute(key) else { return Ok(None) };
    let all = text.split_whitespace().map(|word| parsed(node, what, key, word)).collect::<Result<Vec<_>>>()?;
    match all[..] {
        [x, y, z] => Ok(Some(Vector3::new(x, y, z))),
        _ => Err(bad(node, what, &format!("`{key}` has {} numbers", all.len()), "give three")),
    }
}

fn parsed(node: Node<'_, '_>, what: &str, key: &str, text: &str) -> Result<f64> {
    let value = text.trim().parse::<f64>().ok().filter(|value| value.abs() < 1e30);
    value.ok_or_else(|| bad(node, what, &format!("`{key}` is `{}`", shortened(text, 40)), "give a finite number"))
}

/// The beginning of a text for a message.
fn shortened(text: &str, most: usize) -> String {
    text.chars().take(most).filter(|c| !c.is_control()).collect()
}

fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

fn bad(node: Node<'_, '_>, what: &str, why: &str, remedy: &str) -> Error {
    Error::definition(format!("{} (line {})", shortened(what, 100), line(node)), why, remedy)
}
