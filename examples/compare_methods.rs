//! Compares the work of four methods on one problem: `cargo run --example compare_methods`.
//!
//! The command `linkwright compare impact-absorber-comfort --methods slp,mma,gcmma,hessian-errors` prints the same table.

use linkwright::Result;
use linkwright::cases::{Conclusion, compare, find};
use linkwright::report::methods::table;
use linkwright::sao::preset;

fn main() -> Result<()> {
    let entry = find("impact-absorber-comfort")?;
    let methods = ["slp", "mma", "gcmma", "hessian-errors"].map(preset).into_iter().collect::<Result<Vec<_>>>()?;
    let attempts = compare(entry, &methods)?;
    println!("{}", table(entry, &attempts)?.text());
    for attempt in &attempts {
        assert!(matches!(attempt.conclusion, Conclusion::Reached(_)), "{}", attempt.method);
    }
    let work = |name| attempts.iter().find(|a| a.method == name).and_then(|a| a.to_optimum).map_or(0, |w| w.total());
    assert!(work("hessian-errors") < work("slp") && work("slp") < work("gcmma"));
    Ok(())
}
