//! Measured sets that nobody should have made: an error or something that can be used, in bounded memory, and never a panic.

use promenade_audio::wav;
use promenade_fit::{LoadOptions, Measurements, all_figures};
use promenade_testing::fuzz::{Counting, Input, Search};
use promenade_testing::noise;
use std::fs;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What a file of some kilobytes and the sounds beside it may take at a time, bytes.
const FILE_BYTES: usize = 64 << 20;

/// A second of a room that dies away.
fn response(seed: u64) -> Vec<f32> {
    let mut samples = vec![0.0; 2400];
    for (i, x) in noise(seed, 2000).into_iter().enumerate() {
        samples[200 + i] = x * (-(i as f32) / 200.0).exp();
    }
    samples
}

#[test]
fn measured_sets() {
    let manifest = r#"{ "title": "Room", "sd_m": 0.01, "clock": "known", "responses": [
        { "file": "a.wav", "source": { "at": [1.0, 2.0, 1.5] }, "microphone": { "at": [3.0, 2.5, 1.2], "sd_m": 0.02 } },
        { "file": "a.wav", "channel": 1, "clock": "free", "source": { "at": [1.0, 2.0, 1.5], "facing": [1, 0, 0] },
          "microphone": { "at": [2.0, 1.5, 1.2] } } ] }"#;
    let table = "file,setting,a,b,c,d,x,y,z,e\na.wav,000,1,2,3,4,1.5,2.5,1.2,9\na.wav,111,1,2,3,4,1.5,nan,1.2,9\n";
    let whole = [Input::new("measurements.json", manifest), Input::new("positions_derived.csv", table)];
    let layouts = [["measurements.json", "a.wav"], ["positions_derived.csv", "RIRs_flac24"]];
    let options = LoadOptions {
        source_m: Some([0.5, 0.5, 1.0]),
        setting: Some("000".into()),
        channel: Some(1),
        ..LoadOptions::default()
    };
    let kept = tempfile::tempdir().unwrap();
    for input in &whole {
        fs::write(kept.path().join(&input.name), &input.bytes).unwrap();
    }
    let sound = kept.path().join("a.wav");
    wav::write(&sound, 24_000, &[&response(4)], wav::Format::Float32).unwrap();
    Search { name: "measurements", cases: 2000, most_bytes: FILE_BYTES }.run(whole.to_vec(), |input, path| {
        let folder = path.parent().unwrap();
        let beside = layouts.iter().find(|layout| layout.contains(&&*input.name)).unwrap();
        let beside: Vec<_> = beside.iter().map(|name| folder.join(name)).filter(|other| other != path).collect();
        for other in &beside {
            if other.ends_with("RIRs_flac24") {
                fs::create_dir_all(other).unwrap();
                fs::copy(&sound, other.join("a.wav")).unwrap();
            } else {
                fs::copy(kept.path().join(other.file_name().unwrap()), other).unwrap();
            }
        }
        let set = Measurements::load(folder, &options);
        for other in &beside {
            let _gone = if other.is_dir() { fs::remove_dir_all(other) } else { fs::remove_file(other) };
        }
        let set = set.map_err(|error| error.to_string())?;
        assert!(set.all.iter().all(|one| one.samples.iter().all(|x| x.is_finite())), "samples that are no numbers");
        assert_eq!(all_figures(&set).len(), set.all.len());
        Ok(())
    });
}
