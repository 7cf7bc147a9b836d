use super::*;
use crate::factory;
use std::fs;

/// A folder that goes when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("promenade-library-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn with(self, file: &str, bytes: &[u8]) -> Self {
        fs::write(self.0.join(file), bytes).unwrap();
        self
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(fs::remove_dir_all(&self.0));
    }
}

fn key(path: PathBuf, bytes: &[u8]) -> SceneKey {
    SceneKey { hash: cache::content_hash(bytes), absolute: path, ..SceneKey::default() }
}

#[test]
fn slots_count_the_files_by_name() {
    let folder = Folder::new("slots").with("b.promenade", b"b").with("a.promenade", b"a").with("c.txt", b"c");
    let folders = [folder.0.clone()];
    assert_eq!(file_in_slot(&folders, SCENES, 1).unwrap(), folder.0.join("a.promenade"));
    assert_eq!(file_in_slot(&folders, SCENES, 2).unwrap(), folder.0.join("b.promenade"));
    assert!(matches!(file_in_slot(&folders, SCENES, 3), Err(LibraryError::EmptySlot { found: 2, .. })));
    assert!(file_in_slot(&folders, SCENES, 0).is_err());
}

#[test]
fn a_moved_and_renamed_scene_is_found_by_its_content() {
    let _alone = cache::alone();
    let bytes = factory::ROOM_A.bytes;
    let folder = Folder::new("moved").with("a.promenade", factory::ROOM_B.bytes).with("renamed.promenade", bytes);
    let found = scene_of(std::slice::from_ref(&folder.0), &key("/nowhere/hall.promenade".into(), bytes)).unwrap();
    assert!(found.note.is_empty(), "{}", found.note);
    assert!(found.key.absolute.ends_with("renamed.promenade"));
}

#[test]
fn a_changed_scene_is_played_and_reported_and_the_old_one_still_asked_for() {
    let _alone = cache::alone();
    let folder = Folder::new("changed").with("hall.promenade", factory::ROOM_A.bytes);
    let wanted = key(folder.0.join("hall.promenade"), b"the scene of yore");
    let found = scene_of(&[], &wanted).unwrap();
    assert!(found.note.contains("has changed"), "{}", found.note);
    assert_eq!(found.key, wanted);
}

#[test]
fn the_right_content_wins_over_the_right_name() {
    let _alone = cache::alone();
    let bytes = factory::ROOM_A.bytes;
    let folder = Folder::new("content").with("hall.promenade", b"something else").with("other.promenade", bytes);
    let found = scene_of(std::slice::from_ref(&folder.0), &key(folder.0.join("hall.promenade"), bytes)).unwrap();
    assert!(found.key.absolute.ends_with("other.promenade"));
}

#[test]
fn what_is_nowhere_is_missing() {
    let wanted = key("/nowhere/hall.promenade".into(), b"gone");
    assert!(matches!(scene_of(&[], &wanted), Err(LibraryError::Missing { .. })));
    assert!(matches!(scene_of(&[], &SceneKey::default()), Err(LibraryError::NoScene)));
}
