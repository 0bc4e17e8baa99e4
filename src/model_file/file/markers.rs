//! Points, directions and orientations in space.

use super::key::{Accepts, Key, TableKeys, optional, required};
use super::parts::{Axes, BuildContext, Direction, FrameRef, MarkerSpec, NamedPart, Parts, PointSpec, Vector};
use super::section::{FileSource, Read, Section, Value, vector, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::mechanism::{Body3, EulerSequence, Marker3, Pose3, Rotation};
use toml::de::DeValue;

/// Keys of an orientation.
const ORIENTATION: &[Key] = &[
    optional(
        "order",
        Accepts::Choice(SEQUENCES),
        "axes of the three `angles`, each an axis of the already turned frame",
    ),
    optional("angles", Accepts::Triple, "Euler angles about the axes of `order`, rad").of("rad"),
    optional("axis", Accepts::Direction, "axis of the rotation by `angle`").of_any_unit(),
    optional("angle", Accepts::Expression, "angle about `axis`, rad").of("rad"),
    Z,
    X,
    optional(
        "matrix",
        Accepts::Numbers,
        "rotation matrix of numbers [[…], […], […]], row by row, such as one from a CAD system",
    ),
    optional(
        "euler_parameters",
        Accepts::Numbers,
        "Euler parameters [e0, e1, e2, e3], a unit quaternion with the scalar first",
    ),
];
const Z: Key = optional("z", Accepts::Direction, "direction of the axis z, in axes of the body, or through two points")
    .of_any_unit();
const X: Key = optional(
    "x",
    Accepts::Direction,
    "direction of the axis x; with `z`, the direction near which it is; without, z is as near as possible to that of the body",
)
.of_any_unit();

/// The axis z of a frame in its own axes.
const Z_OF_FRAME: [f64; 3] = [0.0, 0.0, 1.0];

/// Keys of a point in a table.
pub const MARKER_KEYS: &[Key] = &[
    required("body", Accepts::Name, "name of a body or beam node, or \"ground\""),
    optional("at", Accepts::Place, "position [x, y, z] in m, in axes fixed to it; or where this point is at the start")
        .of("m"),
    Z,
    X,
    optional("orientation", Accepts::Table, "orientation of the axes of the point, relative to the body"),
];

/// Keys of a joint that place both of its points at once.
pub const SHARED_KEYS: &[Key] = &[
    optional(
        "at",
        Accepts::Place,
        "place of the joint at the start, in world axes or as a named point, for those of `a` and `b` that name a body only",
    )
    .of("m"),
    optional(
        "axis",
        Accepts::Direction,
        "axis z of both points in world axes at the start; by default z of the bodies",
    )
    .of_any_unit(),
    optional(
        "axis_b",
        Accepts::Direction,
        "axis z of `b`, if it differs from that of `a`, as in universal and constant-velocity joints; its axes are those of `a`, rotated by \
         the smallest angle that gives z this direction",
    )
    .of_any_unit(),
    optional(
        "x",
        Accepts::Direction,
        "direction in world axes near which the axis x of both points is at the start; without `axis`, x has exactly this direction, and z is as \
         near as possible to that of the bodies",
    )
    .of_any_unit(),
];

const SEQUENCES: &[&str] = &["xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys {
        name: "orientation3",
        kind: None,
        about: "an orientation: `order` and `angles`, `axis` and `angle`, `z` and `x`, `matrix`, or `euler_parameters`",
        keys: ORIENTATION,
    },
    TableKeys {
        name: "marker3",
        kind: None,
        about: "a point with axes, as the points of joints and forces",
        keys: MARKER_KEYS,
    },
];

impl Parts {
    /// A point at `key`: coordinates, or the name of a point.
    pub fn place(&self, section: &Section<'_>, key: &str, names: &Names, scope: &Scope) -> Read<Option<PointSpec>> {
        let Some(value) = section.get(key) else { return Ok(None) };
        if let DeValue::String(name) = value.get_ref() {
            return self.named_point(name, value).map(|k| Some(PointSpec::Point(k)));
        }
        section.vector(key, names, scope).map(|v| Some(PointSpec::Coordinates(v)))
    }

    fn named_point(&self, name: &str, value: &Value<'_>) -> Read<usize> {
        if let Some(NamedPart::Point(k)) = self.get(name) {
            return Ok(*k);
        }
        let known = self.order.iter().filter(|name| matches!(self.get(name), Some(NamedPart::Point(_))));
        Err(Diagnostic::unknown(value.span(), "point", name, known.map(String::as_str)))
    }

