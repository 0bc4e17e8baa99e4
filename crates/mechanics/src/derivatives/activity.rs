//! What of a mechanism depends on the design.

use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Dual8;

/// Which parameters of elements and motions depend on the design at all.
pub(crate) struct Dependence {
    /// Of each element, the local numbers.
    pub parameters: Vec<Vec<usize>>,
    /// Whether a coordinate is prescribed by a motion that depends on the design.
    pub motions: Vec<bool>,
}

impl Dependence {
    /// Of mechanisms whose design variables are seeded, a chunk each.
    pub fn of(chunks: &[Mechanism<Dual8>], mechanism: &Mechanism<f64>) -> Self {
        let depends = |x: &Dual8| x.eps.iter().any(|slope| *slope != 0.0);
        let parameter = |part: usize, k: usize| chunks.iter().any(|c| depends(&c.parts[part].parameters[k]));
        let parameters =
            |part: usize| (0..mechanism.parts[part].parameters.len()).filter(|&k| parameter(part, k)).collect();
        let moves = |c: &Mechanism<Dual8>, i: usize| {
            c.coordinates[i].motion.as_ref().is_some_and(|(_, parameters)| parameters.iter().any(depends))
        };
        Self {
            parameters: (0..mechanism.parts.len()).map(parameters).collect(),
            motions: (0..mechanism.coordinates.len()).map(|i| chunks.iter().any(|c| moves(c, i))).collect(),
        }
    }

    /// The coordinates whose motion depends on the design.
    pub fn moving(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.motions.len()).filter(|&i| self.motions[i])
    }
}
