//! Choice of the method that differentiates an analysis.

use std::collections::BTreeMap;

/// Method by which an analysis is differentiated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Differentiation {
    /// Direct for few design variables, adjoint for few responses: see [`Differentiation::of`].
    #[default]
    Automatic,
    /// The direct method: forward in time, for all responses at once.
    Direct,
    /// The discrete adjoint method: backwards in time, for all design variables at once.
    Adjoint,
    /// The direct method with differenced residuals, a check of the others. Not for explicit steps.
    SemiAnalytical,
}

/// Costs of the direct and the adjoint method, in any unit: measured by `cargo bench --bench adjoint`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Fixed cost of the direct method, and its cost for each eight design variables.
    pub direct: [f64; 2],
    /// Fixed cost of the adjoint method, and its cost for each four responses.
    pub adjoint: [f64; 2],
}

impl Cost {
    /// Recorded implicit steps, in analyses.
    pub const IMPLICIT: Self = Self { direct: [0.7, 1.0], adjoint: [1.3, 0.4] };
    /// Explicit steps, in analyses.
    pub const EXPLICIT: Self = Self { direct: [1.3, 0.25], adjoint: [1.6, 0.3] };
    /// Static equilibria.
    pub const EQUILIBRIUM: Self = Self { direct: [0.0, 1.0], adjoint: [0.0, 2.0] };
    /// Kinematics with inverse dynamics.
    pub const KINEMATICS: Self = Self { direct: [0.0, 1.6], adjoint: [0.0, 1.2] };
}

impl Differentiation {
    /// The method for this many design variables and responses, where every response takes a full reverse pass.
    ///
    /// A forward pass carries eight design variables, a reverse pass four responses.
    pub fn of(self, variables: usize, responses: usize, cost: Cost) -> Self {
        self.choose(variables.div_ceil(8), responses.div_ceil(4), cost)
    }

    /// The method for analyses that solve each time point separately; `points` has the time point of each response.
    pub fn at_points(self, variables: usize, points: impl IntoIterator<Item = usize>, cost: Cost) -> Self {
        let mut responses = BTreeMap::<usize, usize>::new();
        points.into_iter().for_each(|point| *responses.entry(point).or_default() += 1);
        let backward = responses.values().map(|count| count.div_ceil(4)).sum();
        self.choose(responses.len() * variables.div_ceil(8), backward, cost)
    }

    fn choose(self, forward: usize, backward: usize, cost: Cost) -> Self {
        let total = |[fixed, each]: [f64; 2], count: usize| fixed + each * count as f64;
        match self {
            Self::Automatic if total(cost.adjoint, backward) < total(cost.direct, forward) => Self::Adjoint,
            Self::Automatic => Self::Direct,
            chosen => chosen,
        }
    }

    /// The name of the method.
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::Direct => "direct",
            Self::Adjoint => "adjoint",
            Self::SemiAnalytical => "semi-analytical",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Differentiation::*;
    use super::*;

    #[test]
    fn few_variables_go_forward_and_few_responses_backward() {
        assert_eq!(Automatic.of(3, 3, Cost::IMPLICIT), Direct);
        assert_eq!(Automatic.of(512, 4, Cost::IMPLICIT), Adjoint);
        assert_eq!(Direct.of(512, 4, Cost::IMPLICIT), Direct);
    }

    #[test]
    fn time_points_are_counted_one_by_one() {
        let four_each = || (0..40).map(|k| k / 4);
        assert_eq!(Automatic.at_points(8, four_each(), Cost::EQUILIBRIUM), Direct);
        assert_eq!(Automatic.at_points(24, four_each(), Cost::EQUILIBRIUM), Adjoint);
        // Each response at a time point of its own.
        assert_eq!(Automatic.at_points(24, 0..40, Cost::EQUILIBRIUM), Adjoint);
    }
}
