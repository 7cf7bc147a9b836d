//! An archive as a package of its system's own installer, which opens with a double click: .deb, .pkg, or a setup program.

use crate::archive;
use crate::bundle::{self, run};
use crate::system::System;
use anyhow::{Context, Result, bail};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use zip::ZipArchive;

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Packs the archive of a target for its system's installer, with that system's own tool; prints the package's path.
pub(crate) fn package(root: &Path, options: &[String]) -> Result<()> {
    let triple = match options {
        [] => archive::rustc_host()?,
        [option, target] if option == "--target" => target.clone(),
        _ => bail!("expected --target TARGET or nothing, found \"{}\"", options.join(" ")),
    };
    let system = System::of_target(&triple)?;
    let target = bundle::target_folder()?;
    let name = format!("promenade-{VERSION}-{triple}");
    let zip = target.join("archives").join(format!("{name}.zip"));
    let folder = target.join("packages").join(&triple);
    bundle::remove(&folder)?;
    unpack(&zip, &folder)?;
    let files = folder.join(&name);
    let image = folder.join("image");
    let out = target.join("archives");
    let made = match system {
        System::Linux => {
            lay_out(&files, &image, system)?;
            debian(&folder, &image, &triple, &out.join(&name))?
        }
        System::MacOs => {
            lay_out(&files, &image, system)?;
            let made = out.join(format!("{name}.pkg"));
            let mut tool = Command::new("pkgbuild");
            tool.args(["--identifier", "promenade.installer", "--version", VERSION, "--install-location", "/", "--root"]);
            run(tool.arg(&image).arg(&made))?;
            made
        }
        System::Windows => {
            let mut tool = Command::new("iscc");
            tool.arg(format!("/DVersion={VERSION}")).arg(format!("/DFiles={}", files.display()));
            tool.arg(format!("/O{}", out.display())).arg(format!("/F{name}-setup"));
            run(tool.arg(root.join("bundler/installer/windows.iss")))?;
            out.join(format!("{name}-setup.exe"))
        }
    };
    println!("{}", made.display());
    Ok(())
}

/// Unpacks an archive, with its permissions.
fn unpack(zip: &Path, to: &Path) -> Result<()> {
    let context = || format!("{} cannot be unpacked; `cargo xtask archive` makes it", zip.display());
    let mut zip = ZipArchive::new(File::open(zip).with_context(context)?).with_context(context)?;
    zip.extract(to).with_context(context)
}

/// Where a system's installer puts each part of an archive, for all users: its name there, and the folder.
///
/// Sources: CLAP's `entry.h`, the VST 3 developer portal's "Plug-in locations" and "Preset locations", for the rest the
/// Filesystem Hierarchy Standard 3.0 and Apple's "File System Programming Guide".
fn places(system: System) -> [(&'static str, &'static str); 6] {
    match system {
        System::MacOs => [
            ("Promenade.clap", "Library/Audio/Plug-Ins/CLAP/Promenade.clap"),
            ("Promenade.vst3", "Library/Audio/Plug-Ins/VST3/Promenade.vst3"),
            ("presets", "Library/Audio/Presets/Promenade/Promenade"),
            ("scenes", "Library/Application Support/promenade/scenes"),
            ("bin", "usr/local/lib/promenade"),
            ("", "Library/Application Support/promenade/manual"),
        ],
        // On Windows the setup program's own script says so.
        System::Linux | System::Windows => [
            ("Promenade.clap", "usr/lib/clap/Promenade.clap"),
            ("Promenade.vst3", "usr/lib/vst3/Promenade.vst3"),
            ("presets", "usr/share/vst3/presets/Promenade/Promenade"),
            ("scenes", "usr/share/promenade/scenes"),
            ("bin", "usr/lib/promenade"),
            ("", "usr/share/doc/promenade"),
        ],
    }
}

