//! Complementarity of forces and accelerations of several parts whose forces have limits: rigid contacts and dry friction that change modes together.

use nalgebra::{DMatrix, DVector};

/// Acceleration, as a fraction of the largest one, and deviation of a force from its limit, as a fraction of the limit, that count as rounding.
const ROUNDING: f64 = 1e-9;

/// Acceleration of a part whose motion the held parts determine, as a fraction of the largest one, above which a drive accelerates it.
pub(crate) const DRIVEN: f64 = 1e-7;

/// Fraction of the compliance of a part that remains if the held parts do not move; below it, the part depends on them.
const DEPENDENT: f64 = 1e-10;

/// Largest number of iterations, per part.
const MOST_CHANGES: usize = 1000;

/// State of a part: either its acceleration is zero and determines the force, or the force is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PartState {
    /// The force is between its limits, and the acceleration is zero.
    Held,
    /// The force is zero between its limits, and the other forces make the acceleration zero.
    Unloaded,
    /// The force is the lower (−1) or the upper (1) limit, and the acceleration is zero or has this sign.
    AtLimit(f64),
}

/// Solves y = c − A f with l ≤ f ≤ u for the state of each part: y = 0 where f is between the limits, y ≥ 0 at the upper and y ≤ 0 at the
/// lower one.
///
/// * `free`: accelerations c of the parts without forces, in m/s² or rad/s²;
/// * `compliance`: A, symmetric and positive semidefinite, in the same units per N or N·m;
/// * `limits`: l ≤ 0 ≤ u in N or N·m.
///
/// These are the conditions for the minimum of ½ fᵀ A f − cᵀ f within the limits, which is convex: y is unique. An active-set method holds one
/// part after the other, each time the first one that accelerates, and releases parts that reach a limit. A part that accelerates although the
/// held ones determine its motion, as between a body at rest and a drive, is loaded against them until one of them reaches its limit. Each part
/// is scaled to a compliance of one. Returns `None` if none of them has a limit, or if the method does not terminate because of rounding errors.
///
/// # Sources
///
/// Nocedal & Wright, *Numerical Optimization* (2006), Section 16.5.
pub(crate) fn solve(free: &[f64], compliance: &DMatrix<f64>, limits: &[[f64; 2]]) -> Option<Vec<PartState>> {
    let n = free.len();
    let scale: Vec<f64> = (0..n).map(|k| compliance[(k, k)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let a = DMatrix::from_fn(n, n, |i, j| compliance[(i, j)] / (scale[i] * scale[j]));
    let c = DVector::from_fn(n, |k, _| free[k] / scale[k]);
    let limits: Vec<[f64; 2]> = (0..n).map(|k| limits[k].map(|limit| limit * scale[k])).collect();
    let smallest = ROUNDING * c.amax();
    let (mut force, mut held) = (DVector::zeros(n), Vec::<usize>::new());
    for _ in 0..MOST_CHANGES * n {
        let acceleration = &c - &a * &force;
        if move_to_limit(&a, &acceleration, &limits, (&mut force, &mut held))? {
            continue;
        }
        let acceleration = &c - &a * &force;
        let can_move = |k: usize, smallest: f64| {
            let [lower, upper] = limits[k];
            (acceleration[k] > smallest && force[k] < upper) || (acceleration[k] < -smallest && force[k] > lower)
        };
        let others: Vec<usize> = (0..n).filter(|k| !held.contains(k)).collect();
        if let Some(&next) = others.iter().find(|&&k| can_move(k, smallest) && is_independent(&a, &held, k)) {
            held.push(next);
        } else if let Some(&next) = others.iter().find(|&&k| can_move(k, DRIVEN * c.amax())) {
            load_against(&a, &limits, (next, acceleration[next].signum()), (&mut force, &mut held))?;
        } else {
            let negligible = ROUNDING * force.amax();
            return Some((0..n).map(|k| state_of(force[k], limits[k], (held.contains(&k), negligible))).collect());
        }
    }
    None
}

/// Increases the force of part `k` in a `direction`, and lets the `held` parts carry it, until one of all these reaches its limit. Returns `None` if
/// there is no limit.
fn load_against(
    a: &DMatrix<f64>,
    limits: &[[f64; 2]],
    (k, direction): (usize, f64),
    (force, held): (&mut DVector<f64>, &mut Vec<usize>),
) -> Option<()> {
    let among = DMatrix::from_fn(held.len(), held.len(), |i, j| a[(held[i], held[j])]);
    let column = DVector::from_fn(held.len(), |i, _| a[(held[i], k)]);
    let carried = if held.is_empty() { column } else { among.cholesky()?.solve(&column) };
    let parts: Vec<(usize, f64)> =
        held.iter().zip(carried.iter()).map(|(&j, share)| (j, -direction * share)).chain([(k, direction)]).collect();
    let room = |&(j, rate): &(usize, f64)| match rate {
        rate if rate > 0.0 => (limits[j][1] - force[j]) / rate,
        rate if rate < 0.0 => (limits[j][0] - force[j]) / rate,
        _ => f64::INFINITY,
    };
    let (length, (first, rate)) =
        parts.iter().map(|part| (room(part), *part)).min_by(|one, other| one.0.total_cmp(&other.0))?;
    if !length.is_finite() {
        return None;
    }
    parts.iter().for_each(|(j, rate)| force[*j] += length * rate);
    force[first] = limits[first][usize::from(rate > 0.0)];
    held.retain(|j| *j != first);
    Some(())
}

/// Changes the forces of the `held` parts so that they do not accelerate, as far as the limits allow. Returns true if a force reaches its limit
/// first; that part is then released.
fn move_to_limit(
    a: &DMatrix<f64>,
    acceleration: &DVector<f64>,
    limits: &[[f64; 2]],
    (force, held): (&mut DVector<f64>, &mut Vec<usize>),
) -> Option<bool> {
    if held.is_empty() {
        return Some(false);
    }
    let among = DMatrix::from_fn(held.len(), held.len(), |i, j| a[(held[i], held[j])]);
    let right = DVector::from_fn(held.len(), |i, _| acceleration[held[i]]);
    let change = among.cholesky()?.solve(&right);
    let share = |i: usize| {
        let [lower, upper] = limits[held[i]];
        let room = if change[i] > 0.0 { upper - force[held[i]] } else { lower - force[held[i]] };
        if change[i] == 0.0 { f64::INFINITY } else { room / change[i] }
    };
    let first = (0..held.len()).min_by(|&i, &j| share(i).total_cmp(&share(j)))?;
    let length = share(first).min(1.0);
    held.iter().zip(change.iter()).for_each(|(&k, change)| force[k] += length * change);
    if length < 1.0 {
        let k = held.remove(first);
        force[k] = limits[k][usize::from(change[first] > 0.0)];
    }
    Some(length < 1.0)
}

/// Returns whether part `k` can move while the `held` ones do not. `a` is the matrix of compliances, scaled to ones on its diagonal.
pub(crate) fn is_independent(a: &DMatrix<f64>, held: &[usize], k: usize) -> bool {
    if held.is_empty() {
        return a[(k, k)] > DEPENDENT;
    }
    let column = DVector::from_fn(held.len(), |i, _| a[(held[i], k)]);
    let among = DMatrix::from_fn(held.len(), held.len(), |i, j| a[(held[i], held[j])]);
    let carried = among.cholesky().map_or(f64::NAN, |factor| column.dot(&factor.solve(&column)));
    a[(k, k)] - carried > DEPENDENT
}

/// State of a part with this force. Up to rounding, a force at its limit counts as such; the limit zero has the rounding `negligible`.
fn state_of(force: f64, [lower, upper]: [f64; 2], (is_held, negligible): (bool, f64)) -> PartState {
    let rounding = |limit: f64| if limit == 0.0 { negligible } else { ROUNDING * limit.abs() };
    if upper.is_finite() && force >= upper - rounding(upper) {
        PartState::AtLimit(1.0)
    } else if lower.is_finite() && force <= lower + rounding(lower) {
        PartState::AtLimit(-1.0)
    } else if is_held {
        PartState::Held
    } else {
        PartState::Unloaded
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    /// Checks the conditions of [`solve`] with forces from the equations of the state that it returns.
    fn check(free: &[f64], compliance: &DMatrix<f64>, limits: &[[f64; 2]]) -> Vec<PartState> {
        let n = free.len();
        let parts = solve(free, compliance, limits).unwrap();
        let held: Vec<usize> = (0..n).filter(|&k| parts[k] == PartState::Held).collect();
        let mut force = DVector::zeros(n);
        for k in 0..n {
            if let PartState::AtLimit(side) = parts[k] {
                force[k] = limits[k][usize::from(side > 0.0)];
            }
        }
        let rest = DVector::from_column_slice(free) - compliance * &force;
        let among = DMatrix::from_fn(held.len(), held.len(), |i, j| compliance[(held[i], held[j])]);
        let right = DVector::from_fn(held.len(), |i, _| rest[held[i]]);
        let solved = if held.is_empty() { right } else { among.lu().solve(&right).unwrap() };
        held.iter().zip(solved.iter()).for_each(|(&k, f)| force[k] = *f);
        let acceleration = DVector::from_column_slice(free) - compliance * &force;
        let size = free.iter().fold(0.0f64, |a, c| a.max(c.abs())) * 1e-7;
        for k in 0..n {
            let ([lower, upper], y) = (limits[k], acceleration[k]);
            assert!(lower - 1e-7 <= force[k] && force[k] <= upper + 1e-7, "{k}: {force} {limits:?}");
            match parts[k] {
                PartState::AtLimit(side) => assert!(side * y >= -size, "{k}: {y}"),
                PartState::Held | PartState::Unloaded => assert!(y.abs() <= size, "{k}: {y}"),
            }
        }
        parts
    }

    /// Two friction forces of which the one that is released first reverses its direction: both slide.
    #[test]
    fn a_part_that_was_released_reverses() {
        // Two sliders, a friction force between them and one between the first and the ground: a = c − W M⁻¹ Wᵀ f.
        let compliance = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 3.0]);
        assert_eq!(
            check(&[2.0, 8.0], &compliance, &[[-1.0, 1.0], [-1.0, 1.0]]),
            [PartState::AtLimit(1.0), PartState::AtLimit(1.0)]
        );
        assert_eq!(check(&[0.5, 0.5], &compliance, &[[-2.0, 2.0], [-2.0, 2.0]]), [PartState::Held, PartState::Held]);
    }

    /// A second contact at the same place, and one without a force at the limit zero.
    #[test]
    fn a_part_that_others_hold_stays_unloaded() {
        let compliance = DMatrix::from_element(2, 2, 1.0);
        assert_eq!(
            check(&[1.0, 1.0], &compliance, &[[-2.0, 2.0], [-2.0, 2.0]]),
            [PartState::Held, PartState::Unloaded]
        );
        assert_eq!(
            check(&[3.0, 3.0], &compliance, &[[-2.0, 2.0], [-2.0, 2.0]]),
            [PartState::AtLimit(1.0), PartState::Held]
        );
        let contact = DMatrix::from_element(1, 1, 2.0);
        assert_eq!(check(&[-1.0], &contact, &[[0.0, f64::INFINITY]]), [PartState::AtLimit(-1.0)]);
        assert_eq!(check(&[1.0], &contact, &[[0.0, f64::INFINITY]]), [PartState::Held]);
    }

    /// A body between the ground and a belt that accelerates: it stays on one of them, or slides on both.
    #[test]
    fn a_body_between_parts_that_move_apart_slides_on_one_of_them() {
        let compliance = DMatrix::from_element(2, 2, 1.0);
        for (load, expected) in [
            (1.0, [PartState::Held, PartState::AtLimit(1.0)]),
            (-0.2, [PartState::AtLimit(-1.0), PartState::AtLimit(1.0)]),
            (4.2, [PartState::AtLimit(1.0), PartState::AtLimit(1.0)]),
            (5.3, [PartState::AtLimit(1.0), PartState::AtLimit(1.0)]),
            (-3.5, [PartState::AtLimit(-1.0), PartState::Held]),
        ] {
            assert_eq!(check(&[load, load + 1.5], &compliance, &[[-1.8, 1.8], [-2.2, 2.2]]), expected, "{load}");
        }
        let contacts = [[0.0, f64::INFINITY]; 2];
        let pressed = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
        assert_eq!(solve(&[0.0, 1.0], &pressed, &contacts), None);
    }

    /// Problems of three to eight parts on fewer coordinates, with all kinds of limits: every solution satisfies the conditions.
    #[test]
    fn random_problems_are_solved() {
        let mut seed = 12345u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        for case in 0..300 {
            let (parts, coordinates) = (3 + case % 6, 2 + case % 4);
            let gradients = DMatrix::from_fn(parts, coordinates, |_, _| random());
            let load = DVector::from_fn(coordinates, |_, _| 5.0 * random());
            let (free, compliance) = (&gradients * load, &gradients * gradients.transpose());
            let limits: Vec<[f64; 2]> = (0..parts)
                .map(|k| match k % 3 {
                    0 => [0.0, f64::INFINITY],
                    _ => [-2.0, 2.0].map(|side: f64| side * (random() + 1.1)),
                })
                .map(|[lower, upper]| [lower.min(0.0), upper.max(0.0)])
                .collect();
            check(free.as_slice(), &compliance, &limits);
        }
    }

    #[test]
    fn units_do_not_matter() {
        let gradients = Matrix3::new(1.0, 0.3, 0.0, -0.5, 1.0, 0.2, 0.0, -1.0, 1.0);
        let load = nalgebra::Vector3::new(3.0, -2.0, 4.0);
        let parts = |units: [f64; 3]| {
            let rows = Matrix3::from_fn(|i, j| gradients[(i, j)] * units[i]);
            let (free, a) = (rows * load, rows * rows.transpose());
            let limits: Vec<[f64; 2]> = units.iter().map(|unit| [-1.0 / unit, 1.0 / unit]).collect();
            let compliance = DMatrix::from_fn(3, 3, |i, j| a[(i, j)]);
            solve(free.as_slice(), &compliance, &limits).unwrap()
        };
        assert_eq!(parts([1.0; 3]), parts([1e6, 1.0, 1e-6]));
    }
}
