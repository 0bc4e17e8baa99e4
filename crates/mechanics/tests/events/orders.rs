//! Orders of convergence of values and of derivatives of first and second order in motions with events.

use crate::models::{
    BOUNCING, Bouncing, FALLING, FallingBars, PUSHED, PUSHED_TWICE, Pushed, PushedTwice, SLING, Sling, bouncing,
    pushed, pushed_twice, sling,
};
use autodiff::{gradient, hessian};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::second_order::{HessianPart, differentiate_twice};
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::integrators::generalized_alpha::Newton;
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, ParametricMechanism, Result};

/// Value, gradient and Hessian of an output in closed form.
type Exact = (f64, Vec<f64>, Vec<f64>);

/// Largest errors of values, first and second derivatives at the time `end` (s) over all outputs.
fn errors<M: ParametricMechanism>(
    (model, end): (&M, f64),
    b: &[f64],
    settings: &Dynamics,
    exact: &[(usize, Exact); 2],
) -> [f64; 3] {
    let first = differentiate(model, b, settings, &[end]).unwrap();
    let second = differentiate_twice(model, b, settings, &[end], HessianPart::Full).unwrap();
    let largest =
        |ours: &[f64], exact: &[f64]| ours.iter().zip(exact).fold(0.0f64, |all, (a, b)| all.max((a - b).abs()));
    let mut errors = [0.0f64; 3];
    for (output, (value, slopes, curvatures)) in exact {
        let hessian = second.hessian(*output, 0).unwrap();
        let these = [
            (first.values[*output][0] - value).abs(),
            largest(&first.gradients[*output][0], slopes),
            largest(hessian.as_slice(), curvatures),
        ];
        errors.iter_mut().zip(these).for_each(|(error, this)| *error = error.max(this));
    }
    errors
}

/// Time in s at which the motions are compared: a time of all grids, after one event.
const END: f64 = 0.9;

/// Smallest orders of values, first and second derivatives. A step that ends at an event has an error of h³ times a function of
/// its place between two times of the grid, and each derivative divides by h. The place is another one for each step: the orders
/// of derivatives vary about 2 and 1.
const ORDERS: [f64; 3] = [1.95, 1.7, 0.9];

fn check<M: ParametricMechanism>(of: (&M, f64), b: &[f64], exact: &[(usize, Exact); 2]) {
    check_orders(of, b, exact, ORDERS);
}

fn check_orders<M: ParametricMechanism>(
    (model, end): (&M, f64),
    b: &[f64],
    exact: &[(usize, Exact); 2],
    least: [f64; 3],
) {
    let schemes =
        [GeneralizedAlpha::chung_hulbert(0.9), GeneralizedAlpha::chung_hulbert(0.3), GeneralizedAlpha::hht(0.2)];
    for scheme in schemes.map(Result::unwrap) {
        let newton = Newton { tolerance: 1e-13, iterations: 30 };
        let at = |h: f64| errors((model, end), b, &Dynamics { scheme, newton, ..Dynamics::fixed(h) }, exact);
        let (coarse, fine) = (at(0.01), at(0.01 / 16.0));
        let orders: [f64; 3] = std::array::from_fn(|k| (coarse[k] / fine[k]).log2() / 4.0);
        println!("{scheme:?}: errors {coarse:?} and {fine:?}, orders {orders:.2?}");
        for (order, least) in orders.iter().zip(least) {
            assert!(*order > least, "{scheme:?}: {coarse:?} {fine:?} {orders:?}");
        }
    }
}

#[test]
fn derivatives_through_an_impact_converge_with_the_step() {
    let exact = |output: usize| {
        let (value, slopes) = gradient(|b| bouncing(b, END)[output], &BOUNCING);
        (value, slopes, hessian(|b| bouncing(b, END)[output], &BOUNCING).2.iter().copied().collect())
    };
    check((&Bouncing, END), &BOUNCING, &[(0, exact(0)), (1, exact(1))]);
}

#[test]
fn derivatives_through_a_switched_force_converge_with_the_step() {
    let exact = |output: usize| {
        let (value, slopes) = gradient(|b| pushed(b, END)[output], &PUSHED);
        (value, slopes, hessian(|b| pushed(b, END)[output], &PUSHED).2.iter().copied().collect())
    };
    check((&Pushed, END), &PUSHED, &[(0, exact(0)), (1, exact(1))]);
}

/// The step between the two events is so short that its end is extrapolated from its beginning, and so are the derivatives.
#[test]
fn derivatives_through_two_events_in_a_very_short_time_converge_with_the_step() {
    let exact = |output: usize| {
        let (value, slopes) = gradient(|b| pushed_twice(b, END)[output], &PUSHED_TWICE);
        (value, slopes, hessian(|b| pushed_twice(b, END)[output], &PUSHED_TWICE).2.iter().copied().collect())
    };
    // The places of its events give second derivatives the order 0.80 between these two steps, with all schemes.
    let least = [ORDERS[0], ORDERS[1], 0.75];
    check_orders((&PushedTwice, END), &PUSHED_TWICE, &[(0, exact(0)), (1, exact(1))], least);
}

#[test]
fn derivatives_through_a_joint_that_lets_go_converge_with_the_step() {
    let exact = |output: usize| {
        let (value, slopes) = gradient(|b| sling(b)[output], &SLING);
        (value, slopes, hessian(|b| sling(b)[output], &SLING).2.iter().copied().collect())
    };
    check((&Sling, 3.0), &SLING, &[(0, exact(0)), (2, exact(1))]);
}

/// The velocities of implicit steps violate the joints by the square of the step, which at an event depends on the design.
#[test]
fn derivatives_of_velocities_and_reactions_at_an_event_converge_with_the_square_of_the_step() {
    for by_velocity in [false, true] {
        let (model, end) = (FallingBars { by_velocity }, [0.6]);
        let exact = differentiate_explicitly(&model, &FALLING, &Explicit::eighth_order(1e-13), &end).unwrap();
        let errors = |h: f64| -> Vec<[f64; 2]> {
            let newton = Newton { tolerance: 1e-13, iterations: 30 };
            let found = differentiate(&model, &FALLING, &Dynamics { newton, ..Dynamics::fixed(h) }, &end).unwrap();
            let error = |output: usize| {
                let slopes = found.gradients[output][0].iter().zip(&exact.gradients[output][0]);
                let size = exact.gradients[output][0].iter().fold(0.0, |size: f64, x| size.max(x.abs()));
                let slope = slopes.fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs() / size));
                [(found.values[output][0] - exact.values[output][0]).abs(), slope]
            };
            (0..found.names.len()).map(error).collect()
        };
        let (coarse, fine) = (errors(1.6e-3), errors(1e-4));
        for ((name, coarse), fine) in exact.names.iter().zip(&coarse).zip(&fine) {
            if by_velocity && name == "vy" {
                continue; // the limit of the event
            }
            let orders = [0, 1].map(|k| (coarse[k] / fine[k]).log2() / 4.0);
            println!("by velocity {by_velocity}, {name}: errors {coarse:?} and {fine:?}, orders {orders:.2?}");
            assert!(coarse[1] < 1e-3 && orders[0] > 1.8 && orders[1] > 1.6, "{name}: {coarse:?} {fine:?} {orders:?}");
        }
    }
}
