//! The order of elimination that makes little fill.

use std::collections::BTreeSet;

/// Unknowns in the order of elimination, each with those that it is coupled with when its turn comes.
///
/// Always the unknown with the fewest couplings is next, the one of lower number among equals; those in `late` (zero
/// diagonals) wait until the others that they are coupled with are eliminated. `rows[i]` lists the unknowns that `i` is
/// coupled with (increasing, symmetric; itself may be among them). `None` if an elimination would take more than `most`
/// multiplications.
///
/// **Source.** Markowitz, *Management Sci.* 3 (1957) 255–269; George & Liu, *SIAM Rev.* 31 (1989) 1–19.
pub(crate) fn minimum_fill(rows: &[Vec<usize>], late: &[bool], most: usize) -> Option<Vec<(usize, Vec<usize>)>> {
    let n = rows.len();
    let others = |i: usize| rows[i].iter().copied().filter(move |&j| j != i);
    let mut coupled: Vec<Vec<usize>> = (0..n).map(|i| others(i).collect()).collect();
    let mut awaited: Vec<usize> =
        (0..n).map(|i| if late[i] { others(i).filter(|&j| !late[j]).count() } else { 0 }).collect();
    let mut queue: BTreeSet<_> = (0..n).filter(|&i| awaited[i] == 0).map(|i| (coupled[i].len(), i)).collect();
    let (mut order, mut work) = (Vec::with_capacity(n), 0);
    while let Some((degree, next)) = queue.pop_first() {
        work += degree * degree;
        if work > most {
            return None;
        }
        let clique = std::mem::take(&mut coupled[next]);
        for &i in &clique {
            queue.remove(&(coupled[i].len(), i));
            coupled[i] = union(&coupled[i], &clique, [i, next]);
        }
        if !late[next] {
            others(next).filter(|&i| late[i]).for_each(|i| awaited[i] -= 1);
            queue.extend(others(next).filter(|&i| late[i] && awaited[i] == 0).map(|i| (coupled[i].len(), i)));
        }
        queue.extend(clique.iter().filter(|&&i| awaited[i] == 0).map(|&i| (coupled[i].len(), i)));
        order.push((next, clique));
    }
    Some(order)
}

/// Both increasing lists merged, without `left_out`.
fn union(a: &[usize], b: &[usize], left_out: [usize; 2]) -> Vec<usize> {
    let mut all: Vec<usize> = a.iter().chain(b).copied().filter(|i| !left_out.contains(i)).collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_is_eliminated_from_its_tips() {
        let mut rows = vec![vec![0, 1, 2, 3, 4]];
        rows.extend((1..5).map(|i| vec![0, i]));
        let order = minimum_fill(&rows, &[false; 5], usize::MAX).unwrap();
        assert_eq!(order.iter().map(|(i, _)| *i).collect::<Vec<_>>(), [1, 2, 3, 0, 4]);
        assert!(minimum_fill(&rows, &[false; 5], 3).is_none());
    }

    #[test]
    fn zero_diagonals_wait() {
        let rows = [vec![0, 1], vec![0, 1, 2], vec![1, 2]];
        let order = minimum_fill(&rows, &[true, false, true], usize::MAX).unwrap();
        assert_eq!(order.iter().map(|(i, _)| *i).collect::<Vec<_>>(), [1, 0, 2]);
    }
}
