//! Sparse derivatives of the equations, and their products with the derivatives of states.

use crate::linalg::simd::{Gradient, Kernel, dispatch, subtract};

/// A derivative of one row of the equations with respect to one source.
///
/// Sources are the arguments of the equations: positions of all n coordinates, velocities, accelerations and active
/// parameters, numbered in this order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triplet {
    pub row: u32,
    pub source: u32,
    pub value: f64,
}

/// Derivatives of rows with respect to the state and, separately, with respect to parameters.
///
/// They are separate because most design variables change few parameters.
#[derive(Clone, Debug)]
pub(crate) struct Entries {
    pub states: Vec<Triplet>,
    pub parameters: Vec<Triplet>,
    first_parameter: usize,
}

impl Entries {
    /// No entries; sources from `first_parameter` on are parameters.
    pub fn new(first_parameter: usize) -> Self {
        Self { states: Vec::new(), parameters: Vec::new(), first_parameter }
    }

    /// Removes all entries.
    pub fn clear(&mut self) {
        self.states.clear();
        self.parameters.clear();
    }

    /// Copies the entries of `other` into the existing storage.
    pub fn copy_from(&mut self, other: &Self) {
        self.states.clone_from(&other.states);
        self.parameters.clone_from(&other.parameters);
    }

    /// Adds an entry, unless it is zero.
    #[inline]
    pub fn push(&mut self, row: usize, source: usize, value: f64) {
        if value != 0.0 {
            let list = if source < self.first_parameter { &mut self.states } else { &mut self.parameters };
            list.push(Triplet { row: row as u32, source: source as u32, value });
        }
    }

    /// rows −= entries · sources; parameters that are not `active` have no derivatives.
    pub fn subtract<const W: usize>(&self, sources: &[Gradient<W>], active: &[bool], rows: &mut [Gradient<W>]) {
        dispatch(EntriesProduct { entries: self, sources, active, rows });
    }

    /// sources += entriesᵀ · rows.
    pub fn vjp<const W: usize>(&self, rows: &[Gradient<W>], sources: &mut [Gradient<W>]) {
        for entry in self.states.iter().chain(&self.parameters) {
            subtract(&mut sources[entry.source as usize], -entry.value, &rows[entry.row as usize]);
        }
    }
}

/// rows −= entries · sources.
struct EntriesProduct<'a, const W: usize> {
    entries: &'a Entries,
    sources: &'a [Gradient<W>],
    active: &'a [bool],
    rows: &'a mut [Gradient<W>],
}

impl<const W: usize> Kernel for EntriesProduct<'_, W> {
    #[inline(always)]
    fn run(self) {
        let Self { entries, sources, active, rows } = self;
        for run in entries.states.chunk_by(|a, b| a.row == b.row) {
            let mut row = rows[run[0].row as usize];
            for entry in run {
                subtract(&mut row, entry.value, &sources[entry.source as usize]);
            }
            rows[run[0].row as usize] = row;
        }
        for entry in &entries.parameters {
            let source = entry.source as usize;
            if active[source - entries.first_parameter] {
                let mut row = rows[entry.row as usize];
                subtract(&mut row, entry.value, &sources[source]);
                rows[entry.row as usize] = row;
            }
        }
    }
}
