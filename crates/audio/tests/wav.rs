//! WAV files, good and bad, through the public interface.

use promenade_audio::pcm::PcmReader;
use promenade_audio::sound;
use promenade_audio::wav::{self, Format, WavWriter};
use std::path::{Path, PathBuf};

fn ramp(count: usize) -> Vec<f32> {
    (0..count).map(|i| (i as f32 / count as f32) * 1.8 - 0.9).collect()
}

fn error(path: &Path) -> String {
    let error = sound::read(path).unwrap_err();
    let cause = std::error::Error::source(&error).map(|s| format!(": {s}")).unwrap_or_default();
    format!("{error}{cause}")
}

#[test]
fn formats_survive_the_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let (left, right) = (ramp(1000), ramp(1000).iter().map(|v| -v).collect::<Vec<_>>());
    for (format, step) in
        [(Format::Int16, 1.0 / 32768.0), (Format::Int24, 1.0 / 8_388_608.0), (Format::Int32, 1e-7), (Format::Float32, 0.0)]
    {
        let path = folder.path().join(format!("{format:?}.wav"));
        let written = wav::write(&path, 44_100, &[&left, &right], format).unwrap();
        assert_eq!((written.frames, written.clipped), (1000, 0));
        let back = sound::read(&path).unwrap();
        assert_eq!((back.sample_rate_hz, back.channels.len(), back.frames()), (44_100, 2, 1000));
        for (a, b) in back.channels[0].iter().chain(&back.channels[1]).zip(left.iter().chain(&right)) {
            assert!((a - b).abs() <= 0.5 * step + 1e-8, "{format:?}: {a} for {b}");
        }
    }
}

#[test]
fn blocks_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.wav");
    let x = ramp(10_000);
    let mut writer = WavWriter::create(&path, 48_000, 1, Format::Float32).unwrap();
    for block in x.chunks(777) {
        writer.write(&[block]).unwrap();
    }
    assert!(!path.exists(), "not before it is whole");
    writer.finish().unwrap();
    let mut reader = PcmReader::open(&path).unwrap();
    let mut channels = vec![Vec::new()];
    while reader.read(333, &mut channels).unwrap() > 0 {}
    assert_eq!(channels[0], x);
}

#[test]
fn too_loud_is_limited_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("loud.wav");
    assert_eq!(wav::write(&path, 48_000, &[&[0.5, 1.5, -2.0]], Format::Int16).unwrap().clipped, 2);
    assert_eq!(sound::read(&path).unwrap().channels[0], [0.5, 32767.0 / 32768.0, -1.0]);
}

#[test]
fn an_abandoned_file_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.wav");
    let mut writer = WavWriter::create(&path, 48_000, 1, Format::Int24).unwrap();
    writer.write(&[&[0.1; 100]]).unwrap();
    let refused = writer.write(&[&[f32::NAN]]).unwrap_err().to_string();
    assert!(refused.contains("sample 100"), "{refused}");
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// A RIFF header for 16-bit samples, as wrong as the caller makes it.
fn bytes(channels: u16, rate: u32, claimed: u32, data: &[u8]) -> Vec<u8> {
    let mut b = Vec::new();
    b.extend(b"RIFF");
    b.extend((36 + claimed).to_le_bytes());
    b.extend(b"WAVEfmt ");
    b.extend(16_u32.to_le_bytes());
    b.extend(1_u16.to_le_bytes());
    b.extend(channels.to_le_bytes());
    b.extend(rate.to_le_bytes());
    b.extend(rate.wrapping_mul(2 * u32::from(channels)).to_le_bytes());
    b.extend((2 * channels).to_le_bytes());
    b.extend(16_u16.to_le_bytes());
    b.extend(b"data");
    b.extend(claimed.to_le_bytes());
    b.extend(data);
    b
}

