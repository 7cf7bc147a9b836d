//! A small server of HTTP/1.1 with limits: one request a connection, whose size and time a stranger cannot stretch.

use flate2::{Compression, write::GzEncoder};
use promenade_audio::FileError;
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Largest head of a request, bytes.
const MOST_HEAD: u64 = 16 << 10;
/// Most headers.
const MOST_HEADERS: usize = 64;
/// Most connections at a time; others wait. Each has a thread, of which some 50 kB are ever touched.
const MOST_CONNECTIONS: usize = 512;
const STACK: usize = 256 << 10;
/// Most bytes of the bodies of all requests at a time.
const MOST_BODIES: usize = 32 << 20;
/// How long a client may take for a request's head, and for what is sent either way besides a time for its bytes.
const PATIENCE: Duration = Duration::from_secs(20);
/// Bytes a second that a client must keep up with.
const SLOWEST: u64 = 32 << 10;
/// Bytes that are still taken from a client when it has its answer.
const MOST_LEFT: u64 = 4 << 20;

/// A server that listens, and has not begun to answer.
pub struct Listener {
    inner: TcpListener,
    /// Names that a request may have for this machine; any where there are none.
    hosts: Vec<String>,
    /// Bytes of bodies that are being read.
    bodies: AtomicUsize,
}

/// A connection that must end in time.
struct Timed<'a> {
    stream: &'a TcpStream,
    end: Instant,
}

impl Timed<'_> {
    /// Lets it end after so many bytes at the slowest.
    fn allow(&mut self, bytes: u64) {
        self.end = Instant::now() + PATIENCE + Duration::from_secs(bytes / SLOWEST);
    }

    fn left(&self) -> io::Result<Option<Duration>> {
        let left = self.end.saturating_duration_since(Instant::now());
        if left.is_zero() { Err(ErrorKind::TimedOut.into()) } else { Ok(Some(left)) }
    }
}

impl Read for Timed<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.left()?)?;
        self.stream.read(to)
    }
}

impl Write for Timed<'_> {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.left()?)?;
        self.stream.write(from)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// A file's bytes as gzip, of kinds that it makes smaller.
pub fn compressed(name: &str, bytes: &[u8]) -> Option<Vec<u8>> {
    const KINDS: [&str; 9] = ["css", "head", "html", "js", "json", "ply", "promenade", "splat", "wasm"];
    let kind = Path::new(name).extension()?.to_str()?;
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    let packed = KINDS.contains(&kind).then(|| packer.write_all(bytes).and_then(|()| packer.finish()).ok())??;
    // What saves less than a tenth is not worth a second file.
    (packed.len() * 10 < bytes.len() * 9).then_some(packed)
}

/// A request, and its body, which has not been read.
pub struct Request<'a, 's> {
    /// Its method, such as `GET`.
    pub method: String,
    /// What is asked for, without what follows `?` or `#`.
    pub path: String,
    /// Bytes of its body, where it says how many.
    pub length: Option<usize>,
    /// What its body is, without parameters.
    pub kind: String,
    /// The host that it names, without a port, and that of the page that sent it, where it says so.
    host: Option<String>,
    origin: Option<String>,
    expects: bool,
    /// Whether it takes gzip.
    pub gzip: bool,
    bodies: &'a AtomicUsize,
    reader: &'a mut BufReader<Timed<'s>>,
}

/// What an answer holds.
enum Body<'a> {
    Bytes(Cow<'a, [u8]>),
    File(File, u64),
}

/// What is answered.
pub struct Response<'a> {
    status: &'static str,
    kind: &'static str,
    body: Body<'a>,
    gzip: bool,
}

impl<'a> Response<'a> {
    /// A part of memory.
    #[must_use]
    pub fn found(kind: &'static str, body: &'a [u8]) -> Self {
        Self { status: "200 OK", kind, body: Body::Bytes(body.into()), gzip: false }
    }

    /// A file, which is sent as it is read.
    ///
    /// # Errors
    /// The system's.
    pub fn file(kind: &'static str, file: File) -> io::Result<Self> {
        let length = file.metadata()?.len();
        Ok(Self { status: "200 OK", kind, body: Body::File(file, length), gzip: false })
    }

