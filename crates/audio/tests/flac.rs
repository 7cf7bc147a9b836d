//! FLAC files, of verbatim frames made here and of an encoder's where there are some.

use promenade_audio::sound;

/// Cyclic redundancy check of `bits` bits, most significant bit first, starting at 0 (RFC 9639, sections 9.1.8 and 9.3).
fn crc(bytes: &[u8], bits: u32, polynomial: u32) -> u32 {
    bytes.iter().fold(0, |sum, &byte| {
        (0..8).fold(sum ^ (u32::from(byte) << (bits - 8)), |sum, _| {
            let out = (sum << 1) ^ if sum >> (bits - 1) & 1 == 1 { polynomial } else { 0 };
            out & ((1 << bits) - 1)
        })
    })
}

/// A file of one frame with 16-bit samples stored as they are.
fn file_of(rate_hz: u32, channels: &[&[i16]]) -> Vec<u8> {
    let (count, frames) = (channels.len() as u64, channels[0].len() as u64);
    let block = frames as u16;
    let mut bytes = b"fLaC\x80\x00\x00\x22".to_vec();
    bytes.extend([block.to_be_bytes(), block.to_be_bytes()].concat());
    bytes.extend([0; 6]);
    bytes.extend((u64::from(rate_hz) << 44 | (count - 1) << 41 | 15 << 36 | frames).to_be_bytes());
    bytes.extend([0; 16]);
    let mut frame = vec![0xFF, 0xF8, 0x70, ((count as u8 - 1) << 4) | 0x08, 0];
    frame.extend((block - 1).to_be_bytes());
    frame.push(crc(&frame, 8, 0x07) as u8);
    for channel in channels {
        frame.push(0x02);
        channel.iter().for_each(|v| frame.extend(v.to_be_bytes()));
    }
    frame.extend((crc(&frame, 16, 0x8005) as u16).to_be_bytes());
    bytes.extend(frame);
    bytes
}

#[test]
fn samples_rate_and_channels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.FLAC");
    let (left, right): (Vec<i16>, Vec<i16>) = ((0..32).map(|i| i * 1000).collect(), (0..32).map(|i| -i * 1000 - 768).collect());
    std::fs::write(&path, file_of(22_050, &[&left, &right])).unwrap();
    let read = sound::read(&path).unwrap();
    assert_eq!((read.sample_rate_hz, read.frames()), (22_050, 32));
    let expected = [left, right].map(|c| c.iter().map(|v| f32::from(*v) / 32_768.0).collect::<Vec<f32>>());
    assert_eq!(read.channels, expected);
    let error = sound::read_limited(&path, 63).unwrap_err().to_string();
    assert!(error.contains("at most 63 samples, found 64"), "{error}");
}

#[test]
fn a_tag_of_id3_may_come_first_and_names_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.wav");
    // Two bytes of seven bits: 130 bytes.
    let tag = [&b"ID3\x04\0\0\0\0\x01\x02"[..], &[7; 130]].concat();
    std::fs::write(&path, [tag.clone(), file_of(48_000, &[&[16_384; 16]])].concat()).unwrap();
    assert_eq!(sound::read(&path).unwrap().channels, [[0.5; 16]]);
    std::fs::write(&path, [tag, b"\xff\xfb".to_vec()].concat()).unwrap();
    assert!(sound::read(&path).unwrap_err().to_string().contains("no readable WAV, FLAC or AIFF file"));
}

#[test]
fn damage_is_an_error_at_every_byte() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.flac");
    let whole = file_of(48_000, &[&[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]]);
    for cut in 0..whole.len() {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let error = sound::read(&path).expect_err("cut short").to_string();
        assert!(error.contains("a.flac"), "{error}");
    }
    // A check covers the whole frame.
    for at in 42..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x10;
        std::fs::write(&path, &damaged).unwrap();
        assert!(sound::read(&path).is_err(), "byte {at}");
    }
    assert!(sound::read(&folder.path().join("none.flac")).unwrap_err().to_string().contains("cannot be read"));
    assert!(sound::read(folder.path()).is_err(), "a folder");
}

mod needs_shared {
    use super::*;
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn an_encoders_files_are_read() {
        let list = std::fs::read_dir(shared("data/r3vival/RIRs_flac24")).unwrap();
        let mut files: Vec<_> =
            list.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "flac")).collect();
        files.sort();
        let read = sound::read(files.first().expect("a FLAC file")).unwrap();
        let peak = read.channels[0].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        assert!(read.sample_rate_hz == 48_000 && read.frames() > 1000 && peak > 1e-4 && peak <= 1.0, "{peak}");
    }
}
