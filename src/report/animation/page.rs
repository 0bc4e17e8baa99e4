//! The animation as HTML that needs nothing but a browser.

use serde_json::{Value, json};

use super::Animation;
use super::scene::Stage;
use crate::report::figure::markup;

const PLAYER: &str = include_str!("player.js");
const STYLE: &str = include_str!("player.css");

impl Animation {
    /// A whole page: it plays at once, with a slider for time and a choice of speed, without any network.
    ///
    /// `#t=0.3` behind the address shows that time and stands still.
    pub fn page(&self) -> String {
        let title = markup::escape(&markup::plain(&self.description));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
             <style>:root {{ color-scheme: light dark; }}\nbody {{ margin: 1.5rem auto; max-width: 72rem; padding: 0 1rem; }}\n\
             </style>\n</head>\n<body>\n{}</body>\n</html>\n",
            self.fragment()
        )
    }

    /// A `<figure>` to put into a larger page; several of them do not disturb each other. Without scripts it is a picture
    /// of the first frame.
    pub fn fragment(&self) -> String {
        let caption = markup::escape(&markup::plain(&self.description));
        // No tag inside a text may end the script that holds it, or begin another one.
        let data = self.data().to_string().replace('<', "\\u003c");
        let overlay = match self.compared {
            true => "<label><input type=\"checkbox\" checked> first design behind the other</label>",
            false => "",
        };
        format!(
            "<figure class=\"linkwright-animation\">\n<style>\n{STYLE}</style>\n\
             <div class=\"scenes\" tabindex=\"0\" role=\"group\" aria-label=\"Mechanism; space plays, arrows step\">\n{}</div>\n\
             <div class=\"controls\" hidden><button type=\"button\">Pause</button>\
             <input type=\"range\" min=\"0\" step=\"1\" value=\"0\" aria-label=\"time\"><output></output>\
             <label>speed <select></select></label>{overlay}</div>\n<figcaption>{caption}</figcaption>\n\
             <script type=\"application/json\">{data}</script>\n<script>\n{PLAYER}</script>\n</figure>\n",
            self.scenes_svg()
        )
    }

    fn scenes_svg(&self) -> String {
        let stage = Stage::new(&self.windows());
        let unit = markup::plain(&self.axes[0].unit);
        let one = |(k, scene): (usize, &super::Scene)| {
            let behind = (self.compared && k > 0).then(|| &self.scenes[0].frames[0]);
            let svg = stage.svg(&scene.title, &scene.traces, &scene.frames[0], behind, &unit);
            format!("<section><h3>{}</h3>\n{svg}</section>\n", markup::escape(&scene.title))
        };
        self.scenes.iter().enumerate().map(one).collect()
    }

    fn data(&self) -> Value {
        let stage = Stage::new(&self.windows());
        let scene = |scene: &super::Scene| scene.frames.iter().map(|f| stage.data(f)).collect::<Vec<Value>>();
        json!({
            "seconds": self.seconds,
            "times": self.times,
            "time": [markup::plain(&self.time.name), markup::plain(&self.time.unit)],
            "scenes": self.scenes.iter().map(scene).collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::crank;

    #[test]
    fn the_page_holds_its_data_and_asks_nobody() {
        let page = crank(5).page();
        for text in
            ["requestAnimationFrame", "type=\"range\"", "<h3>optimum</h3>", "<h3>first &lt;/script&gt; design</h3>"]
        {
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
        // Bars are the third part. A crank of length 1 turns from the right to the top: y falls by as much as x has grown.
        let bar =
            |frame: usize| -> Vec<f64> { serde_json::from_value(data["scenes"][1][frame][2][0].clone()).unwrap() };
        let (right, top) = (bar(0), bar(1));
        assert_eq!(right[..2], top[..2]);
        assert!((right[2] - right[0] - (top[1] - top[3])).abs() <= 0.2 && right[2] > right[0] + 50.0);
    }

    #[test]
    fn the_first_frame_is_there_without_the_script() {
        let (alone, compared) = (crank(4).fragment(), crank(4).compared().fragment());
        assert_eq!(
            (alone.matches("<g class=\"bars\"><path").count(), alone.matches("class=\"behind\"").count()),
            (2, 0)
        );
        assert_eq!(compared.matches("<g class=\"bars\"><path").count(), 3);
        assert!(compared.contains("type=\"checkbox\""));
    }
}
