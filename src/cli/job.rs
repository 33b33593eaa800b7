//! A simulation that is ready to run, and its way to the end: recorded, reported, summed up.

use super::args::OutputArgs;
use super::output::{check_outputs, recorder};
use super::progress::Display;
use super::{Failure, choose, report};
use crate::frame::{Capture, Header};
use crate::pipeline::{self, Finished, Plan};
use crate::scene::LoadedScene;
use crate::simulation::Simulation;
use crate::study::Picked;
use anyhow::{Context as _, anyhow};
use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A simulation that is ready to run.
pub(super) struct Job {
    pub(super) loaded: LoadedScene,
    pub(super) simulation: Simulation,
    pub(super) capture: Capture,
    pub(super) header: Header,
    /// Said at the start.
    pub(super) notes: Vec<String>,
    pub(super) threads: usize,
    /// What a calibration picked.
    pub(super) picked: Option<Picked>,
    /// Files that no output may replace, besides the scene's.
    pub(super) inputs: Vec<PathBuf>,
}

impl Job {
    /// Runs the simulation to the scene's end, or until it is stopped from outside.
    pub(super) fn perform(self, output: &OutputArgs, stop: &AtomicBool) -> Result<(), Failure> {
        let saved = check_outputs(output, &self.loaded, &self.inputs)?;
        let mut recorder = recorder(output, saved.as_deref(), &self.header)?;
        if !output.quiet {
            self.notes.iter().for_each(|note| eprintln!("{note}"));
        }
        let record = &self.loaded.scene.record;
        let plan = Plan {
            duration: self.loaded.scene.duration,
            fps: record.fps,
            checkpoint: record.checkpoint,
            error: record.error,
            threads: self.threads,
            notes: self.notes,
            stop,
        };
        let mut display = Display::new(plan.duration, output.quiet);
        let finished = pipeline::run(
            self.simulation,
            self.capture,
            recorder.as_mut(),
            &plan,
            &mut |progress| display.show(progress),
        );
        display.finish();
        let finished = finished.map_err(Failure::run)?;
        let name = &self.loaded.scene.name;
        if let Some(path) = saved.filter(|_| !output.quiet) {
            println!("recorded in {}", path.display());
        }
        conclude(output, name, self.threads, self.picked.as_ref(), &finished)
    }
}

/// More than any machine of today has cores.
const MOST_THREADS: usize = 256;

/// Threads of the simulation: as asked, or one a core.
pub(super) fn threads(asked: Option<usize>) -> Result<usize, Failure> {
    match asked {
        Some(0) => Err(Failure::Input(anyhow!(
            "--threads 0: at least one thread is needed"
        ))),
        Some(threads) if threads > MOST_THREADS => Err(Failure::Input(anyhow!(
            "--threads {threads}: at most {MOST_THREADS}; one a core is best"
        ))),
        Some(threads) => Ok(threads),
        None => Ok(std::thread::available_parallelism().map_or(1, std::num::NonZero::get)),
    }
}

/// A flag that Ctrl-C sets; a second Ctrl-C ends the program at once.
pub(super) fn stop_on_interrupt() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .context("Ctrl-C can't be handled")
    .map_err(Failure::Run)?;
    Ok(stop)
}

/// Writes the report, prints the summary, and says how the run went.
fn conclude(
    output: &OutputArgs,
    scene: &str,
    threads: usize,
    picked: Option<&Picked>,
    finished: &Finished,
) -> Result<(), Failure> {
    let mut report = report::report(scene, threads, finished);
    if let (Some(picked), Some(fields)) = (picked, report.as_object_mut()) {
        fields.insert("chosen".to_owned(), choose::report(picked));
    }
    if let Some(path) = &output.report {
        let file = File::create(path).map_err(Failure::run)?;
        serde_json::to_writer_pretty(file, &report).map_err(Failure::run)?;
    }
    if !output.quiet {
        let scheme = finished.simulation.integrator();
        println!("{}", report::summary(&report, scheme));
        if let Some(picked) = picked {
            let ms = report["ms_per_frame"].as_f64().unwrap_or(f64::NAN);
            println!("{}", choose::outcome(picked, ms));
        }
        if finished.recorded.dropped_live_frames > 0 {
            println!(
                "{} live frames dropped; the file has them all",
                finished.recorded.dropped_live_frames
            );
        }
    }
    match &finished.diverged {
        Some(diverged) => Err(Failure::run(diverged.clone())),
        None => Ok(()),
    }
}
