//! What a recording holds.

use super::reading::Messages;
use super::{ReadError, seconds};
use crate::frame::Facts;
use crate::recorder::statics::{BRANCH, frames_of, texts_of};
use crate::recorder::{checkpoint, entity, properties};
use rerun::log::{Chunk, LogMsg};
use rerun::{EntityPathPart, Scalars, TextLog};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What a file has besides rows: its name, where each chunk is, and what a killed run left half.
const INDEX: &str = "(the file's own index)";

/// What a recording holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Info {
    /// What it says about itself; `None` for one without such properties.
    pub facts: Option<Facts>,
    /// Does it end as a finished recording does? One that doesn't is of a run that was killed or goes on.
    pub complete: bool,
    /// Of which recording this is a branch, and how; empty otherwise.
    pub branch: String,
    /// Frames of which there is anything.
    pub frames: u64,
    /// Simulated time of the first and the last frame (s).
    pub span: Option<(f64, f64)>,
    /// Every series by its path, such as `energy/kinetic`.
    pub series: BTreeMap<String, Summary>,
    /// Times of the checkpoints (s).
    pub checkpoints: Vec<f64>,
    /// Lines of the log by level.
    pub log: BTreeMap<String, u64>,
    /// Size of the file (bytes).
    pub bytes: u64,
    /// What each entity takes of it, the largest first.
    pub sizes: Vec<Size>,
}

/// A series in three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Its last value.
    pub last: f64,
    /// Its largest value in any frame.
    pub largest: f64,
    /// Time of that (s).
    pub at: f64,
}

/// What an entity takes of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Size {
    /// The entity, or what else takes space, in brackets.
    pub entity: String,
    /// Bytes in the file, compressed as they are there.
    pub bytes: u64,
    /// Rows.
    pub rows: u64,
}

impl Info {
    /// Reads through a recording.
    ///
    /// # Errors
    ///
    /// When the file can't be read or is no recording.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let cannot_read = |source| ReadError::CannotRead {
            path: path.to_owned(),
            source,
        };
        let mut tally = Tally::default();
        let mut messages = Messages::open(path)?;
        let mut done = 0;
        while let Some(message) = messages.next()? {
            let rows = messages.rows(&message)?;
            let bytes = messages.bytes() - done;
            done += bytes;
            tally.add(&message, rows.as_ref(), bytes);
        }
        let mut info = tally.info;
        info.bytes = std::fs::metadata(path).map_err(cannot_read)?.len();
        info.checkpoints.sort_by(f64::total_cmp);
        info.frames = tally.frames.len() as u64;
        let told: u64 = tally.sizes.values().map(|(bytes, _)| bytes).sum();
        let rest = tally.sizes.entry(INDEX.to_owned()).or_default();
        rest.0 += info.bytes.saturating_sub(told);
        let sizes = tally.sizes.into_iter();
        info.sizes = sizes
            .map(|(entity, (bytes, rows))| Size {
                entity,
                bytes,
                rows,
            })
            .filter(|size| size.bytes > 0)
            .collect();
        info.sizes.sort_by_key(|size| std::cmp::Reverse(size.bytes));
        Ok(info)
    }

    /// Bytes of the file a frame; `None` without frames.
    #[expect(clippy::cast_precision_loss, reason = "files stay below 2⁵³ bytes")]
    pub fn bytes_per_frame(&self) -> Option<f64> {
        (self.frames > 0).then(|| self.bytes as f64 / self.frames as f64)
    }

    /// Bytes of the file a particle and frame; `None` when either is not known.
    #[expect(clippy::cast_precision_loss, reason = "counts stay below 2⁵³")]
    pub fn bytes_per_particle_and_frame(&self) -> Option<f64> {
        let particles = self.facts.as_ref()?.particles;
        (particles > 0).then(|| Some(self.bytes_per_frame()? / particles as f64))?
    }
}

/// What is added up.
#[derive(Debug, Default)]
struct Tally {
    info: Info,
    frames: BTreeSet<i64>,
    /// Bytes and rows by entity.
    sizes: BTreeMap<String, (u64, u64)>,
}

impl Tally {
    fn add(&mut self, message: &LogMsg, rows: Option<&Chunk>, bytes: u64) {
        let entity = match rows {
            Some(chunk) => chunk.entity_path().to_string(),
            None if message.store_id().is_blueprint() => "(the viewer's layout)".to_owned(),
            None => INDEX.to_owned(),
        };
        let size = self.sizes.entry(entity).or_default();
        size.0 += bytes;
        if let Some(chunk) = rows {
            size.1 += chunk.num_rows() as u64;
            self.add_rows(chunk);
        }
    }

    fn add_rows(&mut self, chunk: &Chunk) {
        let info = &mut self.info;
        let path = chunk.entity_path();
        if *path == entity::path(&[entity::SCENE]) {
            info.complete |= frames_of(chunk).is_some();
            let branch = texts_of(chunk, BRANCH).and_then(|mut texts| texts.pop());
            info.branch = branch.unwrap_or(std::mem::take(&mut info.branch));
        }
        if *path == properties::path() {
            info.facts = info.facts.take().or_else(|| properties::read(chunk));
        }
        let timelines = chunk.timelines();
        if let Some(frames) = timelines.get(&entity::FRAME.into()) {
            self.frames.extend(frames.times_raw());
        }
        let times = timelines.get(&entity::SIM_TIME.into());
        for time in times.iter().flat_map(|column| column.times_raw()) {
            let time = seconds(*time);
            let span = info.span.get_or_insert((time, time));
            *span = (span.0.min(time), span.1.max(time));
        }
        if *path == entity::path(&[entity::CHECKPOINT]) {
            let marks = checkpoint::marks(chunk);
            info.checkpoints.extend(marks.iter().map(|mark| mark.time));
        }
        if *path == entity::path(&[entity::LOG]) {
            let levels = chunk.iter_slices::<String>(TextLog::descriptor_level().component);
            for level in levels.flat_map(|levels| levels.first().map(ToString::to_string)) {
                *info.log.entry(level).or_default() += 1;
            }
        }
        self.add_series(chunk);
    }

    fn add_series(&mut self, chunk: &Chunk) {
        let component = Scalars::descriptor_scalars().component;
        let times = chunk.iter_component_indices(entity::SIM_TIME.into(), component);
        let values = chunk.iter_slices::<f64>(component);
        let parts = chunk
            .entity_path()
            .iter()
            .map(EntityPathPart::unescaped_str);
        let path = parts.collect::<Vec<_>>().join("/");
        for ((time, _), values) in times.zip(values) {
            let Some(&value) = values.first() else {
                continue;
            };
            let at = seconds(time.as_i64());
            let first = Summary {
                last: value,
                largest: value,
                at,
            };
            let summary = self.info.series.entry(path.clone()).or_insert(first);
            summary.last = value;
            if value > summary.largest {
                (summary.largest, summary.at) = (value, at);
            }
        }
    }
}
