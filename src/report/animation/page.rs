//! The animation as HTML without external files.

use super::Animation;
use super::scene::Viewport;
use crate::report::figure::markup::plain;
use crate::report::figure::short;
use crate::report::plots::{Linkage, ViewDirection};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::{Value, json};

const PLAYER: &str = include_str!("player.js");
const STYLE: &str = include_str!("player.css");
/// Largest number of names that are shown at first.
const FEW_NAMES: usize = 6;
/// Largest sizes in bytes of the motions of the scenes, and of those of cycles; beyond, they have fewer frames.
const SCENES: usize = 150_000;
const CYCLES: usize = 80_000;
const PAGE_STYLE: &str =
    ":root { color-scheme: light dark; }\nbody { margin: 1.5rem auto; max-width: 72rem; padding: 0 1rem; }";

impl Animation {
    /// A complete HTML page that needs no network. It plays when it is opened, with a slider for the time and a choice of speed.
    ///
    /// If the address ends with `#t=0.3`, the page shows that time and pauses.
    pub fn page(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (plain(&self.description)) }
                    style { (PreEscaped(PAGE_STYLE)) }
                }
                body { (self.figure_element()) }
            }
        };
        page.into_string()
    }

    /// A `<figure>` for a larger page, which may contain several of them. Without scripts it shows the first frame.
    pub fn fragment(&self) -> String {
        self.figure_element().into_string()
    }

    fn figure_element(&self) -> Markup {
        // A `<` inside the data could end the script element or begin another one.
        let is_spatial = self.viewport().is_spatial();
        let label = match is_spatial {
            true => "Mechanism; space plays, arrows step, arrows with shift turn the view",
            false => "Mechanism; space plays, arrows step",
        };
        let data = self.data().to_string().replace('<', "\\u003c");
        let frames = || self.scenes.iter().flat_map(|scene| &scene.frames);
        let names = frames().map(|frame| frame.notes.len()).max().unwrap_or(0);
        let stress = frames().map(|frame| frame.stress).fold(0.0, f64::max);
        html! {
            figure class=(if names > FEW_NAMES { "linkwright-animation nameless" } else { "linkwright-animation" }) {
                style { (PreEscaped(STYLE)) }
                div class="scenes" tabindex="0" role="group" aria-label=(label) {
                    (self.scene_elements())
                }
                div class="controls" hidden {
                    button type="button" { "Pause" }
                    input type="range" min="0" step="1" value="0" aria-label="time";
                    output {}
                    label { "speed " select class="speed" {} }
                    @if is_spatial {
                        label { "view "
                            select class="view" {
                                @for name in ["oblique", "front (x, z)", "side (y, z)", "top (x, y)"] { option { (name) } }
                                option hidden { "turned" }
                            }
                        }
                    }
                    @if self.compared {
                        label { input class="overlay" type="checkbox" checked; " first design behind the other" }
                    }
                    @if names > 0 {
                        label { input class="naming" type="checkbox" checked[names <= FEW_NAMES]; " names" }
                    }
                }
                @if stress > 0.0 {
                    p class="stress" {
                        "stress 0 " span {} " " (plain(&short(stress / 1e6))) " MPa (largest normal stress at the surface of beams)"
                    }
                }
                figcaption { (plain(&self.description)) }
                script type="application/json" { (PreEscaped(data)) }
                script { (PreEscaped(PLAYER)) }
            }
        }
    }

    fn scene_elements(&self) -> Markup {
        let viewport = self.viewport();
        let unit = plain(&self.axes[0].unit);
        html! {
            @for (k, scene) in self.scenes.iter().enumerate() {
                @let behind = (self.compared && k > 0).then(|| &self.scenes[0].frames[0]);
                section {
                    h3 { (scene.title) }
                    (viewport.svg(scene, behind, &unit))
                }
            }
        }
    }

    fn viewport(&self) -> Viewport {
        let frames = self.scenes.iter().flat_map(|scene| &scene.frames);
        Viewport::in_space(frames).unwrap_or_else(|| Viewport::new(&self.windows()))
    }

    fn data(&self) -> Value {
        let viewport = self.viewport();
        let frame = |linkage: &Linkage| match &linkage.space {
            Some(space) => json!(viewport.frame3(space)),
            None => json!(viewport.frame(linkage)),
        };
        let one = self.scenes.first().map_or(0, |scene| frame(&scene.frames[0]).to_string().len());
        let most = |size: usize, motions: usize| (size / (one * motions).max(1)).max(2);
        // The last frame belongs to every motion.
        let last = self.times.len() - 1;
        let apart = last.div_ceil(most(SCENES, self.scenes.len())).max(1);
        let shown: Vec<usize> = (0..last).step_by(apart).chain([last]).collect();
        let frames = |scene: &super::Scene| shown.iter().map(|&k| frame(&scene.frames[k])).collect::<Vec<Value>>();
        let view = ViewDirection::default();
        let turned = json!({ "height": viewport.height(), "azimuth": view.azimuth, "elevation": view.elevation });
        let stride = shown.len().div_ceil(most(CYCLES, self.cycles.len()));
        let thinned = |cycle: &super::CycleMotion| {
            let frames = shown.iter().step_by(stride).map(|&k| frame(&cycle.frames[k]));
            json!([cycle.cycle, frames.collect::<Vec<Value>>()])
        };
        json!({
            "space": viewport.is_spatial().then_some(turned),
            "stride": stride,
            "cycles": self.cycles.iter().map(thinned).collect::<Vec<_>>(),
            "seconds": self.seconds,
            "times": shown.iter().map(|&k| self.times[k]).collect::<Vec<f64>>(),
            "time": [plain(&self.time.name), plain(&self.time.unit)],
            "scenes": self.scenes.iter().map(frames).collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::crank;
    use super::*;

    /// A long motion has fewer frames in a page, and its end.
    #[test]
    fn a_long_motion_is_thinned() {
        let (short, long) = (crank(200).data(), crank(20_001).data());
        assert_eq!(short["times"].as_array().unwrap().len(), 200);
        let times = long["times"].as_array().unwrap();
        assert!(times.len() > 100 && long["scenes"].to_string().len() <= SCENES + SCENES / 5, "{}", times.len());
        assert_eq!(times.last(), crank(20_001).times.last().map(|t| json!(t)).as_ref());
        assert!(long["scenes"].as_array().unwrap().iter().all(|scene| scene.as_array().unwrap().len() == times.len()));
    }

    #[test]
    fn the_page_holds_its_data_and_loads_nothing() {
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
    fn the_first_frame_is_shown_without_the_script() {
        let (alone, compared) = (crank(4).fragment(), crank(4).compared().fragment());
        assert_eq!(
            (alone.matches("<g class=\"bars\"><path").count(), alone.matches("class=\"behind\"").count()),
            (2, 0)
        );
        assert_eq!(compared.matches("<g class=\"bars\"><path").count(), 3);
        assert!(compared.contains("type=\"checkbox\""));
    }
}
