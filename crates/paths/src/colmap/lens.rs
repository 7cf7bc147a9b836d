//! The lenses of a COLMAP model: `cameras.txt` or `cameras.bin`.

use super::binary::Rest;
use crate::PathFileError;
use crate::text::{self, quoted};
use glam::DVec3;
use std::collections::BTreeMap;

/// Kinds of lenses by their number in the binary form, with how many numbers each has.
const KINDS: [(&str, usize); 5] = [("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8)];
const NAMES: &str = "SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV";
/// Lenses, and pixels along a side, at most.
const MOST: u64 = 1 << 20;

/// What a camera makes of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Pixels of a photograph.
    pub size: [u32; 2],
    /// Focal lengths, pixels.
    focal: [f64; 2],
    /// Where the axis meets the photograph, pixels.
    centre: [f64; 2],
    /// Radial distortion by the second and the fourth power of the distance from the axis.
    radial: [f64; 2],
    /// Tangential distortion.
    tangential: [f64; 2],
}

impl Lens {
    fn new(kind: usize, size: [u64; 2], n: &[f64]) -> Result<Self, String> {
        if !n.iter().all(|v| v.is_finite()) {
            return Err(format!("{n:?}"));
        }
        let side = |v: u64| u32::try_from(v).ok().filter(|v| (1..=MOST).contains(&u64::from(*v)));
        let [Some(width), Some(height)] = size.map(side) else { return Err(format!("{size:?} pixels")) };
        let (focal, rest) = match kind {
            0 | 2 | 3 => ([n[0], n[0]], &n[1..]),
            _ => ([n[0], n[1]], &n[2..]),
        };
        if !focal.iter().all(|f| *f > 0.0) {
            return Err(format!("a focal length of {focal:?} pixels"));
        }
        let more = |i: usize| rest.get(2 + i).copied().unwrap_or(0.0);
        Ok(Self {
            size: [width, height],
            focal,
            centre: [rest[0], rest[1]],
            radial: [more(0), more(1)],
            tangential: [more(2), more(3)],
        })
    }

    /// The pixel, counted from the upper left corner, at which a point is seen that has these places along the camera's axes:
    /// right, down, ahead. None behind the camera, beside the photograph, or where the lens's polynomial turns back.
    #[must_use]
    pub fn pixel(&self, at: DVec3) -> Option<[f64; 2]> {
        if at.z <= 0.0 {
            return None;
        }
        let (x, y) = (at.x / at.z, at.y / at.z);
        let r = x * x + y * y;
        let [k1, k2] = self.radial;
        let [p1, p2] = self.tangential;
        if 1.0 + 3.0 * k1 * r + 5.0 * k2 * r * r <= 0.0 {
            return None;
        }
        let grown = 1.0 + k1 * r + k2 * r * r;
        let own =
            [x * grown + 2.0 * p1 * x * y + p2 * (r + 2.0 * x * x), y * grown + p1 * (r + 2.0 * y * y) + 2.0 * p2 * x * y];
        let pixel: [f64; 2] = std::array::from_fn(|i| self.focal[i] * own[i] + self.centre[i]);
        let inside = |i: usize| pixel[i] >= 0.0 && pixel[i] < f64::from(self.size[i]);
        (inside(0) && inside(1)).then_some(pixel)
    }

    /// This lens for a photograph of another size.
    #[must_use]
    pub fn resized(&self, size: [u32; 2]) -> Self {
        let ratio: [f64; 2] = std::array::from_fn(|i| f64::from(size[i]) / f64::from(self.size[i]));
        let scaled = |of: [f64; 2]| std::array::from_fn(|i| ratio[i] * of[i]);
        Self { size, focal: scaled(self.focal), centre: scaled(self.centre), ..*self }
    }
}

/// The lenses of a COLMAP model by the ids of their cameras. `file` says by its ending whether it is text.
///
/// # Errors
/// A damaged file, or a lens of another kind. The message names the file and the place in it.
pub fn lenses(file: &str, bytes: &[u8]) -> Result<BTreeMap<u32, Lens>, PathFileError> {
    if file.to_lowercase().ends_with(".txt") { of_text(file, bytes) } else { of_binary(file, bytes) }
}

fn of_text(file: &str, bytes: &[u8]) -> Result<BTreeMap<u32, Lens>, PathFileError> {
    let mut all = BTreeMap::new();
    for (line, number) in text::of(file, bytes)?.lines().map(str::trim).zip(1_u64..) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = |expected: &str, found: String| PathFileError::entry(file, format!("line {number}"), expected, found);
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [id, kind, width, height, numbers @ ..] = &words[..] else {
            return Err(wrong("CAMERA_ID MODEL WIDTH HEIGHT PARAMS", quoted(line)));
        };
        let kind = KINDS.iter().position(|(name, _)| name == kind).ok_or_else(|| wrong(NAMES, quoted(kind)))?;
        let numbers: Option<Vec<f64>> = numbers.iter().map(|n| n.parse().ok()).collect();
        let parsed = (id.parse::<u32>().ok(), width.parse().ok(), height.parse().ok(), numbers);
        let (Some(id), Some(width), Some(height), Some(numbers)) = parsed else {
            return Err(wrong("CAMERA_ID MODEL WIDTH HEIGHT PARAMS", quoted(line)));
        };
        if numbers.len() != KINDS[kind].1 {
            return Err(wrong(&format!("{} numbers of {}", KINDS[kind].1, KINDS[kind].0), numbers.len().to_string()));
        }
        all.insert(id, Lens::new(kind, [width, height], &numbers).map_err(|found| wrong("a lens", found))?);
    }
    Ok(all)
}

