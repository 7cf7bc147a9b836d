//! How late blocks are where many instances play in one thread at blocks of 64, and how uneven they are.
//!
//! `cargo bench --bench late_blocks -p promenade-core`. Printed are how many blocks of three seconds took longer than they
//! last, the mean of all as a share of a core, the worst over the mean and over the median, and a histogram of the time that
//! blocks took as a share of what they last. Every block is the fastest of several runs: the machine's interruptions fall on
//! other blocks each time.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use promenade_core::{BlockParams, Carriers, Pose, Renderer, RendererConfig, Scene, Spatializer};
use promenade_testing::noise;
use promenade_testing::scenes::walk;
use std::hint::black_box;
use std::sync::Arc;

const RATE: f64 = 48_000.0;
const BLOCK: usize = 64;
const RUNS: usize = 3;
const SECONDS: usize = 3;
/// Blocks at the start that find the caches full of something else.
const WARM_UP: usize = 30;

fn main() {
    println!(
        "| scene | instances | staggered | late | mean | worst / mean | worst / median | blocks by tenths of what they last |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let cases = [("loft", 1), ("iosr-room-a", 1), ("loft", 16), ("iosr-room-a", 50)];
    for (staggered, (name, instances)) in
        cases.map(|case| (false, case)).into_iter().chain([(true, cases[2]), (true, cases[3])])
    {
        let file = format!("{}/../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
        let scene = Arc::new(Scene::from_bytes(&std::fs::read(file).expect("a factory scene")).expect("a scene"));
        let carriers = Arc::new(Carriers::new(&scene, RATE));
        let engine = |number: usize| {
            let mut s = Spatializer::new(RATE);
            let phase = if staggered { number * scene.grid().at_rate(RATE).hop / instances } else { 0 };
            let config = RendererConfig { phase, ..(RATE, Arc::clone(&carriers)).into() };
            let renderer = Renderer::new(Arc::clone(&scene), config);
            s.install(Box::new(renderer.expect("it can be played")));
            s
        };
        let input = noise(1, SECONDS * RATE as usize);
        let mut fastest = vec![f64::INFINITY; input.len() / BLOCK];
        for _ in 0..RUNS {
            let mut engines: Vec<_> = (0..instances).map(&engine).collect();
            for (number, (x, fastest)) in input.chunks_exact(BLOCK).zip(&mut fastest).enumerate() {
                let began = ThreadTime::now();
                for engine in &mut engines {
                    let (mut left, mut right) = ([0.0; BLOCK], [0.0; BLOCK]);
                    let start = scene.start_pose();
                    let pose = |i: usize| {
                        let walked = walk(RATE)(number * BLOCK + i);
                        Pose { position: start.position + 0.5 * walked.position, ..walked }
                    };
                    engine.process(&[x], &[], [&mut left, &mut right], &BlockParams::default(), pose);
                    black_box((&left, &right));
                }
                *fastest = fastest.min(began.elapsed().as_secs_f64());
            }
        }
        let lasts = BLOCK as f64 / RATE;
        let mut shares: Vec<f64> = fastest[WARM_UP..].iter().map(|s| s / lasts).collect();
        let mut histogram = [0; 11];
        shares.iter().for_each(|share| histogram[((share * 10.0) as usize).min(10)] += 1);
        shares.sort_by(f64::total_cmp);
        let (mean, worst) = (shares.iter().sum::<f64>() / shares.len() as f64, shares[shares.len() - 1]);
        let (late, median) = (shares.iter().filter(|share| **share > 1.0).count(), shares[shares.len() / 2]);
        println!(
            "| {name} | {instances} | {staggered} | {late} of {} | {:.0} % | {:.1} | {:.1} | {histogram:?} |",
            shares.len(),
            100.0 * mean,
            worst / mean,
            worst / median
        );
    }
}
