//! The driven four-bar mechanism with three flexible links.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration, StepSize};
use mechanics::elements::{BeamSection, Shear};
use mechanics::integrators::generalized_alpha::{GeneralizedAlpha, Prescribed};
use mechanics::mechanism::{ElementIndex, Mechanism, ParametricMechanism};
use mechanics::motion::StartUp;

/// Bending moments of a driven four-bar mechanism of three flexible round links, as functions of their diameters.
///
/// Links: crank O–B, coupler B–C, rocker D–C; O is the origin, D lies on the x axis, C above it. Each link consists of equal
/// [`Beam`](mechanics::elements::Beam) elements; coincident end nodes of two links share x and y. The rotation of the crank's
/// root is prescribed.
///
/// Design variables: the three diameters in m. Outputs: `moment i.k` in N·m at node k of link i, link by link,
/// 3 × 7 with six elements. At inner nodes it is the mean of the two adjacent elements.
///
/// # Sources
/// Etman, van Campen & Schoofs, *Multibody Syst. Dyn.* 2 (1998) 393–415, Section 6.3. The fields include the modelling
/// choices that the paper does not state; [`FourBar::as_published`] has those that give the printed stresses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FourBar {
    /// Lengths of crank, coupler and rocker in m.
    pub lengths: [f64; 3],
    /// Distance of the ground pivots in m.
    pub ground: f64,
    /// Young's modulus in N/m².
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density in kg/m³.
    pub density: f64,
    /// Elements per link.
    pub elements: usize,
    /// Shear stiffness of the elements.
    pub shear: Shear,
    /// χ of each link: the rotary inertia per length is ρI + χ ρA l²/12 with the link's full length l. The physical
    /// value is χ = 0; χ = 1 counts the inertia about a transverse axis a second time, spread over the length.
    pub rotary_inertia: [f64; 3],
    /// Gravitational acceleration in m/s².
    pub gravity: [f64; 2],
    /// Crank speed in rad/s.
    pub speed: f64,
    /// Crank angle at the start in rad.
    pub start_angle: f64,
    /// Start-up function of the crank.
    pub start_up: StartUp,
    /// Duration of the start-up in s.
    pub start_up_time: f64,
    /// Numerical damping of the HHT method, 0 to 1/3.
    pub damping: f64,
    /// Time step in s.
    pub step: f64,
}

impl FourBar {
    /// Allowed bending stress in N/m².
    pub const ALLOWED_STRESS: f64 = 2.758e7;

    /// The mechanism of the paper with χ = 0.
    pub fn physical() -> Self {
        Self {
            lengths: [0.3048, 0.9144, 0.762],
            ground: 0.9144,
            young: 6.895e10,
            poisson: 0.3,
            density: 2757.0,
            elements: 6,
            shear: Shear::Flexible,
            rotary_inertia: [0.0; 3],
            gravity: [0.0; 2],
            speed: 10.0 * std::f64::consts::PI,
            start_angle: std::f64::consts::FRAC_PI_2,
            start_up: StartUp::HalfCosine,
            start_up_time: 0.2,
            damping: 0.05,
            step: 1e-3,
        }
    }

    /// The choices that reproduce the printed stresses: as [`FourBar::physical`] with χ = 1 on every link.
    pub fn as_published() -> Self {
        Self { rotary_inertia: [1.0; 3], ..Self::physical() }
    }

    /// Times of the paper's window: 201 points from 0.3 to 0.5 s.
    pub fn window() -> Vec<f64> {
        (300..=500).map(|k| k as f64 * 1e-3).collect()
    }

    /// Total mass of the links in kg.
    pub fn mass<S: Scalar>(&self, diameters: &[S]) -> S {
        let part = |d: &S, l: f64| *d * *d * (std::f64::consts::FRAC_PI_4 * self.density * l);
        diameters.iter().zip(self.lengths).map(|(d, l)| part(d, l)).sum()
    }

    /// Bending stress in N/m² per bending moment in N·m for the diameter `d` in m: 32 / (π d³).
    pub fn stress_per_moment<S: Scalar>(d: S) -> S {
        d.powi(-3) * (32.0 / std::f64::consts::PI)
    }

