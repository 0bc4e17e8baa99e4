//! Override of the decision on the last trial step: the user accepts a design that the method has rejected, or the reverse.

use super::{Cycle, Method, RunState, Status};
use crate::problem::Problem;
use error::{Error, Result};

/// Factor of the move limits after the user has rejected a step.
const REJECTED: f64 = 0.5;

impl Method {
    /// Accepts the last trial step of a state, which the method has rejected: returns the state with its design. The design is analysed
    /// again.
    ///
    /// The filter of the [automatic method](super::Automatic) is emptied, because it would reject designs near this one.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if there is no rejected proposal that could be analysed; errors of its analysis and of the
    /// derivatives.
    pub fn accept_rejected_step(&self, problem: &Problem, mut state: RunState) -> Result<RunState> {
        let last = last_step(&state)?;
        require(!last.accepted, "it was accepted already")?;
        require(last.failure.is_none(), "its design could not be analysed")?;
        let analyzed = problem.analyze_design(&last.design)?;
        let data = match state.data.take() {
            Some(data) => data,
            None => self.screen_and_differentiate(problem, &mut state)?,
        };
        if let Some(last) = state.history.last_mut() {
            last.accepted = true;
        }
        match self.automatic {
            Some(automatic) => automatic.accept_rejected_step(self, problem, &mut state, (analyzed, data))?,
            None => {
                self.keep(problem, &mut state, &data);
                state.advance(analyzed, data.sensitivities, self.memory());
            }
        }
        Ok(running(state))
    }

    /// Rejects the last trial step of `after`, which the method has accepted: returns the state `before` it with this step as a rejected
    /// one and half the move limits. Those of the automatic method are at most half the step.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the last step was not accepted, or if `before` is not the state before it; errors of the
    /// derivatives.
    pub fn reject_accepted_step(&self, problem: &Problem, before: RunState, after: &RunState) -> Result<RunState> {
        let last = last_step(after)?;
        require(last.accepted, "it was rejected already")?;
        let is_adopted = after.confirmation.as_ref().is_some_and(|confirmation| confirmation.is_adopted);
        require(!is_adopted, "the confirmation of the end found it")?;
        let is_before = before.history.len() + 1 == after.history.len() && before.problem == after.problem;
        require(is_before, "the state before it is another one")?;
        let mut state = RunState { counters: after.counters, ..before };
        match self.automatic {
            Some(automatic) => automatic.shorten_next_step(self, problem, &mut state, &last.design)?,
            None => state.factors.iter_mut().for_each(|factor| *factor *= REJECTED),
        }
        state.history.push(Cycle { accepted: false, ..last.clone() });
        Ok(running(state))
    }
}

fn running(state: RunState) -> RunState {
    RunState { status: Status::Running, reason: String::new(), ..state }
}

/// The last trial step of a run.
fn last_step(state: &RunState) -> Result<&Cycle> {
    let last = state.history.last().filter(|cycle| cycle.cycle > 0);
    last.ok_or_else(|| Error::definition("the last proposal", "there is none yet", "do a trial step first"))
}

fn require(holds: bool, why: &str) -> Result<()> {
    if holds {
        Ok(())
    } else {
        Err(Error::definition(
            "the last proposal",
            why,
            "decide about a proposal that the method has decided otherwise",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::find;
    use crate::sao::{Stop, preset};

    /// The run of a preset from the start of a case, stopped after a number of trial steps.
    fn run(name: &str, case: &str, trials: usize) -> (Method, Problem, Vec<RunState>) {
        let problem = (find(case).unwrap().build)().unwrap();
        let method = (preset(name).unwrap().method)().with_stop(Stop { max_cycles: 100, ..Stop::default() });
        let mut states = vec![method.start(&problem).unwrap()];
        for _ in 0..trials {
            let next = method.step(&problem, states.last().unwrap().clone()).unwrap();
            states.push(next);
        }
        (method, problem, states)
    }

    #[test]
    fn a_refused_step_is_shorter_and_an_accepted_one_is_the_design() {
        for name in ["automatic", "slp", "slp-filter", "gcmma", "tana"] {
            let (method, problem, states) = run(name, "cantilever", 2);
            for k in 1..=2 {
                let (before, after) = (&states[k - 1], &states[k]);
                let proposal = after.history.last().unwrap();
                if !proposal.accepted {
                    continue;
                }
                let refused = method.reject_accepted_step(&problem, before.clone(), after).unwrap();
                assert_eq!((&refused.design, refused.history.len()), (&before.design, after.history.len()), "{name}");
                assert!(!refused.history.last().unwrap().accepted);
                assert_eq!(refused.counters.analyses, after.counters.analyses, "{name}");
                refused.check(&problem).unwrap();
                // Accepted after all, it is the design again.
                let accepted = method.accept_rejected_step(&problem, refused.clone()).unwrap();
                assert_eq!((&accepted.design, &accepted.evaluation), (&after.design, &after.evaluation), "{name}");
                accepted.check(&problem).unwrap();
                let end = method.resume(&problem, accepted, |_| ()).unwrap();
                assert!((end.evaluation.objective - 1.339_957).abs() < 1e-4, "{name}: {}", end.evaluation.objective);
                let end = method.resume(&problem, refused, |_| ()).unwrap();
                assert!((end.evaluation.objective - 1.339_957).abs() < 1e-4, "{name}: {}", end.evaluation.objective);
            }
        }
    }

    #[test]
    fn the_automatic_method_takes_half_a_step_that_was_refused() {
        let (method, problem, states) = run("automatic", "cantilever", 4);
        // The first step may be repeated with rows that screening has removed.
        let is_accepted = |pair: &&[RunState]| pair[1].history.last().is_some_and(|cycle| cycle.accepted);
        let [before, after] = states.windows(2).find(is_accepted).unwrap() else { unreachable!() };
        let refused = method.reject_accepted_step(&problem, before.clone(), after).unwrap();
        let again = method.step(&problem, refused).unwrap();
        let length = |to: &RunState| -> f64 {
            let from = &before.design;
            to.history.last().unwrap().design.iter().zip(from).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        assert!(length(&again) <= 0.5 * length(after) * (1.0 + 1e-9), "{} {}", length(&again), length(after));
    }

    #[test]
    fn a_decision_needs_a_proposal_that_was_decided_otherwise() {
        let (method, problem, states) = run("mma", "cantilever", 1);
        let why = |result: Result<RunState>| result.unwrap_err().to_string();
        assert!(why(method.accept_rejected_step(&problem, states[0].clone())).contains("none yet"));
        assert!(why(method.accept_rejected_step(&problem, states[1].clone())).contains("accepted already"));
        assert!(why(method.reject_accepted_step(&problem, states[1].clone(), &states[1])).contains("another one"));
        let refused = method.reject_accepted_step(&problem, states[0].clone(), &states[1]).unwrap();
        assert!(why(method.reject_accepted_step(&problem, states[0].clone(), &refused)).contains("rejected already"));
    }
}
