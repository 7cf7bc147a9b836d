//! What users are given, and where each part of it goes.

use crate::system::Place;
use anyhow::{Context, Result, anyhow, bail};
use std::fs;
use std::path::{Path, PathBuf};

/// The plugin's bundles.
pub(crate) const BUNDLES: [(&str, Place); 2] = [("Promenade.clap", Place::Clap), ("Promenade.vst3", Place::Vst3)];

/// Files of the repository by folder and ending, the folder they have in an archive, and where they are installed.
const COLLECTIONS: [(&str, &str, &str, Option<Place>); 6] = [
    ("presets/plugin", "vstpreset", "presets", Some(Place::Presets)),
    ("presets/library", "promenade", "scenes", Some(Place::Scenes)),
    ("presets/scenes", "promenade", "scenes", Some(Place::Scenes)),
    ("presets/paths", "json", "examples", None),
    ("data", "flac", "examples", None),
    ("data", "wav", "examples", None),
];

/// Scenes that the plugin has built in, so that a user's folder need not hold them.
const BUILT_IN: [&str; 3] = ["iosr-room-a.promenade", "iosr-room-b.promenade", "loft.promenade"];

/// Single files of the repository, and their places in an archive. `CREDITS.md` says which licence is whose.
const FILES: [(&str, &str); 10] = [
    ("LICENSE-MIT", "LICENSE-MIT"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
    ("CREDITS.md", "CREDITS.md"),
    ("CHANGELOG.md", "CHANGELOG.md"),
    ("presets/scenes/loft.promenade", "examples/loft.promenade"),
    ("presets/scenes/IoSR-LICENSE", "licenses/IoSR-LICENSE"),
    ("crates/acoustics/data/LICENSE-pyroomacoustics", "licenses/LICENSE-pyroomacoustics"),
    ("plugin/assets/fonts/Inter-LICENSE", "licenses/Inter-LICENSE"),
    ("data/phrase.copyright", "licenses/phrase.copyright"),
    ("data/speech.copyright", "licenses/speech.copyright"),
];

/// One file or bundle.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    /// Where it is.
    pub(crate) from: PathBuf,
    /// Its place in an archive, with slashes.
    pub(crate) to: String,
    /// Where it is installed, if it is.
    pub(crate) place: Option<Place>,
}

/// The files of an item or bundle, each with the path that begins with its own name.
pub(crate) fn files(of: &Path) -> Result<Vec<(PathBuf, PathBuf)>> {
    let name = of.file_name().with_context(|| format!("{} has no name", of.display()))?;
    let mut files = Vec::new();
    collect(of, Path::new(name), &mut files).with_context(|| format!("{} cannot be read", of.display()))?;
    Ok(files)
}

/// Adds a file or all files of a folder, in order of their names.
fn collect(from: &Path, to: &Path, files: &mut Vec<(PathBuf, PathBuf)>) -> std::io::Result<()> {
    if !from.is_dir() {
        files.push((from.to_owned(), to.to_owned()));
        return Ok(());
    }
    let mut names = fs::read_dir(from)?.map(|entry| Ok(entry?.file_name())).collect::<std::io::Result<Vec<_>>>()?;
    names.sort();
    names.iter().try_for_each(|name| collect(&from.join(name), &to.join(name), files))
}

/// What is installed: the bundles of a folder, programs, and the repository's presets and scenes.
pub(crate) fn installed(root: &Path, bundles: &Path, programs: &[PathBuf]) -> Result<Vec<Item>> {
    let bundles = BUNDLES.map(|(name, place)| Item { from: bundles.join(name), to: name.to_owned(), place: Some(place) });
    let mut items = bundles.to_vec();
    for program in programs {
        let name = program.file_name().and_then(|n| n.to_str()).context("a program has no name")?;
        items.push(Item { from: program.clone(), to: format!("bin/{name}"), place: Some(Place::Programs) });
    }
    items.extend(collections(root)?.into_iter().filter(|item| item.place.is_some()));
    Ok(items)
}

