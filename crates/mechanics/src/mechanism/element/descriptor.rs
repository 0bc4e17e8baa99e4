//! Declarations of elements: family, inputs and measures with units.
//!
//! Each element declares itself once, in the file of its residual. Model files, their reference and schema, drawings and the tests
//! of all elements are made from these declarations.

/// Family of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Inertia and weight.
    Body,
    /// Constraint between bodies.
    Joint,
    /// Constraint that prescribes a motion.
    Drive,
    /// Applied force or torque: spring, damper, friction, load.
    Force,
    /// Unilateral contact, compliant or rigid.
    Contact,
    /// Flexible beam.
    Beam,
    /// Measurement without any effect on the motion.
    Sensor,
}

impl std::fmt::Display for Family {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Body => "body",
            Self::Joint => "joint",
            Self::Drive => "drive",
            Self::Force => "force",
            Self::Contact => "contact",
            Self::Beam => "beam",
            Self::Sensor => "sensor",
        })
    }
}

/// Graphical symbol of an element in drawings of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// Not drawn.
    None,
    /// Revolute joint at the first point.
    Pin,
    /// Bar between two points.
    Bar,
    /// Spring between two points or two coordinates; with a damper in parallel if it has damping.
    Spring,
    /// Damper between two points.
    Damper,
    /// Cylinder with a rod between two points: a drive or a force of given length or tension.
    Cylinder,
    /// Rope between two points.
    Rope,
    /// Two wheels around the bodies of the first two coordinates, with the radii that are the first two parameters.
    Gears,
    /// Rack through the first point, with a wheel around the body of the second one. Parameters: radius, direction of the rack.
    Rack,
    /// Cam around the first point; the first parameters are base radius, lift and phase.
    Cam,
    /// Closed curve through given points, with the first point as its origin, and a roller around the second one with the parameter
    /// `radius`.
    Profile,
    /// Closed curve as of a profile, and a face through the second point with the direction `line`.
    ProfileFace,
    /// Friction surfaces on both sides of the joint to which the element belongs.
    JointFriction,
    /// Wall in the plane. Parameters: x and y of a point of it, direction of its outward normal.
    Wall,
    /// Wall on the body of the first point, along the direction that is the first parameter.
    MovingWall,
    /// Stop of the second coordinate against the first one at the parameter `limit` or `clearance`.
    Stop,
    /// Spheres in space: around the second point with the first parameter as its radius, on the plane through the first point; around both
    /// points with the first two parameters as their radii.
    Spheres,
    /// Rigid or elastic connection at the first point.
    Connection,
    /// Guide through the first point at the angle that is the first parameter, with a slider at the second point.
    Guide,
}

/// Declaration of an element.
#[derive(Clone, Copy, Debug)]
pub struct ElementDescriptor {
    /// Name in model files.
    pub kind: &'static str,
    /// Family.
    pub family: Family,
    /// Attachments and parameters, in the order of the coordinates and parameters of the element.
    pub inputs: &'static [Input],
    /// Quantities that the element measures, in the order of [`Element::measure`](super::Element::measure).
    pub measures: &'static [Measure],
    /// Purpose, in words that follow the kind: "a spring and damper between two points".
    pub about: &'static str,
    /// Formula of the force, or equation of the constraint, with the names of inputs and measures. It is empty if `about` says
    /// all.
    pub law: &'static str,
    /// Symbol in drawings.
    pub symbol: Symbol,
}

/// One input of an element: a point, a body, a coordinate, a parameter or a function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// Name, a key in model files.
    pub name: &'static str,
    /// Role: point, body, coordinate, parameter or function.
    pub role: Role,
    /// Value if none is given; `None` for required inputs.
    pub default: Option<&'static str>,
    /// Unit of a parameter or function, empty if it has none.
    pub unit: &'static str,
    /// Meaning.
    pub about: &'static str,
    /// Typical value of a parameter, for tests that cover all elements.
    pub example: f64,
}

