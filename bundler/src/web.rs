//! The engine for browsers: one crate, compiled to WebAssembly with vector instructions.

use crate::bundle::{cargo, run, target_folder};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

const TARGET: &str = "wasm32-unknown-unknown";
const PACKAGE: &str = "promenade-web";
/// Flags of the compiler, in an environment variable so that they hold for this target alone.
const FLAGS: (&str, &str) = ("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS", "-C target-feature=+simd128");
/// The oldest compiler that the packages are for.
const NEEDED: &str = env!("CARGO_PKG_RUST_VERSION");
const LINKER: &str = "CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER";

/// Where the standard library for the target comes from.
#[derive(Debug, PartialEq, Eq)]
enum Library {
    /// The toolchain in use has it.
    Installed,
    /// Compiled from sources, with this cargo, this compiler and this linker.
    Sources { cargo: PathBuf, rustc: PathBuf, linker: PathBuf },
}

/// Builds the engine and says what it took; returns its path.
pub(crate) fn web() -> Result<PathBuf> {
    check_features()?;
    let target = target_folder()?;
    let library = library()?;
    let built = match &library {
        Library::Installed => {
            println!("the toolchain has the standard library for {TARGET}");
            build(&mut cargo("rustc"), &target)?
        }
        Library::Sources { cargo, rustc, linker } => {
            println!(
                "the standard library for {TARGET} is compiled from sources, by {} and {}",
                rustc.display(),
                linker.display()
            );
            let mut command = Command::new(cargo);
            // The flag for it is not stable. The wrapper of rustup, if any, is left out.
            command.arg("rustc").env("RUSTC_BOOTSTRAP", "1").env("RUSTC", rustc).env(LINKER, linker);
            command.env_remove("RUSTUP_TOOLCHAIN").args(["-Z", "build-std=std,panic_abort"]);
            build(&mut command, &target.join("wasm"))?
        }
    };
    let folder = target.join("web");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let engine = folder.join("promenade.wasm");
    let size = std::fs::copy(&built, &engine).with_context(|| format!("{} cannot be copied", built.display()))?;
    println!("{} ({size} bytes)", engine.display());
    Ok(engine)
}

/// Runs the build; returns what it made.
fn build(command: &mut Command, target: &Path) -> Result<PathBuf> {
    command.args(["--package", PACKAGE, "--lib", "--crate-type", "cdylib", "--profile", "web", "--target", TARGET]);
    // A sanitizer's settings for this system do not hold for that one.
    command.env("CARGO_TARGET_DIR", target).env(FLAGS.0, FLAGS.1).env_remove("RTSAN_ENABLE");
    run(command)?;
    Ok(target.join(TARGET).join("web/promenade_web.wasm"))
}

/// Relaxed vector instructions give wrong sound: their products are rounded in some browsers and not in others.
fn check_features() -> Result<()> {
    let mut tree = cargo("tree");
    tree.args(["--package", PACKAGE, "--target", TARGET, "--edges", "normal", "--prefix", "none", "--format", "{p} {f}"]);
    let out = tree.output().context("cannot run cargo tree")?;
    if !out.status.success() {
        bail!("cargo tree failed: {}", String::from_utf8_lossy(&out.stderr));
    }
    match relaxed(&String::from_utf8_lossy(&out.stdout)) {
        Some(line) => bail!("the engine for browsers must not be built with \"relaxed-simd\", but has {line}"),
        None => Ok(()),
    }
}

/// The line of a package that is built with relaxed vector instructions.
fn relaxed(tree: &str) -> Option<&str> {
    tree.lines().find(|line| line.contains("relaxed-simd"))
}

/// Whether there is a standard library for the target, or what it is compiled from.
pub(crate) fn has_library() -> bool {
    library().is_ok()
}

/// The first standard library that is here, from the simplest to have.
fn library() -> Result<Library> {
    let rustc = std::env::var_os("RUSTC").map_or_else(|| PathBuf::from("rustc"), PathBuf::from);
    let folder = print(&rustc, &["--print", "target-libdir", "--target", TARGET]);
    if folder.is_some_and(|folder| has_core(Path::new(&folder))) {
        return Ok(Library::Installed);
    }
    // Debian has the sources for its own compiler, besides the one of rustup.
    let (cargo, rustc) = (PathBuf::from("/usr/bin/cargo"), PathBuf::from("/usr/bin/rustc"));
    let new = print(&rustc, &["--version"]).is_some_and(|version| is_new_enough(&version));
    let sysroot = if cargo.is_file() && new { print(&rustc, &["--print", "sysroot"]) } else { None };
    let sources = sysroot.map(|root| Path::new(&root).join("lib/rustlib/src/rust/library/std/Cargo.toml"));
    if let (true, Some(linker)) = (sources.is_some_and(|sources| sources.is_file()), linker()) {
        return Ok(Library::Sources { cargo, rustc, linker });
    }
    bail!(
        "there is no standard library for {TARGET}; install one with \"rustup target add {TARGET}\", or on Debian with \
         \"apt-get install rustc-web cargo-web rust-web-src lld-19\", whose compiler must be {NEEDED} or newer"
    )
}

/// Whether a compiler can compile the engine, by what `rustc --version` prints. Debian keeps old ones beside the new.
fn is_new_enough(version: &str) -> bool {
    let numbers = |text: &str| text.split('.').map_while(|part| part.parse().ok()).collect::<Vec<u32>>();
    version.split(' ').nth(1).is_some_and(|version| numbers(version) >= numbers(NEEDED))
}

/// Whether a folder holds a compiled standard library.
fn has_core(folder: &Path) -> bool {
    let Ok(files) = std::fs::read_dir(folder) else { return false };
    files.flatten().any(|file| file.file_name().to_string_lossy().starts_with("libcore-"))
}

/// LLVM's linker for WebAssembly, of any version.
fn linker() -> Option<PathBuf> {
    let files = std::fs::read_dir("/usr/bin").ok()?.flatten().map(|file| file.path());
    files.filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("wasm-ld"))).max()
}

/// What a program prints, one line, if it succeeds.
fn print(program: &Path, args: &[&str]) -> Option<String> {
    let out = Command::new(program).args(args).output().ok().filter(|out| out.status.success())?;
    Some(String::from_utf8(out.stdout).ok()?.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relaxed_instructions_are_found() {
        let tree = "promenade-core v0.1.0 \npulp v0.22.3 relaxed-simd,std\nglam v0.34.2 std\n";
        assert_eq!(relaxed(tree), Some("pulp v0.22.3 relaxed-simd,std"));
        assert_eq!(relaxed("pulp v0.22.3 std,x86-v3,x86-v4\n"), None);
    }

    #[test]
    fn the_engine_is_built_without_them() {
        check_features().unwrap();
    }

    #[test]
    fn an_old_compiler_is_none() {
        let is_new =
            |version: &str| is_new_enough(&format!("rustc {version} (0123abcd 2026-01-01) (built from a source tarball)"));
        assert!(is_new(NEEDED) && is_new("1.123.0") && is_new("2.0.0"));
        assert!(!is_new("1.9.0") && !is_new("1.85.0") && !is_new_enough("clang version 19.1.7"));
    }

    #[test]
    fn a_folder_without_a_library_is_no_standard_library() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!has_core(folder.path()) && !has_core(Path::new("/nowhere")));
        std::fs::write(folder.path().join("libcore-0123.rlib"), "").unwrap();
        assert!(has_core(folder.path()));
    }
}
