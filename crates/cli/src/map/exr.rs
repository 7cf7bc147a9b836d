//! Numbers by place as OpenEXR, for programs that go on with them.

use anyhow::{Context, Result};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage};
use promenade_baker::atomic;
use std::io::Cursor;
use std::path::Path;

/// Writes named channels of `width * height` numbers each, row by row from above; NaN where there is none.
///
/// # Panics
/// A channel has another length.
pub(super) fn write(path: &Path, [width, height]: [usize; 2], channels: Vec<(&str, Vec<f32>)>) -> Result<()> {
    assert!(channels.iter().all(|(_, samples)| samples.len() == width * height), "a number for each pixel");
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, FlatSamples::F32(samples)));
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new((width, height), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).with_context(|| format!("{}: not written", path.display()))?;
    Ok(atomic::write(path, bytes.get_ref())?)
}
