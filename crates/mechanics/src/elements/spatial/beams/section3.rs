//! Cross sections of beams in space.

use autodiff::Scalar;
use std::f64::consts::PI;

/// Stiffness and mass per length of a beam in space with the axis x and the principal axes y and z of its section.
#[derive(Clone, Copy, Debug)]
pub struct BeamSection3<S> {
    /// EA in N.
    pub axial: S,
    /// Shear stiffnesses G A_s along y and z in N.
    pub shear: [S; 2],
    /// Torsional stiffness GJ in N·m².
    pub torsion: S,
    /// Bending stiffnesses EI about y and z in N·m².
    pub bending: [S; 2],
    /// Mass per length in kg/m.
    pub mass: S,
    /// Rotary inertias per length about x, y and z in kg·m.
    pub inertia: [S; 3],
}

impl<S: Scalar> BeamSection3<S> {
    /// A solid circular section of diameter `d` in m, with A_s = 0.9 A and J = π d⁴/32.
    ///
    /// * `young` in N/m², `poisson` without unit, `density` in kg/m³.
    pub fn circular(d: S, young: f64, poisson: f64, density: f64) -> Self {
        let area = d * d.abs() * (PI / 4.0);
        let second_moment = area * d * d * (1.0 / 16.0);
        Self::of(area, [second_moment; 2], second_moment * 2.0, 0.9, [young, poisson, density])
    }

    /// A solid rectangular section with the given lengths (m) along y and z: A_s = 5/6 A, and the torsion constant
    /// J = a b³ (1/3 − 0.21 (b/a)(1 − b⁴/(12 a⁴))) with a ≥ b.
    ///
    /// # Sources
    /// Young & Budynas, *Roark's Formulas for Stress and Strain* (2002), Table 10.1.
    pub fn rectangular([y, z]: [S; 2], young: f64, poisson: f64, density: f64) -> Self {
        let (a, b) = if y.re() >= z.re() { (y, z) } else { (z, y) };
        let area = if b.re() > 0.0 { a * b } else { -(a * b).abs() };
        let ratio = b / a;
        let torsion = area * b * b * (-ratio * (-ratio.powi(4) * (1.0 / 12.0) + 1.0) * 0.21 + 1.0 / 3.0);
        let moments = [area * z * z * (1.0 / 12.0), area * y * y * (1.0 / 12.0)];
        Self::of(area, moments, torsion, 5.0 / 6.0, [young, poisson, density])
    }

    /// A section of the given area (m²), second moments of area about y and z (m⁴), torsion constant (m⁴) and ratio of shear
    /// area to area, of a material with Young's modulus (N/m²), Poisson's ratio and density (kg/m³).
    pub fn of(area: S, moments: [S; 2], torsion: S, shear_ratio: f64, [young, poisson, density]: [f64; 3]) -> Self {
        let shear_modulus = young / (2.0 * (1.0 + poisson));
        let [y, z] = moments;
        Self {
            axial: area * young,
            shear: [area * (shear_ratio * shear_modulus); 2],
            torsion: torsion * shear_modulus,
            bending: [y * young, z * young],
            mass: area * density,
            inertia: [(y + z) * density, y * density, z * density],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::close;

    #[test]
    fn round_and_square_sections_of_steel() {
        let round = BeamSection3::<f64>::circular(0.02, 2e11, 0.25, 8000.0);
        let (area, i) = (PI * 1e-4, PI * 0.25e-8);
        close(&[round.axial, round.bending[0], round.torsion], &[2e11 * area, 2e11 * i, 8e10 * 2.0 * i]);
        close(&[round.shear[0], round.mass, round.inertia[0]], &[0.9 * area * 8e10, 8000.0 * area, 16000.0 * i]);
        // Saint-Venant's torsion constants: 0.1406 of a square and 0.229 a b³ of a rectangle with a = 2 b.
        let square = BeamSection3::<f64>::rectangular([1.0, 1.0], 2.0, 0.0, 1.0);
        assert!((square.torsion - 0.1406).abs() < 3e-4, "{}", square.torsion);
        let strip = BeamSection3::<f64>::rectangular([1.0, 2.0], 2.0, 0.0, 1.0);
        assert!((strip.torsion - 0.229 * 2.0).abs() < 2e-3);
        close(&strip.bending, &[2.0 * 8.0 / 12.0, 2.0 * 2.0 / 12.0]);
        assert!(!(BeamSection3::<f64>::rectangular([-1.0, -2.0], 2.0, 0.0, 1.0).axial > 0.0));
        assert!(!(BeamSection3::<f64>::circular(-1.0, 2.0, 0.0, 1.0).axial > 0.0));
    }
}
