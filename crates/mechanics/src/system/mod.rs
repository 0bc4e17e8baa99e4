//! Equations of motion of a mechanism: numbering of the unknowns, residual and matrix.
//!
//! | file | contents |
//! |---|---|
//! | `state` | positions, velocities, accelerations and multipliers at one time; residual of one element |
//! | `modes` | elements that are active, events that have happened |
//! | `outputs` | named outputs of a state, energy |
//! | `coordinate_scales` | units in which changes of different coordinates are compared |
//! | `dof_map` | rows and columns of each element, and its constant derivatives |
//! | `linearization` | weights of the derivatives of the residual in the matrix of an analysis |
//! | `assembly` | residual in any number type, matrix |

pub(crate) mod assembly;
pub(crate) mod coordinate_scales;
pub(crate) mod dof_map;
pub(crate) mod linearization;
pub(crate) mod modes;
pub(crate) mod outputs;
pub mod state;

pub(crate) use dof_map::ConstantEntry;
pub use linearization::Linearization;

use crate::elements::element::{ElementWorkspace, JacobianWorkspace};
use crate::linalg::factor::Factor;
use crate::linalg::ordering::reverse_cuthill_mckee;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::State;
use crate::{Error, Result};
use dof_map::{Constants, DofMap, constant_entries, nodes_of, pattern};
use error::Seconds;

/// Unknown of an equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// Acceleration (or position) of a coordinate.
    Coordinate(usize),
    /// Multiplier.
    Multiplier(usize),
}

impl Unknown {
    /// Unknown of a node; nodes are the n coordinates, followed by the multipliers.
    fn of(node: usize, n: usize) -> Self {
        if node < n { Self::Coordinate(node) } else { Self::Multiplier(node - n) }
    }

    /// Node of the unknown.
    fn node(self, n: usize) -> usize {
        match self {
            Self::Coordinate(i) => i,
            Self::Multiplier(m) => n + m,
        }
    }
}

/// Numbering, matrix and workspace of one mechanism.
///
/// It is created once per design; assembling it allocates only at the first call.
#[derive(Clone)]
pub struct System {
    maps: Vec<DofMap>,
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
    /// Diagonal entries of followers that a switch holds in place, and these switches.
    held_diagonal: Vec<(usize, usize)>,
    factor: Factor,
    jacobian_workspace: JacobianWorkspace,
    workspace: ElementWorkspace<f64>,
    columns: Vec<f64>,
}

impl System {
    /// [`System::at`] with the time zero.
    pub fn new(mechanism: &Mechanism<f64>) -> Result<Self> {
        Self::at(mechanism, 0.0)
    }

    /// Numbers the unknowns of `mechanism` and checks its parameters, for an analysis that begins at the time `t` (s).
    ///
    /// The matrices of this system have the constant masses and stiffnesses of this design; residuals have those of the mechanism
    /// that they are evaluated for. Make a new system for another design.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming the element whose parameters are invalid.
    pub fn at(mechanism: &Mechanism<f64>, t: f64) -> Result<Self> {
        check_parameters(mechanism, t)?;
        let (n, elements) = (mechanism.coordinates.len(), &mechanism.elements);
        let (mut workspace, mut jacobian_workspace, built) =
            (ElementWorkspace::default(), JacobianWorkspace::default(), State::built(mechanism, t));
        let coefficients: Vec<_> = elements
            .iter()
            .map(|instance| constant_entries(instance, &built, &mut workspace, &mut jacobian_workspace))
            .collect();

        let (mut maps, unknowns) = numbered(mechanism, &coefficients);
        let pattern = couplings(mechanism, &maps, &coefficients, unknowns.len());
        let multipliers: Vec<_> = unknowns.iter().map(|u| matches!(u, Unknown::Multiplier(_))).collect();
        let factor = Factor::new(&pattern, &multipliers);
        let mut constants = Constants::default();
        for ((map, instance), constant) in maps.iter_mut().zip(elements).zip(&coefficients) {
            map.find_slots(instance, constant, &factor, &mut constants);
        }
        let mut equations = vec![None; n + mechanism.multipliers];
        unknowns.iter().enumerate().for_each(|(equation, unknown)| equations[unknown.node(n)] = Some(equation));
        let multiplier_equation = equations.split_off(n).into_iter().flatten().collect();
        let weighted = equations.iter().zip(&mechanism.coordinates).filter(|(_, coordinate)| !coordinate.is_follower);
        let free_diagonal = weighted.filter_map(|(&equation, _)| equation).map(|i| factor.slot(i, i)).collect();
        let held = equations.iter().zip(&mechanism.coordinates);
        let held = held.filter_map(|(&equation, coordinate)| Some((equation?, coordinate.holding?)));
        let held_diagonal = held.map(|(i, switch)| (factor.slot(i, i), switch)).collect();
        Ok(Self {
            equation_of: equations,
            multiplier_equation,
            columns: Vec::new(),
            maps,
            coefficients,
            constants,
            unknowns,
            pattern,
            free_diagonal,
            held_diagonal,
            factor,
            jacobian_workspace,
            workspace,
        })
    }

