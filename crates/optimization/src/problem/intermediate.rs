//! Intermediate design variables: the variables in which a response is close to linear.

use super::IntermediateMap;
use super::problem_scalar::{AnyMap, ProblemScalar};
use autodiff::Scalar;
use std::sync::Arc;

/// One intermediate variable of one design variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Intermediate {
    /// bᴵ = b: the response is linearized in the design variable itself.
    Identity,
    /// bᴵ = 1/b: exact for stresses and displacements of statically determinate trusses.
    Reciprocal,
    /// bᴵ = bᵖ, for b > 0.
    Power(f64),
    /// bᴵ = π b²/4: the area of a circular section of diameter b (equation 54).
    AreaOfDiameter,
}

impl Intermediate {
    /// bᴵ(b).
    pub fn of<S: Scalar>(self, b: S) -> S {
        match self {
            Self::Identity => b,
            Self::Reciprocal => b.recip(),
            Self::Power(p) => b.powf(p),
            Self::AreaOfDiameter => b * b * std::f64::consts::FRAC_PI_4,
        }
    }
}

/// The intermediate variables of one response: a choice for each design variable, or a map of the whole design.
#[derive(Clone, Default)]
pub enum Intermediates {
    /// bᴵ = b for every design variable.
    #[default]
    Identity,
    /// One choice for each design variable, in order.
    Each(Vec<Intermediate>),
    /// A user-defined map.
    Map(Arc<dyn AnyMap>),
}

impl Intermediates {
    /// One choice for all `n` design variables.
    pub fn all(n: usize, choice: Intermediate) -> Self {
        Self::Each(vec![choice; n])
    }

    /// A user-defined map of the whole design.
    pub fn map(map: impl IntermediateMap) -> Self {
        Self::Map(Arc::new(map))
    }

    /// True if each component depends on its own design variable alone.
    pub fn is_separable(&self) -> bool {
        !matches!(self, Self::Map(_))
    }

    /// Component k of bᴵ(b).
    pub fn component<S: ProblemScalar>(&self, k: usize, design: &[S]) -> S {
        match self {
            Self::Identity => design[k],
            Self::Each(choice) => choice[k].of(design[k]),
            Self::Map(map) => S::call_map(&**map, k, design),
        }
    }
}

impl std::fmt::Debug for Intermediates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Identity => f.write_str("Identity"),
            Self::Each(choice) => f.debug_tuple("Each").field(choice).finish(),
            Self::Map(_) => f.write_str("Map"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::gradient;

    #[test]
    fn values_and_slopes_of_all_choices() {
        let cases = [
            (Intermediate::Identity, 2.0, 1.0),
            (Intermediate::Reciprocal, 0.5, -0.25),
            (Intermediate::Power(3.0), 8.0, 12.0),
            (Intermediate::AreaOfDiameter, std::f64::consts::PI, std::f64::consts::PI),
        ];
        for (choice, value, slope) in cases {
            let (v, g) = gradient(|b| choice.of(b[0]), &[2.0]);
            assert!((v - value).abs() < 1e-15 && (g[0] - slope).abs() < 1e-14, "{choice:?}");
        }
    }
}
