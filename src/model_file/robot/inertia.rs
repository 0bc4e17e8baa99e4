//! Mass, centre of mass and inertia matrix of links, and those of several links together.

use crate::Readable;
use nalgebra::{Isometry3, Matrix3, Vector3};

/// Relative excess of the largest principal moment over the sum of the others that counts as rounding.
const ROUNDING: f64 = 0.01;

/// Mass, centre of mass and inertia matrix about it, in the axes of a frame.
#[derive(Clone, Copy, Debug)]
pub struct MassData {
    /// Mass in kg.
    pub mass: f64,
    /// Centre of mass in m.
    pub centre: Vector3<f64>,
    /// Inertia matrix about the centre of mass in kg·m².
    pub inertia: Matrix3<f64>,
}

impl MassData {
    /// Mass, centre and inertia in the frame in which the present one has the pose `frame`.
    pub fn in_frame(&self, frame: &Isometry3<f64>) -> Self {
        let rotation = *frame.rotation.to_rotation_matrix().matrix();
        Self {
            mass: self.mass,
            centre: frame.transform_point(&self.centre.into()).coords,
            inertia: rotation * self.inertia * rotation.transpose(),
        }
    }

    /// Mass, centre and inertia of two rigidly connected bodies.
    pub fn and(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        Self { mass, centre, inertia: self.about(centre) + other.about(centre) }
    }

    /// Multiplies mass and inertia.
    pub fn scale(&mut self, factor: f64) {
        self.mass *= factor;
        self.inertia *= factor;
    }

    /// The inertia matrix about another point: Steiner's theorem.
    fn about(&self, point: Vector3<f64>) -> Matrix3<f64> {
        let r = self.centre - point;
        self.inertia + (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * self.mass
    }

    /// Principal moments of inertia, smallest first.
    fn moments(&self) -> [f64; 3] {
        let found = self.inertia.symmetric_eigenvalues();
        let mut all = [found[0], found[1], found[2]];
        all.sort_by(f64::total_cmp);
        all
    }

    /// Says why an inertia matrix is physically impossible, with the remedy; `None` for a possible one.
    pub fn mistake(&self) -> Option<(String, &'static str)> {
        let [a, b, c] = self.moments();
        // Seven digits show a violation that is larger than `ROUNDING`.
        let [first, second, third] =
            [a, b, c].map(|moment| Readable(format!("{moment:.6e}").parse().unwrap_or(moment)));
        let principal = format!("the principal moments of inertia are {first}, {second} and {third} kg·m²");
        if !(a > 1e-12 * c && c > 0.0) {
            return Some((principal, "all must be positive: complete <inertia>, and check its products of inertia"));
        }
        (a + b < c * (1.0 - ROUNDING)).then_some((
            format!("{principal}, and the largest exceeds the sum of the others"),
            "check <inertia>, its unit (kg·m²), and that it is about the centre of mass",
        ))
    }

    /// Increases all principal moments slightly if the sum of the two smaller ones falls short of the largest one by rounding. Returns the increase.
    pub fn complete(&mut self) -> Option<f64> {
        let [a, b, c] = self.moments();
        let lack = c - a - b;
        (lack > -1e-9 * c).then(|| {
            let added = lack.max(0.0) + 1e-8 * c;
            self.inertia += Matrix3::identity() * added;
            added
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_halves_of_a_rod_are_the_rod() {
        // A rod of 6 kg and 2 m along x: m l²/12 = 2.
        let half = |x: f64| MassData {
            mass: 3.0,
            centre: Vector3::new(x, 0.0, 0.0),
            inertia: Matrix3::from_diagonal(&Vector3::new(0.0, 0.25, 0.25)),
        };
        let rod = half(-0.5).and(&half(0.5));
        assert_eq!((rod.mass, rod.centre), (6.0, Vector3::zeros()));
        assert!((rod.inertia - Matrix3::from_diagonal(&Vector3::new(0.0, 2.0, 2.0))).norm() < 1e-14);
        let pose = Isometry3::new(Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let turned = half(0.5).in_frame(&pose);
        assert!((turned.centre - Vector3::new(0.0, 0.5, 1.0)).norm() < 1e-15);
        assert!((turned.inertia - Matrix3::from_diagonal(&Vector3::new(0.25, 0.0, 0.25))).norm() < 1e-15);
        assert!(rod.mistake().is_some(), "a rod without thickness");
    }

    #[test]
    fn rounding_is_completed_and_mistakes_are_not() {
        let of = |a: f64, b: f64, c: f64| MassData {
            mass: 1.0,
            centre: Vector3::zeros(),
            inertia: Matrix3::from_diagonal(&Vector3::new(a, b, c)),
        };
        let mut flat = of(0.1, 0.1, 0.2001);
        assert!(flat.mistake().is_none());
        assert!((flat.complete().unwrap() - 1e-4).abs() < 1e-8);
        let [a, b, c] = flat.moments();
        assert!(a + b >= c);
        assert!(of(0.1, 0.1, 0.15).complete().is_none());
        assert!(of(0.1, 0.1, 0.25).mistake().is_some() && of(-0.1, 0.1, 0.1).mistake().is_some());
    }
}
