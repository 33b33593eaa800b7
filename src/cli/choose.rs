//! `muslin run --tolerance` and `--budget`: the setting that a calibration picks, in words, as changes to
//! the scene, and in the report.

use super::Failure;
use super::args::RunArgs;
use super::study::failure;
use crate::integrator::Integrator;
use crate::scene::LoadedScene;
use crate::study::pick::{Goal, Measured, Picked, candidates, pick};
use crate::study::{Setting, Subject, digits};
use anyhow::anyhow;
use serde_json::{Value, json};
use std::sync::atomic::AtomicBool;

/// What is asked for, if anything.
pub(super) fn goal(args: &RunArgs) -> Option<Goal> {
    let tolerance = args.tolerance.map(Goal::Tolerance);
    tolerance.or(args.budget.map(Goal::Budget))
}

/// Picks the setting of a run.
pub(super) fn choose(
    args: &RunArgs,
    goal: Goal,
    loaded: &LoadedScene,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Picked, Failure> {
    let changes = args.scene.changes.list();
    let is_set = |key: &str| changes.iter().any(|change| key_of(change) == key);
    if is_set("solver.dt") {
        return Err(Failure::Input(anyhow!(
            "solver.dt is given, which {} is to find: leave one of them out",
            flag(goal)
        )));
    }
    let solver = &loaded.scene.solver;
    let schemes: Vec<Integrator> = if is_set("solver.integrator") {
        vec![Integrator::of(solver)]
    } else {
        candidates(solver)
    };
    let duration = loaded.scene.duration;
    let mut subject =
        Subject::new(loaded.clone(), duration, 1, threads, stop).map_err(Failure::input)?;
    if schemes
        .iter()
        .all(|&scheme| subject.forecast.stable_dt(scheme) == 0.0)
    {
        return Err(Failure::Input(anyhow!(
            "{}: {} is stable at no step here, for want of damping; choose another --integrator, or none",
            flag(goal),
            schemes[0].name()
        )));
    }
    let mut say = |text: String| {
        if !args.output.quiet {
            eprintln!("calibration: {text}");
        }
    };
    pick(&mut subject, goal, &schemes, &mut say).map_err(|error| {
        if stop.load(std::sync::atomic::Ordering::Relaxed) {
            Failure::run("stopped during the calibration: nothing is recorded")
        } else {
            failure(error)
        }
    })
}

fn key_of(change: &str) -> &str {
    change.split('=').next().unwrap_or_default().trim()
}

fn flag(goal: Goal) -> String {
    match goal {
        Goal::Tolerance(tolerance) => format!("--tolerance {}mm", digits(1000.0 * tolerance)),
        Goal::Budget(budget) => format!("--budget {}ms", digits(1000.0 * budget)),
    }
}

/// What makes a scene run with a setting.
pub(super) fn changes(setting: &Setting) -> Vec<String> {
    let mut changes = vec![
        format!("solver.integrator={:?}", setting.integrator.name()),
        format!("solver.dt={:?}", setting.dt),
    ];
    changes.extend(others(setting));
    changes
}

/// The dials besides scheme and step.
fn others(setting: &Setting) -> Option<String> {
    match setting.integrator {
        Integrator::Dopri5 { tolerance } => Some(format!("solver.tolerance={tolerance:?}")),
        Integrator::Xpbd { iterations } | Integrator::Projective { iterations, .. } => {
            Some(format!("solver.iterations={iterations}"))
        }
        Integrator::Newton(dials)
        | Integrator::ImplicitMidpoint(dials)
        | Integrator::Bdf2(dials) => Some(format!("solver.iterations={}", dials.iterations)),
        _ => None,
    }
}

/// What was chosen, what it is expected to do, what was given up, and how to run it again.
pub(super) fn notes(picked: &Picked, duration: f64) -> Vec<String> {
    let Picked {
        goal,
        chosen,
        window,
        seconds,
        ..
    } = picked;
    let mut said = vec![
        format!(
            "{}: chose {}, {} at {} ms a frame, after {} s of calibration",
            flag(*goal),
            name(chosen),
            error(picked, chosen),
            digits(chosen.ms_per_frame()),
            digits(*seconds),
        ),
        "  errors: the RMS distance over particles to what shorter steps lead to, on this mesh, when it is largest".to_owned(),
    ];
    if *window < duration * (1.0 - 1e-6) {
        said.push(format!(
            "  over the first {} of {} s: what comes later was not measured, and errors mostly grow",
            digits(*window),
            digits(duration)
        ));
    }
    let other = |what: &str, row: &Measured| {
        format!(
            "  {what}: {}, {} at {} ms a frame",
            name(row),
            error(picked, row),
            digits(row.ms_per_frame())
        )
    };
    said.extend(modest(picked));
    said.extend(picked.finer().map(|row| other("more exact, dearer", row)));
    said.extend(
        picked
            .cheaper()
            .map(|row| other("cheaper, less exact", row)),
    );
    let extra = others(&chosen.setting).map_or_else(String::new, |set| format!(" --set {set}"));
    said.push(format!(
        "  the same again: --integrator {} --dt {:?}{extra}",
        chosen.setting.integrator.name(),
        chosen.setting.dt
    ));
    said
}

/// Said where the error is far below what was asked for.
fn modest(picked: &Picked) -> Option<String> {
    match picked.goal {
        Goal::Tolerance(tolerance) if picked.chosen.error < tolerance / 3.0 => {
            Some("  nothing that was tried and uses more of the tolerance is cheaper".to_owned())
        }
        _ => None,
    }
}

fn name(row: &Measured) -> String {
    format!("{} at {}", row.setting.series(), row.setting.dial())
}

/// An error in words; what is below the resolution can't be told.
fn error(picked: &Picked, row: &Measured) -> String {
    if row.error < picked.resolution {
        format!("less than {} mm", digits(1000.0 * picked.resolution))
    } else {
        format!("{} mm", digits(1000.0 * row.error))
    }
}

/// The choice in the report.
pub(super) fn report(picked: &Picked) -> Value {
    let asked = match picked.goal {
        Goal::Tolerance(tolerance) => json!({ "tolerance_m": tolerance }),
        Goal::Budget(budget) => json!({ "budget_ms": 1000.0 * budget }),
    };
    json!({
        "asked": asked,
        "integrator": picked.chosen.setting.integrator.name(),
        "dt": picked.chosen.setting.dt,
        "expected_error_m": picked.chosen.error.max(picked.resolution),
        "expected_ms_per_frame": picked.chosen.ms_per_frame(),
        "window_s": picked.window,
        "calibration_s": picked.seconds,
    })
}

/// What came out, against what was asked.
pub(super) fn outcome(picked: &Picked, ms_per_frame: f64) -> String {
    let expected = picked.chosen.ms_per_frame();
    match picked.goal {
        Goal::Tolerance(_) => format!(
            "{}: {} over its first {} s by the calibration, {} ms a frame (expected {})",
            flag(picked.goal),
            error(picked, &picked.chosen),
            digits(picked.window),
            digits(ms_per_frame),
            digits(expected)
        ),
        Goal::Budget(budget) => format!(
            "{}: {} ms a frame, {:+.0} % of the budget (expected {}); {} over its first {} s by the calibration",
            flag(picked.goal),
            digits(ms_per_frame),
            100.0 * (ms_per_frame / (1000.0 * budget) - 1.0),
            digits(expected),
            error(picked, &picked.chosen),
            digits(picked.window),
        ),
    }
}
