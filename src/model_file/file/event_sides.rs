//! Limited histories at events: forces, velocities and accelerations jump there, and the largest value of a history may be the one just
//! before or just after an event, which no time point has.

use super::events::EventSpec;
use super::outputs::{AtEvent, OutputSpec};
use crate::problem::{Constraint, Quantity, TimeGrid};
use mechanics::mechanism::EventSide;

/// Outputs that are values of histories on both sides of events, added to the outputs of a file as they are needed.
pub struct EventSides<'a> {
    events: Vec<(usize, &'a str)>,
    grid: Option<&'a TimeGrid>,
    outputs: Vec<OutputSpec>,
}

impl<'a> EventSides<'a> {
    /// The `outputs`, and no values at events. The histories have their values at the points of `grid`.
    pub fn new(events: &'a [EventSpec], grid: Option<&'a TimeGrid>, outputs: Vec<OutputSpec>) -> Self {
        let all = events.iter().enumerate();
        let events = all.filter(|(_, event)| event.changes_forces()).map(|(k, event)| (k, event.name())).collect();
        Self { events, grid, outputs }
    }

    /// The outputs with those that were added.
    pub fn into_outputs(self) -> Vec<OutputSpec> {
        self.outputs
    }

    /// The `constraints`, each limit of a history followed by the same limit of its values on both sides of each event.
    pub fn constrain(&mut self, constraints: Vec<Constraint>) -> Vec<Constraint> {
        let mut all = vec![];
        for constraint in constraints {
            let is_limit = !constraint.is_equality();
            let sides = if is_limit { self.values(&constraint.quantity, constraint.window) } else { vec![] };
            let at_side = |(words, quantity): (String, Quantity)| {
                let mut side = constraint.clone();
                side.name = format!("{}, {words}", constraint.name);
                side.pair = constraint.pair.as_ref().map(|pair| format!("{pair}, {words}"));
                (side.quantity, side.window, side.selection, side.is_continuous) = (quantity, None, None, false);
                side
            };
            let sides: Vec<Constraint> = sides.into_iter().map(at_side).collect();
            all.push(constraint);
            all.extend(sides);
        }
        all
    }

    /// The values of a history on both sides of each event, with the words that say where. None for a number.
    ///
    /// If an event does not happen, they are the value at the end of the motion; if it is not inside the `window`, that at the last time point
    /// inside.
    pub fn values(&mut self, history: &Quantity, window: Option<[f64; 2]>) -> Vec<(String, Quantity)> {
        let mut values = vec![];
        for (event, name) in self.events.clone() {
            for (side, word) in [(EventSide::Before, "before"), (EventSide::After, "after")] {
                let (at, words) = (AtEvent { event, side, is_required: false }, format!("just {word} {name}"));
                let Some(quantity) = self.value(history, window, at, &words) else { return vec![] };
                values.push((words, quantity));
            }
        }
        values
    }

    fn value(&mut self, history: &Quantity, window: Option<[f64; 2]>, at: AtEvent, words: &str) -> Option<Quantity> {
        let uses = history.responses().to_vec();
        if !history.is_transient() || !uses.iter().any(|&h| self.outputs[h].is_transient) {
            return None;
        }
        let mut responses = vec![];
        for h in uses {
            let output = &self.outputs[h];
            let copy = output.is_transient.then(|| output.at_event(format!("{}, {words}", output.name), at));
            responses.push(copy.map_or(h, |copy| self.place_of(copy)));
        }
        let time = match (history.as_response(), window) {
            (Some(_), None) => 0,
            _ => self.place_of(OutputSpec::time_of_event(format!("time, {words}"), at)),
        };
        match window {
            None => history.at_instant(&responses, time),
            Some([from, to]) => {
                let last = self.grid?.points_between(from, to).last()?;
                history.at_instant_within(&responses, time, [from, to], last)
            }
        }
    }

    /// The number of the output, which is added if there is none of this name.
    fn place_of(&mut self, output: OutputSpec) -> usize {
        let place = self.outputs.iter().position(|other| other.name == output.name);
        place.unwrap_or_else(|| {
            self.outputs.push(output);
            self.outputs.len() - 1
        })
    }
}
