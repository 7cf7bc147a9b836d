//! What the editor shows of Open Sound Control.

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

/// The state of a port.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortStatus {
    /// Where packets are received.
    pub listening: Listening,
    /// Messages a second, for whichever instance.
    pub messages_per_s: f32,
    /// Messages since it was opened.
    pub messages: u64,
    /// The address of the last message; empty before the first.
    pub last_address: String,
}

/// Where poses go to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Sending {
    /// Nowhere.
    #[default]
    Off,
    /// The host's name is being looked up.
    Resolving,
    /// There.
    To(SocketAddr),
    /// Nowhere, for this reason.
    Failed(String),
}

/// What has been counted for one instance.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages with a value that was out of range and has been clamped.
    pub clamped: u64,
    /// Malformed packets, and messages for this instance with malformed arguments.
    pub garbage: u64,
    /// Why the last one was rejected; empty before the first.
    pub last_garbage: String,
    /// Messages at addresses that this instance does not know, such as those of another format.
    pub unknown: u64,
}

/// What has come in and gone out for one instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OscStatus {
    /// The port that is listened at.
    pub port: PortStatus,
    /// Whether the project asks for the networks without a permit of this machine, so that only this machine is listened to.
    pub confined: bool,
    /// What has come in for the instance.
    pub counts: Counts,
    /// Seconds since the tracker was heard last, if there is one.
    pub tracker_s: Option<f32>,
    /// Where the pose is sent.
    pub sending: Sending,
    /// Poses that have been sent.
    pub sent: u64,
    /// Remarks on settings that cannot work as they are; usually empty.
    pub note: String,
}
