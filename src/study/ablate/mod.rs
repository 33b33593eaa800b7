//! What each modelled part of a scene changes, and what it costs: every part is taken out in turn.
//!
//! The change is measured against the full model under the same setting. A part that changes less than
//! halving the step does is lost in the error of the step: the scene can do without it.

mod fingerprint;
mod part;
pub mod table;
pub mod words;

pub use fingerprint::fingerprint;
pub(super) use part::key;
pub use part::{Part, parts};

use super::error::StudyError;
use super::reference::whole;
use super::{Distance, Outcome, Setting, Subject, Trial};
use crate::scene;
use glam::DVec3;

/// Runs of each model; the least time of each counts. Models take turns, so that what else the machine
/// does meets all alike.
pub const ROUNDS: u32 = 3;

/// What each part of a scene is worth.
#[derive(Clone, Debug)]
pub struct Ablation {
    /// What messages call the scene.
    pub scene: String,
    /// Of the scene with all that it names: tells whether a table is of this scene.
    pub fingerprint: u64,
    /// How all runs are computed.
    pub setting: Setting,
    /// How long they are (s).
    pub duration: f64,
    /// Times, evenly spread up to the end, at which they are compared.
    pub times: u32,
    /// Wall time of the full model per simulated second.
    pub seconds_per_second: f64,
    /// The slowest round of the full model over its fastest, less 1: time shares below are noise.
    pub noise: f64,
    /// Up to which change a part can go.
    pub threshold: Threshold,
    /// Each part alone.
    pub parts: Vec<Finding>,
    /// All that can go, at once, if they are several.
    pub together: Option<Finding>,
}

/// The change up to which a part can go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    /// As asked for (m RMS).
    Asked(f64),
    /// What halving the step changes (m RMS).
    TimeStep(f64),
}

impl Threshold {
    /// The length (m RMS).
    pub fn length(self) -> f64 {
        match self {
            Self::Asked(length) | Self::TimeStep(length) => length,
        }
    }
}

/// What a model without a part does.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What was taken out.
    pub part: Part,
    /// Distance from the full model, at the compared time where it is largest.
    pub change: Distance,
    /// The same at the end.
    pub end: Distance,
    /// Wall time per simulated second.
    pub seconds_per_second: f64,
    /// How the run ended; distances are known only of those that were completed.
    pub outcome: Outcome,
}

impl Finding {
    fn new(part: Part, trial: &Trial, full: &Trial) -> Self {
        Self {
            part,
            change: Distance::worst(&trial.states, &full.states),
            end: Distance::worst(last(trial), last(full)),
            seconds_per_second: trial.seconds_per_second,
            outcome: trial.outcome.clone(),
        }
    }

    /// Whether the scene can do without it.
    pub fn can_go(&self, threshold: Threshold) -> bool {
        self.outcome == Outcome::Completed && self.change.rms <= threshold.length()
    }

    /// Share of the full model's wall time (per simulated second) that is saved without it; negative
    /// where the run takes longer; none where it didn't come to its end.
    pub fn time_share(&self, full: f64) -> Option<f64> {
        (self.outcome == Outcome::Completed).then(|| 1.0 - self.seconds_per_second / full)
    }
}

fn last(trial: &Trial) -> &[Vec<DVec3>] {
    &trial.states[trial.states.len().saturating_sub(1)..]
}

/// Takes each part out of the scene in turn and runs what is left, `rounds` times; a part can go where
/// the cloth moves by at most `tolerance` (m RMS), or by what halving the step does.
///
/// Ends early, with the parts so far, when the user stops.
///
/// # Errors
///
/// When the full model doesn't come to its end, or is stopped; when it has no part that could go.
pub fn ablate(
    subject: &Subject<'_>,
    setting: Setting,
    tolerance: Option<f64>,
    rounds: u32,
    say: &mut dyn FnMut(String),
) -> Result<Ablation, StudyError> {
    let setting = Setting {
        dt: subject.fitting(setting.dt),
        ..setting
    };
    let built = scene::build(&subject.loaded)?;
    let all = parts(&subject.loaded.scene, &built.model);
    if all.is_empty() {
        return Err(StudyError::Ask(format!(
            "{} models nothing that could be left out: it has no shear or bend springs, damping, strain limit or obstacles",
            subject.loaded.file
        )));
    }
    say("full model".to_owned());
    let full = whole(subject, setting, None)?;
    let threshold = match tolerance {
        Some(length) => Threshold::Asked(length),
        None => {
            say("full model at half the step".to_owned());
            let halved = Setting {
                dt: 0.5 * setting.dt,
                ..setting
            };
            let finer = whole(subject, halved, None)?;
            Threshold::TimeStep(Distance::worst(&full.states, &finer.states).rms)
        }
    };
    let mut ablation = Ablation {
        scene: subject.loaded.file.clone(),
        fingerprint: fingerprint(&subject.loaded.scene, &built.model, &built.state),
        setting,
        duration: subject.duration,
        times: subject.times,
        seconds_per_second: full.seconds_per_second,
        noise: 0.0,
        threshold,
        parts: Vec::new(),
        together: None,
    };
    let subjects = ablation.take_out(subject, &full, all, say)?;
    ablation.time(subject, &subjects, rounds, say)?;
    Ok(ablation)
}

