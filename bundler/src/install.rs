//! Copies bundles to the folders where hosts look for the user's plugins, and the library's scenes to where the plugin does.

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
    fs::create_dir_all(&scenes).with_context(|| format!("cannot make {}", scenes.display()))?;
    let library = fs::read_dir("presets/library").context("presets/library cannot be read")?;
    let names = library.flatten().map(|entry| entry.file_name()).filter(|name| name.to_string_lossy().ends_with(".promenade"));
    let mut count = 0;
    for name in names {
        copy(&Path::new("presets/library").join(&name), &scenes.join(&name))?;
        count += 1;
    }
    println!("installed {count} scenes in {}", scenes.display());
    Ok(())
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
