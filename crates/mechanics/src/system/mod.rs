//! The equations of a mechanism: which unknown has which number, the residual, and the matrix.

//!
//! | file | what |
//! |---|---|
//! | `place` | which rows and columns an element has, and which of its derivatives never change |
//! | `assembly` | the matrix and its rows |
//! | `linearization` | which derivatives the matrix is made of |
//! | `rows` | residual rows in any number type |

pub(crate) mod assembly;
pub(crate) mod dof_map;
pub(crate) mod linearization;
pub(crate) mod residual;
pub mod state;

pub(crate) use dof_map::ConstantEntry;
pub use linearization::Linearization;

use crate::elements::element::{ElementWorkspace, JacobianWorkspace};
use crate::linalg::factor::Factor;
use crate::linalg::ordering::reverse_cuthill_mckee;
use crate::mechanism::ElementInstance;
use crate::mechanism::Mechanism;
use crate::system::state::State;
use crate::{Error, Result};
use dof_map::Constants;
use dof_map::DofMap;
use dof_map::coefficients;
use dof_map::nodes_of;
use dof_map::pattern;

/// Unknown of an equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// Acceleration (or position) of a coordinate.
    Coordinate(usize),
    /// Multiplier.
    Multiplier(usize),
}

impl Unknown {
    /// Of a node: the n coordinates, then the multipliers.
    fn of(node: usize, n: usize) -> Self {
        if node < n { Self::Coordinate(node) } else { Self::Multiplier(node - n) }
    }

    /// The other way round.
    fn node(self, n: usize) -> usize {
        match self {
            Self::Coordinate(i) => i,
            Self::Multiplier(m) => n + m,
        }
    }
}

/// Numbering, matrix and working room of one mechanism.
///
/// Made once per design; evaluating it allocates nothing after the first time.
#[derive(Clone)]
pub struct System {
    places: Vec<DofMap>,
    /// Derivatives of each element that are the same in every state.
    coefficients: Vec<Vec<ConstantEntry>>,
    constants: Constants,
    /// Unknown of each equation.
    unknowns: Vec<Unknown>,
    equation_of: Vec<Option<usize>>,
    multiplier_equation: Vec<usize>,
    /// Columns of each row.
    pattern: Vec<Vec<usize>>,
    /// Slots of the free coordinates' diagonal entries.
    free_diagonal: Vec<usize>,
    factor: Factor,
    jacobian_workspace: JacobianWorkspace,
    workspace: ElementWorkspace<f64>,
    columns: Vec<f64>,
}

impl System {
    /// [`System::at`] the time zero.
    pub fn new(mechanism: &Mechanism<f64>) -> Result<Self> {
        Self::at(mechanism, 0.0)
    }

    /// Numbers the unknowns of `mechanism` and checks its parameters, for an analysis that begins at the time `t` (s).
    ///
    /// **Errors.** [`Error::Analysis`] naming the element whose parameters are impossible.
    pub fn at(mechanism: &Mechanism<f64>, t: f64) -> Result<Self> {
        check_parameters(mechanism, t)?;
        let (n, parts) = (mechanism.coordinates.len(), &mechanism.parts);
        let (mut workspace, mut jacobian_workspace, built) =
            (ElementWorkspace::default(), JacobianWorkspace::default(), State::built(mechanism, t));
        let coefficients: Vec<_> =
            parts.iter().map(|part| coefficients(part, &built, &mut workspace, &mut jacobian_workspace)).collect();

        let (mut places, unknowns) = numbered(mechanism, &coefficients);
        let pattern = couplings(mechanism, &places, &coefficients, unknowns.len());
        let multipliers: Vec<_> = unknowns.iter().map(|u| matches!(u, Unknown::Multiplier(_))).collect();
        let factor = Factor::new(&pattern, &multipliers);
        let mut constants = Constants::default();
        for ((place, part), known) in places.iter_mut().zip(parts).zip(&coefficients) {
            place.find_slots(part, known, &factor, &mut constants);
        }
        let mut equations = vec![None; n + mechanism.multipliers];
        unknowns.iter().enumerate().for_each(|(equation, unknown)| equations[unknown.node(n)] = Some(equation));
        let multiplier_equation = equations.split_off(n).into_iter().flatten().collect();
        let free_diagonal = equations.iter().flatten().map(|&i| factor.slot(i, i)).collect();
        Ok(Self {
            equation_of: equations,
            multiplier_equation,
            columns: Vec::new(),
            places,
            coefficients,
            constants,
            unknowns,
            pattern,
            free_diagonal,
            factor,
            jacobian_workspace,
            workspace,
        })
    }

    /// Number of equations.
    pub fn size(&self) -> usize {
        self.unknowns.len()
    }

    /// What each equation's unknown is.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Equation of a coordinate, unless it is prescribed.
    pub fn equation_of(&self, coordinate: usize) -> Option<usize> {
        self.equation_of[coordinate]
    }

    /// Equation of a multiplier.
    pub fn equation_of_multiplier(&self, multiplier: usize) -> usize {
        self.multiplier_equation[multiplier]
    }

    /// The rows of an element: local number (coordinates first, then multipliers) and equation of its unknowns.
    pub(crate) fn rows_of(&self, part: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let place = &self.places[part];
        place.active.iter().copied().zip(place.equations.iter().copied())
    }

    /// The derivatives of an element that are the same in every state.
    pub(crate) fn coefficients(&self, part: usize) -> &[ConstantEntry] {
        &self.coefficients[part]
    }

