//! Walking through a file.

use super::ReadError;
use rerun::external::re_log_encoding::{DecoderApp, DecoderIterator};
use rerun::log::{Chunk, LogMsg};
use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The messages of a recording, in the file's order.
///
/// A recording that ends in the middle of a message is read up to there.
pub(crate) struct Messages {
    path: PathBuf,
    decoder: DecoderIterator<LogMsg, BufReader<File>>,
    any: bool,
}

impl Messages {
    /// Opens a recording.
    pub(crate) fn open(path: &Path) -> Result<Self, ReadError> {
        let file = File::open(path).map_err(|source| ReadError::CannotRead {
            path: path.to_owned(),
            source,
        })?;
        let decoder = DecoderApp::decode_eager(BufReader::new(file))
            .map_err(|error| not_a_recording(path, &error))?;
        Ok(Self {
            path: path.to_owned(),
            decoder,
            any: false,
        })
    }

    /// The next message; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<LogMsg>, ReadError> {
        let message = self.decoder.next().transpose();
        let message = message.map_err(|error| not_a_recording(&self.path, &error))?;
        if message.is_none() && !self.any {
            return Err(not_a_recording(&self.path, &"it is empty"));
        }
        self.any = true;
        Ok(message)
    }

    /// Bytes of the file read so far, up to the end of the last message.
    pub(crate) fn bytes(&self) -> u64 {
        self.decoder.num_bytes_processed()
    }

    /// The rows in a message, if it is one of a recording and not of a blueprint.
    pub(crate) fn rows(&self, message: &LogMsg) -> Result<Option<Chunk>, ReadError> {
        match message {
            LogMsg::ArrowMsg(store, rows) if store.is_recording() => Chunk::from_arrow_msg(rows)
                .map(Some)
                .map_err(|error| not_a_recording(&self.path, &error)),
            _ => Ok(None),
        }
    }
}

impl fmt::Debug for Messages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (f.debug_struct("Messages").field("path", &self.path)).finish_non_exhaustive()
    }
}

fn not_a_recording(path: &Path, reason: &impl ToString) -> ReadError {
    ReadError::NotARecording {
        path: path.to_owned(),
        reason: reason.to_string(),
    }
}

/// Calls `visit` for each chunk of the recording, in the file's order.
///
/// A recording that ends in the middle of a message is read up to there.
pub(crate) fn for_each_chunk(path: &Path, mut visit: impl FnMut(Chunk)) -> Result<(), ReadError> {
    let mut messages = Messages::open(path)?;
    while let Some(message) = messages.next()? {
        if let Some(chunk) = messages.rows(&message)? {
            visit(chunk);
        }
    }
    Ok(())
}