    /// Says that the body is gzip.
    #[must_use]
    pub fn gzipped(self) -> Self {
        Self { gzip: true, ..self }
    }

    /// Plain text.
    #[must_use]
    pub fn text(status: &'static str, text: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", body: Body::Bytes(text.into().into_bytes().into()), gzip: false }
    }

    /// Where nothing is.
    #[must_use]
    pub fn nothing() -> Self {
        Self::text("404 Not Found", "there is no such file\n")
    }
}

impl Listener {
    /// Listens at an address; port 0 is any. On the loopback address requests must name this machine, or one of `hosts`: a page
    /// from elsewhere whose name leads here does not.
    ///
    /// # Errors
    /// An address that cannot be had.
    pub fn bind(address: SocketAddr, hosts: &[String]) -> Result<Self, FileError> {
        let inner = TcpListener::bind(address).map_err(FileError::read(&address.to_string()))?;
        let mut hosts = hosts.to_vec();
        if address.ip().is_loopback() || !hosts.is_empty() {
            hosts.extend(["localhost", "127.0.0.1", "[::1]"].map(str::to_owned));
        }
        Ok(Self { inner, hosts, bodies: AtomicUsize::new(0) })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.inner.local_addr()
    }

    /// Answers until the process ends.
    pub fn run<'a>(&self, answer: impl Fn(&mut Request<'_, '_>) -> Response<'a> + Sync) {
        let (open, closed) = (Mutex::new(0), Condvar::new());
        std::thread::scope(|scope| {
            for stream in self.inner.incoming() {
                // A connection that is gone before it is taken is nobody's loss.
                let Ok(stream) = stream else { continue };
                let mut count = open.lock().unwrap_or_else(PoisonError::into_inner);
                while *count >= MOST_CONNECTIONS {
                    count = closed.wait(count).unwrap_or_else(PoisonError::into_inner);
                }
                *count += 1;
                drop(count);
                let place = Place { open: &open, closed: &closed };
                let answer = &answer;
                let work = move || {
                    self.serve(answer, &stream);
                    drop(place);
                };
                // Without a thread the client is sent away, and its place is free again.
                let _ = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work);
            }
        });
    }

    fn serve<'a>(&self, answer: &impl Fn(&mut Request<'_, '_>) -> Response<'a>, stream: &TcpStream) {
        let timed = || Timed { stream, end: Instant::now() + PATIENCE };
        let mut reader = BufReader::new(timed());
        let (Response { status, kind, body, gzip }, with_body) = match Request::read(&mut reader, &self.bodies) {
            Ok(mut request) => match request.refused(&self.hosts) {
                Some(refusal) => (refusal, true),
                None => (answer(&mut request), request.method != "HEAD"),
            },
            Err(response) => (response, true),
        };
        let length = match &body {
            Body::Bytes(bytes) => bytes.len() as u64,
            Body::File(_, length) => *length,
        };
        let encoding = if gzip { "Content-Encoding: gzip\r\n" } else { "" };
        let head = format!(
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nCache-Control: no-cache\r\n\
             {encoding}Vary: Accept-Encoding\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n"
        );
        let mut writer = timed();
        writer.allow(length);
        // A client that has gone gets no answer.
        let sent = writer.write_all(head.as_bytes()).and_then(|()| match body {
            _ if !with_body => Ok(()),
            Body::Bytes(bytes) => writer.write_all(&bytes),
            Body::File(file, length) => io::copy(&mut file.take(length), &mut writer).map(|_| ()),
        });
        if sent.is_ok() {
            let _ = stream.shutdown(Shutdown::Write);
            // What is still on its way would end the connection before the answer is read.
            let _ = io::copy(&mut reader.take(MOST_LEFT), &mut io::sink());
        }
    }
}

/// One of the connections; gives its place back whatever happens.
struct Place<'a> {
    open: &'a Mutex<usize>,
    closed: &'a Condvar,
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        *self.open.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        self.closed.notify_one();
    }
}