    /// The factorization, valid after [`System::factorize`].
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// Exchanges the factorization with another of the same pattern.
    pub(crate) fn swap_factor(&mut self, other: &mut Factor) {
        std::mem::swap(&mut self.factor, other);
    }

    /// Memory for solving with a factorization of this pattern.
    pub(crate) fn solve_workspace(&self) -> crate::linalg::factor::SolveWorkspace {
        self.factor.workspace()
    }

    /// Factorizes what was assembled.
    ///
    /// **Errors.** [`Error::Analysis`] naming the unknown without a pivot.
    pub fn factorize(&mut self, mechanism: &Mechanism<f64>, t: f64) -> Result<()> {
        self.factor.factorize().map_err(|singular| {
            let what =
                self.unknowns.get(singular.unknown).map_or("the mechanism".to_owned(), |&u| name_of(mechanism, u));
            let why = format!("the equations are singular at t = {t:.6e} s");
            Error::analysis(what, why, "give every free coordinate mass or a joint, and remove redundant joints")
        })
    }

    /// The element whose rows are largest, and its row's name: for messages.
    pub fn dominant_residual(&self, mechanism: &Mechanism<f64>, rows: &[[f64; 1]]) -> String {
        let worst = (0..rows.len()).max_by(|&i, &j| rows[i][0].abs().total_cmp(&rows[j][0].abs()));
        let not_finite = (0..rows.len()).find(|&i| !rows[i][0].is_finite());
        not_finite.or(worst).map_or("the mechanism".to_owned(), |i| name_of(mechanism, self.unknowns[i]))
    }
}

/// Every element's place, and the unknowns in an order that makes the matrix a narrow band.
fn numbered(mechanism: &Mechanism<f64>, coefficients: &[Vec<ConstantEntry>]) -> (Vec<DofMap>, Vec<Unknown>) {
    let (n, parts) = (mechanism.coordinates.len(), &mechanism.parts);
    let free = (0..n).filter(|&i| mechanism.coordinates[i].motion.is_none());
    let nodes: Vec<usize> = free.chain(n..n + mechanism.multipliers).collect();
    let mut unknown = vec![None; n + mechanism.multipliers];
    nodes.iter().enumerate().for_each(|(k, &node)| unknown[node] = Some(k));
    let variables = |part| nodes_of(mechanism, part).iter().map(|&node| unknown[node]).collect::<Vec<_>>();
    let mut places: Vec<_> = parts.iter().map(|part| DofMap::new(part, &variables(part))).collect();
    let order = reverse_cuthill_mckee(&couplings(mechanism, &places, coefficients, nodes.len()));
    let mut number = vec![0; order.len()];
    order.iter().enumerate().for_each(|(equation, &k)| number[k] = equation);
    places.iter_mut().for_each(|place| place.renumber(&number));
    (places, order.iter().map(|&k| Unknown::of(nodes[k], n)).collect())
}

/// For each unknown those that share an equation with it, itself among them.
fn couplings(
    mechanism: &Mechanism<f64>,
    places: &[DofMap],
    coefficients: &[Vec<ConstantEntry>],
    unknowns: usize,
) -> Vec<Vec<usize>> {
    let elements = places.iter().zip(&mechanism.parts).zip(coefficients);
    pattern(unknowns, elements.flat_map(|((place, part), known)| place.couplings(part, known)))
}

fn check_parameters(mechanism: &Mechanism<f64>, t: f64) -> Result<()> {
    let when = format!("before the motion starts at t = {t:.6e} s");
    for part in mechanism.parts.iter().chain(mechanism.impacts.iter().map(|impact| &impact.part)) {
        let validate_parameters = part.element.validate_parameters(&part.parameters).or_else(|| {
            let bad = part.parameters.iter().find(|p| !p.is_finite());
            bad.map(|p| format!("a parameter is {p}"))
        });
        if let Some(why) = validate_parameters {
            return Err(Error::analysis(
                &part.name,
                format!("{why}, {when}"),
                "change the design so that it can be built",
            ));
        }
    }
    let bounces = mechanism.impacts.iter().filter_map(|impact| Some((impact, impact.restitution?)));
    if let Some((impact, e)) = bounces.into_iter().find(|(_, e)| !(0.0..=1.0).contains(e)) {
        let why = format!("its coefficient of restitution is {e}, {when}");
        return Err(Error::analysis(&impact.part.name, why, "keep it from 0 to 1"));
    }
    let bad = mechanism.coordinates.iter().find(|c| !(c.position.is_finite() && c.velocity.is_finite()));
    bad.map_or(Ok(()), |c| {
        let why = format!("initial position {} and velocity {} are not finite, {when}", c.position, c.velocity);
        Err(Error::analysis(&c.name, why, "check the geometry: a distance may be impossible to bridge"))
    })
}

/// Name of an unknown: its coordinate, or the joint that it is a reaction of.
pub(crate) fn name_of<T>(mechanism: &Mechanism<T>, unknown: Unknown) -> String {
    match unknown {
        Unknown::Coordinate(i) => mechanism.coordinates[i].name.clone(),
        Unknown::Multiplier(m) => {
            let holds = |part: &&ElementInstance<T>| {
                (part.first_multiplier..part.first_multiplier + part.num_constraints).contains(&m)
            };
            let part = mechanism.parts.iter().find(holds).expect("every multiplier belongs to a joint");
            format!("{} (closure {})", part.name, m - part.first_multiplier + 1)
        }
    }
}
