//! The adjoint of analyses that need no history: equilibria, and kinematics with inverse dynamics.

use crate::Result;
use crate::analyses::dynamics::Origin;
use crate::analyses::kinematics::Walk;
use crate::analyses::statics::{Statics, balance};
use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::adjoint_state::{LANES, Lanes};
use crate::derivatives::adjoint::backward::by_time;
use crate::derivatives::adjoint::batch::{Lane, Products};
use crate::derivatives::adjoint::initial_conditions::Settling;
use crate::derivatives::adjoint::{Functional, check, contract};
use crate::derivatives::forward::instants::check_driven;
use crate::derivatives::seeding::build_sensitive;
use crate::diagnostics;
use crate::events::impact;
use crate::initial_conditions::{Assembly, assemble};
use crate::integrators::generalized_alpha::Prescribed;
use crate::mechanism::scalars::Sensitive;
use crate::mechanism::{Mechanism, Model};
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
pub fn differentiate_equilibria_backwards<M: Model>(
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
    let (mut lanes, mut rows) = (whole.lanes(&system), vec![[0.0]; system.size()]);
    let mut products = Products::at_rest(mechanism, dependence, &system, lanes.len());
    for (k, &t) in whole.times.iter().enumerate() {
        state.t = t;
        balance(&mut system, mechanism, &mut state, settings)?;
        system.assemble(mechanism, &state, Linearization::statics(), &mut rows);
        diagnostics::factorize(&mut system, mechanism, &state)?;
        let mut lanes = whole.sample(k, &state, &mut lanes, &mut products);
        for lane in &mut lanes {
            lane.solve(&mut system, |bars, unknown| match unknown {
                Unknown::Coordinate(i) => bars.q[i],
                Unknown::Multiplier(m) => bars.l[m],
            });
        }
        products.pull(mechanism, &system, &state, 1.0, &mut lanes);
        let nothing = [0.0; LANES];
        for lane in lanes {
            for i in dependence.moving() {
                let bars = [&lane.now.q[i], &nothing, &nothing];
                lane.design.take_motion(mechanism, i, t, Prescribed::Exact, bars);
            }
            lane.now.clear(); // an equilibrium does not depend on where it was sought from
        }
    }
    Ok(whole.contract(&lanes))
}

/// Kinematics and inverse dynamics of `model` at `times`, and the derivatives of `responses` of its outputs, a row each.
///
/// At each time point three transposed back-substitutions for up to four responses: of accelerations and multipliers, of
/// velocities, of positions. The result is that of
/// [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics) up to rounding.
///
/// **Errors.** As there, and [`crate::Error::Definition`] if a response has a term that there is not.
pub fn differentiate_kinematics_backwards<M: Model>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    responses: &[Functional],
) -> Result<DMatrix<f64>> {
    let whole = Whole::build(model, b, times, responses)?;
    let Whole { mechanism, dependence, .. } = &whole;
    let Some(&first) = times.first() else { return Ok(DMatrix::zeros(responses.len(), b.len())) };
    let mut walk = Walk::new(mechanism, assembly, first)?;
    check_driven(&walk)?;
    let mut lanes = whole.lanes(&walk.system);
    let mut products = Products::at_rest(mechanism, dependence, &walk.system, lanes.len());
    let mut settling = Settling::new(mechanism, dependence, &walk.system);
    for (k, &t) in whole.times.iter().enumerate() {
        if t != walk.state.t {
            walk.go(t)?;
        }
        let mut lanes = whole.sample(k, &walk.state, &mut lanes, &mut products);
        if !lanes.is_empty() {
            settling.back(&mut walk.system, &walk.state, &walk.projection, true, Origin::Built, &mut lanes)?;
        }
        lanes.into_iter().for_each(|lane| lane.now.clear()); // nor does a driven mechanism
    }
    Ok(whole.contract(&lanes))
}

/// A mechanism whose responses are taken instant by instant.
struct Whole<'t> {
    mechanism: Mechanism<f64>,
    sensitive: Vec<Mechanism<Sensitive>>,
    dependence: Dependence,
    /// As far as responses go.
    times: &'t [f64],
    /// For each time, the responses that it counts in: lane, output and weight.
    wanted: Vec<Vec<(usize, usize, Lanes)>>,
    responses: usize,
    variables: usize,
}

impl<'t> Whole<'t> {
    fn build<M: Model>(model: &M, b: &[f64], times: &'t [f64], responses: &[Functional]) -> Result<Self> {
        let mechanism = model.build(b)?;
        check(responses, mechanism.outputs.len(), times.len())?;
        let sensitive = build_sensitive(model, b, &mechanism)?;
        let dependence = Dependence::of(&sensitive, &mechanism);
        let wanted = by_time(responses, times.len());
        let count = wanted.iter().rposition(|wanted| !wanted.is_empty()).map_or(0, |last| last + 1);
        let (times, responses, variables) = (&times[..count], responses.len(), b.len());
        Ok(Self { mechanism, sensitive, dependence, times, wanted, responses, variables })
    }

    fn lanes(&self, system: &System) -> Vec<Lane> {
        vec![Lane::new(&self.mechanism, system.size()); self.responses.div_ceil(LANES)]
    }

    /// Takes in the outputs at time number `k`. Returns the lanes that it counts in.
    fn sample<'l>(
        &self,
        k: usize,
        state: &State<f64>,
        lanes: &'l mut [Lane],
        products: &mut Products,
    ) -> Vec<&'l mut Lane> {
        for (lane, output, weight) in &self.wanted[k] {
            lanes[*lane].output(&self.mechanism, state, *output, weight, &mut products.probe);
        }
        let counts = |lane: usize| self.wanted[k].iter().any(|wanted| wanted.0 == lane);
        lanes.iter_mut().enumerate().filter(|(lane, _)| counts(*lane)).map(|(_, lane)| lane).collect()
    }

    fn contract(&self, lanes: &[Lane]) -> DMatrix<f64> {
        contract(lanes, &self.sensitive, self.responses, self.variables)
    }
}
