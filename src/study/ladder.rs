//! Which settings a study runs: each scheme from steps that are too long to steps that are dear.

use super::error::StudyError;
use super::{Setting, Subject};
use crate::integrator::Integrator;
use crate::scene::IntegratorName;

/// What is asked for; empty lists stand for the usual ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dials {
    /// Schemes.
    pub schemes: Vec<IntegratorName>,
    /// Steps (s).
    pub steps: Vec<f64>,
    /// Sweeps of xpbd and iterations of projective.
    pub iterations: Vec<u32>,
    /// Tolerances of dopri5 (m).
    pub tolerances: Vec<f64>,
}

/// Steps of explicit schemes as shares of the stable one: beyond it once, to show what happens.
const SHARES: [f64; 4] = [1.8, 0.9, 0.45, 0.225];

/// Longest step of the implicit schemes (s): a frame of 60 a second.
const FRAME: f64 = 1.0 / 60.0;

/// Halvings of a frame down to the shortest step of the implicit schemes.
const HALVINGS: std::ops::Range<i32> = 0..6;

/// The same of XPBD, which does a fraction of the work in a step.
const SWEEP_HALVINGS: std::ops::Range<i32> = 2..9;

/// dopri5's (m).
const TOLERANCES: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];

/// projective's.
const ITERATIONS: [u32; 2] = [10, 100];

/// The settings of a study, scheme by scheme, long steps first.
///
/// # Errors
///
/// When a scheme is stable at no step and none is given, or a dial is out of its range.
pub fn settings(subject: &Subject<'_>, dials: &Dials) -> Result<Vec<Setting>, StudyError> {
    check(subject, dials)?;
    let every = IntegratorName::ALL;
    let schemes = or(&dials.schemes, &every);
    let mut settings: Vec<Setting> = Vec::new();
    for &name in schemes {
        let mut steps = Vec::new();
        for integrator in variants(subject, name, dials) {
            steps.clear();
            steps.extend(match integrator {
                // Its tolerance is its dial.
                Integrator::Dopri5 { .. } if dials.steps.is_empty() => vec![0.25 * FRAME],
                _ if !dials.steps.is_empty() => dials.steps.clone(),
                _ => usual(subject, integrator),
            });
            steps.sort_by(|a, b| b.total_cmp(a));
            for &dt in &steps {
                let setting = Setting {
                    integrator,
                    dt: subject.fitting(dt),
                };
                if !settings.contains(&setting) {
                    settings.push(setting);
                }
            }
        }
    }
    if settings.is_empty() {
        return Err(StudyError::Ask(format!(
            "{} is stable at no step in this scene, which has no damping: choose other --schemes, or give --steps",
            schemes[0].name()
        )));
    }
    Ok(settings)
}

fn or<'a, T>(asked: &'a [T], usual: &'a [T]) -> &'a [T] {
    if asked.is_empty() { usual } else { asked }
}

/// A scheme with every value of its dial besides the step.
fn variants(subject: &Subject<'_>, name: IntegratorName, dials: &Dials) -> Vec<Integrator> {
    let mut solver = subject.loaded.scene.solver.clone();
    solver.integrator = name;
    if name != subject.loaded.scene.solver.integrator {
        solver.iterations = None; // the scene means its own scheme's
    }
    let scheme = Integrator::of(&solver);
    match scheme {
        Integrator::Dopri5 { .. } => {
            let mut tolerances = or(&dials.tolerances, &TOLERANCES).to_vec();
            tolerances.sort_by(|a, b| b.total_cmp(a));
            let of = |tolerance| Integrator::Dopri5 { tolerance };
            tolerances.into_iter().map(of).collect()
        }
        Integrator::Xpbd { .. } => or(&dials.iterations, &[1])
            .iter()
            .map(|&iterations| Integrator::Xpbd { iterations })
            .collect(),
        Integrator::Projective { residual, .. } => or(&dials.iterations, &ITERATIONS)
            .iter()
            .map(|&iterations| Integrator::Projective {
                iterations,
                residual,
            })
            .collect(),
        _ => vec![scheme],
    }
}

/// The usual steps of a scheme (s).
fn usual(subject: &Subject<'_>, scheme: Integrator) -> Vec<f64> {
    let halvings = |range: std::ops::Range<i32>| range.map(|k| FRAME * 0.5_f64.powi(k)).collect();
    if scheme.is_explicit() {
        let stable = subject.forecast.stable_dt(scheme);
        return SHARES
            .iter()
            .map(|share| (share * stable).min(FRAME))
            .filter(|dt| *dt > 0.0)
            .collect();
    }
    match scheme {
        Integrator::Xpbd { .. } => halvings(SWEEP_HALVINGS),
        _ => halvings(HALVINGS),
    }
}

/// Are the dials in their ranges?
fn check(subject: &Subject<'_>, dials: &Dials) -> Result<(), StudyError> {
    let fail = |text: String| Err(StudyError::Ask(text));
    let positive = |x: &&f64| !(x.is_finite() && **x > 0.0);
    if let Some(step) = dials.steps.iter().find(positive) {
        return fail(format!(
            "--steps {step}: a step is a positive number of seconds"
        ));
    }
    if let Some(step) = dials
        .steps
        .iter()
        .find(|step| **step > subject.interval() * 1.000_001)
    {
        return fail(format!(
            "--steps {step}: the study compares states every {} s; use shorter steps, or a longer --duration",
            super::digits(subject.interval())
        ));
    }
    if let Some(tolerance) = dials.tolerances.iter().find(positive) {
        return fail(format!(
            "--tolerance {tolerance}: a tolerance is a positive length in metres"
        ));
    }
    if dials.iterations.contains(&0) {
        return fail("--iterations 0: a step takes at least one".to_owned());
    }
    Ok(())
}
