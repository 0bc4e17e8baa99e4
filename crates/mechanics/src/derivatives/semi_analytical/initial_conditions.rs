//! Semi-analytical derivatives of assembled positions, consistent velocities and accelerations, and equilibria.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration};
use crate::derivatives::forward::initial_conditions::{
    ProjectedPart, factorize_accelerations, factorize_initial_equilibrium,
};
use crate::derivatives::semi_analytical::central_difference::CentralDifference;
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::{Projection, acceleration_rows};
use crate::initial_velocities::{VelocityMatrix, VelocityProjection, sticking_coordinates};
use crate::mechanism::Mechanism;
use crate::system::state::State;
use crate::system::{System, Unknown};

/// Differentiates consistent states with respect to all design variables.
///
/// Each problem has one matrix, which all variables share, and a residual, which is differenced for each of them.
pub(crate) struct InitialDifferences<'s> {
    pub plain: &'s Mechanism<f64>,
    pub system: &'s mut System,
}

/// Number of differences for each problem: the first one is taken along a direction that violates the linearized
/// equations, and corrected by the second one.
const PASSES: usize = 2;

/// Role of the coordinates from which a problem is solved.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Guess {
    /// The solution x is the nearest one: the equations have the term W (x − guess), with the weights of this projection.
    Nearest(ProjectedPart),
    /// The solution does not depend on them.
    None,
}

/// Right-hand sides for one design variable.
type RightHandSides = Vec<[f64; 1]>;

