//! The listener's pose, sent to another instance or to a program that draws it.

use super::{address, packet};
use super::{input::OscInput, status::Sending};
use crate::project::adm_config::AdmConfig;
use crate::project::osc_config::{OscConfig, OscOut};
use crate::telemetry::Telemetry;
use crate::worker::{RESOLVER, SENDER, Task, TaskHandle, lock::lock};
use promenade_core::Pose;
use rosc::OscType;
use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

/// A pose that does not change is sent this often.
const REPEAT: Duration = Duration::from_secs(1);
/// A host name that cannot be looked up is looked up again this often.
const RETRY: Duration = Duration::from_secs(5);

/// One instance's poses on their way out. They stop with it.
pub(super) struct Outlet {
    feed: Arc<Feed>,
    _sending: TaskHandle,
}

/// What the sending thread holds of an instance.
struct Feed {
    telemetry: Arc<Telemetry>,
    receiver: Arc<OscInput>,
    out: OscOut,
    adm: AdmConfig,
    address: String,
    route: Mutex<Route>,
    sent: AtomicU64,
}

struct Route {
    state: Sending,
    socket: Option<UdpSocket>,
    due: Instant,
    last: Option<(Vec<u8>, Instant)>,
    /// What looks names up, if there is a name to look up.
    resolver: Option<TaskHandle>,
    asked: Instant,
    /// Whether the instance is gone, so that a late answer is ignored.
    gone: bool,
}

impl Outlet {
    /// Sends the pose of `telemetry` as `config` sets it up.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn new(config: &OscConfig, telemetry: Arc<Telemetry>, receiver: Arc<OscInput>) -> io::Result<Self> {
        let now = Instant::now();
        let route =
            Route { state: Sending::Resolving, socket: None, due: now, last: None, resolver: None, asked: now, gone: false };
        let feed = Arc::new(Feed {
            telemetry,
            receiver,
            out: config.out.clone(),
            adm: config.adm,
            address: address::of_pose(&config.address_name()),
            route: Mutex::new(route),
            sent: AtomicU64::new(0),
        });
        match literal(&config.out.host) {
            _ if config.out.port == 0 => feed.connect(Err("a port is a number from 1 to 65535".to_owned())),
            _ if config.out.host.trim().is_empty() => feed.connect(Err("no host to send to".to_owned())),
            Some(ip) => feed.connect(Ok(SocketAddr::new(ip, config.out.port))),
            None => {
                let lookup = RESOLVER.add(Arc::new(Lookup(Arc::downgrade(&feed))))?;
                lookup.schedule();
                lock(&feed.route).resolver = Some(lookup);
            }
        }
        let sending = SENDER.add(feed.clone())?;
        sending.schedule();
        Ok(Self { feed, _sending: sending })
    }

    /// Where poses go to, and how many have gone.
    pub(super) fn report(&self) -> (Sending, u64) {
        (lock(&self.feed.route).state.clone(), self.feed.sent.load(Ordering::Relaxed))
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        let mut route = lock(&self.feed.route);
        route.gone = true;
        self.feed.receiver.set_own_address(None);
        let resolver = route.resolver.take();
        drop(route);
        // Without the lock: on some systems the resolver is waited for.
        drop(resolver);
    }
}

/// An address that needs no looking up.
fn literal(host: &str) -> Option<IpAddr> {
    let host = host.trim();
    if host.eq_ignore_ascii_case("localhost") { Some(IpAddr::V4(Ipv4Addr::LOCALHOST)) } else { host.parse().ok() }
}

/// Looks up a feed's host name, on the resolver's thread.
struct Lookup(Weak<Feed>);

impl Task for Lookup {
    fn run(&self) -> Option<Instant> {
        // The feed is not held while the name is looked up, so that its instance can go.
        let (host, port) = self.0.upgrade().map(|feed| (feed.out.host.trim().to_owned(), feed.out.port))?;
        let found = (host.as_str(), port).to_socket_addrs().map(|mut all| {
            let first = all.next();
            // Most programs listen at the older kind of address only.
            all.chain(first).max_by_key(SocketAddr::is_ipv4)
        });
        let target = match found {
            Ok(Some(target)) => Ok(target),
            Ok(None) => Err(format!("{host} has no address")),
            Err(error) => Err(format!("{host} cannot be found: {error}")),
        };
        if let Some(feed) = self.0.upgrade() {
            feed.connect(target);
        }
        None
    }
}

impl Feed {
    /// Sends to a target from now on, or reports why not.
    fn connect(&self, target: Result<SocketAddr, String>) {
        let connected = target.and_then(|target| {
            let any = if target.is_ipv4() { IpAddr::V4(Ipv4Addr::UNSPECIFIED) } else { IpAddr::V6(Ipv6Addr::UNSPECIFIED) };
            let open = || {
                let socket = UdpSocket::bind((any, 0))?;
                socket.connect(target)?;
                socket.set_nonblocking(true)?;
                let own = socket.local_addr()?;
                Ok((socket, own))
            };
            open().map(|(socket, own)| (socket, own, target)).map_err(|error: io::Error| format!("{target}: {error}"))
        });
        let mut route = lock(&self.route);
        if route.gone {
            return;
        }
        match connected {
            Ok((socket, own, target)) => {
                self.receiver.set_own_address(Some(own));
                (route.socket, route.state) = (Some(socket), Sending::To(target));
            }
            Err(reason) => (route.socket, route.state) = (None, Sending::Failed(reason)),
        }
    }

    /// Sends the pose. Returns when the next is due.
    fn send(&self, now: Instant) -> Instant {
        let mut route = lock(&self.route);
        let interval = self.out.interval();
        route.due = (route.due + interval).max(now + interval / 2);
        let Some(socket) = &route.socket else {
            if now.saturating_duration_since(route.asked) >= RETRY
                && let Some(resolver) = &route.resolver
            {
                resolver.schedule();
                route.asked = now;
            }
            return route.due;
        };
        let Some((_, pose)) = self.telemetry.pose.read() else { return route.due };
        let packet = if self.out.adm { self.receiver.adm_packet(self.adm, &pose) } else { packet(&self.address, &pose) };
        let old = |at: &Instant| now.saturating_duration_since(*at) >= REPEAT;
        let fresh = route.last.as_ref().is_none_or(|(last, at)| *last != packet || old(at));
        if fresh {
            // Where nobody listened to the packet before, the system reports that instead of sending this one.
            let sent = socket.send(&packet).or_else(|error| if nobody(&error) { socket.send(&packet) } else { Err(error) });
            route.state = match (sent, socket.peer_addr()) {
                (Ok(_), Ok(target)) => {
                    self.sent.fetch_add(1, Ordering::Relaxed);
                    Sending::To(target)
                }
                (Err(error), Ok(target)) if nobody(&error) || error.kind() == ErrorKind::WouldBlock => Sending::To(target),
                (Err(error), _) | (_, Err(error)) => Sending::Failed(error.to_string()),
            };
            route.last = Some((packet, now));
        }
        route.due
    }
}

impl Task for Feed {
    fn run(&self) -> Option<Instant> {
        Some(self.send(Instant::now()))
    }
}

/// Whether an error means that nobody listens.
fn nobody(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset)
}

/// A pose as a packet.
fn packet(address: &str, pose: &Pose) -> Vec<u8> {
    let [x, y, z] = pose.position.to_array();
    let [qx, qy, qz, qw] = pose.orientation.to_array();
    let args = [x, y, z, qw, qx, qy, qz].map(OscType::Float).to_vec();
    packet::encoded(address, args)
}
