//! Walking through a file.

use super::ReadError;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Calls `visit` for each chunk of the recording, in the file's order.
///
/// A recording that ends in the middle of a message is read up to there.
pub(crate) fn for_each_chunk(path: &Path, mut visit: impl FnMut(Chunk)) -> Result<(), ReadError> {
    let not_a_recording = |reason: String| ReadError::NotARecording {
        path: path.to_owned(),
        reason,
    };
    let file = File::open(path).map_err(|source| ReadError::CannotRead {
        path: path.to_owned(),
        source,
    })?;
    let messages = DecoderApp::decode_eager(BufReader::new(file))
        .map_err(|error| not_a_recording(error.to_string()))?;
    let mut any = false;
    for message in messages {
        let message = message.map_err(|error| not_a_recording(error.to_string()))?;
        any = true;
        if let LogMsg::ArrowMsg(store, rows) = message
            && store.is_recording()
        {
            let chunk =
                Chunk::from_arrow_msg(&rows).map_err(|error| not_a_recording(error.to_string()))?;
            visit(chunk);
        }
    }
    match any {
        true => Ok(()),
        false => Err(not_a_recording("it is empty".to_owned())),
    }
}