    /// A direction at `key`: components, or the names of two points.
    pub fn direction(&self, section: &Section<'_>, key: &str, names: &Names) -> Read<Option<Direction>> {
        let Some(value) = section.get(key) else { return Ok(None) };
        let ends = value.get_ref().as_array().filter(|list| list.len() == 2);
        if let Some(ends) = ends {
            let end = |k: usize| match ends[k].get_ref() {
                DeValue::String(name) => self.named_point(name, &ends[k]),
                _ => Err(wrong_type(&ends[k], &format!("an end of `{key}`"), "the name of a point")),
            };
            let [a, b] = [end(0)?, end(1)?];
            if a == b {
                return Err(Diagnostic::new(value.span(), format!("`{key}` has length zero")).help("name two points"));
            }
            return Ok(Some(Direction::Through([a, b])));
        }
        let components: Vector = section.vector(key, names, &Scope::MOTION)?;
        if components.iter().all(|c| c.as_constant() == Some(0.0)) {
            let error = Diagnostic::new(value.span(), format!("`{key}` has length zero"));
            return Err(error.label("no direction").help("give a direction such as [0, 0, 1]"));
        }
        Ok(Some(Direction::Components(components)))
    }

    /// The orientation in the table at `key`.
    pub fn orientation(&self, section: &Section<'_>, key: &str, names: &Names) -> Read<Option<Axes>> {
        let Some(inner) = section.inner(key, &[ORIENTATION])? else { return Ok(None) };
        let forms = [
            ("angles", "order", &["order", "angles"][..]),
            ("angle", "axis", &["axis", "angle"]),
            ("z", "", &["z", "x"]),
            ("x", "", &["x", "z"]),
            ("matrix", "", &["matrix"]),
            ("euler_parameters", "", &["euler_parameters"]),
        ];
        let help = "give `order` and `angles`, `axis` and `angle`, `z` and `x`, `matrix`, or `euler_parameters`";
        let Some((main, with, keys)) = forms.into_iter().find(|(main, ..)| inner.has(main)) else {
            return Err(section.error_at(key, "this orientation lacks its angles or axes").help(help));
        };
        let extra = ORIENTATION.iter().find(|known| inner.has(known.name) && !keys.contains(&known.name));
        if let Some(extra) = extra {
            return Err(inner
                .error_at(extra.name, format!("`{main}` and `{}` exclude each other", extra.name))
                .help(help));
        }
        if !with.is_empty() && !inner.has(with) {
            let remedy = match with {
                "order" => "there are many conventions: order = \"zyx\" is yaw, pitch and roll",
                _ => help,
            };
            return Err(inner.error_at(main, format!("`{main}` needs `{with}`")).help(remedy));
        }
        Ok(Some(match main {
            "angles" => {
                let choices: Vec<_> = SEQUENCES.iter().copied().zip(EulerSequence::ALL).collect();
                Axes::Angles(inner.choice("order", &choices)?, inner.vector("angles", names, &Scope::MOTION)?)
            }
            "angle" => {
                let axis = self.direction(&inner, "axis", names)?.expect("the key is there");
                Axes::About(axis, inner.expression("angle", names, &Scope::MOTION)?)
            }
            "matrix" => Axes::Fixed(matrix(&inner, names)?),
            "euler_parameters" => {
                let e: [CompiledExpression; 4] = inner.vector("euler_parameters", names, &Scope::MOTION)?;
                let numbers: Option<Vec<f64>> = e.iter().map(CompiledExpression::as_constant).collect();
                let length = numbers.map_or(1.0, |e| e.iter().map(|e| e * e).sum::<f64>().sqrt());
                if (length - 1.0).abs() > 1e-3 {
                    let message = format!("these are no Euler parameters: their length is {length:.4}, and must be 1");
                    return Err(inner
                        .error_at("euler_parameters", message)
                        .help("give the scalar first: [1, 0, 0, 0]"));
                }
                Axes::EulerParameters(e)
            }
            _ => self.axes(&inner, "z", names)?.unwrap_or(Axes::Same),
        }))
    }

    /// The axes by the direction at the key `z` and, near it, `x`.
    fn axes(&self, section: &Section<'_>, z: &str, names: &Names) -> Read<Option<Axes>> {
        let (main, near) = (self.direction(section, z, names)?, self.direction(section, "x", names)?);
        Ok(match (main, near) {
            (None, None) => None,
            (None, Some(x)) => {
                if let Direction::Components(x) = &x
                    && z == Z.name
                    && are_parallel(x, &Z_OF_FRAME.map(CompiledExpression::constant))
                {
                    let error =
                        section.error_at("x", "with `x` alone the axis z is near z of the body, which is along x");
                    return Err(error.help("give the direction `z`, too"));
                }
                Some(Axes::X(x))
            }
            (Some(z), x) => {
                if let (Direction::Components(z), Some(Direction::Components(x))) = (&z, &x)
                    && are_parallel(z, x)
                {
                    let error = section.error_at("x", "the axes x and z are parallel");
                    return Err(error.help("give a direction x that is not along z; it need not be perpendicular"));
                }
                Some(Axes::Z(z, x))
            }
        })
    }

