//! Joints in space of points: spherical and universal joints, points on lines and planes.

use crate::elements::spatial::joints::rows::{self, COINCIDENT, Row, TRANSLATIONS, X, Y, Z, spatial_joint};
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
    rows: [COINCIDENT[0], COINCIDENT[1], COINCIDENT[2], Row::Perpendicular(Z, Z)], aligned: [], linear: TRANSLATIONS,
    /// Joins two markers by a universal joint whose cross has the axes z of `a` and `b`.
    universal, UNIVERSAL
}

spatial_joint! {
    /// A point on a line: the point B lies on the axis z of A, Φ = (x_A, y_A) · (r_A − r_B). λ are forces of A on B in N.
    ///
    /// # Sources
    /// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
    PointOnLine3, "point-on-line", "the point of b on the axis z of a", "x_a·(r_b − r_a) = 0, y_a·(r_b − r_a) = 0", Symbol::None,
    rows: [Row::InPlane(X), Row::InPlane(Y)], aligned: [], linear: &[],
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
    rows: [Row::InPlane(Z)], aligned: [], linear: &[],
    /// Keeps the point of `b` in the plane through `a` normal to its axis z.
    point_on_plane, POINT_ON_PLANE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};
    use crate::elements::spatial::line3::{points, upright};

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
}
