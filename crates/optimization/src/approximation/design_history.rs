//! Data of the accepted designs of a run that approximations use.

use super::Asymptotes;

/// Number of last designs that a rule for moving asymptotes uses.
const LAST: usize = 3;

/// The accepted designs of a run: the last ones, the extent of all of them, and the distances of moving asymptotes. Its size does not
/// depend on the number of designs.
#[derive(Clone, Debug, Default)]
pub struct DesignHistory {
    /// Number of designs so far.
    count: usize,
    /// The last designs, the oldest first.
    last: Vec<Vec<f64>>,
    /// Least and largest value of each variable.
    extents: Vec<[f64; 2]>,
    /// Rules for moving asymptotes, with the distances of each variable.
    followed: Vec<(Asymptotes, Vec<[f64; 2]>)>,
}

impl DesignHistory {
    /// A history without designs, which updates the distances of these rules with each design; see
    /// [`Approximation::asymptotes`](super::Approximation::asymptotes).
    pub fn new(rules: &[Asymptotes]) -> Self {
        let followed = rules.iter().flat_map(Asymptotes::parts).map(|rule| (*rule, vec![])).collect();
        Self { followed, ..Self::default() }
    }

    /// The history of these designs, the oldest first.
    #[must_use]
    pub fn after<'b>(mut self, designs: impl IntoIterator<Item = &'b [f64]>) -> Self {
        designs.into_iter().for_each(|design| self.push(design));
        self
    }

    /// True if exactly the distances by these rules are tracked.
    pub(crate) fn follows(&self, rules: &[Asymptotes]) -> bool {
        rules.iter().flat_map(Asymptotes::parts).eq(self.followed.iter().map(|(rule, _)| rule))
    }

    /// The rules whose distances are tracked.
    pub(crate) fn rules(&self) -> Vec<Asymptotes> {
        self.followed.iter().map(|(rule, _)| *rule).collect()
    }

    /// Adds an accepted design.
    pub fn push(&mut self, design: &[f64]) {
        self.count += 1;
        if self.last.len() == LAST {
            self.last.remove(0);
        }
        self.last.push(design.to_vec());
        self.extents.resize(design.len(), [f64::INFINITY, f64::NEG_INFINITY]);
        for ([least, most], b) in self.extents.iter_mut().zip(design) {
            (*least, *most) = (least.min(*b), most.max(*b));
        }
        for (rule, distances) in &mut self.followed {
            *distances = (0..design.len())
                .map(|k| match distances.get(k) {
                    Some(before) if self.count >= LAST => rule.next(*before, k, &self.last),
                    _ => rule.first(k, &self.last),
                })
                .collect();
        }
    }

    /// The last design.
    pub fn last(&self) -> Option<&[f64]> {
        self.last.last().map(Vec::as_slice)
    }

    /// Least and largest value of variable k; an empty interval without designs.
    pub fn extent(&self, k: usize) -> [f64; 2] {
        self.extents.get(k).copied().unwrap_or([f64::INFINITY, f64::NEG_INFINITY])
    }

    /// Distances of the asymptotes of variable k; `None` if the rule is not tracked and there were more designs than it uses.
    pub(super) fn distances(&self, rule: &Asymptotes, k: usize) -> Option<[f64; 2]> {
        if let Some((_, distances)) = self.followed.iter().find(|(followed, _)| followed == rule)
            && let Some(known) = distances.get(k)
        {
            return Some(*known);
        }
        let first = || rule.first(k, &self.last[..self.last.len().min(LAST - 1)]);
        match self.count {
            0..LAST => Some(first()),
            LAST => Some(rule.next(first(), k, &self.last)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tracked distances, computed from all designs at once.
    fn from_the_start(rule: Asymptotes, designs: &[Vec<f64>]) -> [f64; 2] {
        let first = rule.first(0, &designs[..designs.len().min(2)]);
        designs.windows(3).fold(first, |distances, window| rule.next(distances, 0, window))
    }

    #[test]
    fn followed_distances_are_those_of_all_designs() {
        let relative = Asymptotes::Relative { initial: [1.0, 4.0], rate: 0.5, least: [0.75, 1.5], most: [51.0, 49.0] };
        let rules = [Asymptotes::SVANBERG_1987, Asymptotes::SVANBERG_2002, relative];
        let designs: Vec<Vec<f64>> = (0..500).map(|k| vec![2.0 + f64::sin(0.1 * f64::from(k * k))]).collect();
        let mut history = DesignHistory::new(&rules);
        for (k, design) in designs.iter().enumerate() {
            history.push(design);
            for rule in rules {
                assert_eq!(history.distances(&rule, 0), Some(from_the_start(rule, &designs[..=k])));
                let other = DesignHistory::default().after(designs[..=k].iter().map(Vec::as_slice));
                assert_eq!(other.distances(&rule, 0).is_some(), k < LAST);
            }
        }
        assert_eq!(history.last.len(), LAST);
        let [least, most] = history.extent(0);
        assert!(1.0 < least && least < 1.01 && 2.99 < most && most < 3.0);
    }
}
