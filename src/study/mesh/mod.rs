//! The error of the mesh, apart from that of the step.
//!
//! At each resolution the scene runs with steps so short that their error is far below what the mesh
//! makes. Cloth is compared where it is the same piece of cloth: at the particles of the coarsest mesh.

mod material;
mod refine;
pub mod table;

use super::error::StudyError;
use super::reference::{Reference, reference};
use super::{Distance, Outcome, Setting, Subject, diagonal};
use crate::lab::limit::LEAST_ORDER;
use crate::model::Model;
use crate::scene::{self, Shape};
use glam::DVec3;
pub(super) use material::{Stencil, stencils};
use std::time::Instant;

/// What is left of the step's error is at most this share of the smallest difference of two meshes, as
/// far as the time for it lasts.
pub const STEP_SHARE: f64 = 0.1;

/// Differences below this share of the cloth's size are none (rounding, what still moves).
const NOTHING: f64 = 1e-6;

/// The scene at one resolution.
#[derive(Clone, Debug)]
pub struct Resolution {
    /// Cells along the longest row of the first cloth that is made of cells.
    pub cells: u32,
    /// Particles of all cloths.
    pub particles: usize,
    /// Wall time per simulated second, and error of the step on this mesh (m), of the scene's own
    /// setting; none where that fails.
    pub own: Option<(f64, Distance)>,
    /// How the converged run was computed.
    pub converged: Setting,
    /// What is left of the error of its step (m).
    pub step_left: Distance,
    /// How far the next finer mesh is (m); none of the finest.
    pub to_next: Option<Distance>,
    /// How far the limit is (m), where the meshes have one.
    pub to_limit: Option<Distance>,
    /// Observed order between the difference to the mesh before and that to the next.
    pub order: Option<f64>,
    states: Vec<Vec<DVec3>>,
}

/// What the meshes say together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// They tend to a limit with this order.
    Converges(f64),
    /// Two meshes have a difference, and no limit.
    TooFew,
    /// Their last difference is nothing that could be told from the step or from rounding (m RMS).
    Below(f64),
    /// Their differences don't shrink.
    NoLimit,
}

/// A scene on ever finer meshes.
#[derive(Clone, Debug)]
pub struct MeshStudy {
    /// What messages call the scene.
    pub scene: String,
    /// The scene's own setting.
    pub setting: Setting,
    /// How long the runs are (s).
    pub duration: f64,
    /// Times, evenly spread up to the end, at which they are compared.
    pub times: u32,
    /// The meshes, the coarsest first.
    pub resolutions: Vec<Resolution>,
    /// Cloths that are meshes from files, whose resolution is what it is; they don't count.
    pub fixed: Vec<String>,
    /// What the meshes say.
    pub verdict: Verdict,
    /// The limit at the compared times: the particles of the coarsest mesh (m); empty without one.
    pub limit: Vec<Vec<DVec3>>,
}

