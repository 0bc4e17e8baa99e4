//! The mechanism of a file as a pure function of the design.

use super::beams::{self, BeamSpec};
use super::beams3::{self, BeamSpec3};
use super::bodies::{self, BodySpec};
use super::bodies3::{self, BodySpec3};
use super::element_spec::ElementSpec;
use super::elements;
use super::events::{self, EventSpec};
use super::measures::Sensors;
use super::outputs::OutputSpec;
#[cfg(feature = "report")]
use super::parts::FrameRef;
use super::parts::{BuildContext, Parts};
use super::section::{Read, Section};
use crate::Result;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use crate::responses::mechanism::ModalQuantity;
use autodiff::Scalar;
#[cfg(feature = "report")]
use mechanics::elements::Family;
use mechanics::mechanism::{Mechanism, ParametricMechanism, SimulationClock};
use std::sync::Arc;

/// Kinds of joints between two points whose distance does not change.
#[cfg(feature = "report")]
const KEEP_DISTANCE: [&str; 6] = ["revolute", "distance", "fixed", "spherical", "universal", "constant-velocity"];

/// A mechanism with its outputs, as a function of the design.
#[derive(Clone, Debug)]
pub struct MechanismTemplate {
    spec: Arc<MechanismSpec>,
    outputs: Arc<Vec<OutputSpec>>,
}

/// A mechanism without its outputs.
#[derive(Debug)]
pub struct MechanismSpec {
    gravity: [CompiledExpression; 3],
    /// Time at which the motion starts.
    pub start: f64,
    pub bodies: Vec<BodySpec>,
    pub bodies3: Vec<BodySpec3>,
    pub beams: Vec<BeamSpec>,
    pub beams3: Vec<BeamSpec3>,
    pub elements: Vec<ElementSpec>,
    pub events: Vec<EventSpec>,
    pub parts: Parts,
    /// Shows the time of running simulations.
    pub clock: SimulationClock,
}

impl MechanismSpec {
    /// Returns whether outputs may jump at the times of events: where forces are switched, joints are released, contacts close or friction sticks.
    pub fn has_events(&self) -> bool {
        self.elements.iter().any(|element| element.kind.has_modes())
            || self.events.iter().any(EventSpec::changes_forces)
    }
}

#[cfg(feature = "report")]
impl MechanismSpec {
    /// Bodies whose joints are all released by events, and which then move freely.
    pub fn flying_bodies(&self) -> Vec<FrameRef> {
        let released: Vec<usize> = self.events.iter().flat_map(EventSpec::released).collect();
        let mut held: Vec<(FrameRef, bool)> = vec![];
        for (k, element) in self.elements.iter().enumerate() {
            let is_held = !released.contains(&k);
            if element.kind.descriptor.family == Family::Joint {
                held.extend(element.frames().map(|frame| (frame, is_held)));
            }
        }
        let is_flying = |frame: &FrameRef| {
            let mut own = held.iter().filter(|(other, _)| other == frame).peekable();
            own.peek().is_some() && own.all(|(_, is_held)| !is_held)
        };
        let bodies = (0..self.bodies.len().max(self.bodies3.len())).map(FrameRef::Body);
        bodies.filter(is_flying).collect()
    }

    /// Numbers of the joints that an event releases and that keep the distance of their two points until then.
    pub fn released_joints(&self) -> Vec<usize> {
        let keeps_distance = |k: &usize| KEEP_DISTANCE.contains(&self.elements[*k].kind.descriptor.kind);
        self.events.iter().flat_map(EventSpec::released).filter(keeps_distance).collect()
    }
}

