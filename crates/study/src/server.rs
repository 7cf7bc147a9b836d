//! The small server of a study: shows its site and takes answers. One file can be written, at its end; only files that the site
//! had at the start can be read.

use crate::intake::{Intake, Refusal};
use crate::site::ANSWERS_PATH;
use promenade_audio::FileError;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Largest post, bytes.
const MOST_BODY: usize = 4 << 20;
/// Largest head of a request, bytes.
const MOST_HEAD: u64 = 16 << 10;
/// Most headers.
const MOST_HEADERS: usize = 64;
/// Most connections at a time; others wait.
const MOST_CONNECTIONS: usize = 64;
/// How long a client may be silent.
const PATIENCE: Duration = Duration::from_secs(20);
/// Most files of a site.
const MOST_FILES: usize = 100_000;

/// A server that listens, and has not begun to answer.
pub struct Server {
    listener: TcpListener,
    shared: Arc<Shared>,
}

struct Shared {
    /// Files by their path in addresses.
    files: BTreeMap<String, PathBuf>,
    intake: Intake,
    open: Mutex<usize>,
    closed: Condvar,
}

impl Server {
    /// Listens at an address (port 0 is any) for a site, with a file of answers.
    ///
    /// # Errors
    /// A folder that is no site, a file that cannot be written, an address that cannot be had.
    pub fn new(address: SocketAddr, site: &Path, answers: &Path) -> Result<Self, FileError> {
        let files = files_of(site)?;
        let intake = Intake::open(site, answers)?;
        let of_address = |source| FileError::Read { path: PathBuf::from(address.to_string()), source };
        let listener = TcpListener::bind(address).map_err(of_address)?;
        let shared = Shared { files, intake, open: Mutex::new(0), closed: Condvar::new() };
        Ok(Self { listener, shared: Arc::new(shared) })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> std::io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until the process ends.
    pub fn run(self) {
        for stream in self.listener.incoming() {
            // A connection that is gone before it is taken is nobody's loss.
            let Ok(stream) = stream else { continue };
            {
                let mut open = self.shared.open.lock().unwrap_or_else(PoisonError::into_inner);
                while *open >= MOST_CONNECTIONS {
                    open = self.shared.closed.wait(open).unwrap_or_else(PoisonError::into_inner);
                }
                *open += 1;
            }
            let place = Place(self.shared.clone());
            std::thread::spawn(move || serve(&place.0, stream));
        }
    }
}

/// One of the connections; gives its place back whatever happens.
struct Place(Arc<Shared>);

impl Drop for Place {
    fn drop(&mut self) {
        *self.0.open.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        self.0.closed.notify_one();
    }
}

/// All regular files below a folder, links left out, by their path with slashes.
fn files_of(site: &Path) -> Result<BTreeMap<String, PathBuf>, FileError> {
    let mut files = BTreeMap::new();
    let mut folders = vec![(site.to_owned(), String::new())];
    while let Some((folder, prefix)) = folders.pop() {
        for entry in std::fs::read_dir(&folder).map_err(FileError::read(&folder))? {
            let entry = entry.map_err(FileError::read(&folder))?;
            let kind = entry.file_type().map_err(FileError::read(&folder))?;
            let Ok(name) = entry.file_name().into_string() else { continue };
            let path = format!("{prefix}{name}");
            if kind.is_dir() {
                folders.push((entry.path(), path + "/"));
            } else if kind.is_file() {
                files.insert(path, entry.path());
            }
            if files.len() > MOST_FILES {
                return Err(FileError::Content {
                    path: site.to_owned(),
                    expected: "a site of at most 100000 files".into(),
                    found: "more".into(),
                });
            }
        }
    }
    Ok(files)
}

/// What is answered.
struct Response {
    status: &'static str,
    kind: &'static str,
    body: Vec<u8>,
}

impl Response {
    fn text(status: &'static str, text: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", body: text.into().into_bytes() }
    }
}

fn serve(shared: &Shared, stream: TcpStream) {
    let ready = stream.set_read_timeout(Some(PATIENCE)).and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
    if ready.is_err() {
        return;
    }
    let mut reader = BufReader::new(&stream);
    let (response, with_body) = match Request::read(&mut reader) {
        Ok(request) => (answer(shared, &request, &mut reader), request.method != "HEAD"),
        Err(response) => (response, true),
    };
    let Response { status, kind, body } = response;
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-cache\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    );
    let mut writer = &stream;
    // A client that has gone gets no answer.
    let sent = writer.write_all(head.as_bytes()).and_then(|()| if with_body { writer.write_all(&body) } else { Ok(()) });
    if sent.is_ok() {
        let _ = stream.shutdown(std::net::Shutdown::Write);
        // What is still on its way would end the connection before the answer is read.
        let _ = std::io::copy(&mut reader.take(MOST_BODY as u64), &mut std::io::sink());
    }
}

