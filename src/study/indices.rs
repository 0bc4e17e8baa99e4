//! Sensitivity indices: the share of each variable in the scatter of the results.

use super::distribution::Distribution;
use super::error::StudyError;
use super::figures::{bars, stacked};
use super::file::{RUNS, StudyFile};
use super::model::{Evaluator, ModelSource, StudyQuantity};
use super::plan::{Conclusions, Phase, RunResult, StudyPlan, in_words};
use super::rows::Rows;
use super::sample::{analysed, columns, mean_and_deviation};
use super::sequence::{PointSequence, SequenceKind, uniform};
use crate::report::figure::literal;
use crate::report::table::{Cell, Table};
use crate::{Error, Result};

/// Resamples of a bootstrap.
const RESAMPLES: usize = 200;
/// Levels of each variable in a Morris design.
const LEVELS: usize = 4;
/// Probability below the first and above the last level of a variable without bounds.
const TAIL: f64 = 0.005;

/// A study of sensitivity indices.
pub struct Indices {
    design: Design,
    distributions: Vec<Distribution>,
    evaluator: Evaluator,
    wanted: Vec<StudyQuantity>,
    phases: Vec<Phase>,
}

enum Design {
    /// Blocks of d + 2 points: A, B, and A with each column of B.
    Sobol(PointSequence),
    /// Trajectories of d + 1 points that differ in one variable each.
    Morris { seed: u64 },
}

impl Indices {
    /// The study of a file.
    ///
    /// # Errors
    /// If the file does not fit the model.
    pub fn new(file: &StudyFile, source: &ModelSource) -> std::result::Result<Self, StudyError> {
        let evaluator = file.evaluator(source)?;
        let wanted = file.wanted(&evaluator)?;
        let distributions = file.distributions(&evaluator)?;
        let d = distributions.len();
        let (design, block) = if file.is_morris {
            (Design::Morris { seed: file.seed }, d + 1)
        } else {
            (Design::Sobol(PointSequence::new(SequenceKind::Sobol, 2 * d, file.count, file.seed)?), d + 2)
        };
        let runs = file.count.saturating_mul(block);
        Error::check_option("number of runs", "at most 10 million", runs as f64, runs <= RUNS)?;
        let phases = vec![Phase::independent("runs", columns(&evaluator, &wanted), runs)];
        Ok(Self { design, distributions, evaluator, wanted, phases })
    }

    /// Runs of a block.
    fn block(&self) -> usize {
        self.distributions.len() + if matches!(self.design, Design::Sobol(_)) { 2 } else { 1 }
    }

    /// The point of a run.
    fn point(&self, run: usize) -> Vec<f64> {
        let d = self.distributions.len();
        let (block, place) = (run / self.block(), run % self.block());
        match &self.design {
            Design::Sobol(points) => {
                let both = points.point(block);
                let of_b = |k: usize| place == 1 || place == k + 2;
                let coordinate = |k: usize| both[if of_b(k) { d + k } else { k }];
                (0..d).map(|k| self.distributions[k].of_coordinate(coordinate(k), points.count())).collect()
            }
            Design::Morris { seed } => {
                let walk = MorrisWalk::new(*seed, block, d);
                (0..d).map(|k| at_level(&self.distributions[k], walk.level(k, place))).collect()
            }
        }
    }

    /// Values of a quantity, a list for each block without a failed run.
    fn blocks(&self, rows: &Rows, column: usize) -> Vec<(usize, Vec<f64>)> {
        let block = self.block();
        let of = |number: usize| {
            let value = |place: usize| {
                let row = rows.get(0, number * block + place).filter(|row| !row.has_failed())?;
                Some(row.value(column)).filter(|v| v.is_finite())
            };
            Some((number, (0..block).map(value).collect::<Option<Vec<f64>>>()?))
        };
        (0..self.phases[0].runs / block).filter_map(of).collect()
    }
}

/// The value of a variable at a level from 0 to 1.
fn at_level(distribution: &Distribution, level: f64) -> f64 {
    match distribution {
        Distribution::Normal { .. } => distribution.quantile(TAIL + (1.0 - 2.0 * TAIL) * level),
        Distribution::Uniform { .. } => distribution.quantile(level),
    }
}

/// A trajectory of a Morris design: each variable changes once, by Δ = p/(2(p − 1)) with p levels, in a random order.
///
/// # Sources
/// M. D. Morris, *Technometrics* 33 (1991) 161–174.
struct MorrisWalk {
    first: Vec<f64>,
    moves: Vec<f64>,
    /// The step at which a variable moves.
    step: Vec<usize>,
}

