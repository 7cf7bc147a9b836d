//! A long run: hours of audio faster than real time, and whatever else may happen, with all checks on.
//!
//! `cargo bench -p promenade-core --bench soak -- --hours 24 --seed 1`
//!
//! A listener walks through a room for that many hours of audio. At the end of each hour the engine is compared with a new one
//! that has heard the last minute only: what differs has drifted. Then streams of wild inputs, poses, settings and scenes
//! follow, and instances that come and go. The exit status is 1 where a check fails.

use promenade_core::{BlockParams, Carriers, Renderer, Scene, Spatializer};
use promenade_testing::hostile::{Walk, is_output, one_transfer, room_of_anchors, scenes, wild};
use promenade_testing::scenes::{render, room, room_of_responses, room_with_images, spatializer, walk};
use promenade_testing::signal::{difference_db, rms};
use promenade_testing::{Rng, noise};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

const RATE: f64 = 48_000.0;
const MINUTE: usize = 60 * 48_000;
/// The most that an engine may differ from a new one, dB below what it plays.
const DRIFT_DB: f32 = -100.0;
/// The largest mean of a minute's output, relative to its level: noise of a minute has some 1e-3 by itself.
const DC: f64 = 5e-3;

struct Options {
    hours: usize,
    seed: u64,
}

impl Options {
    fn read() -> Result<Self, String> {
        let mut options = Self { hours: 1, seed: 1 };
        let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
        while let Some(word) = words.next() {
            let value = words.next().unwrap_or_default();
            let wrong = |_| format!("{word}: expected a whole number, found \"{value}\"");
            match word.as_str() {
                "--hours" => options.hours = value.parse().map_err(wrong)?,
                "--seed" => options.seed = value.parse().map_err(wrong)?,
                _ => return Err(format!("expected --hours N or --seed N, found \"{word}\"")),
            }
        }
        Ok(options)
    }
}

/// What is played in a minute: noise without a mean, now and then silence, so that tails end too.
fn dry(seed: u64, minute: usize) -> Vec<f32> {
    let mut x = noise(seed.wrapping_mul(1_000_003).wrapping_add(minute as u64), MINUTE);
    for (second, part) in x.chunks_mut(48_000).enumerate() {
        if second % 10 >= 7 && second != 59 {
            part.fill(0.0);
        }
    }
    x
}

/// Plays one minute of the day.
fn play(s: &mut Spatializer, seed: u64, minute: usize) -> [Vec<f32>; 2] {
    let pose = walk(RATE);
    render(s, &dry(seed, minute), &[512, 64, 4_096, 1_000], &BlockParams::default(), |i| pose(minute * MINUTE + i))
}

fn day(name: &str, scene: &Arc<Scene>, hours: usize, seed: u64) -> Result<(), String> {
    let (mut s, began) = (spatializer(scene, RATE), Instant::now());
    let (mut worst_drift, mut worst_dc, mut loudest) = (f32::MIN, 0.0_f64, 0.0_f32);
    for minute in 0..60 * hours {
        let ears = play(&mut s, seed, minute);
        if let Some(x) = ears.iter().flatten().find(|x| !is_output(**x)) {
            return Err(format!("{name}, minute {minute}: {x:e} in the output"));
        }
        for ear in &ears {
            let mean = ear.iter().map(|x| f64::from(*x)).sum::<f64>() / ear.len() as f64;
            worst_dc = worst_dc.max(mean.abs() / rms(ear));
            loudest = ear.iter().fold(loudest, |most, x| most.max(x.abs()));
        }
        if minute % 60 == 59 {
            let new = play(&mut spatializer(scene, RATE), seed, minute);
            let last = |ears: &[Vec<f32>; 2]| ears.each_ref().map(|ear| ear[MINUTE - 48_000..].to_vec());
            let level = 20.0 * (rms(&last(&ears)[0]) as f32).log10();
            worst_drift = worst_drift.max(difference_db(&last(&ears), &last(&new)) - level);
        }
    }
    let speed = 3600.0 * hours as f64 / began.elapsed().as_secs_f64();
    println!(
        "{name}: {hours} h, {speed:.0} times real time; drift {worst_drift:.0} dB, mean {worst_dc:.1e} of the level, peak \
         {loudest:.2}"
    );
    if worst_drift > DRIFT_DB {
        return Err(format!("{name}: drift of {worst_drift} dB, expected at most {DRIFT_DB}"));
    }
    if worst_dc > DC {
        return Err(format!("{name}: a mean of {worst_dc} of the level, expected at most {DC}"));
    }
    Ok(())
}

