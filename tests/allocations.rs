//! Time steps allocate nothing after the first one.

use linkwright::analysis::dynamics::Run;
use linkwright::multibody::Model;
use linkwright::multibody::mechanisms::{Andrews, FourBar};

/// Allocations of `steps` further steps after the first few.
fn allocations<M: Model>(model: &M, b: &[f64], settings: &linkwright::analysis::Dynamics) -> u64 {
    let mechanism = model.build(b).unwrap();
    let mut run = Run::new(&mechanism, settings, &[0.1]).unwrap();
    run.advance().unwrap();
    let count = allocation_counter::measure(|| {
        for _ in 0..20 {
            run.advance().unwrap();
        }
    });
    count.count_total
}

#[test]
fn no_allocation_per_step() {
    let four_bar = FourBar::as_published();
    assert_eq!(allocations(&four_bar, &[0.0385, 0.0252, 0.02], &four_bar.dynamics().unwrap()), 0);
    assert_eq!(allocations(&Andrews, &Andrews::DESIGN, &linkwright::analysis::Dynamics::fixed(1e-5)), 0);
}
