//! Copies bundles to the folders where hosts look for the user's plugins and presets, and the library's scenes to where the plugin does.

use crate::bundle;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};

/// Builds release bundles and installs them and the library.
pub(crate) fn install(options: &[String]) -> Result<()> {
    let bundles = bundle::bundle(&[vec!["--release".to_owned()], options.to_vec()].concat())?;
    for (bundle, folder) in ["Promenade.clap", "Promenade.vst3"].into_iter().zip(plugin_folders()?) {
        let to = folder.join(bundle);
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        remove(&to)?;
        copy(&bundles.join(bundle), &to)?;
        println!("installed {}", to.display());
    }
    let scenes = dirs::data_dir().context("the user's data folder is not known")?.join("promenade").join("scenes");
    let count = install_files("presets/library", "promenade", &scenes, |_| true)?;
    println!("installed {count} scenes in {}", scenes.display());
    let presets = preset_folder()?;
    let count = install_files("presets/plugin", "vstpreset", &presets, is_ours)?;
    println!("installed {count} presets in {}", presets.display());
    Ok(())
}

/// Copies the files with an extension, but none over a file that `may_replace` forbids to. Returns how many.
fn install_files(from: &str, extension: &str, to: &Path, may_replace: fn(&Path) -> bool) -> Result<usize> {
    fs::create_dir_all(to).with_context(|| format!("cannot make {}", to.display()))?;
    let mut count = 0;
    for entry in fs::read_dir(from).with_context(|| format!("{from} cannot be read"))?.flatten() {
        let there = to.join(entry.file_name());
        if entry.path().extension().is_none_or(|e| e != extension) {
            continue;
        }
        if there.exists() && !may_replace(&there) {
            println!("kept {}, which is your own", there.display());
            continue;
        }
        copy(&entry.path(), &there)?;
        count += 1;
    }
    Ok(count)
}

/// Whether a preset came with the plugin: those say so. A user's own of the same name is not replaced.
fn is_ours(preset: &Path) -> bool {
    const MARK: &[u8] = b"Promenade Factory";
    fs::read(preset).is_ok_and(|bytes| bytes.windows(MARK.len()).any(|part| part == MARK))
}

/// Where VST3 hosts look for the user's presets of the plugin, by the format's documentation.
fn preset_folder() -> Result<PathBuf> {
    let home = || dirs::home_dir().context("the user's home folder is not known");
    let base = match std::env::consts::OS {
        "windows" => dirs::document_dir().context("the user's documents folder is not known")?.join("VST3 Presets"),
        "macos" => home()?.join("Library/Audio/Presets"),
        _ => home()?.join(".vst3/presets"),
    };
    Ok(base.join("Promenade").join("Promenade"))
}

/// The user's folders for CLAP and for VST3 plugins.
fn plugin_folders() -> Result<[PathBuf; 2]> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).with_context(|| format!("{name} is not set"));
    Ok(match std::env::consts::OS {
        "linux" => {
            let home = variable("HOME")?;
            [home.join(".clap"), home.join(".vst3")]
        }
        "macos" => {
            let plugins = variable("HOME")?.join("Library/Audio/Plug-Ins");
            [plugins.join("CLAP"), plugins.join("VST3")]
        }
        "windows" => {
            // The user's own folders, which need no administrator.
            let common = variable("LOCALAPPDATA")?.join("Programs").join("Common");
            [common.join("CLAP"), common.join("VST3")]
        }
        os => bail!("where plugins go on {os} is not known; copy the bundles from target/bundled by hand"),
    })
}

fn remove(path: &Path) -> Result<()> {
    let removed = if path.is_dir() {
        fs::remove_dir_all(path)
    } else if path.exists() {
        fs::remove_file(path)
    } else {
        Ok(())
    };
    removed.with_context(|| format!("cannot replace {}", path.display()))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let context = || format!("cannot copy {} to {}", from.display(), to.display());
    if from.is_dir() {
        fs::create_dir_all(to).with_context(context)?;
        for entry in fs::read_dir(from).with_context(context)? {
            let entry = entry.with_context(context)?;
            copy(&entry.path(), &to.join(entry.file_name()))?;
        }
    } else {
        fs::copy(from, to).with_context(context)?;
    }
    Ok(())
}
