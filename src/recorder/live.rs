//! A sink for live viewers that can't hold anyone up.
//!
//! Rerun's own `GrpcSink` blocks whoever logs as soon as 100 messages wait, hangs at exit, and
//! never connects again. Here it is owned by a thread of its own behind a bounded [`Queue`]:
//! whether the viewer is absent, slow, stopped, killed or started again, `send` returns at once.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use super::RecordError;
use super::queue::{Link, Queue};
use super::viewer::{Connection, Status, Viewer};

/// How often the thread looks whether a viewer has come or gone.
const LOOK: Duration = Duration::from_millis(50);
/// Pause before the first new connection after a lost one; doubles up to [`LONGEST_PAUSE`].
const FIRST_PAUSE: Duration = Duration::from_millis(250);
/// Something that isn't a viewer may listen on the port and hang up on us: don't spin.
const LONGEST_PAUSE: Duration = Duration::from_secs(4);
/// Time for a connected viewer to take the rest when a run ends.
const DRAIN: Duration = Duration::from_secs(2);

/// A viewer that has taken nothing for so long then stands still: nobody waits for it.
const PATIENCE: Duration = Duration::from_millis(500);

/// The recording's end of the line to a viewer.
#[derive(Debug)]
pub(super) struct LiveSink {
    queue: Arc<Queue>,
}

impl LogSink for LiveSink {
    fn send(&self, message: LogMsg) {
        self.queue.push(message);
    }

    /// Does nothing: whoever flushes means the file, and must not wait for a viewer.
    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(())
    }
}

/// A viewer that is being fed; dropping it ends that.
#[derive(Debug)]
pub(super) struct LiveViewer {
    queue: Arc<Queue>,
    /// Until then a viewer may be starting up.
    expected_by: Instant,
    /// Goes on for viewers that come later, until dropped.
    outlives_run: bool,
}

impl LiveViewer {
    /// Starts the thread that feeds `viewer`.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub(super) fn start(viewer: Viewer) -> Result<Self, RecordError> {
        let queue = Arc::new(Queue::new());
        let live = Self {
            queue: Arc::clone(&queue),
            expected_by: Instant::now() + viewer.start_up_time(),
            outlives_run: viewer.outlives_run(),
        };
        // Never joined: a stopped viewer would keep it for ever. It ends with the process.
        thread::Builder::new()
            .name("muslin-live".to_owned())
            .spawn(move || feed(&queue, &viewer))
            .map_err(|source| RecordError::CannotStartThread { source })?;
        Ok(live)
    }

    /// Lines a message up for the viewer, and returns at once.
    pub(super) fn send(&self, message: LogMsg) {
        self.queue.push(message);
    }

    /// A way into the line for those who log.
    pub(super) fn sink(&self) -> LiveSink {
        LiveSink {
            queue: Arc::clone(&self.queue),
        }
    }

    /// Frames of which the viewer missed something so far.
    pub(super) fn dropped(&self) -> u64 {
        self.queue.dropped()
    }

    /// Viewers that have come so far.
    pub(super) fn greeted(&self) -> u64 {
        self.queue.greeted()
    }

    /// Waits until a viewer is there, as long as one may take to start.
    pub(super) fn wait_for_viewer(&self) {
        self.queue.wait_for_viewer(self.expected_by);
    }

    /// Waits until half of the line is free, no longer than `patience`. Is nothing in the way?
    pub(super) fn wait_for_room(&self, patience: Duration) -> bool {
        self.queue.wait_for_room(patience)
    }

    /// Gives a connected viewer up to two seconds to take the rest; what it doesn't is dropped.
    pub(super) fn finish(&self) {
        let deadline = self.expected_by.max(Instant::now()) + DRAIN;
        let drained = self.queue.drain(self.expected_by, PATIENCE, deadline);
        if self.outlives_run {
            self.queue.give_up();
        } else {
            self.queue.close();
            if drained {
                self.queue.wait_for_end(deadline);
            }
        }
    }
}

impl Drop for LiveViewer {
    fn drop(&mut self) {
        self.queue.close();
    }
}

/// Feeds one viewer after another until the queue is closed.
fn feed(queue: &Queue, viewer: &Viewer) {
    let mut pause = FIRST_PAUSE;
    while !queue.closing() {
        let connection = match viewer.open() {
            Ok(connection) => connection,
            Err(reason) => {
                tracing::error!("no live viewer at {viewer}: {reason}");
                break;
            }
        };
        let delivered = deliver(queue, viewer, &connection);
        // The viewer gets what is on its way before the connection closes; a stopped one keeps
        // this thread here, but nobody waits for it longer than `DRAIN`.
        drop(connection);
        queue.set_link(Link::Down);
        pause = if delivered {
            FIRST_PAUSE
        } else {
            (2 * pause).min(LONGEST_PAUSE)
        };
        queue.pause(pause);
    }
    queue.set_link(Link::Ended);
}

/// Feeds one viewer until it is lost or the queue is closed. Did it take anything?
fn deliver(queue: &Queue, viewer: &Viewer, connection: &Connection) -> bool {
    let mut delivered = false;
    let mut greeted = false;
    while !queue.closing() {
        match connection.status() {
            Status::Connecting => queue.pause(LOOK),
            Status::Lost => {
                if greeted {
                    tracing::warn!("lost the live viewer at {viewer}; waiting for another");
                }
                return delivered;
            }
            Status::Connected => {
                if !greeted {
                    tracing::info!("feeding the live viewer at {viewer}");
                    queue.set_link(Link::Up);
                    greeted = true;
                }
                let batch = queue.take(LOOK);
                if batch.is_empty() {
                    continue;
                }
                let arrived = connection.send(batch);
                queue.settle(arrived);
                delivered |= arrived;
            }
        }
    }
    delivered
}
