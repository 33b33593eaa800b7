//! The frames of a recording as parts of the file, in its order: twice the same.

use super::TARGETS;
use crate::export::body::bodies;
use crate::export::{ExportError, Selection, Span, for_each_selected};
use crate::replay::{Layout, RecordedFrame};
use std::ops::ControlFlow;
use std::path::Path;

/// A body at one time.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub(super) name: String,
    pub(super) is_cloth: bool,
    /// Vertex positions (m).
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The links of a chain.
    pub(super) links: Vec<[u32; 2]>,
}

/// A part of the file.
#[derive(Debug)]
pub(super) enum Part<'a> {
    /// The bodies that rest; once, in front.
    Resting(&'a [Place]),
    /// The others where a row of morph targets begins.
    Base(&'a [Place]),
    /// The same at a later time.
    Target {
        base: &'a [Place],
        places: &'a [Place],
        /// Time of the base and this (s), from that of the first frame.
        times: [f32; 2],
    },
}

/// A frame of what moves, and its time (s) from the first.
type Moment = (f32, Vec<Place>);

/// Calls `visit` for each part, with `most` frames at most.
///
/// Of frames at times that `f32` can't tell apart the first counts: keyframes must ascend.
pub(super) fn walk(
    path: &Path,
    layout: &Layout,
    selection: Selection,
    most: usize,
    mut visit: impl FnMut(Part<'_>) -> Result<(), ExportError>,
) -> Result<Span, ExportError> {
    let mut span = Span::default();
    let mut base: Moment = Default::default();
    // The last frame, when it is the base of the next.
    let mut turn: Option<Moment> = None;
    let mut before = f32::NEG_INFINITY;
    for_each_selected(path, layout, selection, |frame| {
        if span.frames == 0 {
            visit(Part::Resting(&places(layout, &frame, true)))?;
            span.first = frame.time;
        }
        let time = after(span.first, frame.time);
        if time <= before {
            return Ok(ControlFlow::Continue(()));
        }
        before = time;
        span.last = frame.time;
        let places = places(layout, &frame, false);
        if span.frames > 0 {
            if let Some(next) = turn.take() {
                base = next;
                visit(Part::Base(&base.1))?;
            }
            check(path, &base.1, &places, &frame)?;
            visit(Part::Target {
                base: &base.1,
                places: &places,
                times: [base.0, time],
            })?;
        }
        if span.frames.is_multiple_of(TARGETS) {
            turn = Some((time, places));
        }
        span.frames += 1;
        Ok(match span.frames < most {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        })
    })?;
    if let (1, Some(only)) = (span.frames, turn) {
        visit(Part::Base(&only.1))?;
    }
    Ok(span)
}

/// Time since the first frame (s).
#[expect(
    clippy::cast_possible_truncation,
    reason = "rounded: glTF's times are f32"
)]
fn after(first: f64, time: f64) -> f32 {
    (time - first) as f32
}

/// The bodies that rest, or those that move.
fn places(layout: &Layout, frame: &RecordedFrame, rest: bool) -> Vec<Place> {
    let bodies = bodies(layout, frame).filter(|body| body.rests == rest);
    // A body without triangles or links can't be drawn.
    let drawn = bodies.filter(|body| !body.triangles.is_empty() || body.links().next().is_some());
    drawn
        .map(|body| Place {
            name: body.name.to_owned(),
            is_cloth: body.is_cloth,
            positions: body.positions.to_vec(),
            triangles: body.triangles.to_vec(),
            links: body.links().collect(),
        })
        .collect()
}

/// Refuses a frame that has other vertices than the first.
fn check(
    path: &Path,
    base: &[Place],
    places: &[Place],
    frame: &RecordedFrame,
) -> Result<(), ExportError> {
    let counts = |places: &[Place]| -> Vec<usize> {
        places.iter().map(|place| place.positions.len()).collect()
    };
    if counts(base) == counts(places) {
        return Ok(());
    }
    Err(ExportError::Damaged {
        path: path.to_owned(),
        what: format!("frame {} has other vertices than the first", frame.index),
    })
}
