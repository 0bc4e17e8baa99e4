//! Warnings of an analysis, wherever its numbers are shown.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright};

/// The impact absorber with a spring that pushes away, and other derivatives.
fn model(place: &TempFolder, derivatives: &str) {
    place.example("impact-absorber");
    let spring =
        "[[force]]\nname = \"magnet\"\nkind = \"coordinate-spring\"\nb = \"mass\"\nstiffness = -0.001\n\n[time]";
    let analysis = format!("[analysis]\nderivatives = \"{derivatives}\"");
    let text = place.read("impact-absorber.toml").replace("[time]", spring).replace("[analysis]", &analysis);
    std::fs::write(place.0.join("magnet.toml"), text).unwrap();
}

#[test]
fn warnings_are_shown_by_every_command_that_shows_the_numbers() {
    for derivatives in ["direct", "central"] {
        let place = TempFolder::new("warnings");
        model(&place, derivatives);
        let warning = "Warning: magnet: its stiffness of -0.001 N/m";
        let run = |arguments: &[&str], code: i32| {
            let shown = place.run(arguments, code);
            assert!(shown.contains(warning), "{arguments:?}: {shown}");
        };
        run(&["analyze", "magnet"], 0);
        let json: serde_json::Value =
            serde_json::from_slice(&linkwright(&["analyze", "magnet", "--json"], &place.0).stdout).unwrap();
        assert!(json["warnings"][0].as_str().unwrap().starts_with("magnet: its stiffness"));
        run(&["sensitivities", "magnet"], 0);
        run(&["optimize", "magnet", "--max-cycles", "2"], 3);
        run(&["resume", "magnet"], 3);
        let summary: serde_json::Value = serde_json::from_str(&place.read("out/magnet/summary.json")).unwrap();
        assert!(summary["warnings"][0].as_str().unwrap().starts_with("magnet: its stiffness"));
        let without_objective = place.read("magnet.toml");
        let from = without_objective.find("[objective]").unwrap();
        std::fs::write(place.0.join("simulation.toml"), &without_objective[..from]).unwrap();
        run(&["analyze", "simulation"], 0);
    }
}
