//! The systems that bundles are made for, and where their users keep plugins, presets and scenes.

use anyhow::{Context, Result, bail};
use std::path::PathBuf;

/// An operating system with hosts for plugins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum System {
    Linux,
    MacOs,
    Windows,
}

impl System {
    /// That of a target's name, such as `x86_64-pc-windows-gnu`.
    pub(crate) fn of_target(target: &str) -> Result<Self> {
        let known = [("linux", Self::Linux), ("darwin", Self::MacOs), ("windows", Self::Windows)];
        let part = target.split('-').find_map(|part| known.iter().find(|(name, _)| *name == part));
        part.map(|(_, system)| *system).with_context(|| format!("where plugins go is not known for {target}"))
    }

    /// The one this runs on.
    pub(crate) fn here() -> Result<Self> {
        match std::env::consts::OS {
            "linux" => Ok(Self::Linux),
            "macos" => Ok(Self::MacOs),
            "windows" => Ok(Self::Windows),
            os => bail!("where plugins go on {os} is not known; copy the bundles from target/bundled by hand"),
        }
    }

    /// Its name in sentences.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Linux => "Linux",
            Self::MacOs => "macOS",
            Self::Windows => "Windows",
        }
    }

    /// The file name of a program.
    pub(crate) fn program(self, name: &str) -> String {
        if self == Self::Windows { format!("{name}.exe") } else { name.to_owned() }
    }
}

/// What a user's host or the plugin looks for in a folder of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Place {
    /// CLAP plugins.
    Clap,
    /// VST3 plugins.
    Vst3,
    /// Presets of this plugin.
    Presets,
    /// Scenes and camera paths of this plugin.
    Scenes,
    /// Programs for a terminal.
    Programs,
}

/// Where a folder begins.
#[derive(Clone, Copy)]
enum Base {
    Home,
    Documents,
    Data,
    LocalData,
}

impl Place {
    pub(crate) const ALL: [Self; 5] = [Self::Clap, Self::Vst3, Self::Presets, Self::Scenes, Self::Programs];

    /// The user's own folder, which needs no administrator.
    ///
    /// Sources: CLAP's `entry.h`, the VST 3 developer portal's "Plug-in locations" and "Preset locations", for programs
    /// systemd's `file-hierarchy(7)` and the Windows known folder `UserProgramFiles`.
    fn parts(self, system: System) -> (Base, &'static [&'static str]) {
        match (self, system) {
            (Self::Clap, System::Linux) => (Base::Home, &[".clap"]),
            (Self::Vst3, System::Linux) => (Base::Home, &[".vst3"]),
            (Self::Presets, System::Linux) => (Base::Home, &[".vst3", "presets", "Promenade", "Promenade"]),
            (Self::Clap, System::MacOs) => (Base::Home, &["Library", "Audio", "Plug-Ins", "CLAP"]),
            (Self::Vst3, System::MacOs) => (Base::Home, &["Library", "Audio", "Plug-Ins", "VST3"]),
            (Self::Presets, System::MacOs) => (Base::Home, &["Library", "Audio", "Presets", "Promenade", "Promenade"]),
            (Self::Clap, System::Windows) => (Base::LocalData, &["Programs", "Common", "CLAP"]),
            (Self::Vst3, System::Windows) => (Base::LocalData, &["Programs", "Common", "VST3"]),
            (Self::Presets, System::Windows) => (Base::Documents, &["VST3 Presets", "Promenade", "Promenade"]),
            (Self::Scenes, _) => (Base::Data, &["promenade", "scenes"]),
            (Self::Programs, System::Linux | System::MacOs) => (Base::Home, &[".local", "bin"]),
            (Self::Programs, System::Windows) => (Base::LocalData, &["Programs", "Promenade"]),
        }
    }

    /// This user's folder on this system.
    pub(crate) fn folder(self) -> Result<PathBuf> {
        let (base, rest) = self.parts(System::here()?);
        let (found, name) = match base {
            Base::Home => (dirs::home_dir(), "home"),
            Base::Documents => (dirs::document_dir(), "documents"),
            Base::Data => (dirs::data_dir(), "data"),
            Base::LocalData => (dirs::data_local_dir(), "local data"),
        };
        let found = found.with_context(|| format!("the user's {name} folder is not known"))?;
        Ok(rest.iter().fold(found, |folder, part| folder.join(part)))
    }

    /// The folder as a shell of that system understands it: sh, or PowerShell.
    pub(crate) fn in_shell(self, system: System) -> String {
        let (base, rest) = self.parts(system);
        let start = match (base, system) {
            (Base::Home | Base::Documents, System::Linux | System::MacOs) => "$HOME",
            (Base::Data | Base::LocalData, System::Linux) => "${XDG_DATA_HOME:-$HOME/.local/share}",
            (Base::Data | Base::LocalData, System::MacOs) => "$HOME/Library/Application Support",
            (Base::Home, System::Windows) => "$HOME",
            (Base::Documents, System::Windows) => "$([Environment]::GetFolderPath('MyDocuments'))",
            (Base::Data, System::Windows) => "$env:APPDATA",
            (Base::LocalData, System::Windows) => "$env:LOCALAPPDATA",
        };
        let separator = if system == System::Windows { "\\" } else { "/" };
        [&[start], rest].concat().join(separator)
    }

    /// What it holds, for a reader.
    pub(crate) fn holds(self) -> &'static str {
        match self {
            Self::Clap => "CLAP plugins",
            Self::Vst3 => "VST3 plugins",
            Self::Presets => "presets, for VST3 hosts and for the editor",
            Self::Scenes => "scenes",
            Self::Programs => "programs",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_name_their_system() {
        for (target, system) in [
            ("x86_64-pc-windows-gnu", System::Windows),
            ("aarch64-apple-darwin", System::MacOs),
            ("aarch64-unknown-linux-gnu", System::Linux),
        ] {
            assert_eq!(System::of_target(target).unwrap(), system);
        }
        assert!(System::of_target("wasm32-unknown-unknown").unwrap_err().to_string().contains("wasm32"));
    }

    #[test]
    fn the_plugin_looks_where_the_installer_writes() {
        assert_eq!(promenade_plugin::library::folders().last(), Some(&Place::Scenes.folder().unwrap()));
        assert_eq!(promenade_plugin::history::presets::folder().unwrap(), Place::Presets.folder().unwrap());
    }

    #[test]
    fn a_shell_and_the_installer_name_the_same_folders() {
        // What `dirs` says here, beside what a shell makes of the text.
        if cfg!(not(unix)) {
            return;
        }
        for place in Place::ALL {
            let text = format!("printf %s \"{}\"", place.in_shell(System::here().unwrap()));
            let out = std::process::Command::new("sh").args(["-c", &text]).output().unwrap();
            assert_eq!(PathBuf::from(String::from_utf8(out.stdout).unwrap()), place.folder().unwrap());
        }
    }
}
