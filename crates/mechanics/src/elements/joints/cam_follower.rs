//! A cam with a follower.

use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::Frame;
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A cam and its follower: point B of one body stays on the profile of a cam, which is fixed to another body at point A.
///
/// The profile is a periodic function of the polar angle φ around A, from x of the cam's body to B:
///
/// $$ \Phi = |\mathbf r_B - \mathbf r_A| - r(\varphi) = 0 ,\qquad
///    r(\varphi) = r_0 + \tfrac{h}{2}\left(1 - \cos(\varphi - \varphi_0)\right) $$
///
/// with the base radius r₀, the lift h and the angle φ₀ of the smallest radius. **u** is the unit vector from A to B
/// and **t** the unit vector normal to it. **e** is the direction of the smallest radius, fixed to the cam, so that
/// cos(φ − φ₀) = **u**·**e**. The contact force acts at B along the gradient **n** = **u** + h/(2ρ) (**e**·**t**) **t** with
/// the distance ρ = |r_B − r_A|. λ is its component along **u** in N, positive if it pulls the follower to the cam.
///
/// The constraint is bilateral, as for a grooved (form-closed) cam: a negative measured force means that an open cam would
/// lose contact.
///
/// # Sources
/// Norton, *Cam Design and Manufacturing Handbook* (2009), for simple harmonic profiles.
#[derive(Clone, Copy, Debug)]
pub struct CamFollower;

as_object!(CamFollower);

element_inputs!(CamFollowerInputs {
    a: marker("centre of the cam"),
    b: marker("point of the follower"),
    base_radius: required("m", 0.3, "smallest radius of the profile"),
    lift: required("m", 0.1, "largest radius minus smallest radius"),
    phase: optional("0", "rad", 0.4, "angle of the smallest radius on the cam"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "cam-follower",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[
        Measure::new(
            "force",
            "N",
            "contact force along the normal of the profile, positive if the cam pushes the follower",
        ),
        Measure::new("lift", "m", "distance of the points minus the base radius"),
    ],
    about: "a cam around a, with point b as its follower",
    law: "|r_b − r_a| = r₀ + h/2·(1 − cos(φ − φ₀)) with the base radius r₀, the lift h, the polar angle φ of b around a from x of the body of a, and the angle φ₀ of the smallest radius",
    symbol: Symbol::Cam,
};

impl CamFollower {
    /// cos(φ − φ₀), and the component of the gradient **n** along **t**.
    fn profile<T: Scalar>(x: &ElementState<'_, T>, line: &Line<T>) -> (T, T) {
        let p = CamFollowerInputs(x.p);
        let (sin, cos) = (Frame::of(x, 0).theta + p.phase()).sin_cos();
        let [ux, uy] = line.direction;
        let tangential = p.lift() * (cos * -uy + sin * ux) / (line.length * 2.0);
        (cos * ux + sin * uy, tangential)
    }
}

impl Element for CamFollower {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (p, line) = (CamFollowerInputs(x.p), Line::of(x));
        let (cos, tangential) = Self::profile(x, &line);
        constraint[0] = line.length - p.base_radius() - p.lift() * 0.5 * (-cos + 1.0);
        let [ux, uy] = line.direction;
        let [fx, fy] = [ux - tangential * uy, uy + tangential * ux].map(|n| n * x.l[0]);
        line.apply([fx, fy], dynamics);
        // `apply` lets the force on the cam act at A; it acts at B.
        dynamics[2] -= line.gap[0] * fy - line.gap[1] * fx;
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        let tangential = Self::profile(x, &line).1;
        out[0] = -x.l[0] * (tangential * tangential + 1.0).sqrt();
        out[1] = line.length - CamFollowerInputs(x.p).base_radius();
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let radius = CamFollowerInputs(p).base_radius();
        (!(radius > 0.0)).then(|| format!("its base radius is {radius} m"))
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps point `b` on the profile of a cam around `a`: base radius (m), lift (m), angle of the smallest radius (rad).
    pub fn cam_follower(&mut self, name: &str, a: Marker<S>, b: Marker<S>, profile: [S; 3]) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), CamFollower::object(), &coordinates, &[&p[..], &profile[..]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};
    use autodiff::Jet2;

    /// Base radius 0.3 m, lift 0.1 m, smallest radius at 0.4 rad on the cam.
    const P: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.3, 0.1, 0.4];

    #[test]
    fn a_translating_follower_moves_as_the_formula_says() {
        // The follower is above the centre: φ = π/2 − θ, with the cam at θ = 0.2 + ω t, ω = 7 rad/s.
        let omega = 7.0;
        for k in 0..8 {
            let theta = 0.2 + f64::from(k);
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 - theta - 0.4).sin_cos();
            let height = 0.35 - 0.05 * cos;
            let (speed, acceleration) = (-0.05 * omega * sin, 0.05 * omega * omega * cos);
            let zero = Jet2::new(0.0, 0.0, 0.0);
            let q = [zero, zero, Jet2::new(theta, omega, 0.0), zero, Jet2::new(height, speed, acceleration), zero];
            let p = P.map(|p| Jet2::new(p, 0.0, 0.0));
            let x = ElementState {
                t: zero,
                p: &p,
                q: &q,
                v: &[zero; 6],
                a: &[zero; 6],
                l: &[zero],
                sides: Default::default(),
            };
            let (mut dynamics, mut constraint) = ([zero; 6], [zero]);
            Element::residual(&CamFollower, &x, &mut dynamics, &mut constraint);
            close(&[constraint[0].re, constraint[0].v1, constraint[0].v2], &[0.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn the_torque_of_the_cam_lifts_the_follower() {
        // A quarter turn from the smallest radius the follower moves by h/2 per radian, downwards if the cam turns
        // counter-clockwise. The cam pushes it up with 20 N, and 20 N · 0.05 m = 1 N·m turn the cam counter-clockwise.
        let q = [0.0, 0.0, -0.4, 0.0, 0.35, 0.0];
        let x = at(&P, &q, &[-20.0]);
        let (dynamics, constraint) = rows(&CamFollower, &x);
        close(&constraint, &[0.0]);
        let across = 20.0 * 0.05 / 0.35;
        close(&dynamics, &[across, 20.0, -1.0, -across, -20.0, 0.0]);
        close(&measured(&CamFollower, &x), &[20.0 * (1.0 + (0.05f64 / 0.35).powi(2)).sqrt(), 0.05]);
        assert!(CamFollower.validate_parameters(&[0.0; 7]).is_some());
    }
}
