//! Animations of mechanisms, as HTML and as animated GIF.

mod gif;
mod page;
mod scene;

use crate::report::figure::{
    Colour, Figure, Legend, Mark, Panel, PlotAxis, QuantityLabel, Stroke, check, literal, short,
};
use crate::report::plots::{Linkage, window};
use crate::{Error, Result};

/// The motion of one design.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Title, as plain text.
    pub title: String,
    /// The mechanism at each time.
    pub frames: Vec<Linkage>,
    /// Fixed curves, such as the path of a coupler point.
    pub traces: Vec<Vec<[f64; 2]>>,
}

impl Scene {
    /// The motion of a mechanism with the paths of its traced points.
    pub fn new(title: impl Into<String>, frames: Vec<Linkage>) -> Self {
        let count = frames.first().map_or(0, |frame| frame.traced.len());
        let path = |k: usize| frames.iter().filter_map(|frame| frame.traced.get(k)).copied().collect();
        let traces = (0..count).map(path).collect();
        Self { title: title.into(), frames, traces }
    }
}

/// The motion of the design of a cycle.
#[derive(Clone, Debug)]
struct CycleMotion {
    cycle: usize,
    frames: Vec<Linkage>,
}

/// The motion of several designs side by side, in one scale and over the same times.
///
/// ```
/// use linkwright::report::animation::{Animation, Scene};
/// use linkwright::report::{figure::QuantityLabel, plots::Linkage};
///
/// let crank = |angle: f64| Linkage {
///     bars: vec![vec![[0.0, 0.0], [angle.cos(), angle.sin()]]],
///     ground_joints: vec![[0.0, 0.0]],
///     ..Linkage::default()
/// };
/// let times: Vec<f64> = (0..20).map(|k| 0.05 * k as f64).collect();
/// let frames = times.iter().map(|t| crank(std::f64::consts::TAU * t)).collect();
/// let scene = Scene { title: "crank".to_owned(), frames, traces: vec![] };
/// let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
/// let animation = Animation::new("A rotating crank", axes, times, vec![scene])?.lasting(2.0)?;
/// assert!(animation.page().starts_with("<!DOCTYPE html>"));
/// assert_eq!(&animation.gif(96.0)?[..6], b"GIF89a");
/// # Ok::<(), linkwright::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Animation {
    description: String,
    axes: [QuantityLabel; 2],
    times: Vec<f64>,
    scenes: Vec<Scene>,
    seconds: f64,
    time: QuantityLabel,
    compared: bool,
    cycles: Vec<CycleMotion>,
}

impl Animation {
    /// An animation of all scenes at the given times in s, played in real time (0.1 s to 3600 s).
    ///
    /// # Errors
    /// If times do not increase, there is no scene, a scene has another number of frames than times, or a coordinate is not finite.
    pub fn new(
        description: impl Into<String>,
        axes: [QuantityLabel; 2],
        times: Vec<f64>,
        scenes: Vec<Scene>,
    ) -> Result<Self> {
        check::increasing("times of the animation", &times)?;
        check::not_empty("scenes of the animation", scenes.len())?;
        for scene in &scenes {
            Error::check_length(&format!("frames of '{}'", scene.title), times.len(), scene.frames.len())?;
            scene.frames.iter().try_for_each(Linkage::check)?;
            scene.traces.iter().try_for_each(|trace| check::finite_points("trace of the animation", trace))?;
        }
        let seconds = (times[times.len() - 1] - times[0]).clamp(0.1, 3600.0);
        let (time, description) = (QuantityLabel::new("*t*", "s"), description.into());
        Ok(Self { description, axes, times, scenes, seconds, time, compared: false, cycles: vec![] })
    }

    /// Sets the duration in seconds, for instance to slow down a vibration.
    ///
    /// # Errors
    /// [`Error::Option`] outside 0.1 to 3600 s.
    pub fn lasting(self, seconds: f64) -> Result<Self> {
        Error::check_option(
            "duration of the animation",
            "from 0.1 to 3600 s",
            seconds,
            (0.1..=3600.0).contains(&seconds),
        )?;
        Ok(Self { seconds, ..self })
    }

    /// Replaces name and unit of the time, for another parameter such as a crank rotation.
    pub fn over(self, time: QuantityLabel) -> Self {
        Self { time, ..self }
    }

    /// Draws the first scene faintly behind the others in the HTML page, with a check box to hide it.
    pub fn compared(self) -> Self {
        Self { compared: true, ..self }
    }

