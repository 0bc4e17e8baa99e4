//! A choice of approximation for each response.

use super::{AnyModel, Approximation, Asymptotes, Expansion};
use crate::problem::Problem;
use error::{Error, Result};
use std::sync::Arc;

/// One approximation for all responses, and others for some of them by name.
///
/// Names are those of responses, and of the objective and constraints that are approximated directly.
///
/// ```
/// use linkwright_optimization::approximation::{Linear, Mma, PerResponse, Reciprocal};
/// let choice = PerResponse::all(Linear).but("tip displacement", Reciprocal).but("mass", Mma::default());
/// # let _ = choice;
/// ```
#[derive(Debug)]
pub struct PerResponse {
    default: Box<dyn Approximation>,
    choices: Vec<(String, Box<dyn Approximation>)>,
}

impl PerResponse {
    /// One approximation for all responses.
    pub fn all(approximation: impl Approximation + 'static) -> Self {
        Self { default: Box::new(approximation), choices: vec![] }
    }

    /// Replaces the approximation of the response, objective or constraint of this name; of several choices for a name the last
    /// one applies.
    #[must_use]
    pub fn but(mut self, name: &str, approximation: impl Approximation + 'static) -> Self {
        self.choices.push((name.to_owned(), Box::new(approximation)));
        self
    }

    fn of(&self, name: &str) -> &dyn Approximation {
        self.choices.iter().rev().find(|(n, _)| n == name).map_or(&*self.default, |(_, a)| &**a)
    }

    fn every(&self) -> impl Iterator<Item = &dyn Approximation> {
        self.choices.iter().map(|(_, a)| &**a).chain([&*self.default])
    }
}

impl Approximation for PerResponse {
    fn check(&self, problem: &Problem) -> Result<()> {
        let names: Vec<&str> = problem.approximated().collect();
        if let Some((name, _)) = self.choices.iter().find(|(name, _)| !names.contains(&name.as_str())) {
            let why = format!("nothing of this name is approximated; the approximated names are {}", names.join(", "));
            return Err(Error::definition(format!("approximation of `{name}`"), why, "use one of these names"));
        }
        self.every().try_for_each(|a| a.check(problem))
    }

    fn memory(&self) -> usize {
        self.every().map(Approximation::memory).max().unwrap_or(0)
    }

    fn asymptotes(&self) -> Vec<Asymptotes> {
        self.every().flat_map(Approximation::asymptotes).collect()
    }

    fn is_odd(&self) -> bool {
        self.every().all(Approximation::is_odd)
    }

    fn wants_curvature(&self) -> bool {
        self.every().any(Approximation::wants_curvature)
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        self.of(expansion.name).fit(expansion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::Case;
    use crate::approximation::{Linear, Reciprocal};
    use crate::cases::impact_absorber;
    use autodiff::DualNum as _;

    #[test]
    fn each_number_has_its_own_approximation_and_unknown_names_are_rejected() {
        let choice = PerResponse::all(Linear).but("r", Reciprocal);
        let case = Case::of(|b| b[0].recip(), &[2.0], &[0.1], &[9.0]);
        assert!((case.fit(&choice).unwrap().real(&[4.0]) - 0.25).abs() < 1e-15);
        let problem = impact_absorber::comfort().unwrap();
        let message = choice.check(&problem).unwrap_err().to_string();
        assert!(message.contains("`r`") && message.contains("acceleration"), "{message}");
    }
}
