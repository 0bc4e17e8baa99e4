//! Branches of the assembly of a driven mechanism, such as the two positions of a dyad on either side of its dead centre.

use crate::constraint_rank::ConstraintRank;
use crate::linalg::determinant::DeterminantSign;
use crate::mechanism::Mechanism;
use crate::system::assembly::ConstraintWorkspace;
use crate::system::state::State;
use crate::system::{System, Unknown, name_of};
use nalgebra::{DMatrix, RowDVector};

/// A branch of the assembly: along it the determinant of the constraints keeps its sign.
///
/// det Φ_q is zero in singular positions, where branches meet. A mechanism that is driven close to its dead centre and back stays on its
/// branch; a step over the dead centre ends on the other one, with the other sign. With redundant constraints the determinant is that of
/// independent ones. Others take their place where these become dependent, which is no singular position.
#[derive(Clone, Debug)]
pub(crate) struct AssemblyBranch {
    /// The row of each multiplier in the determinant: as many independent constraints as free coordinates.
    row_of: Vec<Option<usize>>,
    /// The column of each free coordinate.
    column_of: Vec<Option<usize>>,
    is_positive: bool,
    /// The rows of the determinant, as (column, value).
    rows: Vec<Vec<(usize, f64)>>,
    workspace: ConstraintWorkspace,
    sign: DeterminantSign,
}

impl AssemblyBranch {
    /// The branch of the assembled `state`; `None` if there are fewer independent constraints than coordinates.
    pub fn of(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Self> {
        let redundant = if system.allows_redundancy() {
            ConstraintRank::of(system, mechanism, state).redundant
        } else {
            Vec::new()
        };
        let column_of = numbered((0..state.q.len()).map(|i| system.equation_of(i).is_some()));
        let row_of = numbered((0..mechanism.multipliers).map(|m| !redundant.contains(&m)));
        let [rows, columns] = [&row_of, &column_of].map(|numbers| numbers.iter().flatten().count());
        let mut branch = (rows == columns).then_some(Self {
            row_of,
            column_of,
            is_positive: true,
            rows: vec![Vec::new(); rows],
            workspace: ConstraintWorkspace::default(),
            sign: DeterminantSign::default(),
        })?;
        branch.is_positive = branch.contains(system, mechanism, state);
        Some(branch)
    }

    /// Returns whether the assembled state `now` is on the branch of the state `before`, which is a step away.
    ///
    /// If the determinant has changed its sign, and constraints are redundant, those that are most independent `before` decide.
    pub fn continues(
        &mut self,
        system: &System,
        mechanism: &Mechanism<f64>,
        before: &State<f64>,
        now: &State<f64>,
    ) -> bool {
        if self.contains(system, mechanism, now) {
            return true;
        }
        if self.rows.len() == self.row_of.len() {
            return false;
        }
        self.choose_constraints(system, mechanism, before);
        self.contains(system, mechanism, now)
    }

    /// Chooses the most independent constraints in `state`, by the pivots of a QR decomposition of Φ_qᵀ, and takes the sign there.
    fn choose_constraints(&mut self, system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let (count, multipliers) = (self.rows.len(), self.row_of.len());
        let mut gradients = DMatrix::<f64>::zeros(count, multipliers);
        system.visit_constraint_jacobian(mechanism, state, &mut self.workspace, |m, i, value| {
            if let Some(column) = self.column_of[i] {
                gradients[(column, m)] += value;
            }
        });
        let mut order = RowDVector::from_fn(multipliers, |_, m| m);
        gradients.col_piv_qr().p().permute_columns(&mut order);
        self.row_of = numbered((0..multipliers).map(|m| order.iter().take(count).any(|chosen| *chosen == m)));
        self.is_positive = true;
        self.is_positive = self.contains(system, mechanism, state);
    }

    /// Returns whether the determinant has the sign of this branch in `state`, or is zero.
    fn contains(&mut self, system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> bool {
        let Self { row_of, column_of, rows, workspace, .. } = self;
        rows.iter_mut().for_each(Vec::clear);
        system.visit_constraint_jacobian(mechanism, state, workspace, |m, i, value| {
            if let (Some(row), Some(column)) = (row_of[m], column_of[i]) {
                rows[row].push((column, value));
            }
        });
        self.sign.is_positive(rows).is_none_or(|is_positive| is_positive == self.is_positive)
    }
}

/// Numbers those of a sequence that are true, from 0.
fn numbered(chosen: impl Iterator<Item = bool>) -> Vec<Option<usize>> {
    let mut next = 0..;
    chosen.map(|is_chosen| if is_chosen { next.next() } else { None }).collect()
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