    /// The point with axes at `key` of a part; keys in `shared` hold for several points of the part.
    pub fn marker(&self, section: &Section<'_>, key: &str, names: &Names, shared: &[Key]) -> Read<MarkerSpec> {
        let value = section.get(key).expect("the key is required");
        let mut marker = self.marker_of(value, key, names, section.source())?;
        if shared.is_empty() {
            return Ok(marker.0);
        }
        let (has_place, has_axes) = marker.1;
        if let (Some(place), false) = (self.place(section, "at", names, &Scope::DESIGN)?, has_place) {
            (marker.0.place, marker.0.is_world_place) = (place, true);
        }
        let bent = if key == "b" { self.direction(section, "axis_b", names)? } else { None };
        let axes = match (self.axes(section, "axis", names)?, bent) {
            (axes, Some(z)) => Some(Axes::Bent(Box::new(axes.unwrap_or(Axes::Same)), z)),
            (axes, None) => axes,
        };
        if let (Some(axes), false) = (axes, has_axes) {
            (marker.0.axes, marker.0.is_world_axes) = (axes, true);
        }
        Ok(marker.0)
    }

    /// A point, and whether it has a position and axes of its own.
    fn marker_of(
        &self,
        value: &Value<'_>,
        key: &str,
        names: &Names,
        source: FileSource<'_>,
    ) -> Read<(MarkerSpec, (bool, bool))> {
        match value.get_ref() {
            DeValue::String(name) => {
                if let Some(NamedPart::Point(k)) = self.get(name) {
                    return Ok((self.markers[*k].clone(), (true, self.markers[*k].has_axes())));
                }
                Ok((MarkerSpec::of(self.frame(name, &value.span())?), (false, false)))
            }
            DeValue::Table(_) => {
                let inner = Section::open(value, &format!("`{key}`"), &[MARKER_KEYS], source)?;
                let body = inner.need_word("body")?;
                let marker = self.marker_in(&inner, self.frame(&body.text, &body.span)?, names)?;
                let has = (inner.has("at"), marker.has_axes());
                Ok((marker, has))
            }
            _ => Err(wrong_type(value, &format!("`{key}`"), "a name, or a table { body = …, at = [x, y, z] }")),
        }
    }

    /// The point that a table with [`MARKER_KEYS`] describes.
    pub fn marker_in(&self, section: &Section<'_>, frame: FrameRef, names: &Names) -> Read<MarkerSpec> {
        let mut marker = MarkerSpec::of(frame);
        if let Some(place) = self.place(section, "at", names, &Scope::DESIGN)? {
            marker.place = place;
        }
        let (axes, orientation) = (self.axes(section, "z", names)?, self.orientation(section, "orientation", names)?);
        if axes.is_some() && orientation.is_some() {
            return Err(section.error_at("orientation", "`orientation` excludes `z` and `x` beside it"));
        }
        marker.axes = axes.or(orientation).unwrap_or(Axes::Same);
        Ok(marker)
    }
}

/// Returns whether two directions are numbers, and parallel.
pub(super) fn are_parallel(a: &Vector, b: &Vector) -> bool {
    let (Some(a), Some(b)) = (numbers(a), numbers(b)) else { return false };
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    length(&cross) <= 1e-9 * length(&a) * length(&b)
}

/// The cosine of the angle between two directions, if they are numbers.
pub(super) fn cosine(a: &Vector, b: &Vector) -> Option<f64> {
    let (a, b) = (numbers(a)?, numbers(b)?);
    Some(a.iter().zip(&b).map(|(a, b)| a * b).sum::<f64>() / (length(&a) * length(&b)))
}

fn numbers(v: &Vector) -> Option<Vec<f64>> {
    v.iter().map(CompiledExpression::as_constant).collect()
}

