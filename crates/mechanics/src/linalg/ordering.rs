//! Orders of elimination: minimum fill for factorizations without interchanges, and reverse Cuthill–McKee for bands.

use std::collections::{BTreeMap, BTreeSet};

/// Minimum-degree order of elimination: each unknown with those that it is coupled with when it is eliminated.
///
/// The next unknown is always one with the fewest couplings, and the lowest number among equals. Unknowns in `late` (zero
/// diagonals) wait until all others that they are coupled with are eliminated. `rows[i]` lists the unknowns coupled with `i`
/// (increasing, symmetric; it may contain `i`). Returns `None` if the elimination takes more than `most` multiplications.
///
/// # Sources
///
/// Markowitz, *Management Sci.* 3 (1957) 255–269; George & Liu, *SIAM Rev.* 31 (1989) 1–19.
pub(crate) fn minimum_fill(rows: &[Vec<usize>], late: &[bool], most: usize) -> Option<Vec<(usize, Vec<usize>)>> {
    let n = rows.len();
    let others = |i: usize| rows[i].iter().copied().filter(move |&j| j != i);
    let mut coupled: Vec<Vec<usize>> = (0..n).map(|i| others(i).collect()).collect();
    let mut awaited: Vec<usize> =
        (0..n).map(|i| if late[i] { others(i).filter(|&j| !late[j]).count() } else { 0 }).collect();
    let mut queue: BTreeSet<_> = (0..n).filter(|&i| awaited[i] == 0).map(|i| (coupled[i].len(), i)).collect();
    let (mut order, mut multiplications) = (Vec::with_capacity(n), 0);
    while let Some((degree, next)) = queue.pop_first() {
        multiplications += degree * degree;
        if multiplications > most {
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

/// Merges two increasing lists, except the numbers in `omitted`.
fn union(a: &[usize], b: &[usize], omitted: [usize; 2]) -> Vec<usize> {
    let mut all: Vec<usize> = a.iter().chain(b).copied().filter(|i| !omitted.contains(i)).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Reverse Cuthill–McKee order of a graph: `order[k]` is the node with the number `k`.
///
/// `neighbours[i]` lists the nodes coupled with node `i`. The search of every component starts at a peripheral node, found by
/// repeated breadth-first search: a chain is numbered from one end to the other.
///
/// # Sources
///
/// Cuthill & McKee, *Proc. 24th Nat. Conf. ACM* (1969) 157–172; George & Liu's start node (1979).
pub fn reverse_cuthill_mckee(neighbours: &[Vec<usize>]) -> Vec<usize> {
    let mut placed = vec![false; neighbours.len()];
    let mut order = Vec::with_capacity(neighbours.len());
    for seed in 0..neighbours.len() {
        if !placed[seed] {
            let component = breadth_first(neighbours, peripheral_node(neighbours, seed)).0;
            component.iter().for_each(|&node| placed[node] = true);
            order.extend(component);
        }
    }
    order.reverse();
    order
}

/// A peripheral node of the component of `seed`.
fn peripheral_node(neighbours: &[Vec<usize>], seed: usize) -> usize {
    let (mut node, mut depth) = (seed, 0);
    for _ in 0..8 {
        let (visited, levels) = breadth_first(neighbours, node);
        if levels <= depth {
            break;
        }
        depth = levels;
        node = *visited.last().expect("a component holds its seed");
    }
    node
}

/// Nodes in breadth-first order, those of a level by degree, and the number of levels.
fn breadth_first(neighbours: &[Vec<usize>], start: usize) -> (Vec<usize>, usize) {
    let mut level_of = BTreeMap::from([(start, 1)]);
    let mut visited = vec![start];
    let mut head = 0;
    while head < visited.len() {
        let node = visited[head];
        let level = level_of[&node] + 1;
        let mut fresh: Vec<usize> = neighbours[node].iter().copied().filter(|n| !level_of.contains_key(n)).collect();
        fresh.sort_by_key(|&n| (neighbours[n].len(), n));
        fresh.dedup();
        level_of.extend(fresh.iter().map(|&n| (n, level)));
        visited.extend(fresh);
        head += 1;
    }
    let levels = level_of[visited.last().expect("the start is visited")];
    (visited, levels)
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

    #[test]
    fn a_shuffled_chain_becomes_tridiagonal() {
        let n = 50;
        let name = |k: usize| (k * 17) % n; // 17 and 50 have no common factor
        let mut neighbours = vec![Vec::new(); n];
        for k in 1..n {
            neighbours[name(k)].push(name(k - 1));
            neighbours[name(k - 1)].push(name(k));
        }
        let order = reverse_cuthill_mckee(&neighbours);
        let mut number = vec![0; n];
        order.iter().enumerate().for_each(|(k, &node)| number[node] = k);
        let width = |i: usize| neighbours[i].iter().map(|&j| number[i].abs_diff(number[j])).max().unwrap();
        assert_eq!((0..n).map(width).max(), Some(1));
    }

    #[test]
    fn every_component_is_numbered_once() {
        let mut order = reverse_cuthill_mckee(&[vec![2], vec![], vec![0], vec![]]);
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2, 3]);
    }
}
