//! Recorder of the energy of a motion, and of the reasons for warnings about it.

use crate::analyses::conservation::{EnergyDrift, EnergyWatch};
use crate::analyses::element_warnings::StateWatch;
use crate::analyses::negative_coefficients::CoefficientWatch;
use crate::analyses::small_displacements::DisplacementWatch;
use crate::analyses::tensioned_beams::TensionWatch;
use crate::initial_velocities::velocities_that_do_not_fit;
use crate::mechanism::Mechanism;
use crate::system::state::State;

/// Everything that is observed at the output times of a motion, besides the outputs.
pub(crate) struct MotionWatch {
    energy: EnergyWatch,
    coefficients: CoefficientWatch,
    /// The warning about given velocities that do not satisfy the constraints.
    initial_velocities: Option<String>,
    tension: TensionWatch,
    states: StateWatch,
    displacements: DisplacementWatch,
}

impl MotionWatch {
    /// Recorder for a motion that begins at `start`.
    pub fn new(mechanism: &Mechanism<f64>, start: &State<f64>) -> Self {
        Self {
            energy: EnergyWatch::new(mechanism, start),
            coefficients: CoefficientWatch::new(mechanism),
            initial_velocities: velocities_that_do_not_fit(mechanism, start),
            tension: TensionWatch::new(mechanism),
            states: StateWatch::default(),
            displacements: DisplacementWatch::new(start),
        }
    }

    /// Records `state`.
    pub fn add(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        self.energy.add(mechanism, state);
        self.coefficients.add(mechanism, state);
        self.tension.add(mechanism, state);
        self.states.add(mechanism, state);
        self.displacements.add(state);
    }

    /// The change of the energy, and the warnings. `tolerance` is the absolute tolerance of the steps in m or rad, if their error is controlled.
    pub fn finish(self, mechanism: &Mechanism<f64>, tolerance: Option<f64>) -> (Option<EnergyDrift>, Vec<String>) {
        let energy_drift = self.energy.finish(tolerance);
        let mut warnings = self.coefficients.warnings(mechanism);
        warnings.extend(self.initial_velocities);
        warnings.extend(self.tension.warning(mechanism));
        warnings.extend(self.states.warnings());
        warnings.extend(energy_drift.and_then(|drift| drift.warning()));
        warnings.extend(tolerance.and_then(|tolerance| self.displacements.warning(tolerance)));
        (energy_drift, warnings)
    }
}
