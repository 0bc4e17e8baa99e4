//! A robot as links and joints, independent of the format of its file.

use super::inertia::MassData;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// A robot as its file describes it.
pub struct Robot {
    pub name: String,
    /// Gravitational acceleration in m/s².
    pub gravity: Vector3<f64>,
    pub links: Vec<Link>,
    /// Joints that make a tree of the links.
    pub joints: Vec<RobotJoint>,
    /// Connections that close loops.
    pub closures: Vec<Closure>,
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
    Spherical,
    Floating,
    Fixed,
}

impl JointType {
    /// True if it has one degree of freedom.
    pub fn has_coordinate(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous | Self::Prismatic)
    }

    /// True if it has several degrees of freedom.
    pub fn has_many(self) -> bool {
        matches!(self, Self::Planar | Self::Spherical | Self::Floating)
    }
}

/// A joint between two links. Its frame has the axes of the child where the joint is at zero.
pub struct RobotJoint {
    pub name: String,
    pub kind: JointType,
    /// Links, by number.
    pub parent: usize,
    pub child: usize,
    /// Pose of the joint in the frame of the parent.
    pub origin: Isometry3<f64>,
    /// Position of the joint in the frame of the child.
    pub anchor: Vector3<f64>,
    /// Unit vector in the frame of the joint.
    pub axis: Vector3<f64>,
    /// Position at the start, unless the joint follows another one.
    pub start: f64,
    /// Smallest and largest position.
    pub range: Option<[f64; 2]>,
    /// Limits of the force or torque, and of the velocity.
    pub strength: [Option<f64>; 2],
    /// Stiffness of its spring, and the position without force.
    pub spring: [f64; 2],
    pub damping: f64,
    pub friction: f64,
    /// Inertia of its motor.
    pub armature: f64,
    pub mimic: Option<Mimic>,
}

impl RobotJoint {
    /// A joint without any resistance, with its frame at that of the child.
    pub fn new(name: String, kind: JointType, [parent, child]: [usize; 2], origin: Isometry3<f64>) -> Self {
        Self {
            name,
            kind,
            parent,
            child,
            origin,
            anchor: Vector3::zeros(),
            axis: Vector3::z(),
            start: 0.0,
            range: None,
            strength: [None; 2],
            spring: [0.0; 2],
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            mimic: None,
        }
    }

    /// Pose of the child in the frame of the parent at the position `q`.
    pub fn pose(&self, q: f64) -> Isometry3<f64> {
        self.origin * motion(self.kind, self.axis, q) * Translation3::from(-self.anchor)
    }
}

/// The motion of a joint at the position `q`.
pub fn motion(kind: JointType, axis: Vector3<f64>, q: f64) -> Isometry3<f64> {
    match kind {
        JointType::Prismatic => Isometry3::from_parts(Translation3::from(axis * q), UnitQuaternion::identity()),
        _ => Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(axis * q)),
    }
}

/// Position of a joint as a linear function of that of another.
pub struct Mimic {
    /// The other joint, by number.
    pub joint: usize,
    pub multiplier: f64,
    pub offset: f64,
}

/// A connection of two links that closes a loop.
pub struct Closure {
    pub name: String,
    /// True if it fixes the orientation, too.
    pub is_fixed: bool,
    /// Links, by number, and poses in their frames that coincide.
    pub ends: [(usize, Isometry3<f64>); 2],
}

/// Sentences about properties of the joints that a model does not have, or has in another form.
pub fn changed(joints: &[RobotJoint]) -> Vec<String> {
    let count = |is: &dyn Fn(&RobotJoint) -> bool| joints.iter().filter(|joint| is(joint)).count();
    let resists = |joint: &RobotJoint| joint.damping > 0.0 || joint.friction > 0.0;
    let is_moved = |joint: &RobotJoint| joint.spring[0] > 0.0 || joint.armature > 0.0;
    let sentences = [
        (
            count(&|joint| joint.range.is_some() || joint.strength.iter().any(Option::is_some)),
            "limits of joints ({}) are comments only: add forces of the kind `bump-stop` for positions that are reached",
        ),
        (
            count(&|joint| joint.kind.has_coordinate() && joint.friction > 0.0),
            "Coulomb friction of joints ({}) fades below 0.01 rad/s or m/s, `speed` of the forces `friction`",
        ),
        (
            count(&|joint| joint.kind.has_many() && resists(joint)),
            "damping and friction of planar, spherical and floating joints ({}) were left out",
        ),
        (
            count(&|joint| joint.kind.has_many() && is_moved(joint)),
            "springs and motor inertia of spherical and floating joints ({}) were left out",
        ),
    ];
    let found = sentences.into_iter().filter(|(count, _)| *count > 0);
    found.map(|(count, text)| text.replace("{}", &count.to_string())).collect()
}
