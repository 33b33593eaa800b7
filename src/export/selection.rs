//! Which frames of a recording are exported.

use super::ExportError;
use super::body::check;
use crate::replay::{At, Layout, RecordedFrame, for_each_frame};
use std::num::NonZeroU64;
use std::ops::ControlFlow;
use std::path::Path;

/// Half of the nanosecond to which times are recorded (s).
const TIME_ROUNDING: f64 = 0.5e-9;

/// Which frames of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Selection {
    /// The first and every so many after it.
    Every(NonZeroU64),
    /// One: the last, or the last at or before a time.
    At(At),
}

/// What was selected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// Number of frames.
    pub frames: usize,
    /// Time of the first (s).
    pub first: f64,
    /// Time of the last (s).
    pub last: f64,
}

impl Span {
    /// One frame more.
    fn add(&mut self, time: f64) {
        if self.frames == 0 {
            self.first = time;
        }
        self.last = time;
        self.frames += 1;
    }
}

/// Calls `visit` for each selected frame in order, until it breaks.
///
/// # Errors
///
/// When the file can't be read, has no such frame, or its parts don't belong together; and what `visit`
/// returns.
pub fn for_each_selected(
    path: &Path,
    layout: &Layout,
    selection: Selection,
    mut visit: impl FnMut(RecordedFrame) -> Result<ControlFlow<()>, ExportError>,
) -> Result<Span, ExportError> {
    let mut span = Span::default();
    let mut hand_out = |frame: RecordedFrame| {
        check(path, layout, &frame)?;
        span.add(frame.time);
        visit(frame)
    };
    match selection {
        Selection::At(at) => {
            let frame = find(path, layout, at)?;
            let _ = hand_out(frame)?;
        }
        Selection::Every(every) => {
            let mut seen = 0;
            let mut done = Ok(ControlFlow::Continue(()));
            for_each_frame(path, layout, |frame| {
                if seen % every == 0 {
                    done = hand_out(frame);
                }
                seen += 1;
                match done {
                    Ok(going) => going,
                    Err(_) => ControlFlow::Break(()),
                }
            })?;
            let _ = done?;
        }
    }
    match span.frames {
        0 => Err(ExportError::NoFrame {
            path: path.to_owned(),
        }),
        _ => Ok(span),
    }
}

/// The last frame, or the last at or before a time.
fn find(path: &Path, layout: &Layout, at: At) -> Result<RecordedFrame, ExportError> {
    let mut found = None;
    let mut first = None;
    for_each_frame(path, layout, |frame| {
        first = first.or(Some(frame.time));
        if matches!(at, At::Time(time) if frame.time > time + TIME_ROUNDING) {
            return ControlFlow::Break(());
        }
        found = Some(frame);
        ControlFlow::Continue(())
    })?;
    let path = path.to_owned();
    match (found, first, at) {
        (Some(frame), ..) => Ok(frame),
        (None, Some(first), At::Time(time)) => Err(ExportError::TooEarly { path, time, first }),
        (None, ..) => Err(ExportError::NoFrame { path }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample::{self, Recording};
    use super::*;

    fn indices(recording: &Recording, selection: Selection) -> Result<Vec<u64>, ExportError> {
        let layout = Layout::read(&recording.path)?;
        let mut indices = Vec::new();
        for_each_selected(&recording.path, &layout, selection, |frame| {
            indices.push(frame.index);
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(indices)
    }

    #[test]
    fn frames_are_found_by_number_and_time() {
        let recording = sample::recording("selection", 8);
        let every = |n| indices(&recording, Selection::Every(NonZeroU64::new(n).unwrap())).unwrap();
        assert_eq!(every(1), (0..8).collect::<Vec<_>>());
        assert_eq!(every(3), [0, 3, 6]);
        assert_eq!(every(100), [0]);
        let at = |at| indices(&recording, Selection::At(at));
        assert_eq!(at(At::Last).unwrap(), [7]);
        for (time, index) in [(0.0, 0), (0.1, 1), (0.3, 3), (0.399, 3), (9.0, 7)] {
            assert_eq!(at(At::Time(time)).unwrap(), [index], "{time} s");
        }
        let error = at(At::Time(-0.1)).unwrap_err().to_string();
        assert!(error.contains("the first is at 0 s"), "{error}");
    }

    #[test]
    fn a_recording_without_frames_is_refused() {
        let recording = sample::recording("selection-none", 0);
        let every = Selection::Every(NonZeroU64::MIN);
        for selection in [every, Selection::At(At::Last), Selection::At(At::Time(1.0))] {
            let error = indices(&recording, selection).unwrap_err();
            assert!(matches!(error, ExportError::NoFrame { .. }), "{error}");
        }
    }
}
