//! A geometrically exact planar beam element with two nodes.

use crate::elements::beams::section::{BeamSection, Deflection, Shear};
use crate::elements::beams::shape::BeamShape;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::{Body, ElementIndex, Mechanism, WeightedQuantity};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A two-node Simo–Reissner beam element with large displacements and rotations.
///
/// Strains at the mid-point, with θ = (θ_i + θ_j)/2 and the distance (Δx, Δy) of the nodes:
///
/// $$ a = \frac{\Delta x\cos\theta + \Delta y\sin\theta}{\ell},\quad
///    \gamma = \frac{-\Delta x\sin\theta + \Delta y\cos\theta}{\ell},\quad
///    \kappa = \frac{\theta_j - \theta_i}{\ell},\qquad
///    U = \tfrac{\ell}{2}\left(EA\,\varepsilon^2 + 2 N_0\,\varepsilon + GA^*\gamma^2 + EI(\kappa-\varphi_0/\ell)^2\right) $$
///
/// where N₀ is the normal force at the unloaded length, a prestress, and φ₀ the angle from the first to the second node without
/// load. An unloaded arc is a polygon of such elements, whose length is their chord. The axial strain is the mean along the
/// deflected axis:
///
/// $$ \varepsilon = a - 1 + \tfrac12 c\,\gamma^2 + \tfrac{\beta}{24}\left((\theta_j-\theta_i)^2 - \varphi_0^2\right),\quad
///    c = r(2-r) + \tfrac15 r^2,\quad r = \beta\,\frac{GA^*\ell^2}{12\,EI} $$
///
/// With β = 1 the axis between the nodes is the cubic whose bending flexibility GA* contains: its slope differs from that of the
/// chord by rγ in the mean of both ends, and ½ ∫ (w′)² dx/ℓ = (rγ)²/10 + (θ_j − θ_i)²/24 with the deflection w from the chord;
/// the shear strain is (1 − r)γ, and a − 1 = |r′| − 1 − γ²/2. With β = 0 the axis is straight between the nodes and ε = a − 1.
/// A tension therefore stiffens the element against bending as it does a beam, and an element buckles at 12 EI/ℓ².
///
/// The consistent mass is that of linear interpolation; it is constant, planar beams have no gyroscopic terms.
///
/// End moments are positive if they turn the tangent counter-clockwise along i → j.
///
/// # Sources
/// Simo, *CMAME* 49 (1985) 55–70; one-point integration as in Simo & Vu-Quoc, *J. Appl. Mech.* 53 (1986)
/// 849–854. For GA* with residual bending flexibility see [`Shear`]. Crisfield, *CMAME* 81 (1990) 131–150, for the mean axial
/// strain of a cubic.
#[derive(Clone, Copy, Debug)]
pub struct Beam;

as_object!(Beam);

element_inputs!(BeamInputs {
    i: body("first node"),
    j: body("second node"),
    length: required("m", 0.4, "unloaded length"),
    axial: required("N", 1e3, "axial stiffness EA"),
    shear: required("N", 3e2, "shear stiffness GA*"),
    bending: required("N·m²", 20.0, "bending stiffness EI"),
    mass: required("kg/m", 0.5, "mass per length"),
    inertia: required("kg·m", 0.01, "rotary inertia per length"),
    turn: optional("0", "rad", 0.1, "angle from the first to the second node without load"),
    tension: optional("0", "N", 2.0, "normal force at the unloaded length"),
    cubic: optional("0", "", 1.0, "1 if the axis between the nodes is a cubic, 0 if it is straight"),
    gravity_x: gravity(),
    gravity_y: gravity(),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "beam",
    family: Family::Beam,
    inputs: INPUTS,
    measures: &[
        Measure::new("moment_i", "N·m", "bending moment at the first node"),
        Measure::new("moment_j", "N·m", "bending moment at the second node"),
        Measure::new("normal_force", "N", "normal force, positive in tension"),
        Measure::new("shear_force", "N", "shear force"),
    ],
    about: "a two-node beam element",
    law: "",
    symbol: Symbol::Bar,
};

impl<T: Scalar> BeamInputs<'_, T> {
    /// Factor c of γ²/2 in the axial strain.
    fn shear_shortening(self) -> T {
        let deflection = Deflection { cubic: self.cubic(), length: self.length() };
        deflection.shear_shortening(self.shear(), self.bending())
    }
}

