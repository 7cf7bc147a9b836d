//! A small server of HTTP/1.1 with limits: one request a connection, whose size and time a stranger cannot stretch.

use promenade_audio::FileError;
use std::borrow::Cow;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Largest head of a request, bytes.
const MOST_HEAD: u64 = 16 << 10;
/// Most headers.
const MOST_HEADERS: usize = 64;
/// Most connections at a time; others wait.
const MOST_CONNECTIONS: usize = 64;
/// How long a client may be silent.
const PATIENCE: Duration = Duration::from_secs(20);
/// Bytes that are still taken from a client when it has its answer.
const MOST_LEFT: u64 = 4 << 20;

/// A server that listens, and has not begun to answer.
pub struct Listener(TcpListener);

/// A request, and its body, which has not been read.
pub struct Request<'a> {
    /// Its method, such as `GET`.
    pub method: String,
    /// What is asked for, without what follows `?` or `#`.
    pub path: String,
    /// The host that it names, without a port.
    pub host: Option<String>,
    /// Bytes of its body, where it says how many.
    pub length: Option<usize>,
    /// What its body is, without parameters.
    pub kind: String,
    expects: bool,
    stream: &'a TcpStream,
    reader: &'a mut dyn BufRead,
}

/// What is answered.
pub struct Response<'a> {
    status: &'static str,
    kind: &'static str,
    body: Cow<'a, [u8]>,
}

impl<'a> Response<'a> {
    /// A file or a part of memory.
    #[must_use]
    pub fn found(kind: &'static str, body: impl Into<Cow<'a, [u8]>>) -> Self {
        Self { status: "200 OK", kind, body: body.into() }
    }

    /// Plain text.
    #[must_use]
    pub fn text(status: &'static str, text: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", body: text.into().into_bytes().into() }
    }

    /// Where nothing is.
    #[must_use]
    pub fn nothing() -> Self {
        Self::text("404 Not Found", "there is no such file\n")
    }
}

impl Listener {
    /// Listens at an address; port 0 is any.
    ///
    /// # Errors
    /// An address that cannot be had.
    pub fn bind(address: SocketAddr) -> Result<Self, FileError> {
        TcpListener::bind(address).map(Self).map_err(FileError::read(&address.to_string()))
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> std::io::Result<SocketAddr> {
        self.0.local_addr()
    }

    /// Answers until the process ends.
    pub fn run<'a>(&self, answer: impl Fn(&mut Request<'_>) -> Response<'a> + Sync) {
        let (open, closed) = (Mutex::new(0), Condvar::new());
        std::thread::scope(|scope| {
            for stream in self.0.incoming() {
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
                scope.spawn(move || {
                    serve(answer, &stream);
                    drop(place);
                });
            }
        });
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

fn serve<'a>(answer: &impl Fn(&mut Request<'_>) -> Response<'a>, stream: &TcpStream) {
    let ready = stream.set_read_timeout(Some(PATIENCE)).and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
    if ready.is_err() {
        return;
    }
    let mut reader = BufReader::new(stream);
    let (Response { status, kind, body }, with_body) = match Request::read(stream, &mut reader) {
        Ok(mut request) => (answer(&mut request), request.method != "HEAD"),
        Err(response) => (response, true),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-cache\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    );
    let mut writer = stream;
    // A client that has gone gets no answer.
    let sent = writer.write_all(head.as_bytes()).and_then(|()| if with_body { writer.write_all(&body) } else { Ok(()) });
    if sent.is_ok() {
        let _ = stream.shutdown(Shutdown::Write);
        // What is still on its way would end the connection before the answer is read.
        let _ = std::io::copy(&mut reader.take(MOST_LEFT), &mut std::io::sink());
    }
}

impl<'a> Request<'a> {
    fn read(stream: &'a TcpStream, reader: &'a mut dyn BufRead) -> Result<Self, Response<'static>> {
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
        Ok(Self {
            length: value("content-length").map(|text| text.parse()).transpose().map_err(|_| bad())?,
            kind: before(&value("content-type").unwrap_or_default(), &[';']),
            expects: value("expect").is_some(),
            host: value("host").map(|host| host.rsplit_once(':').map_or(&*host, |(name, _)| name).to_owned()),
            method: parsed.method.ok_or_else(bad)?.to_owned(),
            path: before(parsed.path.ok_or_else(bad)?, &['?', '#']),
            stream,
            reader,
        })
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
        if self.expects {
            let mut writer = self.stream;
            let _ = writer.write_all(b"HTTP/1.1 100 Continue\r\n\r\n");
        }
        let mut body = Vec::new();
        match (&mut *self.reader).take(length as u64).read_to_end(&mut body) {
            Ok(read) if read == length => Ok(body),
            _ => Err(Response::text("400 Bad Request", format!("expected {length} bytes, found {}\n", body.len()))),
        }
    }
}
