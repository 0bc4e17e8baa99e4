//! Rigid contacts that a mechanism bounces off.

use super::element::Element;
use super::elements::{Driver, PointOnLine};
use super::mechanism::{Coordinate, Marker, Mechanism, PartData};
use super::motion::Fixed;
use crate::scalar::Scalar;
use crate::{Error, Result};
use std::sync::Arc;

/// A contact that is open as long as its gap is positive.
pub(crate) struct ImpactData<S> {
    /// The constraint whose one closure is the gap; its multiplier is the impulse.
    pub part: PartData<S>,
    /// Coefficient of restitution.
    pub restitution: S,
}

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
        let (name, closures) = (name.into(), Element::closures(&gap));
        if closures != 1 {
            let why = format!("its gap has {closures} closures");
            return Err(Error::definition(name, why, "give a constraint of one closure: a pin in a slot, a rod"));
        }
        let coordinates = coordinates.iter().map(|c| c.0).collect();
        let (element, parameters) = (Arc::new(gap), parameters.to_vec());
        let part = PartData { name, element, coordinates, first_multiplier: 0, closures, parameters };
        self.impacts.push(ImpactData { part, restitution });
        Ok(())
    }

    /// A rigid stop between two coordinates: `b` − `a` does not fall below `clearance` (m or rad).
    pub fn rigid_stop(&mut self, name: &str, a: Coordinate, b: Coordinate, clearance: S, restitution: S) -> Result<()> {
        self.impact(name, Driver(Fixed), &[a, b], &[clearance], restitution)
    }

    /// A rigid wall: the line through point `a` at the angle `line` (rad) in the body of `a`. Point `b` stays to the left of
    /// it, as seen along the line.
    pub fn rigid_wall(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>, restitution: S) -> Result<()> {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        self.impact(name, PointOnLine, &coordinates, &[a.x, a.y, line, b.x, b.y], restitution)
    }
}
