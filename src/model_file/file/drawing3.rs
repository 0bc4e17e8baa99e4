//! The mechanism of a file in space in motion, as drawings.

use super::beams3::BeamSpec3;
use super::bodies3::BodyKind3;
use super::drawing::Released;
use super::element_spec::{ElementSpec, InputSpec};
use super::events::came_apart;
use super::measures::MeasureRef;
use super::mechanism::{MechanismSpec, MechanismTemplate};
use super::parts::{FrameRef, MarkerSpec};
use crate::Result;
use crate::model_file::expression::Inputs;
use crate::report::plots::{Linkage, SpatialLinkage, ViewDirection};
use mechanics::elements::Symbol;
use mechanics::mechanism::{Pose3, Rotation};
use std::collections::HashMap;
use std::sync::Arc;

/// Number of sides of the polygon that stands for a circle.
const SIDES: usize = 24;
/// Extent in m that may be a rounding error of a mechanism that is one point at rest.
const NOTHING: f64 = 1e-9;

/// A point of a frame with the axes of a joint, in the axes of the frame.
#[derive(Clone, Copy, Debug)]
struct Attachment {
    frame: FrameRef,
    point: [f64; 3],
    axes: Rotation<f64>,
}

/// Frames that move, in the order of the drawn outputs: bodies and nodes.
fn moving_frames(spec: &MechanismSpec) -> Vec<FrameRef> {
    let nodes = |(beam, b): (usize, &BeamSpec3)| (0..=b.elements).map(move |k| FrameRef::Node(beam, k));
    let nodes = spec.beams3.iter().enumerate().flat_map(nodes);
    (0..spec.bodies3.len()).map(FrameRef::Body).chain(nodes).collect()
}

/// Position of every frame, and of points along its axes x and y.
pub fn measures(spec: &MechanismSpec) -> Vec<MeasureRef> {
    const POSITION: [&str; 3] = ["x", "y", "z"];
    let of_frame = |frame: FrameRef| {
        let ends = [0, 1].map(|axis| POSITION.map(|what| MeasureRef::AxisEnd(frame, axis, what)));
        [POSITION.map(|what| MeasureRef::Frame(frame, what)), ends[0].clone(), ends[1].clone()].concat()
    };
    moving_frames(spec).into_iter().flat_map(of_frame).collect()
}

/// A mechanism in space at one design.
pub struct DrawnMechanism3<'p> {
    spec: &'p MechanismSpec,
    /// All frames that move, in the order of the outputs.
    frames: Vec<FrameRef>,
    /// Points of each element, and the named points.
    ends: Vec<Vec<Attachment>>,
    named: Vec<Attachment>,
    /// The first three numbers of each element: the direction of a load, the radii of spheres.
    directions: Vec<Option<[f64; 3]>>,
    /// Bodies that move freely after a release, whose paths are drawn.
    flying: Vec<FrameRef>,
    /// Numbers of the joints that are released.
    released: Vec<usize>,
}

impl<'p> DrawnMechanism3<'p> {
    /// The mechanism at a design.
    pub fn new(spec: &'p Arc<MechanismSpec>, design: &[f64]) -> Result<Self> {
        let mut context = MechanismTemplate::new(spec, &Arc::new(vec![])).parts_at(design)?;
        let mut attachment = |marker: &MarkerSpec| {
            let at = context.marker3(marker, design);
            Attachment { frame: marker.frame, point: at.point, axes: at.orientation }
        };
        let ends = spec.elements.iter().map(|part| part.markers().map(&mut attachment).collect()).collect();
        let named = spec.parts.markers.iter().map(&mut attachment).collect();
        let direction = |part: &ElementSpec| {
            let numbers = part.numbers().take(3).map(|number| number.value(&Inputs::design(design)));
            numbers.collect::<Vec<f64>>().try_into().ok()
        };
        let directions = spec.elements.iter().map(direction).collect();
        let (flying, released) = (spec.flying_bodies(), spec.released_joints());
        Ok(Self { spec, frames: moving_frames(spec), ends, named, directions, flying, released })
    }

