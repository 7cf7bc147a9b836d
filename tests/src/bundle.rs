//! Where the built plugin is.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
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

/// A VST3 bundle around the shared library, one per test process so that none loads a file that another is writing.
fn bundle_library() -> PathBuf {
    let bundle = env::temp_dir().join(format!("promenade-tests-{}", std::process::id())).join("Promenade.vst3");
    let (folder, suffix) = match env::consts::OS {
        "macos" => ("MacOS".to_owned(), ""),
        "windows" => (format!("{}-win", env::consts::ARCH), ".vst3"),
        os => (format!("{}-{os}", env::consts::ARCH), env::consts::DLL_SUFFIX),
    };
    let binary = bundle.join("Contents").join(folder).join(format!("Promenade{suffix}"));
    fs::create_dir_all(binary.parent().expect("the path has folders")).expect("the temporary folder can be written");
    fs::copy(library(), binary).expect("the library can be copied");
    bundle
}

fn existing(path: PathBuf) -> PathBuf {
    assert!(path.exists(), "{} does not exist: build it with `cargo xtask bundle`", path.display());
    path
}
