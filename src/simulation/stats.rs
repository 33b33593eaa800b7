//! Sums and extremes of a run, and where its time went.

use crate::linear::Solve;
use crate::state::Archive;
use std::time::{Duration, Instant};

/// What is known of a run besides its state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stats {
    /// Steps done.
    pub steps: u64,
    /// Largest strain now.
    pub strain: f64,
    /// Largest strain of any step.
    pub strain_ever: f64,
    /// Deepest particle below an obstacle's surface now (m).
    pub depth: f64,
    /// The same over all steps (m).
    pub depth_ever: f64,
    /// Largest kinetic energy of any step (J).
    pub kinetic_peak: f64,
    /// The last linear solve.
    pub solve: Solve,
    /// Iterations of all linear solves.
    pub iterations: u64,
    /// Solves that ended before their tolerance.
    pub unsolved: u64,
    /// Steps that implicit Euler took, since the scheme would have made energy.
    pub damped: u64,
    /// Passes of strain limiting.
    pub limit_passes: u64,
    /// What keeping edges and triangles apart did.
    pub impacts: ImpactStats,
    /// Where the time went, in this process.
    pub times: StageTimes,
    /// Steps that it went into.
    pub timed: u64,
}

impl Stats {
    /// Carries over everything but the times, which are this process's.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        let Self {
            steps,
            strain,
            strain_ever,
            depth,
            depth_ever,
            kinetic_peak,
            solve,
            iterations,
            unsolved,
            damped,
            limit_passes,
            impacts,
            times: _,
            timed: _,
        } = self;
        let ImpactStats {
            impacts,
            zones,
            missed,
        } = impacts;
        for count in [
            steps,
            iterations,
            unsolved,
            damped,
            limit_passes,
            impacts,
            zones,
            missed,
        ] {
            archive.count(count);
        }
        for number in [strain, strain_ever, depth, depth_ever, kinetic_peak] {
            archive.real(number);
        }
        archive.small(&mut solve.iterations);
        archive.real(&mut solve.residual);
        archive.flag(&mut solve.converged);
        archive.flag(&mut solve.damped);
    }
}

/// What keeping edges and triangles apart did since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImpactStats {
    /// Pairs of features that would have met.
    pub impacts: u64,
    /// Groups of particles that were moved as one, since single impulses didn't part them.
    pub zones: u64,
    /// Pairs that met nevertheless.
    pub missed: u64,
}

/// A stage of the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Forces and the scheme's solve.
    Integrate,
    /// Strain limiting.
    LimitStrain,
    /// Finding contacts.
    DetectContacts,
    /// Answering them.
    Respond,
    /// Keeping the ways of whole triangles and edges apart.
    ResolveImpacts,
    /// Strain and dissipated power.
    Measure,
}

impl Stage {
    /// Every stage with its name in reports.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Integrate, "integrate"),
        (Self::LimitStrain, "limit_strain"),
        (Self::DetectContacts, "detect_contacts"),
        (Self::Respond, "respond"),
        (Self::ResolveImpacts, "resolve_impacts"),
        (Self::Measure, "measure"),
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// Wall time of each stage since the start.
#[derive(Clone, Copy, Debug, Default)]
pub struct StageTimes {
    spent: [Duration; Stage::ALL.len()],
}

impl StageTimes {
    /// Runs a piece of a stage and adds its time.
    pub fn time<T>(&mut self, stage: Stage, run: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = run();
        self.spent[stage as usize] += start.elapsed();
        result
    }

    /// Time spent in a stage.
    pub fn of(&self, stage: Stage) -> Duration {
        self.spent[stage as usize]
    }

    /// Time spent in all stages.
    pub fn total(&self) -> Duration {
        self.spent.iter().sum()
    }
}
