//! The mechanism of a file as a pure function of the design.

use super::beams::{self, BeamSpec};
use super::bodies::{self, BodySpec};
use super::elements::{self, ElementSpec};
use super::events::{self, EventSpec};
use super::measures::Sensors;
use super::outputs::OutputSpec;
use super::parts::{BuildContext, Parts};
use super::section::{Read, Section};
use crate::Result;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use crate::responses::mechanism::NaturalFrequency;
use autodiff::Scalar;
use mechanics::mechanism::{Mechanism, ParametricMechanism, SimulationClock};
use std::sync::Arc;

/// A mechanism with its outputs, as a function of the design.
#[derive(Clone, Debug)]
pub struct MechanismTemplate {
    spec: Arc<MechanismSpec>,
    outputs: Arc<Vec<OutputSpec>>,
}

/// A mechanism without its outputs.
#[derive(Debug)]
pub struct MechanismSpec {
    gravity: [CompiledExpression; 2],
    /// Time at which the motion starts.
    pub start: f64,
    pub bodies: Vec<BodySpec>,
    pub beams: Vec<BeamSpec>,
    pub elements: Vec<ElementSpec>,
    pub events: Vec<EventSpec>,
    pub parts: Parts,
    /// Shows the time of running simulations.
    pub clock: SimulationClock,
}

/// Reads the mechanism, if there is one.
pub fn read(file: &Section<'_>, names: &Names) -> Read<Option<MechanismSpec>> {
    let mut parts = Parts::default();
    let bodies = bodies::read(file, names, &mut parts)?;
    let beams = beams::read(file, names, &mut parts)?;
    bodies::read_points(file, names, &mut parts)?;
    let elements = elements::read(file, names, &mut parts)?;
    let events = events::read(file, names, &mut parts, &elements)?;
    let gravity = file.pair("gravity", names, &Scope::DESIGN)?;
    // Parts with mistakes are in the file, but not in the lists.
    let is_empty =
        |key: &str| file.get(key).is_none_or(|value| value.get_ref().as_array().is_some_and(|all| all.is_empty()));
    if !(is_empty("body") && is_empty("beam")) {
        return Ok(Some(MechanismSpec {
            gravity,
            start: 0.0,
            bodies,
            beams,
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

impl MechanismSpec {
    /// Upper bound of the number of coordinates.
    pub fn coordinates(&self) -> usize {
        let nodes: usize = self.beams.iter().map(|beam| beam.elements + 1).sum();
        3 * (self.bodies.len() + nodes)
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

    /// For each output the natural frequency that it is, if any; `None` if no output is one.
    pub fn frequencies(&self) -> Option<Vec<Option<NaturalFrequency>>> {
        let all: Vec<Option<NaturalFrequency>> = self.outputs.iter().map(|output| output.frequency).collect();
        all.iter().any(Option::is_some).then_some(all)
    }
}

impl ParametricMechanism for MechanismTemplate {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let spec = &self.spec;
        let [gx, gy] = spec.gravity.each_ref().map(|g| g.value(&Inputs::design(b)));
        let mut context = BuildContext {
            mechanism: Mechanism::with_gravity(gx, gy),
            bodies: vec![],
            sliders: vec![],
            beams: vec![],
            elements: vec![],
            events: vec![],
        };
        context.mechanism.set_clock(spec.clock.clone());
        spec.bodies.iter().for_each(|body| body.build(&mut context, b, spec.start));
        spec.beams.iter().for_each(|beam| beam.build(&mut context, b));
        spec.elements.iter().for_each(|part| part.build(&mut context, b));
        let mut sensors = Sensors::new(&spec.parts.points);
        for event in &spec.events {
            event.build(&mut sensors, &mut context, b)?;
        }
        for output in self.outputs.iter() {
            output.build(&mut sensors, &mut context, b)?;
        }
        Ok(context.mechanism)
    }
}
