//! Regular files, read up to a limit.

use promenade_audio::file::read;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

#[test]
fn files_are_read_up_to_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("four");
    fs::write(&path, b"1234").unwrap();
    assert_eq!(read(&path, 4).unwrap(), b"1234");
    assert_eq!(read(&path, 3).unwrap_err().to_string(), "expected at most 3 bytes, found 4");
    assert_eq!(read(&folder.path().join("none"), 4).unwrap_err().kind(), ErrorKind::NotFound);
    assert_eq!(read(folder.path(), 4).unwrap_err().to_string(), "expected a regular file, found a folder");
}

#[cfg(target_os = "linux")]
#[test]
fn devices_are_refused_and_sizes_are_not_believed() {
    let device = read(Path::new("/dev/zero"), 1 << 20).unwrap_err().to_string();
    assert_eq!(device, "expected a regular file, found a pipe, a socket or a device");
    // Its size is 0.
    let system = Path::new("/proc/self/status");
    assert!(read(system, 1 << 20).unwrap().starts_with(b"Name:"));
    assert_eq!(read(system, 10).unwrap_err().to_string(), "expected at most 10 bytes, found more");
}
