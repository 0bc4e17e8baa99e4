//! Elements in dual numbers, once per stage for all design variables.

use super::entries::Entries;
use crate::analysis::explicit::mechanism::Projected;
use crate::analysis::system::Coefficient;
use crate::analysis::{State, System};
use crate::multibody::element::Room;
use crate::multibody::mechanism::PartData;
use crate::multibody::{Jet, Mechanism, Number, Sensitive};
use crate::scalar::{Tangent, WIDTH};
use std::collections::BTreeSet;

/// What a local variable of an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Position,
    Velocity,
    Acceleration,
    Parameter,
}

/// A local variable that can change with the design.
#[derive(Clone, Copy, Debug)]
struct Variable {
    kind: Kind,
    local: usize,
    source: usize,
}

/// Which time derivative of Φ stands in the closure rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Closure {
    /// Φ̈ with the accelerations of the state.
    Accelerations,
    /// Φ + Φ_q δ, where δ are the accelerations of the state.
    Positions,
    /// Φ̇.
    Velocities,
    /// Φ_q ε, where ε are the accelerations of the state.
    Corrections,
}

/// The elements of a mechanism whose residuals are differentiated with respect to their own few variables.
///
/// An element's local derivatives serve all design variables: with few nonzero entries per row they are cheaper than
/// one dual evaluation for each chunk. A constraint is evaluated once, on positions that move in time (jets) and are
/// seeded: the derivative of Φ̈ with respect to velocities is twice that of Φ̇ with respect to positions. Coordinates that
/// an element is linear in are not seeded; what they contribute is the same at every stage.
pub(super) struct Linearizer {
    /// Variables and rows of each element.
    elements: Vec<(Vec<Variable>, Rows)>,
    /// Derivatives that are the same at every stage: of the accelerations' rows, of the position step's and of the
    /// velocities' closures.
    constants: [Entries; 3],
    /// Element and place of each parameter that changes with the design.
    pub parameters: Vec<(usize, usize)>,
    /// Prescribed coordinates whose motion changes with the design.
    pub moving: Vec<usize>,
    coordinates: usize,
}

/// Local number and equation of an element's rows.
type Rows = Vec<(usize, usize)>;

/// Room for one linearization.
#[derive(Clone, Default)]
pub(super) struct Rooms {
    plain: Room<Sensitive>,
    jets: Room<Jet<Sensitive>>,
    short_jets: Room<Jet<Tangent<4>>>,
}

impl Linearizer {
    /// For the design variables that are seeded in the `chunks` of `mechanism`.
    pub fn new(mechanism: &Mechanism<f64>, chunks: &[Mechanism<Sensitive>], system: &System) -> Self {
        let n = mechanism.coordinates.len();
        let depends = |x: &Sensitive| x.eps.iter().any(|slope| *slope != 0.0);
        let moves = |i: usize| {
            let parameters = |m: &Mechanism<Sensitive>| m.coordinates[i].motion.as_ref().map(|(_, p)| p.clone());
            chunks.iter().filter_map(parameters).flatten().any(|p| depends(&p))
        };
        let moving: Vec<usize> = (0..n).filter(|&i| moves(i)).collect();
        let mut parameters = Vec::new();
        let elements = (0..mechanism.parts.len()).map(|k| {
            let part = &mechanism.parts[k];
            let rows: Vec<_> = system.rows_of(k).collect();
            if rows.is_empty() {
                return (Vec::new(), rows);
            }
            let mut variables = Vec::new();
            for (local, &i) in part.coordinates.iter().enumerate() {
                let prescribed = mechanism.coordinates[i].motion.is_some();
                let moves = moving.contains(&i);
                if (prescribed && !moves) || part.element.linear().contains(&local) {
                    continue;
                }
                variables.push(Variable { kind: Kind::Position, local, source: i });
                if part.closures == 0 {
                    variables.push(Variable { kind: Kind::Velocity, local, source: n + i });
                    if moves {
                        variables.push(Variable { kind: Kind::Acceleration, local, source: 2 * n + i });
                    }
                }
            }
            for local in 0..part.parameters.len() {
                if chunks.iter().any(|m| depends(&m.parts[k].parameters[local])) {
                    variables.push(Variable { kind: Kind::Parameter, local, source: 3 * n + parameters.len() });
                    parameters.push((k, local));
                }
            }
            (variables, rows)
        });
        let elements: Vec<_> = elements.collect();
        let mut constants = [(); 3].map(|()| Entries::new(3 * n));
        for (k, (part, (_, rows))) in mechanism.parts.iter().zip(&elements).enumerate() {
            let carries = |c: &&Coefficient| {
                let i = part.coordinates[c.coordinate];
                mechanism.coordinates[i].motion.is_none() || moving.contains(&i)
            };
            for coefficient in system.coefficients(k).iter().filter(carries) {
                add_constants(part, coefficient, rows, n, &moving, &mut constants);
            }
        }
        Self { elements, constants, parameters, moving, coordinates: n }
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        3 * self.coordinates + self.parameters.len()
    }