fn length(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The rotation of a matrix of numbers, as Euler parameters.
fn matrix(section: &Section<'_>, names: &Names) -> Read<[f64; 4]> {
    let value = section.get("matrix").expect("the key is there");
    let wanted = "three rows [[…], […], […]] of three numbers";
    let rows = value.get_ref().as_array().filter(|rows| rows.len() == 3);
    let rows = rows.ok_or_else(|| wrong_type(value, "`matrix`", wanted))?;
    let row = |k: usize| -> Read<[f64; 3]> {
        let row: Vector = vector(&rows[k], "matrix", names, &Scope { units: "1", ..Scope::NUMBER }, section.source())?;
        Ok(row.map(|x| x.as_constant().expect("an expression of constants is folded")))
    };
    let rotation = Rotation::<f64>::from_matrix([row(0)?, row(1)?, row(2)?]);
    rotation.map(Rotation::parameters).map_err(|error| section.error_at("matrix", error.to_string()))
}

/// Components along the axes of a pose of a world vector.
fn along<S: Scalar>(pose: &Pose3<S>, v: [S; 3]) -> [S; 3] {
    pose.orientation.inverse().rotate(v)
}

fn difference<S: Scalar>(a: [S; 3], b: [S; 3]) -> [S; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

impl<S: Scalar> BuildContext<S> {
    /// The numbers of expressions of the design, at the time at which the motion starts.
    pub fn numbers<const N: usize>(&self, all: &[CompiledExpression; N], b: &[S]) -> [S; N] {
        all.each_ref().map(|e| e.value(&Inputs::at(b, self.start)))
    }

    /// Coordinates of a point along the axes of a frame with this pose.
    pub fn place(&mut self, pose: &Pose3<S>, place: &PointSpec, b: &[S]) -> [S; 3] {
        match place {
            PointSpec::Coordinates(v) => self.numbers(v, b),
            PointSpec::Point(k) => {
                let point = self.point_at_start(*k, b);
                along(pose, difference(point, pose.position))
            }
        }
    }

    /// World coordinates of a named point at the start.
    fn point_at_start(&mut self, k: usize, b: &[S]) -> [S; 3] {
        let marker = self.markers[k].clone();
        let marker = self.marker3(&marker, b);
        self.mechanism.pose3(marker.body).point(marker.point)
    }

    fn direction(&mut self, pose: &Pose3<S>, direction: &Direction, b: &[S]) -> [S; 3] {
        match direction {
            Direction::Components(v) => self.numbers(v, b),
            Direction::Through([from, to]) => {
                let gap = difference(self.point_at_start(*to, b), self.point_at_start(*from, b));
                along(pose, gap)
            }
        }
    }

    /// An orientation relative to a frame with this pose.
    pub fn rotation(&mut self, pose: &Pose3<S>, axes: &Axes, b: &[S]) -> Rotation<S> {
        match axes {
            Axes::Same => Rotation::identity(),
            Axes::Angles(sequence, angles) => Rotation::euler_angles(*sequence, self.numbers(angles, b)),
            Axes::About(axis, angle) => {
                let axis = self.direction(pose, axis, b);
                Rotation::about(axis, angle.value(&Inputs::at(b, self.start)))
            }
            Axes::Z(z, None) => Rotation::z_along(self.direction(pose, z, b)),
            Axes::Z(z, Some(x)) => Rotation::from_z_x(self.direction(pose, z, b), self.direction(pose, x, b)),
            Axes::X(x) => Rotation::from_x_z(self.direction(pose, x, b), Z_OF_FRAME.map(S::from)),
            Axes::Bent(from, z) => {
                let from = self.rotation(pose, from, b);
                from.then(Rotation::z_along(from.inverse().rotate(self.direction(pose, z, b))))
            }
            Axes::EulerParameters(e) => Rotation::euler_parameters(self.numbers(e, b)),
            Axes::Fixed(e) => Rotation::euler_parameters(e.map(S::from)),
        }
    }

    /// The body of a reference in space.
    pub fn frame3(&mut self, frame: FrameRef) -> Body3 {
        match frame {
            FrameRef::Ground => self.mechanism.ground3(),
            FrameRef::Body(k) => self.bodies3[k],
            FrameRef::Node(beam, node) => self.beams3[beam].0[node],
        }
    }

    /// A point with axes.
    pub fn marker3(&mut self, marker: &MarkerSpec, b: &[S]) -> Marker3<S> {
        let body = self.frame3(marker.frame);
        let (pose, world) = (self.mechanism.pose3(body), Pose3::at([S::from(0.0); 3]));
        let point = if marker.is_world_place {
            let point = self.place(&world, &marker.place, b);
            along(&pose, difference(point, pose.position))
        } else {
            self.place(&pose, &marker.place, b)
        };
        let orientation = match &marker.axes {
            // The axis z is near that of the body.
            Axes::X(x) if marker.is_world_axes => {
                let x = self.direction(&world, x, b);
                Rotation::from_x_z(along(&pose, x), Z_OF_FRAME.map(S::from))
            }
            axes if marker.is_world_axes => pose.orientation.inverse().then(self.rotation(&world, axes, b)),
            axes => self.rotation(&pose, axes, b),
        };
        Marker3 { body, point, orientation }
    }
}
