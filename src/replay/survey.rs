//! A first look through a recording: what never changes, from when to when, and what comes late.

use super::{ReadError, reading::Messages};
use crate::recorder::entity;
use rerun::log::{Chunk, LogMsg};
use std::path::Path;

/// What a first look through a recording finds.
#[derive(Debug)]
pub(super) struct Survey {
    /// What every viewer needs at once: names, static data, properties, the blueprint.
    pub(super) sticky: Vec<LogMsg>,
    /// First and last time (ns); `None` when nothing happens in it.
    pub(super) span: Option<(i64, i64)>,
    /// What can still come at each place of the file.
    pub(super) horizon: Horizon,
}

impl Survey {
    /// Looks through a recording.
    pub(super) fn of(path: &Path) -> Result<Self, ReadError> {
        let mut survey = Self {
            sticky: Vec::new(),
            span: None,
            horizon: Horizon::default(),
        };
        let mut messages = Messages::open(path)?;
        let mut number = 0;
        while let Some(message) = messages.next()? {
            let rows = messages.rows(&message)?;
            if rows.as_ref().is_none_or(Chunk::is_static) {
                survey.sticky.push(message);
            } else if let Some((first, last)) = rows.as_ref().and_then(times_of) {
                survey.horizon.note(number, first);
                let span = survey.span.get_or_insert((first, last));
                *span = (span.0.min(first), span.1.max(last));
            }
            number += 1;
        }
        Ok(survey)
    }
}

/// First and last simulated time of rows (ns), if they have any: rows of other timelines aren't ours.
fn times_of(rows: &Chunk) -> Option<(i64, i64)> {
    let times = rows.timelines().get(&entity::SIM_TIME.into())?.times_raw();
    Some((*times.iter().min()?, *times.iter().max()?))
}

/// The earliest time that is still to come, at each place of a file.
///
/// A recording is written in batches, and the entities of a batch come one after another, each with several
/// frames: after a chunk with frames 1 to 30 of a mesh come frames 1 to 30 of its energy. Rows may only be
/// handed out in the order of time when nothing earlier can come.
///
/// Kept are the messages whose times are before those of all later ones: a few a batch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Horizon(Vec<(u64, i64)>);

impl Horizon {
    /// Takes the first time (ns) of message `number`; they come in order.
    fn note(&mut self, number: u64, first: i64) {
        while self.0.pop_if(|(_, time)| *time >= first).is_some() {}
        self.0.push((number, first));
    }

    /// The earliest time (ns) of the messages from `number` on; the end of time when there are none.
    pub(super) fn at(&self, number: u64) -> i64 {
        let passed = self.0.partition_point(|(message, _)| *message < number);
        self.0.get(passed).map_or(i64::MAX, |(_, time)| *time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_horizon_is_the_smallest_time_to_come(times in prop::collection::vec(-5_i64..5, 0..30)) {
            let mut horizon = Horizon::default();
            for (number, &time) in (0..).zip(&times) {
                horizon.note(number, time);
            }
            for number in 0..=times.len() {
                let smallest = times[number..].iter().min().copied().unwrap_or(i64::MAX);
                prop_assert_eq!(horizon.at(number as u64), smallest, "{:?} from {}", times, number);
            }
        }
    }

    #[test]
    fn batches_leave_little() {
        let mut horizon = Horizon::default();
        for number in 0..3000_u64 {
            // A hundred batches of 30 entities that all begin at one time.
            horizon.note(number, number.cast_signed() / 30);
        }
        assert_eq!(horizon.0.len(), 100);
    }
}
