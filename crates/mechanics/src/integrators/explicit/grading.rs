//! Steps whose stages are graded towards one end, where the rates contain powers that are not integers.

use autodiff::Scalar;

/// Distribution of the stages of a step.
///
/// Where a contact closes or opens, its force is proportional to δ^{3/2}, and δ to the distance in time. Rates with such a power lose the
/// order of the method, and their derivatives, with the power 1/2, lose more of it. A graded step takes the square root σ of that distance
/// as its variable: rates and derivatives are smooth functions of σ.
///
/// A step from t₀ with the length h integrates dy/dσ = h s′(σ) f(t₀ + h s(σ), y) from 0 to 1. The stored rates are f; the
/// factors s′ belong to the weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grading {
    /// s = σ: the stages of the method.
    #[default]
    Even,
    /// s = σ²: towards the beginning.
    Start,
    /// s = 1 − (1 − σ)²: towards the end.
    End,
}

impl Grading {
    /// All gradings, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Even, Self::Start, Self::End];

    /// Fraction s of the length of the step at the variable `x`.
    pub fn fraction(self, x: f64) -> f64 {
        match self {
            Self::Even => x,
            Self::Start => x * x,
            Self::End => x * (2.0 - x),
        }
    }

    /// Derivative s′ at the variable `x`.
    pub fn slope(self, x: f64) -> f64 {
        match self {
            Self::Even => 1.0,
            Self::Start => 2.0 * x,
            Self::End => 2.0 * (1.0 - x),
        }
    }

    /// The variable at the fraction `s` of the length of the step.
    pub fn variable<T: Scalar>(self, s: T) -> T {
        match self {
            Self::Even => s,
            Self::Start => s.sqrt(),
            Self::End => -(-s + 1.0).sqrt() + 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrators::explicit::dop853::DOP853;
    use crate::integrators::explicit::tableau::DOPRI5;

    /// The powers s^{p/2}, the rates of s^{p/2 + 1}, are polynomials in σ.
    #[test]
    fn graded_steps_integrate_half_integer_powers_of_the_distance() {
        for table in [&DOPRI5, &DOP853] {
            for p in 0..table.order - 1 {
                let exponent = f64::from(p) / 2.0;
                let rate = |s: f64| s.powf(exponent) * (exponent + 1.0);
                let start: f64 = table
                    .row(table.end, Grading::Start)
                    .map(|(j, weight)| weight * rate(Grading::Start.fraction(table.nodes[j])))
                    .sum();
                let end: f64 = table
                    .row(table.end, Grading::End)
                    .map(|(j, weight)| weight * rate((1.0 - Grading::End.fraction(table.nodes[j])).max(0.0)))
                    .sum();
                assert!((start - 1.0).abs() < 1e-13 && (end - 1.0).abs() < 1e-13, "{} {p}: {start} {end}", table.name);
            }
        }
    }

    #[test]
    fn variables_are_those_of_the_fractions() {
        for grading in Grading::ALL {
            for x in [0.0, 0.2, 0.7, 1.0] {
                assert!((grading.variable(grading.fraction(x)) - x).abs() < 1e-15);
                let slope = (grading.fraction(x + 1e-6) - grading.fraction(x - 1e-6)) / 2e-6;
                assert!((grading.slope(x) - slope).abs() < 1e-9);
            }
            let weights = DOPRI5.graded_dense_weights(1.0f64, grading);
            assert!((weights.change - 1.0).abs() < 1e-15 && weights.slots.iter().all(|weight| *weight == 0.0));
        }
    }
}
