//! Constraint equations of which joints in space consist.

use crate::element_inputs;
use crate::elements::spatial::line3::MarkerPair;
use crate::mechanism::element::{ElementState, Measure};
use crate::mechanism::vector::{add, cross, dot, norm, scaled, subtract};
use autodiff::Scalar;

element_inputs!(JointInputs { a: marker3("marker of the first body"), b: marker3("marker of the second body") });

/// Inputs of joints: the markers A and B.
pub(crate) const JOINT_INPUTS: &[crate::mechanism::element::Input] = INPUTS;

/// Number of an axis of a marker or of the world.
pub(crate) const X: usize = 0;
/// See [`X`].
pub(crate) const Y: usize = 1;
/// See [`X`].
pub(crate) const Z: usize = 2;

/// A constraint equation between two markers, with the points r and the axes a and b of A and B.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConstraintRow {
    /// The points have the same world coordinate: Φ = (r_A − r_B)ₖ. λ is a force of A on B in N.
    Coincident(usize),
    /// The point B lies in the plane through A normal to an axis of A: Φ = aₖ · (r_A − r_B). λ is a force of A on B in N.
    InPlane(usize),
    /// An axis of A is perpendicular to an axis of B: Φ = aᵢ · bⱼ. λ is a torque of A on B about aᵢ × bⱼ in N·m.
    Perpendicular(usize, usize),
    /// The axis of the rotation from A to B is normal to their axes z: Φ = x_A · y_B − y_A · x_B. λ is a torque of A on B about
    /// x_A × y_B − y_A × x_B, the sum of the axes z, in N·m.
    Untwisted,
}

/// The points coincide.
pub(crate) const COINCIDENT: [ConstraintRow; 3] =
    [ConstraintRow::Coincident(X), ConstraintRow::Coincident(Y), ConstraintRow::Coincident(Z)];

/// Adds the rows of a joint.
pub(crate) fn residual<T: Scalar>(
    rows: &[ConstraintRow],
    x: &ElementState<'_, T>,
    dynamics: &mut [T],
    constraint: &mut [T],
) {
    let ends = MarkerPair::of(x);
    let MarkerPair { a, b } = &ends;
    let (back, zero) = (subtract(a.point, b.point), T::zero());
    let (mut at_points, mut at_b, mut torque) = ([zero; 3], [zero; 3], [zero; 3]);
    for ((row, value), &l) in rows.iter().zip(constraint).zip(x.l) {
        match *row {
            ConstraintRow::Coincident(k) => {
                *value = back[k];
                at_points[k] += l;
            }
            ConstraintRow::InPlane(k) => {
                *value = dot(a.axes[k], back);
                at_b = add(at_b, scaled(a.axes[k], l));
            }
            ConstraintRow::Perpendicular(i, j) => {
                *value = dot(a.axes[i], b.axes[j]);
                torque = add(torque, scaled(cross(a.axes[i], b.axes[j]), l));
            }
            ConstraintRow::Untwisted => {
                *value = dot(a.axes[X], b.axes[Y]) - dot(a.axes[Y], b.axes[X]);
                torque = add(torque, scaled(untwisting(&ends), l));
            }
        }
    }
    if rows.iter().any(|row| matches!(row, ConstraintRow::Coincident(_))) {
        a.frame.add_force(dynamics, a.lever, at_points);
        b.frame.add_force(dynamics, b.lever, at_points.map(|f| -f));
    }
    if rows.iter().any(|row| matches!(row, ConstraintRow::InPlane(_))) {
        ends.apply_at_b(at_b, dynamics);
    }
    if rows.iter().any(|row| matches!(row, ConstraintRow::Perpendicular(..) | ConstraintRow::Untwisted)) {
        ends.apply_torque(torque, dynamics);
    }
}

/// Torque of A on B by a unit multiplier of [`ConstraintRow::Untwisted`].
fn untwisting<T: Scalar>(MarkerPair { a, b }: &MarkerPair<T>) -> [T; 3] {
    subtract(cross(a.axes[X], b.axes[Y]), cross(a.axes[Y], b.axes[X]))
}

/// Measures of joints in space, see [`measure`].
pub(crate) const REACTIONS: &[Measure] = &[
    Measure::new("force_x", "N", "force of a on b at the point of b, along x of the marker a"),
    Measure::new("force_y", "N", "force of a on b at the point of b, along y of the marker a"),
    Measure::new("force_z", "N", "force of a on b at the point of b, along z of the marker a"),
    Measure::new("force", "N", "magnitude of the force"),
    Measure::new("torque_x", "N·m", "torque of a on b, along x of the marker a"),
    Measure::new("torque_y", "N·m", "torque of a on b, along y of the marker a"),
    Measure::new("torque_z", "N·m", "torque of a on b, along z of the marker a"),
    Measure::new("torque", "N·m", "magnitude of the torque"),
];

