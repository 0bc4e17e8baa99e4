use linkwright_optimization::cases::suite::{self, Suite, Transformation, Verdict, problems};
use linkwright_optimization::cases::find;
use linkwright_optimization::sao::{presets, preset};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    // probe TRANSFORMS(;) PROBLEMS(, or all) PRESETS(, or all) MODE
    let ts: Vec<Transformation> = args[1].split(';').flat_map(|t| Transformation::parse_set(t).unwrap()).collect();
    let entries: Vec<_> = match args[2].as_str() {
        "all" => problems().filter(|e| !e.expensive).collect(),
        "small" => problems().filter(|e| !e.expensive && matches!(e.suite, Suite::HockSchittkowski | Suite::Adversarial)).collect(),
        names => names.split(',').map(|n| find(n).unwrap()).collect(),
    };
    let ps: Vec<_> = match args[3].as_str() {
        "all" => presets().iter().collect(),
        "notauto" => presets().iter().filter(|p| p.name != "automatic").collect(),
        names => names.split(',').map(|n| preset(n).unwrap()).collect(),
    };
    let mode = args.get(4).map_or("", |s| s.as_str());
    if mode == "matrix" {
        for e in &entries { for a in linkwright_optimization::cases::compare(e, &ps).unwrap() {
            println!("{} {} {:?} {:?} {:?}", a.problem, a.method, a.conclusion.to_string(), a.to_optimum.map(|w| (w.analyses, w.sensitivity_analyses)), (a.work.analyses, a.work.sensitivity_analyses)); } }
        return;
    }
    if mode == "trace" {
        for e in &entries { for t in &ts { for p in &ps {
            let problem = t.build(e).unwrap();
            let mut m = (p.method)();
            m.stop.accuracy = 1e-6; m.stop.residual = 1e-3;
            match m.solve(&problem, |_| ()) {
                Ok(s) => {
                    println!("{} {} {}: {:?} {} | {}+{}", e.name, t, p.name, s.status, s.reason, s.counters.analyses, s.counters.sensitivity_analyses);
                    println!("{:?}", s.confirmation);
                    for c in &s.history {
                        println!("{:>3} {} F {:.9e} V {:.2e} dx% {:.1e} lim {} res {:?} kept {} fac {:.1e} relax {:.1e} {:?}", c.cycle, if c.accepted {"A"} else {"-"}, c.objective, c.violation_pct, c.max_variable_change_pct, c.active_limits, c.residual, c.retained.len(), c.factors.iter().cloned().fold(0.0,f64::max), c.relaxation, c.design.iter().take(4).map(|v| (v*1e6).round()/1e6).collect::<Vec<_>>());
                    }
                }
                Err(err) => println!("{} {} {}: ERR {err}", e.name, t, p.name),
            }
        }}}
        return;
    }
    use std::io::Write;
    let mut runs = vec![];
    for e in &entries { let t0 = std::time::Instant::now(); runs.extend(suite::run(&[*e], &ts, &ps).unwrap()); let d = t0.elapsed().as_secs_f64(); if d > 3.0 { eprintln!("{} {:.1}s", e.name, d); std::io::stderr().flush().unwrap(); } }
    if mode == "all" {
        for r in &runs { println!("{} {} {} {} {}+{} {:?}", r.problem, r.transformation, r.method, r.status, r.work.analyses, r.work.sensitivity_analyses, r.judgement.map(|j| (j.verdict, j.excess))); }
    }
    let mut total = 0;
    for p in &ps {
        let of: Vec<_> = runs.iter().filter(|r| r.method == p.name).collect();
        let count = |v: Verdict| of.iter().filter(|r| r.judgement.is_some_and(|j| j.verdict == v)).count();
        let mut w: Vec<usize> = of.iter().filter(|r| r.is_solved()).map(|r| r.work.total()).collect(); w.sort();
        let inf = of.iter().filter(|r| r.status == "infeasible").count();
        println!("{:22} runs {:5} solved {:5} honest {:5} FALSE {:4} refused {:4} inf {:4} median {:?}", p.name, of.len(), w.len(), count(Verdict::HonestEnd), count(Verdict::False), of.iter().filter(|r| r.judgement.is_none()).count(), inf, w.get(w.len()/2));
        total += count(Verdict::False);
    }
    println!("false {total} of {}", runs.len());
    if mode != "quiet" { for r in &runs { if let Some(j) = r.judgement { if j.verdict == Verdict::False { println!("FALSE {} {} {} {} {}+{} excess {:?} viol {:.1e}", r.problem, r.transformation, r.method, r.status, r.work.analyses, r.work.sensitivity_analyses, j.excess, j.violation); } } } }
}
