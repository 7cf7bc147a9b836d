//! Packets that are read from a socket at one go and thinned out.
//!
//! A tracker, or a program gone wild, may send faster than anybody needs. All that has come is read at one go, and of the
//! messages of one sender at one address only the newest is looked at.

use super::{foreign::translated, input::Message, packet};
use std::cell::OnceCell;
use std::collections::HashSet;
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};

/// Largest packet, bytes.
const LARGEST: usize = 65_536;
/// Bytes and packets that are read at one go.
const MOST_BYTES: usize = 1 << 20;
const MOST_PACKETS: usize = 4096;

/// Packets that have been read, one after the other.
pub(super) struct Batch {
    bytes: Box<[u8]>,
    packets: Vec<(SocketAddr, std::ops::Range<usize>)>,
}

/// The messages of a batch that count.
pub(super) struct Thinned<'a> {
    /// The newest message of each sender at each address, in the order in which they came.
    pub(super) messages: Vec<Message<'a>>,
    /// How many messages there were.
    pub(super) count: usize,
    /// Packets that could not be parsed, and why.
    pub(super) garbage: Vec<(SocketAddr, &'static str)>,
}

impl Batch {
    pub(super) fn new() -> Self {
        Self { bytes: vec![0; MOST_BYTES + LARGEST].into_boxed_slice(), packets: Vec::with_capacity(MOST_PACKETS) }
    }

    /// Waits for a packet as long as the socket does, then reads what else is there.
    ///
    /// # Errors
    /// The socket cannot be read from any more.
    pub(super) fn fill(&mut self, socket: &UdpSocket) -> io::Result<()> {
        self.packets.clear();
        let mut used = 0;
        if self.receive(socket, &mut used)? {
            socket.set_nonblocking(true)?;
            let mut more = Ok(true);
            while matches!(more, Ok(true)) && used < MOST_BYTES && self.packets.len() < MOST_PACKETS {
                more = self.receive(socket, &mut used);
            }
            socket.set_nonblocking(false)?;
            more?;
        }
        Ok(())
    }

    /// Reads one packet; returns whether there was one.
    fn receive(&mut self, socket: &UdpSocket, used: &mut usize) -> io::Result<bool> {
        match socket.recv_from(&mut self.bytes[*used..*used + LARGEST]) {
            Ok((mut length, source)) => {
                let space = &mut self.bytes[*used..*used + LARGEST];
                if let Some(message) = translated(&space[..length]) {
                    length = message.len();
                    space[..length].copy_from_slice(&message);
                }
                self.packets.push((source, *used..*used + length));
                *used += length;
                Ok(true)
            }
            // Some systems report here that a packet of another socket was not wanted.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::ConnectionReset | ErrorKind::ConnectionRefused | ErrorKind::Interrupted
                ) =>
            {
                Ok(true)
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(false),
            Err(error) => Err(error),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.packets.is_empty()
    }

    /// The messages that count. What comes after a recentring counts apart from what comes before.
    pub(super) fn thin(&self) -> Thinned<'_> {
        let (mut found, mut garbage) = (Vec::new(), Vec::new());
        for (source, range) in &self.packets {
            let taken =
                packet::messages(&self.bytes[range.clone()], &mut |address, bytes| found.push((*source, address, bytes)));
            if let Err(reason) = taken {
                garbage.push((*source, reason));
            }
        }
        let count = found.len();
        let mut seen = HashSet::new();
        let mut messages = Vec::new();
        for (source, address, bytes) in found.into_iter().rev() {
            if address.ends_with("/recenter") {
                seen.clear();
            }
            if seen.insert((source, address)) {
                messages.push(Message { source, address, bytes, arguments: OnceCell::new() });
            }
        }
        messages.reverse();
        Thinned { messages, count, garbage }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rosc::OscType;
    use std::time::Duration;

    fn sockets() -> (UdpSocket, UdpSocket) {
        let (from, to) = (UdpSocket::bind("127.0.0.1:0").unwrap(), UdpSocket::bind("127.0.0.1:0").unwrap());
        from.connect(to.local_addr().unwrap()).unwrap();
        to.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        (from, to)
    }

    #[test]
    fn the_newest_of_each_address_counts_in_the_order_of_arrival() {
        let (from, to) = sockets();
        for (address, value) in [("/a", 1), ("/b", 2), ("/a", 3), ("/recenter", 4), ("/a", 5), ("/b", 6), ("/a", 7)] {
            from.send(&packet::encoded(address, vec![OscType::Int(value)])).unwrap();
        }
        from.send(b"garbage").unwrap();
        let mut batch = Batch::new();
        batch.fill(&to).unwrap();
        let thinned = batch.thin();
        let found = thinned.messages.iter().map(|m| (m.address, packet::arguments(m.bytes).unwrap())).collect::<Vec<_>>();
        let wanted = [("/b", 2), ("/a", 3), ("/recenter", 4), ("/b", 6), ("/a", 7)].map(|(a, v)| (a, vec![OscType::Int(v)]));
        assert_eq!(found, wanted);
        assert_eq!((thinned.count, thinned.garbage.len()), (7, 1));
    }

    #[test]
    fn the_largest_packets_fit_and_nothing_is_nothing() {
        let (from, to) = sockets();
        let mut batch = Batch::new();
        batch.fill(&to).unwrap();
        assert!(batch.is_empty());
        from.send(&vec![b'/'; 65_507]).unwrap();
        batch.fill(&to).unwrap();
        assert_eq!(batch.thin().garbage.len(), 1);
    }
}
