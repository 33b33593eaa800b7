//! The recording's file, written by ourselves: Rerun's own sink ends quietly when a disk is full, and says neither
//! that nor why.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{EncodeError, Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use super::RecordError;

/// A file ends with a table of its messages if there are no more: readers of part of a file like it, but it takes
/// 1 kB a message of memory until then, and runs may last for days.
const MOST_LISTED: u64 = 20_000;

/// The recording's end of the line to the file. Each message is whole in the file before the next is taken.
#[derive(Debug)]
pub(super) struct FileSink {
    writer: Arc<Mutex<Writer>>,
}

/// The file, for those who ask how it is.
#[derive(Debug)]
pub(super) struct RecordingFile {
    path: PathBuf,
    writer: Arc<Mutex<Writer>>,
}

struct Writer {
    /// `None` once the file is complete.
    encoder: Option<Encoder<File>>,
    messages: u64,
    /// Why nothing more is written.
    failed: Option<io::Error>,
}

impl RecordingFile {
    /// Creates the file; one that exists is replaced if that was asked for.
    ///
    /// # Errors
    ///
    /// When it can't be created.
    pub(super) fn create(path: &Path, force: bool) -> Result<Self, RecordError> {
        let create = || -> io::Result<Writer> {
            let mut options = OpenOptions::new();
            options
                .write(true)
                .truncate(true)
                .create(true)
                .create_new(!force);
            let file = options.open(path)?;
            let encoding = EncodingOptions::PROTOBUF_COMPRESSED;
            let encoder = Encoder::new_eager(CrateVersion::LOCAL, encoding, file);
            Ok(Writer {
                encoder: Some(encoder.map_err(cause)?),
                messages: 0,
                failed: None,
            })
        };
        let writer = create().map_err(|source| RecordError::of_file(path, source))?;
        Ok(Self {
            path: path.to_owned(),
            writer: Arc::new(Mutex::new(writer)),
        })
    }

    /// A way into the file.
    pub(super) fn sink(&self) -> FileSink {
        FileSink {
            writer: Arc::clone(&self.writer),
        }
    }

    /// Whether everything that was sent is in the file.
    ///
    /// # Errors
    ///
    /// Why something isn't.
    pub(super) fn check(&self) -> Result<(), RecordError> {
        match &lock(&self.writer).failed {
            None => Ok(()),
            Some(error) => Err(RecordError::of_file(&self.path, copy(error))),
        }
    }

    /// Completes the file and sees to it that it is on the disk.
    ///
    /// # Errors
    ///
    /// When it isn't.
    pub(super) fn complete(&self) -> Result<(), RecordError> {
        lock(&self.writer).complete();
        self.check()
    }
}

impl Writer {
    fn write(&mut self, message: &LogMsg) {
        let Some(encoder) = self.encoder.as_mut().filter(|_| self.failed.is_none()) else {
            return;
        };
        self.messages += 1;
        if self.messages == MOST_LISTED {
            encoder.do_not_emit_footer();
        }
        self.failed = encoder.append(message).err().map(cause);
    }

    fn complete(&mut self) {
        let Some(mut encoder) = self.encoder.take() else {
            return;
        };
        if self.failed.is_some() {
            // What fits no more would come after half a message: nobody could read it.
            encoder.do_not_emit_footer();
            return;
        }
        let file = encoder.finish().and_then(|()| encoder.into_inner());
        let synced = file.map_err(cause).and_then(|file| file.sync_all());
        self.failed = synced.err();
    }
}

impl LogSink for FileSink {
    fn send(&self, message: LogMsg) {
        lock(&self.writer).write(&message);
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        match &lock(&self.writer).failed {
            None => Ok(()),
            Some(error) => Err(SinkFlushError::failed(error.to_string())),
        }
    }
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer")
            .field("messages", &self.messages)
            .field("failed", &self.failed)
            .finish_non_exhaustive()
    }
}

fn lock(writer: &Mutex<Writer>) -> MutexGuard<'_, Writer> {
    // Whatever panicked elsewhere, whole messages are whole.
    writer.lock().unwrap_or_else(PoisonError::into_inner)
}

fn cause(error: EncodeError) -> io::Error {
    match error {
        EncodeError::Write(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

fn copy(error: &io::Error) -> io::Error {
    match error.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code),
        None => io::Error::new(error.kind(), error.to_string()),
    }
}