    /// Number of equations.
    pub fn size(&self) -> usize {
        self.unknowns.len()
    }

    /// Unknown of each equation.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Equation of a coordinate; `None` if it is prescribed.
    pub fn equation_of(&self, coordinate: usize) -> Option<usize> {
        self.equation_of[coordinate]
    }

    /// The diagonal entry of a free coordinate in the matrix; `None` if it is prescribed or a follower.
    pub(crate) fn diagonal(&mut self, mechanism: &Mechanism<f64>, coordinate: usize) -> Option<&mut f64> {
        let equation = self.equation_of[coordinate].filter(|_| !mechanism.coordinates[coordinate].is_follower)?;
        let slot = self.factor.slot(equation, equation);
        self.factor.entries_mut().get_mut(slot)
    }

    /// Equation of a multiplier.
    pub fn equation_of_multiplier(&self, multiplier: usize) -> usize {
        self.multiplier_equation[multiplier]
    }

    /// Unknowns of an element: local number (coordinates, followed by multipliers) and equation.
    pub(crate) fn rows_of(&self, element: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let map = &self.maps[element];
        map.active.iter().copied().zip(map.equations.iter().copied())
    }

    /// Derivatives of an element that do not depend on the state.
    pub(crate) fn coefficients(&self, element: usize) -> &[ConstantEntry] {
        &self.coefficients[element]
    }

    /// The factorization, valid after [`System::factorize`].
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// Sets whether constraints may be redundant: multipliers are then those of least norm.
    pub fn allow_redundancy(&mut self, is_allowed: bool) {
        if is_allowed {
            let multipliers: Vec<_> = self.unknowns.iter().map(|u| matches!(u, Unknown::Multiplier(_))).collect();
            self.factor.allow_redundancy(&self.pattern, &multipliers);
        } else {
            self.factor.forbid_redundancy();
        }
    }

    /// The system of another design of the mechanism, for an analysis that begins at the time `t` (s). Constraints may be redundant in both.
    ///
    /// # Errors
    ///
    /// As [`System::at`].
    pub(crate) fn of_design(&self, mechanism: &Mechanism<f64>, t: f64) -> Result<Self> {
        let mut other = Self::at(mechanism, t)?;
        other.allow_redundancy(self.allows_redundancy());
        Ok(other)
    }

    /// Returns whether constraints may be redundant.
    pub fn allows_redundancy(&self) -> bool {
        self.factor.allows_redundancy()
    }

    /// Exchanges the factorization with another one of the same pattern.
    pub(crate) fn swap_factor(&mut self, other: &mut Factor) {
        std::mem::swap(&mut self.factor, other);
    }

    /// Memory for solving with a factorization of this pattern.
    pub(crate) fn solve_workspace(&self) -> crate::linalg::factor::SolveWorkspace {
        self.factor.workspace()
    }

    /// Factorizes the assembled matrix.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming the unknown without a pivot.
    pub fn factorize(&mut self, mechanism: &Mechanism<f64>, t: f64) -> Result<()> {
        self.factor.factorize().map_err(|singular| {
            let what =
                self.unknowns.get(singular.unknown).map_or("the mechanism".to_owned(), |&u| name_of(mechanism, u));
            let why = format!("the equations are singular at t = {t}", t = Seconds(t));
            Error::analysis(what, why, "give every free coordinate mass or a joint, and remove redundant joints")
        })
    }

    /// Sets the free accelerations and the multipliers of `state` to the negative solution `rows`.
    pub(crate) fn set_accelerations(&self, rows: &[[f64; 1]], state: &mut State<f64>) {
        for (unknown, row) in self.unknowns.iter().zip(rows) {
            match *unknown {
                Unknown::Coordinate(i) => state.a[i] = -row[0],
                Unknown::Multiplier(m) => state.l[m] = -row[0],
            }
        }
    }

    /// Unknown whose row is not finite or has the largest residual; `None` without rows.
    pub(crate) fn dominant_unknown(&self, rows: &[[f64; 1]]) -> Option<Unknown> {
        let largest = || (0..rows.len()).max_by(|&i, &j| rows[i][0].abs().total_cmp(&rows[j][0].abs()));
        (0..rows.len()).find(|&i| !rows[i][0].is_finite()).or_else(largest).map(|i| self.unknowns[i])
    }

    /// Name of the unknown whose row is not finite or has the largest residual, for messages.
    pub fn dominant_residual(&self, mechanism: &Mechanism<f64>, rows: &[[f64; 1]]) -> String {
        self.dominant_unknown(rows).map_or("the mechanism".to_owned(), |unknown| name_of(mechanism, unknown))
    }

