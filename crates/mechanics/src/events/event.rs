//! Rigid contacts and switches of a mechanism, and the record of an event.

use crate::elements::contacts::rigid_stop;
use crate::elements::joints::point_on_line::PointOnLine;
use crate::mechanism::element::{AnyElement, Element, ElementState};
use crate::mechanism::{Coordinate, Marker, Mechanism};
use crate::{Error, Result};
use autodiff::Scalar;
use std::sync::Arc;

/// An impact during a motion, or the passage of a switch.
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
/// along Φ_q makes velocities jump, M (v⁺ − v⁻) + Φ_qᵀ Λ = 0, and joints hold. The gap opens again by Newton's impact law,
/// Φ̇⁺ = −e Φ̇⁻. There is no friction. For contacts that last, take compliant ones ([`Mechanism::wall_contact`],
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
        let (name, num_constraints) = (name.into(), Element::num_constraints(&gap));
        if num_constraints != 1 {
            let why = format!("its gap has {num_constraints} constraints");
            return Err(Error::definition(
                name,
                why,
                "give an element of one constraint: a point on a line, a distance constraint",
            ));
        }
        self.add_event(name, Arc::new(gap), coordinates, parameters, Some(restitution));
        Ok(())
    }

    /// Adds a rigid stop between two coordinates: `b` − `a` does not fall below `clearance` (m or rad).
    pub fn rigid_stop(&mut self, name: &str, a: Coordinate, b: Coordinate, clearance: S, restitution: S) {
        self.add_event(name.into(), rigid_stop::gap(), &[a, b], &[clearance], Some(restitution));
    }

    /// Adds a rigid wall: the line through point `a` at the angle `line` (rad) in the body of `a`. Point `b` stays on its left
    /// side, as seen along the line.
    pub fn rigid_wall(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>, restitution: S) {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        let parameters = [a.x, a.y, line, b.x, b.y];
        self.add_event(name.into(), PointOnLine::object(), &coordinates, &parameters, Some(restitution));
    }

    /// Adds a switch: a time step ends where the constraint of the element `of` passes zero, in either direction.
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
        let (name, num_constraints) = (name.into(), Element::num_constraints(&of));
        if num_constraints != 1 {
            let why = format!("its function has {num_constraints} constraints");
            return Err(Error::definition(
                name,
                why,
                "give an element of one constraint: a point on a line, a distance constraint",
            ));
        }
        self.add_event(name, Arc::new(of), coordinates, parameters, None);
        Ok(())
    }

    /// Adds a switch at the time `t` (s).
    pub fn switch_at(&mut self, name: &str, t: S) {
        self.add_event(name.into(), clock(), &[], &[t], None);
    }
}

/// Φ = t − t₀; parameter t₀ in s.
struct Clock;

impl Element for Clock {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, _dynamics: &mut [T], constraint: &mut [T]) {
        constraint[0] = x.t - x.p[0];
    }

    fn num_constraints(&self) -> usize {
        1
    }
}

/// The time of a switch as an object.
#[inline(never)]
fn clock() -> Arc<dyn AnyElement> {
    Arc::new(Clock)
}