/// Runs a scene with each of `cells` along the longest row of its first cloth, with converged steps, and
/// under its own `setting`; about `budget` (s) of wall time for making the steps' error small.
///
/// Ends early, with the resolutions so far, when the user stops.
///
/// # Errors
///
/// When the cells don't grow by one factor or don't fit the scene's shapes; as [`reference()`].
pub fn mesh_study(
    subject: &Subject<'_>,
    setting: Setting,
    cells: &[u32],
    budget: f64,
    say: &mut dyn FnMut(String),
) -> Result<MeshStudy, StudyError> {
    let start = Instant::now();
    let ratio = refine::ratio(cells)?;
    let mut meshes: Vec<Mesh<'_>> = Vec::new();
    for &cells in cells {
        let changes = refine::changes(&subject.loaded.scene, cells)?;
        let refined = subject.with(&changes)?;
        let model = scene::build(&refined.loaded)?.model;
        let coarsest = meshes.first().map_or(&model, |mesh| &mesh.model);
        let stencils = stencils(&subject.loaded.scene, coarsest, &model)?;
        meshes.push(Mesh {
            cells,
            subject: refined,
            stencils,
            model,
        });
    }
    let left = || budget - start.elapsed().as_secs_f64();
    let mut references = Vec::new();
    for mesh in &mut meshes {
        match mesh.converged(f64::INFINITY, left(), say) {
            Ok(reference) => references.push(reference),
            Err(StudyError::Stopped) if references.len() > 1 => break,
            Err(error) => return Err(error),
        }
    }
    shorten(&mut meshes, &mut references);
    // Now that the differences are known, the steps whose error is not far below are made shorter.
    let goal = STEP_SHARE * smallest_difference(&meshes, &references);
    for (mesh, reference) in meshes.iter_mut().zip(&mut references) {
        if reference.error.rms > goal && left() > 0.0 {
            match mesh.converged(goal, left(), say) {
                Ok(better) => *reference = better,
                Err(StudyError::Stopped) => break,
                Err(error) => return Err(error),
            }
        }
    }
    shorten(&mut meshes, &mut references);
    let mut resolutions = Vec::new();
    for (mesh, reference) in meshes.iter().zip(references) {
        say(format!(
            "{} cells under the scene's own setting",
            mesh.cells
        ));
        resolutions.push(mesh.resolution(setting, &reference)?);
    }
    let mut study = MeshStudy::new(subject, setting, resolutions, ratio);
    (study.duration, study.times) = (meshes[0].subject.duration, meshes[0].subject.times);
    Ok(study)
}

/// Leaves out the times at which one of the references has nothing to say.
fn shorten(meshes: &mut [Mesh<'_>], references: &mut [Reference]) {
    let times = references.iter().map(|reference| reference.states.len());
    let times = times.min().unwrap_or(0);
    for reference in references {
        reference.states.truncate(times);
    }
    for mesh in meshes {
        let times = u32::try_from(times).unwrap_or(u32::MAX);
        mesh.subject.shorten(times.min(mesh.subject.times));
    }
}

/// A scene at one resolution, before it runs.
struct Mesh<'a> {
    cells: u32,
    subject: Subject<'a>,
    model: Model,
    /// The particles of the coarsest mesh on this one.
    stencils: Vec<Stencil>,
}

impl Mesh<'_> {
    fn converged(
        &mut self,
        goal: f64,
        budget: f64,
        say: &mut dyn FnMut(String),
    ) -> Result<Reference, StudyError> {
        let cells = self.cells;
        let mut say_cells = |what: String| say(format!("{cells} cells: {what}"));
        reference(&mut self.subject, goal, budget, &mut say_cells)
    }

    /// States at the particles of the coarsest mesh.
    fn sampled(&self, states: &[Vec<DVec3>]) -> Vec<Vec<DVec3>> {
        let at = |state: &Vec<DVec3>| self.stencils.iter().map(|s| s.of(state)).collect();
        states.iter().map(at).collect()
    }

    fn resolution(
        &self,
        setting: Setting,
        reference: &Reference,
    ) -> Result<Resolution, StudyError> {
        let own = Setting {
            dt: self.subject.fitting(setting.dt),
            ..setting
        };
        let trial = self.subject.measure(own)?;
        let error = Distance::over(&trial.states, &reference.states);
        let completed = trial.outcome == Outcome::Completed;
        Ok(Resolution {
            cells: self.cells,
            particles: self.model.cloth_particles(),
            own: completed.then_some((trial.seconds_per_second, error)),
            converged: reference.setting,
            step_left: reference.error,
            to_next: None,
            to_limit: None,
            order: None,
            states: self.sampled(&reference.states),
        })
    }
}

