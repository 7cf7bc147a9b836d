//! Sockets: one per port and process, shared by all instances that listen there, with a thread of its own.

use super::status::{Listening, PortStatus};
use super::{batch::Batch, input::OscInput};
use crate::project::osc_config::Interface;
use crate::worker::lock::lock;
use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// A thread checks this often whether it is still needed.
const WAIT: Duration = Duration::from_millis(100);
/// A port that cannot be opened is tried again this often.
const RETRY: Duration = Duration::from_secs(1);
/// Time over which messages a second are counted.
const COUNTED: Duration = Duration::from_millis(500);

/// All that are open in this process.
static PORTS: Mutex<Vec<Open>> = Mutex::new(Vec::new());

/// A port and its thread.
struct Open {
    port: Arc<Port>,
    thread: JoinHandle<()>,
}

/// What instances share that listen at the same port.
pub(super) struct Port {
    number: u16,
    ends: AtomicBool,
    receivers: Mutex<Vec<(Interface, Arc<OscInput>)>>,
    state: Mutex<PortStatus>,
}

/// An instance's subscription to a port; the socket is closed with the last one.
pub(super) struct Subscription {
    port: Arc<Port>,
    receiver: Arc<OscInput>,
}

impl Subscription {
    /// Subscribes to a port, which is opened if it is not.
    ///
    /// The socket is as wide as the widest that is asked for; the receiver of an instance for this machine only ignores
    /// the rest.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn new(number: u16, interface: Interface, receiver: Arc<OscInput>) -> io::Result<Self> {
        let mut ports = lock(&PORTS);
        let port = match ports.iter().find(|open| open.port.number == number) {
            Some(open) => {
                lock(&open.port.receivers).push((interface, Arc::clone(&receiver)));
                open.thread.thread().unpark();
                Arc::clone(&open.port)
            }
            None => {
                let port = Arc::new(Port {
                    number,
                    ends: AtomicBool::new(false),
                    receivers: Mutex::new(vec![(interface, Arc::clone(&receiver))]),
                    state: Mutex::new(PortStatus { listening: Listening::Opening, ..PortStatus::default() }),
                });
                let of_thread = Arc::clone(&port);
                let thread = thread::Builder::new().name(format!("promenade-osc-{number}")).spawn(move || of_thread.run())?;
                ports.push(Open { port: Arc::clone(&port), thread });
                port
            }
        };
        Ok(Self { port, receiver })
    }

    /// The state of the port, for the editor.
    pub(super) fn state(&self) -> PortStatus {
        lock(&self.port.state).clone()
    }
}

impl Drop for Subscription {
    fn drop(&mut self) {
        let mut ports = lock(&PORTS);
        let mut receivers = lock(&self.port.receivers);
        if let Some(index) = receivers.iter().position(|(_, receiver)| Arc::ptr_eq(receiver, &self.receiver)) {
            receivers.swap_remove(index);
        }
        let last = receivers.is_empty();
        drop(receivers);
        let Some(index) = ports.iter().position(|open| Arc::ptr_eq(&open.port, &self.port)) else { return };
        if last {
            let open = ports.swap_remove(index);
            open.port.ends.store(true, Ordering::Release);
            open.thread.thread().unpark();
            // The port is free again before anybody can ask for it. A panic of the thread has been reported where it happened.
            drop(open.thread.join());
        } else {
            ports[index].thread.thread().unpark();
        }
    }
}

impl Port {
    fn run(&self) {
        let mut batch = Batch::new();
        let mut socket: Option<(Interface, UdpSocket)> = None;
        let (mut since, mut before) = (Instant::now(), 0);
        while !self.ends.load(Ordering::Acquire) {
            let wanted = self.widest();
            if socket.as_ref().is_none_or(|(bound, _)| *bound != wanted) {
                // Closed first: the system does not give a port twice.
                drop(socket.take());
                match bind(wanted, self.number) {
                    Ok(bound) => {
                        let at = bound.local_addr().unwrap_or_else(|_| SocketAddr::new(wanted.address(), self.number));
                        lock(&self.state).listening = Listening::At(at);
                        socket = Some((wanted, bound));
                    }
                    Err(error) => {
                        lock(&self.state).listening = Listening::Failed(message(self.number, &error));
                        thread::park_timeout(RETRY);
                        continue;
                    }
                }
            }
            if let Some((_, bound)) = &socket
                && let Err(error) = batch.fill(bound)
            {
                lock(&self.state).listening = Listening::Failed(message(self.number, &error));
                socket = None;
                thread::park_timeout(RETRY);
            }
            if !batch.is_empty() {
                self.deliver(&batch);
            }
            let past = since.elapsed();
            if past >= COUNTED {
                let mut state = lock(&self.state);
                state.messages_per_s = (state.messages - before) as f32 / past.as_secs_f32();
                (since, before) = (Instant::now(), state.messages);
            }
        }
    }

    /// The widest interface that is asked for.
    fn widest(&self) -> Interface {
        let any = lock(&self.receivers).iter().any(|(interface, _)| *interface == Interface::Any);
        if any { Interface::Any } else { Interface::Loopback }
    }

    fn deliver(&self, batch: &Batch) {
        let thinned = batch.thin();
        let mut state = lock(&self.state);
        state.messages += thinned.count as u64;
        if let Some(last) = thinned.messages.last().filter(|last| last.address != state.last_address) {
            state.last_address = last.address.to_owned();
        }
        drop(state);
        let receivers = lock(&self.receivers).clone();
        for (_, receiver) in &receivers {
            for (source, reason) in &thinned.garbage {
                receiver.reject(*source, reason);
            }
            for message in &thinned.messages {
                receiver.take(message);
            }
            receiver.commit();
        }
    }
}

impl Interface {
    /// The address that is listened at.
    fn address(self) -> IpAddr {
        IpAddr::V4(match self {
            Self::Loopback => Ipv4Addr::LOCALHOST,
            Self::Any => Ipv4Addr::UNSPECIFIED,
        })
    }
}

fn bind(interface: Interface, port: u16) -> io::Result<UdpSocket> {
    if port == 0 {
        return Err(io::Error::new(ErrorKind::InvalidInput, "a port is a number from 1 to 65535"));
    }
    let socket = UdpSocket::bind((interface.address(), port))?;
    socket.set_read_timeout(Some(WAIT))?;
    Ok(socket)
}

/// An error as a message for the user.
fn message(port: u16, error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::AddrInUse => format!("port {port} is in use by another program"),
        ErrorKind::PermissionDenied => format!("the system does not allow port {port}"),
        _ => format!("port {port}: {error}"),
    }
}

/// Ports that are open in this process.
#[cfg(test)]
pub(super) fn numbers() -> Vec<u16> {
    lock(&PORTS).iter().map(|open| open.port.number).collect()
}
