//! Finite differences of analyses with respect to the design.

/// Derivatives of the values of `run` with respect to variable `k` of the design `b`: central differences with the steps `h` and h/2, extrapolated.
pub fn extrapolated_differences(b: &[f64], k: usize, h: f64, run: impl Fn(&[f64]) -> Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let at = |step: f64| {
        let mut moved = b.to_vec();
        moved[k] += step;
        run(&moved)
    };
    let [above, below, half_above, half_below] = [h, -h, 0.5 * h, -0.5 * h].map(at);
    let value = |i: usize, j: usize| {
        let coarse = (above[i][j] - below[i][j]) / (2.0 * h);
        let fine = (half_above[i][j] - half_below[i][j]) / h;
        (4.0 * fine - coarse) / 3.0
    };
    (0..above.len()).map(|i| (0..above[i].len()).map(|j| value(i, j)).collect()).collect()
}
