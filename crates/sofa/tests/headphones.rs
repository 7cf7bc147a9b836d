//! What headphones need, from files.

use hdf5_pure::{AttrValue, FileBuilder};
use promenade_core::headphones::Headphones;
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::spectrum;
use promenade_sofa::read_headphones;
use std::path::Path;

const RATE: f64 = 48_000.0;

/// What an ear hears through headphones: a resonance of the ear canal and a loss of bass.
fn response(ear: usize) -> Vec<f32> {
    let text = [
        "Filter 1: ON PK Fc 3000 Hz Gain 9 dB Q 1.2\nFilter 2: ON LSC Fc 150 Hz Gain -6 dB Q 0.7",
        "Filter 1: ON PK Fc 4200 Hz Gain -7 dB Q 1.5\nFilter 2: ON HSC Fc 6000 Hz Gain 4 dB Q 0.7",
    ];
    let mut ears = [(); 2].map(|()| vec![0.0; 8_192]);
    ears.iter_mut().for_each(|ear| ear[30] = 0.2);
    let [left, right] = &mut ears;
    Headphones::from_text(text[ear]).unwrap().filter(RATE).process([left, right]);
    ears[0].clone()
}

fn write(path: &Path, convention: &str, channels: &[Vec<f32>]) {
    let mut file = FileBuilder::new();
    let text = |t: &str| AttrValue::AsciiString(t.to_owned());
    for (name, value) in [("SOFAConventions", convention), ("DataType", "FIR"), ("Title", "Headphones")] {
        file.set_attr(name, text(value));
    }
    for name in ["SourcePosition", "ListenerPosition"] {
        file.create_dataset(name).with_f64_data(&[0.0; 3]).with_shape(&[1, 3]).set_attr("Type", text("cartesian"));
    }
    file.create_dataset("Data.SamplingRate").with_f64_data(&[RATE]).with_shape(&[1]);
    // A driver at each ear.
    file.create_dataset("E").with_f64_data(&[0.0; 2]).with_shape(&[2]);
    let frames = channels[0].len();
    let samples: Vec<f64> = channels.iter().flatten().copied().map(f64::from).collect();
    file.create_dataset("Data.IR").with_f64_data(&samples).with_shape(&[1, channels.len() as u64, frames as u64]);
    file.write(path).unwrap();
}

fn read(name: &str, fill: impl Fn(&Path)) -> Result<Headphones, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fill(&path);
    read_headphones(&path).map_err(|error| error.to_string())
}

#[test]
fn a_measured_pair_is_flat_with_what_it_needs() {
    let responses = [response(0), response(1)];
    let needed = read("pair.sofa", |path| write(path, "SimpleHeadphoneIR", &responses)).unwrap();
    let mut ears = responses;
    let [left, right] = &mut ears;
    needed.filter(RATE).process([left, right]);
    let spectra = ears.map(|ear| spectrum(ear.iter().copied().map(f64::from), 8_192));
    let level = |x: &Complex64| 10.0 * x.norm_sqr().log10();
    let (from, to) = ((100.0 * 8_192.0 / RATE) as usize, (10_000.0 * 8_192.0 / RATE) as usize);
    let mean = spectra.iter().map(|s| level(&s[from * 10])).sum::<f64>() / 2.0;
    let off = spectra.iter().flat_map(|s| &s[from..to]).map(|x| (level(x) - mean).abs()).fold(0.0, f64::max);
    println!("{off:.2} dB");
    assert!(off < 0.4, "{off} dB");
}

#[test]
fn a_text_is_read_by_its_ending() {
    let text = "Preamp: -3 dB\nFilter 1: ON PK Fc 105 Hz Gain 5.5 dB Q 0.70\n";
    let found = read("HD 600 ParametricEQ.txt", |path| std::fs::write(path, text).unwrap()).unwrap();
    assert_eq!(found, Headphones::from_text(text).unwrap());
}

#[test]
fn other_files_are_refused_by_name() {
    let pair = [response(0), response(1)];
    let silent = [response(0), vec![0.0; 8_192]];
    let mut broken = pair.clone();
    broken[1][7] = f32::NAN;
    let sofa = |convention: &'static str, channels: &[Vec<f32>]| {
        read("pair.sofa", |path| write(path, convention, channels)).unwrap_err()
    };
    let refused = [
        (sofa("SimpleFreeFieldHRIR", &pair), "headphone responses (SimpleHeadphoneIR)"),
        (sofa("SimpleHeadphoneIR", &pair[..1]), "2 receivers"),
        (sofa("SimpleHeadphoneIR", &silent), "right ear: expected a response, found silence"),
        (sofa("SimpleHeadphoneIR", &broken), "expected"),
        (read("pair.sofa", |path| std::fs::write(path, b"no HDF5").unwrap()).unwrap_err(), "no readable SOFA"),
        (read("eq.txt", |path| std::fs::write(path, b"\xc3\x28 and more").unwrap()).unwrap_err(), "expected letters"),
        (read("eq.txt", |path| std::fs::write(path, "Filter 1: ON PK").unwrap()).unwrap_err(), "line 1: expected"),
        (read("eq.txt", |_| ()).unwrap_err(), "cannot be read"),
    ];
    for (found, clue) in refused {
        assert!((found.contains("pair.sofa") || found.contains("eq.txt")) && found.contains(clue), "{found}");
    }
}
