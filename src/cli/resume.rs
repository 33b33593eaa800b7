//! `muslin resume`: going on from a checkpoint of a recording, or branching with a change.

use super::Failure;
use super::args::ResumeArgs;
use super::job::{Job, stop_on_interrupt, threads};
use super::run::{Prepared, prepare_loaded};
use crate::frame::{Capture, Checkpoint, Header};
use crate::replay::{At, Layout, read_checkpoint};
use crate::scene::LoadedScene;
use crate::simulation::Simulation;
use anyhow::anyhow;

/// Keys that change nothing about how a run goes on.
const HARMLESS: [&str; 3] = ["duration", "record", "name"];

pub(super) fn run(args: &ResumeArgs) -> Result<(), Failure> {
    let threads = threads(args.changes.threads)?;
    let stop = stop_on_interrupt()?;
    let at = args.at.map_or(At::Last, At::Time);
    if args.at.is_some_and(|time| !time.is_finite()) {
        return Err(Failure::Input(anyhow!("--at: give a time in seconds")));
    }
    let name = args.recording.display().to_string();
    let layout = Layout::read(&args.recording).map_err(Failure::input)?;
    let checkpoint = read_checkpoint(&args.recording, at).map_err(Failure::input)?;
    let recorded = layout.scene(&name).map_err(Failure::input)?;
    let changes = args.changes.list();
    let loaded = recorded.with(&changes).map_err(Failure::input)?;
    if loaded.scene.duration <= checkpoint.time {
        return Err(Failure::Input(anyhow!(
            "{name} is at {} s already and ends at {} s; go on for longer with --duration, or from earlier with --at",
            checkpoint.time,
            loaded.scene.duration
        )));
    }
    let branches = changes.iter().any(|change| !is_harmless(change));
    let Prepared {
        loaded,
        simulation,
        foresight,
        mut notes,
    } = prepare_loaded(loaded)?;
    let (simulation, capture, mut header) = if branches {
        branch(&loaded, simulation, &checkpoint, &name)?
    } else {
        go_on(
            &loaded,
            simulation,
            (layout.start.as_ref(), &checkpoint),
            &name,
        )?
    };
    header.branch = origin(&name, checkpoint.time, &changes);
    notes.insert(0, header.branch.clone());
    notes.extend(foresight.head(&simulation));
    let job = Job {
        loaded,
        simulation,
        capture,
        header,
        notes,
        threads,
        picked: None,
        inputs: vec![args.recording.clone()],
    };
    job.perform(&args.output, &stop)
}

/// Does a change of the scene leave the run as it is?
fn is_harmless(change: &str) -> bool {
    let key = change.split('=').next().unwrap_or_default().trim();
    HARMLESS.iter().any(|harmless| {
        let rest = key.strip_prefix(harmless);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}

/// Where a recording comes from, in words.
fn origin(recording: &str, time: f64, changes: &[String]) -> String {
    let from = format!("goes on from {recording} at {time} s");
    if changes.is_empty() {
        from
    } else {
        format!("{from}, with {}", changes.join(" "))
    }
}

/// The run as it was at a checkpoint, if it started as the scene says, or as the branch did that it is.
pub(super) fn go_on(
    loaded: &LoadedScene,
    simulation: Simulation,
    (start, checkpoint): (Option<&Checkpoint>, &Checkpoint),
    name: &str,
) -> Result<(Simulation, Capture, Header), Failure> {
    let (mut simulation, mut capture, header) = match start {
        Some(start) => branch(loaded, simulation, start, name)?,
        None => {
            let (capture, header) = Capture::new(loaded, &simulation);
            (simulation, capture, header)
        }
    };
    match capture.go_on(&mut simulation, checkpoint) {
        Ok(()) => Ok((simulation, capture, header)),
        Err(damaged) => Err(Failure::Input(anyhow!(
            "{name}: {damaged}; `muslin resume` with any --set, such as --set solver.dt=0.004, branches from its positions"
        ))),
    }
}

/// A new run that starts with the positions and velocities of a checkpoint.
fn branch(
    loaded: &LoadedScene,
    simulation: Simulation,
    start: &Checkpoint,
    name: &str,
) -> Result<(Simulation, Capture, Header), Failure> {
    let Some(simulation) = simulation.started_at(&start.state()) else {
        return Err(Failure::Input(anyhow!(
            "{name} has other particles than the scene with these changes; change materials, the solver or surroundings, but not the shapes of cloths"
        )));
    };
    let (capture, mut header) = Capture::new(loaded, &simulation);
    header.start = Some(Checkpoint {
        step: 0,
        luggage: Vec::new(),
        ..start.clone()
    });
    Ok((simulation, capture, header))
}
