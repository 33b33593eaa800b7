//! The rows of one recording in the order of their times, read as far ahead as that needs.

use super::reading::Messages;
use super::survey::Survey;
use super::{ReadError, Window};
use crate::recorder::entity;
use rerun::external::arrow::array::Array as _;
use rerun::log::{Chunk, LogMsg};
use rerun::{ComponentIdentifier, EntityPath, SizeBytes as _};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Most bytes read ahead. A recording's batches have 2 MB each; only one that was put together by something else, a
/// whole series at a time, comes near, and then its rows come as early as they can.
const READ_AHEAD: u64 = 256 << 20;

/// One recording as it is replayed.
#[derive(Debug)]
pub(super) struct Track {
    path: PathBuf,
    messages: Messages,
    survey: Survey,
    /// Messages read so far.
    number: u64,
    /// Rows of these times (ns) are replayed, and before them what is to be seen at the first.
    window: Window,
    /// The last row before the window of each component.
    before: BTreeMap<(EntityPath, ComponentIdentifier), (i64, Chunk)>,
    ahead: Vec<Ahead>,
}

/// A chunk read ahead.
#[derive(Debug)]
struct Ahead {
    chunk: Chunk,
    bytes: u64,
    /// Rows handed out.
    done: usize,
}

impl Ahead {
    fn times(&self) -> &[i64] {
        let column = self.chunk.timelines().get(&entity::SIM_TIME.into());
        column.map_or(&[], |column| &column.times_raw()[self.done..])
    }

    /// Takes the rows up to a time (ns).
    fn take(&mut self, until: i64) -> Option<Chunk> {
        let count = self.times().partition_point(|time| *time <= until);
        // Deep: a shallow slice would carry the whole chunk through the line to the viewer.
        let rows = (count > 0).then(|| self.chunk.row_sliced_deep(self.done, count));
        self.done += count;
        rows
    }
}

impl Track {
    /// Opens a recording of which the first look is taken.
    pub(super) fn open(path: PathBuf, survey: Survey, window: Window) -> Result<Self, ReadError> {
        Ok(Self {
            messages: Messages::open(&path)?,
            path,
            survey,
            number: 0,
            window,
            before: BTreeMap::new(),
            ahead: Vec::new(),
        })
    }

    /// Begins again.
    pub(super) fn rewind(&mut self) -> Result<(), ReadError> {
        self.messages = Messages::open(&self.path)?;
        self.number = 0;
        self.before.clear();
        self.ahead.clear();
        Ok(())
    }

    /// What every viewer needs at once.
    pub(super) fn sticky(&self) -> &[LogMsg] {
        &self.survey.sticky
    }

    /// What is to be seen at the window's first time: of each component the last row before it.
    pub(super) fn opening(&mut self) -> Result<Vec<Chunk>, ReadError> {
        self.read(self.window.from.saturating_sub(1))?;
        let rows = std::mem::take(&mut self.before).into_values();
        let mut rows: Vec<(i64, Chunk)> = rows.collect();
        rows.sort_by_key(|(time, _)| *time);
        Ok(rows.into_iter().map(|(_, row)| row).collect())
    }

    /// Time (ns) of the next rows, every one of which is read; `None` when there are no more.
    pub(super) fn next(&mut self) -> Result<Option<i64>, ReadError> {
        loop {
            let first = self.ahead.iter().flat_map(|a| a.times().first()).min();
            match first.copied() {
                Some(time) if time < self.complete_before() => return Ok(Some(time)),
                first if self.complete_before() > self.window.to => return Ok(first),
                _ => self.read_one()?,
            }
        }
    }

    /// Rows before this time (ns) are all read.
    pub(super) fn complete_before(&self) -> i64 {
        if self.full() {
            i64::MAX
        } else {
            self.survey.horizon.at(self.number)
        }
    }

    /// Takes the rows up to a time (ns), the earliest first.
    pub(super) fn take(&mut self, until: i64) -> Vec<Chunk> {
        let first = |ahead: &Ahead| ahead.times().first().copied();
        self.ahead.sort_by_key(first);
        let rows = self.ahead.iter_mut().filter_map(|ahead| ahead.take(until));
        let rows = rows.collect();
        self.ahead.retain(|ahead| !ahead.times().is_empty());
        rows
    }

    fn full(&self) -> bool {
        self.ahead.iter().map(|ahead| ahead.bytes).sum::<u64>() > READ_AHEAD
    }

    /// Reads until no row at or before `time` (ns) can come any more.
    fn read(&mut self, time: i64) -> Result<(), ReadError> {
        while self.complete_before() <= time {
            self.read_one()?;
        }
        Ok(())
    }

    fn read_one(&mut self) -> Result<(), ReadError> {
        let Some(message) = self.messages.next()? else {
            // Shorter than at the first look: what isn't there can't be waited for.
            self.number = u64::MAX;
            return Ok(());
        };
        self.number += 1;
        let timeline = entity::SIM_TIME.into();
        let rows = self.messages.rows(&message)?;
        let Some(rows) = rows.filter(|rows| rows.timelines().contains_key(&timeline)) else {
            return Ok(());
        };
        let mut ahead = Ahead {
            bytes: rows.total_size_bytes(),
            chunk: rows.sorted_by_timeline_if_unsorted(&timeline),
            done: 0,
        };
        let times = ahead.times();
        let before = times.partition_point(|time| *time < self.window.from);
        let inside = times.partition_point(|time| *time <= self.window.to);
        self.remember(&ahead.chunk, &times[..before]);
        if inside > before {
            if inside < times.len() {
                ahead.chunk = ahead.chunk.row_sliced_deep(0, inside);
            }
            ahead.done = before;
            self.ahead.push(ahead);
        }
        Ok(())
    }

    /// Keeps the last of the rows before the window of each component; `times` are theirs.
    fn remember(&mut self, chunk: &Chunk, times: &[i64]) {
        let mut columns: Vec<_> = chunk.components().values().collect();
        columns.sort_by_key(|column| column.descriptor.component);
        for column in columns {
            let rows = 0..times.len();
            let Some(row) = rows.rev().find(|row| column.list_array.is_valid(*row)) else {
                continue;
            };
            let component = column.descriptor.component;
            let key = (chunk.entity_path().clone(), component);
            let known = self.before.get(&key).map(|(time, _)| *time);
            if known.is_none_or(|known| known <= times[row]) {
                let row_alone = chunk.component_sliced(component).row_sliced_deep(row, 1);
                self.before.insert(key, (times[row], row_alone));
            }
        }
    }
}
