//! Beams in space: equal to planar beams in a plane, and compared with the equations of rods, solved by shooting, and with
//! closed forms.

use crate::watch;
use linkwright_mechanics::elements::spatial::{BeamSection3, LoadKind3};
use linkwright_mechanics::elements::{BeamSection, Shear};
use linkwright_mechanics::initial_conditions::assemble;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::mechanism::Rotation;
use linkwright_mechanics::motion::{ConstantSpeed, Fixed};
use linkwright_mechanics::system::System;
use linkwright_mechanics::system::state::State;
use linkwright_mechanics::{Assembly, Mechanism, Statics, equilibria, modes, simulate_explicitly};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Points of an arc in the plane x, y that starts along x, with the given radius and angle; a straight line if the angle is 0.
pub(crate) fn arc(length: f64, angle: f64, elements: usize) -> Vec<[f64; 3]> {
    let point = |k: usize| {
        let s = length * k as f64 / elements as f64;
        let turned = angle * k as f64 / elements as f64;
        if angle == 0.0 {
            [s, 0.0, 0.0]
        } else {
            [length / angle * turned.sin(), length / angle * (1.0 - turned.cos()), 0.0]
        }
    };
    (0..=elements).map(point).collect()
}

/// Tip of a clamped beam with a load at its tip, in static equilibrium. The load grows in ten steps: a path of equilibria that
/// is found from the unloaded beam alone does not reach rotations of half a turn.
pub(crate) fn tip(
    points: &[[f64; 3]],
    section: &BeamSection3<f64>,
    shear: Shear,
    kind: LoadKind3,
    load: [f64; 3],
) -> [f64; 3] {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground3();
    let (nodes, _) = m.beam3("beam", points, [0.0, 0.0, 1.0], [Some(ground), None], section, shear);
    let end = *nodes.last().unwrap();
    let size = load.iter().map(|x| x * x).sum::<f64>().sqrt();
    m.load3("load", kind, end.origin(), load, ConstantSpeed, &[0.0, size]);
    let sensor = m.sensor3("tip", end.origin());
    watch(&mut m, sensor, &["x", "y", "z"]).unwrap();
    let values = equilibria(&m, &Statics::default(), &crate::times(1.0, 10)).unwrap();
    [values[0][9], values[1][9], values[2][9]]
}

/// A clamped rod with a force at its tip: n = F, m′ = −r′ × n, r′ = R (e_x + C_Γ⁻¹ Rᵀ n), R′ = R [κ₀ + C_κ⁻¹ Rᵀ m]×, from the
/// clamped end; m(L) = 0 determines m(0) by Newton's iteration.
///
/// # Sources
/// Antman, *Nonlinear Problems of Elasticity* (2005), Chapter 8.
pub(crate) struct Rod<'a> {
    pub section: &'a BeamSection3<f64>,
    pub length: f64,
    pub curvature: f64,
}

impl Rod<'_> {
    fn rates(&self, y: &[f64; 10], force: Vector3<f64>) -> [f64; 10] {
        let e = [y[3], y[4], y[5], y[6]];
        let rows = Rotation::euler_parameters(e).matrix();
        let r = Matrix3::from_fn(|i, k| rows[i][k]);
        let moment = Vector3::new(y[7], y[8], y[9]);
        let (n, m) = (r.transpose() * force, r.transpose() * moment);
        let BeamSection3 { axial, shear, torsion, bending, .. } = *self.section;
        let tangent = r * Vector3::new(1.0 + n[0] / axial, n[1] / shear[0], n[2] / shear[1]);
        let k = [m[0] / torsion, m[1] / bending[0], m[2] / bending[1] + self.curvature];
        let turn = [
            -0.5 * (e[1] * k[0] + e[2] * k[1] + e[3] * k[2]),
            0.5 * (e[0] * k[0] - e[3] * k[1] + e[2] * k[2]),
            0.5 * (e[3] * k[0] + e[0] * k[1] - e[1] * k[2]),
            0.5 * (-e[2] * k[0] + e[1] * k[1] + e[0] * k[2]),
        ];
        let change = -tangent.cross(&force);
        let [a, b, c, d] = turn;
        [tangent[0], tangent[1], tangent[2], a, b, c, d, change[0], change[1], change[2]]
    }

    /// State at the tip for the moment at the clamped end.
    fn shoot(&self, root: Vector3<f64>, force: Vector3<f64>) -> [f64; 10] {
        let mut y = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, root[0], root[1], root[2]];
        let h = self.length / 400.0;
        for _ in 0..400 {
            let step = |k: &[f64; 10], f: f64| std::array::from_fn(|i| y[i] + f * h * k[i]);
            let k1 = self.rates(&y, force);
            let k2 = self.rates(&step(&k1, 0.5), force);
            let k3 = self.rates(&step(&k2, 0.5), force);
            let k4 = self.rates(&step(&k3, 1.0), force);
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        y
    }

    /// The tip under the force, which is applied in ten parts.
    pub fn tip(&self, force: [f64; 3]) -> [f64; 3] {
        let mut root = Vector3::zeros();
        for part in 1..=10 {
            let f = Vector3::from(force) * (0.1 * f64::from(part));
            let moment = |root: Vector3<f64>| Vector3::from_column_slice(&self.shoot(root, f)[7..]);
            for _ in 0..30 {
                let residual = moment(root);
                let step = 1e-6 * (1.0 + root.norm());
                let column = |k: usize| {
                    let mut moved = root;
                    moved[k] += step;
                    (moment(moved) - residual) / step
                };
                let jacobian = Matrix3::from_columns(&[column(0), column(1), column(2)]);
                let change = jacobian.lu().solve(&residual).unwrap();
                root -= change;
                if change.norm() < 1e-10 * (1.0 + root.norm()) {
                    break;
                }
            }
        }
        let y = self.shoot(root, Vector3::from(force));
        assert!(y[7..].iter().all(|m| m.abs() < 1e-6 * (1.0 + root.norm())), "shooting converges");
        [y[0], y[1], y[2]]
    }
}

pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn in_a_plane_it_is_the_planar_beam() {
    let planar = BeamSection { axial: 1e4, shear: 2e3, bending: 5.0, mass: 1.0, inertia: 0.01 };
    let section = BeamSection3 {
        axial: 1e4,
        shear: [2e3; 2],
        torsion: 4.0,
        bending: [8.0, 5.0],
        mass: 1.0,
        inertia: [0.02, 0.01, 0.01],
    };
    for shear in [Shear::Flexible, Shear::Plain] {
        let mut m = Mechanism::<f64>::new();
        let (nodes, _) = m.beam("beam", [[0.0, 0.0], [2.0, 0.0]], [None, None], 8, &planar, shear);
        nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
        m.load("x", m.ground().x, nodes[8].x, Fixed, &[3.0]);
        m.load("y", m.ground().y, nodes[8].y, Fixed, &[6.0]);
        let sensor = m.sensor("tip", nodes[8].origin());
        watch(&mut m, sensor, &["x", "y"]).unwrap();
        let values = equilibria(&m, &Statics::default(), &[0.0]).unwrap();
        let points = arc(2.0, 0.0, 8);
        let spatial = tip(&points, &section, shear, LoadKind3::Force, [3.0, 6.0, 0.0]);
        let error = distance(spatial, [values[0][0], values[1][0], 0.0]);
        println!("{shear:?}: {error:.1e} at {spatial:?}");
        assert!(error < 1e-9 && spatial[1] > 0.5);
    }
}

#[test]
fn a_moment_rolls_a_beam_up_to_circles() {
    let section = BeamSection3::circular(0.05, 1e9, 0.3, 1000.0);
    for turns in [0.25, 0.5, 1.0] {
        let moment = 2.0 * PI * turns * section.bending[1] / 3.0;
        let rolled = tip(&arc(3.0, 0.0, 12), &section, Shear::Flexible, LoadKind3::FollowerTorque, [0.0, 0.0, moment]);
        // The nodes are on the circle through the ends of chords of 3/12 m that turn by equal angles.
        let angle = 2.0 * PI * turns / 12.0;
        let sum = |f: fn(f64) -> f64| (0..12).map(|k| 0.25 * f((f64::from(k) + 0.5) * angle)).sum::<f64>();
        let error = distance(rolled, [sum(f64::cos), sum(f64::sin), 0.0]);
        println!("{turns} turns: {error:.1e}");
        assert!(error < 1e-9);
    }
}