/// Role of an input, which determines the coordinates and parameters of the element that belong to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A point of a body: the coordinates x, y, θ of the body, and two parameters, the point's body-fixed x and y in m.
    Marker,
    /// A body: its coordinates x, y, θ.
    Body,
    /// A body whose rotation does not matter: its coordinates x, y.
    Translations,
    /// A point with axes on a body in space: the coordinates x, y, z, e₀ to e₃ of the body, and seven parameters, the
    /// point's body-fixed x, y, z in m and the Euler parameters of its axes.
    Marker3,
    /// A body in space: its coordinates x, y, z, e₀ to e₃.
    Body3,
    /// A body in space whose rotation does not matter: its coordinates x, y, z.
    Translations3,
    /// One coordinate.
    Coordinate,
    /// One design-dependent number.
    Parameter,
    /// One component of the gravitational acceleration in m/s², a parameter that the mechanism sets.
    Gravity,
    /// A joint of one of these kinds whose reactions the element reads: the coordinates of the joint, and its parameters after
    /// all others. It is the last input.
    Joint(&'static [&'static str]),
    /// Points of a closed curve; all further parameters are their x and y in m.
    Profile,
    /// A function of time; all further parameters are its own.
    TimeFunction,
    /// A function of time and state; all further coordinates and parameters are its own.
    StateFunction,
}

impl Input {
    const fn of(name: &'static str, role: Role, unit: &'static str, about: &'static str) -> Self {
        Self { name, role, default: None, unit, about, example: 0.0 }
    }

    /// A point of a body.
    pub const fn marker(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Marker, "", about)
    }

    /// A body.
    pub const fn body(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Body, "", about)
    }

    /// A body of which only the translations matter.
    pub const fn translations(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Translations, "", about)
    }

    /// A point with axes on a body in space.
    pub const fn marker3(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Marker3, "", about)
    }

    /// A body in space.
    pub const fn body3(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Body3, "", about)
    }

    /// A body in space of which only the translations matter.
    pub const fn translations3(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Translations3, "", about)
    }

    /// A coordinate.
    pub const fn coordinate(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Coordinate, "", about)
    }

    /// A coordinate with a default such as `ground.x`.
    pub const fn coordinate_or(name: &'static str, default: &'static str, about: &'static str) -> Self {
        Self { default: Some(default), ..Self::coordinate(name, about) }
    }

    /// A parameter that must be given.
    pub const fn required(name: &'static str, unit: &'static str, example: f64, about: &'static str) -> Self {
        Self { example, ..Self::of(name, Role::Parameter, unit, about) }
    }

    /// A parameter with a default.
    pub const fn optional(
        name: &'static str,
        default: &'static str,
        unit: &'static str,
        example: f64,
        about: &'static str,
    ) -> Self {
        Self { default: Some(default), ..Self::required(name, unit, example, about) }
    }

    /// A component of the gravitational acceleration.
    pub const fn gravity(name: &'static str) -> Self {
        Self::of(name, Role::Gravity, "m/s²", "gravitational acceleration")
    }

    /// A joint of one of the `kinds`.
    pub const fn joint(name: &'static str, kinds: &'static [&'static str], about: &'static str) -> Self {
        Self::of(name, Role::Joint(kinds), "", about)
    }

    /// Points of a closed curve.
    pub const fn profile(name: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::Profile, "m", about)
    }

    /// A function of time.
    pub const fn time_function(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::TimeFunction, unit, about)
    }

    /// A function of time and state.
    pub const fn state_function(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self::of(name, Role::StateFunction, unit, about)
    }
}

/// A quantity that an element measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measure {
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Meaning and sign.
    pub about: &'static str,
}

impl Measure {
    /// A measure with its unit, meaning and sign.
    pub const fn new(name: &'static str, unit: &'static str, about: &'static str) -> Self {
        Self { name, unit, about }
    }
}

