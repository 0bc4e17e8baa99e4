//! Relative coordinates: the motions, reactions and derivatives of absolute coordinates, chains with known energy, and errors that
//! name what is not supported.

mod chains;
mod loops;
mod rejected;
mod zoo;
mod zoo3;

use linkwright_mechanics::analyses::dynamics::{History, simulate_explicitly};
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::second_order::{HessianPart, differentiate_explicitly_twice};
use linkwright_mechanics::integrators::explicit::{Coordinates, StepControl};
use linkwright_mechanics::{Explicit, ParametricMechanism};
use zoo::{DESIGN, Zoo};
use zoo3::{DESIGN3, Zoo3};

const TIMES: [f64; 4] = [0.0, 0.117, 0.2, 0.45];

/// Short steps, whose error is that of rounding.
fn settings(coordinates: Coordinates) -> Explicit {
    Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(2e-3)).with_coordinates(coordinates)
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |largest: f64, x| largest.max(x.abs()))
}

/// Asserts that two series are equal up to `tolerance` of their size.
fn assert_close(name: &str, a: &[f64], b: &[f64], tolerance: f64) {
    let size = 1.0 + largest(b.iter().copied());
    let error = largest(a.iter().zip(b).map(|(a, b)| a - b));
    assert!(a.len() == b.len() && error <= tolerance * size, "{name}: {error:.2e} of {size:.2e}\n{a:?}\n{b:?}");
}

/// Compares motions in absolute and in relative coordinates, of which the automatic choice is `chosen`.
fn moves_alike(model: &impl ParametricMechanism, b: &[f64], chosen: Coordinates) {
    let run = |coordinates| -> History {
        simulate_explicitly(&model.build(b).unwrap(), &settings(coordinates), &TIMES).unwrap()
    };
    let [absolute, relative, automatic] =
        [Coordinates::Absolute, Coordinates::Relative, Coordinates::Automatic].map(run);
    assert_eq!(absolute.coordinates, Coordinates::Absolute);
    assert_eq!(relative.coordinates, Coordinates::Relative);
    assert_eq!(automatic.coordinates, chosen);
    for (k, name) in absolute.names.iter().enumerate() {
        assert_close(name, &relative.values[k], &absolute.values[k], 1e-10);
    }
}

/// Compares first derivatives in absolute and in relative coordinates, and those by the adjoint method with longer steps.
fn has_derivatives_alike(model: &impl ParametricMechanism, b: &[f64]) {
    let direct = |settings: &Explicit| differentiate_explicitly(model, b, settings, &TIMES).unwrap();
    let [absolute, relative] =
        [Coordinates::Absolute, Coordinates::Relative].map(|coordinates| direct(&settings(coordinates)));
    for (k, name) in relative.names.iter().enumerate() {
        for (point, t) in TIMES.iter().enumerate() {
            let [a, r] = [&absolute, &relative].map(|history| history.gradients[k][point].clone());
            assert_close(&format!("{name} at {t} s"), &r, &a, 1e-8);
        }
    }
    // Both methods differentiate the same discrete motion.
    let longer = settings(Coordinates::Relative).with_step_control(StepControl::Fixed(1e-2));
    let (relative, last) = (direct(&longer), TIMES.len() - 1);
    let all: Vec<_> = (0..relative.names.len()).map(|k| AdjointFunctional::at(k, last)).collect();
    let adjoint = differentiate_explicitly_backwards(model, b, &longer, &TIMES, &all).unwrap();
    for (k, name) in relative.names.iter().enumerate() {
        let row: Vec<f64> = adjoint.row(k).iter().copied().collect();
        assert_close(&format!("adjoint, {name}"), &row, &relative.gradients[k][last], 1e-10);
    }
}

/// Compares second derivatives in absolute and in relative coordinates.
fn has_second_derivatives_alike(model: &impl ParametricMechanism, b: &[f64]) {
    let direction: Vec<f64> = (0..b.len()).map(|i| (1.0 + 2.3 * i as f64).sin()).collect();
    let twice = |coordinates| {
        let settings = settings(coordinates).with_step_control(StepControl::Fixed(5e-3));
        differentiate_explicitly_twice(model, b, &settings, &TIMES[..3], HessianPart::Times(&direction)).unwrap()
    };
    let [absolute, relative] = [Coordinates::Absolute, Coordinates::Relative].map(twice);
    for (k, name) in relative.names.iter().enumerate() {
        for point in 0..3 {
            let label = format!("{name} at {} s", TIMES[point]);
            assert_close(&label, &relative.gradient(k, point), &absolute.gradient(k, point), 1e-7);
            let [r, a] = [&relative, &absolute].map(|history| history.second_derivatives(k, point));
            assert_close(&format!("second, {label}"), &r, &a, 1e-6);
        }
    }
}

#[test]
fn a_tree_moves_as_in_absolute_coordinates() {
    moves_alike(&Zoo, &DESIGN, Coordinates::Relative);
}

#[test]
fn trees_in_space_move_as_in_absolute_coordinates() {
    moves_alike(&Zoo3, &DESIGN3, Coordinates::Relative);
}

#[test]
fn derivatives_are_those_of_absolute_coordinates() {
    has_derivatives_alike(&Zoo, &DESIGN);
}

#[test]
fn derivatives_in_space_are_those_of_absolute_coordinates() {
    has_derivatives_alike(&Zoo3, &DESIGN3);
}

#[test]
fn second_derivatives_are_those_of_absolute_coordinates() {
    has_second_derivatives_alike(&Zoo, &DESIGN);
}

#[test]
fn second_derivatives_in_space_are_those_of_absolute_coordinates() {
    has_second_derivatives_alike(&Zoo3, &DESIGN3);
}
