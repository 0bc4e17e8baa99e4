//! Messages about mechanisms that cannot be assembled: which drives and loops are the reason.

use linkwright::model_file::read;

/// The message of the failed analysis of a file without design variables.
fn failure(text: &str) -> String {
    let model = read("m.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}"));
    model.simulate(&[]).err().unwrap_or_else(|| panic!("nothing fails: {text}")).to_string()
}

/// A slider-crank of a crank of 0.1 m and a rod of 0.3 m, with these drivers.
fn slider_crank(drivers: &str, analysis: &str) -> String {
    format!(
        "version = 2\n[[body]]\nname = 'crank'\nmass = 1\ninertia = 0.01\nposition = [0, 0]\nangle = 1.2\n\
         [[body]]\nname = 'pin'\nkind = 'point'\nmass = 1\nposition = [0.32, 0]\n\
         [[joint]]\nname = 'hinge'\na = 'ground'\nb = 'crank'\n\
         [[joint]]\nname = 'rod'\nkind = 'distance'\na = {{ body = 'crank', at = [0.1, 0] }}\nb = 'pin'\nlength = 0.3\n\
         [[joint]]\nname = 'guide'\nkind = 'point-on-line'\na = 'ground'\nb = 'pin'\n\
         {drivers}[time]\nto = 1\npoints = 11\n[analysis]\nkind = '{analysis}'\n\
         [[output]]\nname = 'x'\nvalue = 'pin.x'\n"
    )
}

fn driver(coordinate: &str, motion: &str) -> String {
    let name = coordinate.replace('.', "_drives_");
    format!("[[driver]]\nname = '{name}'\ncoordinate = '{coordinate}'\nmotion = '{motion}'\n")
}

/// Crank and slider are driven: whether the positions at the start agree or not, both drives are named.
#[test]
fn drives_of_one_degree_of_freedom_are_named() {
    let start = "0.1*cos(1.2) + sqrt(0.09 - 0.01*sin(1.2)^2)";
    for analysis in ["kinematics", "statics"] {
        for position in [start, "0.35"] {
            let drivers = driver("crank.theta", "1.2 + time") + &driver("pin.x", &format!("{position} + 0.01*time"));
            let message = failure(&slider_crank(&drivers, analysis));
            assert!(
                message.contains("the drives of crank.theta and pin.x prescribe the same degree of freedom"),
                "{analysis}, {position}: {message}"
            );
        }
        let relative = "[[driver]]\nname = 'push'\nkind = 'relative'\nb = 'pin.x'\nmotion = '0.35 + 0.01*time'\n";
        let message = failure(&slider_crank(&(driver("crank.theta", "1.2 + time") + relative), analysis));
        assert!(message.contains("the drives of crank.theta and push prescribe the same"), "{analysis}: {message}");
    }
}

/// The slider is driven beyond the reach of 0.4 m: kinematics and statics name the position near it, not the load.
#[test]
fn a_drive_that_locks_is_named_with_its_position() {
    for analysis in ["kinematics", "statics"] {
        // At the limit of the reach itself the position is singular.
        let message = failure(&slider_crank(&driver("pin.x", "0.32 + 0.2*time"), analysis));
        assert!(
            message.contains("singular position at t = 0.4 s") && message.contains("stroke of the drive"),
            "{message}"
        );
        let message = failure(&slider_crank(&driver("pin.x", "0.32 + 0.21*time"), analysis));
        assert!(
            message.contains("cannot be assembled") && message.contains("pin.x driven to 0.4"),
            "{analysis}: {message}"
        );
        assert!(!message.contains("load"), "{analysis}: {message}");
        assert!(!message.contains("same degree of freedom"), "{analysis}: {message}");
    }
}

/// A rod that is too short and in line with the crank leaves constraints that depend on each other: the gap is the reason.
#[test]
fn a_loop_that_is_too_short_is_not_called_redundant() {
    for analysis in ["dynamics", "statics"] {
        let text = slider_crank("", analysis).replace("angle = 1.2", "angle = 0").replace("[0.32, 0]", "[5, 0]");
        let text = text.replace("kind = 'point'\nmass = 1\n", "kind = 'fixed-node'\n");
        let guide = text.find("[[joint]]\nname = 'guide'").unwrap();
        let rest = text.find("[time]").unwrap();
        let text = text[..guide].to_owned() + &text[rest..].replace("pin.x", "crank.theta");
        let message = failure(&text);
        assert!(
            message.contains("rod") && message.contains("cannot be closed") && message.contains("a gap of 4.6"),
            "{analysis}: {message}"
        );
        assert!(!message.contains("redundant"), "{analysis}: {message}");
    }
}
