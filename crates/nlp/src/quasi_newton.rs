//! Powell's damping of quasi-Newton updates.

/// Least ratio of the updated to the previous curvature along a step.
const LEAST_RATIO: f64 = 0.2;

/// The factor θ of the damped change of the gradient r = θ y + (1 − θ) B s of a BFGS update, which replaces the change y along the step s: sᵀr is at
/// least 0.2 sᵀBs, so that the matrix B stays positive definite.
///
/// * `previous`: sᵀBs > 0; `measured`: sᵀy.
///
/// # Sources
///
/// Powell (1978); Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), procedure 18.2.
pub fn powell_damping(previous: f64, measured: f64) -> f64 {
    if measured >= LEAST_RATIO * previous { 1.0 } else { (1.0 - LEAST_RATIO) * previous / (previous - measured) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_damped_curvature_is_at_least_a_fifth() {
        for measured in [-3.0, 0.0, 0.3, 0.5, 4.0] {
            let θ = powell_damping(2.0, measured);
            let damped = θ * measured + (1.0 - θ) * 2.0;
            assert!((0.0..=1.0).contains(&θ) && damped >= 0.4 - 1e-15, "{measured}: {damped}");
        }
    }
}