/// Declares the inputs of an element once: the constant `INPUTS` for its descriptor, and a view of its parameters by name.
///
/// Each line names an input and a constructor of [`Input`](crate::mechanism::element::Input) with its remaining arguments.
/// The view wraps the parameters `x.p` of an [`ElementState`](crate::mechanism::element::ElementState): a parameter is read
/// as `T`, a point as `[T; 2]`, a point with axes in space as `[T; 7]`, a function's own parameters as a slice.
///
/// ```
/// use linkwright_mechanics::element_inputs;
///
/// element_inputs!(SpringInputs {
///     coordinate: coordinate("coordinate that it acts on"),
///     stiffness: required("N/m", 10.0, "stiffness"),
///     unloaded: optional("0", "m", 0.1, "position without force"),
/// });
/// assert_eq!(SpringInputs(&[40.0, 0.5]).unloaded(), 0.5);
/// assert_eq!(INPUTS[1].unit, "N/m");
/// ```
#[macro_export]
macro_rules! element_inputs {
    ($view:ident { $($name:ident: $constructor:ident($($argument:expr),*)),* $(,)? }) => {
        const INPUTS: &[$crate::mechanism::element::Input] =
            &[$($crate::mechanism::element::Input::$constructor(stringify!($name), $($argument),*)),*];

        /// Parameters of the element by name.
        // Not every parameter is read by name: the line between two points reads both points itself.
        #[allow(dead_code)]
        #[derive(Clone, Copy)]
        struct $view<'a, T>(&'a [T]);

        #[allow(dead_code)]
        impl<'a, T: Copy> $view<'a, T> {
            $crate::element_inputs!(@view 0; $($name: $constructor,)*);
        }
    };
    (@view $at:expr;) => {};
    (@view $at:expr; $name:ident: marker, $($rest:tt)*) => {
        #[inline(always)]
        fn $name(self) -> [T; 2] {
            [self.0[$at], self.0[$at + 1]]
        }
        $crate::element_inputs!(@view $at + 2; $($rest)*);
    };
    (@view $at:expr; $name:ident: marker3, $($rest:tt)*) => {
        #[inline(always)]
        fn $name(self) -> [T; 7] {
            [0, 1, 2, 3, 4, 5, 6].map(|k| self.0[$at + k])
        }
        $crate::element_inputs!(@view $at + 7; $($rest)*);
    };
    (@view $at:expr; $name:ident: required, $($rest:tt)*) => {
        #[inline(always)]
        fn $name(self) -> T {
            self.0[$at]
        }
        $crate::element_inputs!(@view $at + 1; $($rest)*);
    };
    (@view $at:expr; $name:ident: optional, $($rest:tt)*) => {
        $crate::element_inputs!(@view $at; $name: required, $($rest)*);
    };
    (@view $at:expr; $name:ident: gravity, $($rest:tt)*) => {
        $crate::element_inputs!(@view $at; $name: required, $($rest)*);
    };
    (@view $at:expr; $name:ident: time_function, $($rest:tt)*) => {
        #[inline(always)]
        fn $name(self) -> &'a [T] {
            &self.0[$at..]
        }
        $crate::element_inputs!(@view $at; $($rest)*);
    };
    (@view $at:expr; $name:ident: state_function, $($rest:tt)*) => {
        $crate::element_inputs!(@view $at; $name: time_function, $($rest)*);
    };
    (@view $at:expr; $name:ident: profile, $($rest:tt)*) => {
        $crate::element_inputs!(@view $at; $name: time_function, $($rest)*);
    };
    (@view $at:expr; $name:ident: joint, $($rest:tt)*) => {
        $crate::element_inputs!(@view $at; $name: time_function, $($rest)*);
    };
    (@view $at:expr; $name:ident: $attachment:ident, $($rest:tt)*) => {
        $crate::element_inputs!(@view $at; $($rest)*);
    };
}
