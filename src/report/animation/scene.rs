//! One scene as SVG inside a page: its first frame as elements, all frames as data for the script that moves them.

use super::Scene;
use crate::report::figure::Colour;
use crate::report::figure::markup::plain;
use crate::report::figure::{range, short};
use crate::report::plots::{Linkage, SpatialLinkage, ViewDirection, headed, stress_colour};
use maud::{Markup, html};

/// Width of a scene in units of its view box.
const WIDTH: f64 = 480.0;
/// Margin around the mechanism for the symbols of joints.
const MARGIN: f64 = 26.0;

/// Parts of a frame in drawing order, with the names that `player.js` uses.
const PARTS: [&str; 12] = [
    "guides", "plates", "bars", "stressed", "lines", "springs", "masses", "sliders", "ground", "joints", "arrows",
    "names",
];

/// Transformation from coordinates of the mechanism to those of the view box, with one scale for both axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Viewport {
    middle: [f64; 2],
    scale: f64,
    height: f64,
    /// Centre of a mechanism in space, about which it is rotated.
    centre: Option<[f64; 3]>,
}

impl Viewport {
    /// The viewport of a window, given by its limits along both axes.
    pub fn new([x, y]: &[[f64; 2]; 2]) -> Self {
        let (width, height) = (x[1] - x[0], y[1] - y[0]);
        let tall = WIDTH / (width / height).clamp(0.75, 2.4);
        let scale = ((WIDTH - 2.0 * MARGIN) / width).min((tall - 2.0 * MARGIN) / height);
        Self { middle: [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])], scale, height: tall, centre: None }
    }

    /// The viewport of mechanisms in space, which contains all points in every orientation; `None` for planar mechanisms.
    pub fn in_space<'l>(frames: impl Iterator<Item = &'l Linkage>) -> Option<Self> {
        let points: Vec<[f64; 3]> =
            frames.filter_map(|f| f.space.as_deref()).flat_map(|s| s.points().copied()).collect();
        let centre = [0, 1, 2].map(|k| {
            let [low, high] = range(points.iter().map(|p| p[k]));
            0.5 * (low + high)
        });
        let distance = |p: &[f64; 3]| (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum::<f64>().sqrt();
        let radius = points.iter().map(distance).fold(0.0, f64::max);
        let height = 0.8 * WIDTH;
        let scale = (height / 2.0 - MARGIN) / radius.max(1e-9);
        (!points.is_empty()).then(|| Self {
            middle: ViewDirection::default().project(centre),
            scale,
            height,
            centre: Some(centre),
        })
    }

    /// The height in units of the view box.
    pub fn height(&self) -> f64 {
        self.height.round()
    }

    /// Returns whether mechanisms in it can be rotated.
    pub fn is_spatial(&self) -> bool {
        self.centre.is_some()
    }

    /// The numbers of a frame in space, part by part as in [`Viewport::frame`], with three coordinates of each point relative to
    /// the middle, in units of the view box; for a slider also the direction of its guide. After them the points whose paths are
    /// drawn.
    pub fn frame3(&self, linkage: &SpatialLinkage) -> [Vec<Vec<f64>>; 13] {
        let centre = self.centre.unwrap_or_default();
        let at = |p: &[f64; 3]| [0, 1, 2].map(|k| tenths(self.scale * (p[k] - centre[k])));
        let points = |all: &[[f64; 3]]| all.iter().map(|p| at(p).to_vec()).collect();
        let lines = |all: &[Vec<[f64; 3]>]| {
            all.iter().map(|line| line.iter().flat_map(at).collect()).collect::<Vec<Vec<f64>>>()
        };
        let pairs = |all: &[[[f64; 3]; 2]]| all.iter().map(|pair| pair.iter().flat_map(at).collect()).collect();
        let slider = |[place, along]: &[[f64; 3]; 2]| -> Vec<f64> {
            let direction = along.map(|x| (1e3 * x).round() / 1e3);
            at(place).into_iter().chain(direction).collect()
        };
        [
            pairs(&linkage.guides),
            lines(&linkage.plates),
            lines(&linkage.bars),
            vec![],
            vec![],
            pairs(&linkage.springs),
            points(&linkage.masses),
            linkage.sliders.iter().map(slider).collect(),
            points(&linkage.ground_joints),
            points(&linkage.joints),
            lines(&linkage.arrows),
            vec![],
            points(&linkage.traced),
        ]
    }

    /// The axes of the world in the lower right corner; `player.js` turns them.
    fn triad(&self) -> Markup {
        html! {
            g class="triad" transform={ "translate(" (WIDTH - 40.0) " " (self.height.round() - 40.0) ")" } {
                @for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
                    @let tip = ViewDirection::default().project([0, 1, 2].map(|c| f64::from(u8::from(c == k))));
                    path d=(path(&[0.0, 0.0, tenths(24.0 * tip[0]), tenths(-24.0 * tip[1])], false)) {}
                    text x=(tenths(32.0 * tip[0])) y=(tenths(4.0 - 32.0 * tip[1])) { (name) }
                }
            }
        }
    }

    fn position(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at =
            [WIDTH / 2.0 + self.scale * (x - self.middle[0]), self.height / 2.0 - self.scale * (y - self.middle[1])];
        at.map(tenths)
    }

    fn flat(&self, points: &[[f64; 2]]) -> Vec<f64> {
        points.iter().flat_map(|p| self.position(*p)).collect()
    }

    /// The numbers of a frame, part by part: flat lists of coordinates; for a slider also its angle in degrees.
    pub fn frame(&self, linkage: &Linkage) -> [Vec<Vec<f64>>; 12] {
        let curves = |bodies: &[Vec<[f64; 2]>]| bodies.iter().map(|body| self.flat(body)).collect();
        let ends = |pairs: &[[[f64; 2]; 2]]| pairs.iter().map(|pair| self.flat(pair)).collect();
        let points = |points: &[[f64; 2]]| points.iter().map(|p| self.flat(&[*p])).collect();
        let slider = |(at, angle): &([f64; 2], f64)| {
            let [x, y] = self.position(*at);
            vec![x, y, tenths(-angle.to_degrees())]
        };
        [
            ends(&linkage.guides),
            curves(&linkage.plates),
            curves(&linkage.bars),
            linkage
                .stressed
                .iter()
                .map(|(outline, share)| [self.flat(outline), vec![(100.0 * share).round()]].concat())
                .collect(),
            curves(&linkage.lines),
            ends(&linkage.springs),
            points(&linkage.masses),
            linkage.sliders.iter().map(slider).collect(),
            points(&linkage.ground_joints),
            points(&linkage.joints),
            linkage.arrows.iter().map(|arrow| self.flat(&headed(arrow))).collect(),
            linkage.notes.iter().map(|(_, at)| self.flat(&[*at])).collect(),
        ]
    }

    /// The SVG of the first frame with the traces; `behind` is drawn faintly behind the mechanism. `unit` is that of lengths.
    pub fn svg(&self, scene: &Scene, behind: Option<&Linkage>, unit: &str) -> Markup {
        html! {
            svg viewBox={ "0 0 " (WIDTH) " " (self.height.round()) } role="img" aria-label=(scene.title) {
                title { (scene.title) }
                @for trace in &scene.traces { path class="trace" d=(path(&self.flat(trace), false)) {} }
                @if self.is_spatial() {
                    @let traced = scene.frames[0].space.as_ref().map_or(0, |space| space.traced.len());
                    g class="traces" { @for _ in 0..traced { path class="trace" {} } }
                }
                @if let Some(behind) = behind { (self.group("behind", behind)) }
                (self.group("linkage", &scene.frames[0]))
                (self.scale_bar(unit))
                @if self.is_spatial() { (self.triad()) }
            }
        }
    }

    fn group(&self, class: &str, linkage: &Linkage) -> Markup {
        html! {
            g class=(class) {
                @for (name, items) in PARTS.iter().zip(self.frame(linkage)) {
                    g class=(name) {
                        @for (k, item) in items.iter().enumerate() {
                            @if *name == "names" {
                                text x="7" y="-7" transform={ "translate(" (item[0]) " " (item[1]) ")" } { (linkage.notes[k].0) }
                            } @else {
                                (shape(name, item))
                            }
                        }
                    }
                }
            }
        }
    }

    /// A bar of round length in the lower left corner.
    fn scale_bar(&self, unit: &str) -> Markup {
        let power = 10f64.powf((80.0 / self.scale).log10().floor());
        let length = [5.0, 2.0, 1.0].into_iter().map(|f| f * power).find(|l| l * self.scale <= 90.0).unwrap_or(power);
        let (foot, end) = ((self.height - 12.0).round(), (12.0 + length * self.scale).round());
        let (number, unit) = if unit == "m" && length < 1.0 { (1e3 * length, "mm") } else { (length, unit) };
        html! {
            path class="scale" d={ "M12 " (foot - 4.0) "V" (foot) "H" (end) "V" (foot - 4.0) } {}
            text class="scale" x="14" y=(foot - 8.0) { (plain(&short(number))) " " (unit) }
        }
    }
}

