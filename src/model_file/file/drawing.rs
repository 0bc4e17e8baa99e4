//! The mechanism of a file in motion, as drawings of its bodies, joints and springs.

use super::Model;
use super::beams::BeamSpec;
use super::bodies::BodyKind;
use super::drawing3::{self, DrawnMechanism3};
use super::element_spec::{ElementSpec, InputSpec};
use super::events::came_apart;
use super::measures::MeasureRef;
use super::mechanism::{MechanismSpec, MechanismTemplate};
use super::outputs::OutputSpec;
use super::parts::{CoordinateRef, FrameCoordinate, FrameRef, NamedPart, PointRef};
use super::symbols;
use crate::Result;
use crate::model_file::expression::{CompiledExpression, Inputs};
use crate::problem::TimeGrid;
use crate::report::plots::Linkage;
use mechanics::elements::{Symbol, profile_curve};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Least number of frames of a motion; a coarser time grid is refined for the drawing.
const FEWEST: usize = 40;
/// Largest number of frames.
const MOST: usize = 240;
/// Largest number of values of drawn outputs, with a derivative of each by each variable, that are computed with the outputs of a model.
const WITH_OUTPUTS: usize = 2_000_000;
/// Number of line segments of a profile.
const CURVE: usize = 72;
/// Number of intervals between the arrows of a distributed load.
const LOAD_ARROWS: usize = 6;

impl Model {
    /// The time points of the model, if it has any.
    pub fn grid(&self) -> Option<&TimeGrid> {
        self.grid.as_ref()
    }

    /// Name of the time, or of the quantity of a sweep, in expressions.
    pub fn axis(&self) -> &str {
        &self.axis
    }

    /// Times for a drawing of the motion, if there is a mechanism: at most 240 of the model's own, or 121 equally
    /// spaced ones if it has fewer than 40.
    pub fn drawing_times(&self) -> Option<Vec<f64>> {
        let (mechanism, grid) = (self.mechanism.as_ref()?, self.grid.as_ref()?);
        let points = &grid.points;
        if points.len() < 2 {
            return None;
        }
        if points.len() < FEWEST && mechanism.1.is_motion() {
            let (first, span) = (points[0], grid.span());
            return Some((0..=120).map(|k| first + span * f64::from(k) / 120.0).collect());
        }
        Some(points.iter().copied().step_by(points.len().div_ceil(MOST)).collect())
    }

    /// Returns whether there is a mechanism whose drawings show a motion in time: not load cases of statics.
    pub fn draws_motion(&self) -> bool {
        self.mechanism.as_ref().is_some_and(|mechanism| mechanism.1.is_motion())
    }

    /// The mechanism of each design at the given times; none without a mechanism.
    ///
    /// A body is drawn as a bar or a plate through its joints and points, a point mass as a disc, a body of one coordinate as
    /// a block on a guide, a beam by its true thickness with its largest normal stress |N|/A + |M|/W in colour, or as a line through its nodes
    /// if its cross-section is given by stiffnesses.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn drawings(&self, designs: &[&[f64]], times: &[f64]) -> Result<Option<Vec<Vec<Linkage>>>> {
        self.drawn(designs, times, Released::Omitted)
    }

    /// The mechanism of a design at the given times, in drawings that all have the same parts: a released joint stays closed at its first point, on the
    /// body there.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn frames(&self, design: &[f64], times: &[f64]) -> Result<Option<Vec<Linkage>>> {
        Ok(self.drawn(&[design], times, Released::AtFirstPoint)?.and_then(|mut all| all.pop()))
    }

    fn drawn(&self, designs: &[&[f64]], times: &[f64], released: Released) -> Result<Option<Vec<Vec<Linkage>>>> {
        let Some((spec, settings)) = &self.mechanism else { return Ok(None) };
        let outputs = Arc::new(spec.drawn_outputs());
        let places = |design: &&[f64]| {
            settings.sampled(MechanismTemplate::new(spec, &outputs), self.grid.as_ref(), times, design)
        };
        let places: Vec<Vec<Vec<f64>>> = designs.iter().map(places).collect::<Result<_>>()?;
        draw(spec, designs, &places, released).map(Some)
    }

    /// This model with the outputs from which its drawings are made after its own: one analysis gives both. `None` for these outputs if there is
    /// no mechanism, if the drawings have other time points than the model, or if they were a large part of the memory of the analysis.
    pub fn with_drawn_outputs(self) -> (Self, Option<DrawnOutputs>) {
        let Some(((spec, _), times)) = self.mechanism.as_ref().zip(self.drawing_times()) else { return (self, None) };
        let grid = self.grid.as_ref().map_or(&[][..], |grid| &grid.points);
        let places = spec.drawn_outputs();
        let points = times.iter().map(|time| grid.binary_search_by(|at| at.total_cmp(time)).ok()).collect();
        match points {
            Some(points) if places.len() * grid.len() * (1 + self.variables.len()) <= WITH_OUTPUTS => {
                let first = self.outputs.len();
                let outputs = self.outputs.iter().cloned().chain(places).collect();
                (Self { outputs: Arc::new(outputs), ..self }, Some(DrawnOutputs { first, points }))
            }
            _ => (self, None),
        }
    }

    /// The [frames](Self::frames) of a design from the values of all outputs of a model [with drawn outputs](Self::with_drawn_outputs).
    ///
    /// # Errors
    /// If an orientation at this design is not a rotation.
    pub fn frames_of(&self, drawn: &DrawnOutputs, design: &[f64], values: &[Vec<f64>]) -> Result<Vec<Linkage>> {
        let Some((spec, _)) = &self.mechanism else { return Ok(vec![]) };
        let at_points = |series: &Vec<f64>| drawn.points.iter().map(|&p| series[p]).collect();
        let places = values[drawn.first..].iter().map(at_points).collect();
        Ok(draw(spec, &[design], &[places], Released::AtFirstPoint)?.pop().unwrap_or_default())
    }
}

