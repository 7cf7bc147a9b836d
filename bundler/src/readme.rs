//! The text that tells a user what is in an archive and how to install it.

use crate::bundle::Build;
use crate::system::{Place, System};

/// The text for the archive of a system.
pub(crate) fn readme(system: System, builds: &[Build]) -> String {
    let standalone = builds.iter().any(Build::is_standalone);
    let mut lines = vec![
        format!("Promenade {} for {}", env!("CARGO_PKG_VERSION"), system.name()),
        String::new(),
        "A spatialiser: it makes a dry track sound as it would in a real room, for a listener who walks and turns.".to_owned(),
        String::new(),
        "WHAT IS HERE".to_owned(),
        String::new(),
    ];
    let program = |name: &str| format!("bin/{}", system.program(name));
    let mut contents = vec![
        ("Promenade.clap".to_owned(), "the plugin for CLAP hosts"),
        ("Promenade.vst3".to_owned(), "the plugin for VST3 hosts; one of the two is enough"),
        ("presets/".to_owned(), "presets for VST3 hosts; CLAP hosts and the editor find them in the plugin"),
        ("scenes/".to_owned(), "places to be in; three more are built into the plugin"),
        (program("promenade"), "the command line: render, bake, measure, simulate, train"),
        ("bin/promenade.wasm".to_owned(), "the engine of pages that the command line makes; it stays beside it"),
        ("examples/".to_owned(), "dry music and speech, and camera paths to walk along"),
        (
            "LICENSE-*, CREDITS.md, licenses/".to_owned(),
            "on which terms you may use and pass on all this, and whose work it is",
        ),
        ("manual/index.html".to_owned(), "the manual, for a browser"),
        ("share/".to_owned(), "completions for shells, and pages for man"),
        ("CHANGELOG.md".to_owned(), "what changed"),
    ];
    if standalone {
        contents.insert(5, (program("promenade-standalone"), "the plugin as a program, without a host"));
    }
    lines.extend(contents.into_iter().map(|(name, what)| format!("  {name:34} {what}")));
    lines.extend(["", "INSTALL", "", "Close your host."].map(str::to_owned));
    lines.extend(before(system).iter().map(|line| (*line).to_owned()));
    let shell = if system == System::Windows { "PowerShell" } else { "a terminal" };
    lines.push(format!("Then copy to these folders of yours; in {shell}, in the folder of this file:"));
    lines.push(String::new());
    lines.extend(commands(system).into_iter().map(|command| format!("  {command}")));
    lines.push(String::new());
    lines.push(
        "Start your host, let it scan for plugins if it does not by itself, and insert Promenade as the last effect of a"
            .to_owned(),
    );
    lines.push(
        "track with a stereo output. To remove it, delete what you have copied. A preset of your own that has the name of"
            .to_owned(),
    );
    lines.push("one of these is replaced: give it another name first.".to_owned());
    lines.extend(["", "TRY IT WITHOUT A HOST", ""].map(str::to_owned));
    let tool = match system {
        System::Windows => ".\\bin\\promenade.exe".to_owned(),
        _ => "./bin/promenade".to_owned(),
    };
    lines.push(format!("  {tool} render examples/loft.promenade examples/phrase.flac walk.wav --path examples/loft.json"));
    lines.extend([
        "".to_owned(),
        "The manual is manual/index.html; it begins with manual/quick-start.html.".to_owned(),
        String::new(),
    ]);
    lines.join(if system == System::Windows { "\r\n" } else { "\n" })
}

/// What a system asks for before files from elsewhere are run.
fn before(system: System) -> &'static [&'static str] {
    match system {
        System::Linux => &[],
        System::MacOs => &[
            "These files are not notarised by Apple. macOS runs them once this mark of a download is taken off:",
            "",
            "  xattr -dr com.apple.quarantine .",
            "",
        ],
        System::Windows => &[
            "These files are not signed. In the Properties of the .zip file tick \"Unblock\" before you unpack it, or Windows \
             asks at",
            "each start.",
            "",
        ],
    }
}

/// Commands that install, in sh or in PowerShell.
fn commands(system: System) -> Vec<String> {
    let what = |place: Place| match place {
        Place::Clap => "Promenade.clap",
        Place::Vst3 => "Promenade.vst3",
        Place::Presets => "presets/*",
        Place::Scenes => "scenes/*",
        Place::Programs => "bin/*",
    };
    let both = |place: Place| {
        let folder = place.in_shell(system);
        match system {
            System::Windows => [
                format!("New-Item -Force -ItemType Directory \"{folder}\" | Out-Null"),
                format!("Copy-Item -Force -Recurse {} \"{folder}\"", what(place)),
            ],
            _ => [format!("mkdir -p \"{folder}\""), format!("cp -R {} \"{folder}/\"", what(place))],
        }
    };
    Place::ALL.into_iter().flat_map(both).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundle::BUILDS;
    use crate::manifest::{self, Item};
    use std::path::Path;
    use std::process::Command;
    use std::{fs, io};

    #[test]
    fn each_system_is_told_its_folders() {
        for (system, folders) in [
            (
                System::Linux,
                ["$HOME/.clap", "$HOME/.vst3\"", ".vst3/presets/Promenade/Promenade", ".local/share}/promenade/scenes"],
            ),
            (
                System::MacOs,
                [
                    "Plug-Ins/CLAP",
                    "Plug-Ins/VST3",
                    "Library/Audio/Presets/Promenade/Promenade",
                    "Application Support/promenade/scenes",
                ],
            ),
            (
                System::Windows,
                [
                    "$env:LOCALAPPDATA\\Programs\\Common\\CLAP",
                    "Common\\VST3",
                    "VST3 Presets\\Promenade",
                    "$env:APPDATA\\promenade\\scenes",
                ],
            ),
        ] {
            let text = readme(system, &BUILDS);
            for folder in folders {
                assert!(text.contains(folder), "{folder} in {text}");
            }
            assert!(text.contains("promenade-standalone") && text.contains(system.name()));
            assert!(!readme(system, &BUILDS[..2]).contains("promenade-standalone"));
            assert!(text.lines().all(|line| line.chars().count() <= 140), "{text}");
        }
    }

    /// Follows the text in an archive's folder as a new user, and compares with what the installer says is installed where.
    #[cfg(target_os = "linux")]
    #[test]
    fn who_follows_it_has_all_that_the_installer_installs() -> io::Result<()> {
        let kept = tempfile::tempdir()?;
        let (archive, home) = (kept.path().join("archive"), kept.path().join("home"));
        let items = manifest::installed(&crate::root(), Path::new("bundles"), &["bin/promenade".into()]).unwrap();
        for item in &items {
            let path = archive.join(&item.to);
            fs::create_dir_all(path.parent().unwrap())?;
            if item.place == Some(Place::Vst3) { fs::create_dir(path)? } else { fs::write(path, "")? }
        }
        let script = commands(System::Linux).join("\n");
        let status =
            Command::new("sh").args(["-e", "-c", &script]).current_dir(&archive).env_clear().env("HOME", &home).status()?;
        assert!(status.success());
        let folder = |place| match place {
            Place::Clap => ".clap",
            Place::Vst3 => ".vst3",
            Place::Presets => ".vst3/presets/Promenade/Promenade",
            Place::Scenes => ".local/share/promenade/scenes",
            Place::Programs => ".local/bin",
        };
        for Item { from, place, .. } in items {
            let path = home.join(folder(place.unwrap())).join(from.file_name().unwrap());
            assert!(path.exists(), "{}", path.display());
        }
        Ok(())
    }
}