/// Strains and stress resultants at the mid-point.
struct SectionForces<T> {
    /// Stretch a of the nodes' distance along the mean section, 1 without load.
    stretch: T,
    shear: T,
    /// Axial strain ε.
    strain: T,
    cos: T,
    sin: T,
    normal_force: T,
    shear_force: T,
    /// Gradient of the strain energy per length with respect to γ: the force across the mean section.
    transverse_force: T,
    /// Moment of the curvature, EI (κ − φ₀/ℓ).
    moment: T,
    /// Gradient of the strain energy with respect to θ_j − θ_i: the mean of the moments at the ends.
    end_moment: T,
}

impl<T: Scalar> SectionForces<T> {
    #[inline]
    fn of(x: &ElementState<'_, T>) -> Self {
        let (p, q) = (BeamInputs(x.p), x.q);
        let (sin, cos) = ((q[2] + q[5]) * 0.5).sin_cos();
        let inverse = p.length().recip();
        let (dx, dy) = ((q[3] - q[0]) * inverse, (q[4] - q[1]) * inverse);
        let (stretch, shear) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let (turn, shortening) = (q[5] - q[2], p.shear_shortening());
        let arc = p.cubic() * (turn * turn - p.turn() * p.turn()) * (1.0 / 24.0);
        let strain = stretch - 1.0 + shortening * shear * shear * 0.5 + arc;
        let normal_force = p.axial() * strain + p.tension();
        let shear_force = p.shear() * shear;
        let moment = p.bending() * (turn - p.turn()) * inverse;
        Self {
            normal_force,
            shear_force,
            transverse_force: shear_force + normal_force * shortening * shear,
            moment,
            end_moment: moment + normal_force * p.cubic() * p.length() * turn * (1.0 / 12.0),
            stretch,
            shear,
            strain,
            cos,
            sin,
        }
    }

    /// Half the torque of the end forces: ℓ/2 (N γ − Q a), with the transverse force Q.
    #[inline]
    fn half_torque(&self, length: T) -> T {
        length * 0.5 * (self.normal_force * self.shear - self.transverse_force * self.stretch)
    }
}

