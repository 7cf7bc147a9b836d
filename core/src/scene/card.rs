//! What a scene file says about itself in its head, without its tensors.

use super::Provenance;
use super::error::SceneError;
use super::format::{MANIFEST, manifest};
use serde::Deserialize;
use std::collections::HashMap;

/// Bytes at the start of a file that say how long its head is.
const PREFIX: usize = 8;
/// A longer head is refused unread, bytes.
const MAX_HEAD: usize = 1 << 26;

/// A scene file by what it says about itself, to list it. Its tensors may still be damaged.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCard {
    /// Where it comes from.
    pub provenance: Provenance,
    /// The rate that it was measured, simulated or trained at, hertz: above half of it it knows nothing.
    pub sample_rate_hz: f64,
    /// Number of measurements kept for judging it.
    pub held_out: usize,
}

/// The part of the container's header that is not about tensors.
#[derive(Deserialize)]
struct Header {
    #[serde(rename = "__metadata__", default)]
    metadata: HashMap<String, String>,
}

impl SceneCard {
    /// How many bytes from the start of a file its head takes, by the file's first 8 bytes.
    ///
    /// # Errors
    /// Fewer bytes, or a length that no scene's head has.
    pub fn head_len(bytes: &[u8]) -> Result<usize, SceneError> {
        let too_short = || SceneError::Container(format!("expected at least {PREFIX} bytes, found {}", bytes.len()));
        let prefix = bytes.first_chunk::<PREFIX>().ok_or_else(too_short)?;
        let length = u64::from_le_bytes(*prefix);
        usize::try_from(length).ok().filter(|length| *length <= MAX_HEAD).map(|length| PREFIX + length).ok_or_else(|| {
            SceneError::Container(format!("expected a header of at most {MAX_HEAD} bytes, found one of {length}"))
        })
    }

    /// Reads the head of a scene file; more than the head does no harm.
    ///
    /// # Errors
    /// Says what is damaged or of another version.
    pub fn from_head(bytes: &[u8]) -> Result<Self, SceneError> {
        let end = Self::head_len(bytes)?;
        let cut = || SceneError::Container(format!("expected a head of {end} bytes, found {}", bytes.len()));
        let head = bytes.get(PREFIX..end).ok_or_else(cut)?;
        let header: Header = serde_json::from_slice(head).map_err(|e| SceneError::Container(e.to_string()))?;
        let text = header.metadata.get(MANIFEST);
        let text = text.ok_or_else(|| SceneError::Manifest(format!("no '{MANIFEST}' in the metadata")))?;
        let m = manifest(text)?;
        Ok(Self { provenance: m.provenance(), sample_rate_hz: m.grid.sample_rate_hz, held_out: m.held_out.len() })
    }
}