fn smallest_difference(meshes: &[Mesh<'_>], references: &[Reference]) -> f64 {
    let sampled: Vec<_> = meshes
        .iter()
        .zip(references)
        .map(|(mesh, reference)| mesh.sampled(&reference.states))
        .collect();
    let pairs = sampled.windows(2);
    let differences = pairs.map(|pair| Distance::over(&pair[0], &pair[1]).rms);
    differences.fold(f64::INFINITY, f64::min)
}

impl MeshStudy {
    fn new(
        subject: &Subject<'_>,
        setting: Setting,
        mut resolutions: Vec<Resolution>,
        ratio: f64,
    ) -> Self {
        let states: Vec<_> = resolutions.iter().map(|r| r.states.clone()).collect();
        let pairs = states.windows(2);
        let next: Vec<Distance> = pairs
            .map(|pair| Distance::over(&pair[0], &pair[1]))
            .collect();
        for (k, &to_next) in next.iter().enumerate() {
            resolutions[k].to_next = Some(to_next);
            if k > 0 {
                resolutions[k].order = order(next[k - 1].rms, to_next.rms, ratio);
            }
        }
        let verdict = verdict(&resolutions, &next);
        let limit = match (verdict, states.as_slice()) {
            (Verdict::Converges(order), [.., middle, fine]) => {
                extrapolated(middle, fine, ratio.powf(order))
            }
            _ => Vec::new(),
        };
        if !limit.is_empty() {
            for (resolution, states) in resolutions.iter_mut().zip(&states) {
                resolution.to_limit = Some(Distance::over(states, &limit));
            }
        }
        let cloths = subject.loaded.scene.cloth.iter();
        Self {
            scene: subject.loaded.file.clone(),
            setting,
            duration: subject.duration,
            times: subject.times,
            resolutions,
            fixed: cloths
                .filter(|cloth| matches!(cloth.shape, Shape::Obj(_)))
                .map(|cloth| cloth.name.clone())
                .collect(),
            verdict,
            limit,
        }
    }

    /// The largest of what is left of the steps' errors (m RMS).
    pub fn step_left(&self) -> f64 {
        step_left(&self.resolutions)
    }

    /// Whether that is far below the smallest difference of two meshes.
    pub fn is_of_the_mesh(&self) -> bool {
        let next = self.resolutions.iter().filter_map(|r| r.to_next);
        let least = next.map(|next| next.rms).fold(f64::INFINITY, f64::min);
        self.step_left() <= STEP_SHARE * least
    }
}

fn step_left(resolutions: &[Resolution]) -> f64 {
    let left = resolutions.iter().map(|r| r.step_left.rms);
    left.fold(0.0, f64::max)
}

fn verdict(resolutions: &[Resolution], next: &[Distance]) -> Verdict {
    let Some(last) = next.last() else {
        return Verdict::TooFew;
    };
    let floor = step_left(resolutions).max(NOTHING * size(resolutions));
    if last.rms <= floor {
        return Verdict::Below(floor);
    }
    match resolutions.iter().rev().find_map(|r| r.order) {
        None => Verdict::TooFew,
        Some(order) if order >= LEAST_ORDER => Verdict::Converges(order),
        Some(_) => Verdict::NoLimit,
    }
}

/// Diagonal of the box around the cloths at the end (m).
fn size(resolutions: &[Resolution]) -> f64 {
    let end = resolutions.first().and_then(|r| r.states.last());
    end.map_or(f64::INFINITY, |end| diagonal(end))
}

/// p of differences ∝ hᵖ between three meshes, each finer by `ratio`.
fn order(before: f64, after: f64, ratio: f64) -> Option<f64> {
    let order = (before / after).ln() / ratio.ln();
    order.is_finite().then_some(order)
}

/// Richardson's extrapolation, x + (x − x₂ₕ)/(rᵖ − 1) with the growth rᵖ of the error, particle by
/// particle.
///
/// Source: Richardson 1911.
fn extrapolated(middle: &[Vec<DVec3>], fine: &[Vec<DVec3>], growth: f64) -> Vec<Vec<DVec3>> {
    let state = |(middle, fine): (&Vec<DVec3>, &Vec<DVec3>)| {
        let each = middle.iter().zip(fine);
        each.map(|(&m, &f)| f + (f - m) / (growth - 1.0)).collect()
    };
    middle.iter().zip(fine).map(state).collect()
}
