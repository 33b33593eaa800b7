//! The kinds of live viewers: one to connect to, and whoever comes to our port.

use std::fmt;
use std::net::{SocketAddr, TcpListener};
use std::str::FromStr;
use std::time::Duration;

use rerun::external::re_uri::ProxyUri;
use rerun::grpc_server::GrpcServerSink;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, GrpcSinkConnectionState, LogSink};
use rerun::{MemoryLimit, ServerOptions, SpawnOptions};

use super::RecordError;

/// History kept for viewers that come later to our port: about 80 s of a 60 × 60 sheet at
/// 60 frames a second. Beyond it the oldest is forgotten.
const SERVED_HISTORY_BYTES: u64 = 512 << 20;
/// How long a local connection may take; a run shorter than that waits for it.
const CONNECT_TIME: Duration = Duration::from_millis(500);
/// How long a viewer may take to start.
const SPAWN_TIME: Duration = Duration::from_secs(10);
/// Memory of a viewer that we start: Rerun's own default, 75 % of the machine's, leaves too
/// little for a simulation.
const SPAWNED_MEMORY: &str = "2GB";

/// Who is fed.
#[derive(Clone, Debug)]
pub(super) enum Viewer {
    /// A viewer that listens at an address.
    Remote {
        /// Its address.
        uri: ProxyUri,
        /// How long it may take to be there.
        start_up: Duration,
    },
    /// Viewers that come to an address of ours.
    Served {
        /// The address.
        address: SocketAddr,
    },
}

impl Viewer {
    /// A viewer that listens at `url`.
    ///
    /// # Errors
    ///
    /// When `url` is no viewer's address.
    pub(super) fn at(url: &str) -> Result<Self, RecordError> {
        let uri = ProxyUri::from_str(url).map_err(|error| RecordError::BadUrl {
            url: url.to_owned(),
            reason: error.to_string(),
        })?;
        Ok(Self::Remote {
            uri,
            start_up: CONNECT_TIME,
        })
    }

    /// Viewers that come to `address`.
    ///
    /// # Errors
    ///
    /// When its port is taken; Rerun itself would only log that.
    pub(super) fn served(address: SocketAddr) -> Result<Self, RecordError> {
        match TcpListener::bind(address) {
            Ok(_free) => Ok(Self::Served { address }),
            Err(source) => Err(RecordError::CannotServe { address, source }),
        }
    }

    /// Starts a viewer, or takes the one that runs.
    ///
    /// # Errors
    ///
    /// When there is no `rerun` in PATH, or it doesn't start.
    pub(super) fn spawned() -> Result<Self, RecordError> {
        let options = SpawnOptions {
            memory_limit: SPAWNED_MEMORY.to_owned(),
            hide_welcome_screen: true,
            ..SpawnOptions::default()
        };
        let spawned = rerun::spawn(&options).map_err(|error| RecordError::CannotSpawn {
            reason: match error {
                rerun::SpawnError::ExecutableNotFoundInPath {
                    executable_name, ..
                } => format!("there is no `{executable_name}` in PATH"),
                other => other.to_string(),
            },
        })?;
        let url = format!("rerun+http://127.0.0.1:{}/proxy", spawned.port);
        match Self::at(&url)? {
            Self::Remote { uri, .. } => Ok(Self::Remote {
                uri,
                start_up: SPAWN_TIME,
            }),
            served => Ok(served),
        }
    }

    /// How long the viewer may take to be there.
    pub(super) fn start_up_time(&self) -> Duration {
        match self {
            Self::Remote { start_up, .. } => *start_up,
            Self::Served { .. } => CONNECT_TIME,
        }
    }

    /// Are viewers served that come after the run's end?
    pub(super) fn outlives_run(&self) -> bool {
        matches!(self, Self::Served { .. })
    }

    /// Opens a connection; returns before anyone has answered.
    ///
    /// # Errors
    ///
    /// When there can never be one.
    pub(super) fn open(&self) -> Result<Connection, std::net::AddrParseError> {
        Ok(match self {
            Self::Remote { uri, .. } => Connection::Client(GrpcSink::new(uri.clone())),
            Self::Served { address } => {
                let options = ServerOptions {
                    memory_limit: MemoryLimit::from_bytes(SERVED_HISTORY_BYTES),
                    ..ServerOptions::default()
                };
                Connection::Server({
                    let (ip, port) = (address.ip().to_string(), address.port());
                    GrpcServerSink::new(&ip, port, options)?
                })
            }
        })
    }
}

impl fmt::Display for Viewer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Remote { uri, .. } => uri.fmt(f),
            Self::Served { address } => write!(f, "rerun+http://{address}/proxy"),
        }
    }
}

/// An open connection.
pub(super) enum Connection {
    /// To a viewer.
    Client(GrpcSink),
    /// A server of our own, which keeps a history for those who come.
    Server(GrpcServerSink),
}

/// How a connection is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Status {
    /// Nobody has answered yet.
    Connecting,
    /// Somebody listens.
    Connected,
    /// Nobody ever will.
    Lost,
}

impl Connection {
    /// How the connection is. A server always has a listener: its own history.
    pub(super) fn status(&self) -> Status {
        match self {
            Self::Server(_) => Status::Connected,
            Self::Client(sink) => match sink.status() {
                GrpcSinkConnectionState::Connecting { .. } => Status::Connecting,
                GrpcSinkConnectionState::Connected => Status::Connected,
                GrpcSinkConnectionState::Disconnected(_) => Status::Lost,
            },
        }
    }

    /// Sends messages and waits until they are on their way. Are they?
    pub(super) fn send(&self, messages: Vec<LogMsg>) -> bool {
        let sink: &dyn LogSink = match self {
            Self::Client(sink) => sink,
            Self::Server(sink) => sink,
        };
        sink.send_all(messages);
        sink.flush_blocking(Duration::MAX).is_ok()
    }
}
