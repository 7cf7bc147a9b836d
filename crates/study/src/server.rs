//! The small server of a study: shows its site and takes answers. One file can be written, at its end; only files that the site
//! had at the start can be read.

use crate::http::{Listener, Request, Response};
use crate::intake::{Intake, Refusal};
use crate::site::ANSWERS_PATH;
use promenade_audio::FileError;
use std::collections::BTreeMap;
use std::fs::File;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Largest post, bytes.
const MOST_BODY: usize = 4 << 20;
/// Most files of a site.
const MOST_FILES: usize = 100_000;

/// A server that listens, and has not begun to answer: made by `promenade study serve`, whose main thread runs it.
pub struct Server {
    listener: Listener,
    /// Files by their path in addresses, without links on their ways.
    files: BTreeMap<String, PathBuf>,
    intake: Intake,
}

impl Server {
    /// Listens at an address (port 0 is any) for a site, with a file of answers, which is never shown. `hosts` are names of
    /// this machine beside its own ones.
    ///
    /// # Errors
    /// A folder that is no site, a file that cannot be written, an address that cannot be had.
    pub fn new(address: SocketAddr, hosts: &[String], site: &Path, answers: &Path) -> Result<Self, FileError> {
        let intake = Intake::open(site, answers)?;
        let answers = answers.canonicalize().map_err(FileError::read(answers))?;
        let mut files = files_of(site)?;
        files.retain(|_, file| *file != answers);
        Ok(Self { files, intake, listener: Listener::bind(address, hosts)? })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> std::io::Result<SocketAddr> {
        self.listener.address()
    }

    /// Answers until the process ends.
    pub fn run(self) {
        self.listener.run(|request| self.answer(request));
    }

    fn answer(&self, request: &mut Request<'_, '_>) -> Response<'static> {
        let Some(name) = request.path.strip_prefix('/') else {
            return Response::text("400 Bad Request", "expected a path\n");
        };
        match &*request.method {
            "GET" | "HEAD" => {
                let name = if name.is_empty() { "index.html" } else { name };
                // Names of a site need no percents, and paths beyond it have no name here.
                let found = |file: &str| {
                    let path = self.files.get(file)?;
                    // A file that was exchanged for a link leads elsewhere.
                    let file = File::open(path).ok().filter(|_| path.canonicalize().is_ok_and(|real| real == *path))?;
                    Response::file(promenade_web::media_type(name), file).ok()
                };
                let packed = if request.gzip && self.files.contains_key(name) { found(&format!("{name}.gz")) } else { None };
                packed.map(Response::gzipped).or_else(|| found(name)).unwrap_or_else(Response::nothing)
            }
            "POST" if name == ANSWERS_PATH => self.take(request).unwrap_or_else(|refused| refused),
            "POST" => Response::text("404 Not Found", "answers go to /answers\n"),
            _ => Response::text("405 Method Not Allowed", "expected GET, or POST to /answers\n"),
        }
    }

    fn take(&self, request: &mut Request<'_, '_>) -> Result<Response<'static>, Response<'static>> {
        // Pages of other sites cannot send this kind unasked.
        if request.length.is_some_and(|length| length <= MOST_BODY) && request.kind != "application/json" {
            return Err(Response::text("415 Unsupported Media Type", "expected application/json\n"));
        }
        let body = request.body(MOST_BODY)?;
        Ok(match self.intake.take(&body) {
            Ok(rows) => Response::text("200 OK", format!("{rows} rows\n")),
            Err(Refusal::Broken(why)) => Response::text("422 Unprocessable Content", format!("{why}\n")),
            Err(Refusal::Unwritten(why)) => Response::text("507 Insufficient Storage", format!("{why}\n")),
        })
    }
}

/// All regular files below a folder, links left out, by their path with slashes.
fn files_of(site: &Path) -> Result<BTreeMap<String, PathBuf>, FileError> {
    let mut files = BTreeMap::new();
    let mut folders = vec![(site.canonicalize().map_err(FileError::read(site))?, String::new())];
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
                return Err(FileError::content(site, format!("a site of at most {MOST_FILES} files"), "more"));
            }
        }
    }
    Ok(files)
}
