//! Points of the unit cube: random numbers, Latin hypercubes and Sobol sequences.
//!
//! A point depends on the seed and on its number only, so that points can be computed in any order and by any thread.

use crate::{Error, Result};
use std::sync::LazyLock;

/// A way to fill the unit cube with points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SequenceKind {
    /// Independent uniform numbers.
    Random,
    /// One point in each of N equal intervals of every coordinate, at a random place in it.
    LatinHypercube,
    /// A Sobol sequence, shifted by the seed.
    Sobol,
}

/// N points of the unit cube of dimension d.
///
/// ```
/// use linkwright::study::{PointSequence, SequenceKind};
///
/// let points = PointSequence::new(SequenceKind::Sobol, 2, 4, 0)?;
/// assert_eq!(points.point(1), [0.5, 0.5]);
/// assert_eq!(points.point(2), [0.25, 0.75]);
/// # Ok::<(), linkwright::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct PointSequence {
    kind: SequenceKind,
    dimension: usize,
    count: usize,
    seed: u64,
    /// Direction numbers of each coordinate, of a Sobol sequence.
    directions: Vec<[u64; BITS]>,
    /// The interval of each point, for each coordinate of a Latin hypercube.
    intervals: Vec<Vec<u32>>,
}

/// Bits of the coordinates of a Sobol point: as many as a double has. At most 2⁵² points differ.
const BITS: usize = 52;
/// Largest dimension of a Sobol sequence.
pub const SOBOL_DIMENSIONS: usize = 128;

