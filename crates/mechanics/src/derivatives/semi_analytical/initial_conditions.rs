//! Slopes of assembled positions, consistent velocities and accelerations, and of equilibria.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration};
use crate::derivatives::forward::initial_conditions::at_rest;
use crate::derivatives::semi_analytical::central_difference::CentralDifference;
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::{Projection, acceleration_rows};
use crate::mechanism::Mechanism;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};

/// Differentiates one state for all design variables: each of its problems has a matrix, which all share, and a residual,
/// which is differenced for each.
pub(crate) struct Starter<'s> {
    pub plain: &'s Mechanism<f64>,
    pub system: &'s mut System,
}

/// Which entries of a state are the unknowns of a problem.
type Which = fn(&mut State<f64>) -> &mut Vec<f64>;

impl Starter<'_> {
    /// Slopes of the state `values` at the start of a motion.
    pub fn start(
        &mut self,
        besides: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        settings: &Dynamics,
    ) -> Result<Vec<State<f64>>> {
        let mut slopes = match settings.origin {
            InitialConfiguration::Built => self.built(besides, values, projection)?,
            InitialConfiguration::Equilibrium(_) => self.settled(besides, values, projection)?,
        };
        if settings.initial == InitialAcceleration::Consistent {
            self.accelerations(besides, values, &mut slopes)?;
        }
        Ok(slopes)
    }

    /// Slopes of assembled positions and consistent velocities.
    pub fn built(
        &mut self,
        besides: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
    ) -> Result<Vec<State<f64>>> {
        let mut slopes: Vec<_> = besides.iter().map(|beside| beside.built(values.t)).collect();
        if self.plain.multipliers > 0 {
            self.positions(besides, values, projection, &mut slopes)?;
            self.velocities(besides, values, projection, &mut slopes)?;
        }
        Ok(slopes)
    }

    /// Slopes of positions in equilibrium and consistent velocities.
    fn settled(
        &mut self,
        besides: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
    ) -> Result<Vec<State<f64>>> {
        let rest = at_rest(values, projection);
        self.system.assemble(self.plain, &rest, Linearization::statics(), &mut vec![[0.0]; self.system.size()]);
        self.system.factorize(self.plain, rest.t)?;
        let positions = self.equilibrium(besides, &rest);
        let mut slopes: Vec<_> = besides.iter().map(|beside| beside.built(values.t)).collect();
        slopes.iter_mut().zip(positions).for_each(|(slopes, rest)| slopes.q = rest.q);
        if self.plain.multipliers > 0 {
            self.velocities(besides, values, projection, &mut slopes)?;
        }
        Ok(slopes)
    }

    /// q − q_guess + Φ_qᵀ μ = 0, Φ = 0.
    fn positions(
        &mut self,
        besides: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        slopes: &mut [State<f64>],
    ) -> Result<()> {
        let at = with_multipliers(values, &projection.position);
        let mut workspace = ElementWorkspace::default();
        let mut rows = self.rows(
            besides,
            &at,
            slopes,
            |state| &mut state.q,
            |system, mechanism, state, rows| {
                system.constraint_rows(mechanism, state, &mut workspace, rows);
            },
        );
        self.solve(&at, Linearization::projection(), &mut rows)?;
        self.enter(&rows, slopes, |state| &mut state.q);
        Ok(())
    }

    /// v − v_guess + Φ_qᵀ μ = 0, Φ̇ = 0.
    fn velocities(
        &mut self,
        besides: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        slopes: &mut [State<f64>],
    ) -> Result<()> {
        let at = with_multipliers(values, &projection.velocity);
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::default());
        let mut rows = self.rows(
            besides,
            &at,
            slopes,
            |state| &mut state.v,
            |system, mechanism, state, rows| {
                system.constraint_rows(mechanism, state, &mut workspace, rows);
                system.closure_rates(mechanism, state, 1, &mut jets, rows);
            },
        );
        // Φ̇ is linear in v: its matrix is Φ_q, the rest is the identity.
        self.solve(&without_multipliers(values), Linearization::projection(), &mut rows)?;
        self.enter(&rows, slopes, |state| &mut state.v);
        Ok(())
    }

    /// M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    pub fn accelerations(
        &mut self,
        besides: &mut [CentralDifference],
        values: &State<f64>,
        slopes: &mut [State<f64>],
    ) -> Result<()> {
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::default());
        // Accelerations are built without a guess: their slopes are those of the solution alone.
        let mut rows = self.rows(
            besides,
            values,
            slopes,
            |state| &mut state.a,
            |system, mechanism, state, rows| {
                acceleration_rows(system, mechanism, state, &mut workspace, &mut jets, rows);
            },
        );
        self.solve(&without_multipliers(values), Linearization::accelerations(), &mut rows)?;
        self.enter(&rows, slopes, |state| &mut state.a);
        self.enter_multipliers(&rows, slopes);
        Ok(())
    }

    /// Slopes of the equilibrium `values`, with the factorization that found it.
    pub fn equilibrium(&mut self, besides: &mut [CentralDifference], values: &State<f64>) -> Vec<State<f64>> {
        let mut workspace = ElementWorkspace::default();
        let mut slopes: Vec<_> = besides.iter().map(|beside| self.at_rest(beside.built(values.t))).collect();
        let mut rows = self.rows(
            besides,
            values,
            &mut slopes,
            |state| &mut state.q,
            |system, mechanism, state, rows| {
                system.residual(mechanism, state, 1.0, &mut workspace, rows);
            },
        );
        rows.iter_mut().for_each(|rows| self.system.factor().solve(rows));
        self.enter(&rows, &mut slopes, |state| &mut state.q);
        self.enter_multipliers(&rows, &mut slopes);
        slopes
    }

    /// An equilibrium does not remember from where it was sought.
    fn at_rest(&self, mut slopes: State<f64>) -> State<f64> {
        slopes.v.fill(0.0);
        slopes.a.fill(0.0);
        for unknown in self.system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                slopes.q[i] = 0.0;
            }
        }
        slopes
    }

    /// The derivatives of the residual at unknowns that stand still, less the slope of the guess from which they are
    /// nearest: right-hand sides with the sign turned round.
    fn rows(
        &self,
        besides: &mut [CentralDifference],
        at: &State<f64>,
        slopes: &mut [State<f64>],
        which: Which,
        mut residual: impl FnMut(&System, &Mechanism<f64>, &State<f64>, &mut [f64]),
    ) -> Vec<Vec<[f64; 1]>> {
        let size = self.system.size();
        let one = |(beside, slopes): (&mut CentralDifference, &mut State<f64>)| {
            let guess = std::mem::take(which(slopes));
            let held = |(i, &slope): (usize, &f64)| if self.system.equation_of(i).is_some() { 0.0 } else { slope };
            *which(slopes) = guess.iter().enumerate().map(held).collect();
            let slope = beside.slope(at, slopes, |mechanism, state, rows| {
                rows.resize(size, 0.0);
                residual(self.system, mechanism, state, rows);
            });
            let less_guess = |(slope, unknown): (f64, &Unknown)| match *unknown {
                Unknown::Coordinate(i) => [slope - guess[i]],
                Unknown::Multiplier(_) => [slope],
            };
            slope.zip(self.system.unknowns()).map(less_guess).collect()
        };
        besides.iter_mut().zip(slopes).map(one).collect()
    }

    fn solve(&mut self, at: &State<f64>, how: Linearization, rows: &mut [Vec<[f64; 1]>]) -> Result<()> {
        self.system.assemble(self.plain, at, how, &mut vec![[0.0]; self.system.size()]);
        self.system.factorize(self.plain, at.t)?;
        rows.iter_mut().for_each(|rows| self.system.factor().solve(rows));
        Ok(())
    }

    fn enter(&self, rows: &[Vec<[f64; 1]>], slopes: &mut [State<f64>], which: Which) {
        for (rows, slopes) in rows.iter().zip(slopes) {
            for (row, unknown) in rows.iter().zip(self.system.unknowns()) {
                if let Unknown::Coordinate(i) = *unknown {
                    which(slopes)[i] = -row[0];
                }
            }
        }
    }

    fn enter_multipliers(&self, rows: &[Vec<[f64; 1]>], slopes: &mut [State<f64>]) {
        for (rows, slopes) in rows.iter().zip(slopes) {
            for (m, slope) in slopes.l.iter_mut().enumerate() {
                *slope = -rows[self.system.equation_of_multiplier(m)][0];
            }
        }
    }
}

fn with_multipliers(values: &State<f64>, multipliers: &[f64]) -> State<f64> {
    State { l: multipliers.to_vec(), ..values.clone() }
}

fn without_multipliers(values: &State<f64>) -> State<f64> {
    State { l: vec![0.0; values.l.len()], ..values.clone() }
}
