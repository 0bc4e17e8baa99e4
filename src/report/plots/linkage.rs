//! Drawing of a planar mechanism in one position, or of the view of one in space.

use super::spatial_linkage::{SpatialLinkage, ViewDirection};
use crate::Result;
use crate::report::figure::{
    Colour, Dash, Figure, Legend, Mark, MarkSymbol, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, check, range,
};

/// A planar mechanism in one position; coordinates in the unit of the axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Linkage {
    /// Bars, straight or bent: polylines of at least two points.
    pub bars: Vec<Vec<[f64; 2]>>,
    /// Rigid plates: outlines of at least three points.
    pub plates: Vec<Vec<[f64; 2]>>,
    /// Revolute joints between moving bodies.
    pub joints: Vec<[f64; 2]>,
    /// Revolute joints on the ground.
    pub ground_joints: Vec<[f64; 2]>,
    /// Sliders: position, and angle of the guide in radians.
    pub sliders: Vec<([f64; 2], f64)>,
    /// Guides of sliders, from end to end.
    pub guides: Vec<[[f64; 2]; 2]>,
    /// Springs, from end to end.
    pub springs: Vec<[[f64; 2]; 2]>,
    /// Thin lines: wheels, racks, cams, walls, dampers, ropes.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Elements of beams of true thickness, as outlines, with their largest normal stress as a share of `stress`.
    pub stressed: Vec<([[f64; 2]; 4], f64)>,
    /// The stress of the darkest colour, in Pa.
    pub stress: f64,
    /// Point masses.
    pub masses: Vec<[f64; 2]>,
    /// Arrows of loads and drives: lines from their beginning to the tip, straight or bent.
    pub arrows: Vec<Vec<[f64; 2]>>,
    /// Texts near points, such as names of links.
    pub notes: Vec<(String, [f64; 2])>,
    /// The mechanism in space of which this is a view.
    pub space: Option<Box<SpatialLinkage>>,
    /// Points whose paths are drawn.
    pub traced: Vec<[f64; 2]>,
}

impl Linkage {
    pub(crate) fn check(&self) -> Result<()> {
        let bodies = self.bars.len() + self.plates.len() + self.sliders.len() + self.masses.len() + self.stressed.len();
        check::not_empty("bodies of the mechanism", bodies)?;
        for body in self.bars.iter().chain(&self.plates).chain(&self.arrows).chain(&self.lines) {
            check::finite_points("body of the mechanism", body)?;
        }
        let points = self.points();
        for point in points.chain(self.sliders.iter().map(|s| &s.0)).chain(self.notes.iter().map(|n| &n.1)) {
            check::finite("joint of the mechanism", point)?;
        }
        for (outline, share) in &self.stressed {
            check::finite_points("beam of the mechanism", outline)?;
            check::finite("stress of a beam", &[*share])?;
        }
        self.traced.iter().try_for_each(|point| check::finite("traced point of the mechanism", point))?;
        self.sliders.iter().try_for_each(|slider| check::finite("angle of a slider", &[slider.1]))
    }

