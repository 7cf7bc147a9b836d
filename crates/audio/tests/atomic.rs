//! Files that are there whole or not at all.

use promenade_audio::atomic::{Draft, write};
use std::fs;
use std::io::Write;

#[test]
fn appears_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("scene.promenade");
    let (draft, mut file) = Draft::create(&target).unwrap();
    file.write_all(b"half").unwrap();
    assert!(!target.exists());
    drop(draft);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "an abandoned draft leaves nothing");
    write(&target, b"one").unwrap();
    write(&target, b"two").unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"two");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn refuses_folders_and_places_that_do_not_exist() {
    let folder = tempfile::tempdir().unwrap();
    assert!(write(folder.path(), b"").unwrap_err().to_string().contains("expected"));
    assert!(write(&folder.path().join("no/such/file"), b"").unwrap_err().to_string().contains("cannot be written"));
}

#[cfg(unix)]
#[test]
fn leftovers_of_ended_processes_are_removed_and_others_stay() {
    let top = tempfile::tempdir().unwrap();
    let path = |name: &str| top.path().join("folder").join(name);
    let names = || {
        let mut names: Vec<_> =
            fs::read_dir(path("")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    fs::create_dir(path("")).unwrap();
    fs::write(path("out.wav.4000000-0.promenade-partial"), b"half").unwrap();
    fs::write(path("download.partial"), b"somebody else's").unwrap();
    let (draft, _) = Draft::create(&path("out.wav")).unwrap();
    let found = names();
    let [download, alive] = &found[..] else { panic!("{found:?}") };
    assert!(download == "download.partial" && !alive.contains("4000000"), "{alive}");
    // The folder by another name is looked through again; the draft's process lives.
    std::os::unix::fs::symlink(path(""), top.path().join("again")).unwrap();
    fs::write(path("out.wav.4000000-1.promenade-partial"), b"half").unwrap();
    write(&top.path().join("again/other"), b"whole").unwrap();
    assert_eq!(names(), [download.as_str(), "other", alive.as_str()]);
    draft.publish().unwrap();
    assert_eq!(names(), ["download.partial", "other", "out.wav"]);
}

#[cfg(unix)]
#[test]
fn a_link_stays_and_its_target_is_written() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("real")).unwrap();
    fs::write(path("real/scene"), b"old").unwrap();
    symlink("real/scene", path("link")).unwrap();
    symlink("link", path("link to link")).unwrap();
    symlink("real/new", path("dangling")).unwrap();
    symlink("circle", path("circle")).unwrap();
    for (link, target) in [("link", "real/scene"), ("link to link", "real/scene"), ("dangling", "real/new")] {
        write(&path(link), link.as_bytes()).unwrap();
        assert!(fs::symlink_metadata(path(link)).unwrap().is_symlink(), "{link}");
        assert_eq!(fs::read(path(target)).unwrap(), link.as_bytes(), "{link}");
    }
    assert!(write(&path("circle"), b"").unwrap_err().to_string().contains("circle"));
}
