//! An SVG file as part of a page.

/// The SVG without its size on paper, so that the page decides, with names of its own, and with a name for readers of the
/// screen; colours are changed by the style sheet.
pub(super) fn embedded(svg: &str, number: usize) -> String {
    let own = svg
        .replace("id=\"clip", &format!("id=\"f{number}-clip"))
        .replace("url(#clip", &format!("url(#f{number}-clip"))
        .replacen("<title>", &format!("<title id=\"f{number}\">"), 1);
    let (head, rest) = own.split_once('>').unwrap_or((&own, ""));
    let kept = |attribute: &str| {
        let (_, value) = head.split_once(&format!(" {attribute}=\""))?;
        Some(format!(" {attribute}=\"{}\"", value.split('"').next()?))
    };
    let kept: String = ["viewBox", "role", "font-family"].into_iter().filter_map(kept).collect();
    format!("<svg{kept} aria-labelledby=\"f{number}\">{rest}")
}

#[cfg(test)]
mod tests {
    use super::embedded;
    use crate::report::figure::{Axis, Colour, Figure, Mark, Panel, Stroke};

    #[test]
    fn names_are_the_figures_own() {
        let mut panel = Panel::new(Axis::new("x", ""), Axis::new("y", ""));
        panel.add(Mark::curve(vec![[0.0, 0.0], [1.0, 1.0]], Stroke::solid(Colour::BLUE, 1.0)));
        let svg = Figure::new("A line", 85.0, 60.0).with(panel).svg().unwrap();
        let inline = embedded(&svg, 7);
        assert!(inline.starts_with("<svg viewBox=\"0 0 240.94 170.08\" role=\"img\" font-family="), "{inline}");
        assert!(inline.contains("<title id=\"f7\">A line</title>") && inline.contains("url(#f7-clip1)"));
        assert!(!inline.contains("xmlns") && !inline.contains("url(#clip"));
    }
}
