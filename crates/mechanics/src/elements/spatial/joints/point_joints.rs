//! Joints in space of points: spherical, universal and constant-velocity joints, points on lines and planes.

use crate::elements::spatial::joints::rows::{self, COINCIDENT, ConstraintRow, TRANSLATIONS, X, Y, Z, spatial_joint};
use crate::elements::spatial::line3::{check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Symbol};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use autodiff::Scalar;

spatial_joint! {
    /// A spherical joint: the points A and B coincide, Φ = r_A − r_B. λ is the force of A on B in world axes, in N.
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    Spherical, "spherical", "a ball joint: the points coincide", "r_a = r_b", Symbol::Pin,
    rows: COINCIDENT, aligned: [], linear: TRANSLATIONS,
    /// Joins the points of two markers by a spherical joint.
    spherical, SPHERICAL
}

spatial_joint! {
    /// A universal joint (Cardan or Hooke joint): the points coincide, and the axes z of A and B are perpendicular.
    ///
    /// $$ \Phi = (\mathbf r_A - \mathbf r_B,\ \mathbf z_A\cdot\mathbf z_B) = 0 $$
    ///
    /// The axes z are the two axes of its cross, each fixed to one body. λ are the force of A on B in world axes (N) and a
    /// torque (N·m).
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    Universal, "universal", "a Cardan joint: the points coincide and the axes z, those of the cross, are perpendicular", "r_a = r_b, z_a·z_b = 0",
    Symbol::Pin,
    rows: [COINCIDENT[0], COINCIDENT[1], COINCIDENT[2], ConstraintRow::Perpendicular(Z, Z)], aligned: [], linear: TRANSLATIONS,
    /// Joins two markers by a universal joint whose cross has the axes z of `a` and `b`.
    universal, UNIVERSAL
}

spatial_joint! {
    /// A constant-velocity joint (homokinetic joint, such as Rzeppa's): the points coincide, and the two shafts along z turn at the
    /// same rate about their axes at every angle between them.
    ///
    /// $$ \Phi = (\mathbf r_A - \mathbf r_B,\ \mathbf x_A\cdot\mathbf y_B - \mathbf y_A\cdot\mathbf x_B) = 0 $$
    ///
    /// The last equation says that the axis of the rotation from A to B is normal to both axes z, so that the plane that bisects the
    /// shafts is a plane of symmetry. λ are the force of A on B in world axes (N) and a torque along z_A + z_B (N·m). The angle β between the shafts must be less than 180°.
    ///
    /// # Sources
    /// Seherr-Thoss, Schmelz & Aucktor, *Universal Joints and Driveshafts* (2006), Section 1.3.
    ConstantVelocity, "constant-velocity",
    "a homokinetic joint: the points coincide, and the shafts along z turn at the same rate at every angle between them",
    "r_a = r_b, x_a·y_b = y_a·x_b", Symbol::Pin,
    rows: [COINCIDENT[0], COINCIDENT[1], COINCIDENT[2], ConstraintRow::Untwisted], aligned: [], linear: TRANSLATIONS,
    /// Joins two shafts along the axes z of `a` and `b` by a constant-velocity joint.
    constant_velocity, CONSTANT_VELOCITY
}

spatial_joint! {
    /// A point on a line: the point B lies on the axis z of A, Φ = (x_A, y_A) · (r_A − r_B). λ are forces of A on B in N.
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    PointOnLine3, "point-on-line", "the point of b on the axis z of a", "x_a·(r_b − r_a) = 0, y_a·(r_b − r_a) = 0", Symbol::None,
    rows: [ConstraintRow::InPlane(X), ConstraintRow::InPlane(Y)], aligned: [], linear: &[],
    /// Keeps the point of `b` on the axis z of `a`.
    point_on_line3, POINT_ON_LINE
}

spatial_joint! {
    /// A point on a plane: the point B lies in the plane through A normal to z, Φ = z_A · (r_A − r_B). λ is a force of A on B
    /// in N.
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    PointOnPlane, "point-on-plane", "the point of b in the plane through a normal to its axis z", "z_a·(r_b − r_a) = 0", Symbol::None,
    rows: [ConstraintRow::InPlane(Z)], aligned: [], linear: &[],
    /// Keeps the point of `b` in the plane through `a` normal to its axis z.
    point_on_plane, POINT_ON_PLANE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};
    use crate::elements::spatial::line3::{points, upright};
    use crate::mechanism::Rotation;

    #[test]
    fn a_cross_and_points_on_planes_and_lines() {
        let mut p = points([0.0; 3], [0.0; 3]);
        // The axis z of B is turned to x of its body: by a quarter about y.
        let half = 0.5f64.sqrt();
        (p[10], p[12]) = (half, half);
        let q = upright([0.0; 3], [0.1, 0.2, 0.3]);
        let x = at(&p, &q, &[0.0, 0.0, 0.0, 2.0]);
        close(&rows(&Universal, &x).1, &[-0.1, -0.2, -0.3, 0.0]);
        // z × x = y.
        close(&measured(&Universal, &x), &[0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        close(&rows(&PointOnPlane, &at(&p, &q, &[1.0])).1, &[-0.3]);
        close(&rows(&PointOnLine3, &at(&p, &q, &[1.0, 1.0])).1, &[-0.1, -0.2]);
        close(&measured(&PointOnPlane, &at(&p, &q, &[5.0])), &[0.0, 0.0, 5.0, 5.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn shafts_at_an_angle_are_not_twisted() {
        let p = points([0.0; 3], [0.0; 3]);
        let turned = |rotation: Rotation<f64>| {
            let mut q = upright([0.0; 3], [0.0; 3]);
            q[10..].copy_from_slice(&rotation.parameters());
            q
        };
        let l = [0.0, 0.0, 0.0, 3.0];
        // About an axis normal to z, in front of which both shafts have turned by the same angle.
        let bent = Rotation::about([0.6, 0.8, 0.0], 0.9);
        let both = |spin: f64| {
            let mut q = turned(Rotation::about_z(spin).then(Rotation::about([0.6, 0.8, 0.0], 0.9)));
            q[3..7].copy_from_slice(&Rotation::about_z(spin).parameters());
            q
        };
        close(&rows(&ConstantVelocity, &at(&p, &both(1.3), &l)).1, &[0.0; 4]);
        // Ahead by a right angle: x_A·y_B − y_A·x_B = −2.
        close(
            &rows(&ConstantVelocity, &at(&p, &turned(Rotation::about_z(0.5 * std::f64::consts::PI)), &l)).1[3..],
            &[-2.0],
        );
        // At an angle of 0.9 the torque is λ (1 + cos 0.9) along the sum of the axes, which has the length 2 cos 0.45.
        let x = turned(bent);
        close(&measured(&ConstantVelocity, &at(&p, &x, &l))[7..], &[3.0 * (1.0 + 0.9f64.cos()) / 0.45f64.cos()]);
        assert!(ConstantVelocity.diagnose_assembly(&at(&p, &x, &l)).is_none());
        for (axis, words) in [([0.0, 0.0, 1.0], "half a turn about z"), ([1.0, 0.0, 0.0], "along the shafts")] {
            let q = turned(Rotation::about(axis, std::f64::consts::PI));
            close(&rows(&ConstantVelocity, &at(&p, &q, &l)).1, &[0.0; 4]);
            let why = ConstantVelocity.diagnose_assembly(&at(&p, &q, &l)).unwrap();
            assert!(why.contains(words), "{why}");
        }
    }
}
