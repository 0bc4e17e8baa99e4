//! Joints in space between surfaces: revolute, prismatic, cylindrical, planar and fixed.

use crate::elements::spatial::joints::rows::{self, COINCIDENT, ConstraintRow, TRANSLATIONS, X, Y, Z, spatial_joint};
use crate::elements::spatial::line3::{check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Symbol};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use autodiff::Scalar;

/// The axes z of A and B are parallel.
const PARALLEL: [ConstraintRow; 2] = [ConstraintRow::Perpendicular(X, Z), ConstraintRow::Perpendicular(Y, Z)];

/// The axes of A and B are the same.
const SAME_AXES: [ConstraintRow; 3] =
    [ConstraintRow::Perpendicular(X, Y), ConstraintRow::Perpendicular(Y, Z), ConstraintRow::Perpendicular(Z, X)];

/// The point B lies on the axis z of A.
const ON_AXIS: [ConstraintRow; 2] = [ConstraintRow::InPlane(X), ConstraintRow::InPlane(Y)];

spatial_joint! {
    /// A revolute joint in space: the points A and B coincide, and the body of B turns about the common axis z.
    ///
    /// $$ \Phi = (\mathbf r_A - \mathbf r_B,\ \mathbf x_A\cdot\mathbf z_B,\ \mathbf y_A\cdot\mathbf z_B) = 0 $$
    ///
    /// λ are the force of A on B in world axes (N) and torques (N·m). [`Mechanism::joint_angle`] makes its angle a coordinate.
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    Revolute3, "revolute", "a hinge: the points coincide and the axes z are parallel", "r_a = r_b, z_a ∥ z_b", Symbol::Pin,
    rows: [COINCIDENT[0], COINCIDENT[1], COINCIDENT[2], PARALLEL[0], PARALLEL[1]], aligned: [Z], linear: TRANSLATIONS,
    /// Joins two markers by a revolute joint about their common axis z.
    revolute3, REVOLUTE
}

spatial_joint! {
    /// A prismatic joint in space: the body of B slides along the axis z of A and does not turn relative to A.
    ///
    /// $$ \Phi = (\mathbf x_A\cdot\mathbf y_B,\ \mathbf y_A\cdot\mathbf z_B,\ \mathbf z_A\cdot\mathbf x_B,\
    ///    \mathbf x_A\cdot(\mathbf r_A - \mathbf r_B),\ \mathbf y_A\cdot(\mathbf r_A - \mathbf r_B)) = 0 $$
    ///
    /// λ are torques (N·m) and forces of A on B (N). [`Mechanism::joint_displacement`] makes its displacement a coordinate.
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    Prismatic3, "prismatic", "a guide: b slides along z of a without turning", "r_b − r_a ∥ z_a, axes of b parallel to those of a", Symbol::None,
    rows: [SAME_AXES[0], SAME_AXES[1], SAME_AXES[2], ON_AXIS[0], ON_AXIS[1]], aligned: [X, Y, Z], linear: &[],
    /// Guides the marker `b` along the axis z of `a`, with the same axes.
    prismatic3, PRISMATIC
}

spatial_joint! {
    /// A cylindrical joint: the body of B slides along the axis z of A and turns about it.
    ///
    /// $$ \Phi = (\mathbf x_A\cdot\mathbf z_B,\ \mathbf y_A\cdot\mathbf z_B,\
    ///    \mathbf x_A\cdot(\mathbf r_A - \mathbf r_B),\ \mathbf y_A\cdot(\mathbf r_A - \mathbf r_B)) = 0 $$
    ///
    /// λ are torques (N·m) and forces of A on B (N).
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    Cylindrical, "cylindrical", "a sleeve: b slides along z of a and turns about it", "r_b − r_a ∥ z_a, z_a ∥ z_b", Symbol::None,
    rows: [PARALLEL[0], PARALLEL[1], ON_AXIS[0], ON_AXIS[1]], aligned: [Z], linear: &[],
    /// Joins two markers by a cylindrical joint along and about their common axis z.
    cylindrical, CYLINDRICAL
}

