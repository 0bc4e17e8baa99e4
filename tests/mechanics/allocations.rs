//! Time steps allocate memory only in the first one.

use linkwright::cases::{Andrews, Chain, FourBar};
use linkwright::mechanics::analyses::dynamics::Dynamics;
use linkwright::mechanics::integrators::time_stepper::TimeStepper;
use linkwright::mechanics::mechanism::ParametricMechanism;

/// Allocations of `steps` further steps after the first few.
fn allocations<M: ParametricMechanism>(model: &M, b: &[f64], settings: &Dynamics) -> u64 {
    let mechanism = model.build(b).unwrap();
    let mut stepper = TimeStepper::new(&mechanism, settings, &[0.1]).unwrap();
    stepper.advance().unwrap();
    let count = allocation_counter::measure(|| {
        for _ in 0..20 {
            stepper.advance().unwrap();
        }
    });
    count.count_total
}

#[test]
fn no_allocation_per_step() {
    let four_bar = FourBar::as_published();
    assert_eq!(allocations(&four_bar, &[0.0385, 0.0252, 0.02], &four_bar.dynamics().unwrap()), 0);
    let chain = Chain::horizontal(8);
    assert_eq!(allocations(&chain, &chain.equal_links(), &Dynamics::fixed(1e-3)), 0);
    assert_eq!(allocations(&Andrews, &Andrews::DESIGN, &Dynamics::fixed(1e-5)), 0);
}

/// Simulations of 50 steps allocate as much as those of 10, with and without derivatives.
#[test]
fn no_allocation_per_explicit_step() {
    use linkwright::mechanics::analyses::dynamics::simulate_explicitly;
    use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
    use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
    let chain = Chain::horizontal(8);
    let b = chain.equal_links();
    let mechanism = chain.build(&b).unwrap();
    let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(1e-3));
    let plain = |steps: f64| drop(simulate_explicitly(&mechanism, &settings, &[1e-3 * steps]).unwrap());
    let both = |steps: f64| drop(differentiate_explicitly(&chain, &b, &settings, &[1e-3 * steps]).unwrap());
    let count = |run: &dyn Fn(f64), steps: f64| allocation_counter::measure(|| run(steps)).count_total;
    assert_eq!(count(&plain, 10.0), count(&plain, 50.0));
    assert_eq!(count(&both, 10.0), count(&both, 50.0));
}
