//! Prints the tables of `docs/mechanics-benchmarks.md`: `cargo run --release --example mechanics_benchmarks`.

mod series;
mod table;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models");
    let references = table::references(&std::fs::read_to_string(format!("{models}/benchmarks/references.csv"))?);
    let values = table::compute(models, &references)?;
    println!("{}", table::comparison(&references, &values));
    let series = series::all(&references);
    let (orders, measured) = table::orders(models, &series)?;
    println!("{orders}");
    let low = series.iter().zip(measured).filter(|(s, order)| *order < 0.9 * s.order);
    let low = low.map(|(s, order)| format!("{} with {}: order {order:.1}", s.model, s.scheme));
    let wrong: Vec<String> = table::outside(&references, &values).into_iter().chain(low).collect();
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n").into()) }
}