    /// No entries yet.
    pub fn entries(&self) -> Entries {
        Entries::new(3 * self.coordinates)
    }

    /// Coordinates whose position or velocity the accelerations' rows can depend on, increasing.
    pub fn felt(&self) -> Vec<usize> {
        let n = self.coordinates;
        let variables = self.elements.iter().flat_map(|(variables, _)| variables.iter().map(|v| v.source));
        let states = variables.chain(self.constants[0].states.iter().map(|entry| entry.source as usize));
        let felt: BTreeSet<usize> = states.filter(|&source| source < 2 * n).map(|source| source % n).collect();
        felt.into_iter().collect()
    }

    /// Derivatives of M q̈ + Φ_qᵀ λ − f and Φ̈ at fixed accelerations and multipliers.
    pub fn accelerations(&self, mechanism: &Mechanism<f64>, state: &State<f64>, rooms: &mut Rooms, out: &mut Entries) {
        out.copy_from(&self.constants[0]);
        for (part, (variables, rows)) in mechanism.parts.iter().zip(&self.elements) {
            if part.closures > 0 {
                self.constraint(part, variables, rows, state, Closure::Accelerations, rooms, out);
            } else {
                balance(part, variables, rows, state, &mut rooms.plain, out);
            }
        }
    }

    /// Derivatives of both projections: of the position step, of the velocities' closures, of the velocity step.
    pub fn projections(
        &self,
        mechanism: &Mechanism<f64>,
        projected: &Projected,
        corrections: &State<f64>,
        rooms: &mut Rooms,
        out: &mut [Entries; 3],
    ) {
        let [_, positions, velocities] = &self.constants;
        let cases = [
            (&projected.before, Closure::Positions, Some(positions)),
            (&projected.after, Closure::Velocities, Some(velocities)),
            (corrections, Closure::Corrections, None),
        ];
        for (out, (state, closure, constants)) in out.iter_mut().zip(cases) {
            out.clear();
            constants.into_iter().for_each(|constants| out.copy_from(constants));
            for (part, (variables, rows)) in mechanism.parts.iter().zip(&self.elements) {
                if part.closures > 0 {
                    self.constraint(part, variables, rows, state, closure, rooms, out);
                }
            }
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn constraint(
        &self,
        part: &PartData<f64>,
        variables: &[Variable],
        rows: &[(usize, usize)],
        state: &State<f64>,
        closure: Closure,
        rooms: &mut Rooms,
        out: &mut Entries,
    ) {
        if variables.len() <= 4 {
            return self.constraint_chunk(part, variables, rows, state, closure, &mut rooms.short_jets, out);
        }
        for chunk in variables.chunks(WIDTH) {
            self.constraint_chunk(part, chunk, rows, state, closure, &mut rooms.jets, out);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn constraint_chunk<const N: usize>(
        &self,
        part: &PartData<f64>,
        chunk: &[Variable],
        rows: &[(usize, usize)],
        state: &State<f64>,
        closure: Closure,
        room: &mut Room<Jet<Tangent<N>>>,
        out: &mut Entries,
    ) where
        Jet<Tangent<N>>: Number,
    {
        if chunk.is_empty() {
            return;
        }
        let n = part.coordinates.len();
        let t = fill_jets(part, chunk, state, closure, room);
        Jet::<Tangent<N>>::residual(part.element.as_ref(), t, room);
        for &(local, row) in rows {
            if local < n {
                if closure != Closure::Velocities {
                    push(chunk, row, &room.balance[local].re.eps, out);
                }
                continue;
            }
            let value = &room.closure[local - n];
            match closure {
                Closure::Accelerations => push(chunk, row, &value.v2.eps, out),
                Closure::Velocities | Closure::Corrections => push(chunk, row, &value.v1.eps, out),
                Closure::Positions => push(chunk, row, &(value.re + value.v1).eps, out),
            }
            self.push_rates(chunk, row, value, closure, out);
        }
    }

    /// Derivatives of closure rows with respect to velocities and accelerations, from those to positions.
    fn push_rates<const N: usize>(
        &self,
        chunk: &[Variable],
        row: usize,
        value: &Jet<Tangent<N>>,
        closure: Closure,
        out: &mut Entries,
    ) {
        let n = self.coordinates;
        for (k, variable) in chunk.iter().enumerate().filter(|(_, variable)| variable.kind == Kind::Position) {
            match closure {
                Closure::Accelerations => {
                    out.push(row, variable.source + n, 2.0 * value.v1.eps[k]);
                    if self.moving.contains(&variable.source) {
                        out.push(row, variable.source + 2 * n, value.re.eps[k]);
                    }
                }
                Closure::Velocities => out.push(row, variable.source + n, value.re.eps[k]),
                Closure::Positions | Closure::Corrections => {}
            }
        }
    }
}

/// Adds the entries of a derivative that never changes.
fn add_constants(
    part: &PartData<f64>,
    coefficient: &Coefficient,
    rows: &[(usize, usize)],
    n: usize,
    moving: &[usize],
    [accelerations, positions, velocities]: &mut [Entries; 3],
) {
    let Some(&(_, row)) = rows.iter().find(|(local, _)| *local == coefficient.row) else { return };
    let (i, [stiffness, damping, mass]) = (part.coordinates[coefficient.coordinate], coefficient.values);
    let inertia = if part.closures > 0 { stiffness } else { mass };
    if moving.contains(&i) {
        accelerations.push(row, 2 * n + i, inertia);
    }
    if part.closures > 0 {
        positions.push(row, i, stiffness);
        velocities.push(row, n + i, stiffness);
    } else {
        accelerations.push(row, i, stiffness);
        accelerations.push(row, n + i, damping);
    }
}

#[inline]
fn push(chunk: &[Variable], row: usize, slopes: &[f64], out: &mut Entries) {
    for (variable, &value) in chunk.iter().zip(slopes) {
        out.push(row, variable.source, value);
    }
}

/// Puts a constraint's variables into `room`, moving as `closure` wants and seeded. Returns the time.
fn fill_jets<const N: usize>(
    part: &PartData<f64>,
    chunk: &[Variable],
    state: &State<f64>,
    closure: Closure,
    room: &mut Room<Jet<Tangent<N>>>,
) -> Jet<Tangent<N>>
where
    Jet<Tangent<N>>: Number,
{
    let (zero, number) = (Tangent::constant(0.0), Tangent::constant);
    let constant = |x: f64| Jet::new(number(x), zero, zero);
    room.p.clear();
    room.p.extend(part.parameters.iter().map(|&p| constant(p)));
    room.q.clear();
    room.q.extend(part.coordinates.iter().map(|&i| match closure {
        Closure::Accelerations => Jet::new(number(state.q[i]), number(state.v[i]), number(state.a[i])),
        Closure::Velocities => Jet::new(number(state.q[i]), number(state.v[i]), zero),
        Closure::Positions | Closure::Corrections => Jet::new(number(state.q[i]), number(state.a[i]), zero),
    }));
    for still in [&mut room.v, &mut room.a] {
        still.resize(part.coordinates.len(), constant(0.0)); // what is there already is zero as well
    }
    room.l.clear();
    let multipliers = &state.l[part.first_multiplier..part.first_multiplier + part.closures];
    room.l.extend(multipliers.iter().map(|&l| constant(l)));
    for (k, variable) in chunk.iter().enumerate() {
        match variable.kind {
            Kind::Parameter => room.p[variable.local].re.eps[k] = 1.0,
            _ => room.q[variable.local].re.eps[k] = 1.0,
        }
    }
    let moves = matches!(closure, Closure::Accelerations | Closure::Velocities);
    Jet::new(number(state.t), number(f64::from(u8::from(moves))), zero)
}

/// Derivatives of the rows of an element without closures.
fn balance(
    part: &PartData<f64>,
    variables: &[Variable],
    rows: &[(usize, usize)],
    state: &State<f64>,
    room: &mut Room<Sensitive>,
    out: &mut Entries,
) {
    for chunk in variables.chunks(WIDTH) {
        room.p.clear();
        room.p.extend(part.parameters.iter().map(|&p| Sensitive::constant(p)));
        for (to, from) in [(&mut room.q, &state.q), (&mut room.v, &state.v), (&mut room.a, &state.a)] {
            to.clear();
            to.extend(part.coordinates.iter().map(|&i| Sensitive::constant(from[i])));
        }
        for (k, variable) in chunk.iter().enumerate() {
            let values = match variable.kind {
                Kind::Position => &mut room.q,
                Kind::Velocity => &mut room.v,
                Kind::Acceleration => &mut room.a,
                Kind::Parameter => &mut room.p,
            };
            values[variable.local].eps[k] = 1.0;
        }
        Sensitive::residual(part.element.as_ref(), Sensitive::constant(state.t), room);
        for &(local, row) in rows {
            push(chunk, row, &room.balance[local].eps, out);
        }
    }
}
