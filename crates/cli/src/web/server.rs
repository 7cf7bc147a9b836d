//! A page on the loopback address: what the site holds, and nothing else of this machine.

use super::site::Site;
use crate::report;
use anyhow::Result;
use promenade_study::http::{Listener, Request, Response};
use std::net::{Ipv4Addr, SocketAddr};

/// Serves until the process is ended.
pub(crate) fn serve(site: &Site, port: u16) -> Result<()> {
    let listener = Listener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port)), &[])?;
    report::print(&format!("http://localhost:{}/\n", listener.address()?.port()))?;
    listener.run(|request| answer(site, request));
    Ok(())
}

/// Answers one request.
fn answer<'a>(site: &'a Site, request: &Request<'_, '_>) -> Response<'a> {
    let name = match request.path.trim_start_matches('/') {
        "" => "index.html",
        name => name,
    };
    let known = matches!(&*request.method, "GET" | "HEAD");
    let found = |file: &str| Some(Response::found(promenade_web::media_type(name), site.files().get(file).filter(|_| known)?));
    let packed = if request.gzip { found(&format!("{name}.gz")) } else { None };
    packed.map(Response::gzipped).or_else(|| found(name)).unwrap_or_else(Response::nothing)
}
