//! Spatial mechanisms compared with closed forms, conservation laws, planar mechanisms and finite differences.

mod beam_references;
mod beams;
mod contacts;
mod derivatives;
mod elements;
#[path = "../support/finite_differences.rs"]
mod finite_differences;
mod joints;
mod linkages;
mod platforms;
mod rejected;
mod tops;

use autodiff::Scalar;
use linkwright_mechanics::integrators::explicit::{Coordinates, Explicit};
use linkwright_mechanics::{ElementIndex, Mechanism, Result};

/// Adds outputs for measures of an element, named by their numbers and the measures.
fn watch<S: Scalar>(m: &mut Mechanism<S>, element: ElementIndex, measures: &[&str]) -> Result<()> {
    for name in measures {
        let term = m.measure(element, name)?;
        m.output(format!("{} {name}", m.output_names().len()), &[term]);
    }
    Ok(())
}

/// Explicit steps of order 8 with small errors.
fn accurate() -> Explicit {
    Explicit::eighth_order(1e-11)
}

/// [`accurate`] steps in absolute and in relative coordinates, with the names of these.
fn in_both_coordinates() -> [(&'static str, Explicit); 2] {
    [Coordinates::Absolute, Coordinates::Relative].map(|choice| (choice.name(), accurate().with_coordinates(choice)))
}

/// `count` times from `end`/`count` to `end`.
fn times(end: f64, count: usize) -> Vec<f64> {
    (1..=count).map(|k| end * k as f64 / count as f64).collect()
}

/// Asserts that every value of a series is near the expected one, and prints the largest error.
#[track_caller]
fn follows(label: &str, times: &[f64], series: &[f64], expected: impl Fn(f64) -> f64, tolerance: f64) {
    let errors = times.iter().zip(series).map(|(&t, value)| (value - expected(t)).abs());
    let worst = errors.fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a });
    println!("{label}: {worst:.1e}");
    assert!(worst <= tolerance, "{label}: {worst:.2e} above {tolerance:.0e}");
}
