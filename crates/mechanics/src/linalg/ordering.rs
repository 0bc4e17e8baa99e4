//! Numbering unknowns so that the matrix becomes a narrow band.

/// The reverse Cuthill–McKee order of a graph: `order[k]` is the node that gets number `k`.
///
/// `neighbours[i]` lists the nodes that node `i` is coupled with. Every component is started at a node far from the
/// others (found by repeated breadth-first search), which gives chains their natural order.
///
/// **Source.** Cuthill & McKee, *Proc. 24th Nat. Conf. ACM* (1969) 157–172; George & Liu's start node (1979).
pub fn reverse_cuthill_mckee(neighbours: &[Vec<usize>]) -> Vec<usize> {
    let mut placed = vec![false; neighbours.len()];
    let mut order = Vec::with_capacity(neighbours.len());
    for seed in 0..neighbours.len() {
        if !placed[seed] {
            let component = breadth_first(neighbours, remote_node(neighbours, seed)).0;
            component.iter().for_each(|&node| placed[node] = true);
            order.extend(component);
        }
    }
    order.reverse();
    order
}

/// A node at the far end of the component of `seed`.
fn remote_node(neighbours: &[Vec<usize>], seed: usize) -> usize {
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
    let mut level_of = std::collections::BTreeMap::from([(start, 1)]);
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
