//! Svanberg's eight-bar truss: eight bars in space from eight supports to one loaded node.
//!
//! Minimize W = Σ Aᵢ Lᵢ / 128 211 mm³ over the areas Aᵢ ≥ 100 mm², from 400 mm², with stresses within ± 100 N/mm² under
//! the force (40, 20, 200) kN. The optimum is not unique: the first four bars can share their load in many ways.
//!
//! # Sources
//! Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, section 6; its eight-bar truss.

use super::{Optimum, truss::Truss};
use crate::problem::{DesignVariable, Problem, ProblemBuilder};
use error::Result;

/// Nodes in mm: four supports of a square, the loaded node, four supports on the axes.
const NODES: [[f64; 3]; 9] = [
    [-250.0, -250.0, 0.0],
    [-250.0, 250.0, 0.0],
    [250.0, 250.0, 0.0],
    [250.0, -250.0, 0.0],
    [0.0, 0.0, 375.0],
    [-375.0, 0.0, 0.0],
    [0.0, 375.0, 0.0],
    [375.0, 0.0, 0.0],
    [0.0, -375.0, 0.0],
];
const LOADED: usize = 4;
const FORCE: [f64; 3] = [40e3, 20e3, 200e3];
/// Allowed stress in N/mm².
const ALLOWED: f64 = 100.0;
/// Largest area in mm²; the source has no such bound, and it is never active.
const LARGEST: f64 = 1e4;

/// The problem. The weight is explicit, the stresses are the responses of an analysis.
pub fn problem() -> Result<Problem> {
    let supports: Vec<usize> = (0..NODES.len()).filter(|&n| n != LOADED).collect();
    let bars: Vec<[usize; 2]> = supports.iter().map(|&n| [n, LOADED]).collect();
    let truss = Truss::new(&NODES, &bars, &[(LOADED, FORCE)], &supports)?;
    let mut parts = ProblemBuilder::new("eight-bar truss");
    for bar in 1..=bars.len() {
        parts.variable(DesignVariable::new(format!("area {bar}"), "mm²", 400.0).within(100.0, LARGEST));
    }
    let weights = truss.lengths().iter().map(|l| l / 128_211.0).collect();
    truss.least_weight(parts, ("", weights), ("N/mm²", vec![ALLOWED; bars.len()]))
}

/// The optimum, whose design is not unique; published as 11.23 at (880, 720, 260, 520, 100, 100, 100, 100) mm².
pub const fn optimum() -> Optimum {
    Optimum::published(11.228_2, &[], "Svanberg 1987, here to six digits").within(1e-5).of_any_design()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_and_the_published_design_weigh_what_is_printed() {
        let problem = problem().unwrap();
        let at = |b: &[f64]| problem.evaluate(b, &problem.analyze(b).unwrap()).unwrap();
        let start = at(&problem.start());
        assert!((start.objective - 13.05).abs() < 5e-3, "{}", start.objective);
        let published = at(&[880.0, 720.0, 260.0, 520.0, 100.0, 100.0, 100.0, 100.0]);
        assert!((published.objective - 11.23).abs() < 1e-2, "{}", published.objective);
        assert!(published.max_violation_pct() < 1.0, "{}", published.max_violation_pct());
    }

    #[test]
    fn bar_forces_balance_the_load() {
        let problem = problem().unwrap();
        let areas = [500.0, 300.0, 700.0, 200.0, 150.0, 600.0, 110.0, 400.0];
        let stresses = problem.analyze(&areas).unwrap().values;
        for axis in 0..3 {
            let supports = (0..NODES.len()).filter(|&n| n != LOADED);
            let pull: f64 = supports
                .zip(areas)
                .zip(&stresses)
                .map(|((n, area), stress)| {
                    let along: [f64; 3] = std::array::from_fn(|a| NODES[LOADED][a] - NODES[n][a]);
                    stress[0] * area * along[axis] / along.iter().map(|d| d * d).sum::<f64>().sqrt()
                })
                .sum();
            assert!((pull - FORCE[axis]).abs() < 1e-8, "{axis}: {pull}");
        }
    }
}
