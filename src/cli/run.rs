//! `muslin run`: a scene from its file to its recording.

use super::args::{RunArgs, SceneArgs};
use super::foresight::Foresight;
use super::progress::Display;
use super::{Failure, choose, report};
use crate::frame::{Capture, Header};
use crate::integrator::Integrator;
use crate::pipeline::{self, Finished, Plan};
use crate::recorder::{DiscardRecorder, Recorder};
use crate::scene::{self, LoadedScene};
use crate::simulation::{Simulation, forecast, step_length};
use crate::study::Picked;
use anyhow::{Context as _, anyhow};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(super) fn run(args: &RunArgs) -> Result<(), Failure> {
    let threads = threads(args.scene.threads)?;
    let stop = stop_on_interrupt()?;
    let picked = picked(args, threads, &stop)?;
    let setting = picked.as_ref().map(|picked| &picked.chosen.setting);
    let Prepared {
        loaded,
        simulation,
        foresight,
        mut notes,
    } = prepare(&args.scene, &setting.map_or_else(Vec::new, choose::changes))?;
    check_outputs(args, &loaded)?;
    if let Some(picked) = &picked {
        notes.extend(choose::notes(picked, loaded.scene.duration));
    }
    notes.extend(too_many_frames(&loaded, simulation.dt()));
    notes.extend(foresight.head(&simulation));
    let (capture, header) = Capture::new(&loaded, &simulation);
    let mut recorder = recorder(args, &header)?;
    if !args.quiet {
        notes.iter().for_each(|note| eprintln!("{note}"));
    }
    let record = &loaded.scene.record;
    let plan = Plan {
        duration: loaded.scene.duration,
        fps: record.fps,
        checkpoint: record.checkpoint,
        error: record.error,
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
    conclude(args, &loaded, threads, picked.as_ref(), &finished)
}

/// The setting that a tolerance or a budget asks for, by a calibration.
fn picked(args: &RunArgs, threads: usize, stop: &AtomicBool) -> Result<Option<Picked>, Failure> {
    let Some(goal) = choose::goal(args) else {
        return Ok(None);
    };
    let loaded = scene::load(&args.scene.scene, &args.scene.changes()).map_err(Failure::input)?;
    check_outputs(args, &loaded)?;
    choose::choose(args, goal, &loaded, threads, stop).map(Some)
}

/// A scene that is ready to run.
pub(super) struct Prepared {
    pub(super) loaded: LoadedScene,
    pub(super) simulation: Simulation,
    pub(super) foresight: Foresight,
    /// What was repaired on the way, and what starts inside something.
    pub(super) notes: Vec<String>,
}

/// Reads a scene with its changes and `more`, forecasts how it can be run, and makes a simulation of it.
pub(super) fn prepare(args: &SceneArgs, more: &[String]) -> Result<Prepared, Failure> {
    let changes = [args.changes(), more.to_vec()].concat();
    let loaded = scene::load(&args.scene, &changes).map_err(Failure::input)?;
    let built = scene::build(&loaded).map_err(Failure::input)?;
    let solver = &loaded.scene.solver;
    let integrator = Integrator::of(solver);
    let forecast = forecast(&built.model, &built.state);
    let dt = step_length(solver.dt, integrator, &forecast)
        .map_err(|error| Failure::input(loaded.error_at("solver.dt", error)))?;
    let simulation = Simulation::new(built.model, built.state, integrator, dt);
    let mut notes = built.notes;
    notes.extend_from_slice(&simulation.tangled().said);
    Ok(Prepared {
        simulation,
        foresight: Foresight::new(&loaded, forecast),
        loaded,
        notes,
    })
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

fn too_many_frames(loaded: &LoadedScene, dt: f64) -> Option<String> {
    let fps = loaded.scene.record.fps;
    (fps * dt > 1.0 + 1e-9).then(|| {
        format!("record.fps = {fps} asks for more frames than there are steps: each step is recorded, {:.1} a second", 1.0 / dt)
    })
}

#[cfg(feature = "rerun")]
fn recorder(args: &RunArgs, header: &Header) -> Result<Box<dyn Recorder + Send>, Failure> {
    use crate::recorder::{RerunRecorder, Targets};
    let targets = Targets {
        save: save_path(args, &header.scene),
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
    if live || save_path(args, &header.scene).is_some() {
        return Err(Failure::Input(anyhow!(
            "this muslin was built without Rerun: use --no-save, or build with default features"
        )));
    }
    Ok(Box::new(DiscardRecorder))
}

/// The recording to write, if any.
fn save_path(args: &RunArgs, scene: &str) -> Option<PathBuf> {
    (!args.no_save).then(|| {
        args.save
            .clone()
            .unwrap_or_else(|| format!("{scene}.rrd").into())
    })
}

/// Refuses outputs that can't be written or would destroy an input or each other, before anything
/// is touched.
fn check_outputs(args: &RunArgs, loaded: &LoadedScene) -> Result<(), Failure> {
    let save = save_path(args, &loaded.scene.name);
    let report = args.report.as_deref();
    let mut used: Vec<&Path> = loaded.path.as_deref().into_iter().collect();
    for (flag, path) in [("--save", save.as_deref()), ("--report", report)] {
        let Some(path) = path else { continue };
        if used.iter().any(|other| same_file(path, other)) {
            return Err(Failure::Input(anyhow!(
                "{flag} {}: that file is used already; choose another",
                path.display()
            )));
        }
        used.push(path);
    }
    report.map_or(Ok(()), check_writable)
}

/// Whether two paths lead to one file, now or when both are written.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path));
    matches!((real(a), real(b)), (Ok(a), Ok(b)) if a == b)
}

/// Can a file be written? Leaves what is in it, and nothing where nothing was.
fn check_writable(path: &Path) -> Result<(), Failure> {
    let existed = path.exists();
    let opened = std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(path);
    let opened = opened.with_context(|| {
        format!(
            "{} can't be written; choose another with --report",
            path.display()
        )
    });
    opened.map_err(Failure::Input)?;
    if !existed {
        std::fs::remove_file(path).map_err(Failure::run)?;
    }
    Ok(())
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
    args: &RunArgs,
    loaded: &LoadedScene,
    threads: usize,
    picked: Option<&Picked>,
    finished: &Finished,
) -> Result<(), Failure> {
    let mut report = report::report(&loaded.scene.name, threads, finished);
    if let (Some(picked), Some(fields)) = (picked, report.as_object_mut()) {
        fields.insert("chosen".to_owned(), choose::report(picked));
    }
    if let Some(path) = &args.report {
        let file = File::create(path).map_err(Failure::run)?;
        serde_json::to_writer_pretty(file, &report).map_err(Failure::run)?;
    }
    if !args.quiet {
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