    /// Largest absolute value of `rows` in the equations of coordinates; NaN if one of them is NaN.
    pub(crate) fn largest_coordinate_row(&self, rows: &[[f64; 1]]) -> f64 {
        let coordinates = self.unknowns.iter().zip(rows).filter(|(u, _)| matches!(u, Unknown::Coordinate(_)));
        // `f64::max` ignores NaN.
        coordinates.map(|(_, row)| row[0].abs()).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    }
}

/// Maps of all elements, and the unknowns in an order with a narrow band.
fn numbered(mechanism: &Mechanism<f64>, coefficients: &[Vec<ConstantEntry>]) -> (Vec<DofMap>, Vec<Unknown>) {
    let (n, elements) = (mechanism.coordinates.len(), &mechanism.elements);
    let free = (0..n).filter(|&i| mechanism.coordinates[i].motion.is_none());
    let nodes: Vec<usize> = free.chain(n..n + mechanism.multipliers).collect();
    let mut unknown = vec![None; n + mechanism.multipliers];
    nodes.iter().enumerate().for_each(|(k, &node)| unknown[node] = Some(k));
    let variables = |instance| nodes_of(mechanism, instance).iter().map(|&node| unknown[node]).collect::<Vec<_>>();
    let mut maps: Vec<_> = elements.iter().map(|instance| DofMap::new(instance, &variables(instance))).collect();
    let order = reverse_cuthill_mckee(&couplings(mechanism, &maps, coefficients, nodes.len()));
    let mut number = vec![0; order.len()];
    order.iter().enumerate().for_each(|(equation, &k)| number[k] = equation);
    maps.iter_mut().for_each(|map| map.renumber(&number));
    (maps, order.iter().map(|&k| Unknown::of(nodes[k], n)).collect())
}

/// Unknowns that share an equation with each unknown, itself included.
fn couplings(
    mechanism: &Mechanism<f64>,
    maps: &[DofMap],
    coefficients: &[Vec<ConstantEntry>],
    unknowns: usize,
) -> Vec<Vec<usize>> {
    let maps = maps.iter().zip(&mechanism.elements).zip(coefficients);
    pattern(unknowns, maps.flat_map(|((map, instance), constant)| map.couplings(instance, constant)))
}

/// Checks parameters, coefficients of restitution and initial values.
fn check_parameters(mechanism: &Mechanism<f64>, t: f64) -> Result<()> {
    let when = format!("before the motion starts at t = {t}", t = Seconds(t));
    for instance in mechanism.elements.iter().chain(mechanism.events.iter().map(|impact| &impact.gap)) {
        let flaw = instance.element.validate_parameters(&instance.parameters).or_else(|| {
            let bad = instance.parameters.iter().find(|p| !p.is_finite());
            bad.map(|p| format!("a parameter is {p}"))
        });
        if let Some(why) = flaw {
            return Err(Error::analysis(
                &instance.name,
                format!("{why}, {when}"),
                "change the design so that it can be built",
            ));
        }
    }
    let contacts = mechanism.events.iter().filter_map(|impact| Some((impact, impact.restitution?)));
    if let Some((impact, e)) = contacts.into_iter().find(|(_, e)| !(0.0..=1.0).contains(e)) {
        let why = format!("its coefficient of restitution is {e}, {when}");
        return Err(Error::analysis(&impact.gap.name, why, "keep it from 0 to 1"));
    }
    for coordinate in &mechanism.coordinates {
        if coordinate.is_driven_twice {
            let why = "its motion is prescribed twice";
            return Err(Error::analysis(&coordinate.name, why, "remove one of its drivers"));
        }
        let motion = coordinate.motion.as_ref();
        if let Some(why) = motion.and_then(|(motion, parameters)| motion.validate_parameters(parameters)) {
            let remedy = "change the design so that the motion is possible";
            return Err(Error::analysis(&coordinate.name, format!("{why}, {when}"), remedy));
        }
    }
    let bad = mechanism.coordinates.iter().find(|c| !(c.position.is_finite() && c.velocity.is_finite()));
    bad.map_or(Ok(()), |c| {
        let why = format!("initial position {} and velocity {} are not finite, {when}", c.position, c.velocity);
        Err(Error::analysis(&c.name, why, "check the geometry: a distance may be impossible to bridge"))
    })
}

/// Name of an unknown: its coordinate, or the joint whose reaction it is.
pub(crate) fn name_of<T>(mechanism: &Mechanism<T>, unknown: Unknown) -> String {
    match unknown {
        Unknown::Coordinate(i) => mechanism.coordinates[i].name.clone(),
        Unknown::Multiplier(m) => {
            let holds = |instance: &&ElementInstance<T>| {
                (instance.first_multiplier..instance.first_multiplier + instance.num_constraints).contains(&m)
            };
            let instance = mechanism.elements.iter().find(holds).expect("every multiplier belongs to a joint");
            format!("{} (constraint {})", instance.name, m - instance.first_multiplier + 1)
        }
    }
}
