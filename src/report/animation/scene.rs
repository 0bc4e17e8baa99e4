//! One scene as SVG inside a page: drawn at its first frame, and as data for the script that moves it.

use serde_json::{Value, json};
use std::fmt::Write;

use crate::report::figure::{markup, short};
use crate::report::plots::Linkage;

/// Width of a scene in the units of its view box.
const WIDTH: f64 = 480.0;
/// Room around the mechanism for the signs of joints.
const RIM: f64 = 26.0;

/// What a frame holds, in the order in which it is drawn; the script knows the same names.
const PARTS: [&str; 8] = ["guides", "plates", "bars", "springs", "masses", "sliders", "ground", "joints"];

/// From coordinates of the mechanism to those of the view box: one unit is as long on both axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    middle: [f64; 2],
    unit: f64,
    height: f64,
}

impl Stage {
    /// The stage that holds a window.
    pub fn new([x, y]: &[[f64; 2]; 2]) -> Self {
        let (width, height) = (x[1] - x[0], y[1] - y[0]);
        let tall = WIDTH / (width / height).clamp(0.75, 2.4);
        let unit = ((WIDTH - 2.0 * RIM) / width).min((tall - 2.0 * RIM) / height);
        Self { middle: [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])], unit, height: tall }
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = [WIDTH / 2.0 + self.unit * (x - self.middle[0]), self.height / 2.0 - self.unit * (y - self.middle[1])];
        // A tenth of a unit is finer than any screen.
        at.map(|v| (v * 10.0).round() / 10.0)
    }

    fn flat(&self, points: &[[f64; 2]]) -> Vec<f64> {
        points.iter().flat_map(|p| self.place(*p)).collect()
    }

    /// The numbers of a frame, part by part: flat lists of coordinates, and with a slider its angle in degrees.
    pub fn frame(&self, linkage: &Linkage) -> [Vec<Vec<f64>>; 8] {
        let all = |bodies: &[Vec<[f64; 2]>]| bodies.iter().map(|body| self.flat(body)).collect();
        let ends = |pairs: &[[[f64; 2]; 2]]| pairs.iter().map(|pair| self.flat(pair)).collect();
        let each = |points: &[[f64; 2]]| points.iter().map(|p| self.flat(&[*p])).collect();
        let slider = |(at, angle): &([f64; 2], f64)| {
            let [x, y] = self.place(*at);
            vec![x, y, (-angle.to_degrees() * 10.0).round() / 10.0]
        };
        [
            ends(&linkage.guides),
            all(&linkage.plates),
            all(&linkage.bars),
            ends(&linkage.springs),
            each(&linkage.masses),
            linkage.sliders.iter().map(slider).collect(),
            each(&linkage.ground_joints),
            each(&linkage.joints),
        ]
    }

    /// The frame for the script.
    pub fn data(&self, linkage: &Linkage) -> Value {
        json!(self.frame(linkage))
    }

    /// The SVG with the traces and the parts at one frame, behind them those of another scene.
    pub fn svg(
        &self,
        title: &str,
        traces: &[Vec<[f64; 2]>],
        shown: &Linkage,
        behind: Option<&Linkage>,
        unit: &str,
    ) -> String {
        let height = self.height.round();
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{0}\"><title>{0}</title>\n",
            markup::escape(title)
        );
        for trace in traces {
            let _ = writeln!(svg, "<path class=\"trace\" d=\"{}\"/>", path(&self.flat(trace), false));
        }
        if let Some(behind) = behind {
            svg += &self.group("behind", behind);
        }
        svg += &self.group("linkage", shown);
        svg + &self.scale(unit) + "</svg>\n"
    }

    fn group(&self, class: &str, linkage: &Linkage) -> String {
        let mut svg = format!("<g class=\"{class}\">");
        for (name, items) in PARTS.iter().zip(self.frame(linkage)) {
            let shapes: String = items.iter().map(|item| shape(name, item)).collect();
            let _ = write!(svg, "<g class=\"{name}\">{shapes}</g>");
        }
        svg + "</g>\n"
    }

    /// A bar of round length in the lower left corner.
    fn scale(&self, unit: &str) -> String {
        let power = 10f64.powf((80.0 / self.unit).log10().floor());
        let length = [5.0, 2.0, 1.0].into_iter().map(|f| f * power).find(|l| l * self.unit <= 90.0).unwrap_or(power);
        let (foot, end) = ((self.height - 12.0).round(), (12.0 + length * self.unit).round());
        let text = markup::escape(&format!("{} {unit}", markup::plain(&short(length))));
        format!(
            "<path class=\"scale\" d=\"M12 {0}V{foot}H{end}V{0}\"/><text class=\"scale\" x=\"14\" y=\"{1}\">{text}</text>",
            foot - 4.0,
            foot - 8.0
        )
    }
}

/// An element at its place; the script changes the same attributes.
fn shape(part: &str, at: &[f64]) -> String {
    match part {
        "plates" => format!("<path d=\"{}\"/>", path(at, true)),
        "bars" | "guides" => format!("<path d=\"{}\"/>", path(at, false)),
        "springs" => format!("<path d=\"{}\"/>", spring(at)),
        "sliders" => format!(
            "<g transform=\"translate({} {}) rotate({})\"><rect x=\"-13\" y=\"-8\" width=\"26\" height=\"16\" rx=\"2\"/>\
             <circle r=\"3.5\"/></g>",
            at[0], at[1], at[2]
        ),
        "ground" => format!(
            "<g transform=\"translate({} {})\"><path d=\"M0 0L-9 15H9ZM-14 15H14\"/>\
             <path class=\"earth\" d=\"M-10 15l-4 5M-5 15l-4 5M0 15l-4 5M5 15l-4 5M10 15l-4 5\"/><circle r=\"4\"/></g>",
            at[0], at[1]
        ),
        "masses" => format!("<circle r=\"9\" transform=\"translate({} {})\"/>", at[0], at[1]),
        _ => format!("<circle r=\"4\" transform=\"translate({} {})\"/>", at[0], at[1]),
    }
}

fn path(flat: &[f64], closed: bool) -> String {
    let points: Vec<String> = flat.chunks(2).map(|p| format!("{} {}", p[0], p[1])).collect();
    format!("M{}{}", points.join("L"), if closed { "Z" } else { "" })
}

/// Six strokes across between straight ends, as the script draws them.
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
    path(&flat.iter().map(|v| (v * 10.0).round() / 10.0).collect::<Vec<_>>(), false)
}
