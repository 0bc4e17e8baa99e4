//! The equations of a mechanism: which unknown has which number, the residual, and the matrix.

use super::state::State;
use crate::linalg::{Factor, bandwidth_order};
use crate::multibody::element::{Room, Scratchpad, Seeds};
use crate::multibody::mechanism::PartData;
use crate::multibody::{Jet, Local, Mechanism, Number, Real};
use crate::{Error, Result};

/// How residual rows are linearized into a matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearization {
    /// How variables of balancing elements move with an unknown.
    pub balance: Seeds,
    /// How variables of constraints move with an unknown.
    pub constraint: Seeds,
    /// Factor on the closure rows.
    pub closure: f64,
    /// Added to the diagonal of the free coordinates, while balancing elements are left out.
    pub projection: bool,
}

impl Linearization {
    /// One implicit time step: the unknowns are accelerations, with which positions move by `position` (s²) and
    /// velocities by `velocity` (s). Closure rows are divided by `position`, which keeps the matrix well scaled for
    /// every step size.
    ///
    /// **Source.** Bottasso, Dopico & Trainelli, *Multibody Syst. Dyn.* 19 (2008) 3–20.
    pub fn step(position: f64, velocity: f64) -> Self {
        let seeds = Seeds { position, velocity, acceleration: 1.0 };
        Self { balance: seeds, constraint: seeds, closure: 1.0 / position, projection: false }
    }

    /// Accelerations and multipliers at a given state: the saddle-point matrix of M and Φ_q.
    pub fn accelerations() -> Self {
        let balance = Seeds { position: 0.0, velocity: 0.0, acceleration: 1.0 };
        let constraint = Seeds { position: 1.0, velocity: 0.0, acceleration: 0.0 };
        Self { balance, constraint, closure: 1.0, projection: false }
    }

    /// Positions only.
    pub fn statics() -> Self {
        let seeds = Seeds { position: 1.0, velocity: 0.0, acceleration: 0.0 };
        Self { balance: seeds, constraint: seeds, closure: 1.0, projection: false }
    }

    /// The nearest point on the constraints.
    pub fn projection() -> Self {
        Self { projection: true, ..Self::statics() }
    }
}

/// Where one element's rows and columns are in the system.
struct Place {
    /// Local variables that are unknowns: coordinates first, then multipliers.
    active: Vec<usize>,
    /// Equation of each active variable.
    equations: Vec<usize>,
    /// Matrix slot of each pair (row, column) of active variables, row by row.
    slots: Vec<usize>,
}

/// Unknown of an equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// Acceleration (or position) of a coordinate.
    Coordinate(usize),
    /// Multiplier.
    Multiplier(usize),
}

/// Numbering, matrix and working room of one mechanism.
///
/// Made once per topology; evaluating it allocates nothing after the first time.
pub struct System {
    places: Vec<Place>,
    /// Unknown of each equation.
    unknowns: Vec<Unknown>,
    equation_of: Vec<Option<usize>>,
    multiplier_equation: Vec<usize>,
    diagonal: Vec<usize>,
    factor: Factor,
    pad: Scratchpad,
    room: Room<f64>,
    columns: Vec<f64>,
}

