//! Contour lines by marching squares.

use std::collections::BTreeMap;

use super::grid::Grid;

/// The curves `value = level`, with larger values on their left. The last point of a closed curve equals the first.
///
/// Values are interpolated linearly along the edges of the grid, so the error of a curve is of second order in the cell size. A
/// saddle cell is resolved by the mean of its corners. Cells with NaN are omitted.
pub fn contour(grid: &Grid, level: f64) -> Vec<Vec<[f64; 2]>> {
    let mut next = BTreeMap::new();
    for j in 0..grid.y().len() - 1 {
        for i in 0..grid.x().len() - 1 {
            cross_cell(grid, level, i, j, &mut next);
        }
    }
    join(next).iter().map(|edges| edges.iter().map(|&edge| crossing(grid, level, edge)).collect()).collect()
}

/// About `count` round levels within the range of values of the grid.
pub fn round_levels(grid: &Grid, count: usize) -> Vec<f64> {
    let [low, high] = grid.range();
    if high <= low {
        return Vec::new();
    }
    let step = super::ticks::round_step((high - low) / count.max(1) as f64);
    super::ticks::multiples(step, low, high)
        .into_iter()
        .filter(|level| (low..high).contains(level) && *level > low)
        .collect()
}

/// An edge of the grid from `(i, j)` to its right or, if `up`, to its upper neighbour.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct GridEdge {
    i: usize,
    j: usize,
    up: bool,
}

/// Adds the pieces of a cell. Counter-clockwise around it, a curve enters at an edge where values fall below the level and leaves
/// where they rise, which puts larger values on its left.
fn cross_cell(grid: &Grid, level: f64, i: usize, j: usize, next: &mut BTreeMap<GridEdge, GridEdge>) {
    let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| grid.value(i, j));
    if corners.iter().any(|v| v.is_nan()) {
        return;
    }
    let edges = [
        GridEdge { i, j, up: false },
        GridEdge { i: i + 1, j, up: true },
        GridEdge { i, j: j + 1, up: false },
        GridEdge { i, j, up: true },
    ];
    let above = corners.map(|v| v > level);
    let falls = |k: usize| above[k] && !above[(k + 1) % 4];
    let rises = |k: usize| !above[k] && above[(k + 1) % 4];
    let middle_above = corners.iter().sum::<f64>() / 4.0 > level;
    for start in (0..4).filter(|&k| falls(k)) {
        // At a saddle, the mean decides whether the curve goes around the low corner or the high one.
        let order = if middle_above { [1, 2, 3] } else { [3, 2, 1] };
        if let Some(end) = order.into_iter().map(|step| (start + step) % 4).find(|&k| rises(k)) {
            next.insert(edges[start], edges[end]);
        }
    }
}

/// Joins the directed pieces: first the open chains, then the loops.
fn join(mut next: BTreeMap<GridEdge, GridEdge>) -> Vec<Vec<GridEdge>> {
    let ends: std::collections::BTreeSet<GridEdge> = next.values().copied().collect();
    let starts: Vec<GridEdge> = next.keys().copied().filter(|edge| !ends.contains(edge)).collect();
    let mut chains: Vec<Vec<GridEdge>> = starts.into_iter().map(|start| follow(&mut next, start)).collect();
    while let Some(&start) = next.keys().next() {
        chains.push(follow(&mut next, start));
    }
    chains
}

fn follow(next: &mut BTreeMap<GridEdge, GridEdge>, start: GridEdge) -> Vec<GridEdge> {
    let mut chain = vec![start];
    let mut at = start;
    while let Some(edge) = next.remove(&at) {
        chain.push(edge);
        at = edge;
    }
    chain
}

fn crossing(grid: &Grid, level: f64, edge: GridEdge) -> [f64; 2] {
    let (i, j) = if edge.up { (edge.i, edge.j + 1) } else { (edge.i + 1, edge.j) };
    let (from, to) = (grid.value(edge.i, edge.j), grid.value(i, j));
    let part = (level - from) / (to - from);
    let between = |a: f64, b: f64| a + part * (b - a);
    [between(grid.x()[edge.i], grid.x()[i]), between(grid.y()[edge.j], grid.y()[j])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_has_its_radius_and_its_inside_on_the_left() {
        let grid = Grid::sample([-2.0, 2.0], [-2.0, 2.0], [81, 81], |x, y| 2.25 - x * x - y * y).unwrap();
        let curves = contour(&grid, 0.0);
        assert_eq!(curves.len(), 1);
        let circle = &curves[0];
        assert_eq!(circle.first(), circle.last());
        assert!(circle.iter().all(|[x, y]| (x.hypot(*y) - 1.5).abs() < 5e-4));
        let twice_area: f64 = circle.windows(2).map(|p| p[0][0] * p[1][1] - p[1][0] * p[0][1]).sum();
        assert!((twice_area / 2.0 - std::f64::consts::PI * 2.25).abs() < 5e-3, "counter-clockwise: {twice_area}");
    }

    #[test]
    fn open_curves_saddles_and_holes() {
        let line = contour(&Grid::sample([0.0, 1.0], [0.0, 1.0], [5, 5], |x, _| x).unwrap(), 0.3);
        assert_eq!(line.len(), 1);
        assert_eq!(line[0].len(), 5);
        assert!(line[0].iter().all(|p| (p[0] - 0.3).abs() < 1e-15));
        let saddle = contour(&Grid::sample([-1.0, 1.0], [-1.0, 1.0], [2, 2], |x, y| x * y).unwrap(), 0.1);
        assert_eq!(saddle.len(), 2);
        let holed = Grid::sample([0.0, 1.0], [0.0, 1.0], [5, 5], |x, y| if y > 0.6 { f64::NAN } else { x }).unwrap();
        assert_eq!(contour(&holed, 0.3)[0].len(), 3);
        assert!(contour(&holed, 9.0).is_empty());
    }

    #[test]
    fn levels_are_round_and_inside() {
        let grid = Grid::sample([0.0, 1.0], [0.0, 1.0], [2, 2], |x, _| x).unwrap();
        let levels = round_levels(&grid, 5);
        assert_eq!(levels.len(), 4);
        assert!((levels[0] - 0.2).abs() < 1e-15);
        let flat = Grid::sample([0.0, 1.0], [0.0, 1.0], [2, 2], |_, _| 3.0).unwrap();
        assert!(round_levels(&flat, 5).is_empty());
    }
}