struct Request {
    method: String,
    path: String,
    length: Option<usize>,
    kind: String,
    expects: bool,
}

impl Request {
    fn read(reader: &mut BufReader<&TcpStream>) -> Result<Self, Response> {
        let bad = || Response::text("400 Bad Request", "expected a request of HTTP/1.1\n");
        let mut head = Vec::new();
        let mut limited = reader.take(MOST_HEAD);
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
        let length = value("content-length").map(|text| text.parse()).transpose().map_err(|_| bad())?;
        Ok(Self {
            length,
            kind: value("content-type").unwrap_or_default(),
            expects: value("expect").is_some(),
            method: parsed.method.ok_or_else(bad)?.to_owned(),
            path: parsed.path.ok_or_else(bad)?.to_owned(),
        })
    }
}

fn answer(shared: &Shared, request: &Request, reader: &mut BufReader<&TcpStream>) -> Response {
    let path = request.path.split(['?', '#']).next().unwrap_or_default();
    let Some(name) = path.strip_prefix('/') else {
        return Response::text("400 Bad Request", "expected a path\n");
    };
    match &*request.method {
        "GET" | "HEAD" => {
            let name = if name.is_empty() { "index.html" } else { name };
            // Names of a site need no percents, and paths beyond it have no name here.
            let Some(file) = shared.files.get(name) else { return Response::text("404 Not Found", "there is no such file\n") };
            match std::fs::read(file) {
                Ok(body) => Response { status: "200 OK", kind: promenade_web::media_type(name), body },
                Err(_) => Response::text("404 Not Found", "there is no such file\n"),
            }
        }
        "POST" if name == ANSWERS_PATH => take(shared, request, reader),
        "POST" => Response::text("404 Not Found", "answers go to /answers\n"),
        _ => Response::text("405 Method Not Allowed", "expected GET, or POST to /answers\n"),
    }
}

fn take(shared: &Shared, request: &Request, reader: &mut BufReader<&TcpStream>) -> Response {
    let Some(length) = request.length else { return Response::text("411 Length Required", "expected a length\n") };
    if length > MOST_BODY {
        return Response::text("413 Content Too Large", format!("expected at most {MOST_BODY} bytes, found {length}\n"));
    }
    // Pages of other sites cannot send this kind unasked.
    if request.kind.split(';').next().map(str::trim) != Some("application/json") {
        return Response::text("415 Unsupported Media Type", "expected application/json\n");
    }
    if request.expects {
        let mut writer = *reader.get_ref();
        let _ = writer.write_all(b"HTTP/1.1 100 Continue\r\n\r\n");
    }
    let mut body = Vec::new();
    match reader.take(length as u64).read_to_end(&mut body) {
        Ok(read) if read == length => {}
        _ => return Response::text("400 Bad Request", format!("expected {length} bytes, found {}\n", body.len())),
    }
    match shared.intake.take(&body) {
        Ok(rows) => Response::text("200 OK", format!("{rows} rows\n")),
        Err(Refusal::Broken(why)) => Response::text("422 Unprocessable Content", format!("{why}\n")),
        Err(Refusal::Unwritten(why)) => Response::text("507 Insufficient Storage", format!("{why}\n")),
    }
}
