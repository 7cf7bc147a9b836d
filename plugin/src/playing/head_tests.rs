//! A head from the wish for it to what is played.

use crate::history::user_state::UserState;
use crate::library::cache;
use crate::playing::{loader::Loader, output::Output};
use crate::project::params::PromenadeParams;
use promenade_core::Scene;
use promenade_core::glam::Vec3;
use promenade_testing::heads::write_sofa;
use std::path::PathBuf;
use std::sync::Arc;
use tempfile::TempDir;

struct Instance {
    params: Arc<PromenadeParams>,
    loader: Arc<Loader>,
}

impl Instance {
    fn new() -> Self {
        let params = Arc::new(PromenadeParams::default());
        let loader = Loader::new(Arc::clone(&params));
        loader.activate(48_000.0, Output::Binaural);
        Self { params, loader }
    }

    /// What is played after a head has been asked for.
    fn asking(&self, file: &str) -> Arc<Scene> {
        self.loader.exchange.head_wish.ask(file);
        assert!(!self.loader.is_up_to_date(), "a wish wakes the loader");
        self.loader.refresh();
        self.loader.scene().unwrap()
    }
}

/// How much later the left ear is, seconds, with the source at the left.
fn delay_s(scene: &Scene) -> f32 {
    let grid = scene.field().unwrap().grid();
    let left = (0..grid.nodes()).max_by(|a, b| grid.node(*a).1.dot(Vec3::Y).total_cmp(&grid.node(*b).1.dot(Vec3::Y)));
    scene.field().unwrap().decode(&grid.pose(left.unwrap())).delay_s
}

fn sofa(radius_m: f32) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.sofa");
    write_sofa(&path, radius_m);
    (folder, path)
}

#[test]
fn a_head_is_read_once_kept_by_content_and_shared() {
    let _alone = cache::alone();
    let (folder, path) = sofa(0.12);
    let instance = Instance::new();
    let own = instance.loader.scene().unwrap();
    let heard = instance.asking(&path.display().to_string());
    assert_eq!(
        (instance.loader.exchange.head_report.text().as_str(), instance.loader.exchange.head_name.text().as_str()),
        ("", "Sphere, mine")
    );
    assert!((delay_s(&heard) - delay_s(&own)).abs() > 2e-5, "{} {}", delay_s(&heard), delay_s(&own));
    assert_eq!(heard.title(), own.title());
    // The project has what it needs.
    drop(folder);
    let other = Instance::new();
    other.params.head.restore(instance.params.head.get().0);
    assert!(Arc::ptr_eq(&other.loader.scene().unwrap(), &heard));
    assert_eq!(other.loader.exchange.head_name.text(), "Sphere, mine");
    assert!(Arc::ptr_eq(&other.asking(""), &own), "the scene's own again");
    assert_eq!((other.loader.exchange.head_wish.answered(), other.loader.exchange.head_name.text().as_str()), (1, ""));
}

#[test]
fn a_file_that_is_no_head_is_reported_and_the_scenes_own_plays() {
    let _alone = cache::alone();
    let (folder, path) = sofa(0.12);
    let instance = Instance::new();
    let own = instance.loader.scene().unwrap();
    instance.asking(&path.display().to_string());
    let broken = folder.path().join("broken.sofa");
    std::fs::write(&broken, b"not a head").unwrap();
    for (file, clue) in [
        (broken.display().to_string(), "broken.sofa: no readable SOFA (HDF5) file"),
        (folder.path().join("none.sofa").display().to_string(), "none.sofa: cannot be read"),
        (folder.path().display().to_string(), "expected a regular file, found a folder"),
    ] {
        assert!(Arc::ptr_eq(&instance.asking(&file), &own), "{file}");
        let report = instance.loader.exchange.head_report.text();
        assert!(report.contains(clue), "{report}");
        assert!(!instance.params.head.get().0.is_some());
    }
    // The file has been mended meanwhile.
    write_sofa(&folder.path().join("none.sofa"), 0.1);
    instance.asking(&folder.path().join("none.sofa").display().to_string());
    assert_eq!(instance.loader.exchange.head_report.text(), "");
    let damaged = "x".repeat(40);
    instance.params.head.restore(damaged.into());
    assert!(Arc::ptr_eq(&instance.loader.scene().unwrap(), &own));
    assert!(
        instance.loader.exchange.head_report.text().contains("the project's head cannot be read"),
        "{}",
        instance.loader.exchange.head_report.text()
    );
    instance.params.head.restore(String::new().into());
    assert_eq!(instance.loader.exchange.head_report.text(), "");
}

#[test]
fn undo_and_presets_restore_the_head() {
    let _alone = cache::alone();
    let (_folder, path) = sofa(0.1);
    let instance = Instance::new();
    let before = UserState::of(&instance.params);
    instance.asking(&path.display().to_string());
    let after = UserState::of(&instance.params);
    assert!(before != after);
    before.restore(&instance.params, |_, _| ());
    assert_eq!(instance.loader.exchange.head_name.text(), "");
    after.restore(&instance.params, |_, _| ());
    assert_eq!(instance.loader.exchange.head_name.text(), "Sphere, mine");
    // A preset of before there were heads leaves the user's own.
    let old = nice_plug::plugin::PluginState { version: String::new(), params: [].into(), fields: [].into() };
    assert!(UserState::from_saved(old, &after) == after);
}