/// The outputs of a model from which its drawings are made.
#[derive(Debug)]
pub struct DrawnOutputs {
    /// Index of the first of them, which is the number of the outputs of the file.
    pub first: usize,
    /// Indices of the time points that are drawn.
    points: Vec<usize>,
}

impl MechanismSpec {
    /// The outputs from which the mechanism is drawn.
    fn drawn_outputs(&self) -> Vec<OutputSpec> {
        let measures = if self.parts.is_spatial { drawing3::measures(self) } else { measures(self) };
        let output = |(k, measure)| OutputSpec::of_measure(format!("place {k}"), measure);
        measures.into_iter().enumerate().map(output).collect()
    }
}

/// The drawing of a joint that was released and has come apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Released {
    /// Not at all.
    Omitted,
    /// Closed at its first point, or at the one on the ground.
    AtFirstPoint,
}

/// The drawings of each design from the values of the drawn outputs, `places[design][output][point]`.
fn draw(
    spec: &Arc<MechanismSpec>,
    designs: &[&[f64]],
    places: &[Vec<Vec<f64>>],
    released: Released,
) -> Result<Vec<Vec<Linkage>>> {
    if spec.parts.is_spatial {
        let one = |(design, places): (&&[f64], &Vec<Vec<f64>>)| {
            Ok(DrawnMechanism3::new(spec, design)?.draw(places, released))
        };
        return designs.iter().zip(places).map(one).collect();
    }
    let mechanisms: Vec<DrawnMechanism<'_>> = designs.iter().map(|design| DrawnMechanism::new(spec, design)).collect();
    let motions: Vec<_> = mechanisms.iter().zip(places).map(|(mechanism, places)| mechanism.states(places)).collect();
    // Guides are drawn at the same place in all frames.
    let ranges = GuideRanges::of(&motions);
    Ok(motions.iter().map(|motion| motion.iter().map(|state| state.draw(&ranges, released)).collect()).collect())
}

/// Frames that move, in the order of the drawn outputs: bodies other than sliders, and nodes.
fn moving_frames(spec: &MechanismSpec) -> Vec<FrameRef> {
    let bodies = spec.bodies.iter().filter(|body| body.kind != BodyKind::Slider).count();
    let nodes = |(beam, b): (usize, &BeamSpec)| (0..=b.elements).map(move |k| FrameRef::Node(beam, k));
    (0..bodies).map(FrameRef::Body).chain(spec.beams.iter().enumerate().flat_map(nodes)).collect()
}

/// x, y and rotation of every frame, the positions of one-coordinate bodies, and normal force and moment at all nodes of beams with a known
/// cross-section.
fn measures(spec: &MechanismSpec) -> Vec<MeasureRef> {
    let sliders = spec.bodies.iter().filter(|body| body.kind == BodyKind::Slider).count();
    let frames = moving_frames(spec);
    let of_frame = |frame: FrameRef| ["x", "y", "theta"].map(|what| MeasureRef::Frame(frame, what));
    let of_slider = |k: usize| MeasureRef::Slider(k, "position");
    let of_beam = |(b, beam): (usize, &BeamSpec)| {
        let of = move |node| ["normal_force", "moment"].map(|what| MeasureRef::Node(b, node, what));
        (0..=beam.elements).flat_map(of)
    };
    let beams = spec.beams.iter().enumerate().filter(|(_, beam)| beam.has_known_section());
    frames.into_iter().flat_map(of_frame).chain((0..sliders).map(of_slider)).chain(beams.flat_map(of_beam)).collect()
}

/// A mechanism at one design.
struct DrawnMechanism<'p> {
    spec: &'p MechanismSpec,
    design: &'p [f64],
    /// All frames that move, in the order of the outputs.
    frames: Vec<FrameRef>,
    /// Kinds of the bodies other than sliders.
    kinds: Vec<BodyKind>,
    sliders: usize,
    /// Bodies that move freely after a release.
    flying: Vec<FrameRef>,
    /// Numbers of the joints that are released.
    released: Vec<usize>,
}

/// Poses of all frames and positions of all sliders at one time.
#[derive(Clone)]
struct DrawnState<'s> {
    mechanism: &'s DrawnMechanism<'s>,
    poses: Vec<[f64; 3]>,
    sliders: Vec<f64>,
    /// Normal force and moment at the nodes of beams with a known cross-section.
    forces: Vec<[f64; 2]>,
    /// Numbers of the released joints that have come apart.
    apart: Vec<usize>,
}