impl System {
    /// Numbers the unknowns of `mechanism` and checks its parameters.
    ///
    /// **Errors.** [`Error::Analysis`] naming the element whose parameters are impossible.
    pub fn new(mechanism: &Mechanism<f64>) -> Result<Self> {
        check_parameters(mechanism)?;
        let n = mechanism.coordinates.len();
        let nodes: Vec<Vec<usize>> = mechanism.parts.iter().map(|part| nodes_of(mechanism, part, n)).collect();
        let free: Vec<usize> = (0..n).filter(|&i| mechanism.coordinates[i].motion.is_none()).collect();
        let unknown_nodes: Vec<usize> = free.iter().copied().chain(n..n + mechanism.multipliers).collect();
        let mut index = vec![usize::MAX; n + mechanism.multipliers];
        unknown_nodes.iter().enumerate().for_each(|(k, &node)| index[node] = k);
        let neighbours = couplings(&nodes, &index, unknown_nodes.len());
        let order = bandwidth_order(&neighbours);
        let mut number = vec![0; order.len()];
        order.iter().enumerate().for_each(|(equation, &k)| number[k] = equation);
        let mut rows: Vec<Vec<usize>> = vec![Vec::new(); order.len()];
        for (equation, &k) in order.iter().enumerate() {
            rows[equation] = neighbours[k].iter().map(|&j| number[j]).chain([equation]).collect();
            rows[equation].sort_unstable();
        }
        let factor = Factor::new(&rows);
        let equation = |node: usize| (index[node] != usize::MAX).then(|| number[index[node]]);
        let places =
            mechanism.parts.iter().zip(&nodes).map(|(part, all)| place(part, all, n, &factor, &equation)).collect();
        let unknown = |&k: &usize| match unknown_nodes[k] {
            node if node < n => Unknown::Coordinate(node),
            node => Unknown::Multiplier(node - n),
        };
        Ok(Self {
            places,
            unknowns: order.iter().map(unknown).collect(),
            equation_of: (0..n).map(equation).collect(),
            multiplier_equation: (n..n + mechanism.multipliers)
                .map(|m| equation(m).expect("multipliers are unknown"))
                .collect(),
            diagonal: (0..order.len()).map(|i| factor.slot(i, i)).collect(),
            factor,
            pad: Scratchpad::default(),
            room: Room::default(),
            columns: Vec::new(),
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

    /// The factorization, valid after [`System::factorize`].
    pub fn factor(&mut self) -> &mut Factor {
        &mut self.factor
    }

    /// Assembles the residual rows into `rows` and the matrix into the factor (not yet factorized).
    pub fn assemble(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        how: Linearization,
        rows: &mut [[f64; 1]],
    ) {
        rows.fill([0.0]);
        self.factor.entries_mut().fill(0.0);
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            let constraint = part.closures > 0;
            if place.active.is_empty() || (how.projection && !constraint) {
                continue;
            }
            gather(part, state, &mut self.room);
            let (width, n) = (place.active.len() + 1, part.coordinates.len());
            self.columns.resize((n + part.closures) * width, 0.0);
            let seeds = if constraint { how.constraint } else { how.balance };
            let local = Local { p: &part.parameters, ..self.room.local(state.t) };
            part.element.columns(&local, seeds, &place.active, &mut self.pad, &mut self.columns);
            let entries = self.factor.entries_mut();
            for ((&r, &equation), slots) in place.active.iter().zip(&place.equations).zip(place.slots.chunks(width - 1))
            {
                let scale = if r < n { 1.0 } else { how.closure };
                let row = &self.columns[r * width..(r + 1) * width];
                rows[equation][0] += scale * row[0];
                for (&slot, &value) in slots.iter().zip(&row[1..]) {
                    entries[slot] += scale * value;
                }
            }
        }
        if how.projection {
            self.add_identity();
        }
    }

    fn add_identity(&mut self) {
        let entries = self.factor.entries_mut();
        for (unknown, &slot) in self.unknowns.iter().zip(&self.diagonal) {
            if matches!(unknown, Unknown::Coordinate(_)) {
                entries[slot] += 1.0;
            }
        }
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

    /// Residual rows by equation in any number type: balance rows, and closure rows times `closure`.
    pub fn residual<T: Real>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        closure: f64,
        room: &mut Room<T>,
        rows: &mut [T],
    ) {
        rows.fill(T::from(0.0));
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            if !place.active.is_empty() {
                evaluate(part, state, room);
                scatter(part, place, room, closure, rows);
            }
        }
    }

    /// Rows of the projection onto the constraints: λ Φ_q in the coordinate rows, Φ in the others.
    pub fn constraint_rows<T: Real>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        room: &mut Room<T>,
        rows: &mut [T],
    ) {
        rows.fill(T::from(0.0));
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            if part.closures > 0 {
                evaluate(part, state, room);
                scatter(part, place, room, 1.0, rows);
            }
        }
    }

    /// Overwrites the closure rows with the constraints' `order`-th time derivative (1 or 2) along the motion.
    pub fn closure_rates<T: Real>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        order: usize,
        room: &mut Room<Jet<T>>,
        rows: &mut [T],
    ) where
        Jet<T>: Number,
    {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let constant = |&x: &T| Jet::new(x, zero, zero);
        for part in mechanism.parts.iter().filter(|part| part.closures > 0) {
            room.p.clear();
            room.p.extend(part.parameters.iter().map(constant));
            room.q.clear();
            room.q.extend(part.coordinates.iter().map(|&i| Jet::new(state.q[i], state.v[i], state.a[i])));
            for still in [&mut room.v, &mut room.a] {
                still.clear();
                still.resize(part.coordinates.len(), constant(&zero));
            }
            room.l.clear();
            room.l.resize(part.closures, constant(&zero));
            Jet::<T>::residual(part.element.as_ref(), Jet::new(T::from(state.t), one, zero), room);
            for (k, closure) in room.closure.iter().enumerate() {
                let rate = if order == 1 { closure.v1 } else { closure.v2 };
                rows[self.multiplier_equation[part.first_multiplier + k]] = rate;
            }
        }
    }

    /// Rows of Φ_q with respect to all coordinates, zero for prescribed ones; one row per multiplier.
    pub fn closure_gradients(&self, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<Vec<f64>> {
        let (mut pad, mut room, mut columns) = (Scratchpad::default(), Room::default(), Vec::new());
        let mut gradients = vec![vec![0.0; mechanism.coordinates.len()]; mechanism.multipliers];
        for (part, place) in mechanism.parts.iter().zip(&self.places).filter(|(part, _)| part.closures > 0) {
            gather(part, state, &mut room);
            let (width, n) = (place.active.len() + 1, part.coordinates.len());
            columns.resize((n + part.closures) * width, 0.0);
            let local = Local { p: &part.parameters, ..room.local(state.t) };
            part.element.columns(&local, Linearization::statics().constraint, &place.active, &mut pad, &mut columns);
            for k in 0..part.closures {
                let row = &columns[(n + k) * width + 1..(n + k + 1) * width];
                for (&local, &value) in place.active.iter().zip(row).filter(|(local, _)| **local < n) {
                    gradients[part.first_multiplier + k][part.coordinates[local]] += value;
                }
            }
        }
        gradients
    }

    /// The assembled matrix, dense: only before it is factorized.
    pub fn dense(&mut self) -> nalgebra::DMatrix<f64> {
        let n = self.size();
        let mut dense = nalgebra::DMatrix::zeros(n, n);
        for place in &self.places {
            let pairs = place.equations.iter().flat_map(|&i| place.equations.iter().map(move |&j| (i, j)));
            for ((i, j), &slot) in pairs.zip(&place.slots) {
                dense[(i, j)] = self.factor.entries_mut()[slot];
            }
        }
        dense
    }

    /// The element whose rows are largest, and its row's name: for messages.
    pub fn culprit(&self, mechanism: &Mechanism<f64>, rows: &[[f64; 1]]) -> String {
        let worst = (0..rows.len()).max_by(|&i, &j| rows[i][0].abs().total_cmp(&rows[j][0].abs()));
        let not_finite = (0..rows.len()).find(|&i| !rows[i][0].is_finite());
        not_finite.or(worst).map_or("the mechanism".to_owned(), |i| name_of(mechanism, self.unknowns[i]))
    }
}

