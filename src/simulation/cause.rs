//! What is behind a step that is too long: one element, one particle, or the step itself.

use super::element::{Element, elements};
use super::stability::Limit;
use crate::model::Model;
use crate::state::State;
use std::fmt;

/// Why a step was too long.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// One element is much stiffer than its fellows.
    StiffElement {
        /// Its stiffness over the median of its family or law in its cloth.
        times: f64,
    },
    /// One particle is much lighter than its fellows.
    LightParticle {
        /// The particle's number in its cloth.
        particle: usize,
        /// Its mass over the median of its cloth.
        share: f64,
    },
    /// All are alike: the step is too long for the cloth.
    LongStep {
        /// The step over the limit.
        times: f64,
    },
    /// No spring or hinge, but drag on all motion.
    Drag {
        /// The step over the limit.
        times: f64,
    },
    /// The scheme is stable at no step for want of damping.
    NoDamping,
    /// The step is within the limit, or none binds the scheme.
    Unknown,
}

/// An element stiffer than this many times the median is to blame itself. Stiffness that the mesh
/// gives to springs of one material differs less: by 4 between the edge and the inside of a sheet.
const STIFF: f64 = 10.0;

/// A particle below this share of the median mass is to blame itself: a sheet's corner has a quarter or
/// less, by its triangles.
const LIGHT: f64 = 0.1;

impl Cause {
    /// Looks for what sets a limit that the step `dt` (s) exceeds.
    pub(super) fn find(model: &Model, state: &State, limit: Limit, dt: f64) -> Self {
        if limit.dt == 0.0 {
            return Self::NoDamping;
        }
        let times = dt / limit.dt;
        let Some(element) = limit.element else {
            return Self::Drag { times };
        };
        let cloths = model.cloths.iter();
        let home = |&i: &u32| {
            let mut cloths = cloths.clone();
            cloths.find(|cloth| cloth.particles.contains(&(i as usize)))
        };
        let Some(cloth) = element.particles().iter().find_map(home) else {
            return Self::LongStep { times };
        };
        let inside = |i: &u32| cloth.particles.contains(&(*i as usize));
        let fellows = elements(model, &model.inverse_masses, &state.positions)
            .filter(|other| other.law == element.law && other.particles().iter().any(inside));
        let stiffer = element.stiffness / median(fellows.map(|other| other.stiffness).collect());
        if stiffer > STIFF {
            return Self::StiffElement { times: stiffer };
        }
        let usual = median(model.masses[cloth.particles.clone()].to_vec());
        let free = element.particles().iter().filter(|&i| inside(i));
        let free = free.map(|&i| i as usize).filter(|&i| !model.is_pinned(i));
        let lightest = free.min_by(|&a, &b| model.masses[a].total_cmp(&model.masses[b]));
        match lightest.map(|i| (i, model.masses[i] / usual)) {
            Some((particle, share)) if share < LIGHT => Self::LightParticle {
                particle: particle - cloth.particles.start,
                share,
            },
            _ => Self::LongStep { times },
        }
    }

    /// Its name in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::StiffElement { .. } => "stiffness",
            Self::LightParticle { .. } => "mass",
            Self::LongStep { .. } => "step",
            Self::Drag { .. } => "drag",
            Self::NoDamping => "no_damping",
            Self::Unknown => "unknown",
        }
    }

    /// What it is, for people.
    pub fn words(&self) -> Option<String> {
        match self {
            Self::StiffElement { times } => Some(format!(
                "that one's stiffness is {times:.3} times the median of its kind"
            )),
            Self::LightParticle { particle, share } => Some(format!(
                "its particle {particle} has {share:.1e} times the median mass"
            )),
            Self::LongStep { times } => Some(format!("the step is {times:.2} times too long")),
            Self::Drag { times } => Some(format!(
                "drag on all motion sets it, and the step is {times:.2} times too long"
            )),
            Self::NoDamping | Self::Unknown => None,
        }
    }

    /// How the material would have to change for the step to be stable.
    pub(super) fn material_remedy(&self) -> String {
        match self {
            Self::StiffElement { .. } => ", or lower its stiffness".to_owned(),
            Self::LightParticle { .. } => ", or give that particle more mass".to_owned(),
            Self::LongStep { times } => {
                // ω² is k/m.
                let softer = times * times / (0.9 * 0.9);
                format!(", or {softer:.1} times less stiffness by mass")
            }
            Self::Drag { times } => format!(", or {times:.2} times less damping.mass"),
            Self::NoDamping | Self::Unknown => String::new(),
        }
    }
}

/// An element by its place in its cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Spring family or bending law.
    pub law: &'static str,
    /// Name of the cloth.
    pub cloth: String,
    /// Its particles' numbers in the cloth.
    pub particles: Vec<usize>,
    /// Strain, of a spring.
    pub strain: Option<f64>,
}

impl Part {
    /// An element at a state.
    pub fn of(element: &Element, model: &Model, state: &State) -> Self {
        let particles = element.particles();
        let place = |&i: &u32| model.place(i as usize);
        let strain = match particles {
            [i, j] => model.springs.iter().find_map(|batch| {
                let mut springs = batch.springs.iter();
                let spring = springs.find(|s| batch.family == element.law && s.ends == [*i, *j]);
                spring.map(|spring| spring.strain(&state.positions))
            }),
            _ => None,
        };
        Self {
            law: element.law,
            cloth: particles.first().map_or("", |i| place(i).0).to_owned(),
            particles: particles.iter().map(|i| place(i).1).collect(),
            strain,
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self.particles.iter().map(ToString::to_string).collect();
        let (last, first) = numbers.split_last().map_or(("", &[][..]), |(l, f)| (l, f));
        let kind = if first.len() == 1 { "spring" } else { "hinge" };
        write!(
            f,
            "the {} {kind} between particles {} and {last} of \"{}\"",
            self.law,
            first.join(", "),
            self.cloth
        )
    }
}

/// The middle one of some numbers, the lower of two; 1 of none.
fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers
        .get(numbers.len().saturating_sub(1) / 2)
        .copied()
        .unwrap_or(1.0)
}