    /// Adds the mechanism to a panel, bodies first, joints on top.
    pub(crate) fn draw(&self, panel: &mut Panel) {
        let outline = Stroke::solid(Colour(70, 70, 70), 0.9);
        for guide in &self.guides {
            panel.add(Mark::curve(*guide, Stroke::solid(Colour::GREY, 0.7).dash(Dash::DashDot)));
        }
        for plate in &self.plates {
            let closed: Vec<_> = plate.iter().chain(plate.first()).copied().collect();
            panel.add(Mark::region(plate.clone(), Colour::LIGHT_GREY, 0.6));
            panel.add(Mark::curve(closed, outline));
        }
        let width = self.spring_width();
        for spring in &self.springs {
            panel.add(Mark::curve(zigzag(*spring, width), Stroke::solid(Colour::GREEN, 0.9)));
        }
        for bar in &self.bars {
            panel.add(Mark::curve(bar.clone(), Stroke::solid(Colour(70, 70, 70), 2.0)));
        }
        for (outline, share) in &self.stressed {
            panel.add(Mark::region(outline.to_vec(), stress_colour(*share), 1.0));
        }
        for line in &self.lines {
            panel.add(Mark::curve(line.clone(), Stroke::solid(Colour(70, 70, 70), 0.8)));
        }
        if !self.masses.is_empty() {
            panel.add(Mark::points(self.masses.clone(), MarkerShape::Disc, Colour(70, 70, 70), 7.0));
        }
        panel.extend(self.sliders.iter().map(|&(at, angle)| Mark::symbol(at, MarkSymbol::Slider(angle))));
        panel.extend(self.ground_joints.iter().map(|&at| Mark::symbol(at, MarkSymbol::GroundJoint)));
        panel.extend(self.joints.iter().map(|&at| Mark::symbol(at, MarkSymbol::Joint)));
        for arrow in &self.arrows {
            panel.add(Mark::curve(headed(arrow), Stroke::solid(Colour::VERMILLION, 1.1)));
        }
        panel.extend(self.notes.iter().map(|(text, at)| Mark::note(*at, text)));
    }

    /// Points of joints, masses, guides and springs.
    fn points(&self) -> impl Iterator<Item = &[f64; 2]> {
        let joints = self.joints.iter().chain(&self.ground_joints).chain(&self.masses);
        joints.chain(self.guides.as_flattened()).chain(self.springs.as_flattened())
    }

    /// Width of a spring, relative to the size of the mechanism.
    fn spring_width(&self) -> f64 {
        let points = self.extent();
        let [width, height] = [0, 1].map(|k| range(points.iter().map(|p| p[k]))).map(|[low, high]| high - low);
        0.05 * width.max(height)
    }

    pub(crate) fn extent(&self) -> Vec<[f64; 2]> {
        let bodies = self.bars.iter().chain(&self.plates).chain(&self.arrows).chain(&self.lines).flatten();
        bodies
            .chain(self.stressed.iter().flat_map(|(outline, _)| outline))
            .chain(self.points())
            .copied()
            .chain(self.sliders.iter().map(|slider| slider.0))
            .collect()
    }
}

impl SpatialLinkage {
    /// The drawing of the mechanism in a view. It keeps the mechanism in space.
    pub fn seen(self, view: &ViewDirection) -> Linkage {
        let at = |p: &[f64; 3]| view.project(*p);
        let points = |all: &[[f64; 3]]| all.iter().map(at).collect();
        let lines = |all: &[Vec<[f64; 3]>]| all.iter().map(|line| line.iter().map(at).collect()).collect();
        let pairs = |all: &[[[f64; 3]; 2]]| all.iter().map(|pair| pair.each_ref().map(at)).collect();
        let slider = |[place, along]: &[[f64; 3]; 2]| {
            let [x, y] = at(along);
            (at(place), y.atan2(x))
        };
        Linkage {
            bars: lines(&self.bars),
            plates: lines(&self.plates),
            joints: points(&self.joints),
            ground_joints: points(&self.ground_joints),
            sliders: self.sliders.iter().map(slider).collect(),
            guides: pairs(&self.guides),
            springs: pairs(&self.springs),
            masses: points(&self.masses),
            arrows: self.arrows.iter().map(|arrow| arrow.iter().map(at).collect()).collect(),
            space: Some(Box::new(self)),
            ..Linkage::default()
        }
    }
}

/// From pale yellow without stress to dark red at the largest one.
pub(crate) fn stress_colour(share: f64) -> Colour {
    const ENDS: [[f64; 3]; 3] = [[255.0, 247.0, 188.0], [254.0, 153.0, 41.0], [140.0, 20.0, 20.0]];
    let at = 2.0 * share.clamp(0.0, 1.0);
    let (k, part) = if at < 1.0 { (0, at) } else { (1, at - 1.0) };
    let [r, g, b] = [0, 1, 2].map(|i| (ENDS[k][i] + part * (ENDS[k + 1][i] - ENDS[k][i])).round() as u8);
    Colour(r, g, b)
}