#[test]
fn bad_files_say_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let samples = [0x10_u8; 400];
    for (name, content, clue) in [
        ("empty.wav", vec![], "an empty file"),
        ("text.wav", b"this is not a WAV file at all, but text".to_vec(), "no readable WAV, FLAC or AIFF file"),
        ("no-channels.wav", bytes(0, 48_000, 400, &samples), "no-channels.wav"),
        ("slow.wav", bytes(1, 10, 400, &samples), "found 10 Hz"),
        ("fast.wav", bytes(1, 2_000_000, 400, &samples), "found 2000000 Hz"),
        ("cut.wav", bytes(1, 48_000, 400_000, &samples), "cut short"),
        ("nothing.wav", bytes(1, 48_000, 0, &[]), "at least one sample, found none"),
        ("header-only.wav", bytes(1, 48_000, 400, &[])[..30].to_vec(), "header-only.wav"),
    ] {
        let path = file(name, &content);
        let said = error(&path);
        assert!(said.contains(clue) && said.contains(name), "{name}: {said}");
    }
    assert!(error(&folder.path().join("missing.wav")).contains("missing.wav: cannot be read"));
    assert!(error(folder.path()).contains("folder"));
}

#[test]
fn every_truncation_is_an_error_not_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("good.wav");
    wav::write(&path, 48_000, &[&ramp(64), &ramp(64)], Format::Int24).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in 0..whole.len() {
        let path = folder.path().join("cut.wav");
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(sound::read(&path).is_err(), "{length} of {} bytes", whole.len());
    }
    for at in 0..whole.len().min(100) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0xff;
        std::fs::write(&path, &damaged).unwrap();
        // Either is fine; neither may panic.
        let _ = sound::read_limited(&path, 1 << 20);
    }
}

#[test]
fn not_a_number_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nan.wav");
    let spec =
        hound::WavSpec { channels: 2, sample_rate: 48_000, bits_per_sample: 32, sample_format: hound::SampleFormat::Float };
    let mut writer = hound::WavWriter::create(&path, spec).unwrap();
    for v in [0.0, 0.0, 0.5, f32::NAN] {
        writer.write_sample(v).unwrap();
    }
    writer.finalize().unwrap();
    let said = error(&path);
    assert!(said.contains("sample 1 of channel 1") && said.contains("NaN"), "{said}");
    let limited = sound::read_limited(&path, 3).unwrap_err().to_string();
    assert!(limited.contains("at most 3 samples, found 4"), "{limited}");
}

/// A chunk with its pad byte.
fn chunk(id: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let size = u32::try_from(content.len()).unwrap();
    [&id[..], &size.to_le_bytes(), content, &[0][..content.len() % 2]].concat()
}

/// A format chunk of one channel at 48 kHz: integers in containers, with the bits that count where they are stated.
fn format(container_bytes: u16, bits: u16, valid_bits: Option<u16>) -> Vec<u8> {
    let tag: u16 = if valid_bits.is_some() { 0xFFFE } else { 1 };
    let mut content = [tag.to_le_bytes(), 1_u16.to_le_bytes()].concat();
    content.extend(48_000_u32.to_le_bytes());
    content.extend((48_000 * u32::from(container_bytes)).to_le_bytes());
    content.extend([container_bytes.to_le_bytes(), bits.to_le_bytes()].concat());
    if let Some(valid_bits) = valid_bits {
        content.extend([22_u16.to_le_bytes(), valid_bits.to_le_bytes()].concat());
        content.extend(4_u32.to_le_bytes());
        // KSDATAFORMAT_SUBTYPE_PCM.
        content.extend(b"\x01\0\0\0\0\0\x10\0\x80\0\0\xaa\0\x38\x9b\x71");
    }
    chunk(b"fmt ", &content)
}

/// A file of chunks.
fn file_of(form: &[u8; 4], chunks: &[Vec<u8>]) -> Vec<u8> {
    let chunks = chunks.concat();
    let size = if form == b"RIFF" { u32::try_from(4 + chunks.len()).unwrap() } else { u32::MAX };
    [&form[..], &size.to_le_bytes(), b"WAVE", &chunks].concat()
}

