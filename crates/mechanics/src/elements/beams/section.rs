//! Cross sections of beams.

use autodiff::Scalar;

/// Choice of the shear stiffness GA* of a beam element.
///
/// # Sources
/// MacNeal, *Comput. Struct.* 8 (1978) 175–183, for the residual bending flexibility.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shear {
    /// 1/GA* = 1/GA_s + ℓ²/(12 EI): exact bending of the element, and shear flexibility.
    Flexible,
    /// 1/GA* = ℓ²/(12 EI): exact bending, no shear (Euler–Bernoulli).
    Rigid,
    /// GA* = GA_s: the plain one-point element, too stiff in bending by order ℓ².
    Plain,
    /// GA* of [`Flexible`](Self::Flexible), and the axis between the nodes is the cubic of that bending flexibility, whose length the axial
    /// strain takes into account, see [`Beam`](super::Beam). For beams under tension: elements of the other kinds with residual bending
    /// flexibility are unstable where the normal force exceeds 12 EI/ℓ².
    Cubic,
}

impl Shear {
    /// GA* of an element of the given length with the shear stiffness GA_s and the bending stiffness EI.
    pub(crate) fn stiffness<S: Scalar>(self, length: S, shear: S, bending: S) -> S {
        let bending_flexibility = length * length / (bending * 12.0);
        match self {
            Self::Flexible | Self::Cubic => (shear.recip() + bending_flexibility).recip(),
            Self::Rigid => bending_flexibility.recip(),
            Self::Plain => shear,
        }
    }

    /// 1 if the axis between the nodes is a cubic, 0 if it is straight.
    pub(crate) fn cubic<S: Scalar>(self) -> S {
        S::from(if self == Self::Cubic { 1.0 } else { 0.0 })
    }
}

/// Deflection of the axis between the nodes of an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deflection<S> {
    /// 1 if the axis is a cubic, 0 if it is straight.
    pub cubic: S,
    /// Unloaded length in m.
    pub length: S,
}

impl<S: Scalar> Deflection<S> {
    /// The factor c of γ²/2 in the axial strain for the shear stiffness GA* and the bending stiffness EI, see
    /// [`Beam`](super::Beam).
    pub fn shear_shortening(self, shear: S, bending: S) -> S {
        let bent = self.cubic * shear * self.length * self.length / (bending * 12.0);
        bent * 2.0 - bent * bent * 0.8
    }
}

/// The area, made negative or zero if the lengths of the section are inadmissible, so that the element rejects it.
fn signed<S: Scalar>(area: S, is_admissible: bool) -> S {
    if is_admissible == (area.re() > 0.0) { area } else { -area }
}

/// Stiffness and mass per length of a beam.
#[derive(Clone, Copy, Debug)]
pub struct BeamSection<S> {
    /// EA in N.
    pub axial: S,
    /// G A_s in N.
    pub shear: S,
    /// EI in N·m².
    pub bending: S,
    /// Mass per length in kg/m.
    pub mass: S,
    /// Rotary inertia per length in kg·m.
    pub inertia: S,
}

impl<S: Scalar> BeamSection<S> {
    /// A solid circular section of diameter `d` in m: A = π d²/4, I = π d⁴/64, A_s = 0.9 A.
    ///
    /// * `young` in N/m², `poisson` without unit, `density` in kg/m³.
    pub fn circular(d: S, young: f64, poisson: f64, density: f64) -> Self {
        let area = signed(d * d, d.re() > 0.0) * (std::f64::consts::PI / 4.0);
        let second_moment = area * d * d * (1.0 / 16.0);
        Self::of(area, second_moment, 0.9, young, poisson, density)
    }

    /// A solid rectangular section: A = b h, I = b h³/12, A_s = 5/6 A.
    pub fn rectangular(width: S, height: S, young: f64, poisson: f64, density: f64) -> Self {
        let area = signed(width * height, width.re() > 0.0 && height.re() > 0.0);
        Self::of(area, area * height * height * (1.0 / 12.0), 5.0 / 6.0, young, poisson, density)
    }

    /// A section of the given area (m²), second moment of area (m⁴) and ratio of shear area to area.
    pub fn of(area: S, second_moment: S, shear_ratio: f64, young: f64, poisson: f64, density: f64) -> Self {
        Self {
            axial: area * young,
            shear: area * (shear_ratio * young / (2.0 * (1.0 + poisson))),
            bending: second_moment * young,
            mass: area * density,
            inertia: second_moment * density,
        }
    }

    pub(crate) fn parameters(&self, length: S, shear: Shear, [turn, tension]: [S; 2], gravity: [S; 3]) -> [S; 11] {
        let shear_stiffness = shear.stiffness(length, self.shear, self.bending);
        let [gx, gy, _] = gravity;
        [
            length,
            self.axial,
            shear_stiffness,
            self.bending,
            self.mass,
            self.inertia,
            turn,
            tension,
            shear.cubic(),
            gx,
            gy,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::close;

    #[test]
    fn round_and_square_sections_of_steel() {
        let round = BeamSection::<f64>::circular(0.02, 2e11, 0.25, 8000.0);
        let area = std::f64::consts::PI * 1e-4;
        close(&[round.axial, round.bending], &[2e11 * area, 2e11 * area * 0.25e-4]);
        close(&[round.shear, round.mass, round.inertia], &[0.9 * area * 8e10, 8000.0 * area, 8000.0 * area * 0.25e-4]);
        let square = BeamSection::<f64>::rectangular(0.1, 0.2, 3.0, 0.5, 2.0);
        close(&[square.axial, square.bending, square.shear], &[0.06, 3.0 * 0.0008 / 12.0, 0.02 * 5.0 / 6.0]);
    }

    #[test]
    fn shear_flexibilities_add() {
        let section = BeamSection { axial: 1.0, shear: 6.0, bending: 1.0, mass: 1.0, inertia: 1.0 };
        let shear = |how| section.parameters(2.0, how, [0.0; 2], [0.0; 3])[2];
        close(&[shear(Shear::Plain), shear(Shear::Rigid), shear(Shear::Flexible)], &[6.0, 3.0, 2.0]);
    }

    #[test]
    fn a_section_of_negative_size_has_no_positive_stiffness() {
        for section in [
            BeamSection::<f64>::circular(-0.01, 2e11, 0.3, 7800.0),
            BeamSection::rectangular(-0.01, 0.02, 2e11, 0.3, 7800.0),
            BeamSection::rectangular(-0.01, -0.02, 2e11, 0.3, 7800.0),
            BeamSection::circular(0.0, 2e11, 0.3, 7800.0),
        ] {
            assert!(!(section.axial > 0.0), "{section:?}");
        }
    }
}
