//! `muslin study`: what accuracy costs in a scene, where it is stable, which parts it needs, and what its
//! contact is worth.

mod ablate;
mod contact;
mod map;
mod mesh;
mod sweep;

use super::args::StudyArgs;
use super::job::{stop_on_interrupt, threads};
use super::{Failure, folder};
use crate::integrator::Integrator;
use crate::scene::{self, LoadedScene};
use crate::simulation::step_length;
use crate::study::{Setting, StudyError, Subject};
use anyhow::anyhow;
use std::io::Write as _;
use std::path::PathBuf;

/// What a study covers of a longer scene (s): swings and contacts, but not yet the folds that a change
/// in the last digit decides.
const LONGEST: f64 = 0.5;

/// The same of contact, which has to rest as well as to begin.
const LONGEST_CONTACT: f64 = 1.0;

/// Times at which states are compared; an ablation looks at the whole scene.
const TIMES: u32 = 6;
const ABLATION_TIMES: u32 = 10;

pub(super) fn run(args: &StudyArgs) -> Result<(), Failure> {
    let loaded = scene::load(&args.scene, &args.set).map_err(Failure::input)?;
    let duration = duration(args, &loaded)?;
    let usual = if args.ablate { ABLATION_TIMES } else { TIMES };
    let times = args.times.unwrap_or(usual);
    let threads = threads(args.threads)?;
    let stop = stop_on_interrupt()?;
    let mut subject = Subject::new(loaded, duration, times, threads, &stop).map_err(failure)?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}-study", subject.loaded.scene.name)));
    let made = folder::make_writable(&out)?;
    let text = if let Some(axis) = args.stability {
        map::run(&subject, args, axis, &out)
    } else if args.ablate {
        ablate::run(&subject, args, &out)
    } else if args.contact {
        contact::run(&subject, &out)
    } else if args.cells.is_empty() {
        sweep::run(&mut subject, args, &out)
    } else {
        mesh::run(&subject, args, &out)
    };
    if text.is_err() && made {
        let _ = std::fs::remove_dir(&out); // only if nothing was put into it
    }
    // Whoever reads no further has seen enough.
    let _ = std::io::stdout().write_all(text?.as_bytes());
    Ok(())
}

/// How much of the scene is studied (s).
fn duration(args: &StudyArgs, loaded: &LoadedScene) -> Result<f64, Failure> {
    let fail = |text: String| Err(Failure::Input(anyhow!("{text}")));
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if args.times == Some(0) {
        return fail("--times 0: states are compared at one time at least".to_owned());
    }
    for (flag, value) in [("--smallest", args.smallest), ("--patience", args.patience)] {
        if !positive(value) {
            return fail(format!("{flag} {value}: a positive number is needed"));
        }
    }
    if let Some(tolerance) = args.tolerance.iter().find(|x| !positive(**x)) {
        return fail(format!(
            "--tolerance {tolerance}: a tolerance is a positive length in metres"
        ));
    }
    let whole = loaded.scene.duration;
    match args.duration {
        Some(seconds) if !positive(seconds) => fail(format!(
            "--duration {seconds}: a positive number of seconds is needed"
        )),
        Some(seconds) => Ok(seconds),
        None if args.ablate => Ok(whole),
        None if args.contact => Ok(whole.min(LONGEST_CONTACT)),
        None => Ok(whole.min(LONGEST)),
    }
}

/// What the scene itself is set to.
fn own_setting(subject: &Subject<'_>) -> Result<Setting, Failure> {
    let solver = &subject.loaded.scene.solver;
    let integrator = Integrator::of(solver);
    let dt = step_length(solver.dt, integrator, &subject.forecast);
    let dt = dt.map_err(|error| Failure::input(subject.loaded.error_at("solver.dt", error)))?;
    Ok(Setting { integrator, dt })
}

/// What was asked for can't be: bad input; a run that failed is a failed run.
pub(super) fn failure(error: StudyError) -> Failure {
    match error {
        StudyError::Scene(_) | StudyError::Ask(_) => Failure::input(error),
        StudyError::NoReference { .. } | StudyError::Stopped | StudyError::Threads(_) => {
            Failure::run(error)
        }
    }
}
