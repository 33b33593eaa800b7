//! What is known of a run before its first step, in words.

use crate::integrator::Integrator;
use crate::model::Model;
use crate::scene::{LoadedScene, Step};
use crate::simulation::{Forecast, Part, Simulation, sweep_compliance};
use crate::study::diagonal;
use glam::DVec3;

/// The forecast of a run, and what of the scene it depends on.
pub(super) struct Foresight {
    forecast: Forecast,
    chosen_by: &'static str,
}

impl Foresight {
    pub(super) fn new(loaded: &LoadedScene, forecast: Forecast) -> Self {
        let solver = &loaded.scene.solver;
        Self {
            forecast,
            chosen_by: match solver.dt {
                Step::Auto => " (auto)",
                Step::Seconds(_) => "",
            },
        }
    }

    /// The scheme and its step, and how far that is from trouble: for the head of a run.
    pub(super) fn head(&self, run: &Simulation) -> Vec<String> {
        let (scheme, dt) = (run.integrator(), run.dt());
        vec![
            format!("{} with dt = {dt:.4e} s{}", scheme.name(), self.chosen_by),
            match scheme {
                Integrator::Xpbd { .. } => self.sweeps(run),
                Integrator::Dopri5 { .. } => "its steps are chosen by solver.tolerance".to_owned(),
                Integrator::Projective { .. } => self.stiffness(run),
                _ if scheme.is_explicit() => self.head_room(run),
                _ => format!("{}; {}", self.stiffness(run), self.iterations(dt)),
            },
        ]
    }

    /// Everything: for `check`.
    pub(super) fn list(&self, run: &Simulation) -> Vec<String> {
        let (scheme, dt) = (run.integrator(), run.dt());
        let mut said = self.fastest_modes(run);
        for scheme in Integrator::EXPLICIT {
            let (name, limit) = (scheme.name(), self.forecast.stable_dt(scheme));
            said.push(if limit == 0.0 {
                format!("{name}: stable at no dt, for want of damping")
            } else if limit.is_finite() {
                format!("{name}: stable up to dt = {limit:.3e} s")
            } else {
                format!("{name}: stable at any dt, nothing swings")
            });
        }
        let others = [
            "dopri5: chooses stable steps itself",
            "implicit-euler, newton, bdf2, xpbd, projective: stable at any dt; their errors grow with it",
            "implicit-midpoint: stable at any dt, with steps of implicit Euler where it would make energy; its error grows with it",
        ];
        said.extend(others.map(str::to_owned));
        let by = self.chosen_by;
        said.push(format!("chosen: {} with dt = {dt} s{by}", scheme.name()));
        if scheme.is_explicit() {
            said.push(format!("  {}", self.head_room(run)));
        }
        said.push(format!("  {}", self.stiffness(run)));
        said.push(format!("  {}", self.iterations(dt)));
        said.push(format!("  {}", self.sweeps(run)));
        let properties = scheme.properties().iter().copied();
        let shortcomings = scheme.shortcomings(run.model());
        said.extend(properties.chain(shortcomings).map(|s| format!("  {s}")));
        said.extend(numerical_damping(run));
        said
    }

    /// The remedy, where the step is beyond the limit.
    pub(super) fn remedy(&self, run: &Simulation) -> Option<String> {
        let limit = self.forecast.stable_dt(run.integrator());
        (run.dt() > limit).then(|| {
            let shorter = if limit > 0.0 {
                format!("--dt {:.1e} or less, or ", 0.9 * limit)
            } else {
                String::new()
            };
            format!("WARNING: this diverges; use {shorter}--integrator implicit-euler")
        })
    }

    fn fastest_modes(&self, run: &Simulation) -> Vec<String> {
        let mut said = Vec::new();
        for (mode, cloth) in self.forecast.modes.iter().zip(&run.model().cloths) {
            said.push(format!(
                "{}: fastest mode {:.3e} rad/s, damped by {:.3e} 1/s",
                cloth.name, mode.omega, mode.damping
            ));
            if let Some(element) = &mode.element {
                let part = Part::of(element, run.model(), run.state());
                said.push(format!("  set by {part}, or the damping on it"));
            }
        }
        said
    }

    /// The step against the limit of the run's explicit scheme.
    fn head_room(&self, run: &Simulation) -> String {
        let (dt, limit) = (run.dt(), self.forecast.limit(run.integrator()));
        if limit.dt == 0.0 {
            return "no step is stable, for want of damping".to_owned();
        }
        if limit.dt.is_infinite() {
            return "head-room: nothing swings, any step is stable".to_owned();
        }
        let by = limit.element.map_or_else(String::new, |element| {
            format!(", set by {}", Part::of(&element, run.model(), run.state()))
        });
        format!(
            "head-room: dt is {:.2} of the stable step {:.3e} s{by}",
            dt / limit.dt,
            limit.dt
        )
    }

    fn stiffness(&self, run: &Simulation) -> String {
        let ratio = self.forecast.stiffness_ratio(run.dt());
        let by = self
            .forecast
            .stiffest()
            .map_or_else(String::new, |element| {
                format!(", of {}", Part::of(&element, run.model(), run.state()))
            });
        format!(
            "stiffness ratio dt² k (1/mᵢ + 1/mⱼ): at most {ratio:.3}{by}; explicit schemes bear 4 alone, about 2 in cloth"
        )
    }

    fn iterations(&self, dt: f64) -> String {
        // About the root of the condition number 1 + ratio.
        let root = (1.0 + self.forecast.stiffness_ratio(dt)).sqrt();
        format!(
            "conjugate gradients at this dt: some {:.0} iterations",
            root.ceil()
        )
    }

    /// What the run's sweeps make of the cloth, one where it has none.
    fn sweeps(&self, run: &Simulation) -> String {
        let sweeps = match run.integrator() {
            Integrator::Xpbd { iterations } => iterations,
            _ => 1,
        };
        let times = sweep_compliance(self.forecast.stiffness_ratio(run.dt()), sweeps);
        format!(
            "xpbd with {sweeps} sweep(s) at this dt: its stiffest springs would stretch {times:.3} times as far as the material"
        )
    }
}

/// What the scheme's own damping does to the slowest swing and to ripples.
fn numerical_damping(run: &Simulation) -> Option<String> {
    let length = longest_cloth(run.model(), &run.state().positions);
    let slowest = (run.model().gravity.acceleration.length() / length).sqrt();
    let ratio = run.integrator().numerical_damping(slowest, run.dt())?;
    (slowest.is_finite() && slowest > 0.0).then(|| {
        format!(
            "  its own damping: {:.2} % of critical for a swing over {length:.2} m ({slowest:.1} rad/s), {:.1} % for ripples ten times as fast",
            100.0 * ratio,
            1000.0 * ratio
        )
    })
}

/// Diagonal of the largest cloth's box (m).
fn longest_cloth(model: &Model, positions: &[DVec3]) -> f64 {
    let each = model
        .cloths
        .iter()
        .map(|cloth| diagonal(&positions[cloth.particles.clone()]));
    each.fold(0.0, f64::max)
}