    /// Settings of the analysis: HHT at fixed steps from rest.
    pub fn dynamics(&self) -> Result<Dynamics> {
        Error::check_option("time step", "positive", self.step, self.step > 0.0)?;
        Ok(Dynamics {
            scheme: GeneralizedAlpha::hht(self.damping)?,
            step: StepSize::Fixed(self.step),
            initial_configuration: InitialConfiguration::Built,
            initial_acceleration: InitialAcceleration::Zero,
            prescribed: Prescribed::Newmark,
            ..Dynamics::fixed(self.step)
        })
    }

    /// Positions of B and C at the crank angle `phi`, with C above the line O–D.
    pub(super) fn joints(&self, phi: f64) -> Result<[[f64; 2]; 2]> {
        let [crank, coupler, rocker] = self.lengths;
        let b = [crank * phi.cos(), crank * phi.sin()];
        let (dx, dy) = (self.ground - b[0], -b[1]);
        let distance = dx.hypot(dy);
        let along = (coupler * coupler - rocker * rocker + distance * distance) / (2.0 * distance);
        let height = (coupler * coupler - along * along).sqrt();
        if height.is_nan() {
            let why = format!("coupler {coupler} m and rocker {rocker} m do not meet over {distance:.4} m");
            return Err(Error::analysis("four-bar loop", why, "change the lengths or the crank angle"));
        }
        let (ux, uy) = (dx / distance, dy / distance);
        Ok([b, [b[0] + along * ux - height * uy, b[1] + along * uy + height * ux]])
    }

    /// Checks that each link has a positive diameter.
    pub(super) fn check<S: Scalar>(&self, b: &[S]) -> Result<()> {
        Error::check_length("diameters", 3, b.len())?;
        let Some(i) = b.iter().position(|d| !(d.re() > 0.0)) else { return Ok(()) };
        let why = format!("its diameter is {} m", b[i].re());
        Err(Error::analysis(format!("link {}", i + 1), why, "keep diameters positive"))
    }

    pub(super) fn section<S: Scalar>(&self, link: usize, d: S) -> BeamSection<S> {
        let mut section = BeamSection::circular(d, self.young, self.poisson, self.density);
        let extra = self.rotary_inertia[link] * self.lengths[link].powi(2) / 12.0;
        section.inertia += section.mass * extra;
        section
    }
}

impl ParametricMechanism for FourBar {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        self.check(b)?;
        let [gx, gy] = self.gravity.map(S::from);
        let mut m = Mechanism::with_gravity(gx, gy);
        let [joint_b, joint_c] = self.joints(self.start_angle)?.map(|p| p.map(S::from));
        let (o, d) = ([S::from(0.0); 2], [S::from(self.ground), S::from(0.0)]);
        let pivots = [m.fixed_node("O", o[0], o[1]), m.fixed_node("D", d[0], d[1])];
        let mut link = |i: usize, from, to, ends| {
            let section = self.section(i, b[i]);
            m.beam(&format!("link {}", i + 1), [from, to], ends, self.elements, &section, self.shear)
        };
        let (crank, crank_parts) = link(0, o, joint_b, [Some(pivots[0]), None]);
        let (coupler, coupler_parts) = link(1, joint_b, joint_c, [crank.last().copied(), None]);
        let (_, rocker_parts) = link(2, d, joint_c, [Some(pivots[1]), coupler.last().copied()]);
        let motion = [self.start_angle, self.speed, self.start_up_time].map(S::from);
        m.drive(crank[0].theta, self.start_up, &motion);
        for (i, parts) in [crank_parts, coupler_parts, rocker_parts].iter().enumerate() {
            add_moments(&mut m, i + 1, parts)?;
        }
        Ok(m)
    }
}

/// Adds the outputs `moment link.node`, means of the adjacent elements.
fn add_moments<S: Scalar>(m: &mut Mechanism<S>, link: usize, parts: &[ElementIndex]) -> Result<()> {
    for node in 0..=parts.len() {
        let mut terms = Vec::with_capacity(2);
        if node > 0 {
            terms.push(m.measure(parts[node - 1], "moment_j")?);
        }
        if node < parts.len() {
            terms.push(m.measure(parts[node], "moment_i")?);
        }
        let weight = S::from(1.0 / terms.len() as f64);
        let terms: Vec<_> = terms.into_iter().map(|term| term.times(weight)).collect();
        m.output(format!("moment {link}.{}", node + 1), &terms);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::analyses::dynamics::simulate;

    /// Largest stress over all nodes and times, divided by the allowed one, minus one, in %.
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