/// A bend of 45° with a force out of its plane, and a cantilever with different principal stiffnesses.
///
/// # Sources
/// Bathe & Bolourchi, *Int. J. Numer. Methods Eng.* 14 (1979) 961–986, for the bend.
#[test]
fn beams_converge_to_rods_with_order_two() {
    let (young, side) = (1e7, 1.0);
    let mut bend = BeamSection3::rectangular([side, side], young, 0.0, 1.0);
    // Sections without warping: GJ = G (I_y + I_z) and GA_s = GA.
    (bend.torsion, bend.shear) = (0.5 * young / 6.0, [0.5 * young; 2]);
    let strip = BeamSection3::rectangular([0.02, 0.05], 1e9, 0.3, 1.0);
    let (length, angle) = (100.0 * PI / 4.0, PI / 4.0);
    for (name, section, length, angle, force) in [
        ("bend of 45°, 300", bend, length, angle, [0.0, 0.0, 300.0]),
        ("bend of 45°, 600", bend, length, angle, [0.0, 0.0, 600.0]),
        ("strip", strip, 1.0, 0.0, [0.0, 60.0, -90.0]),
    ] {
        let exact = Rod { section: &section, length, curvature: angle / length }.tip(force);
        let error = |elements: usize| {
            let points = arc(length, angle, elements);
            distance(tip(&points, &section, Shear::Flexible, LoadKind3::Force, force), exact) / length
        };
        let (coarse, fine) = (error(8), error(16));
        println!("{name}: tip {exact:.4?}, errors {coarse:.1e} and {fine:.1e}, order {:.2}", (coarse / fine).log2());
        assert!(fine < 1e-3 && ((coarse / fine).log2() - 2.0).abs() < 0.25, "{name}");
    }
}

/// Frequencies of a clamped beam: bending (1.8751/L)² √(EI/ρA), torsion π/(2L) √(GJ/ρI_p), extension π/(2L) √(E/ρ).
///
/// # Sources
/// Blevins, *Formulas for Natural Frequency and Mode Shape* (1979), Tables 8-1, 8-16 and 8-20.
#[test]
fn vibrations_of_a_clamped_beam() {
    let section = BeamSection3::rectangular([0.01, 0.02], 2e11, 0.3, 7800.0);
    let length = 1.0;
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground3();
    m.beam3("beam", &arc(length, 0.0, 20), [0.0, 0.0, 1.0], [Some(ground), None], &section, Shear::Flexible);
    let (mut system, mut state) = (System::new(&m).unwrap(), State::built(&m, 0.0));
    assemble(&mut system, &m, &mut state, Assembly::default()).unwrap();
    let found = modes(&mut system, &m, &state).unwrap().frequencies;
    let bending = |ei: f64, root: f64| (root / length).powi(2) * (ei / section.mass).sqrt();
    let rod = |stiffness: f64, mass: f64| PI / (2.0 * length) * (stiffness / mass).sqrt();
    let expected = [
        bending(section.bending[1], 1.875104),
        bending(section.bending[0], 1.875104),
        bending(section.bending[1], 4.694091),
        bending(section.bending[0], 4.694091),
        rod(section.torsion, section.inertia[0]),
        rod(section.axial, section.mass),
    ];
    for expected in expected {
        let nearest = found.iter().map(|f| (f / expected - 1.0).abs()).fold(f64::INFINITY, f64::min);
        println!("{expected:.1} rad/s: {nearest:.1e}");
        assert!(nearest < 1.0e-2);
    }
}

/// A curved beam that swings on a skew hinge keeps its energy.
#[test]
fn a_swinging_beam_keeps_its_energy() {
    let section = BeamSection3 {
        axial: 2e3,
        shear: [1e3; 2],
        torsion: 2.0,
        bending: [3.0, 2.0],
        mass: 0.5,
        inertia: [2e-3, 1e-3, 1e-3],
    };
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
    let ground = m.ground3();
    let (nodes, _) = m.beam3("beam", &arc(1.0, 0.6, 4), [0.0, 0.0, 1.0], [None, None], &section, Shear::Flexible);
    let (axis, to_node) = ([0.0, 1.0, 0.3], m.pose3(nodes[0]).orientation.inverse());
    m.revolute3("hinge", ground.origin().with_z(axis), nodes[0].origin().with_z(to_node.rotate(axis)));
    let terms = [m.kinetic_energy(), m.potential_energy()];
    m.output("energy", &terms);
    m.output("kinetic", &terms[..1]);
    for (tolerance, limit) in [(1e-9, 1e-5), (1e-11, 2e-7)] {
        let run = simulate_explicitly(&m, &Explicit::eighth_order(tolerance), &crate::times(1.0, 20)).unwrap();
        let drift = run.energy_drift.expect("a beam without damping is conservative");
        println!("tolerance {tolerance:.0e}: energy changes by {:.1e} J of {:.2} J", drift.largest, drift.kinetic);
        assert!(drift.kinetic > 0.5 && drift.relative().abs() < limit);
    }
}