#[test]
fn fewer_bits_than_their_containers_hold_are_the_upper_ones() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("24-in-32.wav");
    let expected = [0.5_f32, -0.75, 1.0 / 8_388_608.0, -1.0];
    let samples: Vec<u8> = expected.iter().flat_map(|v| ((v * 8_388_608.0) as i32 * 256).to_le_bytes()).collect();
    std::fs::write(&path, file_of(b"RIFF", &[format(4, 32, Some(24)), chunk(b"data", &samples)])).unwrap();
    assert_eq!(sound::read(&path).unwrap().channels[0], expected);
    // Whether these are the upper or the lower ones, nobody states.
    std::fs::write(&path, file_of(b"RIFF", &[format(4, 24, None), chunk(b"data", &samples)])).unwrap();
    assert!(error(&path).contains("another size than their containers"), "{}", error(&path));
}

#[test]
fn chunks_of_odd_sizes_are_padded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bext.wav");
    let (format, samples) = (format(2, 16, None), chunk(b"data", &0x4000_i16.to_le_bytes()));
    for id in [b"bext", b"iXML", b"LIST"] {
        let padded = chunk(id, b"odd");
        let unpadded = padded[..11].to_vec();
        for chunks in [[&padded, &format, &samples], [&format, &padded, &samples], [&format, &unpadded, &samples]] {
            std::fs::write(&path, file_of(b"RIFF", &chunks.map(Clone::clone))).unwrap();
            assert_eq!(sound::read(&path).unwrap().channels, [[0.5]]);
        }
    }
    let endless = vec![chunk(b"junk", &[]); 2000];
    std::fs::write(&path, file_of(b"RIFF", &endless)).unwrap();
    assert!(error(&path).contains("too many chunks"), "{}", error(&path));
}

#[test]
fn sizes_of_64_bits_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.wav");
    let sizes = |samples: u64| {
        let sizes = [0_u64, samples, samples / 2].map(u64::to_le_bytes).concat();
        chunk(b"ds64", &[&sizes[..], &[0; 4]].concat())
    };
    let samples = [&b"data"[..], &u32::MAX.to_le_bytes(), &0x4000_i16.to_le_bytes(), &i16::MIN.to_le_bytes()].concat();
    let write = |content: Vec<u8>| std::fs::write(&path, content).unwrap();
    for form in [b"RF64", b"BW64"] {
        write(file_of(form, &[sizes(4), format(2, 16, None), samples.clone()]));
        assert_eq!(sound::read(&path).unwrap().channels, [[0.5, -1.0]]);
    }
    write(file_of(b"RF64", &[format(2, 16, None), samples.clone()]));
    assert!(error(&path).contains("no ds64 chunk"), "{}", error(&path));
    write(file_of(b"RF64", &[sizes(u64::MAX), format(2, 16, None), samples.clone()]));
    assert!(error(&path).contains("cut short"), "{}", error(&path));
    write(file_of(b"RF64", &[sizes(5 << 30), format(2, 16, None), samples]));
    // A hole in the disk, so that nothing is written.
    std::fs::File::options().write(true).open(&path).unwrap().set_len(6 << 30).unwrap();
    assert!(error(&path).contains("less than 4 GiB of samples, found 5368709120 bytes"), "{}", error(&path));
}

/// A format chunk of a tag, with samples of some bits in one channel at 48 kHz.
fn tagged(tag: u16, bits: u16) -> Vec<u8> {
    let mut content = [tag.to_le_bytes(), 1_u16.to_le_bytes()].concat();
    content.extend(48_000_u32.to_le_bytes());
    content.extend((48_000 * u32::from(bits / 8)).to_le_bytes());
    content.extend([(bits / 8).to_le_bytes(), bits.to_le_bytes()].concat());
    chunk(b"fmt ", &content)
}