impl<'p> DrawnMechanism<'p> {
    fn new(spec: &'p MechanismSpec, design: &'p [f64]) -> Self {
        let kinds: Vec<BodyKind> = spec.bodies.iter().map(|b| b.kind).filter(|k| *k != BodyKind::Slider).collect();
        let (flying, released) = (spec.flying_bodies(), spec.released_joints());
        let sliders = spec.bodies.len() - kinds.len();
        Self { spec, design, frames: moving_frames(spec), sliders, kinds, flying, released }
    }

    /// The states at all times, from the values of the drawn outputs.
    fn states(&self, values: &[Vec<f64>]) -> Vec<DrawnState<'_>> {
        let n = self.frames.len();
        let state = |p: usize| DrawnState {
            mechanism: self,
            poses: (0..n).map(|k| [0, 1, 2].map(|i| values[3 * k + i][p])).collect(),
            sliders: values[3 * n..][..self.sliders].iter().map(|v| v[p]).collect(),
            forces: values[3 * n + self.sliders..].chunks_exact(2).map(|pair| [pair[0][p], pair[1][p]]).collect(),
            apart: vec![],
        };
        let mut states: Vec<DrawnState<'_>> = (0..values.first().map_or(0, Vec::len)).map(state).collect();
        for &joint in &self.released {
            let distances: Vec<f64> = states.iter().map(|state| state.distance_of_points(joint)).collect();
            let is_apart = came_apart(&distances);
            states.iter_mut().zip(is_apart).filter(|(_, is_apart)| *is_apart).for_each(|(s, _)| s.apart.push(joint));
        }
        states
    }

    fn local(&self, point: &PointRef) -> [f64; 2] {
        point.at.each_ref().map(|expression| expression.value(&Inputs::design(self.design)))
    }

    /// Sliding joints: the two points and the angle of the line on the first body.
    fn sliding(&self) -> impl Iterator<Item = (&PointRef, &PointRef, f64)> {
        let one = |part: &'p ElementSpec| {
            let (mut points, line) = (part.points(), part.numbers().next()?);
            Some((points.next()?, points.next()?, line.value(&Inputs::design(self.design))))
        };
        self.spec.elements.iter().filter(|part| part.symbol() == Symbol::Guide).filter_map(one)
    }

    /// Attachment points of elements on a body and its named points, without repetitions.
    fn points_of(&self, body: usize) -> Vec<[f64; 2]> {
        let attached = self.spec.elements.iter().flat_map(ElementSpec::points).chain(&self.spec.parts.points);
        let mut points: Vec<[f64; 2]> = vec![];
        for point in attached.filter(|point| point.frame == FrameRef::Body(body)) {
            let at = self.local(point);
            if points.iter().all(|p| (p[0] - at[0]).hypot(p[1] - at[1]) > 1e-9) {
                points.push(at);
            }
        }
        points
    }
}

/// Ranges of sliding points and sliders over all motions.
struct GuideRanges {
    guides: Vec<[f64; 2]>,
    sliders: [f64; 2],
    /// Lowest height of all bodies.
    floor: f64,
    /// Length of the arrows of loads and drives.
    arrow: f64,
    /// Largest stress of all beams.
    stress: f64,
    /// Centre of all drawn points, and half the larger side of the window around them.
    centre: [f64; 2],
    half: f64,
}

impl GuideRanges {
    fn of(motions: &[Vec<DrawnState<'_>>]) -> Self {
        const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let widened = |[low, high]: [f64; 2], by: f64| {
            let margin = (by * (high - low)).max(0.02 * low.abs().max(high.abs())).max(1e-3);
            [low - margin, high + margin]
        };
        let grown = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
        let count = motions.iter().flatten().next().map_or(0, |i| i.mechanism.sliding().count());
        let mut guides = vec![NOTHING; count];
        let (mut sliders, mut floor) = (NOTHING, 0.0f64);
        for state in motions.iter().flatten() {
            for (guide, place) in guides.iter_mut().zip(state.along_guides()) {
                *guide = grown(*guide, place);
            }
            sliders = state.sliders.iter().fold(sliders, |range, v| grown(range, *v));
            floor = state.poses.iter().fold(floor, |low, pose| low.min(pose[1]));
        }
        let mut frame = [NOTHING; 2];
        for state in motions.iter().flatten() {
            let corners = state.poses.iter().map(|pose| [pose[0], pose[1]]).chain(state.attachments());
            for point in corners.chain([[0.0; 2]]) {
                frame = [grown(frame[0], point[0]), grown(frame[1], point[1])];
            }
        }
        let size = frame.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let guides = guides.into_iter().map(|g| widened(g, 0.25)).collect();
        let stress =
            motions.iter().flatten().flat_map(DrawnState::stresses).flat_map(|(.., nodes)| nodes).fold(0.0, f64::max);
        let arrow = if size > 0.0 { 0.14 * size } else { 0.14 };
        Self {
            guides,
            sliders: widened(sliders, 0.2),
            floor,
            arrow,
            stress,
            centre: frame.map(|[low, high]| 0.5 * (low + high)),
            half: (0.3 * size).max(0.05),
        }
    }
}

impl DrawnState<'_> {
    fn pose(&self, frame: FrameRef) -> [f64; 3] {
        let known = self.mechanism.frames.iter().position(|f| *f == frame);
        known.map_or([0.0; 3], |k| self.poses[k])
    }

