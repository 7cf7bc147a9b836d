//! What a user wants of every editor on a machine: one file among the user's settings.

use crate::library::file::{read_limited, write_whole};
use crate::project::settings::Theme;
use crate::worker::lock::lock;
use nice_plug::nice_warn;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Mutex;

/// The least and the greatest scale.
pub const SCALES: (f32, f32) = (0.75, 3.0);
/// A larger file is none of ours, bytes.
const LARGEST_FILE: u64 = 1 << 16;

/// What they are in this process, once the file was read.
static NOW: Mutex<Preferences> = Mutex::new(Preferences { theme: Theme::Dark, scale: 1.0 });

/// How every editor looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// Light or dark.
    pub theme: Theme,
    /// Size of everything, 1 for as it comes, within [`SCALES`].
    pub scale: f32,
}

impl Default for Preferences {
    fn default() -> Self {
        Self { theme: Theme::default(), scale: 1.0 }
    }
}

fn file() -> Option<PathBuf> {
    dirs::config_dir().map(|folder| folder.join("promenade").join("editor.json"))
}

impl Preferences {
    /// Those of the process: open editors look alike.
    pub fn now() -> Self {
        *lock(&NOW)
    }

    /// Reads the file again, as each editor that is opened does: other processes write it too. One that cannot be read changes
    /// nothing.
    pub fn read() -> Self {
        let read = file().and_then(|file| read_limited(&file, LARGEST_FILE).ok());
        if let Some(read) = read.and_then(|bytes| serde_json::from_slice::<Self>(&bytes).ok()) {
            let scale = if read.scale.is_finite() { read.scale.clamp(SCALES.0, SCALES.1) } else { 1.0 };
            *lock(&NOW) = Self { scale, ..read };
        }
        Self::now()
    }

    /// Makes them those of the process and of the file.
    pub fn set(self) {
        *lock(&NOW) = self;
        let Some(file) = file() else { return };
        let folder = file.parent().map_or(Ok(()), std::fs::create_dir_all);
        let bytes = serde_json::to_vec(&self).map_err(std::io::Error::other);
        if let Err(error) = folder.and_then(|()| write_whole(&file, &bytes?)) {
            nice_warn!("{}: the editor's look cannot be kept: {error}", file.display());
        }
    }
}
