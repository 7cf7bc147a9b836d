//! Changes of bytes without regard to what they mean.

use fastrand::Rng;

/// Whole numbers at the edges of what readers expect.
pub(super) const WHOLE: [u64; 18] = [
    0,
    1,
    2,
    3,
    0x7f,
    0x80,
    0xff,
    0x100,
    0x7fff,
    0x8000,
    0xffff,
    0x0001_0000,
    0x00ff_ffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];

/// Numbers that samples and places should not be.
pub(super) const REAL: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1e-3,
    1e-40,
    1e-300,
    1e6,
    -1e9,
    1e30,
    3.5e38,
    -1e300,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];

/// Changes one place, or cuts or joins; the other input gives parts.
pub(super) fn change(rng: &mut Rng, bytes: &mut Vec<u8>, other: &[u8]) {
    if bytes.is_empty() {
        bytes.extend(&other[..other.len().min(64)]);
        return;
    }
    let at = rng.usize(..bytes.len());
    let longest = [4, 16, 256, bytes.len()][rng.usize(..4)];
    let end = (at + 1 + rng.usize(..longest)).min(bytes.len());
    match rng.u8(0..12) {
        0 => bytes[at] ^= 1 << rng.u8(0..8),
        1 => bytes[at] = rng.u8(..),
        2 | 3 => whole(rng, bytes, at),
        4 => real(rng, bytes, at),
        5 => bytes.truncate(at),
        6 => drop(bytes.drain(at..end)),
        7 => {
            let part = bytes[at..end].to_vec();
            bytes.splice(at..at, part);
        }
        8 if !other.is_empty() => {
            let from = rng.usize(..other.len());
            let part = other[from..(from + end - at).min(other.len())].to_vec();
            let over = if rng.bool() { at } else { (at + part.len()).min(bytes.len()) };
            bytes.splice(at..over, part);
        }
        9 => bytes[at..end].fill([0, 0xff, b' ', b'0'][rng.usize(..4)]),
        10 => {
            let to = rng.usize(..bytes.len());
            let part = bytes[at..end.min(at + bytes.len() - to)].to_vec();
            bytes[to..to + part.len()].copy_from_slice(&part);
        }
        _ => {
            let near = (bytes.len() as u64).wrapping_add(rng.u64(0..16)).wrapping_sub(8);
            write(rng, bytes, at, near);
        }
    }
}

/// Writes a whole number of a size that is drawn, in either order of bytes; sometimes it is only a little more or less than
/// what was there.
fn whole(rng: &mut Rng, bytes: &mut [u8], at: usize) {
    if rng.bool() {
        let value = WHOLE[rng.usize(..WHOLE.len())];
        write(rng, bytes, at, value);
    } else {
        bytes[at] = bytes[at].wrapping_add(rng.u8(0..16)).wrapping_sub(8);
    }
}

fn write(rng: &mut Rng, bytes: &mut [u8], at: usize, value: u64) {
    let size = [1, 2, 4, 8][rng.usize(..4)];
    let at = if rng.bool() { at / size * size } else { at };
    let mut digits = value.to_le_bytes()[..size].to_vec();
    if rng.bool() {
        digits.reverse();
    }
    bytes.iter_mut().skip(at).zip(digits).for_each(|(byte, digit)| *byte = digit);
}

fn real(rng: &mut Rng, bytes: &mut [u8], at: usize) {
    let value = REAL[rng.usize(..REAL.len())];
    let digits = if rng.bool() { value.to_le_bytes().to_vec() } else { (value as f32).to_le_bytes().to_vec() };
    let at = at / 4 * 4;
    bytes.iter_mut().skip(at).zip(digits).for_each(|(byte, digit)| *byte = digit);
}
