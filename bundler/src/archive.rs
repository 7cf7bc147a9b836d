//! The archive that users download: plugin, programs, presets, scenes, licences, and how to install them.

use crate::bundle::{self, BUILDS, Build, Profile};
use crate::manifest::{self, Item};
use crate::system::System;
use crate::{licenses, manual, readme, web};
use anyhow::{Context, Result, bail};
use std::fs::{self, File};
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// What is asked of the command.
#[derive(Debug, Default, PartialEq, Eq)]
struct Options {
    /// The target of a cross build; none: this machine's.
    target: Option<String>,
    without_standalone: bool,
}

/// Builds all that ships and packs it; prints the archive's path and size.
pub(crate) fn archive(root: &Path, options: &[String]) -> Result<()> {
    let options = parse(options)?;
    let target = options.target.as_deref();
    let triple = target.map_or_else(rustc_host, |target| Ok(target.to_owned()))?;
    let system = System::of_target(&triple)?;
    let builds = BUILDS.into_iter().filter(|build| !(options.without_standalone && build.is_standalone())).collect::<Vec<_>>();
    // First, because it is quick and may find what must not be shipped.
    let mut written = written(root, system, &builds, target)?;
    let engine = web::web()?;
    let (bundles, mut programs) = bundle::ship(&builds, Profile::Dist, system, target)?;
    written.extend(completions(&programs, target)?);
    programs.push(engine);
    let name = format!("promenade-{}-{triple}", env!("CARGO_PKG_VERSION"));
    let folder = bundle::target_folder()?.join("archives");
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = folder.join(format!("{name}.zip"));
    let partial = path.with_extension("partial");
    let context = || format!("cannot write {}", partial.display());
    let file = BufWriter::new(File::create(&partial).with_context(context)?);
    pack(file, &name, &manifest::archived(root, &bundles, &programs)?, &written).with_context(context)?;
    fs::rename(&partial, &path).with_context(|| format!("cannot write {}", path.display()))?;
    #[expect(clippy::cast_precision_loss, reason = "megabytes for a reader")]
    let megabytes = fs::metadata(&path)?.len() as f64 / 1e6;
    println!("{} ({megabytes:.1} MB)", path.display());
    Ok(())
}

fn parse(options: &[String]) -> Result<Options> {
    let mut parsed = Options::default();
    let mut rest = options.iter();
    while let Some(option) = rest.next() {
        match option.as_str() {
            "--without-standalone" => parsed.without_standalone = true,
            "--target" => parsed.target = Some(rest.next().context("--target needs the name of a target")?.clone()),
            _ => bail!("expected --target TARGET or --without-standalone, found \"{option}\""),
        }
    }
    Ok(parsed)
}

/// The target that rustc builds for by itself.
pub(crate) fn rustc_host() -> Result<String> {
    let out = Command::new("rustc").arg("-vV").output().context("cannot run rustc")?;
    let text = String::from_utf8(out.stdout).context("rustc does not write UTF-8")?;
    text.lines().find_map(|line| line.strip_prefix("host: ")).map(str::to_owned).context("rustc does not name its host")
}

/// The texts that are made for an archive, with their places in it.
fn written(root: &Path, system: System, builds: &[Build], target: Option<&str>) -> Result<Vec<(String, Vec<u8>)>> {
    let dependencies = licenses::dependencies(root, builds, target)?;
    let mut files = vec![
        ("README.txt".to_owned(), readme::readme(system, builds).into_bytes()),
        ("licenses/dependencies.txt".to_owned(), licenses::document(&dependencies).into_bytes()),
        ("licenses/rust-standard-library.html".to_owned(), standard_library()?),
    ];
    files.extend(manual::manual(root)?.into_iter().map(|(name, bytes)| (format!("manual/{name}"), bytes)));
    Ok(files)
}