/// Reads the mechanism, if there is one.
pub fn read(file: &Section<'_>, names: &Names) -> Read<Option<MechanismSpec>> {
    let mut parts = Parts::default();
    parts.is_spatial = is_spatial(file)?;
    let (bodies, bodies3) = match parts.is_spatial {
        true => bodies3::read(file, names, &mut parts)?,
        false => (bodies::read(file, names, &mut parts)?, vec![]),
    };
    let (beams, beams3) = match parts.is_spatial {
        true => (vec![], beams3::read(file, names, &mut parts)?),
        false => (beams::read(file, names, &mut parts)?, vec![]),
    };
    match parts.is_spatial {
        true => bodies3::read_points(file, names, &mut parts, false)?,
        false => bodies::read_points(file, names, &mut parts)?,
    }
    let elements = elements::read(file, names, &mut parts)?;
    let events = events::read(file, names, &mut parts, &elements)?;
    let gravity = match parts.is_spatial {
        true => file.vector("gravity", names, &Scope::DESIGN)?,
        false => {
            let [x, y] = file.vector("gravity", names, &Scope::DESIGN)?;
            [x, y, CompiledExpression::constant(0.0)]
        }
    };
    // Parts with mistakes are in the file, but not in the lists.
    let is_empty =
        |key: &str| file.get(key).is_none_or(|value| value.get_ref().as_array().is_some_and(|all| all.is_empty()));
    if !(is_empty("body") && is_empty("beam")) {
        return Ok(Some(MechanismSpec {
            gravity,
            start: 0.0,
            bodies,
            bodies3,
            beams,
            beams3,
            elements,
            events,
            parts,
            clock: SimulationClock::default(),
        }));
    }
    match ["joint", "driver", "force", "event", "point", "gravity", "analysis"].into_iter().find(|key| file.has(key)) {
        Some(key) => Err(file.error_at(key, format!("`{key}` without any body or beam")).help("add a [[body]] first")),
        None => Ok(None),
    }
}

/// Returns whether the mechanism of the file is in space.
fn is_spatial(file: &Section<'_>) -> Read<bool> {
    match file.count("space", usize::MAX)? {
        None | Some(2) => Ok(false),
        Some(3) => Ok(true),
        Some(_) => {
            let error = file.error_at("space", "`space` is the number of dimensions, 2 or 3");
            Err(error.help("write `space = 3` for mechanisms in space"))
        }
    }
}

impl MechanismSpec {
    /// Upper bound of the number of coordinates.
    pub fn coordinates(&self) -> usize {
        let nodes: usize = self.beams.iter().map(|beam| beam.elements + 1).sum();
        let nodes3: usize = self.beams3.iter().map(|beam| beam.elements + 1).sum();
        3 * (self.bodies.len() + nodes) + 7 * (self.bodies3.len() + nodes3)
    }
}

impl MechanismTemplate {
    pub fn new(spec: &Arc<MechanismSpec>, outputs: &Arc<Vec<OutputSpec>>) -> Self {
        Self { spec: spec.clone(), outputs: outputs.clone() }
    }

    /// For each output, true if it is a number: its value at an event.
    pub fn numbers(&self) -> Vec<bool> {
        self.outputs.iter().map(|output| !output.is_transient).collect()
    }

    /// For each output the quantity of a natural mode that it is, if any; `None` if no output is one.
    pub fn modal_quantities(&self) -> Option<Vec<Option<ModalQuantity>>> {
        let all: Vec<Option<ModalQuantity>> = self.outputs.iter().map(|output| output.modal).collect();
        all.iter().any(Option::is_some).then_some(all)
    }
}

impl ParametricMechanism for MechanismTemplate {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (spec, mut context) = (&self.spec, self.parts_at(b)?);
        let mut sensors = Sensors::new(&spec.parts);
        for event in &spec.events {
            event.build(&mut sensors, &mut context, b)?;
        }
        for output in self.outputs.iter() {
            output.build(&mut sensors, &mut context, b)?;
        }
        Ok(context.mechanism)
    }
}

impl MechanismTemplate {
    /// Bodies, beams and elements at a design.
    ///
    /// # Errors
    /// If an orientation is not a rotation.
    pub fn parts_at<S: Scalar>(&self, b: &[S]) -> Result<BuildContext<S>> {
        let spec = &self.spec;
        let gravity = spec.gravity.each_ref().map(|g| g.value(&Inputs::design(b)));
        let mut context = BuildContext::new(Mechanism::with_gravity3(gravity), spec.start, &spec.parts);
        context.mechanism.set_clock(spec.clock.clone());
        spec.bodies.iter().for_each(|body| body.build(&mut context, b, spec.start));
        spec.bodies3.iter().try_for_each(|body| body.build(&mut context, b))?;
        spec.beams.iter().for_each(|beam| beam.build(&mut context, b));
        spec.beams3.iter().for_each(|beam| beam.build(&mut context, b));
        spec.elements.iter().for_each(|part| part.build(&mut context, b));
        Ok(context)
    }
}
