//! A training on disk: weights, moments and settings in one file, from which it goes on as if it had never stopped. The file is
//! safetensors with a checksum after it.

use crate::settings::TrainSettings;
use crate::weights::{AdamW, Arrays};
use promenade_baker::{BakeError, atomic, file};
use promenade_core::network::Tensor;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::Path;

/// Key of the metadata, a single one so that equal states are equal files.
const KEY: &str = "promenade_training";
const VERSION: u32 = 3;
/// Prefixes of the arrays.
const PARTS: [&str; 3] = ["weights.", "first.", "second."];
/// The largest file that is read.
const MAX_BYTES: u64 = 4 << 30;

/// What a training needs to go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// How it is trained.
    pub settings: TrainSettings,
    /// Weights by name.
    pub weights: Arrays,
    /// The optimiser's state.
    pub optimiser: AdamW,
    /// The loss curve: a point per evaluation of the test clips.
    pub curve: Vec<CurvePoint>,
    /// Losses of the steps since the curve's last point.
    pub losses: Vec<f64>,
    /// Tells captures apart: a training goes on with its own.
    pub capture: u64,
}

/// A point of the loss curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurvePoint {
    /// Steps done.
    pub step: usize,
    /// Mean loss of the steps since the point before.
    pub loss: f64,
    /// MAG, LRE and ENV of the test clips.
    pub test: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    version: u32,
    steps: usize,
    settings: TrainSettings,
    curve: Vec<CurvePoint>,
    losses: Vec<f64>,
    capture: u64,
}

impl Checkpoint {
    /// Writes it whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), BakeError> {
        let unwritten =
            |source: Box<dyn std::error::Error + Send + Sync>| BakeError::unreadable(path, "training to write", source);
        let header = Header {
            version: VERSION,
            steps: self.optimiser.steps,
            settings: self.settings.clone(),
            curve: self.curve.clone(),
            losses: self.losses.clone(),
            capture: self.capture,
        };
        let header = serde_json::to_string(&header).map_err(|e| unwritten(e.into()))?;
        let [first, second] = &self.optimiser.moments;
        let arrays = PARTS.iter().zip([&self.weights, first, second]).flat_map(|(part, arrays)| {
            arrays.iter().map(move |(name, tensor)| {
                let bytes: Vec<u8> = tensor.values.iter().flat_map(|v| v.to_le_bytes()).collect();
                (format!("{part}{name}"), tensor.shape.clone(), bytes)
            })
        });
        let arrays: Vec<_> = arrays.collect();
        let views = arrays.iter().map(|(name, shape, bytes)| Ok((name, TensorView::new(Dtype::F32, shape.clone(), bytes)?)));
        let views: Result<Vec<_>, safetensors::SafeTensorError> = views.collect();
        let views = views.map_err(|e| unwritten(e.into()))?;
        let mut file =
            safetensors::serialize(views, Some(HashMap::from([(KEY.to_owned(), header)]))).map_err(|e| unwritten(e.into()))?;
        file.extend(crc32fast::hash(&file).to_le_bytes());
        atomic::replace(path, &file)
    }

    /// Reads one.
    ///
    /// # Errors
    /// A file that is missing, damaged, too large, or no training of this version. The message names the file.
    pub fn load(path: &Path) -> Result<Self, BakeError> {
        let bytes = file::read(path, MAX_BYTES).map_err(BakeError::read(path))?;
        let damaged = |e: safetensors::SafeTensorError| BakeError::content(path, "a training", e.to_string());
        let whole =
            bytes.split_last_chunk::<4>().filter(|(content, checksum)| crc32fast::hash(content).to_le_bytes() == **checksum);
        let Some((bytes, _)) = whole else {
            let expected = format!("a training of version {VERSION}, whole");
            return Err(BakeError::content(path, expected, "a damaged file or an older version (--restart begins anew)"));
        };
        let (_, head) = SafeTensors::read_metadata(bytes).map_err(damaged)?;
        let text = head.metadata().as_ref().and_then(|m| m.get(KEY));
        let Some(text) = text else {
            return Err(BakeError::content(path, "a training", "a safetensors file without one".to_owned()));
        };
        let header: Header = serde_json::from_str(text)
            .map_err(|e| BakeError::content(path, format!("a training of version {VERSION}"), e.to_string()))?;
        if header.version != VERSION {
            let found = format!("version {}", header.version);
            return Err(BakeError::content(path, format!("a training of version {VERSION}"), found));
        }
        let tensors = SafeTensors::deserialize(bytes).map_err(damaged)?;
        let mut parts = [Arrays::new(), Arrays::new(), Arrays::new()];
        for (name, view) in tensors.iter() {
            let place = PARTS.iter().zip(&mut parts).find_map(|(part, arrays)| Some((name.strip_prefix(part)?, arrays)));
            let Some((name, arrays)) = place.filter(|_| view.dtype() == Dtype::F32) else {
                return Err(BakeError::content(path, "weights and moments of 32 bits", format!("'{name}'")));
            };
            let values = view.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
            arrays.insert(name.to_owned(), Tensor { shape: view.shape().to_vec(), values });
        }
        let [weights, first, second] = parts;
        let optimiser = AdamW { moments: [first, second], steps: header.steps };
        let Header { settings, curve, losses, capture, .. } = header;
        Ok(Self { settings, weights, optimiser, curve, losses, capture })
    }
}