/// Rounds to a tenth of a unit, which is finer than any screen.
fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

/// The SVG element of a part at its position; `player.js` changes the same attributes.
fn shape(part: &str, at: &[f64]) -> Markup {
    let moved = || format!("translate({} {})", at[0], at[1]);
    match part {
        "plates" => html! { path d=(path(at, true)) {} },
        "stressed" => {
            let Colour(r, g, b) = stress_colour(at[8] / 100.0);
            html! { path d=(path(&at[..8], true)) style={ "fill: rgb(" (r) " " (g) " " (b) ")" } {} }
        }
        "bars" | "guides" | "arrows" | "lines" => html! { path d=(path(at, false)) {} },
        "springs" => html! { path d=(spring(at)) {} },
        "sliders" => html! {
            g transform={ (moved()) " rotate(" (at[2]) ")" } {
                rect x="-13" y="-8" width="26" height="16" rx="2" {}
                circle r="3.5" {}
            }
        },
        "ground" => html! {
            g transform=(moved()) {
                path d="M0 0L-9 15H9ZM-14 15H14" {}
                path class="earth" d="M-10 15l-4 5M-5 15l-4 5M0 15l-4 5M5 15l-4 5M10 15l-4 5" {}
                circle r="4" {}
            }
        },
        "masses" => html! { circle r="9" transform=(moved()) {} },
        _ => html! { circle r="4" transform=(moved()) {} },
    }
}

fn path(flat: &[f64], closed: bool) -> String {
    let points: Vec<String> = flat.chunks(2).map(|p| format!("{} {}", p[0], p[1])).collect();
    format!("M{}{}", points.join("L"), if closed { "Z" } else { "" })
}

/// A zigzag of six strokes between straight ends, as in `player.js`.
fn spring(ends: &[f64]) -> String {
    let (x, y, dx, dy) = (ends[0], ends[1], ends[2] - ends[0], ends[3] - ends[1]);
    let length = dx.hypot(dy).max(1e-9);
    let (nx, ny) = (-dy / length * 7.0, dx / length * 7.0);
    let mut flat = vec![x, y, x + 0.2 * dx, y + 0.2 * dy];
    for k in 0..6 {
        let (part, side) = (0.25 + 0.1 * f64::from(k), if k % 2 == 0 { 1.0 } else { -1.0 });
        flat.extend([x + part * dx + side * nx, y + part * dy + side * ny]);
    }
    flat.extend([x + 0.8 * dx, y + 0.8 * dy, ends[2], ends[3]]);
    path(&flat.into_iter().map(tenths).collect::<Vec<_>>(), false)
}