spatial_joint! {
    /// A planar joint: the body of B slides in the plane through A normal to z, and turns about z.
    ///
    /// $$ \Phi = (\mathbf x_A\cdot\mathbf z_B,\ \mathbf y_A\cdot\mathbf z_B,\ \mathbf z_A\cdot(\mathbf r_A - \mathbf r_B)) = 0 $$
    ///
    /// λ are torques (N·m) and a force of A on B (N).
    ///
    /// # Sources
    /// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 9.4.
    Planar, "planar", "a flat contact of faces: b slides in the plane normal to z of a and turns about z", "z_a·(r_b − r_a) = 0, z_a ∥ z_b", Symbol::None,
    rows: [PARALLEL[0], PARALLEL[1], ConstraintRow::InPlane(Z)], aligned: [Z], linear: &[],
    /// Keeps the marker `b` in the plane through `a` normal to its axis z, with parallel axes z.
    planar_joint, PLANAR
}

spatial_joint! {
    /// A fixed joint in space: the markers A and B coincide.
    ///
    /// $$ \Phi = (\mathbf r_A - \mathbf r_B,\ \mathbf x_A\cdot\mathbf y_B,\ \mathbf y_A\cdot\mathbf z_B,\
    ///    \mathbf z_A\cdot\mathbf x_B) = 0 $$
    ///
    /// λ are the force of A on B in world axes (N) and torques (N·m).
    ///
    /// # Sources
    /// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 9.4.
    FixedJoint3, "fixed", "a rigid connection: the markers coincide", "r_a = r_b, axes of b parallel to those of a", Symbol::None,
    rows: [COINCIDENT[0], COINCIDENT[1], COINCIDENT[2], SAME_AXES[0], SAME_AXES[1], SAME_AXES[2]],
    aligned: [X, Y, Z], linear: TRANSLATIONS,
    /// Joins two bodies rigidly, so that their markers coincide.
    fixed_joint3, FIXED
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};
    use crate::elements::spatial::line3::{points, upright};
    use crate::mechanism::Rotation;

    #[test]
    fn a_hinge_half_a_metre_from_both_reference_points() {
        let (q, p) = (upright([0.0; 3], [1.1, 0.2, 0.3]), points([0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]));
        let x = at(&p, &q, &[3.0, 4.0, 0.0, 5.0, 6.0]);
        let (dynamics, constraint) = rows(&Revolute3, &x);
        close(&constraint, &[-0.1, -0.2, -0.3, 0.0, 0.0]);
        // The torque of A on B is 5 x × z + 6 y × z = (6, −5, 0); the force has the moments (0, 0, ±2).
        close(&dynamics[..7], &[3.0, 4.0, 0.0, 0.0, 12.0, -10.0, 4.0]);
        close(&dynamics[7..], &[-3.0, -4.0, 0.0, 0.0, -12.0, 10.0, 4.0]);
        close(&measured(&Revolute3, &x), &[3.0, 4.0, 0.0, 5.0, 6.0, -5.0, 0.0, 61f64.sqrt()]);
    }

    #[test]
    fn forces_of_a_guide_act_at_the_slider() {
        let (q, p) = (upright([0.0; 3], [0.1, 0.2, 2.0]), points([0.0; 3], [0.0; 3]));
        let (dynamics, constraint) = rows(&Prismatic3, &at(&p, &q, &[0.0, 0.0, 0.0, 3.0, 0.0]));
        close(&constraint, &[0.0, 0.0, 0.0, -0.1, -0.2]);
        // 3 N along x two metres up: (0, 6, −0.6) N·m on A.
        close(&dynamics, &[3.0, 0.0, 0.0, 0.0, 0.0, 12.0, -1.2, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn opposite_and_exchanged_axes_are_described() {
        let p = points([0.0; 3], [0.0; 3]);
        let turned = |rotation: Rotation<f64>| {
            let mut q = upright([0.0; 3], [0.0; 3]);
            q[10..].copy_from_slice(&rotation.parameters());
            q
        };
        let half = std::f64::consts::PI;
        let upside_down = turned(Rotation::about_x(half));
        let l = [0.0; 6];
        for k in rows(&Revolute3, &at(&p, &upside_down, &l[..5])).1 {
            assert!(k.abs() < 1e-15, "the equations hold");
        }
        let why = Revolute3.diagnose_assembly(&at(&p, &upside_down, &l[..5])).unwrap();
        assert!(why.contains("z-axes") && why.contains("-1.000"), "{why}");
        let third = turned(Rotation::about([1.0; 3], 2.0 * half / 3.0));
        assert!(FixedJoint3.diagnose_assembly(&at(&p, &third, &l)).is_some());
        assert!(Planar.diagnose_assembly(&at(&p, &turned(Rotation::about_z(2.0)), &l[..3])).is_none());
    }
}