    /// The drawings at all times, from the values of the drawn outputs.
    pub fn draw(&self, values: &[Vec<f64>], released: Released) -> Vec<Linkage> {
        let count = values.first().map_or(0, Vec::len);
        let mut motion: Vec<DrawnState3<'_>> = (0..count).map(|p| self.state(values, p)).collect();
        for &joint in &self.released {
            let [a, b, ..] = self.ends[joint][..] else { continue };
            let distances: Vec<f64> = motion.iter().map(|state| distance(state.point(&a), state.point(&b))).collect();
            let is_apart = came_apart(&distances);
            motion.iter_mut().zip(is_apart).filter(|(_, is_apart)| *is_apart).for_each(|(s, _)| s.apart.push(joint));
        }
        let ranges = self.ranges(&motion);
        motion.iter().map(|state| state.draw(&ranges, released).seen(&ViewDirection::default())).collect()
    }

    fn state(&self, values: &[Vec<f64>], p: usize) -> DrawnState3<'_> {
        let pose = |k: usize| {
            let point = |i: usize| [0, 1, 2].map(|c| values[9 * k + 3 * i + c][p]);
            let origin = point(0);
            let [x, y] = [1, 2].map(|i| [0, 1, 2].map(|c| point(i)[c] - origin[c]));
            let z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
            Pose3::new(origin, Rotation::from_z_x(z, x))
        };
        let poses = self.frames.iter().enumerate().map(|(k, frame)| (*frame, pose(k))).collect();
        DrawnState3 { mechanism: self, poses, apart: vec![] }
    }

    /// Lengths that all drawings share.
    fn ranges(&self, motion: &[DrawnState3<'_>]) -> Ranges {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut guides = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.ends.len()];
        for state in motion {
            for at in state.all_points() {
                for k in 0..3 {
                    (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
                }
            }
            for (guide, ends) in guides.iter_mut().zip(&self.ends) {
                let [a, b, ..] = ends[..] else { continue };
                let (from, to, z) = (state.point(&a), state.point(&b), state.axis(&a));
                let along: f64 = (0..3).map(|k| (to[k] - from[k]) * z[k]).sum();
                *guide = [guide[0].min(along), guide[1].max(along)];
            }
        }
        let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        Ranges { size: if size > NOTHING { size } else { 1.0 }, guides }
    }
}

/// Size of the mechanism, and ranges of points along the axes of the first points of elements.
struct Ranges {
    size: f64,
    guides: Vec<[f64; 2]>,
}

/// Poses of all frames at one time.
#[derive(Clone)]
struct DrawnState3<'s> {
    mechanism: &'s DrawnMechanism3<'s>,
    poses: HashMap<FrameRef, Pose3<f64>>,
    /// Numbers of the released joints that have come apart.
    apart: Vec<usize>,
}

