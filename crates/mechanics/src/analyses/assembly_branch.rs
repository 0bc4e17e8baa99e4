//! Branches of the assembly of a driven mechanism, such as the two positions of a dyad on either side of its dead centre.

use crate::analyses::kinematics::KinematicDriver;
use crate::constraint_rank::ConstraintRank;
use crate::initial_conditions::Assembly;
use crate::mechanism::Mechanism;
use crate::system::state::State;
use crate::system::{System, Unknown, name_of};
use error::Seconds;
use nalgebra::DMatrix;

/// A branch of the assembly: along it the determinant of the constraints keeps its sign.
///
/// det Φ_q is zero in singular positions, where branches meet. A mechanism that is driven close to its dead centre and back stays on its
/// branch; a step over the dead centre ends on the other one, with the other sign.
#[derive(Clone, Debug)]
pub(crate) struct AssemblyBranch {
    /// As many independent constraints as free coordinates.
    constraints: Vec<usize>,
    /// The free coordinates.
    coordinates: Vec<usize>,
    is_positive: bool,
}

impl AssemblyBranch {
    /// The branch of the assembled `state`; `None` if there are fewer independent constraints than coordinates.
    pub fn of(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Self> {
        let redundant = if system.allows_redundancy() {
            ConstraintRank::of(system, mechanism, state).redundant
        } else {
            Vec::new()
        };
        let coordinates: Vec<usize> = (0..state.q.len()).filter(|&i| system.equation_of(i).is_some()).collect();
        let constraints: Vec<usize> = (0..mechanism.multipliers).filter(|m| !redundant.contains(m)).collect();
        let mut branch =
            (constraints.len() == coordinates.len()).then_some(Self { constraints, coordinates, is_positive: true })?;
        branch.is_positive = branch.contains(system, mechanism, state);
        Some(branch)
    }

    /// Returns whether the determinant has the sign of this branch in `state`.
    pub fn contains(&self, system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> bool {
        let gradients = system.constraint_jacobian(mechanism, state);
        let n = self.constraints.len();
        let gradients = DMatrix::from_fn(n, n, |i, j| gradients[self.constraints[i]][self.coordinates[j]]);
        // The determinant itself can overflow.
        let factors = gradients.lu();
        let pivots = factors.u().diagonal();
        let is_positive = pivots.iter().filter(|pivot| pivot.is_sign_negative()).count() % 2 == 0;
        (factors.p().determinant::<f64>() > 0.0) == (is_positive == self.is_positive)
    }
}

/// A singular position that a driven mechanism has passed: it is on another branch of its assembly from there on.
#[derive(Clone, Debug, PartialEq)]
pub struct SingularPassage {
    /// Time in s, shortly after the position.
    pub time: f64,
    /// The constraint that nearly depends on the others there.
    pub constraint: String,
}

impl SingularPassage {
    /// The passage before the given state, which is close to the singular position; `None` for a mechanism without constraints.
    pub(crate) fn at(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Self> {
        let multiplier = ConstraintRank::of(system, mechanism, state).most_dependent()?;
        Some(Self { time: state.t, constraint: name_of(mechanism, Unknown::Multiplier(multiplier)) })
    }
}

/// Warning about a driven mechanism that changes the branch of its assembly on the way through the `times` (s): it passes a singular position,
/// such as a parallelogram that becomes flat. `None` if it stays on its branch, or if the analysis fails, which the analysis says.
pub fn warn_of_branch_changes(mechanism: &Mechanism<f64>, assembly: &Assembly, times: &[f64]) -> Option<String> {
    let mut driver = KinematicDriver::new(mechanism, *assembly, *times.first()?).ok()?;
    for &t in times {
        if let Some(SingularPassage { time, constraint }) = driver.advance_to(t).ok()? {
            return Some(format!(
                "{constraint}: at t = {} the mechanism passes a singular position, where branches of its assembly meet: it goes on as smoothly \
                 as it came, and derivatives hold on each side only; if it must stay on the side where it was built, keep it away from this \
                 position",
                Seconds(time)
            ));
        }
    }
    None
}
