//! Svanberg's two-bar truss by approximations of different curvature:
//! `cargo run -p linkwright-optimization --example two_bar_truss`.

use linkwright_optimization::Result;
use linkwright_optimization::cases::two_bar_truss;
use linkwright_optimization::sao::presets;

fn main() -> Result<()> {
    let problem = two_bar_truss::problem()?;
    println!("method               status       weight   analyses");
    for preset in presets() {
        let end = (preset.method)().solve(&problem, |_| ())?;
        println!(
            "{:<20} {:<11?} {:>7.4} {:>10}",
            preset.name, end.status, end.evaluation.objective, end.counters.analyses
        );
    }
    Ok(())
}
