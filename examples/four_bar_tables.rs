//! Writes Tables V and VI of Etman, van Campen & Schoofs (1998) and their figures to a folder, and checks that the three runs
//! converge and that the printed violations are reproduced: `cargo run --release --example four_bar_tables -- FOLDER`.

use linkwright::cases::four_bar::StressConstrained;
use linkwright::papers::ReproducedTable;
use linkwright::papers::etman_1998::four_bar::{
    as_printed, check_rows, table5, table6, table6_from_cycle_4, table6_rows, violation_rms,
};
use linkwright::papers::etman_1998::{four_bar_animation, four_bar_figures};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::path::PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "out/four-bar".to_owned()));
    std::fs::create_dir_all(&out)?;
    let write = |table: &ReproducedTable| -> Result<(), Box<dyn std::error::Error>> {
        println!("{}", table.comparison()?);
        std::fs::write(out.join(format!("{}.csv", table.name)), table.table.csv())?;
        Ok(())
    };
    let (fifth, runs) = table5(&mut |_, _| ())?;
    write(&fifth)?;
    for (name, run) in ["I", "II", "III"].iter().zip(&runs) {
        let rejected = run.state.history.iter().filter(|c| !c.accepted).count();
        println!("{name}: {} cycles, {rejected} rejected, {:?}", run.state.cycles(), run.state.counters);
        assert!(run.state.status.is_success());
    }
    for table in [table6(&mut |_, _| ())?, table6_from_cycle_4(&mut |_, _| ())?] {
        write(&table)?;
    }
    let checks = check_rows(&as_printed())?;
    let rows = table6_rows(&checks)?;
    let rms = violation_rms(&checks)?;
    println!("{}rms of V over 20 designs: {rms:.3} percentage points", rows.text());
    assert!(rms < 0.3, "the printed violations are reproduced within 0.3 percentage points");
    std::fs::write(out.join("table6_rows.csv"), rows.csv())?;
    let model = StressConstrained::as_published().mechanism;
    for (name, figure) in four_bar_figures("table6", &model, &runs[0])? {
        figure.save(&out, &name)?;
    }
    for (name, bytes) in four_bar_animation("table6", &model, &runs[0])? {
        std::fs::write(out.join(name), bytes)?;
    }
    Ok(())
}
