//! Where a run is recorded to, and the sinks for it.

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use rerun::sink::{FileSink, FileSinkError, LogSink};

use super::RecordError;
use super::live::LiveViewer;
use super::viewer::Viewer;

/// Where a run is recorded to: a file, live viewers, or both.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Targets {
    /// The `.rrd` file to write; one that exists is replaced.
    pub save: Option<PathBuf>,
    /// Address of a viewer that listens, such as `rerun+http://127.0.0.1:9876/proxy`.
    pub connect: Option<String>,
    /// Port of this machine at which viewers may fetch the recording.
    pub serve: Option<u16>,
    /// Start a viewer, or take the one that runs on Rerun's usual port.
    pub spawn: bool,
}

/// The open targets.
pub(super) struct Open {
    /// What the stream writes to.
    pub(super) sinks: Vec<Box<dyn LogSink>>,
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
            connect,
            serve,
            spawn,
        } = self;
        let mut open = Open {
            sinks: Vec::new(),
            viewers: Vec::new(),
        };
        let mut kinds = Vec::new();
        kinds.extend(connect.as_deref().map(Viewer::at).transpose()?);
        kinds.extend(serve.map(Viewer::served).transpose()?);
        save.as_deref().map(check_writable).transpose()?;
        if *spawn {
            kinds.push(Viewer::spawned()?);
        }
        if let Some(path) = save {
            open.sinks.push(Box::new(create(path.clone())?));
        }
        for kind in kinds {
            let (sink, viewer) = LiveViewer::start(kind)?;
            open.sinks.push(Box::new(sink));
            open.viewers.push(viewer);
        }
        if open.sinks.is_empty() {
            return Err(RecordError::NoTarget);
        }
        Ok(open)
    }
}

/// Can the recording's file be written? Leaves what is in it.
fn check_writable(path: &Path) -> Result<(), RecordError> {
    let opened = OpenOptions::new().append(true).create(true).open(path);
    opened.map(drop).map_err(|source| RecordError::CannotWrite {
        path: path.to_owned(),
        source,
    })
}

/// Creates the recording's file.
fn create(path: PathBuf) -> Result<FileSink, RecordError> {
    FileSink::new(path.clone()).map_err(|error| match error {
        FileSinkError::CreateFile { source, path } => RecordError::CannotWrite { path, source },
        other => RecordError::CannotWrite {
            path,
            source: std::io::Error::other(other.to_string()),
        },
    })
}
