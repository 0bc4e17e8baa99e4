//! An end for motions that need ever shorter steps.

use crate::Error;

/// Time steps of a run; one that takes more would never end, or fill the memory before.
pub(crate) const MOST_STEPS: usize = if cfg!(test) { 200_000 } else { 20_000_000 };

/// What is said of it.
pub(crate) fn too_many_steps(t: f64) -> Error {
    let why = format!("{MOST_STEPS} time steps have come to t = {t:.6e} s only");
    Error::analysis("the integration", why, "loosen the tolerance, take longer steps, or end sooner")
}

#[cfg(test)]
mod tests {
    use crate::integrators::explicit::ode::{Ode, integrate};
    use crate::integrators::explicit::settings::{Explicit, StepControl};
    use autodiff::Scalar;

    struct Clock;

    impl Ode for Clock {
        fn start<S: Scalar>(&self, _b: &[S]) -> Vec<S> {
            vec![S::from(0.0)]
        }

        fn rates<S: Scalar>(&self, _b: &[S], _t: f64, _y: &[S], out: &mut [S]) {
            out[0] = S::from(1.0);
        }
    }

    #[test]
    fn a_motion_of_endless_steps_ends() {
        let settings = |h: f64| Explicit::eighth_order(1.0).with_pace(StepControl::Fixed(h));
        let error = integrate(&Clock, &[], &settings(1e-6), &[1.0]).unwrap_err().to_string();
        assert!(error.contains("200000 time steps have come to t = 2.000000e-1 s only"), "{error}");
        assert!(integrate(&Clock, &[], &settings(1e-5), &[1.0]).is_ok());
    }
}
