//! FLAC's checksums.

/// Cyclic redundancy check of `bits` bits, most significant bit first, starting at 0 (RFC 9639, sections 9.1.8 and 9.3).
fn crc(bytes: &[u8], bits: u32, polynomial: u32) -> u32 {
    bytes.iter().fold(0, |sum, &byte| {
        (0..8).fold(sum ^ (u32::from(byte) << (bits - 8)), |sum, _| {
            let out = (sum << 1) ^ if sum >> (bits - 1) & 1 == 1 { polynomial } else { 0 };
            out & ((1 << bits) - 1)
        })
    })
}

/// Makes the checksums of all frames fit, as far as the frames can be told: each from its mark to the next or to the end.
pub(super) fn mend(file: &mut [u8]) {
    if !file.starts_with(b"fLaC") {
        return;
    }
    let marks = (4..file.len().saturating_sub(8)).filter(|at| file[*at] == 0xff && file[at + 1] & 0xfe == 0xf8);
    let marks: Vec<usize> = marks.chain([file.len()]).collect();
    for frame in marks.windows(2) {
        let frame = &mut file[frame[0]..frame[1]];
        if frame.len() < 12 {
            continue;
        }
        // Four bytes, the coded number, and what the codes of block size and rate ask for at the end.
        let number = frame[4].leading_ones().clamp(1, 7) as usize;
        let size = match frame[2] >> 4 {
            6 => 1,
            7 => 2,
            _ => 0,
        };
        let rate = match frame[2] & 15 {
            12 => 1,
            13 | 14 => 2,
            _ => 0,
        };
        let head = 4 + number + size + rate;
        if head + 3 < frame.len() {
            frame[head] = crc(&frame[..head], 8, 0x07) as u8;
            let end = frame.len() - 2;
            let sum = crc(&frame[..end], 16, 0x8005) as u16;
            frame[end..].copy_from_slice(&sum.to_be_bytes());
        }
    }
}
