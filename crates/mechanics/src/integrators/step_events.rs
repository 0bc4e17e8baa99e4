//! Events at the ends of a step, and the times and lengths that depend on them.

use crate::integrators::generalized_alpha::WITHOUT_HISTORY;

/// Events at the ends of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StepEvents {
    /// The contact or event at the end.
    pub closed: Option<usize>,
    /// True if the end is at a given time, which does not depend on the design.
    pub has_given_end: bool,
    /// Number of steps since the last event at the beginning.
    pub since_event: usize,
    /// True if the time of the beginning depends on the design, by an event.
    pub is_moved: bool,
    /// True if the length of the step before depends on the design.
    pub has_moved_history: bool,
}

impl StepEvents {
    /// Number of values in a row of a recording.
    pub const VALUES: usize = 5;

    /// Returns whether the step depends on the design by its length, its time, or the length of the step before.
    pub fn depends_on_event(&self) -> bool {
        self.closed.is_some() || self.begins_with_event()
    }

    /// Returns whether the beginning of the step depends on the time of an event before it.
    pub fn begins_with_event(&self) -> bool {
        self.is_moved || (self.has_moved_history && self.since_event >= WITHOUT_HISTORY)
    }

    /// Returns whether the step begins without a history, after an event.
    pub fn is_without_history(&self) -> bool {
        self.since_event < WITHOUT_HISTORY
    }

    /// Returns true for the time of the end, and for the length of the step, if it depends on the design.
    pub fn moves(&self) -> [bool; 2] {
        match self.closed {
            Some(_) => [true, true],
            None => [self.is_moved && !self.has_given_end, self.is_moved && self.has_given_end],
        }
    }

    /// Appends [`StepEvents::VALUES`] values to a row of a recording.
    pub fn write(&self, to: &mut Vec<f64>) {
        let flag = |is_set: bool| f64::from(u8::from(is_set));
        let closed = self.closed.map_or(-1.0, |contact| contact as f64);
        let flags = [self.has_given_end, self.is_moved, self.has_moved_history].map(flag);
        to.extend([closed, self.since_event as f64]);
        to.extend(flags);
    }

    /// Reads the values of [`StepEvents::write`].
    pub fn read(values: &[f64]) -> Self {
        let closed = (values[0] >= 0.0).then_some(values[0] as usize);
        let [has_given_end, is_moved, has_moved_history] = [2, 3, 4].map(|k| values[k] != 0.0);
        Self { closed, has_given_end, since_event: values[1] as usize, is_moved, has_moved_history }
    }
}
