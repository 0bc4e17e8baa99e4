//! Random mechanisms: every scheme, every method of differentiation, first and second order, against differences; energy,
//! momentum, and the same motion by different schemes.
//!
//! `cargo test -p linkwright-mechanics --test random_mechanisms` checks a few hundred. More of them:
//!
//! ```text
//! MECHANISMS=10000 SEED=0 cargo test --release -p linkwright-mechanics --test random_mechanisms -- --ignored --nocapture
//! ```

mod differences;
mod generator;
mod properties;
mod random;
mod spatial;

use generator::RandomMechanism;
use properties::{Findings, check};
use random::{CLASSES, RandomModel};
use rayon::prelude::*;
use spatial::RandomMechanism3;

/// Checks mechanisms number `from` to `to`, in parallel, and prints what was found.
fn check_all<M: RandomModel>(from: u64, to: u64) -> Findings {
    let one = |k: u64| {
        let class = CLASSES[(k % CLASSES.len() as u64) as usize];
        let mut findings = Findings::default();
        match M::random(class, k) {
            Some(mechanism) => {
                check(&mechanism, k, &mut findings);
            }
            None => findings.not_made += 1,
        }
        findings
    };
    let all = (from..to).into_par_iter().map(one).reduce(Findings::default, Findings::and);
    println!("{all}");
    all
}

#[test]
fn a_few_hundred_random_mechanisms() {
    let all = check_all::<RandomMechanism>(0, 200);
    assert!(all.wrong.is_empty(), "{}", all.wrong.join("\n"));
    assert!(all.informative() > 0.9 && all.made() > 0.7, "{all}");
}

/// The number and the first seed come from the environment: `MECHANISMS` and `SEED`.
#[test]
#[ignore = "takes long; the number of mechanisms is given by MECHANISMS"]
fn many_random_mechanisms() {
    check_many::<RandomMechanism>();
}

fn check_many<M: RandomModel>() {
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let seed = number("SEED", 0);
    let all = check_all::<M>(seed, seed + number("MECHANISMS", 10_000));
    assert!(all.wrong.is_empty(), "{} findings:\n{}", all.wrong.len(), all.wrong.join("\n"));
}

#[test]
fn random_spatial_mechanisms() {
    let all = check_all::<RandomMechanism3>(0, 150);
    assert!(all.wrong.is_empty(), "{}", all.wrong.join("\n"));
    assert!(all.informative() > 0.9 && all.made() > 0.7, "{all}");
}

/// See [`many_random_mechanisms`].
#[test]
#[ignore = "takes long; the number of mechanisms is given by MECHANISMS"]
fn many_random_spatial_mechanisms() {
    check_many::<RandomMechanism3>();
}

/// Mechanisms in which derivatives were wrong, by number:
///
/// * 1 (a tree without prescribed motions): sweeps over a tree kept derivatives of angular accelerations from the last outputs;
/// * 5004 (a beam): the semi-analytical recursion grew to 1e161, because each difference was taken along a direction
///   that stretches the beam;
/// * 5047 (a rod near its dead centre): semi-analytical derivatives of the assembly violated the constraints by the square
///   of the difference's step, and accelerations by that divided by h²;
/// * 2812 (a beam) and 6683 (a contact) are right up to rounding, and to the difference of the residual at the start of a contact;
/// * 5068, 5090: the differences were noise and claimed an error a thousand times too small;
/// * 591: differences on one side of a jump claimed an error that was 25 times too small;
/// * 645 (redundant cranks): relative coordinates kept the equations that were independent at the start, past a position where they are not;
/// * 12762, 13882 and 14337: semi-analytical derivatives of accelerations lose digits to rounding, or to curvature, by their step;
/// * 1006 (friction in driven joints): implicit steps ended when positions had converged, before the reactions had;
/// * 147 (a contact) and 20 (a beam), with events: fixed steps after an event had lengths that depend on the time of the event;
/// * 979 and 1555 (contacts with events) are right: differences across jumps of the size of the discretization error were not;
/// * 2128 (a short step after an event): semi-analytical derivatives lost all digits to its rounding errors;
/// * 3220 (a beam): adjoint derivatives of a step of 1e-8 nominal steps that ends at an event were those of its formulas, although its end is
///   extrapolated. Its energy has a kink there, and is right on one side;
/// * 5715 and 6672 (events at given times): semi-analytical derivatives between the last time of the grid and an event lacked those of the
///   accelerations at the event;
/// * 42003 (an event at an inspected time, up to rounding): an implicit step ended before it, and one of 2e-14 s at it;
/// * 20841 (explicit steps beyond their limit of stability) is right as far as its motion stays bounded.
#[test]
fn mechanisms_that_had_wrong_derivatives() {
    let large = [1, 20, 147, 591, 645, 979, 1006, 1555, 2128, 2812, 3220, 5004, 5047, 5068, 5090, 5715, 6672, 6683];
    let small = [12762, 13882, 14337, 20841, 42003];
    for (seed, least) in large.map(|seed| (seed, 200)).into_iter().chain(small.map(|seed| (seed, 100))) {
        let found = check_all::<RandomMechanism>(seed, seed + 1);
        assert!(found.wrong.is_empty(), "{}", found.wrong.join("\n"));
        assert!(found.compared > least, "{found}");
    }
}

/// Every class makes mechanisms, and another seed makes another one.
#[test]
fn every_class_can_be_generated() {
    makes_all_classes::<RandomMechanism>();
    makes_all_classes::<RandomMechanism3>();
}

fn makes_all_classes<M: RandomModel>() {
    for class in CLASSES {
        let made: Vec<_> = (0..40).filter_map(|seed| M::random(class, seed)).collect();
        assert!(made.len() > 20, "{class:?}: {}", made.len());
        let designs: Vec<_> = made.iter().map(M::design).collect();
        assert!(designs.windows(2).all(|pair| pair[0] != pair[1]), "{class:?}: seeds make different mechanisms");
    }
}
