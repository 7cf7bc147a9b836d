//! What a newcomer hears first: the first command of the README, run as it stands.

use super::common::succeeds;
use promenade_audio::sound;
use promenade_core::Scene;
use promenade_fourier::spectrum;
use promenade_testing::signal::rms;
use std::path::Path;

/// Share of the energy from 8 to 16 kHz, dB.
fn treble_db(channels: &[Vec<f32>], rate_hz: u32) -> f64 {
    let (mut treble, mut all) = (0.0, 0.0);
    for channel in channels {
        let bins = spectrum(channel.iter().copied(), channel.len());
        for (bin, value) in bins.iter().enumerate() {
            let (hz, energy) = (bin as f64 * f64::from(rate_hz) / channel.len() as f64, f64::from(value.norm_sqr()));
            all += energy;
            treble += if (8e3..16e3).contains(&hz) { energy } else { 0.0 };
        }
    }
    10.0 * (treble / all).log10()
}

#[test]
fn the_first_command_is_full_band_and_walks() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let command = readme.lines().find_map(|line| line.strip_prefix("cargo run --release -p promenade-player -- ")).unwrap();
    let args = command.split(' ').map(|arg| {
        let there = root.join(arg);
        if there.exists() { there.to_str().unwrap().to_owned() } else { arg.to_owned() }
    });
    let mut args: Vec<String> = args.collect();
    let folder = tempfile::tempdir().unwrap();
    let play = |args: &[String], name: &str| {
        let out = folder.path().join(name);
        let mut args: Vec<&str> = args.iter().map(String::as_str).collect();
        args[2] = out.to_str().unwrap();
        succeeds(&args);
        sound::read(&out).unwrap()
    };
    let heard = play(&args, "walk.wav");
    // Above what was measured a scene goes on as it was there, which is no treble of its own.
    let top_hz = Scene::from_bytes(&std::fs::read(&args[0]).unwrap()).unwrap().top_hz();
    assert!(top_hz > 16e3, "the scene is known up to {top_hz} Hz");
    let dry = sound::read(Path::new(&args[1])).unwrap();
    assert!(dry.sample_rate_hz >= 44_100 && heard.sample_rate_hz == dry.sample_rate_hz);
    let [dry_db, heard_db] = [&dry, &heard].map(|sound| treble_db(&sound.channels, sound.sample_rate_hz));
    assert!(
        (heard_db - dry_db).abs() < 10.0,
        "8 to 16 kHz: {dry_db:.1} dB of the dry phrase, {heard_db:.1} dB of what is heard"
    );
    let path = args.iter().position(|arg| arg == "--path").unwrap();
    args.splice(path..=path + 1, ["--pose", "0,0,0,0,0,0"].map(str::to_owned));
    let still = play(&args, "still.wav");
    for (walking, standing) in heard.channels.iter().zip(&still.channels) {
        let apart: Vec<f32> = walking.iter().zip(standing).map(|(a, b)| a - b).collect();
        assert!(rms(&apart) > 0.3 * rms(standing), "walking is heard");
    }
}
