//! The flexible four-bar mechanism approaches the rigid one as its stiffness grows.

use linkwright::cases::{FourBar, RigidFourBar};
use linkwright::mechanics::analyses::dynamics::simulate;
use linkwright::mechanics::analyses::kinematics::kinematics;
use linkwright::mechanics::mechanism::ParametricMechanism;

const DIAMETERS: [f64; 3] = [0.128448; 3];

/// Bending moments at all nodes over the paper's window, rigid links.
fn rigid(model: FourBar) -> Vec<Vec<f64>> {
    let mechanism = RigidFourBar(model).build(&DIAMETERS).unwrap();
    let times: Vec<f64> = (0..=500).map(|k| k as f64 * 1e-3).collect();
    let moments = kinematics(&mechanism, Default::default(), &times).unwrap();
    moments.into_iter().map(|series| series[300..].to_vec()).collect()
}

/// Bending moments at all nodes with beams, for a multiple of Young's modulus.
fn flexible(model: FourBar, stiffness: f64) -> Vec<Vec<f64>> {
    let model = FourBar { young: model.young * stiffness, ..model };
    let mechanism = model.build(&DIAMETERS).unwrap();
    simulate(&mechanism, &model.dynamics().unwrap(), &FourBar::window()).unwrap().values
}

/// Largest difference at the inner nodes of each link, relative to the largest moment of the link.
fn deviation(a: &[Vec<f64>], b: &[Vec<f64>]) -> [f64; 3] {
    [0, 1, 2].map(|link| {
        let nodes = link * 7 + 1..link * 7 + 6;
        let largest = nodes.clone().flat_map(|k| &b[k]).fold(0.0, |m: f64, x| m.max(x.abs()));
        let pairs = nodes.flat_map(|k| a[k].iter().zip(&b[k]));
        pairs.fold(0.0, |m: f64, (x, y)| m.max((x - y).abs())) / largest
    })
}

#[test]
fn stiff_links_carry_the_moments_of_rigid_inverse_dynamics() {
    // HHT with α = 0.05 averages the moments of two steps; with short steps the effect is negligible.
    for model in [FourBar::physical(), FourBar::as_published()].map(|m| FourBar { step: 1e-4, ..m }) {
        let exact = rigid(model);
        let [real, stiff, stiffer, rigid] = [1.0, 10.0, 100.0, 1e4].map(|e| deviation(&flexible(model, e), &exact));
        for link in 0..3 {
            assert!((0.005..0.015).contains(&real[link]), "{real:?}");
            for (k, ratio) in [real[link] / stiff[link], stiff[link] / stiffer[link]].into_iter().enumerate() {
                assert!((8.0..20.0).contains(&ratio), "link {link}, factor {k}: {ratio}");
            }
            assert!(rigid[link] < 2e-5, "{rigid:?}");
        }
    }
}
