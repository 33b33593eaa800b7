//! Messages for live viewers alone, from those who have them ready.

use std::fmt;
use std::time::Duration;

use rerun::log::LogMsg;

use super::RecordError;
use super::live::LiveViewer;
use super::targets::{Open, Targets};

/// Live viewers that are fed with messages.
pub(crate) struct LiveFeed(Open);

impl LiveFeed {
    /// Opens the targets and waits for their viewers as long as one may take to start.
    ///
    /// # Errors
    ///
    /// When an address is none, a port is taken, no viewer can be started, or there is no target.
    pub(crate) fn open(targets: &Targets) -> Result<Self, RecordError> {
        let open = targets.open()?;
        open.viewers.iter().for_each(LiveViewer::wait_for_viewer);
        Ok(Self(open))
    }

    /// Sends a message to every viewer.
    pub(crate) fn send(&self, message: &LogMsg) {
        for viewer in &self.0.viewers {
            viewer.send(message.clone());
        }
    }

    /// Waits until every viewer has taken half of what can wait for it, no longer than `patience` for each. Have they?
    pub(crate) fn wait_for_room(&self, patience: Duration) -> bool {
        let held_up = (self.0.viewers.iter()).filter(|viewer| !viewer.wait_for_room(patience));
        held_up.count() == 0
    }

    /// Viewers that have come so far.
    pub(crate) fn greeted(&self) -> u64 {
        self.0.viewers.iter().map(LiveViewer::greeted).sum()
    }

    /// Frames that a viewer missed so far: of several viewers the one that missed most.
    pub(crate) fn dropped(&self) -> u64 {
        let dropped = self.0.viewers.iter().map(LiveViewer::dropped);
        dropped.max().unwrap_or(0)
    }

    /// Gives connected viewers up to two seconds to take the rest; what they don't is dropped.
    pub(crate) fn finish(&self) {
        self.0.viewers.iter().for_each(LiveViewer::finish);
    }
}

impl fmt::Debug for LiveFeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (f.debug_tuple("LiveFeed").field(&self.0.viewers)).finish()
    }
}