    fn position(&self, frame: FrameRef, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x0, y0, theta] = self.pose(frame);
        let (s, c) = theta.sin_cos();
        [x0 + c * x - s * y, y0 + s * x + c * y]
    }

    /// Distance of the two points of element number `k`; zero if it has fewer.
    fn distance_of_points(&self, k: usize) -> f64 {
        let mut points = self.mechanism.spec.elements[k].points().map(|point| self.point(point));
        let (Some(a), Some(b)) = (points.next(), points.next()) else { return 0.0 };
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    fn point(&self, point: &PointRef) -> [f64; 2] {
        self.position(point.frame, self.mechanism.local(point))
    }

    /// Position of each sliding point along its line.
    fn along_guides(&self) -> Vec<f64> {
        let one = |(a, b, line): (&PointRef, &PointRef, f64)| {
            let ([x0, y0], [x, y]) = (self.point(a), self.point(b));
            let (s, c) = (self.pose(a.frame)[2] + line).sin_cos();
            (x - x0) * c + (y - y0) * s
        };
        self.mechanism.sliding().map(one).collect()
    }

    /// This state with the points of an element together: the body of one of them is moved.
    fn closed(&self, part: &ElementSpec) -> Self {
        let (mut closed, mut points) = (self.clone(), part.points());
        if let (Some(a), Some(b)) = (points.next(), points.next()) {
            let [still, moved] = if b.frame == FrameRef::Ground { [b, a] } else { [a, b] };
            let ([x, y], [from_x, from_y]) = (self.point(still), self.point(moved));
            if let Some(k) = self.mechanism.frames.iter().position(|frame| *frame == moved.frame) {
                closed.poses[k][0] += x - from_x;
                closed.poses[k][1] += y - from_y;
            }
        }
        closed
    }

    fn draw(&self, ranges: &GuideRanges, released: Released) -> Linkage {
        let mut linkage = Linkage::default();
        (0..self.mechanism.kinds.len()).for_each(|body| self.draw_body(body, &mut linkage));
        self.draw_beams(ranges, &mut linkage);
        for (k, part) in self.mechanism.spec.elements.iter().enumerate() {
            if !self.apart.contains(&k) {
                self.draw_element(part, ranges, &mut linkage);
            } else if released == Released::AtFirstPoint {
                self.closed(part).draw_element(part, ranges, &mut linkage);
            }
        }
        for ((a, b, line), [from, to]) in self.mechanism.sliding().zip(&ranges.guides) {
            let ([x, y], angle) = (self.point(a), self.pose(a.frame)[2] + line);
            let (s, c) = angle.sin_cos();
            linkage.guides.push([from, to].map(|along| [x + along * c, y + along * s]));
            linkage.sliders.push((self.point(b), angle));
        }
        self.draw_slides(ranges, &mut linkage);
        let elements = &self.mechanism.spec.elements;
        linkage.arrows.extend(elements.iter().filter_map(|part| self.arrow(part, ranges)));
        self.name_parts(ranges, &mut linkage);
        linkage
    }

    /// Adds the names of bodies, beams and points at their positions, and the paths of named points and of bodies that move freely after a release.
    fn name_parts(&self, ranges: &GuideRanges, linkage: &mut Linkage) {
        let parts = &self.mechanism.spec.parts;
        for name in &parts.order {
            let at = match parts.get(name) {
                Some(NamedPart::Frame(frame @ FrameRef::Body(body)))
                    if self.mechanism.kinds[*body] != BodyKind::FixedNode =>
                {
                    self.middle(*frame, *body)
                }
                Some(NamedPart::Slider(k)) => [self.sliders[*k], self.row(*k, ranges)],
                Some(NamedPart::Beam(beam, elements)) => self.position(FrameRef::Node(*beam, elements / 2), [0.0; 2]),
                Some(NamedPart::Point(k)) => {
                    let at = self.point(&parts.points[*k]);
                    if parts.points[*k].frame != FrameRef::Ground {
                        linkage.traced.push(at);
                    }
                    at
                }
                _ => continue,
            };
            linkage.notes.push((name.clone(), at));
        }
        linkage.traced.extend(self.mechanism.flying.iter().map(|frame| self.position(*frame, [0.0; 2])));
    }

    /// The mean of the points of a body.
    fn middle(&self, frame: FrameRef, body: usize) -> [f64; 2] {
        let points = self.mechanism.points_of(body);
        let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / points.len().max(1) as f64;
        self.position(frame, [mean(0), mean(1)])
    }

    /// Beams with a known cross-section: number, half thickness, largest normal stress at each node.
    fn stresses(&self) -> impl Iterator<Item = (usize, f64, Vec<f64>)> {
        let mut rest = &self.forces[..];
        let known = self.mechanism.spec.beams.iter().enumerate().filter(|(_, beam)| beam.has_known_section());
        known.filter_map(move |(k, beam)| {
            let (own, others) = rest.split_at_checked(beam.elements + 1)?;
            rest = others;
            let [half, area, modulus] = beam.extremes(self.mechanism.design)?;
            Some((k, half, own.iter().map(|[n, m]| n.abs() / area + m.abs() / modulus).collect()))
        })
    }

    /// Positions of all points of elements.
    fn attachments(&self) -> impl Iterator<Item = [f64; 2]> {
        self.mechanism.spec.elements.iter().flat_map(ElementSpec::points).map(|point| self.point(point))
    }

    /// The arrow of a drive or load that is not drawn otherwise: along the direction of a force at its point, along a driven coordinate, or
    /// around a point for a rotation. It shows the positive direction, not the size.
    fn arrow(&self, part: &ElementSpec, ranges: &GuideRanges) -> Option<Vec<[f64; 2]>> {
        let is_load = part.inputs.iter().any(|input| matches!(input, InputSpec::Time(_) | InputSpec::State(_)));
        if !is_load || part.symbol() != Symbol::None {
            return None;
        }
        let along = |[x, y]: [f64; 2], angle: f64| {
            let (s, c) = angle.sin_cos();
            vec![[x - ranges.arrow * c, y - ranges.arrow * s], [x, y]]
        };
        let mut points = part.points();
        if let (Some(point), None, Some(direction)) = (points.next(), points.next(), part.numbers().next()) {
            return Some(along(self.point(point), direction.value(&Inputs::design(self.mechanism.design))));
        }
        let is_moving = |place: &CoordinateRef| !matches!(place, CoordinateRef::Of(FrameRef::Ground, _));
        let driven = part.coordinates().filter(is_moving).last()?;
        match driven {
            CoordinateRef::Slider(k) => Some(along([self.sliders[k], self.row(k, ranges)], 0.0)),
            CoordinateRef::Of(frame, FrameCoordinate::X) => Some(along(self.position(frame, [0.0; 2]), 0.0)),
            CoordinateRef::Of(frame, FrameCoordinate::Y) => Some(along(self.position(frame, [0.0; 2]), FRAC_PI_2)),
            CoordinateRef::Joint(..) => None,
            CoordinateRef::Of(frame, FrameCoordinate::Theta | FrameCoordinate::Z) => {
                let ([x, y], radius) = (self.hinge(frame), 0.35 * ranges.arrow);
                let at = |k: u32| {
                    let (s, c) = (-0.5 + 0.25 * f64::from(k)).sin_cos();
                    [x + radius * c, y + radius * s]
                };
                Some((0..=16).map(at).collect())
            }
        }
    }

    /// The joint of a body on the ground, or its origin if it has none.
    fn hinge(&self, frame: FrameRef) -> [f64; 2] {
        let on_ground =
            self.mechanism.spec.elements.iter().filter(|part| part.symbol() == Symbol::Pin).find_map(|part| {
                let points: Vec<&PointRef> = part.points().take(2).collect();
                let own = points.iter().find(|point| point.frame == frame)?;
                points.iter().any(|point| point.frame == FrameRef::Ground).then(|| self.point(own))
            });
        on_ground.unwrap_or_else(|| self.position(frame, [0.0; 2]))
    }

    /// Height at which a one-coordinate body is drawn.
    fn row(&self, k: usize, ranges: &GuideRanges) -> f64 {
        let [low, high] = ranges.sliders;
        ranges.floor - 0.35 * (high - low) * (k + usize::from(!self.poses.is_empty())) as f64
    }

    fn draw_body(&self, body: usize, linkage: &mut Linkage) {
        let kind = self.mechanism.kinds[body];
        let points = self.mechanism.points_of(body);
        let outline = hull(&points);
        let at =
            |points: &[[f64; 2]]| points.iter().map(|p| self.position(FrameRef::Body(body), *p)).collect::<Vec<_>>();
        let is_sliding = self.mechanism.sliding().any(|(_, b, _)| b.frame == FrameRef::Body(body));
        match outline.len() {
            _ if kind == BodyKind::FixedNode => {}
            0 | 1 if kind == BodyKind::MasslessNode => {}
            0 | 1 => {
                if let Some(point) = outline.first().filter(|p| p[0].hypot(p[1]) > 1e-9) {
                    linkage.bars.push(at(&[*point, [0.0, 0.0]]));
                }
                if !is_sliding {
                    linkage.masses.extend(at(&[[0.0, 0.0]]));
                }
            }
            2 => linkage.bars.push(at(&outline)),
            _ => linkage.plates.push(at(&outline)),
        }
    }

    fn draw_beams(&self, ranges: &GuideRanges, linkage: &mut Linkage) {
        linkage.stress = ranges.stress;
        let stresses: Vec<_> = self.stresses().collect();
        for (k, beam) in self.mechanism.spec.beams.iter().enumerate() {
            self.draw_line_loads(k, beam, ranges, linkage);
            let node = |node: usize| self.position(FrameRef::Node(k, node), [0.0; 2]);
            match stresses.iter().find(|(beam, ..)| *beam == k) {
                None => linkage.bars.push((0..=beam.elements).map(node).collect()),
                Some((_, half, at_nodes)) => linkage.stressed.extend((0..beam.elements).map(|e| {
                    // Perpendicular to the line through the neighbours of the node.
                    let corner = |n: usize, side: f64| {
                        let ([x0, y0], [x1, y1]) = (node(n.saturating_sub(1)), node((n + 1).min(beam.elements)));
                        let (length, [x, y]) = ((x1 - x0).hypot(y1 - y0).max(f64::MIN_POSITIVE), node(n));
                        [x - side * half * (y1 - y0) / length, y + side * half * (x1 - x0) / length]
                    };
                    let outline = [corner(e, 1.0), corner(e + 1, 1.0), corner(e + 1, -1.0), corner(e, -1.0)];
                    let mean = 0.5 * (at_nodes[e] + at_nodes[e + 1]);
                    (outline, if ranges.stress > 0.0 { mean / ranges.stress } else { 0.0 })
                })),
            }
            for (frame, end) in beam.ends.iter().zip([0, beam.elements]) {
                if let Some(frame) = frame {
                    self.draw_pin(node(end), [*frame, *frame], linkage);
                }
            }
        }
    }

    /// Draws the distributed loads of beam number `k`: arrows in their positive direction, with a line through their beginnings.
    fn draw_line_loads(&self, k: usize, beam: &BeamSpec, ranges: &GuideRanges, linkage: &mut Linkage) {
        for direction in beam.load_directions() {
            let (s, c) = direction.sin_cos();
            let length = 0.5 * ranges.arrow;
            let arrow = |part: usize| {
                let [x, y] = self.position(FrameRef::Node(k, part * beam.elements / LOAD_ARROWS), [0.0; 2]);
                vec![[x - length * c, y - length * s], [x, y]]
            };
            let mut arrows: Vec<Vec<[f64; 2]>> = (0..=LOAD_ARROWS).map(arrow).collect();
            arrows.dedup();
            linkage.lines.push(arrows.iter().map(|arrow| arrow[0]).collect());
            linkage.arrows.extend(arrows);
        }
    }

    /// Draws a revolute joint, on the ground if one of its frames is at rest.
    fn draw_pin(&self, at: [f64; 2], frames: [FrameRef; 2], linkage: &mut Linkage) {
        let rests = |frame: FrameRef| match frame {
            FrameRef::Ground => true,
            FrameRef::Body(k) => self.mechanism.kinds[k] == BodyKind::FixedNode,
            FrameRef::Node(..) => false,
        };
        if frames.into_iter().any(rests) { linkage.ground_joints.push(at) } else { linkage.joints.push(at) }
    }

    /// A parameter of an element by its name; zero if the element has no such parameter.
    fn number(&self, part: &ElementSpec, name: &str) -> f64 {
        let inputs = part.kind.descriptor.inputs.iter().zip(&part.inputs);
        let own = inputs.filter(|(input, _)| input.name == name).find_map(|(_, value)| match value {
            InputSpec::Number(expression) => Some(expression.value(&Inputs::design(self.mechanism.design))),
            _ => None,
        });
        own.unwrap_or(0.0)
    }

    /// Draws an element between its first two points.
    fn draw_element(&self, part: &ElementSpec, ranges: &GuideRanges, linkage: &mut Linkage) {
        let mut points = part.points();
        if part.symbol() == Symbol::JointFriction {
            return self.draw_friction(part, ranges, linkage);
        }
        match (points.next(), points.next()) {
            (None, _) => self.draw_on_coordinates(part, ranges, linkage),
            (Some(a), None) => self.draw_at_point(part, a, ranges, linkage),
            (Some(a), Some(b)) => match part.symbol() {
                Symbol::Wall | Symbol::Connection => self.draw_at_point(part, a, ranges, linkage),
                Symbol::Pin => self.draw_pin(self.point(a), [a.frame, b.frame], linkage),
                Symbol::Rack | Symbol::Cam | Symbol::Profile | Symbol::ProfileFace | Symbol::MovingWall => {
                    self.draw_contact(part, [a, b], ranges, linkage);
                }
                _ => self.draw_between(part, [a, b], ranges, linkage),
            },
        }
    }

    /// Draws an element at its first point: a wall that this point can touch, or a rigid connection.
    fn draw_at_point(&self, part: &ElementSpec, a: &PointRef, ranges: &GuideRanges, linkage: &mut Linkage) {
        let number = |name: &str| self.number(part, name);
        match part.symbol() {
            Symbol::Wall => {
                let (normal, foot) = (number("normal"), [number("wall_x"), number("wall_y")]);
                let (s, c) = normal.sin_cos();
                let foot = projection(ranges.centre, foot, [-s, c]);
                linkage.lines.push(symbols::wall(foot, normal - FRAC_PI_2, ranges.half, 0.3 * ranges.arrow));
            }
            Symbol::Connection => {
                let (at, angle) = (self.point(a), self.pose(a.frame)[2]);
                linkage.lines.push(symbols::rigid_connection(at, angle, 0.14 * ranges.arrow));
            }
            _ => {}
        }
    }

    /// Draws a line element, such as a bar or a spring, and its ends that are on the ground.
    fn draw_between(&self, part: &ElementSpec, points: [&PointRef; 2], ranges: &GuideRanges, linkage: &mut Linkage) {
        let (ends, size) = (points.map(|point| self.point(point)), 0.14 * ranges.arrow);
        let number = |name: &str| self.number(part, name);
        let is_grounded = |point: &PointRef| point.frame == FrameRef::Ground;
        match part.symbol() {
            Symbol::Bar => linkage.bars.push(ends.to_vec()),
            Symbol::Spring => match [number("stiffness"), number("damping")] {
                [0.0, damping] if damping != 0.0 => linkage.lines.push(symbols::damper(ends, 2.0 * size, 0.0)),
                [_, damping] => {
                    linkage.springs.push(ends);
                    if damping != 0.0 {
                        linkage.lines.push(symbols::damper(ends, 1.4 * size, 2.2 * size));
                    }
                }
            },
            Symbol::Damper => linkage.lines.push(symbols::damper(ends, 2.0 * size, 0.0)),
            Symbol::Cylinder => {
                linkage.lines.push(symbols::cylinder(ends, 1.6 * size));
                let moving = points.into_iter().zip(ends).filter(|(point, _)| !is_grounded(point));
                linkage.joints.extend(moving.map(|(_, end)| end));
            }
            Symbol::Rope => linkage.lines.push(ends.to_vec()),
            _ => return,
        }
        let grounded = points.into_iter().zip(ends).filter(|(point, _)| is_grounded(point));
        linkage.ground_joints.extend(grounded.map(|(_, end)| end));
    }

    /// Draws the surfaces of a contact between two bodies: of a cam, a rack or a closed curve, and of a wheel or a line.
    fn draw_contact(&self, part: &ElementSpec, [a, b]: [&PointRef; 2], ranges: &GuideRanges, linkage: &mut Linkage) {
        let (at, angle) = (self.point(a), self.pose(a.frame)[2]);
        let (other, other_angle) = (self.point(b), self.pose(b.frame)[2]);
        let number = |name: &str| self.number(part, name);
        match part.symbol() {
            Symbol::Rack => {
                let (direction, radius) = (number("direction"), number("radius"));
                let (s, c) = direction.sin_cos();
                let ([x, y], offset) = (other, -radius);
                // The pitch line touches the wheel; it is drawn three radii to either side of the contact.
                let foot = [x - s * offset, y + c * offset];
                let from = [foot[0] - 3.0 * radius.abs() * c, foot[1] - 3.0 * radius.abs() * s];
                let to = [foot[0] + 3.0 * radius.abs() * c, foot[1] + 3.0 * radius.abs() * s];
                linkage.lines.push(symbols::rack([from, to], 0.2 * radius.abs()));
                linkage.lines.push(symbols::wheel(other, radius.abs(), other_angle));
            }
            Symbol::Cam => {
                let profile = ["base_radius", "lift", "phase"].map(number);
                linkage.lines.push(symbols::cam(at, angle, profile));
            }
            Symbol::Profile => {
                linkage.lines.push(symbols::turned(at, angle, self.profile(part)));
                let radius = number("radius");
                if radius > 0.0 {
                    linkage.lines.push(symbols::wheel(other, radius, other_angle));
                }
            }
            Symbol::ProfileFace => {
                linkage.lines.push(symbols::turned(at, angle, self.profile(part)));
                let line = other_angle + number("line");
                linkage.lines.push(symbols::wall(other, line, 0.6 * ranges.arrow, 0.2 * ranges.arrow));
            }
            Symbol::MovingWall => {
                let line = angle + number("line");
                let (s, c) = line.sin_cos();
                let is_at_rest = a.frame == FrameRef::Ground;
                let foot = if is_at_rest { projection(ranges.centre, at, [c, s]) } else { at };
                linkage.lines.push(symbols::wall(foot, line, ranges.half, 0.3 * ranges.arrow));
            }
            _ => {}
        }
    }

    /// The closed curve of an element, in the axes of its first body.
    fn profile(&self, part: &ElementSpec) -> Vec<[f64; 2]> {
        let value = |expression: &CompiledExpression| expression.value(&Inputs::design(self.mechanism.design));
        let points: Vec<[f64; 2]> = part.profile().iter().map(|[x, y]| [value(x), value(y)]).collect();
        profile_curve(&points, (CURVE / points.len().max(1)).max(2))
    }

    /// Draws friction in a joint: two shoes around a pin, two hatched surfaces along a guide.
    fn draw_friction(&self, part: &ElementSpec, ranges: &GuideRanges, linkage: &mut Linkage) {
        let Some(joint) = part.joint().and_then(|k| self.mechanism.spec.elements.get(k)) else { return };
        let mut points = joint.points();
        let (Some(a), Some(b)) = (points.next(), points.next()) else { return };
        let at = self.point(b);
        if joint.symbol() == Symbol::Pin {
            let angle = self.pose(a.frame)[2];
            return linkage.lines.extend([0.0, PI].map(|side| symbols::shoe(at, angle + side, 0.2 * ranges.arrow)));
        }
        let angle = self.pose(a.frame)[2] + self.number(joint, "line");
        let (half, offset) = (0.55 * ranges.arrow, 0.34 * ranges.arrow);
        linkage.lines.extend([0.0, PI].map(|side| {
            let (s, c) = (angle + side).sin_cos();
            symbols::wall([at[0] + offset * s, at[1] - offset * c], angle + side, half, 0.16 * ranges.arrow)
        }));
    }

    /// Draws an element between coordinates: gears around the bodies of two rotations, a stop across a translation.
    fn draw_on_coordinates(&self, part: &ElementSpec, ranges: &GuideRanges, linkage: &mut Linkage) {
        let places: Vec<CoordinateRef> = part.coordinates().collect();
        let radii = ["radius_a", "radius_b"].map(|name| self.number(part, name).abs());
        match (part.symbol(), &places[..]) {
            (Symbol::Gears, [a, b, ..]) => {
                for (place, radius) in [a, b].into_iter().zip(radii) {
                    if let CoordinateRef::Of(frame, FrameCoordinate::Theta) = place {
                        linkage.lines.push(symbols::wheel(self.hinge(*frame), radius, self.pose(*frame)[2]));
                    }
                }
            }
            (Symbol::Stop, [a, b]) => {
                let Some(from) = self.coordinate(*a) else { return };
                let at = from + self.number(part, "limit") + self.number(part, "clearance");
                let half = 0.6 * ranges.arrow;
                let (middle, angle) = match b {
                    CoordinateRef::Slider(k) => ([at, self.row(*k, ranges)], -FRAC_PI_2),
                    CoordinateRef::Of(frame, FrameCoordinate::X) => ([at, self.pose(*frame)[1]], -FRAC_PI_2),
                    CoordinateRef::Of(frame, FrameCoordinate::Y) => ([self.pose(*frame)[0], at], 0.0),
                    CoordinateRef::Of(frame, FrameCoordinate::Theta) => {
                        let hinge = self.hinge(*frame);
                        let (s, c) = at.sin_cos();
                        ([hinge[0] + half * c, hinge[1] + half * s], at)
                    }
                    CoordinateRef::Of(_, FrameCoordinate::Z) | CoordinateRef::Joint(..) => return,
                };
                linkage.lines.push(symbols::wall(middle, angle, half, 0.3 * ranges.arrow));
            }
            _ => {}
        }
    }

    /// The value of a coordinate in the plane.
    fn coordinate(&self, place: CoordinateRef) -> Option<f64> {
        match place {
            CoordinateRef::Slider(k) => Some(self.sliders[k]),
            CoordinateRef::Of(frame, FrameCoordinate::X) => Some(self.pose(frame)[0]),
            CoordinateRef::Of(frame, FrameCoordinate::Y) => Some(self.pose(frame)[1]),
            CoordinateRef::Of(frame, FrameCoordinate::Theta) => Some(self.pose(frame)[2]),
            CoordinateRef::Of(_, FrameCoordinate::Z) | CoordinateRef::Joint(..) => None,
        }
    }

    /// Draws one-coordinate bodies below each other, each on its guide; a spring to the ground is fixed at its left end.
    fn draw_slides(&self, ranges: &GuideRanges, linkage: &mut Linkage) {
        let [low, high] = ranges.sliders;
        let row = |k: usize| self.row(k, ranges);
        let anchor = |k: usize| [low - 0.3 * (high - low), row(k)];
        for (k, place) in self.sliders.iter().enumerate() {
            linkage.guides.push([[low, row(k)], [high, row(k)]]);
            linkage.sliders.push(([*place, row(k)], 0.0));
        }
        for part in self.mechanism.spec.elements.iter().filter(|part| part.symbol() == Symbol::Spring) {
            let mut coordinates = part.coordinates();
            let (Some(a), Some(b)) = (coordinates.next(), coordinates.next()) else { continue };
            match (a, b) {
                (CoordinateRef::Slider(k), CoordinateRef::Of(FrameRef::Ground, _))
                | (CoordinateRef::Of(FrameRef::Ground, _), CoordinateRef::Slider(k)) => {
                    linkage.springs.push([anchor(k), [self.sliders[k], row(k)]]);
                    linkage.ground_joints.push(anchor(k));
                }
                (CoordinateRef::Slider(a), CoordinateRef::Slider(b)) => {
                    linkage.springs.push([[self.sliders[a], row(a)], [self.sliders[b], row(b)]]);
                }
                _ => {}
            }
        }
    }
}