    /// Adds the motion of the design of a cycle over the same times, which the page shows in place of the last scene when this cycle is chosen.
    ///
    /// # Errors
    /// If there are other numbers of frames than times, or a coordinate is not finite.
    pub fn with_cycle(mut self, cycle: usize, frames: Vec<Linkage>) -> Result<Self> {
        Error::check_length(&format!("frames of cycle {cycle}"), self.times.len(), frames.len())?;
        frames.iter().try_for_each(Linkage::check)?;
        self.cycles.push(CycleMotion { cycle, frames });
        Ok(self)
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.times.len()
    }

    /// Limits along both axes of all scenes at all times.
    fn windows(&self) -> [[f64; 2]; 2] {
        let shown = self.scenes.iter().map(|scene| &scene.frames).chain(self.cycles.iter().map(|cycle| &cycle.frames));
        let frames = shown.flatten().flat_map(Linkage::extent);
        let traces = self.scenes.iter().flat_map(|scene| scene.traces.concat());
        let everything: Vec<[f64; 2]> = frames.chain(traces).collect();
        [0, 1].map(|k| window(everything.iter().map(|p| p[k])))
    }

    /// The figure at one time, scenes side by side.
    ///
    /// # Errors
    /// [`Error::Option`] for an index outside the times.
    pub fn still(&self, frame: usize) -> Result<Figure> {
        let inside = frame < self.times.len();
        Error::check_option("frame", "less than the number of times", frame as f64, inside)?;
        Ok(self.figure(frame, &self.windows()))
    }

    fn figure(&self, frame: usize, [x, y]: &[[f64; 2]; 2]) -> Figure {
        let columns = self.scenes.len().min(3);
        let rows = self.scenes.len().div_ceil(columns);
        let mut figure = Figure::new(&self.description, 75.0 * columns as f64, 70.0 * rows as f64).in_columns(columns);
        let time = short(self.times[frame]);
        for scene in &self.scenes {
            let axes = [PlotAxis::of(&self.axes[0]).limits(x[0], x[1]), PlotAxis::of(&self.axes[1]).limits(y[0], y[1])];
            let [x_axis, y_axis] = axes;
            let (name, unit) = (&self.time.name, &self.time.unit);
            let title = format!("{} ({name} = {time} {unit})", literal(&scene.title)).replace(" )", ")");
            let mut panel = Panel::new(x_axis, y_axis).equal().titled(title).legend(Legend::Absent);
            panel.add(Mark::curves(scene.traces.clone(), Stroke::solid(Colour::BLUE, 0.6)));
            // The placement of notes would change from frame to frame.
            Linkage { notes: Vec::new(), ..scene.frames[frame].clone() }.draw(&mut panel);
            figure = figure.with(panel);
        }
        figure
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn crank(count: usize) -> Animation {
        let times: Vec<f64> = (0..count).map(|k| k as f64 / count as f64).collect();
        let frame = |t: &f64| {
            let (s, c) = (std::f64::consts::TAU * t).sin_cos();
            Linkage { bars: vec![vec![[0.0, 0.0], [c, s]]], ground_joints: vec![[0.0, 0.0]], ..Linkage::default() }
        };
        let scene = |title: &str| Scene {
            title: title.to_owned(),
            frames: times.iter().map(frame).collect(),
            traces: vec![vec![[1.0, 0.0], [0.0, 1.0]]],
        };
        let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
        Animation::new("crank", axes, times.clone(), vec![scene("first </script> design"), scene("optimum")]).unwrap()
    }

    #[test]
    fn bad_animations_are_rejected() {
        let good = crank(4);
        let again = |times: Vec<f64>, scenes: Vec<Scene>| Animation::new("", good.axes.clone(), times, scenes);
        assert!(again(vec![], vec![]).is_err());
        assert!(again(good.times.clone(), vec![]).is_err());
        assert!(again(vec![0.0, 1.0], good.scenes.clone()).is_err());
        assert!(again(vec![0.0, 0.2, 0.1, 0.3], good.scenes.clone()).is_err());
        let mut broken = good.scenes.clone();
        broken[1].frames[2].bars[0][1][0] = f64::NAN;
        assert!(again(good.times.clone(), broken).is_err());
        assert!(good.clone().lasting(f64::INFINITY).is_err());
        assert!(good.still(4).is_err());
        assert!(good.still(3).unwrap().svg().unwrap().contains("optimum"));
    }
}