impl<'a, 's> Request<'a, 's> {
    fn read(reader: &'a mut BufReader<Timed<'s>>, bodies: &'a AtomicUsize) -> Result<Self, Response<'static>> {
        let bad = || Response::text("400 Bad Request", "expected a request of HTTP/1.1\n");
        let mut head = Vec::new();
        let mut limited = (&mut *reader).take(MOST_HEAD);
        loop {
            let before = head.len();
            limited.read_until(b'\n', &mut head).map_err(|_| Response::text("408 Request Timeout", "too slow\n"))?;
            if head.ends_with(b"\r\n\r\n") {
                break;
            }
            if head.len() == before || limited.limit() == 0 {
                return Err(bad());
            }
        }
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut parsed = httparse::Request::new(&mut headers);
        parsed.parse(&head).map_err(|_| bad())?;
        let value = |name: &str| {
            let mut found = parsed.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name));
            found.next().map(|h| String::from_utf8_lossy(h.value).trim().to_owned())
        };
        if value("transfer-encoding").is_some() {
            return Err(Response::text("411 Length Required", "expected a length\n"));
        }
        let before = |text: &str, ends: &[char]| text.split(ends).next().unwrap_or_default().trim().to_owned();
        // A colon within brackets is part of an address.
        let name = |host: &str| match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name.to_ascii_lowercase(),
            _ => host.to_ascii_lowercase(),
        };
        Ok(Self {
            length: value("content-length").map(|text| text.parse()).transpose().map_err(|_| bad())?,
            kind: before(&value("content-type").unwrap_or_default(), &[';']),
            expects: value("expect").is_some(),
            gzip: value("accept-encoding").is_some_and(|kinds| kinds.split(',').any(|kind| kind.trim() == "gzip")),
            host: value("host").map(|host| name(&host)),
            origin: value("origin").map(|origin| name(origin.split_once("://").map_or(&*origin, |(_, host)| host))),
            method: parsed.method.ok_or_else(bad)?.to_owned(),
            path: before(parsed.path.ok_or_else(bad)?, &['?', '#']),
            bodies,
            reader,
        })
    }

    /// The answer to a request that names another machine, or comes from a page of one.
    fn refused(&self, hosts: &[String]) -> Option<Response<'static>> {
        let named = |host: &Option<String>| host.as_ref().is_some_and(|host| hosts.contains(host));
        if !hosts.is_empty() && !named(&self.host) {
            let found = self.host.as_deref().unwrap_or("none");
            return Some(Response::text(
                "421 Misdirected Request",
                format!("expected a name of this machine, found {found}\n"),
            ));
        }
        let foreign = self.origin.is_some() && self.origin != self.host && !named(&self.origin);
        foreign.then(|| Response::text("403 Forbidden", "expected a request by a page of this server\n"))
    }

    /// The body, of `most` bytes at most.
    ///
    /// # Errors
    /// The answer to a body without a length, too long or cut short.
    pub fn body(&mut self, most: usize) -> Result<Vec<u8>, Response<'static>> {
        let length = self.length.ok_or_else(|| Response::text("411 Length Required", "expected a length\n"))?;
        if length > most {
            let said = format!("expected at most {most} bytes, found {length}\n");
            return Err(Response::text("413 Content Too Large", said));
        }
        if self.bodies.fetch_add(length, Ordering::Relaxed) + length > MOST_BODIES {
            self.bodies.fetch_sub(length, Ordering::Relaxed);
            return Err(Response::text("503 Service Unavailable", "too much at a time\n"));
        }
        let timed = self.reader.get_mut();
        timed.allow(length as u64);
        if self.expects {
            let _ = timed.write_all(b"HTTP/1.1 100 Continue\r\n\r\n");
        }
        let mut body = Vec::new();
        let read = (&mut *self.reader).take(length as u64).read_to_end(&mut body);
        self.bodies.fetch_sub(length, Ordering::Relaxed);
        match read {
            Ok(read) if read == length => Ok(body),
            _ => Err(Response::text("400 Bad Request", format!("expected {length} bytes, found {}\n", body.len()))),
        }
    }
}
