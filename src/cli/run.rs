//! `muslin run`: a scene from its file to its recording.

use super::args::{RunArgs, SceneArgs};
use super::progress::Display;
use super::{Failure, report};
use crate::frame::{Capture, Header};
use crate::integrator::Integrator;
use crate::pipeline::{self, Finished, Plan};
use crate::recorder::{DiscardRecorder, Recorder};
use crate::scene::{self, IntegratorName, LoadedScene};
use crate::simulation::Simulation;
use anyhow::{Context as _, anyhow};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(super) fn run(args: &RunArgs) -> Result<(), Failure> {
    let (loaded, simulation, mut notes) = prepare(&args.scene)?;
    let threads = threads(&args.scene)?;
    let report_file = args.report.as_deref().map(create).transpose()?;
    notes.extend(too_many_frames(&loaded));
    let (capture, header) = Capture::new(&loaded, &simulation);
    let mut recorder = recorder(args, &header)?;
    if !args.quiet {
        notes.iter().for_each(|note| eprintln!("{note}"));
    }
    let stop = stop_on_interrupt()?;
    let record = &loaded.scene.record;
    let plan = Plan {
        duration: loaded.scene.duration,
        fps: record.fps,
        checkpoint: record.checkpoint,
        threads,
        notes,
        stop: &stop,
    };
    let mut display = Display::new(plan.duration, args.quiet);
    let finished = pipeline::run(
        simulation,
        capture,
        recorder.as_mut(),
        &plan,
        &mut |progress| display.show(progress),
    );
    display.finish();
    let finished = finished.map_err(Failure::run)?;
    conclude(args, &loaded, threads, &finished, report_file)
}

/// Reads a scene and makes a simulation of it; also what was repaired on the way.
pub(super) fn prepare(args: &SceneArgs) -> Result<(LoadedScene, Simulation, Vec<String>), Failure> {
    let loaded = scene::load(&args.scene, &args.changes()).map_err(Failure::input)?;
    let built = scene::build(&loaded).map_err(Failure::input)?;
    let solver = &loaded.scene.solver;
    let integrator = match solver.integrator {
        IntegratorName::SymplecticEuler => Integrator::SymplecticEuler,
        IntegratorName::ImplicitEuler => Integrator::ImplicitEuler {
            linear_tolerance: solver.linear_tolerance,
        },
    };
    let simulation = Simulation::new(built.model, built.state, integrator, solver.dt);
    Ok((loaded, simulation, built.notes))
}

/// Threads of the simulation: as asked, or one a core.
pub(super) fn threads(args: &SceneArgs) -> Result<usize, Failure> {
    match args.threads {
        Some(0) => Err(Failure::Input(anyhow!(
            "--threads 0: at least one thread is needed"
        ))),
        Some(threads) => Ok(threads),
        None => Ok(std::thread::available_parallelism().map_or(1, std::num::NonZero::get)),
    }
}

fn too_many_frames(loaded: &LoadedScene) -> Option<String> {
    let (fps, dt) = (loaded.scene.record.fps, loaded.scene.solver.dt);
    (fps * dt > 1.0 + 1e-9).then(|| {
        format!("record.fps = {fps} asks for more frames than there are steps: each step is recorded, {:.1} a second", 1.0 / dt)
    })
}

#[cfg(feature = "rerun")]
fn recorder(args: &RunArgs, header: &Header) -> Result<Box<dyn Recorder + Send>, Failure> {
    use crate::recorder::{RerunRecorder, Targets};
    let targets = Targets {
        save: save_path(args, header),
        connect: args.connect.clone(),
        serve: args.serve,
        spawn: args.spawn,
    };
    if targets == Targets::default() {
        return Ok(Box::new(DiscardRecorder));
    }
    let recorder = RerunRecorder::new(header, &targets).map_err(Failure::input)?;
    Ok(Box::new(recorder))
}

#[cfg(not(feature = "rerun"))]
fn recorder(args: &RunArgs, header: &Header) -> Result<Box<dyn Recorder + Send>, Failure> {
    let live = args.connect.is_some() || args.serve.is_some() || args.spawn;
    if live || save_path(args, header).is_some() {
        return Err(Failure::Input(anyhow!(
            "this muslin was built without Rerun: use --no-save, or build with default features"
        )));
    }
    Ok(Box::new(DiscardRecorder))
}

fn save_path(args: &RunArgs, header: &Header) -> Option<PathBuf> {
    (!args.no_save).then(|| {
        args.save
            .clone()
            .unwrap_or_else(|| format!("{}.rrd", header.scene).into())
    })
}

fn create(path: &Path) -> Result<File, Failure> {
    let file = File::create(path).with_context(|| {
        format!(
            "{} can't be written; choose another with --report",
            path.display()
        )
    });
    file.map_err(Failure::Input)
}

/// A flag that Ctrl-C sets; a second Ctrl-C ends the program at once.
fn stop_on_interrupt() -> Result<Arc<AtomicBool>, Failure> {
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
    args: &RunArgs,
    loaded: &LoadedScene,
    threads: usize,
    finished: &Finished,
    report_file: Option<File>,
) -> Result<(), Failure> {
    let report = report::report(&loaded.scene.name, threads, finished);
    if let Some(file) = report_file {
        serde_json::to_writer_pretty(file, &report)
            .context("the report can't be written")
            .map_err(Failure::Run)?;
    }
    if !args.quiet {
        println!("{}", report::summary(&report));
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
