//! Where the built plugin is.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;
use std::{env, fs};

/// The environment variable with the folder of the bundles.
const BUNDLES_VARIABLE: &str = "PROMENADE_BUNDLES";

/// The path of the CLAP plugin: a bundle, or a library without its ending.
///
/// # Panics
/// It is not built.
#[must_use]
pub fn clap() -> PathBuf {
    match env::var_os(BUNDLES_VARIABLE) {
        Some(folder) => existing(Path::new(&folder).join("Promenade.clap")),
        None => library(),
    }
}

/// The path of the VST3 bundle.
///
/// # Panics
/// It is not built.
#[must_use]
pub fn vst3() -> PathBuf {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    match env::var_os(BUNDLES_VARIABLE) {
        Some(folder) => existing(Path::new(&folder).join("Promenade.vst3")),
        None => MADE.get_or_init(bundle_library).clone(),
    }
}

/// The shared library that cargo builds as a dependency of these tests.
fn library() -> PathBuf {
    let tests = env::current_exe().expect("a test knows its own path");
    let name = format!("{}promenade_plugin{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    existing(tests.with_file_name(name))
}

/// A VST3 bundle around the shared library, beside it in the build's folder: one for each state of the library, made under
/// another name first, so that no test loads a file that another is writing.
fn bundle_library() -> PathBuf {
    let library = library();
    let changed = fs::metadata(&library).and_then(|m| m.modified()).expect("the library's time can be read");
    let state = changed.duration_since(SystemTime::UNIX_EPOCH).expect("it was built after 1970").as_nanos().to_string();
    let folder = library.with_file_name("promenade-tests");
    let bundle = folder.join(&state).join("Promenade.vst3");
    if bundle.exists() {
        return bundle;
    }
    let (inner, suffix) = match env::consts::OS {
        "macos" => ("MacOS".to_owned(), ""),
        "windows" => (format!("{}-win", env::consts::ARCH), ".vst3"),
        os => (format!("{}-{os}", env::consts::ARCH), env::consts::DLL_SUFFIX),
    };
    let new = folder.join(format!("new-{}", std::process::id()));
    let binary = new.join("Promenade.vst3/Contents").join(inner).join(format!("Promenade{suffix}"));
    fs::create_dir_all(binary.parent().expect("the path has folders")).expect("the build's folder can be written");
    fs::copy(&library, binary).expect("the library can be copied");
    if fs::rename(&new, folder.join(&state)).is_err() {
        // Another test was faster.
        let _ = fs::remove_dir_all(&new);
    }
    // Bundles of earlier builds are of no use any more.
    for old in fs::read_dir(&folder).into_iter().flatten().flatten() {
        let name = old.file_name();
        if name != *state && !name.to_string_lossy().starts_with("new-") {
            let _ = fs::remove_dir_all(old.path());
        }
    }
    existing(bundle)
}

fn existing(path: PathBuf) -> PathBuf {
    assert!(path.exists(), "{} does not exist: build it with `cargo xtask bundle --debug`", path.display());
    path
}
