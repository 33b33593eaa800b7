//! Running the scene of a recording again, to see whether the same comes out.

use super::StateHash;
use crate::frame::{Capture, Frame};
use crate::pipeline::{self, Finished, PipelineError, Plan, Progress};
use crate::recorder::{RecordError, Recorded, Recorder};
use crate::simulation::Simulation;
use std::collections::BTreeMap;

/// How a run compares with its recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// All states of so many frames are the recorded ones, bit for bit.
    Same {
        /// Frames that were compared.
        frames: u64,
    },
    /// They part.
    Parts {
        /// Number of the first frame whose state isn't the recorded one.
        frame: u64,
        /// Its time (s).
        time: f64,
        /// Frames before it that are the same.
        same: u64,
    },
}

/// Runs a simulation that stands where a recording starts, and compares its frames with the recorded `hashes`.
///
/// # Errors
///
/// When a thread can't be started.
pub fn verify(
    simulation: Simulation,
    capture: Capture,
    hashes: BTreeMap<u64, StateHash>,
    plan: &Plan<'_>,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Verdict, PipelineError> {
    let mut comparing = Comparing {
        hashes,
        same: 0,
        parts: None,
        over: false,
    };
    let ran = pipeline::run(simulation, capture, &mut comparing, plan, report);
    let over = comparing.over;
    match ran.map(|_: Finished| ()) {
        Err(error) if !over => Err(error),
        _ => Ok(match comparing.parts {
            Some((frame, time)) => Verdict::Parts {
                frame,
                time,
                same: comparing.same,
            },
            None => Verdict::Same {
                frames: comparing.same,
            },
        }),
    }
}

/// Takes frames and compares them.
struct Comparing {
    hashes: BTreeMap<u64, StateHash>,
    same: u64,
    parts: Option<(u64, f64)>,
    /// Nothing more is to be compared: the run may end.
    over: bool,
}

/// Recorded times are whole nanoseconds.
const SAME_TIME: f64 = 1e-9;

impl Recorder for Comparing {
    fn record(&mut self, frame: &Frame) -> Result<(), RecordError> {
        let recorded = self.hashes.remove(&frame.index);
        // A run that was stopped has its last frame at any time.
        let stopped = |recorded: &StateHash| {
            self.hashes.is_empty() && (recorded.time - frame.time).abs() > SAME_TIME
        };
        match recorded {
            Some(recorded) if recorded.hash == frame.hash => self.same += 1,
            Some(recorded) if !stopped(&recorded) => {
                self.parts = Some((frame.index, frame.time));
                self.hashes.clear();
            }
            _ => {}
        }
        if self.hashes.is_empty() {
            self.over = true;
            return Err(RecordError::Sink {
                message: "all is compared".to_owned(),
            });
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<Recorded, RecordError> {
        Ok(Recorded::default())
    }
}
