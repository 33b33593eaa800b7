//! `muslin run`: a scene from its file to its recording.

use super::args::{RunArgs, SceneArgs};
use super::foresight::Foresight;
use super::job::{Job, stop_on_interrupt, threads};
use super::output::check_outputs;
use super::{Failure, choose};
use crate::frame::Capture;
use crate::integrator::Integrator;
use crate::scene::{self, LoadedScene};
use crate::simulation::{Simulation, forecast, step_length};
use crate::study::Picked;
use std::sync::atomic::AtomicBool;

pub(super) fn run(args: &RunArgs) -> Result<(), Failure> {
    let threads = threads(args.scene.changes.threads)?;
    let stop = stop_on_interrupt()?;
    let picked = picked(args, threads, &stop)?;
    let setting = picked.as_ref().map(|picked| &picked.chosen.setting);
    let more = setting.map_or_else(Vec::new, choose::changes);
    let Prepared {
        loaded,
        simulation,
        foresight,
        mut notes,
    } = prepare(&args.scene, &more)?;
    if let Some(picked) = &picked {
        notes.extend(choose::notes(picked, loaded.scene.duration));
    }
    notes.extend(too_many_frames(&loaded, simulation.dt()));
    notes.extend(foresight.head(&simulation));
    let (capture, header) = Capture::new(&loaded, &simulation);
    let job = Job {
        loaded,
        simulation,
        capture,
        header,
        notes,
        threads,
        picked,
        inputs: Vec::new(),
    };
    job.perform(&args.output, &stop)
}

/// The setting that a tolerance or a budget asks for, by a calibration.
fn picked(args: &RunArgs, threads: usize, stop: &AtomicBool) -> Result<Option<Picked>, Failure> {
    let Some(goal) = choose::goal(args) else {
        return Ok(None);
    };
    let changes = args.scene.changes.list();
    let loaded = scene::load(&args.scene.scene, &changes).map_err(Failure::input)?;
    check_outputs(&args.output, &loaded, &[])?;
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
    let changes = [args.changes.list(), more.to_vec()].concat();
    let loaded = scene::load(&args.scene, &changes).map_err(Failure::input)?;
    prepare_loaded(loaded)
}

/// Forecasts how a scene can be run, and makes a simulation of it.
pub(super) fn prepare_loaded(loaded: LoadedScene) -> Result<Prepared, Failure> {
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

fn too_many_frames(loaded: &LoadedScene, dt: f64) -> Option<String> {
    let fps = loaded.scene.record.fps;
    (fps * dt > 1.0 + 1e-9).then(|| {
        format!("record.fps = {fps} asks for more frames than there are steps: each step is recorded, {:.1} a second", 1.0 / dt)
    })
}
