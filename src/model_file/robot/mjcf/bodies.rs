//! Bodies with their joints, shapes and sites.

use super::defaults::Defaults;
use super::settings::{MassSource, MjcfSettings};
use super::shapes;
use crate::Result;
use crate::model_file::robot::inertia::MassData;
use crate::model_file::robot::parts::{JointType, Link, RobotJoint};
use crate::model_file::robot::xml::{Counts, XmlElement};
use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};
use std::collections::HashMap;

/// Attributes that joints have in MuJoCo.
const JOINT_KEYS: [&str; 25] = [
    "name",
    "class",
    "type",
    "group",
    "align",
    "pos",
    "axis",
    "springdamper",
    "limited",
    "actuatorfrclimited",
    "solreflimit",
    "solimplimit",
    "solreffriction",
    "solimpfriction",
    "stiffness",
    "range",
    "actuatorfrcrange",
    "actuatorgravcomp",
    "margin",
    "ref",
    "springref",
    "armature",
    "damping",
    "frictionloss",
    "user",
];

/// Number of the world in the list of links.
pub const WORLD: usize = 0;

/// Links and joints of a file, and what was left out of them.
pub struct Bodies<'a> {
    settings: &'a MjcfSettings,
    defaults: &'a Defaults,
    pub links: Vec<Link>,
    pub joints: Vec<RobotJoint>,
    /// Pose of each link in the world with all joints at zero.
    pub poses: Vec<Isometry3<f64>>,
    /// Numbers of links by the names of bodies and of sites, and of joints.
    pub bodies: HashMap<String, usize>,
    pub sites: HashMap<String, usize>,
    pub joint_names: HashMap<String, usize>,
    pub counts: Counts,
    shapes: usize,
    left_out: Vec<String>,
}

/// Context of the elements in a body: its link, the pose of their frame in it, their class, and whether shapes have masses.
#[derive(Clone)]
struct BodyScope<'c> {
    link: usize,
    frame: Isometry3<f64>,
    class: &'c str,
    has_masses: bool,
}

impl<'a> Bodies<'a> {
    /// A world without bodies.
    pub fn new(settings: &'a MjcfSettings, defaults: &'a Defaults) -> Self {
        let world = Link { name: "world".into(), mass: None };
        Self {
            settings,
            defaults,
            links: vec![world],
            joints: vec![],
            poses: vec![Isometry3::identity()],
            bodies: HashMap::from([("world".to_owned(), WORLD)]),
            sites: HashMap::new(),
            joint_names: HashMap::new(),
            counts: Counts::default(),
            shapes: 0,
            left_out: vec![],
        }
    }

    /// Adds all that an element `worldbody` contains.
    pub fn world(&mut self, element: &XmlElement) -> Result<()> {
        let class = element.attribute("childclass").unwrap_or(super::defaults::MAIN);
        let place = BodyScope { link: WORLD, frame: Isometry3::identity(), class, has_masses: false };
        self.contents(element, &place, &mut vec![])
    }

    /// Sentences about what was left out of the bodies.
    pub fn sentences(&mut self) -> Vec<String> {
        let mut all = std::mem::take(&mut self.left_out);
        if self.shapes > 0 {
            all.push(format!("shapes <geom> ({}) give masses only: their contacts were left out", self.shapes));
        }
        all.extend(std::mem::take(&mut self.counts).sentences());
        all
    }

    fn link(&mut self, name: String, pose: Isometry3<f64>) -> usize {
        self.links.push(Link { name, mass: None });
        self.poses.push(pose);
        self.links.len() - 1
    }

    /// Adds the shapes, sites, bodies and frames in an element, and the masses of the shapes to `masses`.
    fn contents(&mut self, element: &XmlElement, at: &BodyScope<'_>, masses: &mut Vec<MassData>) -> Result<()> {
        for child in &element.children {
            match &*child.name {
                "geom" => {
                    self.shapes += 1;
                    if at.has_masses {
                        let what = self.what("shape", child, at.link);
                        let geom = self.defaults.apply(child, at.class)?;
                        let own = shapes::mass(&geom, self.settings, &what)?;
                        masses.extend(own.map(|mass| mass.in_frame(&at.frame)));
                    }
                }
                "site" => self.site(child, at)?,
                "body" => self.body(child, at)?,
                "frame" => {
                    let what = self.what("frame", child, at.link);
                    let class = child.attribute("childclass").unwrap_or(at.class);
                    if let Some(joint) = child.children.iter().find(|c| matches!(&*c.name, "joint" | "freejoint")) {
                        return Err(joint.bad(&what, "it contains a joint", "move the joint into the body"));
                    }
                    let frame = at.frame * self.settings.pose(child, &what)?;
                    self.contents(child, &BodyScope { frame, class, ..at.clone() }, masses)?;
                }
                "joint" | "freejoint" | "inertial" => {}
                "replicate" | "attach" | "composite" | "flexcomp" => {
                    let remedy = "load the file in MuJoCo and save it: mujoco.mj_saveLastXML(\"flat.xml\", model)";
                    let what = format!("<{}>", child.name);
                    return Err(child.bad(&what, "it makes bodies that the file does not list", remedy));
                }
                _ => self.counts.add_all([child]),
            }
        }
        Ok(())
    }