impl Element for Beam {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let (p, s) = (BeamInputs(x.p), SectionForces::of(x));
        let (along, across) = (s.normal_force, s.transverse_force);
        let force = [along * s.cos - across * s.sin, along * s.sin + across * s.cos];
        let torque = s.half_torque(p.length());
        let (mass, inertia) = (p.length() * p.mass() * (1.0 / 6.0), p.length() * p.inertia() * (1.0 / 6.0));
        for (k, gravity) in [p.gravity_x(), p.gravity_y()].into_iter().enumerate() {
            let (ai, aj) = (x.a[k] - gravity, x.a[3 + k] - gravity);
            dynamics[k] = mass * (ai * 2.0 + aj) - force[k];
            dynamics[3 + k] = mass * (ai + aj * 2.0) + force[k];
        }
        dynamics[2] = inertia * (x.a[2] * 2.0 + x.a[5]) + torque - s.end_moment;
        dynamics[5] = inertia * (x.a[2] + x.a[5] * 2.0) + torque + s.end_moment;
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let s = SectionForces::of(x);
        let torque = s.half_torque(BeamInputs(x.p).length());
        (out[0], out[1]) = (s.end_moment - torque, s.end_moment + torque);
        (out[2], out[3]) = (s.normal_force, s.shear_force);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let (s, p, v) = (SectionForces::of(x), BeamInputs(x.p), x.v);
        let length = p.length();
        let strain = (s.normal_force + p.tension()) * s.strain + s.shear_force * s.shear;
        let bend = s.moment * (x.q[5] - x.q[2] - p.turn());
        let square = |k: usize| v[k] * v[k] + v[k] * v[3 + k] + v[3 + k] * v[3 + k];
        let weight = p.gravity_x() * (x.q[0] + x.q[3]) + p.gravity_y() * (x.q[1] + x.q[4]);
        Energy {
            kinetic: length * (p.mass() * (square(0) + square(1)) + p.inertia() * square(2)) * (1.0 / 6.0),
            potential: (length * strain + bend) * 0.5 - length * p.mass() * weight * 0.5,
        }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let names = ["length", "EA", "GA*", "EI", "mass per length"];
        let bad = names.iter().zip(p).find(|(_, value)| !(**value > 0.0 && value.is_finite()));
        bad.map(|(name, value)| format!("{name} is {value}"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds one beam element of the unloaded `length` between two nodes.
    pub fn beam_element(
        &mut self,
        name: &str,
        nodes: [Body; 2],
        length: S,
        section: &BeamSection<S>,
        shear: Shear,
    ) -> ElementIndex {
        self.shaped_element(name, nodes, section.parameters(length, shear, [S::from(0.0); 2], self.gravity))
    }

    fn shaped_element(&mut self, name: &str, [i, j]: [Body; 2], parameters: [S; 11]) -> ElementIndex {
        self.add_object(name.into(), Beam::object(), &[i.x, i.y, i.theta, j.x, j.y, j.theta], &parameters)
    }

    /// Adds a straight unloaded beam of equal elements between the points `from` and `to`; returns its nodes and elements.
    ///
    /// Where a body is given in `ends`, the end of the beam shares its x and y, as with a revolute joint. The rotations at
    /// both ends belong to the beam.
    pub fn beam(
        &mut self,
        name: &str,
        span: [[S; 2]; 2],
        ends: [Option<Body>; 2],
        elements: usize,
        section: &BeamSection<S>,
        shear: Shear,
    ) -> (Vec<Body>, Vec<ElementIndex>) {
        let zero = S::from(0.0);
        self.curved_beam(name, BeamShape { span, rise: zero, tension: zero }, ends, elements, section, shear)
    }

    /// Adds a beam as [`Mechanism::beam`] whose unloaded shape is an arc, with a prestress.
    pub fn curved_beam(
        &mut self,
        name: &str,
        shape: BeamShape<S>,
        ends: [Option<Body>; 2],
        elements: usize,
        section: &BeamSection<S>,
        shear: Shear,
    ) -> (Vec<Body>, Vec<ElementIndex>) {
        let mut nodes = Vec::with_capacity(elements + 1);
        for k in 0..=elements {
            let pose = shape.pose(k as f64 / elements as f64);
            let shared = if k == 0 {
                ends[0]
            } else if k == elements {
                ends[1]
            } else {
                None
            };
            nodes.push(match shared {
                Some(end) => {
                    Body { theta: self.coordinate(format!("{name}.{}.theta", k + 1), pose.theta, S::from(0.0)), ..end }
                }
                None => self.massless_node(&format!("{name}.{}", k + 1), pose),
            });
        }
        let own = [-shape.angle() * (1.0 / elements as f64), shape.tension];
        let parameters = section.parameters(shape.element_length(elements), shear, own, self.gravity);
        let element = |k: usize| format!("{name} element {}", k + 1);
        let indices =
            (0..elements).map(|k| self.shaped_element(&element(k), [nodes[k], nodes[k + 1]], parameters)).collect();
        (nodes, indices)
    }

    /// The stress (N/m²) in the fibre at `distance` (m) to the left of the axis, at end i (0) or j (1) of an element:
    ///
    /// $$ \sigma = \frac{N}{A} - \frac{M e}{I} = E\left(\frac{N}{EA} - \frac{M e}{EI}\right) $$
    ///
    /// * `young`: E in N/m². A moment that bends to the left compresses the fibres on that side.
    ///
    /// # Errors
    /// [`crate::Error::Definition`] if the element is not a beam or `end` is neither 0 nor 1.
    pub fn fibre_stress(
        &self,
        element: ElementIndex,
        end: usize,
        section: &BeamSection<S>,
        young: S,
        distance: S,
    ) -> crate::Result<[WeightedQuantity<S>; 2]> {
        let end = ["moment_i", "moment_j"].get(end).copied().unwrap_or("a third end");
        let normal = self.measure(element, "normal_force")?.times(young / section.axial);
        Ok([normal, self.measure(element, end)?.times(-young * distance / section.bending)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, energies, measured, rows};

    const P: [f64; 11] = [2.0, 1000.0, 300.0, 60.0, 3.0, 0.5, 0.0, 0.0, 0.0, 0.0, -10.0];

    #[test]
    fn stretched_bent_and_sheared_by_hand() {
        // Mean rotation zero: stretch 0.01, shear 0.02, curvature 0.1; N = 10, V = 6, M = 6; torque 1·(10·0.02 − 6·1.01).
        let x = at(&P, &[0.0, 0.0, -0.1, 2.02, 0.04, 0.1], &[]);
        let torque = 0.2 - 6.06;
        close(&measured(&Beam, &x), &[6.0 - torque, 6.0 + torque, 10.0, 6.0]);
        // Half of the weight of 6 kg on each end: mass/6 (2 + 1) g ℓ = 30 N.
        close(&rows(&Beam, &x).0, &[-10.0, 24.0, torque - 6.0, 10.0, 36.0, torque + 6.0]);
        // ½ ℓ (N a + V γ + M κ) = 0.1 + 0.12 + 0.6, and the weight of 6 kg lifted by 0.02 m.
        close(&energies(&Beam, &x), &[0.0, 0.82 + 1.2]);
    }

    #[test]
    fn curved_and_prestressed_by_hand() {
        // As above with the unloaded angle 0.15 and the prestress 5: N = 15, M = 60 (0.2 − 0.15)/2 = 1.5.
        let mut p = P;
        (p[6], p[7]) = (0.15, 5.0);
        let x = at(&p, &[0.0, 0.0, -0.1, 2.02, 0.04, 0.1], &[]);
        let torque = 15.0 * 0.02 - 6.06;
        close(&measured(&Beam, &x), &[1.5 - torque, 1.5 + torque, 15.0, 6.0]);
        // ½ 10 · 0.02 + 5 · 0.02 + 0.12 + ½ 1.5 · 0.05, and the weight.
        close(&energies(&Beam, &x), &[0.0, 0.1 + 0.1 + 0.12 + 0.0375 + 1.2]);
    }

    #[test]
    fn the_axis_of_a_cubic_is_longer_than_its_chord() {
        // GA* = 120 of the bending flexibility 1/180 and the shear flexibility 1/360: r = 2/3, c = 4/3 · 2/3 + 4/45 = 44/45.
        let mut p = P;
        (p[2], p[6], p[7], p[8]) = (120.0, 0.15, 5.0, 1.0);
        let x = at(&p, &[0.0, 0.0, -0.1, 2.02, 0.04, 0.1], &[]);
        // ε = 0.01 + 22/45 · 0.02² + (0.2² − 0.15²)/24, M = 60 (0.2 − 0.15)/2, V = 120 · 0.02.
        let strain = 0.01 + 22.0 / 45.0 * 4e-4 + 0.0175 / 24.0;
        let normal = 1000.0 * strain + 5.0;
        let torque = normal * 0.02 - (2.4 + normal * 44.0 / 45.0 * 0.02) * 1.01;
        let moment = 1.5 + normal * 2.0 * 0.2 / 12.0;
        close(&measured(&Beam, &x), &[moment - torque, moment + torque, normal, 2.4]);
        close(&energies(&Beam, &x), &[0.0, (normal + 5.0) * strain + 0.048 + 0.0375 + 1.2]);
        // A circular arc of 0.4 rad has the length of its axis, but for the fourth power of the angle: its chord is 2 sin(0.2)/0.2.
        let chord = 2.0 * 0.2f64.sin() / 0.2;
        (p[6], p[7]) = (0.0, 0.0);
        let arc = measured(&Beam, &at(&p, &[0.0, 0.0, -0.2, chord, 0.0, 0.2], &[]));
        assert!(arc[2].abs() < 1000.0 * 0.2f64.powi(4) / 100.0, "normal force {}", arc[2]);
    }

    #[test]
    fn moves_as_a_rigid_bar_of_its_mass() {
        // Both ends accelerate by 1 m/s²: 6 kg; turning by 1 rad/s: kinetic energy of the rotary inertia ½·0.5·2.
        let q = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0];
        let x = ElementState {
            t: 0.0,
            p: &P,
            q: &q,
            v: &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
            a: &[1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            l: &[],
            sides: Default::default(),
        };
        let (dynamics, _) = rows(&Beam, &x);
        close(&[dynamics[0] + dynamics[3]], &[6.0]);
        close(&energies(&Beam, &x)[..1], &[0.5]);
        assert!(Beam.validate_parameters(&[1.0, 1.0, 1.0, -1.0, 1.0]).unwrap().contains("EI"));
    }
}
