//! Time of a four-bar analysis, rigid and flexible, for comparison with Exudyn: `cargo bench --bench exudyn`.
//!
//! The models are those of `peers/exudyn_four_bar.py`; the comparison of chains uses `--bench chain`. The links are round and of
//! aluminium, the crank reaches 10π rad/s in 0.2 s, and 0.5 s are simulated. Printed are the CPU time of all threads, the
//! minimum of several batches, and the largest bending stress of each link from 0.3 s on at six points. These are midpoints of
//! elements for 6, 18, 54 … elements per link.

mod cpu;

use cpu::least;
use linkwright::Result;
use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::dynamics::{Dynamics, History, simulate};
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::mechanism::{Body, Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::StartUp;
use std::f64::consts::PI;

const LENGTHS: [f64; 3] = [0.3048, 0.9144, 0.762];
const GROUND: f64 = 0.9144;
const DIAMETERS: [f64; 3] = [0.0385, 0.0252, 0.02];
const YOUNG: f64 = 6.895e10;
const POISSON: f64 = 0.3;
const DENSITY: f64 = 2757.0;
const START: f64 = 0.5 * PI;

/// End points of the links at the start.
fn ends() -> [[[f64; 2]; 2]; 3] {
    let [crank, coupler, rocker] = LENGTHS;
    let b = [crank * START.cos(), crank * START.sin()];
    let (dx, dy) = (GROUND - b[0], -b[1]);
    let distance = dx.hypot(dy);
    let along = (coupler * coupler - rocker * rocker + distance * distance) / (2.0 * distance);
    let height = (coupler * coupler - along * along).sqrt();
    let c = [b[0] + (along * dx - height * dy) / distance, b[1] + (along * dy + height * dx) / distance];
    [[[0.0; 2], b], [b, c], [[GROUND, 0.0], c]]
}

fn drive<S: Scalar>(m: &mut Mechanism<S>, crank: Body) {
    m.drive(crank.theta, StartUp::HalfCosine, &[START, 10.0 * PI, 0.2].map(S::from));
}

struct Rigid;

impl ParametricMechanism for Rigid {
    fn build<S: Scalar>(&self, _: &[S]) -> Result<Mechanism<S>> {
        let mut m = Mechanism::new();
        let zero = S::from(0.0);
        let links = [0, 1, 2].map(|k| {
            let ([from, to], length) = (ends()[k], LENGTHS[k]);
            let mass = 0.25 * PI * DIAMETERS[k].powi(2) * length * DENSITY;
            let theta = (to[1] - from[1]).atan2(to[0] - from[0]);
            let [x, y, theta] = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1]), theta].map(S::from);
            m.body(&format!("link {k}"), S::from(mass), S::from(mass * length * length / 12.0), Pose { x, y, theta })
        });
        let end = |k: usize, side: f64| links[k].at(S::from(0.5 * side * LENGTHS[k]), zero);
        let ground = m.ground();
        m.revolute("O", ground.origin(), end(0, -1.0));
        m.revolute("B", end(0, 1.0), end(1, -1.0));
        m.revolute("C", end(1, 1.0), end(2, 1.0));
        m.revolute("D", ground.at(S::from(GROUND), zero), end(2, -1.0));
        drive(&mut m, links[0]);
        let angle = m.coordinate_sensor("rocker", ground.theta, links[2].theta);
        let term = m.measure(angle, "position")?;
        m.output("rocker", &[term]);
        Ok(m)
    }
}

struct Flexible {
    elements: usize,
    shear: Shear,
}

impl ParametricMechanism for Flexible {
    fn build<S: Scalar>(&self, _: &[S]) -> Result<Mechanism<S>> {
        let mut m = Mechanism::new();
        let point = |p: [f64; 2]| p.map(S::from);
        let pivots = [[0.0; 2], [GROUND, 0.0]].map(|p| m.fixed_node("pivot", S::from(p[0]), S::from(p[1])));
        let mut link = |k: usize, shared| {
            let [from, to] = ends()[k];
            let section = BeamSection::circular(S::from(DIAMETERS[k]), YOUNG, POISSON, DENSITY);
            m.beam(&format!("link {k}"), [point(from), point(to)], shared, self.elements, &section, self.shear)
        };
        let (crank, crank_parts) = link(0, [Some(pivots[0]), None]);
        let (coupler, coupler_parts) = link(1, [crank.last().copied(), None]);
        let (_, rocker_parts) = link(2, [Some(pivots[1]), coupler.last().copied()]);
        drive(&mut m, crank[0]);
        let refinement = self.elements / 6;
        for part in [crank_parts, coupler_parts, rocker_parts]
            .iter()
            .flat_map(|p| p.iter().skip(refinement / 2).step_by(refinement))
        {
            let half = S::from(0.5);
            let terms = [m.measure(*part, "moment_i")?.times(half), m.measure(*part, "moment_j")?.times(half)];
            m.output("moment", &terms);
        }
        Ok(m)
    }
}

/// Largest bending stress of each link in MPa.
fn peaks(history: &History) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let moments = history.values[6 * k..6 * k + 6].iter().flatten();
        moments.fold(0.0, |a: f64, m| a.max(m.abs())) * 32e-6 / (PI * DIAMETERS[k].powi(3))
    })
}

fn main() {
    let window: Vec<f64> = (300..=500).map(|k| f64::from(k) * 1e-3).collect();
    let rigid = Rigid.build::<f64>(&[]).unwrap();
    let run = || simulate(&rigid, &Dynamics::fixed(1e-3), &[0.5]).unwrap();
    println!("rigid, step 1 ms: CPU {:.2} ms, rocker at {:.9} rad", least(10, run) * 1e3, run().values[0][0]);
    let flexible = |elements, shear, h: f64| {
        let mechanism = Flexible { elements, shear }.build::<f64>(&[]).unwrap();
        let run = || simulate(&mechanism, &Dynamics::fixed(h), &window).unwrap();
        (peaks(&run()), if elements < 50 { least(10, run) } else { f64::NAN }, run().work)
    };
    let (exact, ..) = flexible(54, Shear::Flexible, 1.25e-4);
    println!("flexible, 3 × 54 elements, step 0.125 ms: largest stresses {exact:.4?} MPa");
    for (elements, shear, h) in [
        (6, Shear::Plain, 1e-3),
        (6, Shear::Flexible, 1e-3),
        (18, Shear::Plain, 1e-3),
        (6, Shear::Plain, 2.5e-4),
        (6, Shear::Flexible, 2.5e-4),
        (18, Shear::Flexible, 2.5e-4),
    ] {
        let (stress, spent, work) = flexible(elements, shear, h);
        let error = (0..3).map(|k| (stress[k] / exact[k] - 1.0).abs()).fold(0.0, f64::max) * 100.0;
        println!(
            "flexible, 3 × {elements} elements ({shear:?} shear), step {} ms: CPU {:.2} ms, {} iterations, largest stresses \
             {stress:.4?} MPa, off by {error:.2} % at most",
            h * 1e3,
            spent * 1e3,
            work.iterations
        );
    }
}
