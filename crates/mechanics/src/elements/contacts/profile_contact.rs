//! Contact of a point or roller with the profile of another body.

use crate::elements::contacts::hunt_crossley::{self, contact_force};
use crate::elements::contacts::profile::{self, Profile, dot};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Contact of a roller, or of a point, with the profile of another body, without friction: a cam that its follower can leave.
///
/// The profile is a closed curve through given points, fixed to the body of A: the periodic cubic spline. The normal force acts
/// along the outward normal **n** at the point **c** of the curve nearest to the centre B of the roller with the radius ρ:
///
/// $$ F = k\,\delta^{3/2}\left(1 + \tfrac32 c\,\dot\delta\right) \ge 0 ,\qquad
///    \delta = \rho - \mathbf n\cdot(\mathbf r_B - \mathbf r_c) $$
///
/// Points that run counter-clockwise enclose material, and the roller is outside; points that run clockwise enclose an opening,
/// and the roller is inside. Where the profile is concave towards the roller, its radius of curvature must exceed that of the
/// roller: otherwise the nearest point jumps, and the force with it. Use
/// [`CamFollower`](crate::elements::joints::CamFollower) for a follower that a groove guides.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct ProfileContact;

as_object!(ProfileContact);

element_inputs!(ProfileContactInputs {
    a: marker("origin of the profile, whose axes are those of the body"),
    b: marker("centre of the roller"),
    radius: optional("0", "m", 0.1, "radius of the roller; 0 for a point"),
    stiffness: required("N/m^1.5", 1e3, "stiffness"),
    damping: optional("0", "s/m", 0.1, "damping"),
    profile: profile("points [x, y] of a closed curve, counter-clockwise around material"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "profile-contact",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[
        Measure::new("contact_force", "N", "contact force on the roller, along the outward normal of the profile"),
        Measure::new("gap", "m", "distance of roller and profile, negative in contact"),
    ],
    about: "compliant contact of a point or roller with the profile of another body",
    law: "contact_force = stiffness·δ^1.5·(1 + 1.5·damping·δ̇), at least 0, with the depth δ = radius − n·(r_b − c), where c is the point of \
          the profile nearest to b and n the outward normal there; 0 where δ < 0; gap = −δ",
    symbol: Symbol::Profile,
};

/// The contact in one state.
struct ProfileContactState<T> {
    depth: T,
    rate: T,
    force: T,
    /// Outward normal in the axes of the plane.
    normal: [T; 2],
    /// Levers from the reference points of both bodies to the centre of the roller, through which the force passes.
    levers: [[T; 2]; 2],
}

impl<T: Scalar> ProfileContactState<T> {
    fn of(x: &ElementState<'_, T>) -> Self {
        let (p, frame_a, frame_b) = (ProfileContactInputs(x.p), Frame::of(x, 0), Frame::of(x, 3));
        let ([ax, ay], [bx, by]) = (p.a(), p.b());
        let lever_b = frame_b.turned(bx, by);
        let centre = frame_b.point(lever_b);
        let lever_a = [centre[0] - frame_a.x, centre[1] - frame_a.y];
        // The centre in the axes of the profile.
        let local = [
            frame_a.cos * lever_a[0] + frame_a.sin * lever_a[1] - ax,
            frame_a.cos * lever_a[1] - frame_a.sin * lever_a[0] - ay,
        ];
        let (nearest, outward) = Profile::new(p.profile()).nearest(local);
        let distance = dot([local[0] - nearest.at[0], local[1] - nearest.at[1]], outward);
        let normal = frame_a.turned(outward[0], outward[1]);
        let ([ux, uy], [vx, vy]) = (point_velocity(x, 0, lever_a), point_velocity(x, 3, lever_b));
        let (depth, rate) = (p.radius() - distance, dot([ux - vx, uy - vy], normal));
        let force = contact_force(p.stiffness(), p.damping(), depth, rate, x.sides);
        Self { depth, rate, force, normal, levers: [lever_a, lever_b] }
    }
}

impl Element for ProfileContact {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let ProfileContactState { force, normal: [nx, ny], levers: [a, b], .. } = ProfileContactState::of(x);
        add_force(dynamics, 0, a, [force * nx, force * ny]);
        add_force(dynamics, 3, b, [-force * nx, -force * ny]);
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
        let ProfileContactState { depth, rate, .. } = ProfileContactState::of(x);
        hunt_crossley::switching_functions(ProfileContactInputs(x.p).damping(), depth, rate, out);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = ProfileContactInputs(p);
        if !(p.radius() >= 0.0) {
            return Some(format!("its radius is {} m", p.radius()));
        }
        hunt_crossley::validate(p.stiffness(), p.damping()).or_else(|| profile::validate(p.profile()))
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let ProfileContactState { force, depth, .. } = ProfileContactState::of(x);
        (out[0], out[1]) = (force, -depth);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        hunt_crossley::stored_energy(ProfileContactInputs(x.p).stiffness(), ProfileContactState::of(x).depth, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets a roller with the centre `b` touch the profile through `points` (m) on the body of `a`: `law` is radius of the roller
    /// (m), stiffness (N/m^1.5) and damping (s/m). At least four points.
    pub fn profile_contact(
        &mut self,
        name: &str,
        a: Marker<S>,
        b: Marker<S>,
        law: [S; 3],
        points: &[[S; 2]],
    ) -> ElementIndex {
        self.add_profile(name, ProfileContact::object(), [a, b], law, points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{measured, moving, rows};

    /// A roller of 0.05 m radius on a disk of 0.2 m radius around (0.1, 0) of A.
    fn parameters() -> Vec<f64> {
        let points = (0..40).flat_map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 40.0).sin_cos();
            [0.2 * cos, 0.2 * sin]
        });
        [0.1, 0.0, 0.0, 0.0, 0.05, 1000.0, 0.2].into_iter().chain(points).collect()
    }

    #[test]
    fn a_roller_on_a_disk() {
        // The disk is at (0.3, 0.1) as A turns by 90°; the roller is 0.24 m above its centre, 0.01 m deep, and sinks at 0.5 m/s.
        let q = [0.3, 0.0, std::f64::consts::FRAC_PI_2, 0.3, 0.34, 0.0];
        let (p, v) = (parameters(), [0.0, 0.0, 0.0, 0.7, -0.5, 0.0]);
        let x = moving(&p, &q, &v, &[]);
        let force = 1000.0 * 0.01f64.powf(1.5) * (1.0 + 1.5 * 0.2 * 0.5);
        let found = measured(&ProfileContact, &x);
        assert!((found[0] - force).abs() < 2e-4 * force && (found[1] + 0.01).abs() < 1e-6, "{found:?} {force}");
        let rows = rows(&ProfileContact, &x).0;
        let expected = [0.0, force, 0.0, 0.0, -force, 0.0];
        assert!(rows.iter().zip(expected).all(|(a, b)| (a - b).abs() < 3e-4 * force), "{rows:?}");
        let far = moving(&p, &[0.3, 0.0, 0.0, 5.0, 0.34, 0.0], &v, &[]);
        assert_eq!(measured(&ProfileContact, &far)[0], 0.0);
    }

    #[test]
    fn in_the_middle_of_an_opening_nothing_is_undefined() {
        let mut p = parameters();
        p[7..].as_chunks_mut::<2>().0.reverse();
        let x = moving(&p, &[0.0; 6], &[0.0; 6], &[]);
        let at_centre = [0.0, 0.0, 0.0, 0.1, 0.0, 0.0];
        let centre = moving(&p, &at_centre, &[0.0; 6], &[]);
        for x in [x, centre] {
            assert!(measured(&ProfileContact, &x).iter().all(|value| value.is_finite()));
        }
        assert!((measured(&ProfileContact, &centre)[1] - 0.15).abs() < 1e-5);
    }
}
