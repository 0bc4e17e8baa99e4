//! How the four-bar mechanism is analysed.

use crate::cases::mechanisms::FourBar;
use crate::{Error, Result};
use mechanics::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration, StepSize};
use mechanics::integrators::generalized_alpha::{GeneralizedAlpha, Prescribed};

impl FourBar {
    /// Settings of the analysis: HHT at fixed steps from rest.
    pub fn dynamics(&self) -> Result<Dynamics> {
        Error::check_option("time step", "positive", self.step, self.step > 0.0)?;
        Ok(Dynamics {
            scheme: GeneralizedAlpha::hht(self.damping)?,
            step: StepSize::Fixed(self.step),
            origin: InitialConfiguration::Built,
            initial: InitialAcceleration::Zero,
            prescribed: Prescribed::Newmark,
            ..Dynamics::fixed(self.step)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::analyses::dynamics::simulate;
    use mechanics::mechanism::ParametricMechanism;

    /// Largest stress over all nodes and times, over the allowed one, minus one, in %.
    fn violation(model: &FourBar, diameters_mm: [f64; 3]) -> f64 {
        let b = diameters_mm.map(|d| d * 1e-3);
        let history = simulate(&model.build(&b).unwrap(), &model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let stress = |(k, series): (usize, &Vec<f64>)| {
            let factor = FourBar::stress_per_moment(b[k / 7]) / FourBar::ALLOWED_STRESS;
            series.iter().fold(0.0, |a: f64, m| a.max(m.abs() * factor))
        };
        (history.values.iter().enumerate().map(stress).fold(0.0, f64::max) - 1.0) * 100.0
    }

    #[test]
    fn as_published_gives_the_reference_stresses() {
        // Values of an independent implementation with shear-flexible elements.
        let rows = [
            ([356.8; 3], -71.463),
            ([214.08; 3], -52.808),
            ([128.448; 3], -21.254),
            ([84.7, 77.069, 77.069], -0.618),
            ([52.2, 35.965, 35.965], -6.513),
            ([41.9, 25.6, 25.6], -4.628),
            ([38.5, 25.2, 20.0], -0.207),
            ([37.3, 23.6, 19.8], 0.71),
        ];
        for (diameters, expected) in rows {
            let v = violation(&FourBar::as_published(), diameters);
            assert!((v - expected).abs() < 5e-3, "{diameters:?}: {v:.4} instead of {expected} %");
        }
    }

    #[test]
    fn rigid_shear_gives_the_reference_stresses() {
        use mechanics::elements::Shear;
        let model = FourBar { shear: Shear::Rigid, ..FourBar::as_published() };
        for (diameters, expected) in
            [([356.8; 3], -71.48), ([52.2, 35.965, 35.965], -6.49), ([38.5, 25.2, 20.0], -0.28)]
        {
            let v = violation(&model, diameters);
            assert!((v - expected).abs() < 1e-2, "{diameters:?}: {v:.4} instead of {expected} %");
        }
    }

    #[test]
    fn impossible_diameters_are_named() {
        let model = FourBar::physical();
        for bad in [0.0, -0.01, f64::NAN] {
            let error = model.build(&[0.03, bad, 0.02]).err().unwrap();
            assert!(error.to_string().contains("link 2"), "{error}");
        }
    }
}