fn check_parameters(mechanism: &Mechanism<f64>) -> Result<()> {
    for part in &mechanism.parts {
        let complaint = part.element.complaint(&part.parameters).or_else(|| {
            let bad = part.parameters.iter().find(|p| !p.is_finite());
            bad.map(|p| format!("a parameter is {p}"))
        });
        if let Some(why) = complaint {
            return Err(Error::analysis(&part.name, why, "change the design so that it can be built"));
        }
    }
    let bad = mechanism.coordinates.iter().find(|c| !(c.position.is_finite() && c.velocity.is_finite()));
    bad.map_or(Ok(()), |c| {
        let why = format!("initial position {} and velocity {} are not finite", c.position, c.velocity);
        Err(Error::analysis(&c.name, why, "check the geometry: a distance may be impossible to bridge"))
    })
}

/// Name of an unknown: its coordinate, or the joint that it is a reaction of.
pub(crate) fn name_of<T>(mechanism: &Mechanism<T>, unknown: Unknown) -> String {
    match unknown {
        Unknown::Coordinate(i) => mechanism.coordinates[i].name.clone(),
        Unknown::Multiplier(m) => {
            let holds =
                |part: &&PartData<T>| (part.first_multiplier..part.first_multiplier + part.closures).contains(&m);
            let part = mechanism.parts.iter().find(holds).expect("every multiplier belongs to a joint");
            format!("{} (closure {})", part.name, m - part.first_multiplier + 1)
        }
    }
}

