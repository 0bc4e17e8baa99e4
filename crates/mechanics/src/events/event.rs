//! Rigid contacts and switches of a mechanism.

use crate::elements::drives::driver::Driver;
use crate::elements::joints::point_on_line::PointOnLine;
use crate::mechanism::element::{Element, ElementState};
use crate::mechanism::{Coordinate, Marker, Mechanism};
use crate::motion::Fixed;
use crate::{Error, Result};
use autodiff::Scalar;
use std::sync::Arc;

/// # Impacts
///
/// A contact is a constraint of one closure, the gap Φ(q, t) ≥ 0 in m or rad. When it closes, velocities jump so that
/// it opens again with Newton's law, Φ̇⁺ = −e Φ̇⁻, by an impulse Λ along Φ_q while all joints hold:
/// M (v⁺ − v⁻) + Φ_qᵀ Λ = 0. Contacts are without friction. What lasts is for compliant contacts
/// ([`Mechanism::wall_contact`], [`Mechanism::stop`]).
///
/// **Source.** Pfeiffer & Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), Chapter 8.
impl<S: Scalar> Mechanism<S> {
    /// A contact whose gap is the closure of the constraint `gap`, with the coefficient of restitution from 0 to 1.
    ///
    /// **Errors.** [`Error::Definition`] if the constraint has not just one closure.
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
            let why = format!("its gap has {num_constraints} closures");
            return Err(Error::definition(name, why, "give a constraint of one closure: a pin in a slot, a rod"));
        }
        self.add_event(name, Arc::new(gap), coordinates, parameters, Some(restitution));
        Ok(())
    }

    /// A rigid stop between two coordinates: `b` − `a` does not fall below `clearance` (m or rad).
    pub fn rigid_stop(&mut self, name: &str, a: Coordinate, b: Coordinate, clearance: S, restitution: S) {
        self.add_event(name.into(), Arc::new(Driver(Fixed)), &[a, b], &[clearance], Some(restitution));
    }

    /// A rigid wall: the line through point `a` at the angle `line` (rad) in the body of `a`. Point `b` stays to the left of
    /// it, as seen along the line.
    pub fn rigid_wall(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>, restitution: S) {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        let parameters = [a.x, a.y, line, b.x, b.y];
        self.add_event(name.into(), Arc::new(PointOnLine), &coordinates, &parameters, Some(restitution));
    }

    /// A switch: where the closure of the constraint `of` passes zero, either way, a time step ends and the next one begins.
    ///
    /// What jumps there, a force that an element or a law switches by the same condition, is then integrated on either side
    /// of the jump, and derivatives know that the instant moves with the design. Without a switch they would not: a step
    /// across a jump has no derivative that tells.
    ///
    /// **Errors.** [`Error::Definition`] if the constraint has not just one closure.
    pub fn switch(
        &mut self,
        name: impl Into<String>,
        of: impl Element,
        coordinates: &[Coordinate],
        parameters: &[S],
    ) -> Result<()> {
        let (name, num_constraints) = (name.into(), Element::num_constraints(&of));
        if num_constraints != 1 {
            let why = format!("what it looks at has {num_constraints} closures");
            return Err(Error::definition(name, why, "give a constraint of one closure: a pin in a slot, a rod"));
        }
        self.add_event(name, Arc::new(of), coordinates, parameters, None);
        Ok(())
    }

    /// A switch at the time `t` (s).
    pub fn switch_at(&mut self, name: &str, t: S) {
        self.add_event(name.into(), Arc::new(Clock), &[], &[t], None);
    }
}

/// Φ = t − t₀; parameter t₀ in s.
struct Clock;

impl Element for Clock {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, _balance: &mut [T], constraint: &mut [T]) {
        constraint[0] = x.t - x.p[0];
    }

    fn num_constraints(&self) -> usize {
        1
    }
}
