//! The Rerun recording of a run: a file, live viewers, or both.

use std::collections::BTreeSet;
use std::fmt;
use std::time::Duration;

use rerun::log::ChunkBatcherConfig;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamError};

use super::camera::Camera;
use super::drawing::Drawing;
use super::file::RecordingFile;
use super::live::LiveViewer;
use super::plots::Plots;
use super::targets::Targets;
use super::{RecordError, Recorded, Recorder};
use super::{blueprint, checkpoint, entity, statics};
use crate::frame::{Frame, Header};

/// Longest wait before shapes are sent off while a viewer watches: 20 times a second.
const LIVE_TICK: Duration = Duration::from_millis(50);
/// The same for what nobody sees move: curves, and everything in a file alone. Each entity costs 1.3 kB a tick, 0.05 ms
/// of ours and 0.06 ms of a viewer's time, 30 curves so at 20 times a second 6 % of a core; a killed run loses one tick.
const TICK: Duration = Duration::from_millis(200);
/// What is static has that time to be sent.
const START_TIME: Duration = Duration::from_secs(5);
/// For all that is still on its way when a run ends: 100 MB at most.
const FINISH_TIME: Duration = Duration::from_secs(60);

/// Records a run with Rerun.
///
/// The file gets every frame, whatever the live viewers do. Two recordings of the same frames
/// hold the same data: no clock is recorded, and the recording is named after the scene.
pub struct RerunRecorder {
    header: Header,
    stream: RecordingStream,
    /// The same recording at the pace of shapes.
    shapes: RecordingStream,
    file: Option<RecordingFile>,
    viewers: Vec<LiveViewer>,
    drawing: Drawing,
    plots: Plots,
    frames: u64,
    finished: bool,
}

impl RerunRecorder {
    /// Opens the targets and records what stays the same.
    ///
    /// # Errors
    ///
    /// When the file can't be created, an address is none, a port is taken, no viewer can be
    /// started, or two things of the scene have one name.
    pub fn new(header: &Header, targets: &Targets) -> Result<Self, RecordError> {
        check_names(header)?;
        let open = targets.open()?;
        let stream = paced(builder(header), TICK).set_sinks(open.sinks())?;
        let mut recorder = Self::with_stream(header, stream)?;
        if !open.viewers.is_empty() {
            let shapes = paced(builder(header).send_properties(false), LIVE_TICK);
            recorder.shapes = shapes.set_sinks(open.sinks())?;
            recorder.shapes.set_log_time_enabled(false);
        }
        recorder.file = open.file;
        recorder.viewers = open.viewers;
        // Rows of one tick are sent in no certain order, but a mesh without its triangles is an
        // error to the viewer: what is static goes first.
        recorder.flush(START_TIME)?;
        Ok(recorder)
    }

    pub(super) fn with_stream(
        header: &Header,
        stream: RecordingStream,
    ) -> Result<Self, RecordError> {
        stream.set_log_time_enabled(false);
        statics::log(&stream, header)?;
        Ok(Self {
            drawing: Drawing::new(header),
            plots: Plots::new(header),
            header: header.clone(),
            shapes: stream.clone(),
            stream,
            file: None,
            viewers: Vec::new(),
            frames: 0,
            finished: false,
        })
    }

    fn set_time(&self, frame: &Frame) {
        for stream in [&self.stream, &self.shapes] {
            // Rerun's times are nanoseconds in i64: 292 years.
            stream.set_duration_secs(entity::SIM_TIME, frame.time);
            let number = i64::try_from(frame.index).unwrap_or(i64::MAX);
            stream.set_time_sequence(entity::FRAME, number);
        }
    }

    /// Sends off what was logged. A disk that is only slow is no error: the stream waits by itself when too much is
    /// on its way, and viewers take what they can.
    fn flush(&self, timeout: Duration) -> Result<(), RecordError> {
        for stream in [&self.stream, &self.shapes] {
            stream.flush_with_timeout(timeout).ok();
        }
        self.file.as_ref().map_or(Ok(()), RecordingFile::check)
    }
}

impl Recorder for RerunRecorder {
    fn record(&mut self, frame: &Frame) -> Result<(), RecordError> {
        if self.finished {
            return Err(RecordError::Sink {
                message: format!("frame {} came after the end", frame.index),
            });
        }
        if self.frames == 0 {
            let camera = Camera::framing(&self.header, frame);
            blueprint::send(&self.stream, &self.header, camera)?;
        }
        self.set_time(frame);
        self.drawing.log(&self.shapes, &self.header, frame)?;
        self.plots.log(&self.stream, frame)?;
        checkpoint::log_hash(&self.stream, frame.hash)?;
        if let Some(state) = &frame.checkpoint {
            checkpoint::log(&self.stream, state)?;
        }
        self.frames += 1;
        if self.frames == 1 {
            // From here on there is something to go on from, whenever the run is killed.
            self.flush(START_TIME)?;
        }
        self.file.as_ref().map_or(Ok(()), RecordingFile::check)
    }

    fn finish(&mut self) -> Result<Recorded, RecordError> {
        if !self.finished {
            self.finished = true;
            statics::log_end(&self.stream, self.frames)?;
            let flushed = self.flush(FINISH_TIME);
            let completed = self.file.as_ref().map_or(Ok(()), RecordingFile::complete);
            for viewer in &self.viewers {
                viewer.finish();
            }
            flushed.and(completed)?;
        }
        Ok(Recorded {
            frames: self.frames,
            dropped_live_frames: self.dropped_live_frames(),
        })
    }

    /// Of several viewers the one that missed most.
    fn dropped_live_frames(&self) -> u64 {
        let dropped = self.viewers.iter().map(LiveViewer::dropped);
        dropped.max().unwrap_or(0)
    }
}

impl fmt::Debug for RerunRecorder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RerunRecorder")
            .field("file", &self.file)
            .field("viewers", &self.viewers)
            .field("frames", &self.frames)
            .finish_non_exhaustive()
    }
}

impl From<RecordingStreamError> for RecordError {
    fn from(error: RecordingStreamError) -> Self {
        Self::Sink {
            message: error.to_string(),
        }
    }
}

/// Rows wait so long for more of their entity.
fn paced(builder: RecordingStreamBuilder, flush_tick: Duration) -> RecordingStreamBuilder {
    builder.batcher_config(ChunkBatcherConfig {
        flush_tick,
        ..ChunkBatcherConfig::DEFAULT
    })
}

/// A recording named after its scene, without any clock in it.
pub(super) fn builder(header: &Header) -> RecordingStreamBuilder {
    RecordingStreamBuilder::new(entity::APPLICATION)
        .enabled(true) // RERUN=0 in the environment would make this a recording of nothing
        .recording_id(format!("muslin-{}", header.scene))
        .send_properties(true) // after recording_id, which switches them off
        .recording_name(header.scene.as_str())
        .recording_started(0)
}

/// Refuses two entities of one path.
fn check_names(header: &Header) -> Result<(), RecordError> {
    let cloths = header.cloths.iter().map(|cloth| cloth.name.as_str());
    let obstacles = header
        .obstacles
        .iter()
        .map(|obstacle| obstacle.name.as_str());
    let mut names = BTreeSet::from([entity::CONTACTS, entity::PENETRATIONS]);
    match cloths.chain(obstacles).find(|name| !names.insert(name)) {
        Some(name) => Err(RecordError::NameTaken {
            name: name.to_owned(),
        }),
        None => Ok(()),
    }
}
