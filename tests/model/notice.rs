//! The notice file lists the crates of `Cargo.lock` and `python/Cargo.lock`.

use std::collections::BTreeSet;

#[test]
fn the_notice_lists_every_crate() {
    let locks = [include_str!("../../Cargo.lock"), include_str!("../../python/Cargo.lock")];
    let packages = locks.iter().flat_map(|lock| lock.split("[[package]]").skip(1));
    let packages = packages.filter(|package| package.contains("\nsource = "));
    let name = |package: &'static str| package.split("name = \"").nth(1).unwrap().split('"').next().unwrap();
    let locked: BTreeSet<&str> = packages.map(name).collect();
    let table = include_str!("../../NOTICE.md").split("\n## ").next().unwrap();
    let rows = table.lines().filter(|line| line.starts_with("| ") && line.contains('`'));
    let listed: BTreeSet<&str> = rows.flat_map(|row| row.split('`').skip(1).step_by(2)).collect();
    let missing: Vec<_> = locked.difference(&listed).collect();
    let left: Vec<_> = listed.difference(&locked).collect();
    assert!(missing.is_empty() && left.is_empty(), "add {missing:?} to NOTICE.md, remove {left:?}");
}
