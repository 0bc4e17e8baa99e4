//! Linear pin-jointed trusses: stresses of the bars as functions of their areas, and problems of least weight.
//!
//! $$ K(A)\, u = F ,\qquad K = \sum_e \frac{E A_e}{L_e}\, c_e c_e^T ,\qquad \sigma_e = \frac{E}{L_e}\, c_e \cdot u , $$
//!
//! with c_e the direction cosines of bar e at its free nodes. The equations are solved in the scalar type of the areas,
//! so first and second derivatives of the stresses are exact.

use crate::function;
use crate::problem::{ClosedForm, Constraint, Problem, ProblemBuilder, Quantity};
use autodiff::Scalar;
use error::{Error, Result};

/// A truss in `D` dimensions with Young's modulus one; stresses of a linear truss of one material do not depend on it.
#[derive(Clone, Debug)]
pub struct Truss<const D: usize> {
    /// Lengths of the bars, in the unit of the nodes.
    lengths: Vec<f64>,
    /// Free degrees of freedom of each bar with their direction cosines.
    cosines: Vec<Vec<(usize, f64)>>,
    /// Load on every free degree of freedom.
    load: Vec<f64>,
}

impl<const D: usize> Truss<D> {
    /// A truss from
    ///
    /// * `nodes` — coordinates;
    /// * `bars` — the two nodes of each bar;
    /// * `loads` — node and force vector; other free nodes are unloaded;
    /// * `supports` — fixed nodes.
    ///
    /// # Errors
    /// [`Error::Definition`] for a node that does not exist, a bar of length zero, or a truss that is a mechanism.
    pub fn new(
        nodes: &[[f64; D]],
        bars: &[[usize; 2]],
        loads: &[(usize, [f64; D])],
        supports: &[usize],
    ) -> Result<Self> {
        let named = bars.iter().flatten().chain(supports).chain(loads.iter().map(|(node, _)| node));
        if let Some(node) = named.copied().find(|&node| node >= nodes.len()) {
            let why = format!("node {node} does not exist; there are {}", nodes.len());
            return Err(Error::definition("truss", why, "count nodes from zero"));
        }
        let free: Vec<usize> = (0..nodes.len()).filter(|n| !supports.contains(n)).collect();
        let place = |node: usize, axis: usize| free.binary_search(&node).ok().map(|k| k * D + axis);
        let (mut lengths, mut cosines) = (vec![], vec![]);
        for (e, &[from, to]) in bars.iter().enumerate() {
            let along: [f64; D] = std::array::from_fn(|a| nodes[to][a] - nodes[from][a]);
            let length = along.iter().map(|d| d * d).sum::<f64>().sqrt();
            if length == 0.0 {
                return Err(Error::definition(format!("bar {e}"), "its length is zero", "give it two nodes apart"));
            }
            let ends = [(from, -1.0), (to, 1.0)];
            let entry = |(node, sign): (usize, f64)| {
                (0..D).filter_map(move |a| Some((place(node, a)?, sign * along[a] / length)))
            };
            cosines.push(ends.into_iter().flat_map(entry).collect());
            lengths.push(length);
        }
        let mut load = vec![0.0; free.len() * D];
        for (node, force) in loads {
            (0..D).filter_map(|a| Some((place(*node, a)?, force[a]))).for_each(|(k, f)| load[k] += f);
        }
        let truss = Self { lengths, cosines, load };
        if truss.displacements(&vec![1.0f64; bars.len()]).iter().all(|u| u.is_finite()) {
            return Ok(truss);
        }
        Err(Error::definition("truss", "it is a mechanism", "add bars or supports"))
    }

