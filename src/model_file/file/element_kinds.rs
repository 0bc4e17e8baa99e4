//! Kinds of joints, drives and forces: how they are attached, what they take and what they measure.

use super::key::{Accepts, EACH, Key, Table, default, required};

/// What a part is attached to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attach {
    /// Points `a` and `b`.
    Points,
    /// Coordinates `a` and `b`.
    Coordinates,
    /// Coordinates `a` and `b` of two wheels, and that of their carrier.
    Wheels,
    /// One point.
    Point,
    /// One coordinate.
    Coordinate,
}

impl Attach {
    pub const fn keys(self) -> &'static [Key] {
        match self {
            Self::Points => POINTS,
            Self::Coordinates => COORDINATES,
            Self::Wheels => WHEELS,
            Self::Point => POINT,
            Self::Coordinate => COORDINATE,
        }
    }
}

const POINTS: &[Key] = &[
    required("a", Accepts::Marker, "point of the first body"),
    required("b", Accepts::Marker, "point of the second body"),
];
const COORDINATES: &[Key] = &[
    default("a", Accepts::Coordinate, "ground.x", "coordinate that it acts against"),
    required("b", Accepts::Coordinate, "coordinate that it acts on"),
];
const WHEELS: &[Key] = &[
    required("a", Accepts::Coordinate, "rotation of the first wheel"),
    required("b", Accepts::Coordinate, "rotation of the second wheel"),
    default("carrier", Accepts::Coordinate, "ground.theta", "rotation of the carrier"),
];
const POINT: &[Key] = &[required("at", Accepts::Marker, "point that it acts on")];
const COORDINATE: &[Key] = &[required("coordinate", Accepts::Coordinate, "coordinate that it acts on")];

/// A kind of joint, drive or force.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    pub name: &'static str,
    pub element: Element,
    pub attach: Attach,
    /// Its numbers, in the order of the element's parameters, and its function of time.
    pub keys: &'static [Key],
    pub measures: &'static [&'static str],
    pub about: &'static str,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    Revolute,
    FixedJoint,
    Prismatic,
    PointOnLine,
    DistanceConstraint,
    GearPair,
    Rack,
    Prescribed,
    Relative,
    Length,
    Spring,
    CoordinateSpring,
    Bushing,
    Actuator,
    Load,
    Force,
    Friction,
    BumpStop,
    Wall,
    RigidStop,
    RigidWall,
    FeedbackForce,
    Inertia,
}

pub const COMMON_JOINT: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    default(
        "kind",
        Accepts::Choice(&["revolute", "fixed", "prismatic", "point-on-line", "distance", "gears", "rack"]),
        "revolute",
        "what it is",
    ),
    EACH,
];
pub const COMMON_DRIVER: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    default("kind", Accepts::Choice(&["coordinate", "relative", "length"]), "coordinate", "what it prescribes"),
    EACH,
];
pub const COMMON_FORCE: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    required(
        "kind",
        Accepts::Choice(&[
            "spring",
            "coordinate-spring",
            "bushing",
            "actuator",
            "load",
            "force",
            "friction",
            "bump-stop",
            "wall",
            "rigid-stop",
            "rigid-wall",
            "feedback",
            "inertia",
        ]),
        "what it is",
    ),
    EACH,
];

const TURN: Key = default("angle", Accepts::Expression, "0", "rotation of b against a in rad");
const LINE: Key = default("line", Accepts::Expression, "0", "direction of the line in the body of a, rad");