fn nodes_of<T>(mechanism: &Mechanism<T>, part: &PartData<T>, n: usize) -> Vec<usize> {
    debug_assert!(part.coordinates.iter().all(|&c| c < mechanism.coordinates.len()));
    let multipliers = part.first_multiplier..part.first_multiplier + part.closures;
    part.coordinates.iter().copied().chain(multipliers.map(|m| n + m)).collect()
}

/// For each unknown the others that share an element with it.
fn couplings(nodes: &[Vec<usize>], index: &[usize], unknowns: usize) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); unknowns];
    for all in nodes {
        for &i in all.iter().map(|&node| &index[node]).filter(|&&k| k != usize::MAX) {
            let others = all.iter().map(|&node| index[node]).filter(|&k| k != usize::MAX && k != i);
            neighbours[i].extend(others);
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    neighbours
}

fn place<T>(
    part: &PartData<T>,
    nodes: &[usize],
    n: usize,
    factor: &Factor,
    equation: &impl Fn(usize) -> Option<usize>,
) -> Place {
    debug_assert!(nodes.iter().take(part.coordinates.len()).all(|&node| node < n));
    let sensor = part.element.is_sensor();
    let active: Vec<usize> = (0..nodes.len()).filter(|&k| !sensor && equation(nodes[k]).is_some()).collect();
    let equations: Vec<usize> =
        active.iter().map(|&k| equation(nodes[k]).expect("active variables are unknown")).collect();
    let slots = equations.iter().flat_map(|&i| equations.iter().map(move |&j| (i, j))).map(|(i, j)| factor.slot(i, j));
    let slots = slots.collect();
    Place { active, equations, slots }
}

/// Copies the element's variables out of the state; parameters are left to the caller.
pub(crate) fn gather<T: Real>(part: &PartData<T>, state: &State<T>, room: &mut Room<T>) {
    for (to, from) in [(&mut room.q, &state.q), (&mut room.v, &state.v), (&mut room.a, &state.a)] {
        to.clear();
        to.extend(part.coordinates.iter().map(|&i| from[i]));
    }
    room.l.clear();
    room.l.extend_from_slice(&state.l[part.first_multiplier..part.first_multiplier + part.closures]);
}

/// Evaluates an element's residual into `room`.
pub(crate) fn evaluate<T: Real>(part: &PartData<T>, state: &State<T>, room: &mut Room<T>) {
    gather(part, state, room);
    room.p.clear();
    room.p.extend_from_slice(&part.parameters);
    T::residual(part.element.as_ref(), T::from(state.t), room);
}

fn scatter<T: Real>(part: &PartData<T>, place: &Place, room: &Room<T>, closure: f64, rows: &mut [T]) {
    let n = part.coordinates.len();
    for (&r, &equation) in place.active.iter().zip(&place.equations) {
        rows[equation] += if r < n { room.balance[r] } else { room.closure[r - n] * closure };
    }
}