impl InitialDifferences<'_> {
    /// Derivatives of the initial state `values` of a motion.
    pub fn start(
        &mut self,
        differences: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        settings: &Dynamics,
    ) -> Result<Vec<State<f64>>> {
        let mut sensitivities = match settings.initial_configuration {
            InitialConfiguration::Built => self.consistent(differences, values, projection)?,
            InitialConfiguration::Equilibrium(_) => {
                let rest = factorize_initial_equilibrium(self.system, self.plain, values, projection)?;
                let positions = self.equilibrium(differences, &rest);
                let mut sensitivities = built(differences, values.t);
                sensitivities.iter_mut().zip(positions).for_each(|(sensitivity, rest)| sensitivity.q = rest.q);
                if self.plain.multipliers > 0 {
                    self.velocities(differences, values, projection, &mut sensitivities)?;
                }
                sensitivities
            }
        };
        if settings.initial_acceleration == InitialAcceleration::Consistent {
            self.accelerations(differences, values, &mut sensitivities)?;
        }
        Ok(sensitivities)
    }

    /// Derivatives of assembled positions and consistent velocities.
    pub fn consistent(
        &mut self,
        differences: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
    ) -> Result<Vec<State<f64>>> {
        let mut sensitivities = built(differences, values.t);
        if self.plain.multipliers > 0 {
            self.project(ProjectedPart::Positions, differences, values, projection, &mut sensitivities)?;
            self.velocities(differences, values, projection, &mut sensitivities)?;
        }
        Ok(sensitivities)
    }

    /// Differentiates the consistent velocities in `values`, from the given ones in `sensitivities`.
    fn velocities(
        &mut self,
        differences: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        sensitivities: &mut [State<f64>],
    ) -> Result<()> {
        self.given_velocities(differences, values, projection, sensitivities)?;
        let held = sticking_coordinates(self.plain, &values.modes);
        if held.is_empty() {
            return Ok(());
        }
        let matrix = VelocityMatrix::new(self.system, self.plain, values, &held)?;
        let mut changes: RightHandSides = vec![[0.0]; self.system.size()];
        for sensitivity in sensitivities {
            let rates: RightHandSides = held.iter().map(|&i| [sensitivity.v[i]]).collect();
            matrix.stopping_change(&rates, &mut changes);
            for ([change], unknown) in changes.iter().zip(self.system.unknowns()) {
                if let Unknown::Coordinate(i) = *unknown {
                    sensitivity.v[i] += change;
                }
            }
        }
        Ok(())
    }

    /// Differentiates the velocities that satisfy the constraints, without friction.
    fn given_velocities(
        &mut self,
        differences: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        sensitivities: &mut [State<f64>],
    ) -> Result<()> {
        if !projection.nearest_velocity.is_empty() {
            return self.project(ProjectedPart::Velocities, differences, values, projection, sensitivities);
        }
        let velocity = &projection.velocity;
        let VelocityProjection { multipliers, held, .. } = velocity;
        let at = State { l: multipliers.clone(), ..values.clone() };
        let matrix = VelocityMatrix::new(self.system, self.plain, values, held)?;
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::default());
        let size = self.system.size();
        for (difference, sensitivity) in differences.iter_mut().zip(sensitivities) {
            let given: Vec<f64> = held.iter().map(|&i| sensitivity.v[i]).collect();
            let mut impulses = vec![0.0; held.len()];
            self.fix_unknowns(&mut sensitivity.v);
            for _ in 0..PASSES {
                let derivatives = difference.derivatives(&at, sensitivity, |mechanism, state, rows| {
                    rows.resize(size, 0.0);
                    self.system.constraint_rows(mechanism, state, &mut workspace, rows);
                    self.system.constraint_rates(mechanism, state, 1, &mut jets, rows);
                    let deviations = velocity.deviations(mechanism, &state.v);
                    matrix.add_momenta(self.system, mechanism, (state, &deviations), &mut jets, rows);
                });
                let mut rows: RightHandSides = derivatives.map(|derivative| [-derivative]).collect();
                for (&i, p) in held.iter().zip(&impulses) {
                    if let Some(equation) = self.system.equation_of(i) {
                        rows[equation][0] += p;
                    }
                }
                let mut changes: RightHandSides =
                    held.iter().zip(&given).map(|(&i, g)| [g - sensitivity.v[i]]).collect();
                matrix.solve(self.system, &mut rows, &mut changes);
                for (row, unknown) in rows.iter().zip(self.system.unknowns()) {
                    match *unknown {
                        Unknown::Coordinate(i) => sensitivity.v[i] += row[0],
                        Unknown::Multiplier(m) => sensitivity.l[m] += row[0],
                    }
                }
                impulses.iter_mut().zip(changes).for_each(|(p, [change])| *p += change);
            }
            sensitivity.l.fill(0.0);
        }
        Ok(())
    }

    /// Differentiates a projection onto the constraints, from the guesses in `sensitivities`.
    pub fn project(
        &mut self,
        part: ProjectedPart,
        differences: &mut [CentralDifference],
        values: &State<f64>,
        projection: &Projection,
        sensitivities: &mut [State<f64>],
    ) -> Result<()> {
        let at = State { l: part.multipliers(projection).to_vec(), ..values.clone() };
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::default());
        let residual = |system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, rows: &mut [f64]| {
            system.constraint_rows(mechanism, state, &mut workspace, rows);
            if part == ProjectedPart::Velocities {
                system.constraint_rates(mechanism, state, 1, &mut jets, rows);
            }
        };
        part.factorize(self.system, self.plain, values, projection)?;
        self.solve(differences, &at, sensitivities, |state| part.of(state), Guess::Nearest(part), residual);
        // The multipliers of the projection are not those of the motion.
        sensitivities.iter_mut().for_each(|sensitivity| sensitivity.l.fill(0.0));
        Ok(())
    }

    /// Derivatives of the accelerations and multipliers of `values`: M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    pub fn accelerations(
        &mut self,
        differences: &mut [CentralDifference],
        values: &State<f64>,
        sensitivities: &mut [State<f64>],
    ) -> Result<()> {
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::default());
        let residual = |system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, rows: &mut [f64]| {
            acceleration_rows(system, mechanism, state, &mut workspace, &mut jets, rows);
        };
        factorize_accelerations(self.system, self.plain, values)?;
        self.solve(differences, values, sensitivities, |state| &mut state.a, Guess::None, residual);
        Ok(())
    }

    /// Derivatives of the equilibrium `values`, with the factorization that found it.
    pub fn equilibrium(&mut self, differences: &mut [CentralDifference], values: &State<f64>) -> Vec<State<f64>> {
        let mut workspace = ElementWorkspace::default();
        let mut sensitivities = built(differences, values.t);
        sensitivities.iter_mut().for_each(|sensitivity| self.clear_guess(sensitivity));
        let residual = |system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, rows: &mut [f64]| {
            system.residual(mechanism, state, 1.0, &mut workspace, rows);
        };
        self.solve(differences, values, &mut sensitivities, |state| &mut state.q, Guess::None, residual);
        sensitivities
    }

    /// Clears the derivatives of the initial guess, on which an equilibrium does not depend.
    fn clear_guess(&self, sensitivity: &mut State<f64>) {
        sensitivity.v.fill(0.0);
        sensitivity.a.fill(0.0);
        self.fix_unknowns(&mut sensitivity.q);
    }

    /// Solves for the derivatives of the unknowns, with the factor of the system: the coordinates of `which` and the
    /// multipliers, whose derivatives must be zero before.
    fn solve(
        &mut self,
        differences: &mut [CentralDifference],
        at: &State<f64>,
        sensitivities: &mut [State<f64>],
        which: impl Fn(&mut State<f64>) -> &mut Vec<f64>,
        role: Guess,
        mut residual: impl FnMut(&System, &Mechanism<f64>, &State<f64>, &mut [f64]),
    ) {
        let (size, mut rows) = (self.system.size(), RightHandSides::new());
        for (difference, sensitivity) in differences.iter_mut().zip(sensitivities) {
            let guess = which(sensitivity).clone();
            for pass in 0..PASSES {
                if pass == 0 {
                    self.fix_unknowns(which(sensitivity));
                }
                let derivatives = difference.derivatives(at, sensitivity, |mechanism, state, rows| {
                    rows.resize(size, 0.0);
                    residual(self.system, mechanism, state, rows);
                });
                rows.clear();
                rows.extend(derivatives.map(|derivative| [derivative]));
                if let Guess::Nearest(part) = role {
                    let solution = which(sensitivity);
                    for (row, unknown) in rows.iter_mut().zip(self.system.unknowns()) {
                        if let Unknown::Coordinate(i) = *unknown {
                            row[0] += (solution[i] - guess[i]) * part.weight(self.plain, &at.modes, i);
                        }
                    }
                }
                self.system.factor().solve(&mut rows);
                for (row, unknown) in rows.iter().zip(self.system.unknowns()) {
                    match *unknown {
                        Unknown::Coordinate(i) => which(sensitivity)[i] -= row[0],
                        Unknown::Multiplier(m) => sensitivity.l[m] -= row[0],
                    }
                }
            }
        }
    }

    /// Sets the derivatives of the unknown coordinates to zero.
    fn fix_unknowns(&self, derivatives: &mut [f64]) {
        for unknown in self.system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                derivatives[i] = 0.0;
            }
        }
    }
}

/// Derivatives of the state in which the mechanism is built, prescribed coordinates at the time `t`.
fn built(differences: &[CentralDifference], t: f64) -> Vec<State<f64>> {
    differences.iter().map(|difference| difference.built(t)).collect()
}