impl MorrisWalk {
    fn new(seed: u64, number: usize, d: usize) -> Self {
        let random = |k: usize, use_: usize| uniform(seed, number as u64, (use_ * d + k) as u64);
        let delta = LEVELS as f64 / (2.0 * (LEVELS - 1) as f64);
        let level = |k: usize| (random(k, 0) * LEVELS as f64).floor() / (LEVELS - 1) as f64;
        let first: Vec<f64> = (0..d).map(level).collect();
        let moves = first.iter().map(|level| if level + delta <= 1.0 + 1e-9 { delta } else { -delta }).collect();
        let mut order: Vec<usize> = (0..d).collect();
        order.sort_by(|a, b| random(*a, 1).total_cmp(&random(*b, 1)));
        let mut step = vec![0; d];
        order.iter().enumerate().for_each(|(place, k)| step[*k] = place);
        Self { first, moves, step }
    }

    /// The level of variable `k` at point `place` of the trajectory.
    fn level(&self, k: usize, place: usize) -> f64 {
        let moved = place > self.step[k];
        (self.first[k] + if moved { self.moves[k] } else { 0.0 }).clamp(0.0, 1.0)
    }
}

/// First-order and total indices of each variable.
///
/// $$ S_k = \frac{1}{NV} \sum_i f(B_i) \left( f(A^{(k)}_i) - f(A_i) \right), \qquad
///    T_k = \frac{1}{2NV} \sum_i \left( f(A_i) - f(A^{(k)}_i) \right)^2 $$
///
/// Each block contains f(A), f(B) and f(A⁽ᵏ⁾), where A⁽ᵏ⁾ is A with coordinate k of B; V is the variance over A and B.
///
/// # Sources
/// A. Saltelli et al., *Comput. Phys. Commun.* 181 (2010) 259–270, Table 2 (b) and (f); the latter is from M. J. W. Jansen,
/// *Comput. Phys. Commun.* 117 (1999) 35–43.
pub fn sobol_indices(blocks: &[&[f64]]) -> Option<Vec<[f64; 2]>> {
    let d = blocks.first()?.len().checked_sub(2)?;
    let both: Vec<f64> = blocks.iter().flat_map(|block| [block[0], block[1]]).collect();
    let [mean, deviation] = mean_and_deviation(&both);
    let (n, variance) = (blocks.len() as f64, deviation * deviation);
    let indices = |k: usize| {
        let first: f64 = blocks.iter().map(|f| (f[1] - mean) * (f[k + 2] - f[0])).sum();
        let total: f64 = blocks.iter().map(|f| (f[0] - f[k + 2]) * (f[0] - f[k + 2])).sum();
        [first / (n * variance), total / (2.0 * n * variance)]
    };
    (variance > 0.0).then(|| (0..d).map(indices).collect())
}

/// Half widths of the 95 % intervals of [`sobol_indices`], from resampled blocks.
fn widths(blocks: &[&[f64]]) -> Vec<[f64; 2]> {
    let n = blocks.len();
    let resample = |r: usize| {
        let picked: Vec<&[f64]> =
            (0..n).map(|i| blocks[((uniform(r as u64, i as u64, 0) * n as f64) as usize).min(n - 1)]).collect();
        sobol_indices(&picked)
    };
    let all: Vec<Vec<[f64; 2]>> = (0..RESAMPLES).filter_map(resample).collect();
    let d = blocks.first().map_or(0, |block| block.len() - 2);
    let width =
        |k: usize, which: usize| 1.96 * mean_and_deviation(&all.iter().map(|r| r[k][which]).collect::<Vec<_>>())[1];
    (0..d).map(|k| [width(k, 0), width(k, 1)]).collect()
}

impl StudyPlan for Indices {
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn run(&self, _: usize, run: usize, _: &Rows) -> Result<RunResult> {
        analysed(&self.evaluator, self.point(run), &self.wanted)
    }

    fn conclude(&self, rows: &Rows) -> Result<Conclusions> {
        match &self.design {
            Design::Sobol(_) => self.sobol(rows),
            Design::Morris { seed } => self.morris(rows, *seed),
        }
    }
}

impl Indices {
    fn names(&self) -> Vec<String> {
        self.evaluator.varied().iter().map(|number| number.name.clone()).collect()
    }

