//! Keys of a terminal.

use console::{Key, Term};
use std::io::IsTerminal as _;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Keys that may wait to be heard.
const WAITING: usize = 16;

/// The keys that are pressed; none without a terminal.
///
/// Whoever waits for a key has the terminal in another mode, and can't be called off: the mode as it was is set
/// again at the end.
#[derive(Debug)]
pub(super) struct Keys {
    pressed: Option<Receiver<Key>>,
    mode: Option<String>,
}

impl Keys {
    /// Listens in a thread of its own, if standard input and error are a terminal's and the program is in front.
    pub(super) fn listen() -> Self {
        let terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
        if !terminal || !in_front() {
            return Self {
                pressed: None,
                mode: None,
            };
        }
        let mode = stty("-g").map(|mode| mode.trim().to_owned());
        let (sender, pressed) = sync_channel(WAITING);
        let listening = thread::Builder::new()
            .name("muslin-keys".to_owned())
            .spawn(move || {
                let terminal = Term::stderr();
                while let Ok(key) = terminal.read_key() {
                    if sender.send(key).is_err() {
                        break;
                    }
                }
            });
        Self {
            // Without the thread there are no keys, as without a terminal.
            pressed: listening.ok().map(|_| pressed),
            mode,
        }
    }

    /// Is anyone listening?
    pub(super) fn heard(&self) -> bool {
        self.pressed.is_some()
    }

    /// Waits for a key, no longer than so.
    pub(super) fn wait(&mut self, at_most: Duration) -> Option<Key> {
        let Some(pressed) = &self.pressed else {
            thread::sleep(at_most);
            return None;
        };
        match pressed.recv_timeout(at_most) {
            Ok(key) => Some(key),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                self.pressed = None;
                None
            }
        }
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(mode) = &self.mode {
            stty(mode);
        }
    }
}

/// Runs the system's `stty` with one argument; where there is none, reading a key changes no mode.
fn stty(argument: &str) -> Option<String> {
    let output = Command::new("stty")
        .arg(argument)
        .stdin(Stdio::inherit())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Is this program the one that the terminal talks to? One in the background that reads keys is stopped.
///
/// Linux tells in `/proc/self/stat`, after the name in brackets: state, parent, group, session, terminal, group in
/// front.
fn in_front() -> bool {
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else {
        return true;
    };
    let fields = stat.rsplit_once(") ").map_or("", |(_, fields)| fields);
    let fields: Vec<&str> = fields.split(' ').collect();
    fields.len() < 6 || fields[2] == fields[5]
}
