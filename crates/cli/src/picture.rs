//! Pictures in: red, green and blue of each pixel as they are shown.

use anyhow::{Context, Result, bail};
use promenade_metrics::Plane;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

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

/// PNG or JPEG, by how the file begins.
fn coded(path: &Path, mut file: BufReader<File>) -> Result<[Plane; 3]> {
    let head = file.fill_buf().with_context(|| format!("{}: cannot be read", path.display()))?;
    if head.starts_with(&[0xff, 0xd8]) { jpeg(path, file) } else { png(path, file) }
}

fn none(path: &Path) -> String {
    format!("{}: expected a picture, PNG, JPEG or EXR", path.display())
}

fn jpeg(path: &Path, file: BufReader<File>) -> Result<[Plane; 3]> {
    let side = MOST_SIDE as usize;
    let options = DecoderOptions::default().set_max_width(side).set_max_height(side);
    let mut decoder = JpegDecoder::new_with_options(file, options.jpeg_set_out_colorspace(ColorSpace::RGB));
    decoder.decode_headers().with_context(|| none(path))?;
    let info = decoder.info().with_context(|| none(path))?;
    let size = checked(path, info.width.into(), info.height.into())?;
    let pixels = decoder.decode().with_context(|| none(path))?;
    planes(size, pixels.as_chunks().0.iter().map(|p: &[u8; 3]| p.map(|x| f32::from(x) / 255.0)).collect())
}

fn png(path: &Path, file: BufReader<File>) -> Result<[Plane; 3]> {
    let mut decoder = png::Decoder::new(file);
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().with_context(|| none(path))?;
    let size = checked(path, reader.info().width, reader.info().height)?;
    let mut bytes = vec![0; reader.output_buffer_size().with_context(|| none(path))?];
    let frame = reader.next_frame(&mut bytes).with_context(|| none(path))?;
    let bytes = &bytes[..frame.buffer_size()];
    let samples: Vec<f32> = match frame.bit_depth {
        png::BitDepth::Sixteen => bytes.as_chunks().0.iter().map(|b| f32::from(u16::from_be_bytes(*b)) / 65_535.0).collect(),
        _ => bytes.iter().map(|b| f32::from(*b) / 255.0).collect(),
    };
    let colour = |pixel: &[f32]| match *pixel {
        [red, green, blue, ..] => [red, green, blue],
        [grey, ..] => [grey; 3],
        [] => [0.0; 3],
    };
    planes(size, samples.chunks(frame.color_type.samples()).map(colour).collect())
}

/// Linear light, 0 to 1, of red, green and blue as they are shown.
pub(crate) fn light(shown: &[Plane; 3]) -> [Plane; 3] {
    let light = |v: f32| if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    shown.each_ref().map(|plane| Plane { of: plane.of.iter().map(|v| light(*v)).collect(), ..*plane })
}

/// Linear light is shown as sRGB shows it (IEC 61966-2-1); what is brighter than white is white.
pub(crate) fn shown(linear: f32) -> f32 {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// 16 by 16 pixels, the left half (200, 40, 30), the right half (30, 40, 200).
    const JPEG: &str = "\
ffd8ffe000104a46494600010100000100010000ffdb004300080606070605080707070909080a0c140d0c0b0b0c1912130f141d1a1f1e1d\
1a1c1c20242e2720222c231c1c2837292c30313434341f27393d38323c2e333432ffdb0043010909090c0b0c180d0d1832211c2132323232\
32323232323232323232323232323232323232323232323232323232323232323232323232323232323232323232ffc00011080010001003\
011100021101031101ffc40014000100000000000000000000000000000006ffc40014100100000000000000000000000000000000ffc400\
1501010100000000000000000000000000000705ffc40014110100000000000000000000000000000000ffda000c03010002110311003f00\
2c86481f3289c8034581f3289dffd9";

    fn found(folder: &Path, bytes: &[u8]) -> Result<[Plane; 3]> {
        let path = folder.join("picture");
        std::fs::write(&path, bytes).unwrap();
        read(&path)
    }

    /// Red, green and blue of a pixel, of 255.
    fn at(planes: &[Plane; 3], x: usize, y: usize) -> [f32; 3] {
        planes.each_ref().map(|plane| 255.0 * plane.of[y * plane.width + x])
    }

    #[test]
    fn photographs_have_their_colours() {
        let folder = tempfile::tempdir().unwrap();
        let whole: Vec<u8> = (0..JPEG.len()).step_by(2).map(|i| u8::from_str_radix(&JPEG[i..i + 2], 16).unwrap()).collect();
        let planes = found(folder.path(), &whole).unwrap();
        for (x, colour) in [(2, [200.0, 40.0, 30.0]), (13, [30.0, 40.0, 200.0])] {
            let apart = at(&planes, x, 7).iter().zip(colour).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart < 4.0, "{:?}", at(&planes, x, 7));
        }
        for cut in [0, 2, 40, 150] {
            let error = format!("{:#}", found(folder.path(), &whole[..cut]).unwrap_err());
            assert!(error.contains("expected a picture, PNG, JPEG or EXR"), "{cut}: {error}");
        }
    }

    #[test]
    fn every_form_of_png_has_three_colours() {
        let folder = tempfile::tempdir().unwrap();
        for (colour, depth, row) in [
            (png::ColorType::Grayscale, png::BitDepth::Two, &[0b1000_0000][..]),
            (png::ColorType::GrayscaleAlpha, png::BitDepth::Eight, &[170, 255, 0, 255]),
            (png::ColorType::Rgb, png::BitDepth::Eight, &[170, 170, 170, 0, 0, 0]),
            (png::ColorType::Rgba, png::BitDepth::Sixteen, &[170; 16]),
            (png::ColorType::Indexed, png::BitDepth::Eight, &[1, 0]),
        ] {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
            encoder.set_color(colour);
            encoder.set_depth(depth);
            encoder.set_palette(vec![0, 0, 0, 170, 170, 170]);
            encoder.write_header().unwrap().write_image_data(row).unwrap();
            let planes = found(folder.path(), &bytes).unwrap();
            assert_eq!([planes[0].width, planes[0].height], [2, 1]);
            assert_eq!(at(&planes, 0, 0), [170.0; 3], "{colour:?} {depth:?}");
        }
    }
}
