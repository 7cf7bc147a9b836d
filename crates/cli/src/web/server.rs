//! A page on the loopback address: what the site holds, and nothing else of this machine.

use super::site::Site;
use crate::report;
use anyhow::{Result, anyhow};
use std::net::{Ipv4Addr, SocketAddr};
use tiny_http::{Header, Method, Request, Response, Server};

/// Threads that answer: a browser asks for several files at once.
const THREADS: usize = 4;

/// Serves until the process is ended.
pub(crate) fn serve(site: &Site, port: u16) -> Result<()> {
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
    let server = Server::http(address).map_err(|e| anyhow!("{address} cannot be listened at: {e}"))?;
    report::print(&format!("http://localhost:{}/\n", server.server_addr().to_ip().map_or(port, |a| a.port())))?;
    std::thread::scope(|threads| {
        for _ in 0..THREADS {
            threads.spawn(|| server.incoming_requests().for_each(|request| answer(site, request)));
        }
    });
    Ok(())
}

/// Answers one request. A reader that has gone away is no failure.
fn answer(site: &Site, request: Request) {
    let asked = request.url().split(['?', '#']).next().unwrap_or_default();
    let name = match asked.trim_start_matches('/') {
        "" => "index.html",
        name => name,
    };
    let known = matches!(request.method(), Method::Get | Method::Head);
    let found = site.files().get(name).filter(|_| known && is_local(&request));
    let _ = match found {
        Some(bytes) => {
            let headers = [("Content-Type", promenade_web::media_type(name)), ("Cache-Control", "no-cache")];
            let headers = headers.into_iter().filter_map(|(name, value)| Header::from_bytes(name, value).ok());
            request.respond(headers.fold(Response::from_data(bytes.as_slice()), Response::with_header))
        }
        None => request.respond(Response::from_string("there is no such file").with_status_code(404)),
    };
}

/// Whether the request names this machine: a page from elsewhere whose name leads here does not.
fn is_local(request: &Request) -> bool {
    let host = request.headers().iter().find(|header| header.field.equiv("Host")).map(|header| header.value.as_str());
    let name = host.map(|host| host.rsplit_once(':').map_or(host, |(name, _)| name));
    matches!(name, Some("localhost" | "127.0.0.1"))
}
