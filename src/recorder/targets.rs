//! Where a run is recorded to, and the sinks for it.

use std::fs::{self, OpenOptions};
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use rerun::sink::LogSink;

use super::RecordError;
use super::file::RecordingFile;
use super::live::LiveViewer;
use super::viewer::Viewer;

/// Where a run is recorded to: a file, live viewers, or both.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Targets {
    /// The `.rrd` file to write.
    pub save: Option<PathBuf>,
    /// Replace a file that exists.
    pub force: bool,
    /// Address of a viewer that listens, such as `rerun+http://127.0.0.1:9876/proxy`.
    pub connect: Option<String>,
    /// Address of this machine at which viewers may fetch the recording.
    pub serve: Option<SocketAddr>,
    /// Start a viewer, or take the one that runs on Rerun's usual port.
    pub spawn: bool,
}

/// The open targets.
pub(super) struct Open {
    /// The file, if there is one.
    pub(super) file: Option<RecordingFile>,
    /// The viewers at the other ends.
    pub(super) viewers: Vec<LiveViewer>,
}

impl Targets {
    /// Opens every target.
    ///
    /// What can be refused is asked first: the file may be an older recording, which only a run
    /// that goes ahead may replace, and no viewer is started for one that doesn't.
    pub(super) fn open(&self) -> Result<Open, RecordError> {
        let Self {
            save,
            force,
            connect,
            serve,
            spawn,
        } = self;
        let mut open = Open {
            file: None,
            viewers: Vec::new(),
        };
        let mut kinds = Vec::new();
        kinds.extend(connect.as_deref().map(Viewer::at).transpose()?);
        kinds.extend(serve.map(Viewer::served).transpose()?);
        save.as_deref()
            .map(|path| check_writable(path, *force))
            .transpose()?;
        if *spawn {
            kinds.push(Viewer::spawned()?);
        }
        if let Some(path) = save {
            open.file = Some(RecordingFile::create(path, *force)?);
        }
        for kind in kinds {
            open.viewers.push(LiveViewer::start(kind)?);
        }
        if open.file.is_none() && open.viewers.is_empty() {
            return Err(RecordError::NoTarget);
        }
        Ok(open)
    }
}

impl Open {
    /// What a stream writes to: each target once.
    pub(super) fn sinks(&self) -> Vec<Box<dyn LogSink>> {
        let mut sinks: Vec<Box<dyn LogSink>> = Vec::new();
        if let Some(file) = &self.file {
            sinks.push(Box::new(file.sink()));
        }
        for viewer in &self.viewers {
            sinks.push(Box::new(viewer.sink()));
        }
        sinks
    }
}

/// Can the recording's file be written? Leaves what is in it, and nothing where nothing was.
fn check_writable(path: &Path, force: bool) -> Result<(), RecordError> {
    let of_file = |source| RecordError::of_file(path, source);
    if path.exists() && !force {
        return Err(of_file(io::ErrorKind::AlreadyExists.into()));
    }
    let existed = path.exists();
    let opened = OpenOptions::new().append(true).create(true).open(path);
    opened.map_err(of_file)?;
    if !existed {
        fs::remove_file(path).map_err(of_file)?;
    }
    Ok(())
}
