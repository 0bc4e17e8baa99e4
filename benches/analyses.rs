//! Number of analyses and sensitivity analyses until the optimum is reached to 1e-5: `cargo bench --bench analyses`.
//!
//! The numbers are compared with the smallest ones measured for other programs; no times are measured. `-- thousand` runs the
//! quadratic forms in a thousand variables.

use linkwright::Result;
use linkwright::cases::{Attempt, Conclusion, attempt_with, compare, find, quadratic_forms, slider_crank};
use linkwright::sao::{Cycle, Method, Preset, Stop, preset, presets};

/// Problem, smallest work of other programs, and our target.
const PEERS: [(&str, &str, &str); 6] = [
    ("impact-absorber", "SLSQP 5+4", "4+4"),
    ("impact-absorber-comfort", "Gauss-Newton SQP 7+5, SLSQP 10+9", "6+5"),
    ("cantilever", "mmapy 6+5", "6+5"),
    ("two-bar-truss", "IPOPT 5+4", "5+4"),
    ("quadratic-forms-1", "IPOPT at n = 1000: 111+68", "fewer"),
    ("quadratic-forms-2", "IPOPT at n = 1000: 101+100", "fewer"),
];

fn work(a: &Attempt) -> Option<[usize; 2]> {
    let reached = matches!(a.conclusion, Conclusion::Reached(_));
    a.to_optimum.filter(|_| reached).map(|w| [w.analyses, w.sensitivity_analyses])
}

fn fewest() -> Result<()> {
    println!("{:26} {:>8} {:24} {:34} wanted", "problem", "fewest", "by", "others");
    for (name, others, wanted) in PEERS {
        let methods: Vec<&'static Preset> = presets().iter().collect();
        let attempts = compare(find(name)?, &methods)?;
        let best = attempts.iter().filter_map(|a| Some((work(a)?, a.method))).min_by_key(|(w, _)| w[0] + w[1]);
        let (count, by) = best.map_or(("-".into(), "-"), |(w, by)| (format!("{}+{}", w[0], w[1]), by));
        println!("{name:26} {count:>8} {by:24} {others:34} {wanted}");
    }
    Ok(())
}

fn random_starts() -> Result<()> {
    println!(
        "\nSlider-crank, 16 random feasible starts with free angles; SLSQP 72+47 (16 of 16), Gauss-Newton SQP 18+11 (13)"
    );
    let starts = slider_crank::random_starts(1998, 16);
    let optima = find("slider-crank")?.optima();
    for preset in presets() {
        let mut found = vec![];
        for start in &starts {
            let problem = slider_crank::path_generation(*start)?;
            let end = attempt_with(&problem, &(preset.method)(), optima, ["slider-crank", preset.name]);
            found.extend(end.ok().as_ref().and_then(work));
        }
        found.sort_unstable();
        let median = found.get(found.len() / 2).map_or("-".into(), |w| format!("{}+{}", w[0], w[1]));
        println!("{:24} {:>2} of 16, median {median}", preset.name, found.len());
    }
    Ok(())
}

/// Work on the quadratic forms in a thousand variables to within 1e-5 of the lowest objective found, f₁ = 260.854 = n + f₂.
fn a_thousand_variables() -> Result<()> {
    println!("\nQuadratic forms, n = 1000; IPOPT 111+68 and 101+100");
    let stop = Stop { accuracy: 1e-6, residual: 1e-3, max_cycles: 300, ..Stop::default() };
    for (name, problem, lowest) in [
        ("first", quadratic_forms::first_problem(1000)?, 260.854),
        ("second", quadratic_forms::second_problem(1000)?, -739.146),
    ] {
        for by in ["mma-filtered", "quadratic-spherical", "sqp-filter"] {
            let end = Method { stop, ..(preset(by)?.method)() }.solve(&problem, |_| ())?;
            let near =
                |c: &Cycle| c.accepted && c.objective < lowest + 1e-5 * f64::abs(lowest) && c.violation_pct < 1e-3;
            let count = end.history.iter().position(near).map_or("-".into(), |k| {
                format!("{}+{}", k + 1, end.history[..k].iter().filter(|c| c.accepted).count())
            });
            println!("{name:7} {by:20} {count:>8} F {:.4} {:?}", end.evaluation.objective, end.status);
        }
    }
    Ok(())
}

fn main() -> Result<()> {
    if std::env::args().any(|a| a == "thousand") {
        return a_thousand_variables();
    }
    fewest()?;
    random_starts()
}
