//! Identities that every element must satisfy.

use crate::zoo::{Arm, Forces, Joints};
use linkwright::mechanics::analyses::sampling::energy;
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::mechanics::system::Linearization;
use linkwright::mechanics::system::System;
use linkwright::mechanics::system::Unknown;
use linkwright::mechanics::system::state::State;

/// A state away from every symmetry.
fn disturbed(mechanism: &Mechanism<f64>, system: &System) -> State<f64> {
    let mut state = State::built(mechanism, 0.0);
    for unknown in system.unknowns() {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] += 0.01 * (3.0 * i as f64).sin(),
            Unknown::Multiplier(m) => state.l[m] = (1.0 + m as f64).cos(),
        }
    }
    state
}

/// Reactions do no work on motions that the joints allow: the block ∂balance/∂λ is the transpose of ∂Φ/∂q.
#[test]
fn reactions_are_workless() {
    for length_driver in [false, true] {
        let mechanism = Joints { length_driver }.build(&Joints::DESIGN).unwrap();
        let system = System::new(&mechanism).unwrap();
        let state = disturbed(&mechanism, &system);
        let matrix = system.dense_by_seeding(&mechanism, &state, Linearization::statics());
        for (i, unknown) in system.unknowns().iter().enumerate() {
            if matches!(unknown, Unknown::Multiplier(_)) {
                for j in 0..system.size() {
                    assert!(
                        (matrix[(i, j)] - matrix[(j, i)]).abs() < 1e-14,
                        "{:?} {:?}",
                        unknown,
                        system.unknowns()[j]
                    );
                }
            }
        }
    }
}

/// Forces at rest are the gradient of the potential energy, for everything that has one.
#[test]
fn conservative_forces_are_gradients_of_the_energy() {
    let mut b = Forces::DESIGN;
    for k in [5, 9, 12, 14, 15, 16, 20, 21, 24, 30, 31, 32, 37, 38, 40] {
        b[k] = 0.0; // dampers, friction, loads, stop, wall
    }
    let mut arm = Arm::DESIGN;
    arm[4] = 0.0;
    for mechanism in [Forces.build(&b).unwrap(), Arm { elements: 3 }.build(&arm).unwrap()] {
        let mut system = System::new(&mechanism).unwrap();
        let mut state = disturbed(&mechanism, &system);
        state.v.fill(0.0);
        state.l.fill(0.0);
        let mut rows = vec![[0.0]; system.size()];
        system.assemble(&mechanism, &state, Linearization::statics(), &mut rows);
        let largest = rows.iter().fold(0.0f64, |a, r| a.max(r[0].abs()));
        for (row, unknown) in rows.iter().zip(system.unknowns()) {
            let Unknown::Coordinate(i) = *unknown else { continue };
            let at = |step: f64| {
                let mut moved = state.clone();
                moved.q[i] += step;
                energy(&mechanism, &moved)[1]
            };
            let h = 1e-5;
            let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            assert!((slope - row[0]).abs() < 1e-6 * largest.max(1.0), "coordinate {i}: {slope} {}", row[0]);
        }
    }
}

/// What elements declare to be linear in is so: the matrix that relies on it is the one that seeds every unknown.
#[test]
fn constant_derivatives_are_constant() {
    let mut arm = Arm::DESIGN;
    arm[4] = 0.01;
    let mechanisms = [
        Forces.build(&Forces::DESIGN).unwrap(),
        Joints { length_driver: false }.build(&Joints::DESIGN).unwrap(),
        Joints { length_driver: true }.build(&Joints::DESIGN).unwrap(),
        Arm { elements: 3 }.build(&arm).unwrap(),
    ];
    for mechanism in mechanisms {
        let mut system = System::new(&mechanism).unwrap();
        let mut state = disturbed(&mechanism, &system);
        state.t = 0.3;
        state.v.iter_mut().enumerate().for_each(|(i, v)| *v = (2.0 * i as f64).cos());
        state.a.iter_mut().enumerate().for_each(|(i, a)| *a = (5.0 * i as f64).sin());
        let mut rows = vec![[0.0]; system.size()];
        for how in [Linearization::statics(), Linearization::accelerations(), Linearization::step(0.3, 0.7)] {
            let reference = system.dense_by_seeding(&mechanism, &state, how);
            system.assemble(&mechanism, &state, how, &mut rows);
            let error = (system.dense() - &reference).amax();
            assert!(error <= 1e-13 * reference.amax(), "{how:?}: {error:.1e}");
        }
    }
}
