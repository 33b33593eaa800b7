//! Two recordings on one timeline: how far apart they are, when they part, and both to look at.
//!
//! Compared are the particles of the coarser mesh; those of a finer one are found by where they are at rest. Runs
//! with other steps have their frames at other times, since steps are never bent to frames: the second run is
//! taken at the first one's times, on the cubic through four of its frames (Catmull and Rom 1974). What swings faster
//! than the frames is not seen by that: how far frames are from where their neighbours would have them says how much
//! it may be. On `hanging-cloth` at 60 frames a second corners ring by 0.05 mm between frames; with frames at times that
//! both runs step to, such as 50 a second with steps of 4 and 2 ms, nothing is between frames.

mod overlay;
mod pair;
mod timeline;

pub use overlay::Overlaid;

use super::{Distance, diagonal};
use crate::replay::{Layout, ReadError, RecordedFrame, for_each_frame};
use crate::scene::SceneError;
use glam::DVec3;
use pair::Pair;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use timeline::Timeline;

/// Why two recordings can't be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// One can't be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The scene of one isn't taken any more.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No thread can be started to read it.
    #[error("cannot start a thread: {0}; close other programs")]
    Thread(std::io::Error),
    /// Their cloths have nothing in common.
    #[error("{}; compare runs of one scene, also of other resolutions or solvers", .0)]
    Differ(String),
    /// They have no time in common.
    #[error("{} and {} have no time in common: they have frames from {} to {} s and from {} to {} s", .paths[0].display(), .paths[1].display(), .times[0][0], .times[0][1], .times[1][0], .times[1][1])]
    Apart {
        /// The recordings.
        paths: [PathBuf; 2],
        /// First and last time of each (s).
        times: [[f64; 2]; 2],
    },
}

/// How far two recordings are apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Times that both have (s), those of the first one's frames.
    pub times: Vec<f64>,
    /// The distance at each (m).
    pub each: Vec<Distance>,
    /// Particles that were compared.
    pub particles: usize,
    /// Diagonal of the box around the cloths in the first frame (m).
    pub size: f64,
    /// How far what was found between frames may be off (m); 0 where nothing was.
    pub unseen: Distance,
    /// Is each particle compared with itself? Otherwise the meshes differ, and particles of the coarser one are.
    pub one_mesh: bool,
}

impl Comparison {
    /// The distance over all times.
    pub fn whole(&self) -> Distance {
        Distance::of_all(&self.each)
    }

    /// The first time (s) at which any particle is farther apart than `visible` (m).
    pub fn parts(&self, visible: f64) -> Option<f64> {
        let mut each = self.times.iter().zip(&self.each);
        each.find(|(_, distance)| distance.largest > visible)
            .map(|(time, _)| *time)
    }
}

/// Compares two recordings.
///
/// # Errors
///
/// When one can't be read, or they have no cloths or no time in common.
pub fn compare(a: &Path, b: &Path) -> Result<Comparison, CompareError> {
    let pair = Pair::read([a, b])?;
    let mut comparison = Comparison {
        times: Vec::new(),
        each: Vec::new(),
        particles: pair.particles(),
        size: 0.0,
        unseen: Distance::default(),
        one_mesh: pair.is_one_mesh(),
    };
    let unseen = for_each_common(&pair, |first, second| {
        let [a, b] = pair.places([&flat(&first.cloths), second]);
        if comparison.times.is_empty() {
            comparison.size = diagonal(&a);
        }
        comparison.times.push(first.time);
        comparison.each.push(Distance::between(&a, &b));
        ControlFlow::Continue(())
    })?;
    comparison.unseen = unseen;
    if comparison.times.is_empty() {
        return Err(CompareError::Apart {
            paths: [a, b].map(Path::to_owned),
            times: [span(a, &pair.layouts[0])?, span(b, &pair.layouts[1])?],
        });
    }
    Ok(comparison)
}

/// Calls `visit` for each frame of the first recording with the particles of the second at its time (m). Returns how far
/// these may be off.
fn for_each_common(
    pair: &Pair,
    mut visit: impl FnMut(RecordedFrame, &[DVec3]) -> ControlFlow<()>,
) -> Result<Distance, CompareError> {
    let [first, second] = &pair.layouts;
    let mut timeline = Timeline::start(&pair.paths[1], second).map_err(CompareError::Thread)?;
    for_each_frame(&pair.paths[0], first, |frame| {
        match timeline.at(frame.time) {
            Some(positions) => visit(frame, &positions),
            None if timeline.is_over() => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        }
    })?;
    let unseen = timeline.unseen();
    timeline.finish()?;
    Ok(unseen)
}

/// All particles in a row (m).
fn flat(cloths: &[Vec<[f32; 3]>]) -> Vec<DVec3> {
    let points = cloths.iter().flatten();
    points
        .map(|p| DVec3::from_array(p.map(f64::from)))
        .collect()
}

/// First and last time of a recording (s).
fn span(path: &Path, layout: &Layout) -> Result<[f64; 2], ReadError> {
    let mut span = [f64::NAN; 2];
    for_each_frame(path, layout, |frame| {
        span = [
            if span[0].is_nan() {
                frame.time
            } else {
                span[0]
            },
            frame.time,
        ];
        ControlFlow::Continue(())
    })?;
    Ok(span)
}