/// Writes the force and the torque of A on B along the axes of the marker A, with their magnitudes.
pub(crate) fn measure<T: Scalar>(rows: &[ConstraintRow], x: &ElementState<'_, T>, out: &mut [T]) {
    let ends = MarkerPair::of(x);
    let MarkerPair { a, b } = &ends;
    let (mut force, mut torque) = ([T::zero(); 3], [T::zero(); 3]);
    for (row, &l) in rows.iter().zip(x.l) {
        match *row {
            ConstraintRow::Coincident(k) => force[k] += l,
            ConstraintRow::InPlane(k) => force = add(force, scaled(a.axes[k], l)),
            ConstraintRow::Perpendicular(i, j) => torque = add(torque, scaled(cross(a.axes[i], b.axes[j]), l)),
            ConstraintRow::Untwisted => torque = add(torque, scaled(untwisting(&ends), l)),
        }
    }
    out[..3].copy_from_slice(&a.components(force));
    out[3] = norm(force);
    out[4..7].copy_from_slice(&a.components(torque));
    out[7] = norm(torque);
}

/// Describes axes of A and B that should have the same direction and have not: perpendicular rows hold for −b as well, and
/// [`ConstraintRow::Untwisted`] after half a turn about z.
pub(crate) fn misaligned(rows: &[ConstraintRow], axes: &[usize], x: &ElementState<'_, f64>) -> Option<String> {
    let MarkerPair { a, b } = MarkerPair::of(x);
    if rows.contains(&ConstraintRow::Untwisted) {
        let cosine = |k: usize| dot(a.axes[k], b.axes[k]);
        if cosine(Z) < -0.5 {
            return Some(format!(
                "it is assembled the wrong way round: the z-axes of its markers, along the shafts, should have the same direction where the \
                 joint is straight, but the cosine of their angle is {:.3}",
                cosine(Z)
            ));
        }
        return (cosine(X) + cosine(Y) < 0.0).then(|| {
            "it is assembled the wrong way round: the x-axes of its markers should have the same direction where the joint is straight, \
             but one is half a turn about z ahead"
                .to_owned()
        });
    }
    let wrong = axes.iter().find(|k| dot(a.axes[**k], b.axes[**k]) < 0.5)?;
    let (name, cosine) = (["x", "y", "z"][*wrong], dot(a.axes[*wrong], b.axes[*wrong]));
    Some(format!(
        "it is assembled the wrong way round: the {name}-axes of its markers should have the same direction, but the cosine of \
         their angle is {cosine:.3}"
    ))
}

/// Translations of both bodies, in which rows without [`ConstraintRow::InPlane`] are linear.
pub(crate) const TRANSLATIONS: &[usize] = &[0, 1, 2, 7, 8, 9];

/// Defines a joint between two markers by its constraint equations, with the method of `Mechanism` that adds it.
macro_rules! spatial_joint {
    (
        $(#[$about_joint:meta])* $joint:ident, $kind:literal, $about:literal, $law:literal, $symbol:expr,
        rows: $rows:expr, aligned: $aligned:expr, linear: $linear:expr,
        $(#[$about_method:meta])* $method:ident, $descriptor:ident
    ) => {
        $(#[$about_joint])*
        #[derive(Clone, Copy, Debug)]
        pub struct $joint;

        $crate::as_object!($joint);

        pub static $descriptor: ElementDescriptor = ElementDescriptor {
            kind: $kind,
            family: Family::Joint,
            inputs: rows::JOINT_INPUTS,
            measures: rows::REACTIONS,
            about: $about,
            law: $law,
            symbol: $symbol,
        };

        impl $joint {
            /// Constraint equations, in the order of the multipliers.
            pub(crate) const ROWS: &'static [ConstraintRow] = &$rows;
        }

        impl Element for $joint {
            fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
                rows::residual(Self::ROWS, x, dynamics, constraint);
            }

            fn descriptor(&self) -> Option<&'static ElementDescriptor> {
                Some(&$descriptor)
            }

            fn num_constraints(&self) -> usize {
                Self::ROWS.len()
            }

            fn linear(&self) -> &'static [usize] {
                $linear
            }

            fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
                rows::measure(Self::ROWS, x, out);
            }

            fn validate_parameters(&self, p: &[f64]) -> Option<String> {
                check_ends(p)
            }

            fn diagnose_assembly(&self, x: &ElementState<'_, f64>) -> Option<String> {
                rows::misaligned(Self::ROWS, &$aligned, x)
            }
        }

        impl<S: Scalar> Mechanism<S> {
            $(#[$about_method])*
            pub fn $method(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>) -> ElementIndex {
                let (coordinates, p) = ends3(a, b);
                self.add_object(name.into(), $joint::object(), &coordinates, &p)
            }
        }
    };
}
pub(crate) use spatial_joint;
