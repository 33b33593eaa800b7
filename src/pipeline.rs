//! Two named threads and the bounded channel between them.
//!
//! The simulation thread steps and builds owned frames; the logging thread records them. When the
//! recorder is slower, the channel fills and the simulation waits: recording can slow a run down,
//! but never change it. When the recorder fails, the run ends with its error.

use crate::frame::{Audited, Capture, Event, Frame, Level};
use crate::recorder::{RecordError, Recorded, Recorder};
use crate::simulation::{Diverged, ErrorEstimate, Simulation};
use crossbeam_channel::{Sender, bounded};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Frames that may wait for the recorder: enough to ride out a slow write, at 120 kB each for a
/// 60 × 60 sheet.
const WAITING_FRAMES: usize = 8;

/// What a run is to do.
#[derive(Debug)]
pub struct Plan<'a> {
    /// Simulated time (s).
    pub duration: f64,
    /// Frames in a simulated second.
    pub fps: f64,
    /// Simulated time between checkpoints (s).
    pub checkpoint: f64,
    /// Share of the time that goes into estimating the error of the time step; 0 for no estimate.
    pub error: f64,
    /// Threads of the simulation.
    pub threads: usize,
    /// Said in the first frame.
    pub notes: Vec<String>,
    /// Set from outside to end the run after the current step.
    pub stop: &'a AtomicBool,
}

/// How a run went.
#[derive(Debug)]
pub struct Finished {
    /// The simulation in its last good state.
    pub simulation: Simulation,
    /// What was recorded.
    pub recorded: Recorded,
    /// Why it ended early, if it diverged.
    pub diverged: Option<Diverged>,
    /// The error of its time step, if it was estimated.
    pub error: Option<ErrorEstimate>,
    /// What the audit of contact found, if there is contact.
    pub audited: Option<Audited>,
    /// Whether it was stopped from outside.
    pub stopped: bool,
    /// Time of the first frame (s): not 0 when it went on from a checkpoint.
    pub began: f64,
    /// Wall time spent in steps.
    pub stepping: Duration,
    /// Wall time of the whole run.
    pub wall: Duration,
}

/// Why a run failed besides diverging.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// The recorder failed.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A thread can't be started.
    #[error("cannot start a thread: {0}; close other programs or use --threads 1")]
    Thread(String),
}

/// Where a run stands.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time (s).
    pub time: f64,
    /// Wall milliseconds in steps per simulated 1/60 s.
    pub ms_per_frame: f64,
    /// Largest strain so far.
    pub strain_ever: f64,
    /// Deepest penetration so far (m).
    pub depth_ever: f64,
    /// Frames that a live viewer missed so far.
    pub dropped_live_frames: u64,
}

/// Runs a simulation to its end and records it. `report` is called after each captured frame.
///
/// # Errors
///
/// When the recorder fails or a thread can't be started.
///
/// # Panics
///
/// Passes on a panic of one of the threads, which is a bug.
pub fn run(
    simulation: Simulation,
    capture: Capture,
    recorder: &mut (dyn Recorder + Send),
    plan: &Plan<'_>,
    report: &mut (dyn FnMut(Progress) + Send),
) -> Result<Finished, PipelineError> {
    let start = Instant::now();
    let began = simulation.state().time;
    let (sender, receiver) = bounded(WAITING_FRAMES);
    let dropped = AtomicU64::new(0);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(plan.threads)
        .thread_name(|i| format!("simulate-{i}"))
        .build()
        .map_err(|error| PipelineError::Thread(error.to_string()))?;
    let thread_error = |error: std::io::Error| PipelineError::Thread(error.to_string());
    let (stepped, recorded) = thread::scope(|scope| {
        let recording = thread::Builder::new()
            .name("record".to_owned())
            .spawn_scoped(scope, || record(receiver.into_iter(), recorder, &dropped))
            .map_err(thread_error)?;
        let run = Run {
            error: ErrorEstimate::new(&simulation, plan.error, capture.known_error()),
            simulation,
            capture,
            sender,
            plan,
            dropped: &dropped,
            stepping: Duration::ZERO,
            began,
        };
        let stepping = thread::Builder::new()
            .name("simulate".to_owned())
            .spawn_scoped(scope, move || pool.install(|| run.simulate(report)))
            .map_err(thread_error)?;
        let stepped = stepping.join().unwrap_or_else(|panic| resume_unwind(panic));
        let recorded = recording
            .join()
            .unwrap_or_else(|panic| resume_unwind(panic));
        Ok::<_, PipelineError>((stepped, recorded))
    })?;
    let Stepped {
        simulation,
        error,
        audited,
        diverged,
        stepping,
    } = stepped;
    let stopped = plan.stop.load(Ordering::Relaxed);
    Ok(Finished {
        simulation,
        recorded: recorded?,
        diverged,
        error,
        audited,
        stopped,
        began,
        stepping,
        wall: start.elapsed(),
    })
}

/// The logging thread: records until the simulation is done, and completes the recording.
fn record(
    frames: crossbeam_channel::IntoIter<Frame>,
    recorder: &mut (dyn Recorder + Send),
    dropped: &AtomicU64,
) -> Result<Recorded, RecordError> {
    for frame in frames {
        if let Err(error) = recorder.record(&frame) {
            // The receiver goes: the simulation's next frame can't be sent, and the run ends.
            return recorder.finish().and(Err(error));
        }
        dropped.store(recorder.dropped_live_frames(), Ordering::Relaxed);
    }
    recorder.finish()
}