/// A spring as a zigzag of six strokes between straight ends of a fifth of the length.
fn zigzag([from, to]: [[f64; 2]; 2], width: f64) -> Vec<[f64; 2]> {
    const STROKES: usize = 6;
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = along[0].hypot(along[1]).max(f64::MIN_POSITIVE);
    let across = [-along[1] / length * width / 2.0, along[0] / length * width / 2.0];
    let at = |part: f64, side: f64| [0, 1].map(|k| from[k] + part * along[k] + side * across[k]);
    let stroke =
        |k: usize| at(0.2 + 0.6 * (k as f64 + 0.5) / STROKES as f64, if k.is_multiple_of(2) { 1.0 } else { -1.0 });
    [from, at(0.2, 0.0)].into_iter().chain((0..STROKES).map(stroke)).chain([at(0.8, 0.0), to]).collect()
}

/// A line with an arrowhead at its end, as one line. The head has a sixth of the length of the line.
pub(crate) fn headed(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let [.., before, tip] = line else { return line.to_vec() };
    let length: f64 = line.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum();
    let angle = (tip[1] - before[1]).atan2(tip[0] - before[0]);
    let side = |turn: f64| {
        let (s, c) = (angle + turn).sin_cos();
        [tip[0] - length / 6.0 * c, tip[1] - length / 6.0 * s]
    };
    line.iter().copied().chain([side(0.45), *tip, side(-0.45)]).collect()
}

/// Draws mechanisms side by side in one scale: positions of one design, or several designs.
///
/// `axes` are the quantities along x and y; each linkage comes with a title, which may be empty.
///
/// # Errors
/// If there is no mechanism, one has no bodies, or a coordinate is not finite.
pub fn mechanism(axes: &[QuantityLabel; 2], linkages: &[(&str, &Linkage)]) -> Result<Figure> {
    check::not_empty("mechanisms", linkages.len())?;
    let mut figure = Figure::new("Mechanism", if linkages.len() == 1 { 85.0 } else { 120.0 }, 65.0);
    linkages.iter().try_for_each(|(_, linkage)| linkage.check())?;
    let everything: Vec<[f64; 2]> = linkages.iter().flat_map(|(_, linkage)| linkage.extent()).collect();
    let [x, y] = [0, 1].map(|k| window(everything.iter().map(|p| p[k])));
    for (title, linkage) in linkages {
        let mut panel =
            Panel::new(PlotAxis::of(&axes[0]).limits(x[0], x[1]), PlotAxis::of(&axes[1]).limits(y[0], y[1]))
                .equal()
                .titled(*title)
                .legend(Legend::Absent);
        linkage.draw(&mut panel);
        figure = figure.with(panel);
    }
    Ok(figure.in_columns(2.min(linkages.len())))
}

/// Limits of all values, with a margin for the symbols of joints.
pub(crate) fn window(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = range(values);
    let margin = (0.1 * (high - low)).max(1e-3 * low.abs().max(high.abs())).max(1e-9);
    [low - margin, high + margin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crank_is_drawn_and_a_broken_one_is_refused() {
        let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
        let crank = Linkage {
            bars: vec![vec![[0.0, 0.0], [0.1, 0.2]]],
            joints: vec![[0.1, 0.2]],
            ground_joints: vec![[0.0, 0.0]],
            notes: vec![("crank".to_owned(), [0.05, 0.1])],
            ..Linkage::default()
        };
        let svg = mechanism(&axes, &[("first", &crank), ("last", &crank)]).unwrap().svg().unwrap();
        assert!(svg.contains(">crank<") && svg.contains(">last<") && svg.contains("<circle"));
        assert!(mechanism(&axes, &[("", &Linkage::default())]).is_err());
        let broken = Linkage { joints: vec![[f64::INFINITY, 0.0]], ..crank };
        assert!(mechanism(&axes, &[("", &broken)]).is_err());
        assert!(mechanism(&axes, &[]).is_err());
    }
}
