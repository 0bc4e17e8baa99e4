//! Forces and torques that depend on time and motion.

use super::motion::{JumpsAt, remark_jumps};
use super::parts::{BuildContext, CoordinateRef, FrameCoordinate, NamedPart, Parts, PointRef, position_or_push};
use super::section::{Read, Section};
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::elements::StateFunction;
use mechanics::mechanism::Coordinate;
use std::cell::RefCell;

/// A force or torque whose parameters are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct Feedback {
    law: ObservedFormula,
    observed: Vec<CoordinateRef>,
    parameters: Vec<CompiledExpression>,
}

/// A formula of parameters, time, and positions and velocities of observed coordinates and points.
#[derive(Clone, Debug)]
pub struct ObservedFormula {
    expression: CompiledExpression,
    inputs: Vec<MotionInput>,
}

/// A motion input of a formula; coordinates are indices of observed ones.
#[derive(Clone, Debug)]
struct MotionInput {
    of: Observed,
    is_rate: bool,
}

#[derive(Clone, Debug)]
enum Observed {
    Coordinate(usize),
    /// A point of a body: x (0) or y (1), the coordinates of the body, and the position in its axes.
    Point {
        axis: usize,
        body: [usize; 3],
        at: [CompiledExpression; 2],
    },
}

impl MotionInput {
    fn value<T: Scalar>(&self, p: &[T], q: &[T], v: &[T]) -> T {
        match &self.of {
            Observed::Coordinate(k) => {
                if self.is_rate {
                    v[*k]
                } else {
                    q[*k]
                }
            }
            Observed::Point { axis, body, at } => {
                let [x, y] = at.each_ref().map(|expression| expression.value(&Inputs::design(p)));
                let (sin, cos) = q[body[2]].sin_cos();
                let lever = [cos * x - sin * y, sin * x + cos * y];
                match (self.is_rate, *axis) {
                    (false, axis) => q[body[axis]] + lever[axis],
                    (true, 0) => v[body[0]] - v[body[2]] * lever[1],
                    (true, _) => v[body[1]] + v[body[2]] * lever[0],
                }
            }
        }
    }

    fn expressions(&mut self) -> impl Iterator<Item = &mut CompiledExpression> {
        match &mut self.of {
            Observed::Coordinate(_) => [].iter_mut(),
            Observed::Point { at, .. } => at.iter_mut(),
        }
    }
}

/// Number of motion inputs up to which an evaluation needs no heap allocation.
const FEW: usize = 16;

impl StateFunction for ObservedFormula {
    fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
        let input = |input: &MotionInput| input.value(p, q, v);
        let value = |others: &[T]| self.expression.value(&Inputs { design: p, time: t, others });
        if self.inputs.len() > FEW {
            return value(&self.inputs.iter().map(input).collect::<Vec<T>>());
        }
        let mut few = [T::from(0.0); FEW];
        few.iter_mut().zip(&self.inputs).for_each(|(to, from)| *to = input(from));
        value(&few[..self.inputs.len()])
    }
}

/// The force or torque at `key` of a section.
pub fn read(section: &Section<'_>, key: &str, names: &Names, parts: &Parts) -> Read<Feedback> {
    let found = RefCell::<Vec<(String, NamedMotion)>>::default();
    let others = |text: &str| {
        let mut found = found.borrow_mut();
        if let Some(k) = found.iter().position(|(known, _)| known == text) {
            return Some(k);
        }
        found.push((text.to_owned(), find(text, parts)?));
        Some(found.len() - 1)
    };
    let suggestions = || suggestions(parts);
    let scope = Scope { others: &others, suggestions: &suggestions, ..Scope::MOTION };
    let expression = section.expression(key, names, &scope)?;
    if let Some(value) = section.get(key) {
        remark_jumps(section, &expression, &value.span(), JumpsAt::Motion);
    }
    let mut observed = vec![];
    let mut inputs: Vec<MotionInput> = found
        .into_inner()
        .into_iter()
        .map(|(_, NamedMotion { of, is_rate })| {
            let of = match of {
                MotionOf::Coordinate(place) => Observed::Coordinate(position_or_push(&mut observed, place)),
                MotionOf::Point(PointRef { frame, at }, axis) => {
                    let place = |axis| position_or_push(&mut observed, CoordinateRef::Of(frame, axis));
                    let body = [FrameCoordinate::X, FrameCoordinate::Y, FrameCoordinate::Theta].map(place);
                    Observed::Point { axis, body, at }
                }
            };
            MotionInput { of, is_rate }
        })
        .collect();
    let mut used = expression.uses();
    used.extend(inputs.iter_mut().flat_map(MotionInput::expressions).flat_map(|at| at.uses()));
    used.sort_unstable();
    used.dedup();
    let expression = expression.with_design(&used);
    inputs.iter_mut().flat_map(MotionInput::expressions).for_each(|at| *at = at.clone().with_design(&used));
    let parameters = used.iter().map(|&i| CompiledExpression::variable(i)).collect();
    Ok(Feedback { law: ObservedFormula { expression, inputs }, observed, parameters })
}

