//! How many analyses and sensitivity analyses until the optimum is reached to 1e-5: `cargo bench --bench analyses`.
//!
//! Beside the least that other programs need, as far as they were measured. Times do not matter here: the work counts.

use linkwright::Result;
use linkwright::library::{Attempt, Conclusion, attempt_with, compare, find, slider_crank};
use linkwright::sao::{Preset, presets};
use std::f64::consts::TAU;

/// Problem, what others need at least, and what is wanted of us.
const PEERS: [(&str, &str, &str); 6] = [
    ("impact-absorber", "SLSQP 5+4", "4+4"),
    ("impact-absorber-comfort", "Gauss-Newton SQP 7+5, SLSQP 10+9", "6+5"),
    ("cantilever", "mmapy 6+5", "6+5"),
    ("two-bar-truss", "IPOPT 5+4", "5+4"),
    ("quadratic-forms-1", "IPOPT at n = 1000: 111+68", "fewer"),
    ("quadratic-forms-2", "IPOPT at n = 1000: 101+100", "fewer"),
];

/// SplitMix64: a stream of numbers that no library version changes.
struct Random(u64);

impl Random {
    fn within(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        from + (to - from) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A start of the slider-crank that can turn all the way round, with free angles; the same as in `tests/optima.rs`.
    fn start(&mut self) -> [f64; 8] {
        const RANGES: [[f64; 2]; 8] =
            [[3.0, 15.0], [10.0, 30.0], [-10.0, -1.0], [3.0, 25.0], [3.0, 25.0], [3.0, 15.0], [0.0, TAU], [0.0, TAU]];
        loop {
            let b = RANGES.map(|[from, to]| self.within(from, to));
            let offset: f64 = b[2] - b[5];
            if b[0] + offset.abs() <= 0.85 * b[1] {
                return b;
            }
        }
    }
}

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
    let mut random = Random(1998);
    let starts: Vec<[f64; 8]> = (0..16).map(|_| random.start()).collect();
    let optima = find("slider-crank")?.optima;
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

fn main() -> Result<()> {
    fewest()?;
    random_starts()
}
