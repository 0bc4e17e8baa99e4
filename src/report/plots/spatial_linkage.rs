//! A mechanism in space in one position, and the direction from which it is seen.

/// A mechanism in space in one position; coordinates in the unit of the axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpatialLinkage {
    /// Bars, straight or bent: polylines of at least two points.
    pub bars: Vec<Vec<[f64; 3]>>,
    /// Flat plates: outlines of at least three points.
    pub plates: Vec<Vec<[f64; 3]>>,
    /// Joints between moving bodies.
    pub joints: Vec<[f64; 3]>,
    /// Joints on the ground.
    pub ground_joints: Vec<[f64; 3]>,
    /// Sliders: position and direction of the guide.
    pub sliders: Vec<[[f64; 3]; 2]>,
    /// Axes of hinges and guides of sliders, from end to end.
    pub guides: Vec<[[f64; 3]; 2]>,
    /// Springs and dampers, from end to end.
    pub springs: Vec<[[f64; 3]; 2]>,
    /// Point masses.
    pub masses: Vec<[f64; 3]>,
    /// Arrows of loads: polylines from the beginning to the tip.
    pub arrows: Vec<Vec<[f64; 3]>>,
    /// Points whose paths are drawn.
    pub traced: Vec<[f64; 3]>,
}

/// The direction from which a mechanism in space is seen: a parallel projection with the axis z of the world upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewDirection {
    /// Angle of the direction to the eye in the plane of x and y, from x towards y, in rad.
    pub azimuth: f64,
    /// Angle of the direction to the eye above that plane, in rad.
    pub elevation: f64,
}

impl Default for ViewDirection {
    fn default() -> Self {
        Self { azimuth: -60f64.to_radians(), elevation: 25f64.to_radians() }
    }
}

impl ViewDirection {
    /// Coordinates to the right and upwards.
    pub fn project(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let ((s, c), (se, ce)) = (self.azimuth.sin_cos(), self.elevation.sin_cos());
        [c * y - s * x, ce * z - se * (c * x + s * y)]
    }
}

impl SpatialLinkage {
    /// All points.
    pub fn points(&self) -> impl Iterator<Item = &[f64; 3]> {
        let lines = self.bars.iter().chain(&self.plates).chain(&self.arrows).flatten();
        let pairs = self.guides.iter().chain(&self.springs).flatten();
        let points = self.joints.iter().chain(&self.ground_joints).chain(&self.masses).chain(&self.traced);
        lines.chain(pairs).chain(points).chain(self.sliders.iter().map(|[place, _]| place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_view_shows_x_to_the_right_and_the_top_view_y_upwards() {
        let front = ViewDirection { azimuth: -90f64.to_radians(), elevation: 0.0 };
        let top = ViewDirection { elevation: 90f64.to_radians(), ..front };
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12;
        assert!(near(front.project([1.0, 2.0, 3.0]), [1.0, 3.0]));
        assert!(near(top.project([1.0, 2.0, 3.0]), [1.0, 2.0]));
        let seen =
            SpatialLinkage { bars: vec![vec![[0.0; 3], [1.0, 0.0, 1.0]]], ..SpatialLinkage::default() }.seen(&front);
        assert!(near(seen.bars[0][1], [1.0, 1.0]) && seen.space.is_some());
    }
}
