//! The particles of a recording at any time, read along as time goes on.

use super::flat;
use crate::replay::{Layout, ReadError, for_each_frame};
use crate::study::Distance;
use glam::DVec3;
use std::collections::VecDeque;
use std::io;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{self, JoinHandle};

/// Frames that are read ahead.
const AHEAD: usize = 8;

/// Times this close (s) are one: recorded ones are whole nanoseconds.
const SAME_TIME: f64 = 2e-9;

/// A frame's time (s) and its particles (m).
type Still = (f64, Vec<DVec3>);

/// The particles of a recording at any time; times may only grow.
#[derive(Debug)]
pub(super) struct Timeline {
    frames: Option<Receiver<Still>>,
    reader: Option<JoinHandle<Result<(), ReadError>>>,
    /// The frames around the time that was asked for last: up to two before it and two after.
    around: VecDeque<Still>,
    /// How far frames were at most from where their neighbours would have them, around the times that were asked for:
    /// more than what is between frames is off by.
    unseen: Distance,
}

impl Timeline {
    /// Begins to read a recording.
    pub(super) fn start(path: &Path, layout: &Layout) -> io::Result<Self> {
        let (sender, frames) = sync_channel(AHEAD);
        let (path, layout) = (path.to_owned(), layout.clone());
        let read = move || {
            for_each_frame(&path, &layout, |frame| {
                match sender.send((frame.time, flat(&frame.cloths))) {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(_) => ControlFlow::Break(()), // nobody asks any more
                }
            })
        };
        let reader = thread::Builder::new().name("compare".to_owned());
        Ok(Self {
            frames: Some(frames),
            reader: Some(reader.spawn(read)?),
            around: VecDeque::new(),
            unseen: Distance::default(),
        })
    }

    /// The particles (m) at a time (s); `None` before the first frame and after the last.
    pub(super) fn at(&mut self, time: f64) -> Option<Vec<DVec3>> {
        // Two frames after the time, if there are so many, and no more than two before it.
        while self.after(time) < 2
            && let Some(next) = self.frames.as_ref().and_then(|frames| frames.recv().ok())
        {
            self.around.push_back(next);
            while self.before(time) > 2 {
                self.around.pop_front();
            }
        }
        let same = |still: &&Still| (still.0 - time).abs() <= SAME_TIME;
        if let Some((_, positions)) = self.around.iter().find(same) {
            return Some(positions.clone());
        }
        let before = self.before(time);
        let (from, to) = (before.checked_sub(1)?, before);
        let (start, end) = (&self.around[from], self.around.get(to)?);
        let outer = [from.checked_sub(1), Some(to + 1)];
        let [earlier, later] = outer.map(|k| k.and_then(|k| self.around.get(k)));
        let found = between(earlier, [start, end], later, time);
        if let (Some(earlier), Some(later)) = (earlier, later) {
            let missed = between(None, [earlier, end], Some(later), start.0);
            let missed = Distance::between(&missed, &start.1);
            self.unseen = Distance {
                rms: self.unseen.rms.max(missed.rms),
                largest: self.unseen.largest.max(missed.largest),
            };
        }
        Some(found)
    }

    /// See [`Comparison::unseen`](super::Comparison::unseen).
    pub(super) fn unseen(&self) -> Distance {
        self.unseen
    }

    /// Whether no later time has anything.
    pub(super) fn is_over(&self) -> bool {
        let reader = self.reader.as_ref();
        self.around.len() <= 1 && reader.is_none_or(JoinHandle::is_finished)
    }

    /// Ends the reading; says what went wrong with it.
    pub(super) fn finish(mut self) -> Result<(), ReadError> {
        self.frames = None;
        let ended = self.reader.take().map(JoinHandle::join);
        match ended {
            Some(Ok(read)) => read,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(()),
        }
    }

    fn before(&self, time: f64) -> usize {
        self.around.iter().filter(|still| still.0 <= time).count()
    }

    fn after(&self, time: f64) -> usize {
        self.around.len() - self.before(time)
    }
}

/// The particles between two frames, on cubics whose velocities are those of the parabolas through the neighbours.
fn between(
    earlier: Option<&Still>,
    [start, end]: [&Still; 2],
    later: Option<&Still>,
    time: f64,
) -> Vec<DVec3> {
    let span = end.0 - start.0;
    let s = (time - start.0) / span;
    let one = |i: usize| {
        let slope = (end.1[i] - start.1[i]) / span;
        let bent = |other: &Still, near: &Still| {
            let way = near.0 - other.0;
            let beyond = (near.1[i] - other.1[i]) / way;
            (slope * way.abs() + beyond * span) / (way.abs() + span)
        };
        let known = [earlier.map(|k| bent(k, start)), later.map(|k| bent(k, end))];
        // With one neighbour both are on one parabola.
        let velocities = match known {
            [Some(first), Some(last)] => [first, last],
            [Some(first), None] => [first, slope * 2.0 - first],
            [None, Some(last)] => [slope * 2.0 - last, last],
            [None, None] => [slope; 2],
        };
        let ends = [(start.1[i], velocities[0]), (end.1[i], velocities[1])];
        crate::study::track::hermite(ends, span, s)
    };
    (0..start.1.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parabolas are met exactly between three and four frames at any distances, straight lines between two.
    #[test]
    fn parabolas_are_met() {
        let at = |t: f64| DVec3::new(1.0 - t, 0.5 * t * t, 3.0 * t * t - 2.0 * t);
        let still = |t: f64| (t, vec![at(t)]);
        let frames = [0.0, 0.1, 0.25, 0.3].map(still);
        for time in [0.1, 0.13, 0.2, 0.2499] {
            let ends = [&frames[1], &frames[2]];
            let found = between(Some(&frames[0]), ends, Some(&frames[3]), time)[0];
            assert!(found.distance(at(time)) < 1e-14, "at {time}: {found}");
        }
        for time in [0.0, 0.03, 0.09] {
            let found = between(None, [&frames[0], &frames[1]], Some(&frames[2]), time)[0];
            assert!(found.distance(at(time)) < 1e-14, "at {time}: {found}");
        }
        let straight = [(0.0, vec![DVec3::ZERO]), (0.5, vec![DVec3::X])];
        let found = between(None, [&straight[0], &straight[1]], None, 0.125)[0];
        assert!(found.distance(DVec3::X * 0.25) < 1e-15, "{found}");
    }
}
