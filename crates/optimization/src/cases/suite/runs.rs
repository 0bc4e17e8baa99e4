//! Runs of methods on the problems of the suites.

use super::verification::{Claim, Verification, verify_claim};
use super::{Suite, Transformation};
use crate::cases::CatalogueEntry;
use crate::cases::benchmark::{AnalysisCounts, benchmark_method};
use crate::sao::Preset;
use error::Result;
use rayon::prelude::*;

/// A run of a method on a problem, with the verification of its claim.
#[derive(Clone, Debug, PartialEq)]
pub struct SuiteRun {
    /// Name of the problem.
    pub problem: &'static str,
    /// Group of the problem.
    pub suite: Suite,
    /// Transformation of the problem.
    pub transformation: Transformation,
    /// Name of the method.
    pub method: String,
    /// Status at the end in words, or the reason why the method does not apply to the problem.
    pub status: String,
    /// Numbers of analyses of the whole run.
    pub work: AnalysisCounts,
    /// Verification of the claim; none without a run.
    pub verification: Option<Verification>,
}

impl SuiteRun {
    /// True if the run has solved its problem.
    pub fn is_solved(&self) -> bool {
        self.verification.is_some_and(|j| j.verdict.is_solved())
    }
}

/// Runs each method on each problem with each transformation, in parallel: problem by problem, and methods in order for each.
///
/// Methods run for at most 100 cycles, with accuracy 1e-6 of the objective and residual 1e-3.
///
/// # Errors
/// If a problem cannot be built or evaluated at its end.
pub fn run(
    entries: &[&'static CatalogueEntry],
    transformations: &[Transformation],
    presets: &[&'static Preset],
) -> Result<Vec<SuiteRun>> {
    let mut all = vec![];
    for entry in entries {
        for transformation in transformations {
            all.extend(presets.iter().map(|preset| (*entry, transformation, *preset)));
        }
    }
    all.into_par_iter().map(|(entry, transformation, preset)| one(entry, transformation, preset)).collect()
}

fn one(entry: &'static CatalogueEntry, transformation: &Transformation, preset: &'static Preset) -> Result<SuiteRun> {
    let problem = transformation.build(entry)?;
    match benchmark_method(preset).solve(&problem, |_| ()) {
        Ok(state) => {
            let work = AnalysisCounts {
                analyses: state.counters.analyses,
                sensitivity_analyses: state.counters.sensitivity_analyses,
            };
            let verification = verify_claim(entry, transformation, &problem, state.status.into(), &state.design)?;
            let status = state.status.to_string();
            Ok(SuiteRun {
                status,
                work,
                verification: Some(verification),
                ..SuiteRun::refused(entry, transformation, preset.name, "")
            })
        }
        Err(error) => Ok(SuiteRun::refused(entry, transformation, preset.name, &error.to_string())),
    }
}

impl SuiteRun {
    /// A run that did not start, and the reason.
    fn refused(entry: &CatalogueEntry, transformation: &Transformation, method: &str, why: &str) -> Self {
        Self {
            problem: entry.name,
            suite: entry.suite,
            transformation: *transformation,
            method: method.to_owned(),
            status: format!("refused: {why}"),
            work: AnalysisCounts { analyses: 0, sensitivity_analyses: 0 },
            verification: None,
        }
    }

    /// Verifies the end of another program's run, such as those of `benches/peers`.
    ///
    /// # Errors
    /// If the problem cannot be built, or the design has another length or cannot be evaluated.
    pub fn of_peer(
        entry: &CatalogueEntry,
        transformation: &Transformation,
        peer: &str,
        claim: Claim,
        work: AnalysisCounts,
        design: &[f64],
    ) -> Result<Self> {
        let problem = transformation.build(entry)?;
        let verification = Some(verify_claim(entry, transformation, &problem, claim, design)?);
        let status = format!("{claim:?}").to_lowercase();
        Ok(Self { status, work, verification, ..Self::refused(entry, transformation, peer, "") })
    }
}
