//! What a step of training costs: `cargo bench -p promenade-trainer --bench step_cost`.
//!
//! Batches of 6 one-second clips at 22,050 Hz of noise, on as many threads as there are processors; medians of the wall times
//! of single steps. `step_cost.py` beside it times PyTorch on the second row.

use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::{Capture, Clip, Emitter, Split, Track, Voice};
use promenade_core::glam::Vec3;
use promenade_core::network::Placement;
use promenade_core::random::Random;
use promenade_core::{CameraPath, Keyframe, Pose};
use promenade_trainer::{Device, NetworkSettings, TrainSettings, Trainer};
use std::time::Instant;

const RATE: usize = 22_050;
const STEPS: usize = 9;

fn capture() -> Capture {
    let mut random = Random::new(1);
    let count = 8;
    let dry: Vec<f32> = (0..count * RATE).map(|_| 0.1 * random.normal()).collect();
    let pose = |i: usize| Pose::from_ypr(Vec3::new(i as f32 * 0.3, 1.0, 1.5), i as f32, 0.0, 0.0);
    let clip = |i: usize| Clip {
        name: format!("{i}"),
        track: 0,
        start: i * RATE,
        len: RATE,
        pose: pose(i),
        split: if i < 6 { Split::Train } else { Split::Test },
    };
    let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: pose(0) }]).expect("one keyframe is a path");
    Capture {
        title: "Noise".to_owned(),
        credit: String::new(),
        licence: String::new(),
        sample_rate_hz: RATE as f64,
        emitters: vec![Emitter::at(Vec3::new(1.0, 3.0, 1.5))],
        clips: (0..count).map(clip).collect(),
        tracks: vec![Track {
            name: "noise".to_owned(),
            binaural: [dry.clone(), dry.clone()],
            voices: vec![Voice { emitter: Some(0), dry }],
            path,
        }],
        notes: Vec::new(),
    }
}

fn anchors(count: usize) -> AnchorSet {
    let mut random = Random::new(2);
    let positions = (0..count).map(|_| Vec3::new(random.normal(), random.normal(), random.normal())).collect();
    let features = (0..count * 150).map(|_| random.normal()).collect();
    AnchorSet { placement: Placement::IDENTITY, positions, features, neighbours: 50 }
}

fn main() {
    let capture = capture();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let published =
        NetworkSettings { width: 128, layers: 3, feed_forward: 512, bands: 257, octaves: 10, ..NetworkSettings::default() };
    println!("{threads} threads, batches of 6 clips of 1 s, medians of {STEPS} steps");
    let cases = [
        ("taps, N=64, F=64, C=64, 2 layers", 64, NetworkSettings::default()),
        ("taps, N=256, F=257, C=128, 3 layers", 256, published),
    ];
    for (name, count, network) in cases {
        let settings = TrainSettings { network, steps: 1000, ..TrainSettings::default() };
        let mut trainer =
            Trainer::new(&capture, &anchors(count), settings, Device::flex(), threads).expect("settings in range");
        trainer.step();
        let mut times: Vec<f64> = (0..STEPS)
            .map(|_| {
                let began = Instant::now();
                trainer.step();
                began.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{name}: {:.3} s a step ({:.3} to {:.3})", times[STEPS / 2], times[0], times[STEPS - 1]);
    }
}
