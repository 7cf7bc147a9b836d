//! A glTF file: its JSON and the bytes of its buffers.

use crate::PathFileError;
use crate::limit::MAX_FILE_BYTES;
use crate::options::Beside;
use crate::text::quoted;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::binary::Glb;
use gltf::json::Root;
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::fmt::Display;

pub(super) struct Document<'a, 'b> {
    pub(super) file: &'a str,
    pub(super) root: Root,
    /// The chunk of bytes in a GLB file.
    chunk: Option<Cow<'a, [u8]>>,
    /// Buffers that were read, by their number.
    buffers: Vec<Option<Vec<u8>>>,
    beside: &'a mut Beside<'b>,
}

impl<'a, 'b> Document<'a, 'b> {
    pub(super) fn new(file: &'a str, bytes: &'a [u8], beside: &'a mut Beside<'b>) -> Result<Self, PathFileError> {
        let (json, chunk) = if bytes.starts_with(b"glTF") {
            // The reader subtracts the header's length from the file's without a look.
            let length = bytes.get(8..12).and_then(|l| l.try_into().ok()).map(u32::from_le_bytes);
            if length.is_none_or(|l| l < 12) {
                return Err(PathFileError::content(file, "a GLB file with its header", format!("{} bytes", bytes.len())));
            }
            let glb = Glb::from_slice(bytes).map_err(|source| PathFileError::unreadable(file, "glTF file", source))?;
            (glb.json, glb.bin)
        } else {
            (Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)), None)
        };
        let root: Root = serde_json::from_slice(&json).map_err(PathFileError::json(file))?;
        if !root.asset.version.starts_with("2.") {
            return Err(PathFileError::content(file, "glTF of version 2", format!("version {}", quoted(&root.asset.version))));
        }
        let buffers = vec![None; root.buffers.len()];
        Ok(Self { file, root, chunk, buffers, beside })
    }

    /// An error that blames a part of the file.
    pub(super) fn wrong(&self, place: impl Display, expected: impl Display, found: impl Display) -> PathFileError {
        PathFileError::entry(self.file, place, expected, found)
    }

    /// The bytes of a buffer, read when they are first asked for.
    pub(super) fn buffer(&mut self, index: usize) -> Result<&[u8], PathFileError> {
        let place = format!("buffer {index}");
        let Some(buffer) = self.root.buffers.get(index) else {
            return Err(self.wrong(place, format!("one of {} buffers", self.root.buffers.len()), "none of this number"));
        };
        let length = buffer.byte_length.0;
        if self.buffers[index].is_none() {
            let bytes = match (&buffer.uri, &self.chunk) {
                (Some(uri), _) => {
                    let uri = uri.clone();
                    self.fetch(&place, &uri)?
                }
                (None, Some(chunk)) if index == 0 => chunk.to_vec(),
                (None, _) => return Err(self.wrong(place, "the bytes of a GLB file, a data URI or a file's name", "none")),
            };
            if (bytes.len() as u64) < length {
                return Err(self.wrong(place, format!("{length} bytes"), bytes.len().to_string()));
            }
            self.buffers[index] = Some(bytes);
        }
        Ok(self.buffers[index].as_deref().unwrap_or_default())
    }

    fn fetch(&mut self, place: &str, uri: &str) -> Result<Vec<u8>, PathFileError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let coded = data.split_once(',').filter(|(kind, _)| kind.ends_with(";base64"));
            let (_, coded) = coded.ok_or_else(|| self.wrong(place, "a data URI in base64", quoted(uri)))?;
            return STANDARD.decode(coded).map_err(|e| self.wrong(place, "a data URI in base64", e.to_string()));
        }
        let name = percent_decode_str(uri).decode_utf8_lossy();
        // A file from elsewhere must not choose among all files of this machine.
        let elsewhere = name.is_empty()
            || name.starts_with(['/', '\\'])
            || name.contains(':')
            || name.split(['/', '\\']).any(|part| part == "..");
        if elsewhere {
            return Err(self.wrong(place, "the name of a file beside it or below", quoted(uri)));
        }
        let bytes = (self.beside)(&name).map_err(PathFileError::at(self.file, format!("its buffer {uri} cannot be read")))?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(self.wrong(place, format!("at most {MAX_FILE_BYTES} bytes"), bytes.len().to_string()));
        }
        Ok(bytes)
    }
}
