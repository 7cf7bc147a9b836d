//! Copies what users are given to the folders where hosts, the plugin and a terminal look for it.

use crate::bundle::remove;
use crate::manifest::{Item, files};
use crate::system::Place;
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;

/// Names and VST3 classes of the plugins that play the presets of the first.
const OTHERS: [(&str, &[u8; 16]); 2] = [("Promenade Many", b"PromenadeSp.Many"), ("Promenade Many 64", b"PromenadeSp.Mn64")];

/// Installs items in this user's folders, and prints where.
pub(crate) fn install(items: &[Item]) -> Result<()> {
    let folders = Place::ALL.map(|place| place.folder().map(|folder| (place, folder)));
    for (place, folder) in folders.into_iter().collect::<Result<Vec<_>>>()? {
        let count = install_in(items, place, &folder)?;
        println!("installed {count} in {} ({})", folder.display(), place.holds());
    }
    Ok(())
}

/// Copies the items of one place into a folder and returns their number. Other files there stay.
fn install_in(items: &[Item], place: Place, folder: &Path) -> Result<usize> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let here = items.iter().filter(|item| item.place == Some(place));
    let mut count = 0;
    for item in here {
        let there = folder.join(item.from.file_name().unwrap_or_default());
        if place == Place::Presets && there.exists() && !is_factory_preset(&there) {
            println!("kept {}, which is your own", there.display());
            continue;
        }
        // What another version left in the bundle goes, too.
        remove(&there)?;
        for (from, name) in files(&item.from)? {
            copy(&from, &folder.join(name))?;
        }
        if place == Place::Presets {
            for_others(&item.from, folder)?;
        }
        count += 1;
    }
    Ok(count)
}

/// Writes a preset for the plugins of many sources too: a VST3 host lists those in a folder by the plugin's name that have its
/// class in their header.
fn for_others(preset: &Path, folder: &Path) -> Result<()> {
    const CLASS: std::ops::Range<usize> = 8..40;
    for (name, class) in OTHERS {
        let there = folder.with_file_name(name).join(preset.file_name().unwrap_or_default());
        if there.exists() && !is_factory_preset(&there) {
            continue;
        }
        let mut bytes = fs::read(preset).with_context(|| format!("cannot read {}", preset.display()))?;
        let class: String = class.iter().map(|byte| format!("{byte:02X}")).collect();
        if let Some(place) = bytes.get_mut(CLASS) {
            place.copy_from_slice(class.as_bytes());
        }
        let written = fs::create_dir_all(folder.with_file_name(name)).and_then(|()| fs::write(&there, &bytes));
        written.with_context(|| format!("cannot write {}", there.display()))?;
    }
    Ok(())
}

/// Whether a preset came with the plugin: those say so. A user's own of the same name is not replaced.
fn is_factory_preset(preset: &Path) -> bool {
    const MARK: &[u8] = b"Promenade Factory";
    fs::read(preset).is_ok_and(|bytes| bytes.windows(MARK.len()).any(|part| part == MARK))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let context = || format!("cannot copy {} to {}", from.display(), to.display());
    to.parent().map_or(Ok(()), fs::create_dir_all).with_context(context)?;
    fs::copy(from, to).map(drop).with_context(context)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bundle_takes_the_place_of_an_older_one_and_other_files_stay() {
        let kept = tempfile::tempdir().unwrap();
        let (new, folder) = (kept.path().join("new/P.vst3"), kept.path().join("plugins"));
        for (path, text) in
            [(new.join("Contents/lib"), "new"), (folder.join("P.vst3/Contents/gone"), "old"), (folder.join("other"), "")]
        {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let item = |place| Item { from: new.clone(), to: "P.vst3".to_owned(), place };
        let items = [item(Some(Place::Vst3)), item(None)];
        assert_eq!(install_in(&items, Place::Vst3, &folder).unwrap(), 1);
        assert_eq!(install_in(&items, Place::Clap, &folder).unwrap(), 0);
        assert_eq!(fs::read_to_string(folder.join("P.vst3/Contents/lib")).unwrap(), "new");
        assert!(!folder.join("P.vst3/Contents/gone").exists() && folder.join("other").exists());
    }

    #[test]
    fn plugins_of_many_sources_have_the_presets_with_their_own_class() {
        let kept = tempfile::tempdir().unwrap();
        let preset = crate::root().join("presets/plugin/Club, at the bar.vstpreset");
        let items = [Item { from: preset.clone(), to: "presets/bar".to_owned(), place: Some(Place::Presets) }];
        install_in(&items, Place::Presets, &kept.path().join("Promenade")).unwrap();
        let read = |plugin: &str| fs::read(kept.path().join(plugin).join("Club, at the bar.vstpreset")).unwrap();
        let [one, many] = ["Promenade", "Promenade Many 64"].map(read);
        let hex =
            |text: &[u8]| text.chunks(2).map(|c| u8::from_str_radix(std::str::from_utf8(c).unwrap(), 16).unwrap()).collect();
        let classes = [&one, &many].map(|bytes| hex(&bytes[8..40])).map(|bytes: Vec<u8>| String::from_utf8(bytes).unwrap());
        assert_eq!(classes, ["PromenadeSpatial", "PromenadeSp.Mn64"]);
        assert_eq!((&one[..8], &one[40..]), (&many[..8], &many[40..]));
    }

    #[test]
    fn a_users_own_preset_stays() {
        let kept = tempfile::tempdir().unwrap();
        let (from, folder) = (kept.path().join("new.vstpreset"), kept.path().join("presets"));
        fs::write(&from, "by Promenade Factory, new").unwrap();
        fs::create_dir(&folder).unwrap();
        let items = [Item { from, to: "presets/new.vstpreset".to_owned(), place: Some(Place::Presets) }];
        for (before, count, after) in [("mine", 0, "mine"), ("by Promenade Factory, old", 1, "by Promenade Factory, new")] {
            fs::write(folder.join("new.vstpreset"), before).unwrap();
            assert_eq!(install_in(&items, Place::Presets, &folder).unwrap(), count);
            assert_eq!(fs::read_to_string(folder.join("new.vstpreset")).unwrap(), after);
        }
    }
}