/// Lays an archive's files out as an installer puts them, the rest of them beside the manual; programs have links where a
/// terminal looks for them.
fn lay_out(files: &Path, image: &Path, system: System) -> Result<()> {
    let places = places(system);
    let mut entries = fs::read_dir(files)
        .and_then(|all| all.map(|entry| entry.map(|entry| entry.file_name())).collect::<io::Result<Vec<_>>>())
        .with_context(|| format!("{} cannot be read", files.display()))?;
    entries.sort();
    let rest = places[places.len() - 1].1;
    for name in entries {
        let name = name.to_string_lossy();
        let place = places.iter().find(|(known, _)| *known == name).map(|(_, place)| (*place).to_owned());
        let to = image.join(place.unwrap_or_else(|| format!("{rest}/{name}")));
        let context = || format!("{} cannot be laid out", to.display());
        if let Some(folder) = to.parent() {
            fs::create_dir_all(folder).with_context(context)?;
        }
        fs::rename(files.join(&*name), &to).with_context(context)?;
    }
    let [.., (_, programs), _] = places;
    let links = image.join(if system == System::MacOs { "usr/local/bin" } else { "usr/bin" });
    fs::create_dir_all(&links).with_context(|| format!("{} cannot be made", links.display()))?;
    for name in ["promenade", "promenade-standalone"] {
        if image.join(programs).join(name).exists() {
            link(&Path::new("../lib/promenade").join(name), &links.join(name))?;
        }
    }
    Ok(())
}

#[cfg(unix)]
fn link(to: &Path, at: &Path) -> Result<()> {
    std::os::unix::fs::symlink(to, at).with_context(|| format!("{} cannot be linked", at.display()))
}

#[cfg(not(unix))]
fn link(_to: &Path, at: &Path) -> Result<()> {
    bail!("{}: packages for other systems are made on them", at.display())
}

/// A package for Debian and its kin, by dpkg's own tools.
fn debian(folder: &Path, image: &Path, triple: &str, name: &Path) -> Result<PathBuf> {
    let architecture = match triple.split('-').next() {
        Some("x86_64") => "amd64",
        Some("aarch64") => "arm64",
        _ => bail!("what Debian calls the processor of {triple} is not known"),
    };
    let control = image.join("DEBIAN");
    fs::create_dir_all(&control).context("the package's description cannot be made")?;
    let depends = shared_libraries(folder, image)?;
    let text = format!(
        "Package: promenade\nVersion: {VERSION}\nArchitecture: {architecture}\nMaintainer: Promenade's authors\n\
         Section: sound\nPriority: optional\n{depends}Description: spatialiser, as a plugin (CLAP, VST3) and programs\n \
         It makes a dry track sound as it would in a real room, for a listener who walks and turns. The manual is in\n \
         /usr/share/doc/promenade/manual/index.html.\n"
    );
    fs::write(control.join("control"), text).context("the package's description cannot be written")?;
    // Debian's name of a file is that of its package, but this one lies beside archives for other systems.
    let made = PathBuf::from(format!("{}.deb", name.display()));
    run(Command::new("dpkg-deb").args(["--root-owner-group", "--build"]).arg(image).arg(&made))?;
    Ok(made)
}