impl PointSequence {
    /// `count` points in `dimension` dimensions. A Sobol sequence with seed 0 is not shifted: its first point is the origin.
    ///
    /// # Errors
    /// [`Error::Option`] for a Sobol sequence of more than 128 dimensions, or for more points than 2³².
    pub fn new(kind: SequenceKind, dimension: usize, count: usize, seed: u64) -> Result<Self> {
        Error::check_option("number of points", "at most 2^32", count as f64, count as u64 <= 1 << 32)?;
        let is_sobol = kind == SequenceKind::Sobol;
        let fits = !is_sobol || dimension <= SOBOL_DIMENSIONS;
        Error::check_option("dimension of a Sobol sequence", "at most 128", dimension as f64, fits)?;
        let directions = if is_sobol { DIRECTIONS[..dimension].to_vec() } else { vec![] };
        let intervals = match kind {
            SequenceKind::LatinHypercube => (0..dimension).map(|k| permutation(count, seed, k as u64)).collect(),
            _ => vec![],
        };
        Ok(Self { kind, dimension, count, seed, directions, intervals })
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Point `number`, with coordinates in [0, 1).
    pub fn point(&self, number: usize) -> Vec<f64> {
        let random = |k: usize| uniform(self.seed, number as u64, k as u64);
        let coordinate = |k: usize| match self.kind {
            SequenceKind::Random => random(k),
            SequenceKind::LatinHypercube => {
                let interval = self.intervals[k].get(number).copied().unwrap_or(0);
                ((f64::from(interval) + random(k)) / self.count as f64).min(BELOW_ONE)
            }
            SequenceKind::Sobol => {
                let bits = (0..BITS).filter(|bit| number as u64 >> bit & 1 == 1);
                let shift = if self.seed == 0 { 0 } else { hash(self.seed, u64::MAX, k as u64) >> (64 - BITS) };
                let sum = bits.fold(shift, |sum, bit| sum ^ self.directions[k][bit]);
                sum as f64 / (1u64 << BITS) as f64
            }
        };
        (0..self.dimension).map(coordinate).collect()
    }
}

/// The largest double below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// A hash of three numbers, by the finalizer of SplitMix64.
///
/// # Sources
/// G. L. Steele, D. Lea and C. H. Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014.
fn hash(seed: u64, number: u64, coordinate: u64) -> u64 {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let mix = |z: u64| {
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    [seed, number, coordinate]
        .iter()
        .fold(GOLDEN, |state, part| mix(state.wrapping_add(GOLDEN) ^ mix(part.wrapping_add(GOLDEN))))
}

/// A uniform number in [0, 1).
pub(super) fn uniform(seed: u64, number: u64, coordinate: u64) -> f64 {
    (hash(seed, number, coordinate) >> 11) as f64 / (1u64 << 53) as f64
}

/// A permutation of 0 … count − 1 by exchanges from the end (Fisher and Yates).
fn permutation(count: usize, seed: u64, coordinate: u64) -> Vec<u32> {
    let mut all: Vec<u32> = (0..count as u32).collect();
    for last in (1..count).rev() {
        let other = (uniform(!seed, last as u64, coordinate) * (last + 1) as f64) as usize;
        all.swap(last, other.min(last));
    }
    all
}

/// Direction numbers v_i = m_i / 2^i of all dimensions, times 2^52.
///
/// # Sources
/// S. Joe and F. Y. Kuo, *SIAM J. Sci. Comput.* 30 (2008) 2635–2654; P. Bratley and B. L. Fox, *ACM Trans. Math. Softw.* 14 (1988)
/// 88–100, for the recurrence.
static DIRECTIONS: LazyLock<Vec<[u64; BITS]>> = LazyLock::new(|| {
    let first = std::array::from_fn(|i| 1u64 << (BITS - 1 - i));
    let rows = include_str!("joe-kuo-d6.txt").lines().filter(|line| !line.starts_with('#'));
    let row = |line: &str| {
        let numbers: Vec<u64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let (s, a, m) = (numbers[1] as usize, numbers[2], &numbers[3..]);
        let mut v = [0u64; BITS];
        for i in 0..BITS {
            v[i] = match i.checked_sub(s) {
                None => m[i] << (BITS - 1 - i),
                Some(earlier) => {
                    let terms = (1..s).filter(|k| a >> (s - 1 - k) & 1 == 1).map(|k| v[i - k]);
                    terms.fold(v[earlier] ^ (v[earlier] >> s), |sum, term| sum ^ term)
                }
            };
        }
        v
    };
    std::iter::once(first).chain(rows.map(row)).collect()
});

#[cfg(test)]
mod tests {
    use super::*;

    fn points(kind: SequenceKind, dimension: usize, count: usize, seed: u64) -> Vec<Vec<f64>> {
        let points = PointSequence::new(kind, dimension, count, seed).unwrap();
        (0..count).map(|k| points.point(k)).collect()
    }

    /// The first points of Joe and Kuo's own program for five dimensions, in the order without Gray code.
    #[test]
    fn sobol_points_are_those_of_joe_and_kuo() {
        let found = points(SequenceKind::Sobol, 5, 4, 0);
        assert_eq!(found[1], [0.5; 5]);
        assert_eq!(found[2], [0.25, 0.75, 0.75, 0.75, 0.25]);
        assert_eq!(found[3], [0.75, 0.25, 0.25, 0.25, 0.75]);
        assert_eq!(DIRECTIONS.len(), SOBOL_DIMENSIONS);
    }

    /// Property A′ of a digital net: 2^m points have one point in each interval of length 2^-m of every coordinate.
    #[test]
    fn sobol_and_latin_points_stratify_every_coordinate() {
        for (kind, seed) in [(SequenceKind::Sobol, 0), (SequenceKind::Sobol, 7), (SequenceKind::LatinHypercube, 3)] {
            let found = points(kind, SOBOL_DIMENSIONS, 256, seed);
            for k in 0..SOBOL_DIMENSIONS {
                let mut seen = [false; 256];
                found.iter().for_each(|point| seen[(point[k] * 256.0) as usize] = true);
                assert!(seen.iter().all(|seen| *seen), "{kind:?}, coordinate {k}");
            }
        }
    }

    #[test]
    fn random_points_have_the_moments_of_uniform_numbers() {
        let found = points(SequenceKind::Random, 3, 20_000, 5);
        for k in 0..3 {
            let mean = found.iter().map(|p| p[k]).sum::<f64>() / 20_000.0;
            let square = found.iter().map(|p| p[k] * p[k]).sum::<f64>() / 20_000.0;
            // Four standard errors of the mean.
            assert!((mean - 0.5).abs() < 4.0 * (1.0f64 / 12.0 / 20_000.0).sqrt() && (square - 1.0 / 3.0).abs() < 0.01);
        }
        let product = found.iter().map(|p| p[0] * p[1]).sum::<f64>() / 20_000.0;
        assert!((product - 0.25).abs() < 0.01, "{product}");
        assert_ne!(found, points(SequenceKind::Random, 3, 20_000, 6));
    }

    #[test]
    fn too_many_dimensions_are_an_error() {
        assert!(PointSequence::new(SequenceKind::Sobol, 129, 4, 0).is_err());
        assert!(PointSequence::new(SequenceKind::Random, 129, 4, 0).is_ok());
    }
}
