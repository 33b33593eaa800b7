//! What waits for a live viewer: bounded, and never in anyone's way.
//!
//! Messages of two kinds: *sticky* ones (the recording's name, static data, the blueprint) are
//! kept for good and sent to every viewer that comes, since without them it shows nothing; those
//! of frames wait in line and the oldest are dropped when the line is full.
//!
//! A frame counts as dropped when any part of it didn't reach the viewer.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rerun::SizeBytes;
use rerun::external::arrow::array::{Array, Int64Array};
use rerun::log::LogMsg;

use super::entity;
use super::frame_set::FrameSet;

/// Most messages in line: with some 30 entities a frame, over two seconds at 60 frames a second.
const MAX_MESSAGES: usize = 4096;
/// Most bytes in line: some ten seconds of a 60 × 60 sheet at 60 frames a second.
const MAX_BYTES: u64 = 64 << 20;
/// Messages handed over at once: with the flush behind them they fit into the 100 places of
/// Rerun's own queue, so that handing over never blocks.
const BATCH: usize = 64;

/// How the line to the viewer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Link {
    /// Nobody is there, or not any more.
    Down,
    /// A viewer listens.
    Up,
    /// The thread that feeds the viewer has ended.
    Ended,
}

/// The line for one viewer, shared by the recording and the thread that feeds the viewer.
#[derive(Debug)]
pub(super) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    sticky: Vec<LogMsg>,
    waiting: VecDeque<Waiting>,
    waiting_bytes: u64,
    /// Frames handed to the viewer that it hasn't confirmed.
    in_flight: Vec<u64>,
    dropped: FrameSet,
    link: Link,
    /// Viewers that have come so far.
    greeted: u64,
    /// Sticky messages that the present viewer has.
    sticky_sent: usize,
    closing: bool,
}

/// A message in line.
#[derive(Debug)]
struct Waiting {
    message: LogMsg,
    /// Frames that it has rows of.
    frames: Vec<u64>,
    bytes: u64,
}

impl Queue {
    /// An empty line with nobody at its end.
    pub(super) fn new() -> Self {
        let state = State {
            sticky: Vec::new(),
            waiting: VecDeque::new(),
            waiting_bytes: 0,
            in_flight: Vec::new(),
            dropped: FrameSet::default(),
            link: Link::Down,
            greeted: 0,
            sticky_sent: 0,
            closing: false,
        };
        Self {
            state: Mutex::new(state),
            changed: Condvar::new(),
        }
    }

    /// Lines a message up; drops the oldest when there is no place. Never waits for a viewer.
    pub(super) fn push(&self, message: LogMsg) {
        let frames = frames_of(&message);
        let mut state = self.lock();
        if state.closing {
            state.dropped.insert_all(frames.into_iter().flatten());
            return;
        }
        match frames {
            None => state.sticky.push(message),
            Some(frames) => state.line_up(message, frames),
        }
        drop(state);
        self.changed.notify_all();
    }

    /// Frames of which the viewer missed something so far.
    pub(super) fn dropped(&self) -> u64 {
        self.lock().dropped.len()
    }

    /// Viewers that have come so far.
    pub(super) fn greeted(&self) -> u64 {
        self.lock().greeted
    }

    /// Waits until a viewer is there, no longer than `deadline`.
    pub(super) fn wait_for_viewer(&self, deadline: Instant) {
        let left = deadline.saturating_duration_since(Instant::now());
        let state = self.lock();
        let down = |state: &mut State| state.link == Link::Down;
        drop(self.changed.wait_timeout_while(state, left, down));
    }

    /// Waits until half of the line is free, no longer than `patience`, and only while a viewer is there to make
    /// room. Is nothing in the way?
    pub(super) fn wait_for_room(&self, patience: Duration) -> bool {
        let state = self.lock();
        let waited = (self.changed)
            .wait_timeout_while(state, patience, |state: &mut State| state.is_held_up());
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        !state.is_held_up()
    }

    /// Is it time to end?
    pub(super) fn closing(&self) -> bool {
        self.lock().closing
    }

    /// Says how the line to the viewer is; a new viewer gets the sticky messages again.
    pub(super) fn set_link(&self, link: Link) {
        let mut state = self.lock();
        if state.link != link {
            state.link = link;
            state.greeted += u64::from(link == Link::Up);
            state.sticky_sent = 0;
        }
        drop(state);
        self.changed.notify_all();
    }

    /// The next messages for the viewer, sticky ones first; none when `timeout` runs out.
    ///
    /// Follow it by [`Self::settle`].
    pub(super) fn take(&self, timeout: Duration) -> Vec<LogMsg> {
        let state = self.lock();
        let idle = |state: &mut State| !state.has_work() && !state.closing;
        let waited = self.changed.wait_timeout_while(state, timeout, idle);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let batch = state.next_batch();
        drop(state);
        self.changed.notify_all();
        batch
    }

