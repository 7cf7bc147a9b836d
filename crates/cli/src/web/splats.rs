//! Photographs as 3D Gaussian splats, checked before a page takes them.

use anyhow::{Context, Result, anyhow};
use promenade_baker::file;
use std::path::Path;

/// Splats of a file, at most: the graphics card of whoever opens the page keeps 32 bytes of each.
const MOST: usize = 4_000_000;
/// Bytes of a file, at most: as many splats with the harmonics of third order that trainers write.
const MOST_BYTES: u64 = 1 << 30;
/// Bytes of a PLY file's head, at most.
const MOST_HEAD: usize = 1 << 16;
/// Properties of a vertex that are drawn, all of them floats.
const DRAWN: [&str; 14] = [
    "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0", "f_dc_1", "f_dc_2",
];

/// Where the floats of splats lie in a file.
#[derive(Debug, PartialEq)]
struct Layout {
    from: usize,
    stride: usize,
    count: usize,
    floats: Vec<usize>,
}

/// What was expected and what was found.
type Wrong = (String, String);

fn wrong<T>(expected: impl Into<String>, found: impl Into<String>) -> Result<T, Wrong> {
    Err((expected.into(), found.into()))
}

/// Finds the layout of a file's bytes.
type Reader = fn(&[u8]) -> Result<Layout, Wrong>;

/// A file's bytes and its kind, `ply` or `splat`.
///
/// # Errors
/// A file that is neither by its name and its content, that is cut off, has too many splats, or one that is not finite.
pub(super) fn read(path: &Path) -> Result<(Vec<u8>, &'static str)> {
    let ending = path.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase());
    let say = |(expected, found): Wrong| anyhow!("{}: expected {expected}, found {found}", path.display());
    let (kind, layout): (_, Reader) = match ending.as_str() {
        "ply" => ("ply", ply),
        "splat" => ("splat", splat),
        _ => return wrong("splats as .ply or .splat", format!("the ending {ending:?}")).map_err(say),
    };
    let bytes = file::read(path, MOST_BYTES).with_context(|| format!("{}: cannot be read", path.display()))?;
    layout(&bytes).and_then(|layout| check(&bytes, &layout)).map_err(say)?;
    Ok((bytes, kind))
}

/// The layout of 32 bytes: place and sizes as floats, colour, opacity and rotation as bytes.
fn splat(bytes: &[u8]) -> Result<Layout, Wrong> {
    let stride = 32;
    if !bytes.len().is_multiple_of(stride) {
        return wrong("32 bytes a splat", format!("{} bytes", bytes.len()));
    }
    Ok(Layout { from: 0, stride, count: bytes.len() / stride, floats: (0..6).map(|i| 4 * i).collect() })
}

/// What training of splats writes: binary, little-endian, vertices first, sizes as logarithms, opacities as logits.
fn ply(bytes: &[u8]) -> Result<Layout, Wrong> {
    let begin = String::from_utf8_lossy(&bytes[..bytes.len().min(MOST_HEAD)]);
    if !begin.starts_with("ply") {
        return wrong("a PLY file", "other first bytes");
    }
    let mut layout = Layout { from: 0, stride: 0, count: 0, floats: Vec::new() };
    let mut places: Vec<(&str, &str, usize)> = Vec::new();
    let (mut elements, mut little, mut whole) = (0, false, false);
    for line in begin.split_inclusive('\n') {
        layout.from += line.len();
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", format, _] if format != "binary_little_endian" => {
                return wrong("a PLY file of format binary_little_endian", format);
            }
            ["format", ..] => little = true,
            ["element", name, _] if elements == 0 && name != "vertex" => {
                return wrong("the element vertex first", name);
            }
            ["element", _, number] => {
                if elements == 0 {
                    layout.count = number.parse().or_else(|_| wrong("a number of vertices", number))?;
                }
                elements += 1;
            }
            ["property", kind, name] if elements == 1 => {
                let Some(size) = size(kind) else {
                    return wrong("numbers as properties of a vertex", format!("{kind} {name}"));
                };
                places.push((name, kind, layout.stride));
                layout.stride += size;
            }
            ["property", ..] if elements == 1 => return wrong("numbers as properties of a vertex", line.trim()),
            ["end_header"] if line.ends_with('\n') => {
                whole = true;
                break;
            }
            _ => {}
        }
    }
    if !(whole && little) {
        return wrong(format!("a PLY head with format and end_header within {MOST_HEAD} bytes"), "none");
    }
    for wanted in DRAWN {
        match places.iter().find(|(name, ..)| *name == wanted) {
            Some((_, "float" | "float32", at)) => layout.floats.push(*at),
            Some((_, kind, _)) => return wrong(format!("the property {wanted} as float"), *kind),
            None => return wrong(format!("splats with the property {wanted}"), "none of this name"),
        }
    }
    Ok(layout)
}

fn size(kind: &str) -> Option<usize> {
    match kind {
        "char" | "uchar" | "int8" | "uint8" => Some(1),
        "short" | "ushort" | "int16" | "uint16" => Some(2),
        "int" | "uint" | "float" | "int32" | "uint32" | "float32" => Some(4),
        "double" | "float64" => Some(8),
        _ => None,
    }
}

fn check(bytes: &[u8], layout: &Layout) -> Result<(), Wrong> {
    let Layout { from, stride, count, floats } = layout;
    if !(1..=MOST).contains(count) {
        return wrong(format!("1 to {MOST} splats"), count.to_string());
    }
    let payload = bytes.get(*from..).unwrap_or_default();
    if payload.len() < count * stride {
        return wrong(format!("{count} splats of {stride} bytes"), format!("{} bytes for them", payload.len()));
    }
    let finite = |splat: &[u8]| {
        let float = |at: &usize| splat.get(*at..).and_then(|rest| rest.first_chunk()).map(|b| f32::from_le_bytes(*b));
        floats.iter().all(|at| float(at).is_some_and(f32::is_finite))
    };
    match payload.chunks_exact(*stride).take(*count).position(|splat| !finite(splat)) {
        Some(number) => wrong("finite numbers", format!("others in splat {number}")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn properties_that_are_not_drawn_are_skipped() {
        let drawn: String = DRAWN.iter().map(|name| format!("property float {name}\n")).collect();
        let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar red\n{drawn}end_header\n");
        let layout = ply(head.as_bytes()).unwrap();
        assert_eq!((layout.from, layout.stride, layout.count), (head.len(), 57, 1));
        assert_eq!((layout.floats[0], layout.floats[13]), (1, 53));
        let broken = [0xff; 57];
        let file = [head.as_bytes(), &broken[..]].concat();
        assert_eq!(check(&file, &layout).unwrap_err().1, "others in splat 0");
        assert_eq!(check(&file[..head.len() + 20], &layout).unwrap_err().1, "20 bytes for them");
        let text = head.replace("binary_little_endian", "ascii");
        assert_eq!(ply(text.as_bytes()).unwrap_err().1, "ascii");
        let large = head.replace("vertex 1", "vertex 4000001");
        assert_eq!(check(large.as_bytes(), &ply(large.as_bytes()).unwrap()).unwrap_err().1, "4000001");
    }
}
