//! HDF5's checksums.

use std::ops::Range;

/// Parts with a checksum at their end begin so ("HDF5 File Format Specification", version 3).
const PARTS: [&[u8]; 13] =
    [b"\x89HDF", b"OHDR", b"OCHK", b"BTHD", b"BTIN", b"BTLF", b"FRHP", b"FHDB", b"FHIB", b"FSHD", b"FAHD", b"FADB", b"EAHD"];
/// A part is shorter than this.
const LONGEST: usize = 2048;

/// Makes the checksums of all parts fit that are whole in the file that this one was made of; it must be as long.
pub(super) fn mend(original: &[u8], changed: &mut [u8]) {
    if !original.starts_with(PARTS[0]) || original.len() != changed.len() {
        return;
    }
    for at in 0..original.len() {
        if PARTS.iter().any(|part| original[at..].starts_with(part))
            && let Some(part) = part(original, at)
        {
            let sum = lookup3(&changed[part.clone()]);
            changed[part.end..part.end + 4].copy_from_slice(&sum.to_le_bytes());
        }
    }
}

/// What the first checksum after a place is of: that which fits.
fn part(file: &[u8], start: usize) -> Option<Range<usize>> {
    let ends = start + 8..(start + LONGEST).min(file.len().saturating_sub(3));
    ends.map(|end| start..end).find(|part| file[part.end..].starts_with(&lookup3(&file[part.clone()]).to_le_bytes()))
}

/// Bob Jenkins' `hashlittle` of 2006, from 0.
fn lookup3(bytes: &[u8]) -> u32 {
    let mut s = [0xdead_beef_u32.wrapping_add(bytes.len() as u32); 3];
    let mut rest = bytes;
    loop {
        let (block, after) = rest.split_at(rest.len().min(12));
        let mut padded = [0; 12];
        padded[..block.len()].copy_from_slice(block);
        if block.is_empty() {
            return s[2];
        }
        for (value, word) in s.iter_mut().zip(padded.chunks_exact(4)) {
            *value = value.wrapping_add(word.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte)));
        }
        rest = after;
        let [mut a, mut b, mut c] = s;
        if rest.is_empty() {
            for turn in [[14, 11, 25], [16, 4, 14]] {
                c = (c ^ b).wrapping_sub(b.rotate_left(turn[0]));
                a = (a ^ c).wrapping_sub(c.rotate_left(turn[1]));
                b = (b ^ a).wrapping_sub(a.rotate_left(turn[2]));
            }
            return (c ^ b).wrapping_sub(b.rotate_left(24));
        }
        for turn in [[4, 6, 8], [16, 19, 4]] {
            a = a.wrapping_sub(c) ^ c.rotate_left(turn[0]);
            c = c.wrapping_add(b);
            b = b.wrapping_sub(a) ^ a.rotate_left(turn[1]);
            a = a.wrapping_add(c);
            c = c.wrapping_sub(b) ^ b.rotate_left(turn[2]);
            b = b.wrapping_add(a);
        }
        s = [a, b, c];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_of_a_written_file_are_found_and_mended() {
        let path = std::env::temp_dir().join(format!("promenade-hdf5-{}.sofa", std::process::id()));
        crate::heads::write_sofa(&path, 0.09);
        let whole = std::fs::read(&path).unwrap();
        let _ = std::fs::remove_file(path);
        let head = part(&whole, 0).expect("the first part has a checksum");
        let mut changed = whole.clone();
        changed[head.end - 1] ^= 1;
        let broken = changed.clone();
        mend(&whole, &mut changed);
        assert_ne!(changed, broken);
        assert_eq!(part(&changed, 0), Some(head));
        assert!(whole.windows(4).enumerate().filter(|(_, w)| *w == b"OHDR").all(|(at, _)| part(&whole, at).is_some()));
    }
}
