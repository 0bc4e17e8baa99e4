//! Semi-analytical derivatives of kinematics, inverse dynamics and statics, instant by instant.

use crate::Result;
use crate::analyses::dynamics::Work;
use crate::analyses::kinematics::KinematicDriver;
use crate::analyses::sampling::Sampler;
use crate::analyses::statics::{Statics, find_equilibrium};
use crate::derivatives::forward::instants::check_driven;
use crate::derivatives::history::{Record, SensitiveHistory};
use crate::derivatives::semi_analytical::besides;
use crate::derivatives::semi_analytical::central_difference::CentralDifference;
use crate::derivatives::semi_analytical::initial_conditions::Starter;
use crate::initial_conditions::{Assembly, assemble};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::System;
use crate::system::state::State;

/// Kinematics and inverse dynamics as [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics)
/// has them, with differenced residuals: `step` as [`STEP`](crate::derivatives::semi_analytical::STEP).
///
/// **Errors.** As there, and for a step that is not positive.
pub fn difference_kinematics<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let mut besides = besides(model, b, &mechanism, step)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let Some(&first) = times.first() else { return Ok(record.finish(Work::default())) };
    let mut walk = KinematicDriver::new(&mechanism, assembly, first)?;
    check_driven(&walk)?;
    for (time, &t) in times.iter().enumerate() {
        if t != walk.state.t {
            walk.go(t)?;
        }
        record.values(time, &mechanism, &walk.state)?;
        let mut starter = Starter { plain: &mechanism, system: &mut walk.system };
        let mut slopes = starter.built(&mut besides, &walk.state, &walk.projection)?;
        starter.accelerations(&mut besides, &walk.state, &mut slopes)?;
        enter(&mut record, time, &mechanism, &mut besides, &walk.state, &slopes);
    }
    Ok(record.finish(Work { steps: times.len(), ..Work::default() }))
}

/// Static equilibria as [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria) has them, with
/// differenced residuals: `step` as [`STEP`](crate::derivatives::semi_analytical::STEP).
///
/// **Errors.** As there, and for a step that is not positive.
pub fn difference_equilibria<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let mut besides = besides(model, b, &mechanism, step)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let first = times.first().copied().unwrap_or(0.0);
    let (mut system, mut values) = (System::at(&mechanism, first)?, State::built(&mechanism, first));
    assemble(&mut system, &mechanism, &mut values, Assembly::default())?;
    for (time, &t) in times.iter().enumerate() {
        values.t = t;
        find_equilibrium(&mut system, &mechanism, &mut values, settings)?;
        record.values(time, &mechanism, &values)?;
        let slopes = Starter { plain: &mechanism, system: &mut system }.equilibrium(&mut besides, &values);
        enter(&mut record, time, &mechanism, &mut besides, &values, &slopes);
    }
    Ok(record.finish(Work { steps: times.len(), ..Work::default() }))
}

/// Slopes of the outputs at one time, with respect to every design variable.
fn enter(
    record: &mut Record,
    time: usize,
    mechanism: &Mechanism<f64>,
    besides: &mut [CentralDifference],
    values: &State<f64>,
    slopes: &[State<f64>],
) {
    let mut sampler = Sampler::new(mechanism);
    for (k, (beside, slopes)) in besides.iter_mut().zip(slopes).enumerate() {
        let outputs = beside.slope(values, slopes, |mechanism, state, out| sampler.outputs(mechanism, state, out));
        let outputs: Vec<f64> = outputs.collect();
        record.slopes(time, k, outputs.chunks(1));
    }
}
