//! Is the recording really on the disk?
//!
//! When a disk is full, Rerun's writer ends quietly: only a flush tells, and not why.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rerun::RecordingStream;
use rerun::sink::SinkFlushError;

use super::RecordError;

/// A complete recording ends with 32 bytes that hold this.
const FOOTER_MARK: &[u8] = b"RRF2FOOT";
const TRAILER_BYTES: usize = 32;
/// How much the probe writes: more than what a nearly full disk may have left in a block.
const PROBE_BYTES: usize = 256 << 10;

/// Sees to it that everything logged so far is in the file.
///
/// A disk that is only slow is not an error: nothing is lost, and the stream waits by itself
/// when too much is on its way.
pub(super) fn flush(
    stream: &RecordingStream,
    path: &Path,
    timeout: Duration,
) -> Result<(), RecordError> {
    match stream.flush_with_timeout(timeout) {
        Ok(()) | Err(SinkFlushError::Timeout) => Ok(()),
        Err(SinkFlushError::Failed { message }) => Err(cannot_write(path, message)),
    }
}

/// Checks that the finished file ends as a complete recording does.
pub(super) fn check_complete(path: &Path) -> Result<(), RecordError> {
    match is_complete(path) {
        Ok(true) => Ok(()),
        Ok(false) => Err(cannot_write(path, "its end is missing".to_owned())),
        Err(source) => Err(RecordError::CannotWrite {
            path: path.to_owned(),
            source,
        }),
    }
}

/// Does a file end as a complete recording does?
pub(crate) fn is_complete(path: &Path) -> io::Result<bool> {
    let end = trailer(path)?;
    Ok(end.windows(FOOTER_MARK.len()).any(|w| w == FOOTER_MARK))
}

fn trailer(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TRAILER_BYTES as u64)))?;
    let mut bytes = Vec::with_capacity(TRAILER_BYTES);
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The error of a write that failed for a reason that Rerun keeps to itself.
fn cannot_write(path: &Path, message: String) -> RecordError {
    RecordError::CannotWrite {
        path: path.to_owned(),
        source: probe(path).err().unwrap_or(io::Error::other(message)),
    }
}

/// Writes beside the recording what would have been written into it, to learn what is wrong.
fn probe(recording: &Path) -> io::Result<()> {
    let mut name = recording.as_os_str().to_owned();
    name.push(".probe");
    let path = PathBuf::from(name);
    let mut file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&path)?;
    let written = file
        .write_all(&vec![0; PROBE_BYTES])
        .and_then(|()| file.sync_all());
    drop(file);
    let removed = fs::remove_file(&path);
    written.and(removed)
}
