//! In which units the rows and the objective of a separable program are measured, and what they are at the start.

use crate::Separable;
use crate::separable::CHUNK;
use crate::variable_scale;
use rayon::prelude::*;

/// Changes of the functions over the scales of the variables, at the start.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Units {
    /// The largest change of each row by one variable; one for a row of zeros.
    pub rows: Vec<f64>,
    /// The largest change of the objective by one variable; one if it is constant.
    pub objective: f64,
    /// Prices at which objective and rows pull alike: most variables are then off their bounds.
    pub multipliers: Vec<f64>,
}

/// Largest change and sum of changes of each function, the objective first, and whether all numbers are finite.
struct Changes {
    largest: Vec<f64>,
    sums: Vec<f64>,
    values: Vec<f64>,
    finite: bool,
}

impl Units {
    /// The units at `start`, which is within the bounds; none if the program is not finite there.
    pub fn at(program: &dyn Separable, start: &[f64]) -> Option<Self> {
        let chunks: Vec<Changes> =
            start.par_chunks(CHUNK).enumerate().map(|(c, part)| changes(program, c * CHUNK, part)).collect();
        let functions = program.rows() + 1;
        let mut all = Changes::new(functions);
        for chunk in &chunks {
            all.largest.iter_mut().zip(&chunk.largest).for_each(|(a, b)| *a = a.max(*b));
            all.sums.iter_mut().zip(&chunk.sums).for_each(|(a, b)| *a += b);
            all.values.iter_mut().zip(&chunk.values).for_each(|(a, b)| *a += b);
            all.finite &= chunk.finite;
        }
        let values = all.values.iter().enumerate().map(|(i, v)| program.constant(i) + v);
        if !all.finite || values.into_iter().any(|v| !v.is_finite()) {
            return None;
        }
        let or_one = |v: f64| if v > 0.0 { v } else { 1.0 };
        let rows = functions - 1;
        let price = |i: usize| match program.is_equality(i) || all.sums[i + 1] == 0.0 {
            true => 0.0,
            false => all.sums[0] / all.sums[i + 1] / rows as f64,
        };
        Some(Self {
            rows: all.largest[1..].iter().map(|v| or_one(*v)).collect(),
            objective: or_one(all.largest[0]),
            multipliers: (0..rows).map(price).collect(),
        })
    }
}

impl Changes {
    fn new(functions: usize) -> Self {
        let zeros = || vec![0.0; functions];
        Self { largest: zeros(), sums: zeros(), values: zeros(), finite: true }
    }
}

fn changes(program: &dyn Separable, first: usize, start: &[f64]) -> Changes {
    let functions = program.rows() + 1;
    let mut all = Changes::new(functions);
    let (mut values, mut slopes) = (vec![0.0; functions], vec![0.0; functions]);
    let (lower, upper) = (program.lower(), program.upper());
    for (k, &x) in start.iter().enumerate() {
        let j = first + k;
        program.column(j, x, &mut values, &mut slopes);
        let scale = variable_scale(lower[j], upper[j], x, x);
        for i in 0..functions {
            let change = (scale * slopes[i]).abs();
            all.largest[i] = all.largest[i].max(change);
            all.sums[i] += change;
            all.values[i] += values[i];
        }
    }
    all.finite = all.sums.iter().chain(&all.values).all(|v| v.is_finite());
    all
}
