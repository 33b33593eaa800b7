//! What is turned of a scheme, how far it goes, and what it does until that is measured.

use crate::integrator::Integrator;
use crate::study::{Setting, Subject};

/// Share of its stable step at which an explicit scheme runs; see
/// [`AUTO_SHARE`](crate::simulation::AUTO_SHARE).
const SHARE: f64 = crate::simulation::AUTO_SHARE;

/// The longest step (s): a frame.
const FRAME: f64 = 1.0 / 60.0;

/// What is turned: the step, or dopri5's tolerance.
pub(super) fn dial_of(setting: Setting) -> f64 {
    setting.tolerance().unwrap_or(setting.dt)
}

/// A scheme with its dial at a value.
pub(super) fn setting(subject: &Subject<'_>, scheme: Integrator, dial: f64) -> Setting {
    match scheme {
        Integrator::Dopri5 { .. } => Setting {
            integrator: Integrator::Dopri5 { tolerance: dial },
            dt: subject.fitting(0.25 * FRAME),
        },
        _ => Setting {
            integrator: scheme,
            dt: subject.fitting(dial),
        },
    }
}

/// The largest sensible value of a scheme's dial; 0 where there is none.
pub(super) fn longest(subject: &Subject<'_>, scheme: Integrator) -> f64 {
    match scheme {
        Integrator::Dopri5 { .. } => 0.01,
        _ => (SHARE * subject.forecast.stable_dt(scheme)).min(FRAME),
    }
}

/// Where the search of a scheme begins.
pub(super) fn start(subject: &Subject<'_>, scheme: Integrator) -> f64 {
    match scheme {
        Integrator::Dopri5 { .. } => 1e-4,
        _ => longest(subject, scheme).min(scheme.usual_step()),
    }
}

/// The order in which errors fall with the dial, until two are known.
pub(super) fn usual_order(scheme: Integrator) -> f64 {
    match scheme {
        Integrator::Verlet
        | Integrator::Rk4
        | Integrator::ImplicitMidpoint(_)
        | Integrator::Bdf2(_) => 2.0,
        _ => 1.0,
    }
}

/// The order in which costs rise with a shorter step, until two are known: long steps take more
/// iterations each.
pub(super) fn usual_price(scheme: Integrator) -> f64 {
    match scheme {
        Integrator::Dopri5 { .. } => 0.2,
        Integrator::Xpbd { .. } => 1.0,
        _ if scheme.is_explicit() => 1.0,
        _ => 0.7,
    }
}
