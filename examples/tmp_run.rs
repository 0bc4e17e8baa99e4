use linkwright::library::four_bar::*;
fn main() {
    let problem = StressConstrained::as_published().problem().unwrap();
    let b = [0.0385, 0.0252, 0.02];
    let (mut a, mut r) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..20 {
        let t = std::time::Instant::now();
        for _ in 0..4 {
            problem.analyze(&b).unwrap();
        }
        a = a.min(t.elapsed().as_secs_f64() / 4.0);
        let t = std::time::Instant::now();
        robust_method().solve(&problem, |_| ()).unwrap();
        r = r.min(t.elapsed().as_secs_f64());
    }
    println!("analysis {:.2} run {:.2} = {:.2} analyses, {:.1} %", a * 1e3, r * 1e3, r / a, r / a / 0.58);
}
