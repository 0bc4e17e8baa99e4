//! Derivatives of the flexible four-bar's moments compared with extrapolated differences.

use linkwright::cases::FourBar;
use linkwright::mechanics::analyses::dynamics::simulate;
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::mechanism::ParametricMechanism;

/// Central differences of plain simulations, Richardson-extrapolated.
fn richardson(b: &[f64; 3], k: usize, h: f64) -> Vec<Vec<f64>> {
    let model = FourBar::as_published();
    let run = |step: f64| {
        let mut moved = *b;
        moved[k] += step;
        let mechanism = model.build(&moved).unwrap();
        simulate(&mechanism, &model.dynamics().unwrap(), &FourBar::window()).unwrap().values
    };
    let (far, near) = ([run(h), run(-h)], [run(h / 2.0), run(-h / 2.0)]);
    let derivative = |o: usize, t: usize| {
        let coarse = (far[0][o][t] - far[1][o][t]) / (2.0 * h);
        let fine = (near[0][o][t] - near[1][o][t]) / h;
        (4.0 * fine - coarse) / 3.0
    };
    (0..21).map(|o| (0..201).map(|t| derivative(o, t)).collect()).collect()
}

#[test]
fn moments_of_the_four_bar_agree_with_differences() {
    let (model, b) = (FourBar::as_published(), [0.0385, 0.0252, 0.02]);
    let history = differentiate(&model, &b, &model.dynamics().unwrap(), &FourBar::window()).unwrap();
    let plain = simulate(&model.build(&b).unwrap(), &model.dynamics().unwrap(), &FourBar::window()).unwrap();
    assert_eq!(history.values, plain.values);
    for k in 0..3 {
        let differences = richardson(&b, k, 1e-4 * b[k]);
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for (series, differences) in history.gradients.iter().zip(&differences) {
            for (gradient, difference) in series.iter().zip(differences) {
                worst = worst.max((gradient[k] - difference).abs());
                largest = largest.max(difference.abs());
            }
        }
        assert!(worst < 3e-7 * largest, "variable {k}: {worst:.2e} of {largest:.2e}");
    }
}