/// Streams to which everything happens.
fn wild_streams(cases: u64, seed: u64) -> Result<(), String> {
    let small = scenes(8_000.0);
    let large = [
        ("taps of 10 s", one_transfer(8_000.0, 0.01, 2_000, 1.0)),
        ("65,536 anchors", room_of_anchors(8_000.0, 65_536)),
        ("1,000 images", room_with_images(8_000.0, 0.3, 0.1, 1_000)),
    ];
    for (scenes, cases) in [(&small[..], cases), (&large[..], cases.div_ceil(20))] {
        // A decode of the large cloud takes a tenth of a second.
        let samples = if scenes.len() > 3 { 100_000 } else { 4_000 };
        for seed in seed..seed + cases {
            let mut rng = Rng::with_seed(seed);
            wild(&mut rng, scenes, samples).map_err(|found| format!("seed {seed}: {found}"))?;
        }
        println!("wild streams: {cases} with {} scenes", scenes.len());
    }
    Ok(())
}

/// Instances that come and go; the memory that they leave behind, bytes, where the system tells.
fn instances(count: usize) -> Result<(), String> {
    let resident = || {
        let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
        statm.split_whitespace().nth(1)?.parse::<i64>().ok().map(|pages| pages * 4096)
    };
    let scene = room(RATE, 0.5, 0.1);
    let carriers = Arc::new(Carriers::new(&scene, RATE));
    let input = noise(1, 1_000);
    let play = || -> Result<[Vec<f32>; 2], String> {
        let renderer = Renderer::new(Arc::clone(&scene), (RATE, Arc::clone(&carriers))).map_err(|e| e.to_string())?;
        let mut s = Spatializer::new(RATE);
        s.install(Box::new(renderer));
        Ok(render(&mut s, &input, &[64], &BlockParams::default(), |i| Walk::Spinning.pose(i, RATE)))
    };
    let first = play()?;
    (0..100).try_for_each(|_| play().map(|_| ()))?;
    let before = resident();
    for number in 0..count {
        if play()? != first {
            return Err(format!("instance {number} sounds unlike the first"));
        }
    }
    let grown = resident().zip(before).map(|(after, before)| after - before);
    println!("{count} instances made and dropped; resident memory grew by {grown:?} bytes");
    match grown {
        Some(grown) if grown > 8 << 20 => Err(format!("{count} instances left {grown} bytes behind")),
        _ => Ok(()),
    }
}

fn soak(options: &Options) -> Result<(), String> {
    let Options { hours, seed } = *options;
    println!("seed {seed}, {hours} h of audio");
    day("a room", &room(RATE, 0.5, 0.1), hours, seed)?;
    // An hour of each is enough to tell whether anything adds up.
    day("measured responses", &room_of_responses(RATE).0, hours.div_ceil(24), seed)?;
    day("image sources", &room_with_images(RATE, 0.5, 0.1, 40), hours.div_ceil(24), seed)?;
    wild_streams(20 * hours as u64, seed)?;
    instances(1_000 * hours)
}

fn main() -> ExitCode {
    match Options::read().and_then(|options| soak(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(found) => {
            eprintln!("{found}");
            ExitCode::FAILURE
        }
    }
}