    fn sobol(&self, rows: &Rows) -> Result<Conclusions> {
        let (names, d) = (self.names(), self.distributions.len());
        let columns = ["quantity", "variable", "first", "first_width", "total", "total_width"];
        let mut table = Table::new("Sobol indices", columns).headed(columns.map(in_words))?;
        let (mut panels, mut sentences) = (vec![], vec![]);
        for (q, quantity) in self.wanted.iter().enumerate() {
            let blocks = self.blocks(rows, d + q);
            let blocks: Vec<&[f64]> = blocks.iter().map(|(_, block)| block.as_slice()).collect();
            let Some(indices) = sobol_indices(&blocks) else {
                sentences.push(format!("{} does not vary.", quantity.name));
                continue;
            };
            let widths = widths(&blocks);
            for k in 0..d {
                let ([first, total], [first_width, total_width]) = (indices[k], widths[k]);
                let numbers = [first, first_width, total, total_width].map(Cell::Number);
                table.push([quantity.name.as_str().into(), names[k].as_str().into()].into_iter().chain(numbers))?;
            }
            let largest = (0..d).max_by(|a, b| indices[*a][1].total_cmp(&indices[*b][1])).unwrap_or(0);
            sentences.push(format!(
                "{} depends most on {}: with its interactions it accounts for {:.0} % of the variance.",
                quantity.name,
                names[largest],
                // An estimate from few points may exceed one.
                100.0 * indices[largest][1].min(1.0)
            ));
            let of = |which: usize| indices.iter().map(|index| index[which]).collect();
            panels.push(bars(&literal(&quantity.name), &names, &[("first order *S*", of(0)), ("total *T*", of(1))]));
        }
        let figures = stacked("Sobol indices", panels, d);
        Ok(Conclusions {
            sentences,
            tables: vec![("indices".to_owned(), table)],
            figures: figures
                .map(|f| ("indices".to_owned(), "Sobol indices: first order and total.".to_owned(), f))
                .into_iter()
                .collect(),
        })
    }

    fn morris(&self, rows: &Rows, seed: u64) -> Result<Conclusions> {
        let (names, d) = (self.names(), self.distributions.len());
        let columns = ["quantity", "variable", "mean_absolute", "mean", "deviation"];
        let title = "Elementary effects over the range of each variable";
        let mut table = Table::new(title, columns).headed(columns.map(in_words))?;
        let (mut panels, mut sentences) = (vec![], vec![]);
        for (q, quantity) in self.wanted.iter().enumerate() {
            let blocks = self.blocks(rows, d + q);
            let mut effects = vec![vec![]; d];
            for (number, values) in &blocks {
                let walk = MorrisWalk::new(seed, *number, d);
                for k in 0..d {
                    let step = walk.step[k];
                    effects[k].push((values[step + 1] - values[step]) / walk.moves[k]);
                }
            }
            let absolute = |effects: &Vec<f64>| effects.iter().map(|e| e.abs()).sum::<f64>() / effects.len() as f64;
            let sizes: Vec<f64> = effects.iter().map(absolute).collect();
            for k in 0..d {
                let [mean, deviation] = mean_and_deviation(&effects[k]);
                let numbers =
                    [sizes[k], mean, deviation].map(|v| if v.is_finite() { Cell::Number(v) } else { Cell::Empty });
                table.push([quantity.name.as_str().into(), names[k].as_str().into()].into_iter().chain(numbers))?;
            }
            let largest = (0..d).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b])).unwrap_or(0);
            sentences.push(format!("{} changes most with {}.", quantity.name, names[largest]));
            let deviations = effects.iter().map(|effects| mean_and_deviation(effects)[1]).collect();
            panels.push(bars(
                &literal(&quantity.name),
                &names,
                &[("mean |effect| *μ*^*", sizes), ("deviation *σ*", deviations)],
            ));
        }
        let figures = stacked("Elementary effects", panels, d);
        Ok(Conclusions {
            sentences,
            tables: vec![("indices".to_owned(), table)],
            figures: figures
                .map(|f| ("indices".to_owned(), "Elementary effects of Morris.".to_owned(), f))
                .into_iter()
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_moves_each_variable_once_and_stays_inside() {
        for number in 0..50 {
            let walk = MorrisWalk::new(3, number, 5);
            for place in 0..5 {
                let moved = (0..5).filter(|&k| walk.level(k, place) != walk.level(k, place + 1)).count();
                assert_eq!(moved, 1);
            }
            assert!((0..5).all(|k| (0.0..=1.0).contains(&walk.level(k, 5)) && (walk.moves[k].abs() - 2.0 / 3.0).abs() < 1e-15));
        }
    }

    /// f = x + 2y + 3xy over independent A and B with all four combinations of ±1: V = 1 + 4 + 9, first 1 and 4, interaction 9.
    #[test]
    fn indices_of_a_full_factorial_are_exact() {
        let f = |x: f64, y: f64| x + 2.0 * y + 3.0 * x * y;
        let signs = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        let block = |a: [f64; 2], b: [f64; 2]| vec![f(a[0], a[1]), f(b[0], b[1]), f(b[0], a[1]), f(a[0], b[1])];
        let blocks: Vec<Vec<f64>> = signs.iter().flat_map(|a| signs.iter().map(move |b| block(*a, *b))).collect();
        let views: Vec<&[f64]> = blocks.iter().map(Vec::as_slice).collect();
        let found = sobol_indices(&views).unwrap();
        // The variance of a sample of 32 values is 32/31 of the exact one.
        let exact = [[1.0, 10.0], [4.0, 13.0]].map(|pair: [f64; 2]| pair.map(|v| v / 14.0 * 31.0 / 32.0));
        for (found, exact) in found.iter().flatten().zip(exact.iter().flatten()) {
            assert!((found - exact).abs() < 1e-14, "{found} {exact}");
        }
    }
}
