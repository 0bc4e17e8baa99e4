//! A bushing in space: an elastic connection of two markers.

use crate::elements::spatial::line3::{MarkerPair, check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::rotation::{rotation_vector, torque_of_rotation_vector};
use crate::mechanism::vector::{add, cross, norm, subtract};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A bushing in space: linear springs and dampers between two markers along the axes of A, and about them.
///
/// With the displacement d of B from A and the rotation vector θ of B relative to A, both along the axes of the marker A,
/// the force on A is K d + C v, where v is the velocity of B seen from A. The torque on A has the elastic part T⁻ᵀ(θ) K_θ θ,
/// the gradient of ½ θᵀK_θθ (K_θ θ for small rotations, and about an axis of A for any), and the damping C_θ ω of the relative
/// angular velocity. The force acts at the point B on both bodies. The relative rotation must stay below half a turn, where the
/// torque jumps; an analysis warns of more than 90 % of it.
///
/// # Sources
/// Blundell & Harty, *The Multibody Systems Approach to Vehicle Dynamics* (2004), Chapter 3.
#[derive(Clone, Copy, Debug)]
pub struct Bushing3;

as_object!(Bushing3);

element_inputs!(Bushing3Inputs {
    a: marker3("marker of the first body"),
    b: marker3("marker of the second body"),
    stiffness_x: required("N/m", 15.0, "stiffness along x of a"),
    stiffness_y: required("N/m", 10.0, "stiffness along y of a"),
    stiffness_z: required("N/m", 12.0, "stiffness along z of a"),
    torsional_x: required("N·m/rad", 2.0, "torsional stiffness about x of a"),
    torsional_y: required("N·m/rad", 3.0, "torsional stiffness about y of a"),
    torsional_z: required("N·m/rad", 1.0, "torsional stiffness about z of a"),
    damping_x: optional("0", "N·s/m", 1.0, "damping along x of a"),
    damping_y: optional("0", "N·s/m", 0.5, "damping along y of a"),
    damping_z: optional("0", "N·s/m", 0.7, "damping along z of a"),
    torsional_damping_x: optional("0", "N·m·s/rad", 0.1, "torsional damping about x of a"),
    torsional_damping_y: optional("0", "N·m·s/rad", 0.2, "torsional damping about y of a"),
    torsional_damping_z: optional("0", "N·m·s/rad", 0.15, "torsional damping about z of a"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "bushing",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("force_x", "N", "force on a along x of its marker, positive if b is displaced in this direction"),
        Measure::new("force_y", "N", "force on a along y of its marker, positive if b is displaced in this direction"),
        Measure::new("force_z", "N", "force on a along z of its marker, positive if b is displaced in this direction"),
        Measure::new(
            "torque_x",
            "N·m",
            "torque on a about x of its marker without that of the force, positive if b is turned this way",
        ),
        Measure::new(
            "torque_y",
            "N·m",
            "torque on a about y of its marker without that of the force, positive if b is turned this way",
        ),
        Measure::new(
            "torque_z",
            "N·m",
            "torque on a about z of its marker without that of the force, positive if b is turned this way",
        ),
    ],
    about: "an elastic connection of two markers",
    law: "force = stiffness·displacement + damping·velocity of b seen from a, component by component in axes of the marker of a; it acts \
          at the point b on both bodies. torque = gradient of ½ Σ torsional·θ² + torsional_damping·relative angular velocity, with the \
          rotation vector θ of b from a in axes of a: torsional·θ for small rotations, or about an axis of a. At half a turn it jumps",
    symbol: Symbol::None,
};

/// Rotation in rad from which an analysis warns: at π the direction of the rotation vector jumps.
const DOUBTFUL: f64 = 0.9 * std::f64::consts::PI;

/// Displacement and rotation of a bushing and their rates, along the axes of the marker A.
struct Deformation3<T> {
    ends: MarkerPair<T>,
    gap: [T; 3],
    rotation: [T; 3],
}

/// Entries `first..first + 3` of the parameters after the markers.
fn triple<T: Copy>(p: &[T], first: usize) -> [T; 3] {
    [0, 1, 2].map(|k| p[14 + first + k])
}

fn times<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [0, 1, 2].map(|k| a[k] * b[k])
}

impl<T: Scalar> Deformation3<T> {
    fn of(x: &ElementState<'_, T>) -> Self {
        let ends = MarkerPair::of(x);
        let gap = ends.a.components(ends.gap());
        let [a, b] = ends.orientations(x);
        let rotation = rotation_vector(&a.inverse().then(b).parameters());
        Self { ends, gap, rotation }
    }

    /// Force and torque on A along the axes of its marker.
    fn loads(&self, x: &ElementState<'_, T>) -> [[T; 3]; 2] {
        let Self { ends, gap, rotation } = self;
        let omega = ends.a.frame.angular_velocity(x);
        // Seen from A, B moves by its velocity relative to the point of A that coincides with it.
        let rate = ends.a.components(subtract(ends.gap_rate(x), cross(omega, ends.gap())));
        let spin = ends.a.components(subtract(ends.b.frame.angular_velocity(x), omega));
        let elastic = torque_of_rotation_vector(*rotation, times(triple(x.p, 3), *rotation));
        let force = add(times(triple(x.p, 0), *gap), times(triple(x.p, 6), rate));
        [force, add(elastic, times(triple(x.p, 9), spin))]
    }
}

impl Element for Bushing3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let deformation = Deformation3::of(x);
        let [force, torque] = deformation.loads(x).map(|load| deformation.ends.a.world(load).map(|x| -x));
        deformation.ends.apply_at_b(force, dynamics);
        deformation.ends.apply_torque(torque, dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out.copy_from_slice(Deformation3::of(x).loads(x).as_flattened());
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let Deformation3 { gap, rotation, .. } = Deformation3::of(x);
        let squares = |k: [T; 3], u: [T; 3]| times(k, times(u, u)).into_iter().sum::<T>() * 0.5;
        Energy { kinetic: T::zero(), potential: squares(triple(x.p, 0), gap) + squares(triple(x.p, 3), rotation) }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p)
    }

    fn warn_of_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        let stiffness = triple(x.p, 3);
        let angle = norm(Deformation3::of(x).rotation);
        (angle > DOUBTFUL && stiffness != [0.0; 3]).then(|| {
            format!(
                "b is turned by {:.0}° against a: at half a turn the torque jumps. Use a joint with an angle and a `coordinate-spring`",
                angle.to_degrees()
            )
        })
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins two markers elastically: stiffnesses and dampings, each along x, y, z and about x, y, z of the marker `a`.
    pub fn bushing3(
        &mut self,
        name: &str,
        a: Marker3<S>,
        b: Marker3<S>,
        stiffness: [S; 6],
        damping: [S; 6],
    ) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add_object(name.into(), Bushing3::object(), &coordinates, &[&p[..], &stiffness, &damping].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::spatial::line3::{points, upright};
    use crate::mechanism::Rotation;

    #[test]
    fn displaced_and_turned_in_the_axes_of_a_turned_body() {
        // The body of A is turned by 90° about z: +y of the world is +x of its axes. B is 0.1 m above A and rises by 2 m/s,
        // and is turned by 0.2 rad about z relative to A, with 0.5 rad/s.
        let p =
            [&points([0.0; 3], [0.0; 3])[..], &[100.0, 50.0, 70.0, 5.0, 6.0, 10.0], &[1.0, 2.0, 4.0, 7.0, 8.0, 3.0]]
                .concat();
        let quarter = std::f64::consts::FRAC_PI_2;
        let (mut q, mut v) = (upright([0.0; 3], [0.0, 0.1, 0.0]), [0.0; 14]);
        q[3..7].copy_from_slice(&Rotation::about_z(quarter).parameters());
        let e = Rotation::about_z(quarter + 0.2).parameters();
        q[10..].copy_from_slice(&e);
        v[8] = 2.0;
        (v[10], v[13]) = (-0.25 * e[3], 0.25 * e[0]);
        let x = moving(&p, &q, &v, &[]);
        close(&measured(&Bushing3, &x), &[12.0, 0.0, 0.0, 0.0, 0.0, 3.5]);
        close(&rows(&Bushing3, &x).0[7..10], &[0.0, 12.0, 0.0]);
        close(&energies(&Bushing3, &x), &[0.0, 0.7]);
    }

    /// For a rotation by 60° about (1, 1, 1) with a stiffness about x only, the torque has components about y and z, too.
    #[test]
    fn torques_of_large_rotations_are_the_gradient_of_the_energy() {
        let p = [&points([0.0; 3], [0.0; 3])[..], &[0.0, 0.0, 0.0, 1.0], &[0.0; 8]].concat();
        let turned = |rotation: Rotation<f64>| {
            let mut q = upright([0.0; 3], [0.0; 3]);
            q[10..].copy_from_slice(&rotation.parameters());
            q
        };
        let rotation = Rotation::about([1.0; 3], std::f64::consts::FRAC_PI_3);
        let q = turned(rotation);
        let torque = measured(&Bushing3, &moving(&p, &q, &[0.0; 14], &[]))[3..].to_vec();
        let small = 1e-6;
        let energy = |axis: [f64; 3], angle: f64| {
            let q = turned(Rotation::about(axis, angle).then(rotation));
            energies(&Bushing3, &moving(&p, &q, &[0.0; 14], &[]))[1]
        };
        let slope = |axis| (energy(axis, small) - energy(axis, -small)) / (2.0 * small);
        let gradient = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(slope);
        assert!(torque.iter().zip(gradient).all(|(a, b)| (a - b).abs() < 1e-9), "{torque:?} {gradient:?}");
        assert!((torque[0] - 0.5671).abs() < 1e-4 && (torque[1] - 0.2015).abs() < 1e-4, "{torque:?}");
    }
}
