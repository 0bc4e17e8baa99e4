//! An element defined outside the crate: a spring that stiffens with time, with exact derivatives by automatic differentiation.
//!
//! `cargo run --example your_own_element`

use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::elements::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};

/// A spring that stiffens with time: F = k (1 + r t) u, on one coordinate.
struct HardeningSpring;

linkwright::mechanics::element_inputs!(HardeningSpringInputs {
    coordinate: coordinate("coordinate that it acts on"),
    stiffness: required("N/m", 50.0, "stiffness k at t = 0"),
    growth: required("1/s", 0.3, "growth rate r of the stiffness"),
});

static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "hardening-spring",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[Measure::new("force", "N", "force on the coordinate, positive if it acts towards smaller values")],
    about: "a spring that stiffens with time",
    law: "",
    symbol: Symbol::None,
};

impl HardeningSpring {
    fn force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        let p = HardeningSpringInputs(x.p);
        p.stiffness() * (p.growth() * x.t + 1.0) * x.q[0]
    }
}

impl Element for HardeningSpring {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] = Self::force(x);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = Self::force(x);
    }
}

/// A cart of 2 kg on that spring, released from rest at 0.1 m; the design variables are k in N/m and r in 1/s.
struct Cart;

impl ParametricMechanism for Cart {
    fn build<S: Scalar>(&self, b: &[S]) -> linkwright::Result<Mechanism<S>> {
        let mut m = Mechanism::new();
        let cart = m.coordinate("cart", S::from(0.1), S::from(0.0));
        m.inertia("mass", cart, S::from(2.0));
        let spring = m.add("hardening spring", HardeningSpring, &[cart], b);
        let sensor = m.coordinate_sensor("position", m.ground().x, cart);
        let term = m.measure(sensor, "position")?;
        m.output("position", &[term]);
        let term = m.measure(spring, "force")?;
        m.output("force", &[term]);
        Ok(m)
    }
}

fn main() -> linkwright::Result<()> {
    let (b, settings, end) = ([50.0, 0.3], Dynamics::fixed(1e-3), [2.0]);
    let history = differentiate(&Cart, &b, &settings, &end)?;
    println!("position after 2 s: {:.6} m, with gradient {:?}", history.values[0][0], history.gradients[0][0]);

    let moved = |h: f64| -> linkwright::Result<f64> {
        Ok(simulate(&Cart.build(&[b[0] + h, b[1]])?, &settings, &end)?.values[0][0])
    };
    let difference = (moved(1e-3)? - moved(-1e-3)?) / 2e-3;
    println!("difference quotient for k: {difference:.9e}");
    assert!((history.gradients[0][0][0] - difference).abs() < 1e-8);
    Ok(())
}