/// The field of a package's description that names what its binaries are linked with; empty where they are none.
fn shared_libraries(folder: &Path, image: &Path) -> Result<String> {
    let places = places(System::Linux);
    let mut binaries = Vec::new();
    for (_, place) in &places[..5] {
        if image.join(place).exists() {
            binaries.extend(crate::manifest::files(&image.join(place))?.into_iter().map(|(from, _)| from));
        }
    }
    let is_elf = |path: &PathBuf| fs::read(path).is_ok_and(|bytes| bytes.starts_with(b"\x7fELF"));
    binaries.retain(is_elf);
    if binaries.is_empty() {
        return Ok(String::new());
    }
    // The tool wants a source package around it.
    let debian = folder.join("debian");
    fs::create_dir_all(&debian).context("the package's source cannot be made")?;
    fs::write(debian.join("control"), "Source: promenade\n\nPackage: promenade\nArchitecture: any\n")
        .context("the package's source cannot be written")?;
    let mut tool = Command::new("dpkg-shlibdeps");
    tool.current_dir(folder).args(["-O", "--ignore-missing-info"]).args(&binaries);
    let out = tool.output().context("cannot run dpkg-shlibdeps, of Debian's package dpkg-dev")?;
    let text = String::from_utf8_lossy(&out.stdout);
    let depends = text.lines().find_map(|line| line.strip_prefix("shlibs:Depends="));
    let depends = depends.with_context(|| format!("dpkg-shlibdeps: {}", String::from_utf8_lossy(&out.stderr).trim()))?;
    Ok(format!("Depends: {depends}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_plugin::library;

    fn archive(at: &Path) {
        for name in [
            "Promenade.clap",
            "Promenade.vst3/Contents/x86_64-linux/Promenade.so",
            "presets/Office.vstpreset",
            "scenes/cathedral.promenade",
            "bin/promenade",
            "bin/promenade.wasm",
            "manual/index.html",
            "licenses/dependencies.txt",
            "README.txt",
        ] {
            let path = at.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "content").unwrap();
        }
    }

    #[cfg(unix)]
    #[test]
    fn all_of_an_archive_goes_where_hosts_and_the_plugin_look() {
        for (system, plugins, bin) in
            [(System::Linux, "usr/lib", "usr/bin"), (System::MacOs, "Library/Audio/Plug-Ins", "usr/local/bin")]
        {
            let kept = tempfile::tempdir().unwrap();
            let (files, image) = (kept.path().join("files"), kept.path().join("image"));
            archive(&files);
            lay_out(&files, &image, system).unwrap();
            let upper = |name: &str| if system == System::MacOs { name.to_uppercase() } else { name.to_owned() };
            assert!(image.join(plugins).join(upper("clap")).join("Promenade.clap").exists(), "{system:?}");
            assert!(image.join(plugins).join(upper("vst3")).join("Promenade.vst3/Contents").is_dir(), "{system:?}");
            assert_eq!(fs::read_to_string(image.join(bin).join("promenade")).unwrap(), "content", "{system:?}");
            assert!(fs::read_dir(&files).unwrap().next().is_none(), "{system:?}: something is left over");
        }
    }

    #[test]
    fn the_plugin_looks_for_scenes_where_the_package_puts_them() {
        let (system, root) = match System::here().unwrap() {
            System::Windows => return,
            system => (system, Path::new("/")),
        };
        let (_, scenes) = places(system)[3];
        assert!(library::installed_folders().contains(&root.join(scenes)), "{:?}", library::installed_folders());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_debian_package_has_all_files_and_no_other_owner() {
        let Ok(tool) = Command::new("dpkg-deb").arg("--version").output() else { return };
        assert!(tool.status.success());
        let kept = tempfile::tempdir().unwrap();
        let (files, image) = (kept.path().join("files"), kept.path().join("image"));
        archive(&files);
        lay_out(&files, &image, System::Linux).unwrap();
        let made = debian(kept.path(), &image, "x86_64-unknown-linux-gnu", &kept.path().join("promenade")).unwrap();
        let out = Command::new("dpkg-deb").arg("--contents").arg(&made).output().unwrap();
        let list = String::from_utf8(out.stdout).unwrap();
        for path in [
            "./usr/lib/clap/Promenade.clap",
            "./usr/share/promenade/scenes/cathedral.promenade",
            "./usr/share/doc/promenade/README.txt",
        ] {
            assert!(list.lines().any(|line| line.ends_with(path) && line.contains("root/root")), "{path} in {list}");
        }
        assert!(list.contains("./usr/bin/promenade -> ../lib/promenade/promenade"), "{list}");
        assert!(debian(kept.path(), &image, "riscv64-unknown-linux-gnu", kept.path()).is_err());
    }
}
