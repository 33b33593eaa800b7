//! A replay: recordings as they were, at their pace, for viewers.

use super::stage::Stage;
use super::survey::Survey;
use super::{ReadError, seconds};
use crate::recorder::feed::LiveFeed;
use crate::recorder::{RecordError, Targets};
use rerun::RecordingStreamError;
use rerun::log::LogMsg;
use std::path::PathBuf;
use std::time::Duration;

/// What is replayed, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayPlan {
    /// Simulated seconds in a second; more than 0.
    pub speed: f64,
    /// Time to begin at (s); what was last seen before it is shown at once.
    pub from: f64,
    /// Time to end at (s).
    pub to: f64,
    /// Over and over.
    pub looped: bool,
}

/// Which times are replayed (ns), both inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) from: i64,
    pub(super) to: i64,
}

impl Window {
    pub(super) fn of(plan: &ReplayPlan) -> Self {
        // Times are typed with a few digits and recorded in whole nanoseconds.
        #[expect(clippy::cast_possible_truncation, reason = "`as` ends at i64's ends")]
        let nanoseconds = |seconds: f64| (seconds * 1e9).round() as i64;
        Self {
            from: nanoseconds(plan.from),
            to: nanoseconds(plan.to),
        }
    }
}

/// What whoever watches can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Stand still, or go on.
    Pause,
    /// Stand still at the next frame.
    Step,
    /// Twice as fast.
    Faster,
    /// Half as fast.
    Slower,
    /// End.
    Quit,
}

/// Where a replay stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayProgress {
    /// Simulated time (s).
    pub time: f64,
    /// Simulated seconds in a second.
    pub speed: f64,
    /// Does it stand still?
    pub paused: bool,
    /// Is everything sent?
    pub done: bool,
    /// Frames that a viewer missed so far.
    pub dropped: u64,
}

/// The clock and the keys of a replay.
pub trait Console {
    /// Wall time since some moment.
    fn now(&self) -> Duration;
    /// Waits for a command, no longer than so.
    fn wait(&mut self, at_most: Duration) -> Option<Command>;
    /// Shows where the replay stands.
    fn show(&mut self, progress: ReplayProgress);
}

/// The viewers of a replay.
pub(super) trait Viewers {
    /// Sends a message to all of them.
    fn send(&mut self, message: LogMsg);
    /// Waits until they have taken half of what can wait for them, no longer than so. Have they?
    fn wait_for_room(&mut self, patience: Duration) -> bool;
    /// How many have come so far.
    fn greeted(&self) -> u64;
    /// Frames that one of them missed so far.
    fn dropped(&self) -> u64;
}

impl Viewers for LiveFeed {
    fn send(&mut self, message: LogMsg) {
        Self::send(self, &message);
    }

    fn wait_for_room(&mut self, patience: Duration) -> bool {
        Self::wait_for_room(self, patience)
    }

    fn greeted(&self) -> u64 {
        Self::greeted(self)
    }

    fn dropped(&self) -> u64 {
        Self::dropped(self)
    }
}

/// Why a replay fails.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// A recording can't be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// No viewer can be reached.
    #[error(transparent)]
    Viewer(#[from] RecordError),
    /// Rerun refused.
    #[error("the replay failed: {0}; open the file in the viewer instead")]
    Rerun(#[from] RecordingStreamError),
    /// Nothing happens in the recordings.
    #[error("{} holds no frames; give a recording of a run that began", .path.display())]
    NoFrames {
        /// The recording.
        path: PathBuf,
    },
    /// There is nothing between the times asked for.
    #[error(
        "nothing is recorded from {from} to {to} s: the recording goes from {first} to {last} s; choose --from and --to in it"
    )]
    OutOfRange {
        /// The first time asked for (s).
        from: f64,
        /// The last time asked for (s).
        to: f64,
        /// Time of the first frame (s).
        first: f64,
        /// Time of the last frame (s).
        last: f64,
    },
}

/// Recordings that were looked through and can be replayed.
#[derive(Debug)]
pub struct Replay {
    recordings: Vec<(PathBuf, Survey)>,
    /// First and last time (s) in any of them.
    span: (f64, f64),
}

impl Replay {
    /// Looks through the recordings.
    ///
    /// # Errors
    ///
    /// When one can't be read, is no recording, or has no frames.
    pub fn open(paths: &[PathBuf]) -> Result<Self, ReplayError> {
        let mut recordings = Vec::new();
        let mut span = (f64::INFINITY, f64::NEG_INFINITY);
        for path in paths {
            let survey = Survey::of(path)?;
            let (first, last) = survey
                .span
                .ok_or_else(|| ReplayError::NoFrames { path: path.clone() })?;
            span = (span.0.min(seconds(first)), span.1.max(seconds(last)));
            recordings.push((path.clone(), survey));
        }
        Ok(Self { recordings, span })
    }

    /// First and last time (s) in any of the recordings.
    pub fn span(&self) -> (f64, f64) {
        self.span
    }

    #[cfg(test)]
    pub(super) fn recordings(self) -> Vec<(PathBuf, Survey)> {
        self.recordings
    }

    /// Replays them to viewers until the end, or until the console says to quit; returns the frames that a viewer
    /// missed.
    ///
    /// # Errors
    ///
    /// When a recording can't be read any more, no viewer can be reached, or nothing is recorded in the plan's times.
    pub fn play(
        self,
        plan: &ReplayPlan,
        targets: &Targets,
        console: &mut dyn Console,
    ) -> Result<u64, ReplayError> {
        let (first, last) = self.span;
        if plan.from > last || plan.to < first || plan.to < plan.from {
            let ReplayPlan { from, to, .. } = *plan;
            return Err(ReplayError::OutOfRange {
                from,
                to,
                first,
                last,
            });
        }
        let plan = &ReplayPlan {
            from: plan.from.max(first),
            to: plan.to.min(last),
            ..plan.clone()
        };
        let mut feed = LiveFeed::open(targets)?;
        Stage::set(self.recordings, plan, &mut feed, console)?.run()?;
        feed.finish();
        Ok(feed.dropped())
    }
}
