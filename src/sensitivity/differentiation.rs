//! Which method differentiates an analysis.

/// How derivatives of an analysis are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Differentiation {
    /// Direct for few design variables, adjoint for few responses: see [`Differentiation::of`].
    #[default]
    Automatic,
    /// Along with the motion, all responses at once: the direct method.
    Direct,
    /// Against the motion, all design variables at once: the discrete adjoint. Implicit steps only.
    Adjoint,
    /// Along with the motion by differenced residuals: semi-analytical, a witness against the others. Implicit steps only.
    SemiAnalytical,
}

impl Differentiation {
    /// What is chosen for this many design variables and responses at time points.
    ///
    /// By count: a pass forward carries eight design variables, one backward four responses and costs about as much as
    /// three forward (`cargo bench --bench adjoint`); both ways the steps are linearized once.
    pub fn of(self, variables: usize, responses: usize) -> Self {
        let adjoint = 3 * responses.div_ceil(4) < variables.div_ceil(8);
        match self {
            Self::Automatic if adjoint => Self::Adjoint,
            Self::Automatic => Self::Direct,
            chosen => chosen,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Differentiation::*;

    #[test]
    fn few_variables_go_forward_and_few_responses_backward() {
        assert_eq!(Automatic.of(3, 3), Direct);
        assert_eq!(Automatic.of(512, 4), Adjoint);
        assert_eq!(Direct.of(512, 4), Direct);
    }
}