/// What an archive holds besides what is written for it: all that is installed, examples and licences.
pub(crate) fn archived(root: &Path, bundles: &Path, programs: &[PathBuf]) -> Result<Vec<Item>> {
    let mut items = installed(root, bundles, programs)?;
    items.extend(collections(root)?.into_iter().filter(|item| item.place.is_none()));
    items.extend(FILES.map(|(from, to)| Item { from: root.join(from), to: to.to_owned(), place: None }));
    // An archive whose licences or programs are missing must not leave the house.
    if let Some(missing) = items.iter().find(|item| !item.from.exists()) {
        bail!("{} is missing", missing.from.display());
    }
    Ok(items)
}

fn collections(root: &Path) -> Result<Vec<Item>> {
    let mut items = Vec::new();
    for (folder, ending, to, place) in COLLECTIONS {
        let folder = root.join(folder);
        let unread = || format!("{} cannot be read", folder.display());
        let mut names = Vec::new();
        for entry in fs::read_dir(&folder).with_context(unread)? {
            let name = entry.with_context(unread)?.file_name();
            names.push(name.into_string().map_err(|name| anyhow!("{} has no readable name", folder.join(name).display()))?);
        }
        names.retain(|name| Path::new(name).extension().is_some_and(|e| e == ending) && !BUILT_IN.contains(&name.as_str()));
        names.sort();
        items.extend(names.into_iter().map(|name| Item { from: folder.join(&name), to: format!("{to}/{name}"), place }));
    }
    Ok(items)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::root;
    use std::process::Command;

    /// Whether a file's name says that it is a licence.
    fn is_licence(path: &Path) -> bool {
        let name = path.file_name().unwrap().to_str().unwrap().to_lowercase();
        name.contains("licen") && !name.ends_with(".rs") || name.contains("copy") && !name.ends_with(".rs")
    }

    #[test]
    fn every_licence_of_the_repository_is_in_the_archive_and_credited() {
        let out = Command::new("git").arg("ls-files").current_dir(root()).output().unwrap();
        let listed = String::from_utf8(out.stdout).unwrap();
        let licences = listed.lines().filter(|line| is_licence(Path::new(line))).collect::<Vec<_>>();
        assert!(licences.len() >= 6, "{licences:?}");
        let credits = fs::read_to_string(root().join("CREDITS.md")).unwrap();
        for licence in licences {
            let (_, to) =
                FILES.iter().find(|(from, _)| *from == licence).unwrap_or_else(|| panic!("{licence} is not archived"));
            assert!(credits.contains(to), "{licence} is not credited");
        }
    }

    #[test]
    fn presets_and_scenes_are_installed_once_each() {
        let items = installed(&root(), Path::new("bundles"), &[PathBuf::from("made/promenade")]).unwrap();
        let of = |place| items.iter().filter(|item| item.place == Some(place)).map(|item| item.to.as_str()).collect::<Vec<_>>();
        assert_eq!(of(Place::Clap), ["Promenade.clap"]);
        assert_eq!(of(Place::Vst3), ["Promenade.vst3"]);
        assert_eq!(of(Place::Programs), ["bin/promenade"]);
        assert!(of(Place::Presets).contains(&"presets/Office, at the door.vstpreset"));
        assert!(
            of(Place::Scenes).contains(&"scenes/cathedral.promenade") && of(Place::Scenes).contains(&"scenes/box.promenade")
        );
        assert!(!of(Place::Scenes).iter().any(|to| to.contains("iosr")));
        let mut all = items.iter().map(|item| &item.to).collect::<Vec<_>>();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), items.len());
    }

    #[test]
    fn what_is_missing_is_named() {
        let error = archived(&root(), Path::new("/nowhere"), &[]).unwrap_err().to_string();
        assert!(error.contains("Promenade.clap") && error.contains("missing"), "{error}");
    }
}
