//! The adjoint of analyses that need no history: equilibria, and kinematics with inverse dynamics.

use crate::Result;
use crate::analyses::dynamics::InitialConfiguration;
use crate::analyses::kinematics::KinematicDriver;
use crate::analyses::statics::{Statics, find_equilibrium};
use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues};
use crate::derivatives::adjoint::backward::by_time;
use crate::derivatives::adjoint::batch::{AdjointBatch, ElementProducts};
use crate::derivatives::adjoint::initial_conditions::InitialConditionAdjoint;
use crate::derivatives::adjoint::{Functional, check, contract};
use crate::derivatives::forward::instants::check_driven;
use crate::derivatives::seeding::build_sensitive;
use crate::diagnostics;
use crate::events::impact;
use crate::initial_conditions::{Assembly, assemble};
use crate::integrators::generalized_alpha::Prescribed;
use crate::mechanism::scalars::Dual8;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::System;
use crate::system::Unknown;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use nalgebra::DMatrix;

/// Static equilibria of `model` at `times` (a load path), and the derivatives of `responses` of its outputs, a row each.
///
/// At an equilibrium F(x, p) = 0 of positions and multipliers x,
///
/// $$ \left(\frac{\partial F}{\partial x}\right)^{\!T}\psi = -\left(\frac{\partial J}{\partial x}\right)^{\!T},\qquad
///    \frac{dJ}{dp} = \frac{\partial J}{\partial p} + \psi^T\frac{\partial F}{\partial p} $$
///
/// with the factorization there: one transposed back-substitution for up to four responses at a time point. The
/// result is that of [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria) up to rounding.
///
/// **Errors.** As there, and [`crate::Error::Definition`] if a response has a term that there is not.
pub fn differentiate_equilibria_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
    responses: &[Functional],
) -> Result<DMatrix<f64>> {
    let whole = Whole::build(model, b, times, responses)?;
    let Whole { mechanism, dependence, .. } = &whole;
    impact::refuse(mechanism, "equilibria")?;
    let start = times.first().copied().unwrap_or(0.0);
    let (mut system, mut state) = (System::at(mechanism, start)?, State::built(mechanism, start));
    assemble(&mut system, mechanism, &mut state, Assembly::default())?;
    let (mut batches, mut rows) = (whole.batches(&system), vec![[0.0]; system.size()]);
    let mut products = ElementProducts::at_rest(mechanism, dependence, &system, batches.len());
    for (k, &t) in whole.times.iter().enumerate() {
        state.t = t;
        find_equilibrium(&mut system, mechanism, &mut state, settings)?;
        system.assemble(mechanism, &state, Linearization::statics(), &mut rows);
        diagnostics::factorize(&mut system, mechanism, &state)?;
        let mut batches = whole.sample(k, &state, &mut batches, &mut products);
        for batch in &mut batches {
            batch.solve(&mut system, |bars, unknown| match unknown {
                Unknown::Coordinate(i) => bars.q[i],
                Unknown::Multiplier(m) => bars.l[m],
            });
        }
        products.vjp(mechanism, &system, &state, 1.0, &mut batches);
        let nothing = [0.0; BATCH];
        for batch in batches {
            for i in dependence.moving() {
                let bars = [&batch.now.q[i], &nothing, &nothing];
                batch.design.take_motion(mechanism, i, t, Prescribed::Exact, bars);
            }
            batch.now.clear(); // an equilibrium does not depend on where it was sought from
        }
    }
    Ok(whole.contract(&batches))
}

/// Kinematics and inverse dynamics of `model` at `times`, and the derivatives of `responses` of its outputs, a row each.
///
/// At each time point three transposed back-substitutions for up to four responses: of accelerations and multipliers, of
/// velocities, of positions. The result is that of
/// [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics) up to rounding.
///
/// **Errors.** As there, and [`crate::Error::Definition`] if a response has a term that there is not.
pub fn differentiate_kinematics_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    responses: &[Functional],
) -> Result<DMatrix<f64>> {
    let whole = Whole::build(model, b, times, responses)?;
    let Whole { mechanism, dependence, .. } = &whole;
    let Some(&first) = times.first() else { return Ok(DMatrix::zeros(responses.len(), b.len())) };
    let mut walk = KinematicDriver::new(mechanism, assembly, first)?;
    check_driven(&walk)?;
    let mut batches = whole.batches(&walk.system);
    let mut products = ElementProducts::at_rest(mechanism, dependence, &walk.system, batches.len());
    let mut initial_conditions = InitialConditionAdjoint::new(mechanism, dependence, &walk.system);
    for (k, &t) in whole.times.iter().enumerate() {
        if t != walk.state.t {
            walk.go(t)?;
        }
        let mut batches = whole.sample(k, &walk.state, &mut batches, &mut products);
        if !batches.is_empty() {
            initial_conditions.back(
                &mut walk.system,
                &walk.state,
                &walk.projection,
                true,
                InitialConfiguration::Built,
                &mut batches,
            )?;
        }
        batches.into_iter().for_each(|batch| batch.now.clear()); // nor does a driven mechanism
    }
    Ok(whole.contract(&batches))
}

/// A mechanism whose responses are taken instant by instant.
struct Whole<'t> {
    mechanism: Mechanism<f64>,
    sensitive: Vec<Mechanism<Dual8>>,
    dependence: Dependence,
    /// As far as responses go.
    times: &'t [f64],
    /// For each time, the responses that it counts in: lane, output and weight.
    wanted: Vec<Vec<(usize, usize, BatchValues)>>,
    responses: usize,
    variables: usize,
}

impl<'t> Whole<'t> {
    fn build<M: ParametricMechanism>(model: &M, b: &[f64], times: &'t [f64], responses: &[Functional]) -> Result<Self> {
        let mechanism = model.build(b)?;
        check(responses, mechanism.outputs.len(), times.len())?;
        let sensitive = build_sensitive(model, b, &mechanism)?;
        let dependence = Dependence::of(&sensitive, &mechanism);
        let wanted = by_time(responses, times.len());
        let count = wanted.iter().rposition(|wanted| !wanted.is_empty()).map_or(0, |last| last + 1);
        let (times, responses, variables) = (&times[..count], responses.len(), b.len());
        Ok(Self { mechanism, sensitive, dependence, times, wanted, responses, variables })
    }

    fn batches(&self, system: &System) -> Vec<AdjointBatch> {
        vec![AdjointBatch::new(&self.mechanism, system.size()); self.responses.div_ceil(BATCH)]
    }

    /// Takes in the outputs at time number `k`. Returns the lanes that it counts in.
    fn sample<'l>(
        &self,
        k: usize,
        state: &State<f64>,
        batches: &'l mut [AdjointBatch],
        products: &mut ElementProducts,
    ) -> Vec<&'l mut AdjointBatch> {
        for (batch, output, weight) in &self.wanted[k] {
            batches[*batch].output(&self.mechanism, state, *output, weight, &mut products.probe);
        }
        let counts = |batch: usize| self.wanted[k].iter().any(|wanted| wanted.0 == batch);
        batches.iter_mut().enumerate().filter(|(batch, _)| counts(*batch)).map(|(_, batch)| batch).collect()
    }

    fn contract(&self, batches: &[AdjointBatch]) -> DMatrix<f64> {
        contract(batches, &self.sensitive, self.responses, self.variables)
    }
}
