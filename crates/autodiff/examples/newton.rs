//! Newton's method with exact gradients and Hessians: the minimum of Rosenbrock's function.
//!
//! Run it with `cargo run -p linkwright-autodiff --example newton`.

use linkwright_autodiff::{Scalar, hessian};
use nalgebra::DVector;

/// Rosenbrock's function of n variables; its minimum is 0 at x = (1, …, 1).
fn rosenbrock<S: Scalar>(x: &[S]) -> S {
    x.windows(2).map(|x| (x[1] - x[0].powi(2)).powi(2) * 100.0 + (-x[0] + 1.0).powi(2)).sum()
}

fn main() {
    let mut x = DVector::from_element(6, 1.2);
    for iteration in 0..20 {
        let (value, gradient, hessian) = hessian(rosenbrock, x.as_slice());
        let gradient = DVector::from_vec(gradient);
        println!("{iteration:2}  f = {value:10.3e}  |∇f| = {:10.3e}", gradient.norm());
        if gradient.norm() < 1e-12 {
            break;
        }
        x -= hessian.cholesky().expect("the Hessian is positive definite near the minimum").solve(&gradient);
    }
    assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12), "{x}");
}
