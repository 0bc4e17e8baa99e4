//! Thin lines of drawings: ropes, dampers, wheels, cams, profiles, brake shoes, walls and stops, each as one polyline in the coordinates of the plane.

use std::f64::consts::TAU;

type PlanePoint = [f64; 2];

/// Places a shape: `along` and `across` relative to a line from `from` in the direction `angle`.
fn placed(from: PlanePoint, angle: f64, shape: impl IntoIterator<Item = PlanePoint>) -> Vec<PlanePoint> {
    let (s, c) = angle.sin_cos();
    shape.into_iter().map(|[u, v]| [from[0] + c * u - s * v, from[1] + s * u + c * v]).collect()
}

/// A cylinder open at its far end, and a piston in it on a rod: a damper from one point to another, at the distance `aside` from the line between them.
pub fn damper([from, to]: [PlanePoint; 2], width: f64, aside: f64) -> Vec<PlanePoint> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let (length, half) = (dx.hypot(dy), 0.5 * width);
    let (foot, rim, piston) = (0.3 * length, 0.65 * length, 0.5 * length);
    let cylinder =
        [[0.0, 0.0], [0.0, aside], [foot, aside], [foot, aside + half], [rim, aside + half], [foot, aside + half]];
    let far = [[foot, aside - half], [rim, aside - half], [foot, aside - half], [foot, aside]];
    // The polyline reaches the rod from its far end, as otherwise it would cross the cylinder.
    let shape = cylinder.into_iter().chain(far);
    let rod = [[piston, aside], [piston, aside + 0.7 * half], [piston, aside - 0.7 * half], [piston, aside]];
    let end = [[length, aside], [length, 0.0]];
    placed(from, dy.atan2(dx), shape.chain(rod).chain(end))
}

/// A hydraulic cylinder from one point to another: a closed barrel over three fifths of the length, and a rod.
pub fn cylinder([from, to]: [PlanePoint; 2], width: f64) -> Vec<PlanePoint> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let (length, half) = (dx.hypot(dy), 0.5 * width);
    let barrel = 0.6 * length;
    let around = [[0.0, 0.0], [0.0, half], [barrel, half], [barrel, -half], [0.0, -half], [0.0, 0.0]];
    // The rod begins at the rim of the barrel, to which the line returns along the lower side.
    let rod = [[0.0, -half], [barrel, -half], [barrel, 0.0], [length, 0.0]];
    placed(from, dy.atan2(dx), around.into_iter().chain(rod))
}

/// A wheel with a spoke that shows its rotation.
pub fn wheel(centre: PlanePoint, radius: f64, angle: f64) -> Vec<PlanePoint> {
    const SIDES: u32 = 24;
    let rim =
        (0..=SIDES).map(|k| (TAU * f64::from(k) / f64::from(SIDES)).sin_cos()).map(|(s, c)| [radius * c, radius * s]);
    placed(centre, angle, std::iter::once([0.0, 0.0]).chain(rim))
}

/// A shape that is fixed to a body whose origin is at a point and which is turned by an angle.
pub fn turned(at: PlanePoint, angle: f64, shape: Vec<PlanePoint>) -> Vec<PlanePoint> {
    placed(at, angle, shape)
}

/// A brake shoe: an arc of a third of a circle around a point, in the direction `angle`, with short legs outwards.
pub fn shoe(centre: PlanePoint, angle: f64, radius: f64) -> Vec<PlanePoint> {
    const SIDES: u32 = 8;
    let on = |k: u32, radius: f64| {
        let (s, c) = (TAU / 3.0 * (f64::from(k) / f64::from(SIDES) - 0.5)).sin_cos();
        [radius * c, radius * s]
    };
    let arc = (0..=SIDES).map(|k| on(k, radius));
    placed(centre, angle, std::iter::once(on(0, 1.3 * radius)).chain(arc).chain([on(SIDES, 1.3 * radius)]))
}

/// The profile of a cam, r₀ + h/2·(1 − cos(φ − φ₀)) at the angle φ on the cam.
pub fn cam(centre: PlanePoint, angle: f64, [base, lift, phase]: [f64; 3]) -> Vec<PlanePoint> {
    const SIDES: u32 = 32;
    let at = |k: u32| {
        let turn = TAU * f64::from(k) / f64::from(SIDES);
        let radius = base + 0.5 * lift * (1.0 - (turn - phase).cos());
        [radius * turn.cos(), radius * turn.sin()]
    };
    placed(centre, angle, std::iter::once([0.0, 0.0]).chain((0..=SIDES).map(at)))
}

/// A line through a point, hatched on its right: the side behind a wall whose outward normal points to the left.
pub fn wall(at: PlanePoint, angle: f64, half: f64, spacing: f64) -> Vec<PlanePoint> {
    let count = (2.0 * half / spacing).ceil().clamp(2.0, 40.0);
    let step = 2.0 * half / count;
    let hatch = |k: u32| {
        let u = -half + step * f64::from(k);
        [[u, 0.0], [u - 0.6 * step, -0.6 * step], [u, 0.0]]
    };
    placed(at, angle, (0..=count as u32).flat_map(hatch))
}

/// A toothed line from one point to another.
pub fn rack([from, to]: [PlanePoint; 2], tooth: f64) -> Vec<PlanePoint> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    let count = (length / tooth.max(1e-3 * length)).ceil().clamp(1.0, 40.0);
    let at = |k: u32| [length * f64::from(k) / (2.0 * count), if k.is_multiple_of(2) { 0.0 } else { -0.6 * tooth }];
    placed(from, dy.atan2(dx), (0..=2 * count as u32).map(at))
}

/// A small square: a rigid connection of two bodies.
pub fn rigid_connection(at: PlanePoint, angle: f64, half: f64) -> Vec<PlanePoint> {
    placed(at, angle, [[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_where_their_elements_are() {
        let ends = [[1.0, 2.0], [4.0, 6.0]];
        let line = damper(ends, 0.4, 0.0);
        assert_eq!(line.first(), Some(&ends[0]));
        let last = line.last().unwrap();
        assert!((last[0] - 4.0).hypot(last[1] - 6.0) < 1e-12);
        for [x, y] in &wheel([1.0, 1.0], 0.5, 0.3)[1..] {
            assert!(((x - 1.0).hypot(y - 1.0) - 0.5).abs() < 1e-12);
        }
        let profile: Vec<f64> = cam([0.0; 2], 0.2, [0.3, 0.1, 0.0])[1..].iter().map(|p| p[0].hypot(p[1])).collect();
        assert!((profile[0] - 0.3).abs() < 1e-12 && (profile[16] - 0.4).abs() < 1e-12);
        for [x, y] in &shoe([1.0, 1.0], 0.3, 0.5)[1..10] {
            assert!(((x - 1.0).hypot(y - 1.0) - 0.5).abs() < 1e-12);
        }
        let [x, y] = turned([1.0, 2.0], std::f64::consts::FRAC_PI_2, vec![[0.5, 0.0]])[0];
        assert!((x - 1.0).hypot(y - 2.5) < 1e-12);
        // A floor is hatched below.
        assert!(wall([0.0, 1.0], 0.0, 2.0, 0.5).iter().all(|p| p[1] <= 1.0));
        assert_eq!(rack([[0.0; 2], [1.0, 0.0]], 0.1).len(), 21);
    }
}