impl Ablation {
    /// Runs the scene without each part, and without all that can go; returns the scenes.
    fn take_out<'a>(
        &mut self,
        subject: &Subject<'a>,
        full: &Trial,
        all: Vec<Part>,
        say: &mut dyn FnMut(String),
    ) -> Result<Vec<Subject<'a>>, StudyError> {
        let mut subjects = Vec::new();
        for part in all {
            say(format!("without {}", part.name));
            let less = subject.with(&part.changes)?;
            let trial = less.run(self.setting, &mut |_| {})?;
            if trial.outcome == Outcome::Stopped {
                return Ok(subjects);
            }
            self.parts.push(Finding::new(part, &trial, full));
            subjects.push(less);
        }
        let gone: Vec<&Part> = self.unneeded().map(|finding| &finding.part).collect();
        if gone.len() > 1 {
            let part = all_of(subject, &gone)?;
            say(format!("without {}", part.name));
            let less = subject.with(&part.changes)?;
            let trial = less.run(self.setting, &mut |_| {})?;
            if trial.outcome != Outcome::Stopped {
                self.together = Some(Finding::new(part, &trial, full));
                subjects.push(less);
            }
        }
        Ok(subjects)
    }

    /// Repeats the runs for their times.
    fn time(
        &mut self,
        full: &Subject<'_>,
        subjects: &[Subject<'_>],
        rounds: u32,
        say: &mut dyn FnMut(String),
    ) -> Result<(), StudyError> {
        let mut slowest = self.seconds_per_second;
        for round in 1..rounds {
            say(format!("times, round {} of {rounds}", round + 1));
            let trial = full.measure(self.setting)?;
            if trial.outcome != Outcome::Completed {
                break;
            }
            slowest = slowest.max(trial.seconds_per_second);
            self.seconds_per_second = self.seconds_per_second.min(trial.seconds_per_second);
            for (finding, less) in self
                .parts
                .iter_mut()
                .chain(&mut self.together)
                .zip(subjects)
            {
                if finding.outcome != Outcome::Completed {
                    continue;
                }
                let trial = less.measure(self.setting)?;
                if trial.outcome == Outcome::Completed {
                    let least = finding.seconds_per_second.min(trial.seconds_per_second);
                    finding.seconds_per_second = least;
                }
            }
        }
        self.noise = slowest / self.seconds_per_second - 1.0;
        Ok(())
    }

    /// The parts that can go.
    pub fn unneeded(&self) -> impl Iterator<Item = &Finding> {
        self.parts
            .iter()
            .filter(|finding| finding.can_go(self.threshold))
    }
}

/// Several parts as one: each as it is taken out of what the ones before it leave, since two may be
/// springs of one cloth, and an obstacle takes its friction with it.
fn all_of(subject: &Subject<'_>, gone: &[&Part]) -> Result<Part, StudyError> {
    let mut loaded = subject.loaded.clone();
    let mut changes: Vec<String> = Vec::new();
    for part in gone {
        let built = scene::build(&loaded)?;
        let left = parts(&loaded.scene, &built.model);
        let Some(now) = left.into_iter().find(|other| other.name == part.name) else {
            continue;
        };
        loaded = loaded.with(&now.changes)?;
        for change in now.changes {
            // A list of springs that is set again was only on the way.
            let (key, value) = change.split_once('=').unwrap_or((&change, ""));
            changes.retain(|old| {
                value.is_empty() || old.split_once('=').is_none_or(|(known, _)| known != key)
            });
            changes.push(change);
        }
    }
    let names: Vec<&str> = gone.iter().map(|part| part.name.as_str()).collect();
    Ok(Part {
        name: names.join(", "),
        changes,
    })
}
