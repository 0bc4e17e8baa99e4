//! A geometrically exact beam element in space with two nodes.

use crate::elements::beams::Shear;
use crate::elements::beams::section::Deflection;
use crate::elements::spatial::beams::section3::BeamSection3;
use crate::elements::spatial::line3::{MarkerPair, check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame3::PlacedMarker;
use crate::mechanism::rotation::{
    Rotation, e_times, e_transposed_times, matrix, rotation_vector, square, torque_of_rotation_vector,
};
use crate::mechanism::vector::{add, cross, dot, scaled, subtract, transposed_product};
use crate::mechanism::{Body3, ElementIndex, Marker3, Mechanism, Pose3};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A two-node Simo–Reissner beam element in space, straight when unloaded, with large displacements and rotations.
///
/// The section at each end is fixed to a marker: x along the beam, y and z along the principal axes. With the rotation vector
/// ψ of the second section relative to the first, the section R half way between them, and the vector d between the ends:
///
/// $$ \boldsymbol\Gamma = \frac{\mathbf R^{\mathsf T}\mathbf d}{\ell} - \mathbf e_x ,\quad
///    \boldsymbol\kappa = \frac{\boldsymbol\psi}{\ell} ,\qquad
///    U = \tfrac{\ell}{2}\left(\boldsymbol\Gamma^{\mathsf T}\mathbf C_\Gamma\boldsymbol\Gamma
///    + \boldsymbol\kappa^{\mathsf T}\mathbf C_\kappa\boldsymbol\kappa\right) $$
///
/// with C_Γ = diag(EA, GA*_y, GA*_z) and C_κ = diag(GJ, EI_y, EI_z). In U the axial strain is the mean along the deflected axis,
/// as in the planar [`Beam`](crate::elements::Beam), with a factor c for each transverse direction:
/// Γ_x + ½ (c_y Γ_y² + c_z Γ_z²) + β (ψ_y² + ψ_z²)/24. The strains do not change in a rigid-body motion. The mass is that of
/// linear interpolation, the rotary inertia is that of one half of the element at each end. The relative rotation in one element
/// must stay below half a turn.
///
/// # Sources
/// Simo & Vu-Quoc, *CMAME* 58 (1986) 79–116; Crisfield & Jelenić, *Proc. R. Soc. A* 455 (1999) 1125–1147, for strains from the
/// relative rotation.
#[derive(Clone, Copy, Debug)]
pub struct Beam3;

as_object!(Beam3);

element_inputs!(Beam3Inputs {
    a: marker3("section at the first end, x along the beam"),
    b: marker3("section at the second end"),
    length: required("m", 0.9, "unloaded length"),
    axial: required("N", 1e3, "axial stiffness EA"),
    shear_y: required("N", 3e2, "shear stiffness GA* along y"),
    shear_z: required("N", 4e2, "shear stiffness GA* along z"),
    torsion: required("N·m²", 10.0, "torsional stiffness GJ"),
    bending_y: required("N·m²", 20.0, "bending stiffness EI about y"),
    bending_z: required("N·m²", 30.0, "bending stiffness EI about z"),
    mass: required("kg/m", 0.5, "mass per length"),
    inertia_x: required("kg·m", 0.02, "rotary inertia per length about x"),
    inertia_y: required("kg·m", 0.01, "rotary inertia per length about y"),
    inertia_z: required("kg·m", 0.012, "rotary inertia per length about z"),
    cubic: optional("0", "", 1.0, "1 if the axis between the nodes is a cubic, 0 if it is straight"),
    gravity_x: gravity(),
    gravity_y: gravity(),
    gravity_z: gravity(),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "beam",
    family: Family::Beam,
    inputs: INPUTS,
    measures: &[
        Measure::new("normal_force", "N", "normal force half way, positive in tension"),
        Measure::new("shear_force_y", "N", "shear force half way, along y of the section, on the part of a"),
        Measure::new("shear_force_z", "N", "shear force half way, along z of the section, on the part of a"),
        Measure::new("torque", "N·m", "torque half way, about x of the section, on the part of a"),
        Measure::new("moment_y", "N·m", "bending moment half way, about y of the section, on the part of a"),
        Measure::new("moment_z", "N·m", "bending moment half way, about z of the section, on the part of a"),
    ],
    about: "a two-node beam element in space",
    law: "",
    symbol: Symbol::Bar,
};

impl<T: Scalar> Beam3Inputs<'_, T> {
    fn gravity(self) -> [T; 3] {
        [self.gravity_x(), self.gravity_y(), self.gravity_z()]
    }

    /// Factors c of Γ_y²/2 and Γ_z²/2 in the axial strain.
    fn shear_shortening(self) -> [T; 2] {
        let deflection = Deflection { cubic: self.cubic(), length: self.length() };
        let along = |shear: T, bending: T| deflection.shear_shortening(shear, bending);
        [along(self.shear_y(), self.bending_z()), along(self.shear_z(), self.bending_y())]
    }

    /// Rotary inertia of one half.
    fn half_inertia(self) -> [T; 3] {
        let half = self.length() * 0.5;
        [self.inertia_x() * half, self.inertia_y() * half, self.inertia_z() * half]
    }
}

/// Strains and stress resultants of an element half way.
struct Resultants<T> {
    ends: MarkerPair<T>,
    /// Orientation of the first section.
    first: Rotation<T>,
    /// Unit Euler parameters of both sections, with a positive product, and their sum.
    e: [[T; 4]; 2],
    sum: [T; 4],
    strain: [T; 3],
    rotation: [T; 3],
    /// Force and moment along the axes of the section half way.
    force: [T; 3],
    moment: [T; 3],
    /// Gradients of the strain energy per length with respect to Rᵀd/ℓ and to ψ/ℓ.
    end_force: [T; 3],
    end_moment: [T; 3],
}

impl<T: Scalar> Resultants<T> {
    fn of(x: &ElementState<'_, T>) -> Self {
        let (ends, p) = (MarkerPair::of(x), Beam3Inputs(x.p));
        let [first, second] = ends.orientations(x);
        let (a, mut b) = (first.parameters(), second.parameters());
        if (0..4).map(|k| a[k].re() * b[k].re()).sum::<f64>() < 0.0 {
            b = b.map(|x| -x);
        }
        let sum = [0, 1, 2, 3].map(|k| a[k] + b[k]);
        let inverse = p.length().recip();
        let mut strain = scaled(transposed_product(&matrix(&sum), ends.gap()), inverse);
        let rotation = rotation_vector(&first.inverse().then(second).parameters());
        let [cy, cz] = p.shear_shortening();
        let arc = p.cubic() * (rotation[1] * rotation[1] + rotation[2] * rotation[2]) * (1.0 / 24.0);
        strain[0] += (cy * strain[1] * strain[1] + cz * strain[2] * strain[2]) * 0.5 + arc - 1.0;
        let curvature = scaled(rotation, inverse);
        let force = [p.axial() * strain[0], p.shear_y() * strain[1], p.shear_z() * strain[2]];
        let moment = [p.torsion() * curvature[0], p.bending_y() * curvature[1], p.bending_z() * curvature[2]];
        let end_force = [force[0], force[1] + force[0] * cy * strain[1], force[2] + force[0] * cz * strain[2]];
        let bowed = force[0] * p.cubic() * p.length() * (1.0 / 12.0);
        let end_moment = [moment[0], moment[1] + bowed * rotation[1], moment[2] + bowed * rotation[2]];
        Self { ends, first, e: [a, b], sum, strain, rotation, force, moment, end_force, end_moment }
    }

    /// Adds the elastic forces to the rows: the gradient of the strain energy.
    fn add_forces(&self, dynamics: &mut [T]) {
        let MarkerPair { a, b } = &self.ends;
        let force = Rotation::euler_parameters(self.sum).rotate(self.end_force);
        a.frame.add_force(dynamics, a.lever, force.map(|f| -f));
        b.frame.add_force(dynamics, b.lever, force);
        let moment = self.first.rotate(torque_of_rotation_vector(self.rotation, self.end_moment));
        // The section half way turns by E(s) (Eᵀ(a) δφ_a + Eᵀ(b) δφ_b)/|s|² for s = a + b.
        let torque = scaled(cross(force, self.ends.gap()), square(&self.sum).recip());
        let [on_a, on_b] = self.e.map(|e| e_times(&e, &e_transposed_times(&self.sum, torque)));
        a.frame.add_torque(dynamics, subtract(on_a, moment));
        b.frame.add_torque(dynamics, add(on_b, moment));
    }
}

/// Torque of the rotary inertia `j` of a section, in world axes.
fn rotary<T: Scalar>(x: &ElementState<'_, T>, section: &PlacedMarker<T>, j: [T; 3]) -> [T; 3] {
    let times = |w: [T; 3]| [0, 1, 2].map(|k| j[k] * w[k]);
    let omega = section.components(section.frame.angular_velocity(x));
    let alpha = section.components(section.frame.angular_acceleration(x));
    section.world(add(times(alpha), cross(omega, times(omega))))
}

impl Element for Beam3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let (p, resultants) = (Beam3Inputs(x.p), Resultants::of(x));
        resultants.add_forces(dynamics);
        let MarkerPair { a, b } = &resultants.ends;
        let mass = p.length() * p.mass() * (1.0 / 6.0);
        let [one, two] = [a, b].map(|end| subtract(end.frame.acceleration(x, end.lever), p.gravity()));
        a.frame.add_force(dynamics, a.lever, scaled(add(add(one, one), two), mass));
        b.frame.add_force(dynamics, b.lever, scaled(add(add(two, two), one), mass));
        let inertia = p.half_inertia();
        [a, b].into_iter().for_each(|end| end.frame.add_torque(dynamics, rotary(x, end, inertia)));
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let resultants = Resultants::of(x);
        out[..3].copy_from_slice(&resultants.force);
        out[3..].copy_from_slice(&resultants.moment);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let (p, resultants) = (Beam3Inputs(x.p), Resultants::of(x));
        let MarkerPair { a, b } = &resultants.ends;
        let length = p.length();
        let [v, w] = [a, b].map(|end| end.frame.velocity(x, end.lever));
        let translation = p.mass() * length * (dot(v, v) + dot(v, w) + dot(w, w)) * (1.0 / 6.0);
        let spin = |end: &PlacedMarker<T>| {
            let omega = end.components(end.frame.angular_velocity(x));
            (0..3).map(|k| p.half_inertia()[k] * omega[k] * omega[k]).sum::<T>() * 0.5
        };
        let strain = length * dot(resultants.force, resultants.strain) + dot(resultants.moment, resultants.rotation);
        let weight = length * p.mass() * dot(p.gravity(), add(a.point, b.point));
        Energy { kinetic: translation + spin(a) + spin(b), potential: (strain - weight) * 0.5 }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let bad = INPUTS[2..].iter().zip(&p[14..]).take(11).find(|(_, value)| !(**value > 0.0 && value.is_finite()));
        bad.map(|(input, value)| format!("{} is {value} {}, and must be positive", input.about, input.unit))
            .or_else(|| check_ends(p))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds one beam element of the unloaded `length` (m) between two sections: markers with x along the beam and y and z along
    /// the principal axes.
    pub fn beam_element3(
        &mut self,
        name: &str,
        [a, b]: [Marker3<S>; 2],
        length: S,
        section: &BeamSection3<S>,
        shear: Shear,
    ) -> ElementIndex {
        let (coordinates, markers) = ends3(a, b);
        let BeamSection3 { axial, shear: [y, z], torsion, bending, mass, inertia } = *section;
        let cubic = [shear.cubic()];
        let shear = [shear.stiffness(length, y, bending[1]), shear.stiffness(length, z, bending[0])];
        let own =
            [&[length, axial][..], &shear, &[torsion], &bending, &[mass], &inertia, &cubic, &self.gravity].concat();
        self.add_object(name.into(), Beam3::object(), &coordinates, &[markers, own].concat())
    }

    /// Adds an unloaded beam along a line of `points` (m), with one straight element between two points; returns the frames of
    /// its nodes and its elements.
    ///
    /// Elements keep their relative angles where the line has kinks, so that short elements approximate a curved beam.
    ///
    /// * `up`: the z-axis of all sections is as near as possible to this direction (world axes), which must not be parallel to
    ///   an element.
    /// * `ends`: bodies to which the first and the last section are fixed; without one, a node is added.
    pub fn beam3(
        &mut self,
        name: &str,
        points: &[[S; 3]],
        up: [S; 3],
        ends: [Option<Body3>; 2],
        section: &BeamSection3<S>,
        shear: Shear,
    ) -> (Vec<Body3>, Vec<ElementIndex>) {
        let chords: Vec<[S; 3]> = points.windows(2).map(|pair| subtract(pair[1], pair[0])).collect();
        let sections: Vec<Rotation<S>> = chords.iter().map(|&chord| Rotation::from_x_z(chord, up)).collect();
        let Some(last) = sections.len().checked_sub(1) else { return (Vec::new(), Vec::new()) };
        let nodes: Vec<Body3> = (0..points.len())
            .map(|k| {
                let shared = if k == 0 { ends[0] } else { ends[1].filter(|_| k == last + 1) };
                let pose = Pose3::new(points[k], sections[k.min(last)]);
                shared.unwrap_or_else(|| self.massless_frame3(&format!("{name}.{}", k + 1), pose))
            })
            .collect();
        let elements = (0..sections.len())
            .map(|k| {
                let markers = [k, k + 1].map(|node| self.marker_on(nodes[node], Pose3::new(points[node], sections[k])));
                let length = dot(chords[k], chords[k]).sqrt();
                self.beam_element3(&format!("{name} element {}", k + 1), markers, length, section, shear)
            })
            .collect();
        (nodes, elements)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::Beam;
    use crate::elements::element_tests::{at, close, energies, measured, rows};
    use crate::elements::spatial::line3::{points, upright};

    const SECTION: [f64; 15] = [2.0, 100.0, 30.0, 40.0, 10.0, 20.0, 50.0, 0.6, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, -10.0];

    #[test]
    fn stretched_and_twisted_by_known_amounts() {
        // Stretched from 2 m to 2.2 m and twisted by 0.3 rad: N = 10 N, torque 1.5 N·m, ½·10·0.2 + ½·1.5·0.3 J.
        let p = [&points([0.0; 3], [0.0; 3])[..], &SECTION].concat();
        let mut q = upright([0.0; 3], [2.2, 0.0, 0.0]);
        q[10..].copy_from_slice(&Rotation::about_x(0.3).parameters());
        let x = at(&p, &q, &[]);
        close(&measured(&Beam3, &x), &[10.0, 0.0, 0.0, 1.5, 0.0, 0.0]);
        close(&energies(&Beam3, &x), &[0.0, 1.225]);
        let computed = rows(&Beam3, &x).0;
        // Half of the weight of 12 N at each end; the torque acts by 2 Eᵀ m.
        close(&computed[..4], &[-10.0, 0.0, 6.0, 0.0]);
        close(&computed[4..10], &[-3.0, 0.0, 0.0, 10.0, 0.0, 6.0]);
    }

    #[test]
    fn in_a_plane_a_cubic_has_the_forces_of_the_planar_element() {
        // GA* of the residual bending flexibility and a shear flexibility; turned by ±0.1 rad about z at the ends, with shear.
        let mut p = [&points([0.0; 3], [0.0; 3])[..], &SECTION].concat();
        p[25] = 1.0;
        let mut q = upright([0.0; 3], [2.02, 0.04, 0.0]);
        q[3..7].copy_from_slice(&Rotation::about_z(-0.1).parameters());
        q[10..].copy_from_slice(&Rotation::about_z(0.1).parameters());
        let planar = [2.0, 100.0, 30.0, 50.0, 0.6, 0.3, 0.0, 0.0, 1.0, 0.0, 0.0];
        let y = [0.0, 0.0, -0.1, 2.02, 0.04, 0.1];
        let (spatial, plane) = (rows(&Beam3, &at(&p, &q, &[])).0, rows(&Beam, &at(&planar, &y, &[])).0);
        close(&[spatial[0], spatial[1], spatial[7], spatial[8]], &[plane[0], plane[1], plane[3], plane[4]]);
        // The torque m about z acts on the Euler parameters by 2 Eᵀ m: its component along the rotation is m/½ cos.
        let turning = |e: &[f64], row: &[f64]| 0.5 * (-e[3] * row[0] + e[0] * row[3]);
        close(&[turning(&q[3..7], &spatial[3..7]), turning(&q[10..], &spatial[10..])], &[plane[2], plane[5]]);
        let found = measured(&Beam3, &at(&p, &q, &[]));
        let expected = measured(&Beam, &at(&planar, &y, &[]));
        close(&[found[0], found[1], found[5]], &[expected[2], expected[3], 50.0 * 0.1]);
    }

    #[test]
    fn bent_to_an_arc_it_has_no_shear() {
        // Turned by 0.4 rad about z at the end, with the chord in the middle direction.
        let p = [&points([0.0; 3], [0.0; 3])[..], &SECTION].concat();
        let mut q = upright([0.0; 3], [2.0 * 0.2f64.cos(), 2.0 * 0.2f64.sin(), 0.0]);
        q[10..].copy_from_slice(&Rotation::about_z(0.4).parameters().map(|e| -e));
        close(&measured(&Beam3, &at(&p, &q, &[])), &[0.0, 0.0, 0.0, 0.0, 0.0, 10.0]);
        let mut bad = p;
        bad[16] = 0.0;
        assert!(Beam3.validate_parameters(&bad).unwrap().contains("GA* along y is 0 N"));
    }
}