/// The simulation thread's side.
struct Run<'a> {
    simulation: Simulation,
    error: Option<ErrorEstimate>,
    capture: Capture,
    sender: Sender<Frame>,
    plan: &'a Plan<'a>,
    dropped: &'a AtomicU64,
    stepping: Duration,
    /// Time of the first frame (s).
    began: f64,
}

/// What the simulation thread leaves.
struct Stepped {
    simulation: Simulation,
    error: Option<ErrorEstimate>,
    audited: Option<Audited>,
    diverged: Option<Diverged>,
    stepping: Duration,
}

impl Run<'_> {
    /// Steps until the end, a divergence, a stop from outside, or a recorder that is gone.
    fn simulate(mut self, report: &mut dyn FnMut(Progress)) -> Stepped {
        let mut diverged = None;
        let mut schedule = Schedule::new(self.plan, &self.simulation);
        let notes = self
            .plan
            .notes
            .iter()
            .map(|note| event(Level::Info, note.clone()))
            .collect();
        let mut tangled = self.simulation.tangled().now;
        let mut going = self.send(notes, true, report);
        while going && !schedule.is_over(&self.simulation) {
            let start = Instant::now();
            let step = self.simulation.step();
            self.stepping += start.elapsed();
            if let Err(failure) = step {
                let why = event(Level::Error, failure.to_string());
                self.send(vec![why], true, report);
                diverged = Some(failure);
                break;
            }
            if let Some(error) = &mut self.error {
                error.after_step(&self.simulation);
            }
            let stop = self.plan.stop.load(Ordering::Relaxed);
            let last = stop || schedule.is_over(&self.simulation);
            if let Some(with_checkpoint) = schedule.due(self.simulation.state().time, last) {
                let mut said: Vec<Event> = untangled(&self.simulation, &mut tangled)
                    .into_iter()
                    .collect();
                if stop {
                    said.push(event(Level::Warning, "stopped by the user".to_owned()));
                }
                going = self.send(said, with_checkpoint, report);
            }
            going &= !stop;
        }
        Stepped {
            simulation: self.simulation,
            error: self.error,
            audited: self.capture.audited(),
            diverged,
            stepping: self.stepping,
        }
    }

    /// Sends a frame of the current state; `false` when the recorder is gone.
    fn send(
        &mut self,
        events: Vec<Event>,
        with_checkpoint: bool,
        report: &mut dyn FnMut(Progress),
    ) -> bool {
        let time = self.simulation.state().time;
        if let Some(error) = self.error.as_ref().and_then(|error| error.at(time)) {
            self.capture.note_error(error);
        }
        let frame = if with_checkpoint {
            self.capture.checkpoint_frame(&mut self.simulation, events)
        } else {
            self.capture.frame(&self.simulation, events, false)
        };
        let stats = self.simulation.stats();
        report(Progress {
            time,
            ms_per_frame: ms_per_frame(self.stepping, time - self.began),
            strain_ever: stats.strain_ever,
            depth_ever: stats.depth_ever,
            dropped_live_frames: self.dropped.load(Ordering::Relaxed),
        });
        self.sender.send(frame).is_ok()
    }
}

/// Which steps are recorded.
///
/// Steps are never bent to frame times, which would make the recording a solver knob: frame k is the
/// first state at or after k / fps.
#[derive(Debug)]
struct Schedule {
    steps: f64,
    fps: f64,
    checkpoint: f64,
    next_frame: f64,
    next_checkpoint: f64,
}

/// A step that ends this share of a frame before its time still belongs to it: n dt and k / fps
/// round differently.
const GRACE: f64 = 1e-6;

impl Schedule {
    fn new(plan: &Plan<'_>, simulation: &Simulation) -> Self {
        let steps = (plan.duration - simulation.start()) / simulation.dt();
        let steps = (steps - GRACE).ceil().max(1.0);
        let began = simulation.state().time;
        Self {
            steps,
            fps: plan.fps,
            checkpoint: plan.checkpoint,
            next_frame: (began * plan.fps + GRACE).floor() + 1.0,
            next_checkpoint: (began / plan.checkpoint + GRACE).floor() + 1.0,
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "steps stay far below 2⁵³")]
    fn is_over(&self, simulation: &Simulation) -> bool {
        simulation.stats().steps as f64 >= self.steps
    }

    /// Whether a state is recorded, and if so, whether with a checkpoint.
    fn due(&mut self, time: f64, last: bool) -> Option<bool> {
        let frame = time * self.fps + GRACE;
        if frame < self.next_frame && !last {
            return None;
        }
        self.next_frame = frame.floor() + 1.0;
        let checkpoint = time / self.checkpoint + GRACE;
        let with_checkpoint = last || checkpoint >= self.next_checkpoint;
        if with_checkpoint {
            self.next_checkpoint = checkpoint.floor() + 1.0;
        }
        Some(with_checkpoint)
    }
}

/// What there is to say once nothing is inside or across anything any more; `tangled` particles were when it was
/// asked last.
fn untangled(simulation: &Simulation, tangled: &mut usize) -> Option<Event> {
    let now = simulation.tangled();
    let before = std::mem::replace(tangled, now.now);
    let took = now.took.filter(|_| before > 0)?;
    let text = format!(
        "the {} particles that started tangled are free after {took:.3} s",
        now.at_start
    );
    Some(event(Level::Info, text))
}

fn event(level: Level, text: String) -> Event {
    Event { level, text }
}

/// Wall milliseconds per simulated 1/60 s.
pub fn ms_per_frame(stepping: Duration, simulated: f64) -> f64 {
    if simulated > 0.0 {
        stepping.as_secs_f64() * 1000.0 / (simulated * 60.0)
    } else {
        0.0
    }
}