    /// Lengths of the bars.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// Displacements u for Young's modulus one, by elimination without pivoting: K is positive definite for positive areas.
    pub fn displacements<S: Scalar>(&self, areas: &[S]) -> Vec<S> {
        let n = self.load.len();
        let mut k = vec![S::from(0.0); n * n];
        for ((cosines, &area), &length) in self.cosines.iter().zip(areas).zip(&self.lengths) {
            for &(i, ci) in cosines {
                for &(j, cj) in cosines {
                    k[i * n + j] += area * (ci * cj / length);
                }
            }
        }
        let mut u: Vec<S> = self.load.iter().map(|&f| S::from(f)).collect();
        for pivot in 0..n {
            for row in pivot + 1..n {
                let factor = k[row * n + pivot] / k[pivot * n + pivot];
                for column in pivot..n {
                    let above = k[pivot * n + column];
                    k[row * n + column] -= factor * above;
                }
                let above = u[pivot];
                u[row] -= factor * above;
            }
        }
        for row in (0..n).rev() {
            let known = (row + 1..n).fold(u[row], |sum, column| sum - k[row * n + column] * u[column]);
            u[row] = known / k[row * n + row];
        }
        u
    }

    /// Stress of bar `e`, force over area; positive in tension.
    pub fn stress<S: Scalar>(&self, e: usize, areas: &[S]) -> S {
        let u = self.displacements(areas);
        self.cosines[e].iter().fold(S::from(0.0), |sum, &(i, c)| sum + u[i] * c) / self.lengths[e]
    }
}

impl<const D: usize> Truss<D> {
    /// The problem of least weight in the design variables of `parts`, the areas, with bounded stresses.
    ///
    /// * `weight` — unit of the weight, and weights of the bars for an area of one;
    /// * `stress` — unit of the stresses, and the allowed stresses of the bars in tension and compression.
    pub(super) fn least_weight(
        self,
        mut parts: ProblemBuilder,
        weight: (&str, Vec<f64>),
        stress: (&str, Vec<f64>),
    ) -> Result<Problem> {
        let ((weight_unit, weights), (stress_unit, allowed)) = (weight, stress);
        let weight = function!([weights: Vec<f64> = weights] |p| {
            p.design.iter().zip(&weights).fold(S::from(0.0), |sum, (&a, &w)| sum + a * w)
        });
        parts.minimize("weight", weight_unit, Quantity::plain(weight));
        for (bar, limit) in (1..).zip(allowed) {
            let stress =
                Quantity::response(None::<usize>, parts.constant(&format!("stress of bar {bar}"), stress_unit));
            parts.subject_to(Constraint::at_most(format!("tension of bar {bar}"), limit, stress.clone()));
            parts.subject_to(Constraint::at_least(format!("compression of bar {bar}"), -limit, stress));
        }
        parts.build_analytic(self)
    }
}

/// Response h is the stress of bar h; the design variables are the areas.
impl<const D: usize> ClosedForm for Truss<D> {
    fn response<S: Scalar>(&self, h: usize, areas: &[S], _: S) -> S {
        self.stress(h, areas)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::gradient;

    /// Two bars at 45°, a load of one straight down: forces 1/√2 each.
    fn hanging() -> Truss<2> {
        let nodes = [[-1.0, 1.0], [1.0, 1.0], [0.0, 0.0]];
        Truss::new(&nodes, &[[0, 2], [1, 2]], &[(2, [0.0, -1.0])], &[0, 1]).unwrap()
    }

    #[test]
    fn a_statically_determinate_truss_has_stresses_of_force_over_area() {
        let (truss, force) = (hanging(), 0.5f64.sqrt());
        let (stress, slope) = gradient(|a| truss.stress(0, a), &[2.0, 3.0]);
        assert!((stress - force / 2.0).abs() < 1e-15);
        assert!((slope[0] + force / 4.0).abs() < 1e-15 && slope[1].abs() < 1e-15);
    }

    #[test]
    fn invalid_trusses_are_rejected() {
        let nodes = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]];
        let build = |bars: &[[usize; 2]]| Truss::new(&nodes, bars, &[(1, [0.0, 1.0])], &[0]);
        for (bars, word) in [(&[[0, 7]], "node 7"), (&[[1, 2]], "length is zero"), (&[[0, 1]], "mechanism")] {
            let message = build(bars).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