pub const JOINTS: &[Kind] = &[
    Kind {
        name: "revolute",
        element: Element::Revolute,
        attach: Attach::Points,
        keys: &[],
        measures: &["force_x", "force_y", "force"],
        about: "pins two points together",
    },
    Kind {
        name: "fixed",
        element: Element::FixedJoint,
        attach: Attach::Points,
        keys: &[TURN],
        measures: &["force_x", "force_y", "moment"],
        about: "joins two bodies rigidly",
    },
    Kind {
        name: "prismatic",
        element: Element::Prismatic,
        attach: Attach::Points,
        keys: &[LINE, TURN],
        measures: &["force", "moment", "position"],
        about: "lets b slide along a line of a without turning",
    },
    Kind {
        name: "point-on-line",
        element: Element::PointOnLine,
        attach: Attach::Points,
        keys: &[LINE],
        measures: &["force", "position"],
        about: "keeps point b on a line through a",
    },
    Kind {
        name: "distance",
        element: Element::DistanceConstraint,
        attach: Attach::Points,
        keys: &[required("length", Accepts::Expression, "m")],
        measures: &["tension"],
        about: "keeps two points at a distance",
    },
    Kind {
        name: "gears",
        element: Element::GearPair,
        attach: Attach::Wheels,
        keys: &[
            required("radius_a", Accepts::Expression, "m"),
            required("radius_b", Accepts::Expression, "m; negative for an internal gear"),
            default("offset", Accepts::Expression, "0", "r_a θ_a + r_b θ_b against the carrier, m"),
        ],
        measures: &["tooth_force"],
        about: "lets two wheels roll on each other",
    },
    Kind {
        name: "rack",
        element: Element::Rack,
        attach: Attach::Points,
        keys: &[
            required("radius", Accepts::Expression, "of the pinion, the body of b, in m"),
            default("direction", Accepts::Expression, "0", "of the rack, rad"),
            default("offset", Accepts::Expression, "0", "m"),
        ],
        measures: &["tooth_force"],
        about: "moves a rack, the body of a, with a pinion, the body of b",
    },
];

const MOTION: Key = required("motion", Accepts::Motion, "position as a function of time, m or rad");

pub const DRIVERS: &[Kind] = &[
    Kind {
        name: "coordinate",
        element: Element::Prescribed,
        attach: Attach::Coordinate,
        keys: &[MOTION],
        measures: &["driving_force"],
        about: "prescribes a coordinate",
    },
    Kind {
        name: "relative",
        element: Element::Relative,
        attach: Attach::Coordinates,
        keys: &[MOTION],
        measures: &["driving_force", "power"],
        about: "prescribes b − a",
    },
    Kind {
        name: "length",
        element: Element::Length,
        attach: Attach::Points,
        keys: &[MOTION],
        measures: &["tension", "length"],
        about: "prescribes the distance of two points",
    },
];

const DAMPING: Key = default("damping", Accepts::Expression, "0", "N·s/m or N·m·s/rad");
const CUBIC: Key = default("cubic", Accepts::Expression, "0", "cubic stiffness, N/m³ or N·m/rad³");