/// The projection of a point onto a line.
fn projection(place: [f64; 2], on: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
    let along = (place[0] - on[0]) * u + (place[1] - on[1]) * v;
    [on[0] + u * along, on[1] + v * along]
}

/// The convex hull, counter-clockwise; the two ends where all points are on one line.
fn hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let (Some(first), Some(last)) = (sorted.first().copied(), sorted.last().copied()) else { return vec![] };
    let size = points.iter().map(|p| (p[0] - first[0]).hypot(p[1] - first[1])).fold(0.0, f64::max);
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if sorted.iter().all(|p| turn(first, last, *p).abs() <= 1e-6 * size * size) {
        return if sorted.len() > 1 { vec![first, last] } else { vec![first] };
    }
    let half = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = vec![];
        for point in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], *point) <= 0.0 {
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let lower = half(&mut sorted.iter());
    lower.into_iter().chain(half(&mut sorted.iter().rev())).collect()
}

#[cfg(test)]
mod tests {
    use super::hull;

    #[test]
    fn a_hull_leaves_inner_points_out_and_a_line_keeps_its_ends() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.4]];
        assert_eq!(hull(&square), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(hull(&[[0.0, 0.0], [2.0, 2.0], [1.0, 1.0]]), [[0.0, 0.0], [2.0, 2.0]]);
        assert_eq!(hull(&[[3.0, 1.0]]), [[3.0, 1.0]]);
        assert!(hull(&[]).is_empty());
    }
}