impl Feedback {
    /// The formula, its parameters, and the coordinates that it observes.
    pub fn build<S: Scalar>(
        &self,
        context: &mut BuildContext<S>,
        b: &[S],
    ) -> (ObservedFormula, Vec<S>, Vec<Coordinate>) {
        let parameters = self.parameters.iter().map(|expression| expression.value(&Inputs::design(b))).collect();
        (self.law.clone(), parameters, self.observed.iter().map(|&place| context.coordinate(place)).collect())
    }
}

/// Names of velocities and of their coordinates.
const RATES: [(&str, &str); 3] = [("vx", "x"), ("vy", "y"), ("omega", "theta")];

/// The quantity that a name stands for: a position, or its rate.
struct NamedMotion {
    of: MotionOf,
    is_rate: bool,
}

enum MotionOf {
    Coordinate(CoordinateRef),
    /// x (0) or y (1) of a point.
    Point(PointRef, usize),
}

/// The motion of a name: `crank.theta`, `cart.position`, `tip.x`, or a rate such as `crank.omega`, `cart.velocity`, `tip.vx`.
fn find(text: &str, parts: &Parts) -> Option<NamedMotion> {
    let (owner, what) = text.rsplit_once('.')?;
    if let Some(NamedPart::Slider(k)) = parts.get(owner) {
        let of = MotionOf::Coordinate(CoordinateRef::Slider(*k));
        return matches!(what, "position" | "velocity").then_some(NamedMotion { of, is_rate: what == "velocity" });
    }
    if parts.is_spatial {
        return in_space(text, parts);
    }
    let rate = RATES.iter().find(|(rate, _)| *rate == what);
    let (is_rate, what) = (rate.is_some(), rate.map_or(what, |(_, position)| position));
    if let Some(NamedPart::Point(k)) = parts.get(owner) {
        let point = &parts.points[*k];
        let of = match what {
            "x" => MotionOf::Point(point.clone(), 0),
            "y" => MotionOf::Point(point.clone(), 1),
            "theta" => MotionOf::Coordinate(CoordinateRef::Of(point.frame, FrameCoordinate::Theta)),
            _ => return None,
        };
        return Some(NamedMotion { of, is_rate });
    }
    let of = MotionOf::Coordinate(parts.find_coordinate(&format!("{owner}.{what}"))?);
    Some(NamedMotion { of, is_rate })
}

/// The motion of a name in space: `hinge.angle`, `arm.x` of a reference point, or a rate such as `hinge.omega`, `arm.vx`.
fn in_space(text: &str, parts: &Parts) -> Option<NamedMotion> {
    let (owner, what) = text.rsplit_once('.')?;
    let of_joint = parts.joint_coordinates(owner).find_map(|(place, names)| {
        let order = names.iter().position(|name| name == text).filter(|order| *order < 2)?;
        Some(NamedMotion { of: MotionOf::Coordinate(place), is_rate: order == 1 })
    });
    of_joint.or_else(|| {
        let (is_rate, axis) = what.strip_prefix('v').map_or((false, what), |axis| (true, axis));
        let is_frame = parts.find_frame(owner).is_some() && matches!(axis, "x" | "y" | "z");
        let place = parts.find_coordinate(&format!("{owner}.{axis}")).filter(|_| is_frame)?;
        Some(NamedMotion { of: MotionOf::Coordinate(place), is_rate })
    })
}

fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(NamedPart::Element(..)) => {
                parts.joint_coordinates(name).flat_map(|(_, [position, rate, _])| [position, rate]).collect()
            }
            Some(NamedPart::Frame(_)) if parts.is_spatial => all(&["x", "y", "z", "vx", "vy", "vz"]),
            Some(NamedPart::Slider(_)) => all(&["position", "velocity"]),
            Some(NamedPart::Frame(_) | NamedPart::Point(_)) => all(&["x", "y", "theta", "vx", "vy", "omega"]),
            _ => vec![],
        }
    };
    parts.order.iter().flat_map(of).collect()
}