pub const FORCES: &[Kind] = &[
    Kind {
        name: "spring",
        element: Element::Spring,
        attach: Attach::Points,
        keys: &[
            required("stiffness", Accepts::Expression, "N/m"),
            DAMPING,
            default("length", Accepts::Expression, "0", "unloaded length, m"),
            CUBIC,
        ],
        measures: &["tension", "length", "rate"],
        about: "a spring and damper between two points",
    },
    Kind {
        name: "coordinate-spring",
        element: Element::CoordinateSpring,
        attach: Attach::Coordinates,
        keys: &[
            required("stiffness", Accepts::Expression, "N/m or N·m/rad"),
            DAMPING,
            default("unloaded", Accepts::Expression, "0", "b − a without force, m or rad"),
            CUBIC,
        ],
        measures: &["generalized_force", "elongation", "rate"],
        about: "a spring and damper on b − a",
    },
    Kind {
        name: "bushing",
        element: Element::Bushing,
        attach: Attach::Points,
        keys: &[
            required("stiffness_x", Accepts::Expression, "N/m"),
            required("stiffness_y", Accepts::Expression, "N/m"),
            required("stiffness_theta", Accepts::Expression, "N·m/rad"),
            default("damping_x", Accepts::Expression, "0", "N·s/m"),
            default("damping_y", Accepts::Expression, "0", "N·s/m"),
            default("damping_theta", Accepts::Expression, "0", "N·m·s/rad"),
        ],
        measures: &["force_x", "force_y", "moment"],
        about: "joins two points elastically",
    },
    Kind {
        name: "actuator",
        element: Element::Actuator,
        attach: Attach::Points,
        keys: &[required("tension", Accepts::Motion, "as a function of time, N")],
        measures: &["tension", "length", "rate"],
        about: "an axial force between two points",
    },
    Kind {
        name: "load",
        element: Element::Load,
        attach: Attach::Coordinates,
        keys: &[required("generalized_force", Accepts::Motion, "as a function of time, N or N·m")],
        measures: &["generalized_force", "power"],
        about: "a generalized force on b − a",
    },
    Kind {
        name: "force",
        element: Element::Force,
        attach: Attach::Point,
        keys: &[
            required("direction", Accepts::Expression, "fixed in space, rad"),
            required("force", Accepts::Motion, "as a function of time, N"),
        ],
        measures: &["force"],
        about: "a force at a point",
    },
    Kind {
        name: "friction",
        element: Element::Friction,
        attach: Attach::Coordinates,
        keys: &[
            required("coulomb_force", Accepts::Expression, "N or N·m"),
            required("speed", Accepts::Expression, "over which it rises, m/s or rad/s"),
            default("viscous", Accepts::Expression, "0", "N·s/m or N·m·s/rad"),
        ],
        measures: &["generalized_force"],
        about: "Coulomb and viscous friction between a and b",
    },
    Kind {
        name: "bump-stop",
        element: Element::BumpStop,
        attach: Attach::Coordinates,
        keys: &[
            required("stiffness", Accepts::Expression, "N/m^1.5"),
            default("damping", Accepts::Expression, "0", "s/m"),
            required("limit", Accepts::Expression, "of b − a, m or rad"),
        ],
        measures: &["contact_force"],
        about: "keeps b − a above a limit",
    },
    Kind {
        name: "wall",
        element: Element::Wall,
        attach: Attach::Point,
        keys: &[
            required("wall_x", Accepts::Expression, "a point of the wall, m"),
            required("wall_y", Accepts::Expression, "m"),
            required("normal", Accepts::Expression, "direction of the outward normal, rad"),
            required("stiffness", Accepts::Expression, "N/m^1.5"),
            default("damping", Accepts::Expression, "0", "s/m"),
        ],
        measures: &["contact_force"],
        about: "keeps a point on the outer side of a wall",
    },
    Kind {
        name: "rigid-stop",
        element: Element::RigidStop,
        attach: Attach::Coordinates,
        keys: &[
            required("clearance", Accepts::Expression, "of b − a, m or rad"),
            default("restitution", Accepts::Expression, "0.5", "part of the speed that is left, 0 to 1"),
        ],
        measures: &[],
        about: "lets b − a bounce off a limit that it does not fall below; implicit schemes only",
    },
    Kind {
        name: "rigid-wall",
        element: Element::RigidWall,
        attach: Attach::Points,
        keys: &[LINE, default("restitution", Accepts::Expression, "0.5", "part of the speed that is left, 0 to 1")],
        measures: &[],
        about: "lets b bounce off the line through a; it stays to the left, seen along the line; implicit schemes only",
    },
    Kind {
        name: "feedback",
        element: Element::FeedbackForce,
        attach: Attach::Coordinate,
        keys: &[required(
            "generalized_force",
            Accepts::Feedback,
            "as a function of time and motion, N or N·m: `-k*cart.x - c*cart.vx`",
        )],
        measures: &["generalized_force", "power"],
        about: "a generalized force that depends on the motion: a controller, a drag, a magnet",
    },
    Kind {
        name: "inertia",
        element: Element::Inertia,
        attach: Attach::Coordinate,
        keys: &[required("inertia", Accepts::Expression, "kg or kg·m²")],
        measures: &[],
        about: "adds mass to a coordinate",
    },
];

/// Declarations for documentation and schema.
pub fn tables() -> Vec<Table> {
    let families: [(&str, &str, &'static [Key], &[Kind]); 3] = [
        ("joint", "what joins bodies", COMMON_JOINT, JOINTS),
        ("driver", "what moves as prescribed", COMMON_DRIVER, DRIVERS),
        ("force", "forces", COMMON_FORCE, FORCES),
    ];
    let family = |(name, about, common, kinds): (&'static str, &'static str, &'static [Key], &'static [Kind])| {
        let kind = move |kind: &'static Kind| {
            let both = [kind.attach.keys(), kind.keys];
            both.into_iter().map(move |keys| Table { name, kind: Some(kind.name), about: kind.about, keys })
        };
        std::iter::once(Table { name, kind: None, about, keys: common }).chain(kinds.iter().flat_map(kind))
    };
    families.into_iter().flat_map(family).collect()
}
