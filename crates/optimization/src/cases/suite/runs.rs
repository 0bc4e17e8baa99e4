//! Runs of methods on the problems of the suites.

use super::Transformation;
use super::judge::{Claim, Judgement, judge};
use crate::cases::CatalogueEntry;
use crate::cases::benchmark::{AnalysisCounts, benchmark_method};
use crate::sao::{Preset, Status};
use error::Result;
use rayon::prelude::*;

/// A run of a method on a problem, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct SuiteRun {
    /// Name of the problem.
    pub problem: &'static str,
    /// Transformation of the problem.
    pub transformation: Transformation,
    /// Name of the method.
    pub method: String,
    /// Status at the end, or the reason why the method does not apply to the problem.
    pub end: std::result::Result<Claim, String>,
    /// Status in words.
    pub status: String,
    /// Numbers of analyses of the whole run.
    pub work: AnalysisCounts,
    /// The judgement; none without a run.
    pub judgement: Option<Judgement>,
}

impl SuiteRun {
    /// True if the run has solved its problem.
    pub fn is_solved(&self) -> bool {
        self.judgement.is_some_and(|j| j.verdict.is_solved())
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
    let mut run = SuiteRun {
        problem: entry.name,
        transformation: *transformation,
        method: preset.name.to_owned(),
        end: Ok(Claim::Nothing),
        status: String::new(),
        work: AnalysisCounts { analyses: 0, sensitivity_analyses: 0 },
        judgement: None,
    };
    match benchmark_method(preset).solve(&problem, |_| ()) {
        Ok(state) => {
            let claim = Claim::from(state.status);
            run.end = Ok(claim);
            run.status = in_words(state.status);
            run.work = AnalysisCounts {
                analyses: state.counters.analyses,
                sensitivity_analyses: state.counters.sensitivity_analyses,
            };
            run.judgement = Some(judge(entry, transformation, &problem, claim, &state.design)?);
        }
        Err(error) => {
            run.status = "refused".to_owned();
            run.end = Err(error.to_string());
        }
    }
    Ok(run)
}

fn in_words(status: Status) -> String {
    match status {
        Status::CycleLimit => "cycle limit".to_owned(),
        status => format!("{status:?}").to_lowercase(),
    }
}
