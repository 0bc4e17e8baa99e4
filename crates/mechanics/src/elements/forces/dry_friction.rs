//! Dry friction between two coordinates, which slides or sticks.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Coordinate, ElementIndex, ElementInstance, EventElement, Mechanism, Unilateral};
use crate::{as_object, element_inputs};
use autodiff::Scalar;
use std::sync::Arc;

/// Coulomb friction between two coordinates that sticks: a force F + c |v| against the sliding velocity v = q̇_B − q̇_A, and a joint
/// v = 0 as long as its force stays below the static limit F_s = ratio · F.
///
/// The joint keeps the place where it sticks. An auxiliary coordinate s follows q_B − q_A and stores it:
///
/// $$ \Phi = q_B - q_A - s = 0 ,\qquad \lambda = \begin{cases} \pm F + c\,\dot s & \text{sliding} \\
///    \text{such that } \ddot s = 0 & \text{sticking} \end{cases} $$
///
/// λ in N or N·m is the force of B on A. The mode changes at events, which end the time steps: where v becomes zero, and where |λ|
/// reaches F_s. Derivatives are those between the events, and include those of the times of the events. They do not exist in designs
/// in which an event only just happens, such as a force that touches the limit.
///
/// Friction without sticking, smooth through zero, is [`Friction`](super::Friction). It creeps under load.
///
/// # Sources
/// Leine & Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical Systems* (2004), Section 5.3; Karnopp, *J. Dyn. Syst.
/// Meas. Control* 107 (1985) 100–103.
#[derive(Clone, Copy, Debug)]
pub struct DryFriction;

as_object!(DryFriction);

element_inputs!(DryFrictionInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    coulomb_force: required("N or N·m", 1.5, "force or torque while it slides"),
    static_ratio: optional("1", "", 1.2, "largest force while it sticks, as a multiple of coulomb_force, at least 1"),
    viscous: optional("0", "N·s/m or N·m·s/rad", 0.5, "viscous coefficient while it slides"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "dry-friction",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("generalized_force", "N or N·m", "force or torque on b, positive against increasing b − a"),
        Measure::new("power", "W", "power that becomes heat"),
    ],
    about: "Coulomb friction between a and b that sticks",
    law: "sliding: generalized_force = coulomb_force·sign(v) + viscous·v with v = ḃ − ȧ; sticking: v = 0 as long as \
          |generalized_force| ≤ static_ratio·coulomb_force; it acts on b against v, and its opposite on a",
    symbol: Symbol::None,
};

/// Local numbers of the coordinates.
const A: usize = 0;
const B: usize = 1;
const SLIDING: usize = 2;

impl Element for DryFriction {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        constraint[0] = x.q[B] - x.q[A] - x.q[SLIDING];
        (dynamics[A], dynamics[B], dynamics[SLIDING]) = (-x.l[0], x.l[0], -x.l[0]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[A, B, SLIDING]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (x.l[0], x.l[0] * (x.v[B] - x.v[A]));
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = DryFrictionInputs(p);
        let flaws = [
            (p.coulomb_force() > 0.0, "Coulomb force", p.coulomb_force()),
            (p.static_ratio() >= 1.0, "ratio of the static to the Coulomb force", p.static_ratio()),
            (p.viscous() >= 0.0, "viscous coefficient", p.viscous()),
        ];
        flaws.into_iter().find(|(is_right, ..)| !is_right).map(|(_, what, value)| format!("its {what} is {value}"))
    }
}

/// The force on s while friction slides in one direction: ± F + c ṡ; parameters F, c.
struct SlidingForce(f64);

impl Element for SlidingForce {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] += x.p[0] * self.0 + x.p[1] * x.v[0];
    }
}

/// The row of s while friction sticks, s̈ = 0: it takes the place of the force, which it reads from the multiplier.
struct Sticking;

impl Element for Sticking {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[SLIDING] += x.a[SLIDING] + x.l[0];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds dry friction between `a` and `b` that sticks: force or torque while it slides, ratio of the static limit to it, viscous
    /// coefficient.
    pub fn dry_friction(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 3]) -> ElementIndex {
        let [force, static_ratio, viscous] = parameters;
        let difference = |x: &ElementState<'_, autodiff::Jet2<S>>| x.q[1] - x.q[0];
        let sliding = self.dependent_coordinate(&format!("{name}.sliding"), &[a, b], &[], difference);
        self.coordinates[sliding.0].is_follower = true;
        let multiplier = self.multipliers;
        let joint = self.add_object(name.into(), DryFriction::object(), &[a, b, sliding], &parameters);
        let [forward, backward] = [1.0, -1.0].map(|direction| {
            let force = self.add(name, SlidingForce(direction), &[sliding], &[force, viscous]);
            self.add_switch(force.0, false)
        });
        let on_joint = ElementInstance::new(name.into(), Arc::new(Sticking), &[a, b, sliding], &parameters, multiplier);
        self.elements.push(ElementInstance { num_reactions: 1, ..on_joint });
        let sticking = self.add_switch(self.elements.len() - 1, true);
        self.coordinates[sliding.0].holding = Some(sticking);
        let resting = self.add_mode();
        let unilateral = Unilateral::Friction { joint: joint.0, multiplier, forward, backward, sticking, resting };
        let gap = ElementInstance::new(name.into(), Arc::new(Margin), &[a, b], &[force * static_ratio], 0);
        self.events.push(EventElement { gap, restitution: None, when: None, unilateral: Some(unilateral) });
        joint
    }
}

/// Takes the place of the gap in the event of dry friction; its parameter is the static limit.
struct Margin;

impl Element for Margin {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _dynamics: &mut [T], _constraint: &mut [T]) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, moving, rows};

    #[test]
    fn friction_acts_against_sliding_and_its_opposite_on_the_other_side() {
        let x = moving(&[1.5, 1.2, 0.0], &[0.2, 0.7, 0.5], &[0.0, 2.0, 2.0], &[1.5]);
        let (dynamics, constraint) = rows(&DryFriction, &x);
        close(&dynamics, &[-1.5, 1.5, -1.5]);
        close(&constraint, &[0.0]);
        close(&measured(&DryFriction, &x), &[1.5, 3.0]);
        assert!(DryFriction.validate_parameters(&[1.5, 0.9, 0.0]).unwrap().contains("ratio"));
    }
}
