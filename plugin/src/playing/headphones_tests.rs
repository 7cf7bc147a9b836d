//! Headphones from the wish for them to the filter that the audio thread is given.

use crate::history::user_state::UserState;
use crate::library::cache;
use crate::playing::{loader::Loader, output::Output};
use crate::project::params::PromenadeParams;
use std::sync::Arc;

const TEXT: &str = "Preamp: -6.0 dB\nFilter 1: ON PK Fc 105 Hz Gain 5.5 dB Q 0.70\n";

#[test]
fn headphones_are_kept_by_content_and_what_cannot_be_read_changes_nothing() {
    let _alone = cache::alone();
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(file("HD 600.txt"), TEXT).unwrap();
    std::fs::write(file("broken.txt"), "Filter 1: ON PK").unwrap();
    let params = Arc::new(PromenadeParams::default());
    let loader = Loader::new(Arc::clone(&params));
    loader.activate(48_000.0, Output::Binaural);
    assert!(loader.headphones.pop().unwrap().is_none(), "none at first");
    let before = UserState::of(&params);
    let ask = |file: &str| {
        loader.exchange.headphones_wish.ask(file);
        assert!(!loader.is_up_to_date(), "a wish wakes the loader");
        loader.refresh();
        loader.headphones.pop()
    };
    assert!(ask(&file("HD 600.txt")).unwrap().is_some());
    let kept = params.headphones.get().0;
    assert_eq!(kept.name, "HD 600");
    assert!(UserState::of(&params) == before, "no part of presets and undo");
    for (name, clue) in [("broken.txt", "broken.txt: line 1: expected"), ("none.txt", "none.txt: cannot be read")] {
        assert!(ask(&file(name)).is_none(), "{name}: the filter stays");
        assert!(loader.exchange.headphones_report.text().contains(clue), "{}", loader.exchange.headphones_report.text());
        assert_eq!(params.headphones.get().0, kept);
    }
    loader.activate(96_000.0, Output::Binaural);
    assert!(loader.headphones.pop().unwrap().is_some(), "made anew at another rate");
    // Another instance is given the saved state.
    let other = Arc::new(PromenadeParams::default());
    let its_loader = Loader::new(Arc::clone(&other));
    its_loader.activate(48_000.0, Output::Binaural);
    drop(its_loader.headphones.pop());
    other.headphones.restore(serde_json::from_str(&serde_json::to_string(&kept).unwrap()).unwrap());
    assert!(its_loader.headphones.pop().unwrap().is_some());
    assert!(ask("").unwrap().is_none() && loader.exchange.headphones_report.text().is_empty());
}
