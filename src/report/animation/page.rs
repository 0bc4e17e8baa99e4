//! The animation as HTML that needs nothing but a browser.

use serde_json::{Value, json};

use super::{Animation, Scene};
use crate::report::figure::markup;
use crate::report::picture::Linkage;

const PLAYER: &str = include_str!("player.js");
const STYLE: &str = include_str!("player.css");

impl Animation {
    /// A whole page: it plays at once, with a slider for time and a choice of speed, without any network.
    pub fn page(&self) -> String {
        let title = markup::escape(&markup::plain(&self.description));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
             <style>body {{ margin: 1.5rem auto; max-width: 72rem; padding: 0 1rem; }}</style>\n</head>\n<body>\n\
             {}</body>\n</html>\n",
            self.fragment()
        )
    }

    /// A `<figure>` to put into a larger page; several of them do not disturb each other.
    pub fn fragment(&self) -> String {
        let caption = markup::escape(&markup::plain(&self.description));
        // A closing tag inside a text must not end the script that holds it.
        let data = self.data().to_string().replace("</", "<\\/");
        format!(
            "<figure class=\"linkwright-animation\">\n<style>\n{STYLE}</style>\n<div class=\"scenes\"></div>\n\
             <div class=\"controls\"><button type=\"button\">Pause</button>\
             <input type=\"range\" min=\"0\" step=\"1\" value=\"0\" aria-label=\"time\"><output></output>\
             <label>speed <select></select></label></div>\n<figcaption>{caption}</figcaption>\n\
             <script type=\"application/json\">{data}</script>\n<script>\n{PLAYER}</script>\n</figure>\n"
        )
    }

    fn data(&self) -> Value {
        let [x, y] = self.windows();
        let labels = [0, 1].map(|k| markup::plain(&self.axes[k].label(0)));
        json!({
            "seconds": self.seconds,
            "times": self.times,
            "window": [x, y],
            "labels": labels,
            "scenes": self.scenes.iter().map(scene).collect::<Vec<_>>(),
        })
    }
}

fn scene(scene: &Scene) -> Value {
    let traces: Vec<Value> = scene.traces.iter().map(|trace| points(trace)).collect();
    json!({ "title": scene.title, "traces": traces, "frames": scene.frames.iter().map(frame).collect::<Vec<_>>() })
}

fn frame(linkage: &Linkage) -> Value {
    let all = |bodies: &[Vec<[f64; 2]>]| -> Vec<Value> { bodies.iter().map(|body| points(body)).collect() };
    json!({
        "plates": all(&linkage.plates),
        "bars": all(&linkage.bars),
        "guides": linkage.guides.iter().map(|guide| points(guide)).collect::<Vec<_>>(),
        "sliders": linkage.sliders.iter().map(|(at, angle)| json!([rounded(at[0]), rounded(at[1]), rounded(*angle)])).collect::<Vec<_>>(),
        "ground": points(&linkage.ground_joints),
        "joints": points(&linkage.joints),
    })
}

fn points(points: &[[f64; 2]]) -> Value {
    points.iter().map(|p| json!([rounded(p[0]), rounded(p[1])])).collect()
}

/// Six significant digits are finer than any screen.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::super::tests::crank;

    #[test]
    fn the_page_holds_its_data_and_asks_nobody() {
        let page = crank(5).page();
        for text in ["requestAnimationFrame", "type=\"range\"", "\"optimum\"", "first <\\/script> design"] {
            assert!(page.contains(text), "{text} is missing");
        }
        for address in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!page.contains(address), "{address}");
        }
        assert_eq!(page.matches("</script>").count(), 2);
    }

    #[test]
    fn the_data_are_the_frames() {
        let data = crank(4).data();
        assert_eq!(data["times"].as_array().unwrap().len(), 4);
        assert_eq!(data["scenes"][1]["frames"][1]["bars"][0][1][1], 1.0);
        assert_eq!(data["labels"][0], "x [m]");
    }
}
