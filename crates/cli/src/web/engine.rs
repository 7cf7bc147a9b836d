//! Where the engine for browsers is: it is built for another machine than this program, so it lies beside it.

use anyhow::{Context, Result, bail, ensure};
use promenade_baker::file;
use std::path::{Path, PathBuf};

/// What every WebAssembly module begins with.
const MAGIC: &[u8] = b"\0asm\x01\0\0\0";
/// An engine is about a megabyte.
const MOST_BYTES: u64 = 1 << 26;
/// Its places seen from the folder of this program: in an archive, and in cargo's target folder, whose tests are one folder
/// further down.
const BESIDE: [&str; 3] = ["promenade.wasm", "../web/promenade.wasm", "../../web/promenade.wasm"];

/// The engine of a file, or the one beside this program.
pub(crate) fn read(named: Option<&Path>) -> Result<Vec<u8>> {
    let path = match named {
        Some(path) => path.to_owned(),
        None => beside()?,
    };
    let name = path.display();
    let bytes = file::read(&path, MOST_BYTES).with_context(|| format!("{name}: cannot be read"))?;
    ensure!(bytes.starts_with(MAGIC), "{name}: expected the engine as a WebAssembly module, found something else");
    Ok(bytes)
}

fn beside() -> Result<PathBuf> {
    let program = std::env::current_exe().context("this program does not know where it is")?;
    let folder = program.parent().unwrap_or(Path::new("."));
    let found = BESIDE.iter().map(|place| folder.join(place)).find(|path| path.is_file());
    let Some(found) = found else {
        bail!(
            "the engine for browsers is not beside this program: {} is missing. Archives bring it; in a checkout \
             \"cargo xtask web\" builds it; --engine names one that is elsewhere",
            folder.join(BESIDE[0]).display()
        )
    };
    Ok(found)
}
