use super::*;
use crate::library::factory;
use promenade_fault::with_causes;
use std::fs;
use std::sync::mpsc::channel;
use std::time::Duration;
use tempfile::TempDir;

/// A folder with files, and its path.
fn folder(files: &[(&str, &[u8])]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
    let path = folder.path().to_owned();
    (folder, path)
}

fn key(path: PathBuf, bytes: &[u8]) -> SceneKey {
    SceneKey { hash: cache::content_hash(bytes), absolute: path, ..SceneKey::default() }
}

#[test]
fn files_are_those_of_a_kind_by_name() {
    let (_keep, path) = folder(&[("b.promenade", b"b"), ("a.promenade", b"a"), ("c.txt", b"c")]);
    assert_eq!(files(std::slice::from_ref(&path), SCENES), ["a.promenade", "b.promenade"].map(|name| path.join(name)));
}

#[test]
fn a_moved_and_renamed_scene_is_found_by_its_content() {
    let _alone = cache::alone();
    let bytes = factory::ROOM_A.bytes;
    let (_keep, path) = folder(&[("a.promenade", factory::ROOM_B.bytes), ("renamed.promenade", bytes)]);
    let found = scene_of(&[path], &key("/nowhere/hall.promenade".into(), bytes)).unwrap();
    assert!(found.note.is_empty(), "{}", found.note);
    assert!(found.key.absolute.ends_with("renamed.promenade"));
}

#[test]
fn a_changed_scene_is_played_and_reported_and_the_old_one_still_asked_for() {
    let _alone = cache::alone();
    let (_keep, path) = folder(&[("hall.promenade", factory::ROOM_A.bytes)]);
    let wanted = key(path.join("hall.promenade"), b"the scene of yore");
    let found = scene_of(&[], &wanted).unwrap();
    assert!(found.note.contains("has changed"), "{}", found.note);
    assert_eq!(found.key, wanted);
}

#[test]
fn the_right_content_wins_over_the_right_name() {
    let _alone = cache::alone();
    let bytes = factory::ROOM_A.bytes;
    let (_keep, path) = folder(&[("hall.promenade", b"something else"), ("other.promenade", bytes)]);
    let found = scene_of(std::slice::from_ref(&path), &key(path.join("hall.promenade"), bytes)).unwrap();
    assert!(found.key.absolute.ends_with("other.promenade"));
}

#[test]
fn what_is_nowhere_is_missing() {
    let wanted = key("/nowhere/hall.promenade".into(), b"gone");
    let Err(LoadError::Fault(missing)) = scene_of(&[], &wanted) else { panic!("it is there") };
    assert!(missing.to_string().contains("is missing"), "{missing}");
    assert!(matches!(scene_of(&[], &SceneKey::default()), Err(LoadError::NoneChosen(_))));
}

/// What `work` returns, if it does within ten seconds.
pub(crate) fn in_time<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, result) = channel();
    std::thread::spawn(move || done.send(work()));
    result.recv_timeout(Duration::from_secs(10)).expect("it hangs")
}

/// Makes a named pipe, which nobody writes to.
#[cfg(unix)]
pub(crate) fn make_pipe(path: &Path) {
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[cfg(unix)]
#[test]
fn a_pipe_is_no_scene_and_a_file_of_the_same_content_is_found() {
    let _alone = cache::alone();
    let bytes = factory::ROOM_A.bytes;
    let (_keep, path) = folder(&[("other.promenade", bytes)]);
    let pipe = path.join("hall.promenade");
    make_pipe(&pipe);
    let (wanted, folders) = (key(pipe.clone(), bytes), [path]);
    let found = in_time(move || scene_of(&folders, &wanted)).unwrap();
    assert!(found.key.absolute.ends_with("other.promenade"));
    let wanted = SceneKey { absolute: pipe, ..SceneKey::default() };
    let error = with_causes(&in_time(move || scene_of(&[], &wanted)).err().unwrap());
    let clue = "hall.promenade: cannot be read: expected a regular file, found a pipe, a socket or a device";
    assert!(error.ends_with(clue), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn bytes_are_counted_while_they_are_read() {
    // Its length is reported as 0.
    let system = Path::new("/proc/self/status");
    assert!(read_limited(system, 1 << 20).unwrap().starts_with(b"Name:"));
    let error = read_limited(system, 10).unwrap_err().to_string();
    assert_eq!(error, "the file has more than 10 bytes, expected at most 10");
    let error = read_limited(Path::new("/dev/zero"), 10).unwrap_err().to_string();
    assert!(error.starts_with("expected a regular file"), "{error}");
    let error = with_causes(&read(Path::new("/")).unwrap_err());
    assert_eq!(error, "/: cannot be read: expected a regular file, found a folder");
}

#[test]
fn a_saved_scene_is_listed_and_no_other_is_written_over() {
    let (_keep, path) = folder(&[]);
    let room = crate::library::drawn_room::DrawnRoom::default();
    let scene = cache::drawn(&room, None).unwrap();
    let folders = [path.join("elsewhere"), path.join("own")];
    let saved = save(&folders, " My room ", &scene).unwrap();
    assert_eq!(saved, path.join("own").join("My room.promenade"));
    let found = scene_in_slot(&saved, 1).unwrap();
    assert_eq!(found.scene.title(), "My room");
    assert_eq!(found.scene.images().map(|i| i.images.len()), scene.images().map(|i| i.images.len()));
    let error = with_causes(&save(&folders, "My room", &scene).unwrap_err());
    assert!(error.contains("there is a scene of this name already"), "{error}");
    for name in ["", "../x", "a/b", ".hidden"] {
        let error = with_causes(&save(&folders, name, &scene).unwrap_err());
        assert!(error.contains("expected a name without a folder"), "{name}: {error}");
    }
}

#[test]
fn a_place_that_is_not_there_is_named_with_one_way_to_get_it() {
    let folder = tempfile::tempdir().unwrap();
    let folders = [folder.path().to_owned()];
    let key = |file: &str| SceneKey { title: "A place".to_owned(), absolute: file.into(), ..SceneKey::default() };
    let words = |file: &str| scene_of(&folders, &key(file)).err().unwrap().to_string();
    let club = words("club.promenade");
    assert!(["club.promenade", "archive", "copy it to", "Try again"].iter().all(|part| club.contains(part)), "{club}");
    let own = words("/gone/mine.promenade");
    assert!(["mine.promenade", "/gone", "copy it there"].iter().all(|part| own.contains(part)), "{own}");
    assert!(has_file(&folders, &key("dry-studio.promenade")) && scene_of(&folders, &key("dry-studio.promenade")).is_ok());
    assert!(!has_file(&folders, &key("club.promenade")));
    std::fs::write(folder.path().join("club.promenade"), b"").unwrap();
    assert!(has_file(&folders, &key("club.promenade")) && has_file(&folders, &SceneKey::loft()));
}