#[test]
fn floats_of_64_bits_and_bytes_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.wav");
    let doubles: Vec<u8> = [0.25_f64, -0.75].iter().flat_map(|v| v.to_le_bytes()).collect();
    for (format, samples, expected) in [(tagged(3, 64), doubles, [0.25, -0.75]), (tagged(1, 8), vec![0xC0, 0], [0.5, -1.0])] {
        std::fs::write(&path, file_of(b"RIFF", &[format, chunk(b"data", &samples)])).unwrap();
        assert_eq!(sound::read(&path).unwrap().channels, [expected]);
    }
    std::fs::write(&path, file_of(b"RIFF", &[tagged(0x55, 16), chunk(b"data", &[0; 4])])).unwrap();
    assert!(error(&path).contains("neither integers nor floats, format 85"), "{}", error(&path));
}

#[test]
fn samples_whose_size_nobody_wrote_go_to_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.wav");
    let samples = [0x4000_i16.to_le_bytes(), i16::MIN.to_le_bytes()].concat();
    // ffmpeg and SoX into a pipe, a recorder that was stopped; half of a sample is none.
    for size in [u32::MAX, 0x7FFF_FFFF - 35, 0] {
        let data = [&b"data"[..], &size.to_le_bytes(), &samples, &[1]].concat();
        std::fs::write(&path, file_of(b"RIFF", &[format(2, 16, None), data])).unwrap();
        assert_eq!(sound::read(&path).unwrap().channels, [[0.5, -1.0]], "{size:x}");
    }
    // No samples, and more chunks.
    std::fs::write(&path, file_of(b"RIFF", &[format(2, 16, None), chunk(b"data", &[]), chunk(b"LIST", b"more")])).unwrap();
    assert!(error(&path).contains("at least one sample"), "{}", error(&path));
}

#[test]
fn aiff_is_read_in_its_forms() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.aif");
    let big = |id: &[u8; 4], content: &[u8]| {
        let size = u32::try_from(content.len()).unwrap();
        [&id[..], &size.to_be_bytes(), content, &[0][..content.len() % 2]].concat()
    };
    let write = |kind: &[u8; 4], bits: u16, compression: &[u8], samples: &[u8]| {
        // 44,100 in 80 bits, as every encoder writes it.
        let rate = [0x40, 0x0E, 0xAC, 0x44, 0, 0, 0, 0, 0, 0];
        let common = [&[0, 1, 0, 0, 0, 2], &bits.to_be_bytes()[..], &rate, compression].concat();
        let chunks = [big(b"NAME", b"odd"), big(b"COMM", &common), big(b"SSND", &[&[0; 8], samples].concat())].concat();
        let size = u32::try_from(4 + chunks.len()).unwrap();
        std::fs::write(&path, [&b"FORM"[..], &size.to_be_bytes(), kind, &chunks].concat()).unwrap();
    };
    let floats = |values: [f64; 2]| values.map(f64::to_be_bytes).concat();
    for (kind, bits, compression, samples) in [
        (b"AIFF", 16, &b""[..], vec![0x40, 0, 0xC0, 0]),
        (b"AIFF", 24, b"", vec![0x40, 0, 0, 0xC0, 0, 0]),
        (b"AIFC", 16, b"sowt\0\0", vec![0, 0x40, 0, 0xC0]),
        (b"AIFC", 64, b"fl64\0\0", floats([0.5, -0.5])),
    ] {
        write(kind, bits, compression, &samples);
        let read = sound::read(&path).unwrap();
        assert_eq!((read.sample_rate_hz, &read.channels[..]), (44_100, &[vec![0.5, -0.5]][..]), "{bits}");
    }
    write(b"AIFC", 4, b"ima4\0\0", &[0; 8]);
    assert!(error(&path).contains("compressed as ima4"), "{}", error(&path));
    write(b"AIFF", 16, b"", &[0; 2]);
    assert!(error(&path).contains("cut short"), "{}", error(&path));
}

#[test]
fn a_name_that_says_another_format_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mp3");
    let said = wav::write(&path, 48_000, &[&[0.5]], Format::Int16).unwrap_err().to_string();
    assert!(said.contains("out.mp3: expected a name that ends in .wav"), "{said}");
}
