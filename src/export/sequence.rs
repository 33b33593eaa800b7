//! A mesh file a frame.

use super::file::check_parent;
use super::{ExportError, Selection, Span, for_each_selected, write_obj, write_ply, write_whole};
use crate::replay::{Layout, RecordedFrame};
use std::collections::BTreeSet;
use std::fs::{self, DirEntry};
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ: text, an object a body.
    Obj,
    /// Binary PLY: all bodies in one mesh, coloured by strain.
    Ply,
}

impl MeshFormat {
    fn ending(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
        }
    }

    /// The file of a frame, such as `frame-000123.obj`.
    fn file(self, index: u64) -> String {
        format!("frame-{index:06}.{}", self.ending())
    }

    /// Is this the name of a frame's file?
    fn is_frame(self, name: &str) -> bool {
        let number = name.strip_prefix("frame-");
        let number = number.and_then(|rest| rest.strip_suffix(self.ending()));
        let number = number.and_then(|rest| rest.strip_suffix('.'));
        number.is_some_and(|n| n.len() >= 6 && n.bytes().all(|byte| byte.is_ascii_digit()))
    }
}

/// Refuses a folder that holds frames already, unless they may be replaced, and a place that can't be a
/// folder.
///
/// # Errors
///
/// As said.
pub fn check_folder(folder: &Path, format: MeshFormat, force: bool) -> Result<(), ExportError> {
    if !folder.exists() {
        return check_parent(folder);
    }
    let old = frames_in(folder, format)?;
    match old.len() {
        0 => Ok(()),
        _ if force => Ok(()),
        count => Err(ExportError::Exists {
            path: folder.to_owned(),
            what: format!("holds {count} frames already"),
        }),
    }
}

/// The frames' files in a folder.
fn frames_in(folder: &Path, format: MeshFormat) -> Result<BTreeSet<PathBuf>, ExportError> {
    let path = |entry: io::Result<DirEntry>| entry.map(|entry| entry.path());
    let entries = fs::read_dir(folder).and_then(|entries| entries.map(path).collect());
    let mut paths: BTreeSet<PathBuf> = entries.map_err(|source| ExportError::CannotCreate {
        path: folder.to_owned(),
        source,
    })?;
    paths.retain(|path| {
        let name = path.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| format.is_frame(name))
    });
    Ok(paths)
}

/// Writes the selected frames of a recording into a folder, which is made when its parent is there.
///
/// Frames of an older export are replaced, and when all is written the others are removed, so that the
/// folder holds one sequence.
///
/// # Errors
///
/// When the recording can't be read or a file can't be written.
pub fn write_sequence(
    recording: &Path,
    folder: &Path,
    format: MeshFormat,
    selection: Selection,
) -> Result<Span, ExportError> {
    let layout = Layout::read(recording)?;
    let mut written = BTreeSet::new();
    let span = for_each_selected(recording, &layout, selection, |frame| {
        if written.is_empty() && !folder.exists() {
            fs::create_dir(folder).map_err(|source| ExportError::CannotCreate {
                path: folder.to_owned(),
                source,
            })?;
        }
        let path = folder.join(format.file(frame.index));
        write_frame(&path, format, &layout, &frame)?;
        written.insert(path);
        Ok(ControlFlow::Continue(()))
    })?;
    for old in frames_in(folder, format)?.difference(&written) {
        fs::remove_file(old).map_err(|source| ExportError::CannotWrite {
            path: old.clone(),
            source,
        })?;
    }
    Ok(span)
}

fn write_frame(
    path: &Path,
    format: MeshFormat,
    layout: &Layout,
    frame: &RecordedFrame,
) -> Result<(), ExportError> {
    write_whole(path, |out| {
        match format {
            MeshFormat::Obj => write_obj(layout, frame, out)?,
            MeshFormat::Ply => write_ply(layout, frame, out)?,
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::super::sample::{self, folder};
    use super::*;
    use std::num::NonZeroU64;

    #[test]
    fn a_folder_holds_one_sequence() {
        let recording = sample::recording("sequence", 8);
        let parent = folder("sequence");
        let frames = parent.join("frames");
        let names = || {
            let entries = fs::read_dir(&frames).unwrap();
            let name = |entry: io::Result<DirEntry>| entry.unwrap().file_name();
            let names = entries.map(|entry| name(entry).into_string().unwrap());
            names
                .collect::<BTreeSet<_>>()
                .into_iter()
                .collect::<Vec<_>>()
        };
        let write = |every| {
            let every = Selection::Every(NonZeroU64::new(every).unwrap());
            write_sequence(&recording.path, &frames, MeshFormat::Obj, every).unwrap()
        };
        check_folder(&frames, MeshFormat::Obj, false).unwrap();
        let span = write(2);
        assert_eq!(span.frames, 4);
        assert!((span.last - 0.6).abs() < 1e-9, "{span:?}");
        let even = [0, 2, 4, 6].map(|k| format!("frame-{k:06}.obj"));
        assert_eq!(names(), even);
        let error = check_folder(&frames, MeshFormat::Obj, false).unwrap_err();
        assert!(error.to_string().contains("holds 4 frames"), "{error}");
        check_folder(&frames, MeshFormat::Obj, true).unwrap();
        check_folder(&frames, MeshFormat::Ply, false).unwrap();
        fs::write(frames.join("frame-1.obj"), "somebody else's").unwrap();
        write(3);
        let kept = ["frame-000000.obj", "frame-000003.obj", "frame-000006.obj"];
        assert_eq!(names(), [&kept[..], &["frame-1.obj"]].concat());
        let missing = parent.join("missing/frames");
        check_folder(&missing, MeshFormat::Obj, false).unwrap_err();
        fs::remove_dir_all(&parent).unwrap();
    }
}