fn of_binary(file: &str, bytes: &[u8]) -> Result<BTreeMap<u32, Lens>, PathFileError> {
    let mut rest = Rest { file, length: bytes.len(), bytes };
    let count = u64::from_le_bytes(rest.array("the count of cameras")?);
    if count > MOST {
        return Err(PathFileError::entry(file, "byte 0", format!("at most {MOST} cameras"), count.to_string()));
    }
    let mut all = BTreeMap::new();
    for _ in 0..count {
        let place = rest.place();
        let id = u32::from_le_bytes(rest.array("a camera's id")?);
        let number = u32::from_le_bytes(rest.array("a kind of lens")?);
        let kind = usize::try_from(number).ok().filter(|k| *k < KINDS.len());
        let kind = kind.ok_or_else(|| PathFileError::entry(file, place.as_str(), NAMES, format!("number {number}")))?;
        let mut size = [0; 2];
        for side in &mut size {
            *side = u64::from_le_bytes(rest.array("a size")?);
        }
        let mut numbers = vec![0.0; KINDS[kind].1];
        for number in &mut numbers {
            *number = f64::from_le_bytes(rest.array("a lens's numbers")?);
        }
        let lens = Lens::new(kind, size, &numbers).map_err(|found| PathFileError::entry(file, place, "a lens", found))?;
        all.insert(id, lens);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "# CAMERA_ID, MODEL\n1 SIMPLE_RADIAL 1000 750 800 500 375 0.1\n4 OPENCV 640 480 500 510 320 240 0 0 0.01 0\n";

    #[test]
    fn a_lens_says_where_a_point_is_seen() {
        let lenses = lenses("cameras.txt", TEXT.as_bytes()).unwrap();
        let lens = lenses[&1];
        assert_eq!(lens.pixel(DVec3::Z), Some([500.0, 375.0]));
        // 0.5 to the right at 2 ahead: x = 0.25, and the lens adds k x^3 = 0.0015625.
        let [x, y] = lens.pixel(DVec3::new(0.5, 0.0, 2.0)).unwrap();
        assert!((x - (500.0 + 800.0 * 0.251_562_5)).abs() < 1e-9 && y == 375.0, "{x} {y}");
        assert_eq!((lens.pixel(DVec3::NEG_Z), lens.pixel(DVec3::new(2.0, 0.0, 1.0))), (None, None));
        let half = lens.resized([500, 375]).pixel(DVec3::new(0.5, 0.0, 2.0)).unwrap();
        assert!((half[0] - 0.5 * x).abs() < 1e-9);
        // Tangential: y grows by p1 (r^2 + 2 y^2).
        let [_, y] = lenses[&4].pixel(DVec3::new(0.0, 0.1, 1.0)).unwrap();
        assert!((y - (240.0 + 510.0 * (0.1 + 0.01 * 0.03))).abs() < 1e-9, "{y}");
    }

    #[test]
    fn both_forms_say_the_same_and_what_is_wrong_is_named() {
        let mut bytes = 1_u64.to_le_bytes().to_vec();
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(2_u32.to_le_bytes());
        [1000_u64, 750].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        [800.0_f64, 500.0, 375.0, 0.1].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        assert_eq!(lenses("cameras.bin", &bytes).unwrap()[&1], lenses("cameras.txt", TEXT.as_bytes()).unwrap()[&1]);
        for end in 0..bytes.len() {
            assert!(lenses("cameras.bin", &bytes[..end]).is_err());
        }
        for (text, clue) in [
            ("1 FOV 10 10 1 1 1 1 1", "expected SIMPLE_PINHOLE"),
            ("1 PINHOLE 10 10 1 1 1", "expected 4 numbers of PINHOLE, found 3"),
            ("1 PINHOLE 10 0 1 1 1 1", "[10, 0] pixels"),
            ("1 PINHOLE 10 10 0 1 1 1", "a focal length of [0.0, 1.0]"),
            ("1 PINHOLE 10 10 nan 1 1 1", "line 1: expected a lens"),
        ] {
            let error = lenses("cameras.txt", text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(clue), "{text}: {error}");
        }
    }
}