    /// A description of an element for messages.
    fn what(&self, kind: &str, element: &XmlElement, link: usize) -> String {
        match element.attribute("name") {
            Some(name) => format!("{kind} `{name}`"),
            None => format!("{kind} of body `{}`", self.links[link].name),
        }
    }

    fn site(&mut self, element: &XmlElement, at: &BodyScope<'_>) -> Result<()> {
        let Some(name) = element.attribute("name") else { return Ok(()) };
        let what = format!("site `{name}`");
        let own = self.defaults.apply(element, at.class)?;
        let place = at.frame * self.settings.pose(&own, &what)?;
        let link = self.link(name.to_owned(), self.poses[at.link] * place);
        self.joints.push(RobotJoint::new(format!("{name}_site"), JointType::Fixed, [at.link, link], place));
        match self.sites.insert(name.to_owned(), link) {
            Some(_) => Err(element.bad(&what, "there are two sites of this name", "rename one")),
            None => Ok(()),
        }
    }

    fn body(&mut self, element: &XmlElement, at: &BodyScope<'_>) -> Result<()> {
        let name = element.attribute("name").map_or_else(|| format!("body_{}", self.links.len()), str::to_owned);
        let what = format!("body `{name}`");
        let class = element.attribute("childclass").unwrap_or(at.class);
        if !self.defaults.has(class) {
            let why = format!("there is no class `{class}`");
            return Err(element.bad(&what, &why, "name a class of <default>"));
        }
        let pose = at.frame * self.settings.pose(element, &what)?;
        let in_world = self.poses[at.link] * pose;
        let is_moved = |key: &str| element.attribute(key).is_some_and(|text| !matches!(text, "0" | "false"));
        for key in ["gravcomp", "mocap"].into_iter().filter(|key| is_moved(key)) {
            self.left_out.push(format!("`{key}` of body `{name}` was left out"));
        }
        let joints: Vec<&XmlElement> =
            element.children.iter().filter(|child| matches!(&*child.name, "joint" | "freejoint")).collect();
        let mut parent = at.link;
        let mut origin = pose;
        // Several joints of a body follow each other, with frames without mass in between.
        for (k, joint) in joints.iter().enumerate() {
            let (own, is_last) = (self.joint(joint, &name, k, joints.len(), class)?, k + 1 == joints.len());
            let child = self.link(if is_last { name.clone() } else { format!("{name}_{}", k + 1) }, in_world);
            let origin = std::mem::replace(&mut origin, Isometry3::identity()) * Translation3::from(own.anchor);
            if self.joint_names.insert(own.name.clone(), self.joints.len()).is_some() {
                return Err(joint.bad(
                    &format!("joint `{}`", own.name),
                    "there are two joints of this name",
                    "rename one",
                ));
            }
            self.joints.push(RobotJoint { parent, child, origin, ..own });
            parent = child;
        }
        let link = if joints.is_empty() {
            let link = self.link(name.clone(), in_world);
            self.joints.push(RobotJoint::new(format!("{name}_fixed"), JointType::Fixed, [at.link, link], pose));
            link
        } else {
            parent
        };
        if self.bodies.insert(name.clone(), link).is_some() {
            return Err(element.bad(&what, "there are two bodies of this name", "rename one"));
        }
        // With `inertial`, the masses of shapes are ignored and need not be known.
        let inertial = element.first("inertial").filter(|_| self.settings.masses != MassSource::Shapes);
        let has_masses = inertial.is_none() && self.settings.masses != MassSource::Inertial;
        let mut masses = vec![];
        self.contents(element, &BodyScope { link, frame: Isometry3::identity(), class, has_masses }, &mut masses)?;
        self.links[link].mass = match inertial {
            Some(inertial) => self.inertial(inertial, &what)?,
            None => masses.into_iter().reduce(|a, b| a.and(&b)).map(|mass| self.balanced(mass)),
        };
        Ok(())
    }

