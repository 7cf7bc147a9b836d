//! Files that a user names: regular ones, and of bounded size.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Opens a regular file: opening a pipe would wait for its writer, and a device may have no end.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    let about = std::fs::metadata(path)?;
    if about.is_file() {
        return File::open(path);
    }
    let found = if about.is_dir() { "a folder" } else { "a pipe, a socket or a device" };
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("expected a regular file, found {found}")))
}

/// The bytes of a regular file of at most `largest` bytes.
pub(crate) fn read_limited(path: &Path, largest: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let too_large = |length| {
        let text = format!("the file has {length} bytes, expected at most {largest}");
        io::Error::new(io::ErrorKind::FileTooLarge, text)
    };
    let length = file.metadata()?.len();
    if length > largest {
        return Err(too_large(length.to_string()));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    // The file may grow meanwhile, and files of the system's own report a length of 0.
    file.take(largest.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest { Err(too_large(format!("more than {largest}"))) } else { Ok(bytes) }
}

/// Writes a file that is whole or not there. A crash may leave half of it under another name, an error nothing.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let partial = path.with_extension("partial");
    let written = std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path));
    if written.is_err() {
        let _nothing_there = std::fs::remove_file(&partial);
    }
    written
}

/// A name that a user gives to a file, without blanks around it, if it is one.
pub(crate) fn file_name_of(name: &str) -> Option<&str> {
    let name = name.trim();
    let is_one = Path::new(name).file_name().and_then(|n| n.to_str()) == Some(name);
    (is_one && !name.starts_with('.') && !name.contains(['\\', ':', '\0'])).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_written_whole_and_an_error_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let [file, taken] = ["a.json", "b.json"].map(|name| folder.path().join(name));
        write_whole(&file, b"all").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"all");
        std::fs::create_dir(&taken).unwrap();
        write_whole(&taken, b"all").unwrap_err();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "half of a file stays");
    }
}
