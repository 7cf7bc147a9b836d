//! What the editor shows of Open Sound Control.

use super::outlet::Sending;
use std::net::SocketAddr;

/// Where packets are received.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Listening {
    /// Nowhere: it is off, or the host has not activated the plugin yet.
    #[default]
    Off,
    /// The port is being opened.
    Opening,
    /// There.
    At(SocketAddr),
    /// Nowhere, for this reason. The port is tried again every second.
    Failed(String),
}

/// What has come in and gone out for one instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OscStatus {
    /// Where packets are received.
    pub listening: Listening,
    /// Messages a second at the port, for whichever instance.
    pub messages_per_s: f32,
    /// Messages at the port since it was opened.
    pub messages: u64,
    /// The address of the last message at the port; empty before the first.
    pub last_address: String,
    /// Messages at addresses that this instance does not know, such as those of another format.
    pub unknown: u64,
    /// Malformed packets, and messages with malformed arguments.
    pub garbage: u64,
    /// Why the last one was rejected; empty before the first.
    pub last_garbage: String,
    /// Messages with a value that was out of range and has been clamped.
    pub clamped: u64,
    /// Seconds since the tracker was heard last, if there is one.
    pub tracker_s: Option<f32>,
    /// Whether the tracker has been recentred.
    pub recentred: bool,
    /// Where the pose is sent.
    pub sending: Sending,
    /// Poses that have been sent.
    pub sent: u64,
    /// Remarks on settings that cannot work as they are; usually empty.
    pub note: String,
}
