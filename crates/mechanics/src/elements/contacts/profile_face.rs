//! Contact of the profile of a body with a flat face of another body.

use crate::elements::contacts::hunt_crossley::{self, contact_force};
use crate::elements::contacts::profile::{self, Profile, dot};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Contact of the profile of a body with a flat face of another body, without friction: a cam with a flat-faced follower.
///
/// The profile is that of a [`ProfileContact`](super::ProfileContact). The face is the line through B; the profile is on its left.
/// The normal force acts along the normal **n** of the face, to its left, at the point **c** of the profile that is deepest behind
/// the face:
///
/// $$ F = k\,\delta^{3/2}\left(1 + \tfrac32 c\,\dot\delta\right) \ge 0 ,\qquad
///    \delta = \max_{\mathbf c} \mathbf n\cdot(\mathbf r_B - \mathbf r_c) $$
///
/// A convex profile touches at one point. Where a concave profile touches at two points at once, the point of contact jumps.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct ProfileFace;

as_object!(ProfileFace);

element_inputs!(ProfileFaceInputs {
    a: marker("origin of the profile, whose axes are those of the body"),
    b: marker("point of the face"),
    line: optional("0", "rad", 0.3, "direction of the face in the body of b; the profile is on its left"),
    stiffness: required("N/m^1.5", 1e3, "stiffness"),
    damping: optional("0", "s/m", 0.1, "damping"),
    profile: profile("points [x, y] of a closed curve, counter-clockwise around material"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "profile-face",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[
        Measure::new("contact_force", "N", "contact force on the profile, along the normal of the face"),
        Measure::new("gap", "m", "distance of profile and face, negative in contact"),
    ],
    about: "compliant contact of the profile of a body with a flat face of another body",
    law: "contact_force = stiffness·δ^1.5·(1 + 1.5·damping·δ̇), at least 0, with the depth δ = n·(r_b − c) of the deepest point c of the \
          profile behind the face and the normal n to the left of the face; 0 where δ < 0; gap = −δ",
    symbol: Symbol::ProfileFace,
};

/// The contact in one state.
struct ProfileFaceState<T> {
    depth: T,
    rate: T,
    force: T,
    /// Normal of the face, to its left.
    normal: [T; 2],
    /// Levers from the reference points of both bodies to the deepest point.
    levers: [[T; 2]; 2],
}

impl<T: Scalar> ProfileFaceState<T> {
    fn of(x: &ElementState<'_, T>) -> Self {
        let (p, frame_a, frame_b) = (ProfileFaceInputs(x.p), Frame::of(x, 0), Frame::of(x, 3));
        let ([ax, ay], [bx, by]) = (p.a(), p.b());
        let (sin, cos) = (frame_b.theta + p.line()).sin_cos();
        let normal = [-sin, cos];
        // Into the face, in the axes of the profile.
        let into = [frame_a.cos * sin - frame_a.sin * cos, -(frame_a.sin * sin) - frame_a.cos * cos];
        let [cx, cy] = Profile::new(p.profile()).farthest(into).at;
        let lever_a = frame_a.turned(ax + cx, ay + cy);
        let deepest = frame_a.point(lever_a);
        let lever_b = [deepest[0] - frame_b.x, deepest[1] - frame_b.y];
        let to_face = frame_b.turned(bx, by);
        let depth = dot([to_face[0] - lever_b[0], to_face[1] - lever_b[1]], normal);
        let ([ux, uy], [vx, vy]) = (point_velocity(x, 0, lever_a), point_velocity(x, 3, lever_b));
        let rate = dot([vx - ux, vy - uy], normal);
        let force = contact_force(p.stiffness(), p.damping(), depth, rate, x.sides);
        Self { depth, rate, force, normal, levers: [lever_a, lever_b] }
    }
}

impl Element for ProfileFace {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let ProfileFaceState { force, normal: [nx, ny], levers: [a, b], .. } = ProfileFaceState::of(x);
        add_force(dynamics, 0, a, [-force * nx, -force * ny]);
        add_force(dynamics, 3, b, [force * nx, force * ny]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_switching_functions(&self) -> usize {
        hunt_crossley::SWITCHING_FUNCTIONS
    }

    fn num_fractional_powers(&self) -> usize {
        hunt_crossley::FRACTIONAL_POWERS
    }

    fn switching_functions<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut Vec<T>) {
        let ProfileFaceState { depth, rate, .. } = ProfileFaceState::of(x);
        hunt_crossley::switching_functions(ProfileFaceInputs(x.p).damping(), depth, rate, out);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = ProfileFaceInputs(p);
        hunt_crossley::validate(p.stiffness(), p.damping()).or_else(|| profile::validate(p.profile()))
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let ProfileFaceState { force, depth, .. } = ProfileFaceState::of(x);
        (out[0], out[1]) = (force, -depth);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        hunt_crossley::stored_energy(ProfileFaceInputs(x.p).stiffness(), ProfileFaceState::of(x).depth, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets the profile through `points` (m) on the body of `a` touch the face through `b`: `law` is the direction of the face in
    /// the body of `b` (rad), stiffness (N/m^1.5) and damping (s/m). At least four points.
    pub fn profile_face(
        &mut self,
        name: &str,
        a: Marker<S>,
        b: Marker<S>,
        law: [S; 3],
        points: &[[S; 2]],
    ) -> ElementIndex {
        self.add_profile(name, ProfileFace::object(), [a, b], law, points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{measured, moving, rows};

    #[test]
    fn an_ellipse_on_its_side_sinks_into_a_face() {
        let points = (0..60).flat_map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 60.0).sin_cos();
            [0.3 * cos, 0.2 * sin]
        });
        let p: Vec<f64> = [0.0, 0.0, 0.5, 0.0, 0.0, 1000.0, 0.2].into_iter().chain(points).collect();
        // It has turned by α: it reaches √(a² sin² α + b² cos² α) down, and the point there is at the lever
        // (a² − b²) sin α cos α / that distance.
        let alpha = 0.4f64;
        let (sin, cos) = alpha.sin_cos();
        let reach = ((0.3 * sin).powi(2) + (0.2 * cos).powi(2)).sqrt();
        let q = [2.0, reach - 0.01, alpha, 0.0, 0.0, 0.0];
        let x = moving(&p, &q, &[0.3, -0.5, 0.0, 0.0, 0.0, 0.0], &[]);
        let force = 1000.0 * 0.01f64.powf(1.5) * (1.0 + 1.5 * 0.2 * 0.5);
        let found = measured(&ProfileFace, &x);
        assert!((found[0] - force).abs() < 1e-4 * force && (found[1] + 0.01).abs() < 1e-6, "{found:?} {force}");
        let lever = -(0.09 - 0.04) * sin * cos / reach;
        let expected = [0.0, -force, -force * lever, 0.0, force, force * (2.0 + lever)];
        let rows = rows(&ProfileFace, &x).0;
        assert!(rows.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3 * force), "{rows:?} {expected:?}");
    }
}
