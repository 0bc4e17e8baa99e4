//! Warning about motions that are small in comparison with the tolerance of adaptive steps.

use crate::system::state::State;

/// Largest displacement of a coordinate, in tolerances of its local error, that is worth a warning.
const SMALL: f64 = 1e3;

/// Fraction of the tolerance below which displacements count as rounding errors of a mechanism at rest.
const AT_REST: f64 = 1e-3;

/// Tolerance that is proposed, as a fraction of the largest displacement.
const PROPOSED: f64 = 1e-6;

/// Recorder of the displacements of all coordinates from the start.
pub(crate) struct DisplacementWatch {
    start: Vec<f64>,
    /// The largest so far in m or rad.
    largest: f64,
}

impl DisplacementWatch {
    /// Recorder for a motion that begins at this state.
    pub fn new(start: &State<f64>) -> Self {
        Self { start: start.q.clone(), largest: 0.0 }
    }

    /// Records the displacements at `state`.
    pub fn add(&mut self, state: &State<f64>) {
        let displacements = self.start.iter().zip(&state.q).map(|(from, to)| (to - from).abs());
        self.largest = displacements.fold(self.largest, f64::max);
    }

    /// A warning for steps with this absolute tolerance of the local error, in m or rad.
    pub fn warning(&self, tolerance: f64) -> Option<String> {
        let largest = self.largest;
        (largest > AT_REST * tolerance && largest < SMALL * tolerance).then(|| {
            let proposed = 10f64.powf((PROPOSED * largest).log10().floor());
            format!(
                "no coordinate moves by more than {largest:.1e} m or rad, which is small in comparison with the tolerance of {tolerance:.0e} of \
                 the steps. Take a tolerance of {proposed:.0e} or less."
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::prelude::*;

    /// A mass on a spring that starts at the displacement `size` with the period 2π s.
    fn warnings(size: f64, tolerance: f64) -> Vec<String> {
        let mut m = Mechanism::<f64>::new();
        let mass = m.coordinate("mass", size, 0.0);
        m.inertia("inertia", mass, 1.0);
        let still = m.ground().x;
        m.coordinate_spring("spring", still, mass, [1.0, 0.0, 0.0, 0.0]);
        simulate_explicitly(&m, &Explicit::eighth_order(tolerance), &[0.0, 1.0, 3.0]).unwrap().warnings
    }

    #[test]
    fn motions_of_the_size_of_the_tolerance_are_named() {
        let small = warnings(1e-7, 1e-9);
        assert!(small.iter().any(|text| text.contains("small in comparison") && text.contains("1e-13")), "{small:?}");
        assert!(warnings(1e-7, 1e-13).is_empty() && warnings(1e-3, 1e-9).is_empty());
        // At rest.
        assert!(warnings(0.0, 1e-9).is_empty());
    }
}
