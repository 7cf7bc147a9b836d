//! Pictures in: red, green and blue of each pixel as they are shown.

use anyhow::{Context, Result, bail};
use image::{ImageReader, Limits};
use promenade_metrics::Plane;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Most pixels.
const MOST_PIXELS: u32 = 1 << 26;
const MOST_SIDE: u32 = 1 << 16;

/// Red, green and blue, 0 to 1.
pub(crate) fn read(path: &Path) -> Result<[Plane; 3]> {
    let file = BufReader::new(File::open(path).with_context(|| format!("{}: cannot be read", path.display()))?);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) { linear(path, file) } else { coded(path, file) }
}

fn checked(path: &Path, width: u32, height: u32) -> Result<[usize; 2]> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > u64::from(MOST_PIXELS) || width > MOST_SIDE || height > MOST_SIDE {
        bail!("{}: expected 1 to {MOST_PIXELS} pixels, found {width} x {height}", path.display());
    }
    Ok([width as usize, height as usize])
}

fn planes(size: [usize; 2], colours: Vec<[f32; 3]>) -> Result<[Plane; 3]> {
    let of = |channel: usize| colours.iter().map(|c| c[channel]).collect();
    match [0, 1, 2].map(|channel| Plane::new(size, of(channel))) {
        [Some(red), Some(green), Some(blue)] => Ok([red, green, blue]),
        _ => bail!("a picture has other pixels than its size"),
    }
}

fn coded(path: &Path, file: BufReader<File>) -> Result<[Plane; 3]> {
    let mut reader =
        ImageReader::new(file).with_guessed_format().with_context(|| format!("{}: cannot be read", path.display()))?;
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MOST_SIDE), Some(MOST_SIDE));
    reader.limits(limits);
    let picture = reader.decode().with_context(|| format!("{}: expected a picture, PNG, JPEG or EXR", path.display()))?;
    let size = checked(path, picture.width(), picture.height())?;
    planes(size, picture.into_rgb32f().pixels().map(|pixel| pixel.0).collect())
}

/// Linear light is shown as sRGB shows it (IEC 61966-2-1); what is brighter than white is white.
fn shown(linear: f32) -> f32 {
    let light = if linear.is_finite() { linear.clamp(0.0, 1.0) } else { 0.0 };
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

fn linear(path: &Path, file: BufReader<File>) -> Result<[Plane; 3]> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let meta = exr::meta::MetaData::read_from_file(path, false)
        .with_context(|| format!("{}: expected an OpenEXR file", path.display()))?;
    for header in &meta.headers {
        let side = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        checked(path, side(header.layer_size.0), side(header.layer_size.1))?;
    }
    let picture = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.0, vec![[0.0_f32; 3]; size.0 * size.1]),
            |(width, pixels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.1 * *width + at.0] = [r, g, b].map(shown);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .with_context(|| format!("{}: expected red, green and blue", path.display()))?;
    let size = picture.layer_data.size;
    planes([size.0, size.1], picture.layer_data.channel_data.pixels.1)
}