/// Completions for shells and pages for man, as the command line makes them; that of a cross build may not run here, which is
/// said.
fn completions(programs: &[PathBuf], target: Option<&str>) -> Result<Vec<(String, Vec<u8>)>> {
    let is_tool = |path: &&PathBuf| path.file_stem().is_some_and(|name| name == "promenade");
    let tool = programs.iter().find(is_tool).context("no command line was built")?;
    let share = bundle::target_folder()?.join("archives/share");
    match Command::new(tool).args(["completions", "-o"]).arg(&share).status() {
        Ok(status) if status.success() => {}
        _ if target.is_some() => {
            println!("{} does not run here: the archive has no completions and no pages for man", tool.display());
            return Ok(Vec::new());
        }
        other => bail!("{}: expected completions to be written, found {other:?}", tool.display()),
    }
    let mut files = Vec::new();
    for (path, rest) in manifest::files(&share)? {
        let place = rest.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/");
        files.push((place, fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?));
    }
    Ok(files)
}

/// The licences of Rust's own library, as the toolchain states them.
fn standard_library() -> Result<Vec<u8>> {
    let out = Command::new("rustc").args(["--print", "sysroot"]).output().context("cannot run rustc")?;
    let sysroot = PathBuf::from(String::from_utf8(out.stdout).context("rustc does not write UTF-8")?.trim());
    let path = sysroot.join("share/doc/rust/COPYRIGHT-library.html");
    fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))
}

/// Writes everything under one folder. The same input makes the same bytes.
fn pack(to: impl Write + Seek, name: &str, items: &[Item], written: &[(String, Vec<u8>)]) -> Result<()> {
    let mut zip = ZipWriter::new(to);
    for (place, bytes) in written {
        zip.start_file(format!("{name}/{place}"), SimpleFileOptions::default().unix_permissions(0o644))?;
        zip.write_all(bytes)?;
    }
    for item in items {
        let folder = item.to.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
        for (from, rest) in manifest::files(&item.from)? {
            let bytes = fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
            let rest = rest.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/");
            let mode = if item.to.starts_with("bin/") || is_binary(&bytes) { 0o755 } else { 0o644 };
            zip.start_file(format!("{name}/{folder}{rest}"), SimpleFileOptions::default().unix_permissions(mode))?;
            zip.write_all(&bytes)?;
        }
    }
    zip.finish()?.flush()?;
    Ok(())
}

/// Whether a file is a program or a library of one of the systems: ELF, Mach-O or PE.
fn is_binary(bytes: &[u8]) -> bool {
    [&b"\x7fELF"[..], b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe", b"MZ"].iter().any(|magic| bytes.starts_with(magic))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Read};

    #[test]
    fn options_are_understood_or_named() {
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let parsed = parse(&words("--target x86_64-pc-windows-gnu --without-standalone")).unwrap();
        assert_eq!(parsed, Options { target: Some("x86_64-pc-windows-gnu".to_owned()), without_standalone: true });
        assert!(parse(&words("--target")).is_err());
        assert!(parse(&words("--debug")).unwrap_err().to_string().contains("--debug"));
    }

    #[test]
    fn an_archive_is_one_folder_and_the_same_each_time() {
        let kept = tempfile::tempdir().unwrap();
        let bundle = kept.path().join("Promenade.vst3/Contents/x86_64-linux");
        fs::create_dir_all(&bundle).unwrap();
        fs::write(bundle.join("Promenade.so"), b"\x7fELF...").unwrap();
        fs::write(kept.path().join("LICENSE"), "text").unwrap();
        let item = |from: &str, to: &str| Item { from: kept.path().join(from), to: to.to_owned(), place: None };
        let items = [item("Promenade.vst3", "Promenade.vst3"), item("LICENSE", "licenses/LICENSE")];
        let packed = || {
            let mut bytes = Cursor::new(Vec::new());
            pack(&mut bytes, "p", &items, &[("README.txt".to_owned(), b"read".to_vec())]).unwrap();
            bytes.into_inner()
        };
        let bytes = packed();
        assert_eq!(bytes, packed());
        let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut found = Vec::new();
        for index in 0..zip.len() {
            let mut file = zip.by_index(index).unwrap();
            let mut text = Vec::new();
            file.read_to_end(&mut text).unwrap();
            found.push((file.name().unwrap().into_owned(), file.unix_mode().unwrap() & 0o777, text.len()));
        }
        let expected = [
            ("p/README.txt", 0o644, 4),
            ("p/Promenade.vst3/Contents/x86_64-linux/Promenade.so", 0o755, 7),
            ("p/licenses/LICENSE", 0o644, 4),
        ];
        assert_eq!(found, expected.map(|(name, mode, length)| (name.to_owned(), mode, length)));
    }
}