    /// The joint number `k` of a body; its origin is not yet known.
    fn joint(&mut self, element: &XmlElement, body: &str, k: usize, count: usize, class: &str) -> Result<RobotJoint> {
        let own = match &*element.name {
            "joint" => self.defaults.apply(element, class)?,
            _ => element.clone(),
        };
        let by_number = || if count == 1 { format!("{body}_joint") } else { format!("{body}_joint_{}", k + 1) };
        let name = element.attribute("name").map_or_else(by_number, str::to_owned);
        let what = format!("joint `{name}`");
        let unknown = element.attributes.iter().filter(|(key, _)| !JOINT_KEYS.contains(&&**key));
        self.left_out
            .extend(unknown.map(|(key, _)| format!("attribute `{key}` of {what} is not known and was left out")));
        let kind = joint_type(element, &own, &what)?;
        if kind == JointType::Floating && count > 1 {
            return Err(own.bad(&what, "a free joint is the only one of its body", "remove the other joints"));
        }
        let mut joint = RobotJoint::new(name, kind, [WORLD, WORLD], Isometry3::identity());
        // A free joint is at the frame of its body and has no limits.
        let is_free = kind == JointType::Floating;
        if !is_free {
            joint.anchor = own.triple(&what, "pos")?.unwrap_or_else(Vector3::zeros);
        }
        if kind.has_coordinate() {
            let axis = own.triple(&what, "axis")?.unwrap_or_else(Vector3::z);
            if !(axis.norm() > 1e-9) {
                let why = format!("its axis {:?} has length zero", axis.as_slice());
                return Err(own.bad(&what, &why, "give a direction such as axis=\"0 0 1\""));
            }
            joint.axis = axis.normalize();
        }
        let of_coordinate = |value: f64| if kind == JointType::Revolute { self.settings.radians(value) } else { value };
        // Positions in the model are measured from the initial configuration, which is `ref` in the file.
        let [reference, rest] = ["ref", "springref"].map(|key| own.number(&what, key));
        let (reference, rest) = (reference?.unwrap_or(0.0), rest?.unwrap_or(0.0));
        if let Some(text) = own.attribute("range").filter(|_| !is_free && own.attribute("limited") != Some("false")) {
            let range: [f64; 2] = own.exactly(&what, "range", text)?;
            joint.range = (range != [0.0; 2]).then(|| range.map(|value| of_coordinate(value - reference)));
        }
        let rest = of_coordinate(rest - reference);
        let mut coefficient = |key: &str| self.coefficient(&own, &what, key);
        joint.spring = [coefficient("stiffness")?, rest];
        joint.damping = coefficient("damping")?;
        joint.friction = coefficient("frictionloss")?;
        joint.armature = coefficient("armature")?;
        if own.attribute("springdamper").is_some_and(|text| text != "0 0") {
            self.left_out.push(format!("`springdamper` of {what} was left out"));
        }
        Ok(joint)
    }

    /// A coefficient of a joint that is not negative; higher ones of a polynomial are left out.
    fn coefficient(&mut self, joint: &XmlElement, what: &str, key: &str) -> Result<f64> {
        let all = joint.numbers(what, key, joint.attribute(key).unwrap_or_default())?;
        let (value, higher) = (all.first().copied().unwrap_or(0.0), all.iter().skip(1).any(|x| *x != 0.0));
        if higher {
            self.left_out.push(format!("higher coefficients of `{key}` of {what} were left out"));
        }
        if value < 0.0 {
            return Err(joint.bad(what, &format!("its {key} is {value}"), "give a number that is not negative"));
        }
        Ok(value)
    }

    /// The mass of an element `inertial`.
    fn inertial(&self, element: &XmlElement, what: &str) -> Result<Option<MassData>> {
        let Some(mass) = element.number(what, "mass")? else {
            return Err(element.bad(what, "its <inertial> has no mass", "add mass=\"…\" in kg"));
        };
        if mass == 0.0 {
            return Ok(None);
        }
        if !(mass > 0.0) {
            return Err(element.bad(what, &format!("its mass is {mass} kg"), "give a positive mass"));
        }
        let inertia = match (element.attribute("fullinertia"), element.triple(what, "diaginertia")?) {
            (Some(text), _) => {
                let [xx, yy, zz, xy, xz, yz] = element.exactly(what, "fullinertia", text)?;
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            }
            (None, Some(diagonal)) => Matrix3::from_diagonal(&diagonal),
            (None, None) => {
                return Err(element.bad(what, "its <inertial> has no inertia", "add diaginertia=\"…\" in kg·m²"));
            }
        };
        let own = MassData { mass, centre: Vector3::zeros(), inertia };
        Ok(Some(self.balanced(own.in_frame(&self.settings.pose(element, what)?))))
    }

    /// The mass; its moments of inertia are replaced by their mean if they are physically impossible and the file sets this option.
    fn balanced(&self, mut mass: MassData) -> MassData {
        let of = mass.inertia.symmetric_eigenvalues();
        let (sum, largest) = (of.sum(), of.max());
        if self.settings.balances && largest > sum - largest {
            mass.inertia = Matrix3::identity() * (sum / 3.0);
        }
        mass
    }
}

/// The type of a joint element; `own` is the element with its defaults.
fn joint_type(element: &XmlElement, own: &XmlElement, what: &str) -> Result<JointType> {
    Ok(match (&*element.name, own.attribute("type").unwrap_or("hinge")) {
        ("freejoint", _) | (_, "free") => JointType::Floating,
        (_, "hinge") => JointType::Revolute,
        (_, "slide") => JointType::Prismatic,
        (_, "ball") => JointType::Spherical,
        _ => return Err(own.bad(what, "its type is not known", "use one of free, ball, slide, hinge")),
    })
}
