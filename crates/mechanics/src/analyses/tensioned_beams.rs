//! Warnings about beam elements under a normal force above which they are unstable.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::{State, measure};
use error::Seconds;

/// Recorder of the normal forces of beam elements whose axis between the nodes is straight.
///
/// Such an element is unstable where its normal force exceeds its shear stiffness GA*, which is 12 EI/ℓ² in slender elements with exact
/// bending: a transverse displacement γ ℓ has the restoring force (GA* − N) γ.
pub(crate) struct TensionWatch {
    beams: Vec<StraightBeam>,
    workspace: ElementWorkspace<f64>,
    measures: Vec<f64>,
}

/// A beam element with a straight axis.
struct StraightBeam {
    element: usize,
    /// Number of its measure of the normal force.
    normal_force: usize,
    /// Shear stiffness GA* in N.
    limit: f64,
    /// The largest normal force in N above the limit so far, and its time in s.
    exceeded: Option<[f64; 2]>,
}

impl TensionWatch {
    /// Recorder before the start of a motion.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let beams =
            mechanism.elements.iter().enumerate().filter_map(|(k, instance)| straight_beam(k, instance)).collect();
        Self { beams, workspace: ElementWorkspace::default(), measures: Vec::new() }
    }

    /// Records the normal forces at `state`.
    pub fn add(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let Self { beams, workspace, measures } = self;
        for beam in beams {
            let instance = &mechanism.elements[beam.element];
            measures.clear();
            measures.resize(instance.element.measures().len(), 0.0);
            measure(instance, state, workspace, measures);
            let force = measures[beam.normal_force];
            if force > beam.exceeded.map_or(beam.limit, |[largest, _]| largest) {
                beam.exceeded = Some([force, state.t]);
            }
        }
    }

    /// A warning that names the element whose limit was exceeded most.
    pub fn warning(&self, mechanism: &Mechanism<f64>) -> Option<String> {
        let exceeded = || self.beams.iter().filter_map(|beam| Some((beam, beam.exceeded?)));
        let (beam, [force, t]) = exceeded().max_by(|a, b| (a.1[0] / a.0.limit).total_cmp(&(b.1[0] / b.0.limit)))?;
        let others = match exceeded().count() - 1 {
            0 => String::new(),
            count => format!(" (and {count} more)"),
        };
        Some(format!(
            "{}{others}: its normal force of {force:.4e} N at t = {t} exceeds its shear stiffness of {:.4e} N (12 EI/ℓ² of slender \
             elements): the element is unstable, and frequencies and deflections are wrong; take shear = \"cubic\", or more elements",
            mechanism.elements[beam.element].name,
            beam.limit,
            t = Seconds(t)
        ))
    }
}

/// The element, if it is a beam with a straight axis between its nodes.
fn straight_beam(element: usize, instance: &ElementInstance<f64>) -> Option<StraightBeam> {
    let normal_force = instance.element.measures().iter().position(|measure| measure.name == "normal_force")?;
    let (mut cubic, mut limit) = (None, f64::INFINITY);
    for (input, value) in instance.values() {
        match input.name {
            "cubic" => cubic = Some(value),
            "shear" | "shear_y" | "shear_z" => limit = limit.min(value),
            _ => {}
        }
    }
    let is_straight = cubic == Some(0.0) && limit.is_finite();
    is_straight.then_some(StraightBeam { element, normal_force, limit, exceeded: None })
}