impl DrawnState3<'_> {
    fn pose(&self, frame: FrameRef) -> Pose3<f64> {
        self.poses.get(&frame).copied().unwrap_or_else(|| Pose3::at([0.0; 3]))
    }

    fn point(&self, at: &Attachment) -> [f64; 3] {
        self.pose(at.frame).point(at.point)
    }

    fn axis(&self, at: &Attachment) -> [f64; 3] {
        self.pose(at.frame).orientation.then(at.axes).rotate([0.0, 0.0, 1.0])
    }

    fn all_points(&self) -> impl Iterator<Item = [f64; 3]> {
        let attached = self.mechanism.ends.iter().flatten().chain(&self.mechanism.named);
        self.poses.values().map(|pose| pose.position).chain(attached.map(|at| self.point(at)))
    }

    /// This state with the points of an element together: the body of one of them is moved.
    fn closed(&self, ends: &[Attachment]) -> Self {
        let mut closed = self.clone();
        if let [a, b, ..] = ends {
            let [still, moved] = if b.frame == FrameRef::Ground { [b, a] } else { [a, b] };
            let (to, from) = (self.point(still), self.point(moved));
            if let Some(pose) = closed.poses.get_mut(&moved.frame) {
                (0..3).for_each(|k| pose.position[k] += to[k] - from[k]);
            }
        }
        closed
    }

    fn draw(&self, ranges: &Ranges, released: Released) -> SpatialLinkage {
        let mut drawn = SpatialLinkage::default();
        (0..self.mechanism.spec.bodies3.len()).for_each(|body| self.draw_body(FrameRef::Body(body), &mut drawn));
        for (k, beam) in self.mechanism.spec.beams3.iter().enumerate() {
            let node = |node: usize| self.pose(FrameRef::Node(k, node)).position;
            drawn.bars.push((0..=beam.elements).map(node).collect());
        }
        for (k, part) in self.mechanism.spec.elements.iter().enumerate() {
            let (ends, sizes) = (&self.mechanism.ends[k], (ranges.guides[k], ranges.size));
            if !self.apart.contains(&k) {
                self.draw_element((k, part), ends, sizes, &mut drawn);
            } else if released == Released::AtFirstPoint {
                self.closed(ends).draw_element((k, part), ends, sizes, &mut drawn);
            }
        }
        let moving = self.mechanism.named.iter().filter(|at| !self.rests(at.frame));
        let flying = self.mechanism.flying.iter().map(|frame| self.pose(*frame).position);
        drawn.traced = moving.map(|at| self.point(at)).chain(flying).collect();
        drawn
    }

    /// Returns whether a frame is the ground or a node at rest.
    fn rests(&self, frame: FrameRef) -> bool {
        match frame {
            FrameRef::Ground => true,
            FrameRef::Body(k) => self.mechanism.spec.bodies3[k].kind == BodyKind3::FixedNode,
            FrameRef::Node(..) => false,
        }
    }

    /// Draws a body: a node at rest as the ground, others with one point a mass at the reference point and a bar to the point, with two a bar, with three a plate, otherwise bars from the mean of the points to each of them.
    fn draw_body(&self, frame: FrameRef, drawn: &mut SpatialLinkage) {
        if self.rests(frame) {
            drawn.ground_joints.push(self.pose(frame).position);
            return;
        }
        let mut points: Vec<[f64; 3]> = vec![];
        for at in self.mechanism.ends.iter().flatten().chain(&self.mechanism.named).filter(|at| at.frame == frame) {
            let is_new = |p: &[f64; 3]| distance(*p, at.point) > 1e-9;
            if points.iter().all(is_new) {
                points.push(at.point);
            }
        }
        let pose = self.pose(frame);
        let world: Vec<[f64; 3]> = points.iter().map(|p| pose.point(*p)).collect();
        match world[..] {
            [] => drawn.masses.push(pose.position),
            [point] => {
                if distance(point, pose.position) > 1e-9 {
                    drawn.bars.push(vec![point, pose.position]);
                }
                drawn.masses.push(pose.position);
            }
            [_, _] => drawn.bars.push(world),
            [_, _, _] => drawn.plates.push(world),
            _ => {
                let middle = [0, 1, 2].map(|k| world.iter().map(|p| p[k]).sum::<f64>() / world.len() as f64);
                drawn.bars.extend(world.iter().map(|p| vec![middle, *p]));
            }
        }
    }

    fn draw_element(
        &self,
        (k, part): (usize, &ElementSpec),
        ends: &[Attachment],
        (guide, size): ([f64; 2], f64),
        drawn: &mut SpatialLinkage,
    ) {
        let descriptor = part.kind.descriptor;
        let [a, b, ..] = ends[..] else {
            if let ([at], true) = (ends, part.inputs.iter().any(|input| matches!(input, InputSpec::Time(_)))) {
                self.draw_load((k, part), at, size, drawn);
            }
            return;
        };
        let [from, to] = [a, b].map(|end| self.point(&end));
        let along = |[low, high]: [f64; 2], from: [f64; 3]| {
            let z = self.axis(&a);
            [low, high].map(|s| [0, 1, 2].map(|k| from[k] + s * z[k]))
        };
        match (descriptor.kind, part.symbol()) {
            ("distance", _) => drawn.bars.push(vec![from, to]),
            (_, Symbol::Rope) => drawn.guides.push([from, to]),
            (_, Symbol::Spring) => drawn.springs.push([from, to]),
            (kind, Symbol::Spheres) => {
                let [radius_a, radius_b, _] = self.mechanism.directions[k].unwrap_or_default();
                match kind {
                    "sphere-plane" => {
                        drawn.plates.push(self.square(&a, 0.3 * size));
                        self.draw_sphere(&b, radius_a, drawn);
                    }
                    _ => [(a, radius_a), (b, radius_b)]
                        .iter()
                        .for_each(|(at, radius)| self.draw_sphere(at, *radius, drawn)),
                }
                return;
            }
            ("prismatic" | "cylindrical" | "point-on-line", _) => {
                let margin = 0.06 * size;
                drawn.guides.push(along([guide[0] - margin, guide[1] + margin], from));
                drawn.sliders.push([to, self.axis(&a)]);
                return;
            }
            ("angle" | "displacement" | "bushing", _) => return,
            _ => {}
        }
        if descriptor.kind == "revolute" {
            drawn.guides.push(along([-0.06 * size, 0.06 * size], from));
        }
        let is_pin = !matches!(part.symbol(), Symbol::Spring | Symbol::Rope) && descriptor.kind != "distance";
        for (end, at) in [(a, from), (b, to)] {
            if self.rests(end.frame) {
                drawn.ground_joints.push(at);
            }
        }
        let is_grounded = [a, b].iter().any(|end| self.rests(end.frame));
        if is_pin && !is_grounded {
            drawn.joints.push(from);
        } else if !is_pin {
            let moving = [(a, from), (b, to)].into_iter().filter(|(end, _)| !self.rests(end.frame));
            drawn.joints.extend(moving.map(|(_, at)| at));
        }
    }

    /// Three great circles of a sphere, which turn with its body.
    fn draw_sphere(&self, centre: &Attachment, radius: f64, drawn: &mut SpatialLinkage) {
        let (point, axes) = (self.point(centre), self.pose(centre.frame).orientation.then(centre.axes));
        for first in 0..3 {
            let on_circle = |k: usize| {
                let (sin, cos) = (k as f64 * std::f64::consts::TAU / SIDES as f64).sin_cos();
                let mut lever = [0.0; 3];
                (lever[first], lever[(first + 1) % 3]) = (radius * cos, radius * sin);
                let lever = axes.rotate(lever);
                [0, 1, 2].map(|k| point[k] + lever[k])
            };
            drawn.bars.push((0..=SIDES).map(on_circle).collect());
        }
    }

    /// The corners of a square in the plane through a point, normal to its axis z.
    fn square(&self, at: &Attachment, half_side: f64) -> Vec<[f64; 3]> {
        let (point, axes) = (self.point(at), self.pose(at.frame).orientation.then(at.axes));
        let corner = |(x, y): (f64, f64)| {
            let lever = axes.rotate([half_side * x, half_side * y, 0.0]);
            [0, 1, 2].map(|k| point[k] + lever[k])
        };
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec()
    }

    /// The arrow of a load in its positive direction, that of a torque around its axis; it does not show the size.
    fn draw_load(&self, (k, part): (usize, &ElementSpec), at: &Attachment, size: f64, drawn: &mut SpatialLinkage) {
        let Some([x, y, z]) = self.mechanism.directions[k] else { return };
        let direction = match part.kind.descriptor.kind {
            "follower" | "follower-torque" => self.pose(at.frame).orientation.then(at.axes).rotate([x, y, z]),
            _ => [x, y, z],
        };
        let point = self.point(at);
        drawn.arrows.push(match part.kind.descriptor.kind {
            "torque" | "follower-torque" => turn(point, direction, 0.07 * size),
            _ => {
                let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
                vec![[0, 1, 2].map(|k| point[k] - 0.14 * size * direction[k] / length), point]
            }
        });
    }
}

/// An arc about the `axis` through `centre`, in the direction of a positive rotation.
fn turn(centre: [f64; 3], axis: [f64; 3], radius: f64) -> Vec<[f64; 3]> {
    let axes = Rotation::z_along(axis);
    let at = |k: u32| {
        let (sin, cos) = (-0.5 + 0.25 * f64::from(k)).sin_cos();
        let lever = axes.rotate([radius * cos, radius * sin, 0.0]);
        [0, 1, 2].map(|k| centre[k] + lever[k])
    };
    (0..=16).map(at).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt()
}