    /// Says whether the viewer has what [`Self::take`] gave.
    pub(super) fn settle(&self, arrived: bool) {
        let mut state = self.lock();
        let frames = std::mem::take(&mut state.in_flight);
        if !arrived {
            state.dropped.insert_all(frames);
        }
        drop(state);
        self.changed.notify_all();
    }

    /// Waits for `pause`, or until it is time to end.
    pub(super) fn pause(&self, pause: Duration) {
        let state = self.lock();
        let waited = self
            .changed
            .wait_timeout_while(state, pause, |state| !state.closing);
        drop(waited);
    }

    /// Waits until the viewer has everything, or nobody is there after `until_up`, or it takes nothing for `patience`,
    /// or `deadline`. Returns whether whoever is there has everything.
    pub(super) fn drain(&self, until_up: Instant, patience: Duration, deadline: Instant) -> bool {
        let mut state = self.lock();
        let mut taken = Instant::now();
        loop {
            let until = match state.link {
                Link::Down => until_up.min(deadline),
                Link::Up if state.busy() => deadline.min(taken + patience),
                _ => return true,
            };
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return state.link == Link::Down;
            }
            let before = (state.waiting.len(), state.in_flight.len(), state.link);
            let waited = self.changed.wait_timeout(state, left);
            (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
            if before != (state.waiting.len(), state.in_flight.len(), state.link) {
                taken = Instant::now();
            }
        }
    }

    /// Counts what is still in line as dropped and tells the thread to end.
    pub(super) fn close(&self) {
        let mut state = self.lock();
        state.drop_all();
        state.closing = true;
        drop(state);
        self.changed.notify_all();
    }

    /// Waits until the thread has ended, no longer than `deadline`.
    pub(super) fn wait_for_end(&self, deadline: Instant) {
        let left = deadline.saturating_duration_since(Instant::now());
        let state = self.lock();
        let up = |state: &mut State| state.link == Link::Up;
        drop(self.changed.wait_timeout_while(state, left, up));
    }

    /// Counts what is still in line, or on its way, as dropped.
    pub(super) fn give_up(&self) {
        self.lock().drop_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is a plain record of counts: still good after a panic elsewhere.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn line_up(&mut self, message: LogMsg, frames: Vec<u64>) {
        let bytes = message.total_size_bytes();
        self.waiting_bytes += bytes;
        self.waiting.push_back(Waiting {
            message,
            frames,
            bytes,
        });
        while self.waiting.len() > MAX_MESSAGES || self.waiting_bytes > MAX_BYTES {
            let Some(oldest) = self.pop() else { break };
            self.dropped.insert_all(oldest.frames);
        }
    }

    fn pop(&mut self) -> Option<Waiting> {
        let oldest = self.waiting.pop_front()?;
        self.waiting_bytes = self.waiting_bytes.saturating_sub(oldest.bytes);
        Some(oldest)
    }

    fn has_work(&self) -> bool {
        self.sticky_sent < self.sticky.len() || !self.waiting.is_empty()
    }

    /// Is a viewer there that hasn't taken half of what can be lined up?
    fn is_held_up(&self) -> bool {
        let full = 2 * self.waiting.len() > MAX_MESSAGES || 2 * self.waiting_bytes > MAX_BYTES;
        full && self.link == Link::Up && !self.closing
    }

    fn busy(&self) -> bool {
        self.has_work() || !self.in_flight.is_empty()
    }

    fn next_batch(&mut self) -> Vec<LogMsg> {
        let sticky = self.sticky.iter().skip(self.sticky_sent).take(BATCH);
        let mut batch: Vec<LogMsg> = sticky.cloned().collect();
        self.sticky_sent += batch.len();
        while batch.len() < BATCH {
            let Some(oldest) = self.pop() else { break };
            self.in_flight.extend(oldest.frames);
            batch.push(oldest.message);
        }
        batch
    }

    fn drop_all(&mut self) {
        let in_flight = std::mem::take(&mut self.in_flight);
        self.dropped.insert_all(in_flight);
        while let Some(oldest) = self.pop() {
            self.dropped.insert_all(oldest.frames);
        }
    }
}

/// The frames that a message has rows of; none for what every viewer needs.
fn frames_of(message: &LogMsg) -> Option<Vec<u64>> {
    let LogMsg::ArrowMsg(store, chunk) = message else {
        return None;
    };
    if !store.is_recording() {
        return None;
    }
    let Some(column) = chunk.batch.column_by_name(entity::FRAME) else {
        // What has a time, but no frame, is dropped without being counted.
        return (chunk.batch.column_by_name(entity::SIM_TIME)).map(|_| Vec::new());
    };
    let frames = column.as_any().downcast_ref::<Int64Array>()?;
    let mut frames: Vec<u64> = frames.iter().flatten().map(i64::cast_unsigned).collect();
    frames.dedup();
    Some(frames)
}
