//! Rigid contacts and switches of a mechanism, and the record of an event.

use crate::elements::contacts::rigid;
use crate::mechanism::element::{AnyElement, Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, ElementInstance, EventElement, Marker, Mechanism};
use crate::{Error, Result};
use autodiff::Scalar;
use std::sync::Arc;

/// An impact, or a zero crossing of a switch, during a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Name of the contact or switch.
    pub contact: String,
    /// Time in s.
    pub t: f64,
}

/// # Impacts
///
/// A rigid contact is an element with one constraint, the gap Φ(q, t) ≥ 0 in m or rad. When the gap closes, an impulse Λ
/// along Φ_q makes velocities jump, M (v⁺ − v⁻) + Φ_qᵀ Λ = 0. The new velocities satisfy the constraints of joints and of other
/// closed contacts; a closed contact whose impulse would pull is opened. The gap opens again by Newton's impact law,
/// Φ̇⁺ = −e Φ̇⁻. There is no friction. A contact stays closed if the next flight would be shorter than a millionth of a step, at
/// once if e = 0: Φ = 0 is then a joint, until its force −λ, an output of the contact, becomes zero. Contacts that close at the same
/// time are an error if the impulse of one changes the velocity of the other; use compliant ones ([`Mechanism::wall_contact`],
/// [`Mechanism::bump_stop`]).
///
/// # Sources
///
/// Pfeiffer & Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), Chapter 8.
impl<S: Scalar> Mechanism<S> {
    /// Adds a rigid contact whose gap is the constraint of the element `gap`, with a coefficient of restitution from 0 to 1.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the element does not have exactly one constraint.
    pub fn impact(
        &mut self,
        name: impl Into<String>,
        gap: impl Element,
        coordinates: &[Coordinate],
        parameters: &[S],
        restitution: S,
    ) -> Result<()> {
        let name = name.into();
        check_one_constraint(&name, "gap", &gap)?;
        self.add_event(name, Arc::new(gap), coordinates, parameters, Some(restitution));
        Ok(())
    }

    /// Adds a rigid stop between two coordinates: `b` − `a` does not fall below `clearance` (m or rad).
    pub fn rigid_stop(
        &mut self,
        name: &str,
        a: Coordinate,
        b: Coordinate,
        clearance: S,
        restitution: S,
    ) -> ElementIndex {
        self.add_event(name.into(), rigid::stop_gap(), &[a, b], &[clearance], Some(restitution))
            .expect("it has a restitution")
    }

    /// Adds a rigid wall: the line through point `a` at the angle `line` (rad) in the body of `a`. Point `b` stays on its left
    /// side, as seen along the line.
    pub fn rigid_wall(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>, restitution: S) -> ElementIndex {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        let parameters = [a.x, a.y, line, b.x, b.y];
        self.add_event(name.into(), rigid::wall_gap(), &coordinates, &parameters, Some(restitution))
            .expect("it has a restitution")
    }

    /// Adds a switch: a time step ends where the constraint of the element `of` crosses zero, in either direction.
    ///
    /// Add one for every force that jumps under this condition. The force is then integrated on both sides of the jump, and
    /// derivatives include the change of the time of the jump with the design. Without a switch they do not.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the element does not have exactly one constraint.
    pub fn switch(
        &mut self,
        name: impl Into<String>,
        of: impl Element,
        coordinates: &[Coordinate],
        parameters: &[S],
    ) -> Result<()> {
        let name = name.into();
        check_one_constraint(&name, "function", &of)?;
        self.add_event(name, Arc::new(of), coordinates, parameters, None);
        Ok(())
    }

    /// Adds a switch at the time `t` (s).
    pub fn switch_at(&mut self, name: &str, t: S) {
        self.add_event(name.into(), time_switch(), &[], &[t], None);
    }

    /// Adds a rigid contact with the coefficient of `restitution`, or a switch without one; `gap` has one constraint. Returns
    /// the joint that holds the contact closed.
    pub(crate) fn add_event(
        &mut self,
        name: String,
        gap: Arc<dyn AnyElement>,
        coordinates: &[Coordinate],
        parameters: &[S],
        restitution: Option<S>,
    ) -> Option<ElementIndex> {
        let joint = restitution.map(|_| self.add_object(name.clone(), gap.clone(), coordinates, parameters));
        let unilateral = joint.map(|joint| self.closed_contact(joint));
        let gap = ElementInstance::new(name, gap, coordinates, parameters, 0);
        self.events.push(EventElement { gap, restitution, when: None, unilateral });
        joint
    }
}

/// Checks that `element`, the `role` of the contact or switch `name`, has one constraint.
fn check_one_constraint(name: &str, role: &str, element: &impl Element) -> Result<()> {
    let count = Element::num_constraints(element);
    if count == 1 {
        return Ok(());
    }
    let remedy = "give an element of one constraint: a point on a line, a distance constraint";
    Err(Error::definition(name, format!("its {role} has {count} constraints"), remedy))
}

/// Φ = t − t₀; parameter t₀ in s.
struct TimeSwitch;

impl Element for TimeSwitch {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, _dynamics: &mut [T], constraint: &mut [T]) {
        constraint[0] = x.t - x.p[0];
    }

    fn num_constraints(&self) -> usize {
        1
    }
}

/// The element of a switch in time as a trait object.
#[inline(never)]
fn time_switch() -> Arc<dyn AnyElement> {
    Arc::new(TimeSwitch)
}
