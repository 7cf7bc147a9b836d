//! Cost of the render head, beside a bare short-time transform and a partitioned convolver, in one run.
//!
//! `cargo bench --bench render_cost -p promenade-core [-- [--many] [SCENE...]]`; scenes given by their files are measured too,
//! and with `--many` nothing is measured but many sources. Unit:
//! processor seconds per second of audio of the one thread, median over runs; microseconds a hop where many play, whether in
//! instances of their own or in one. Input: white noise at 48 kHz; a scene with a tail
//! of 1 s; a listener who walks at 1 m/s and turns at 90 degrees a second.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use fft_convolver::TwoStageFFTConvolver;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Carriers, Latency, Pose, Renderer, RendererConfig, Scene, Spatializer, Voice};
use promenade_testing::noise;
use promenade_testing::scenes::{room, room_with_images, walk};
use std::hint::black_box;
use std::sync::Arc;

const RATE: f64 = 48_000.0;
const SECONDS: usize = 4;
const RUNS: usize = 9;
/// Blocks at the start of each run that do not count for the worst.
const WARM_UP: usize = 10;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Processor seconds per second of audio, and seconds of each block.
fn cost(input: &[f32], block: usize, mut process: impl FnMut(usize, &[f32], [&mut [f32]; 2])) -> (f64, Vec<f64>) {
    let (mut left, mut right) = (vec![0.0; block], vec![0.0; block]);
    let mut blocks = Vec::with_capacity(input.len() / block);
    let start = ThreadTime::now();
    for (b, chunk) in input.chunks_exact(block).enumerate() {
        let began = ThreadTime::now();
        process(b * block, chunk, [&mut left, &mut right]);
        blocks.push(began.elapsed().as_secs_f64());
    }
    black_box((&left, &right));
    (start.elapsed().as_secs_f64() / (input.len() as f64 / RATE), blocks)
}

fn main() {
    let input = noise(1, SECONDS * RATE as usize);
    let scene = room(RATE, 1.0, 0.05);
    let bytes = scene.memory_bytes();
    let renderer = Renderer::new(Arc::clone(&scene), RATE).unwrap();
    println!("scene {bytes} bytes once, instance {} bytes", renderer.memory_bytes());
    if !std::env::args().any(|a| a == "--many") {
        table(&scene, &input);
    }
    println!();
    println!("Many sources, moving, blocks of {BLOCK}, us a hop:");
    println!(
        "| scene | sources | one alone | each of as many instances | a further source | over one alone | over one of many \
         | KB of one | KB of a further source | share |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let second = &input[..RATE as usize];
    many("noise", &scene, second);
    many("60 images", &room_with_images(RATE, 1.0, 0.05, 60), second);
    for file in files() {
        many(&file, &read(&file), second);
    }
}

/// One instance of each kind.
fn table(scene: &Arc<Scene>, input: &[f32]) {
    println!("| block | engine | real time | x STFT | x convolver | worst block / median block with a hop |");
    println!("|---|---|---|---|---|---|");
    for block in [512, 128] {
        let mut rows: Vec<(String, Vec<f64>, Vec<f64>)> = Vec::new();
        let mut engines = engines(scene);
        for _ in 0..RUNS {
            for (i, (name, engine)) in engines.iter_mut().enumerate() {
                let (total, blocks) = cost(input, block, engine);
                match rows.get_mut(i) {
                    Some((_, totals, fastest)) => {
                        totals.push(total);
                        // Every run does the same in the same block, so the fastest of all runs is what the engine itself
                        // takes: the machine's interruptions fall on other blocks each time.
                        fastest.iter_mut().zip(blocks).for_each(|(f, b)| *f = f.min(b));
                    }
                    None => rows.push((name.clone(), vec![total], blocks)),
                }
            }
        }
        let base: Vec<f64> = rows.iter().map(|r| median(r.1.clone())).collect();
        for (i, (name, _, fastest)) in rows.iter().enumerate() {
            // The first blocks of a run find the caches full of another engine.
            let mut sorted = fastest[WARM_UP..].to_vec();
            sorted.sort_by(f64::total_cmp);
            // Blocks shorter than a hop mostly only copy; the median is taken over those that hold a hop.
            let busy = (block as f64 / scene.grid().hop as f64).min(1.0);
            let idle = sorted.len() - (sorted.len() as f64 * busy) as usize;
            let worst = sorted[sorted.len() - 1] / median(sorted[idle..].to_vec());
            println!(
                "| {block} | {name} | {:.5} | {:.2} | {:.2} | {worst:.2} |",
                base[i],
                base[i] / base[0],
                base[i] / base[1],
            );
        }
    }
}

/// Scenes that are named on the command line.
fn files() -> impl Iterator<Item = String> {
    std::env::args().skip(1).filter(|a| !a.starts_with("--"))
}

fn read(file: &str) -> Arc<Scene> {
    Arc::new(Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap())
}

/// Samples of each turn of many sources.
const BLOCK: usize = 512;

/// A listener who walks among sources: one, many in one instance, and as many instances.
fn many(name: &str, scene: &Arc<Scene>, input: &[f32]) {
    let carriers = Arc::new(Carriers::new(scene, RATE));
    let instance = |sources: usize| {
        let config = RendererConfig { voices: sources, ..(RATE, Arc::clone(&carriers)).into() };
        let renderer = Renderer::new(Arc::clone(scene), config).unwrap();
        let bytes = renderer.memory_bytes();
        let mut s = Spatializer::new(RATE);
        s.install(Box::new(renderer));
        (s, bytes)
    };
    let per_hop = scene.grid().at_rate(RATE).hop_s() * 1e6;
    let (one, alone_bytes) = instance(1);
    let mut alone = vec![one];
    for sources in [16, 50, 64] {
        let (many, bytes) = instance(sources);
        let (mut many, mut each) = (vec![many], (0..sources).map(|_| instance(1).0).collect::<Vec<_>>());
        let mut totals = [Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..RUNS {
            for (engines, totals) in [&mut alone, &mut many, &mut each].into_iter().zip(&mut totals) {
                totals.push(per_hop * walked(engines, input));
            }
        }
        let [alone, many, each] = totals.map(median);
        let (further, of_many) = ((many - alone) / (sources - 1) as f64, each / sources as f64);
        let more = (bytes - alone_bytes) as f64 / (sources - 1) as f64;
        println!(
            "| {name} | {sources} | {alone:.1} | {of_many:.1} | {further:.1} | {:.2} | {:.2} | {:.0} | {:.0} | {:.2} |",
            further / alone,
            further / of_many,
            alone_bytes as f64 / 1e3,
            more / 1e3,
            more / alone_bytes as f64,
        );
    }
}

/// Processor seconds per second of audio of instances that all play the same, and all of whose sources do.
fn walked(engines: &mut [Spatializer], input: &[f32]) -> f64 {
    let walk = walk(RATE);
    let (mut left, mut right) = (vec![0.0; BLOCK], vec![0.0; BLOCK]);
    let place = |i: usize| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0);
    let params = BlockParams::default();
    let further = engines[0].renderer().map_or(0, |renderer| renderer.voices() - 1);
    let start = ThreadTime::now();
    for (b, x) in input.chunks_exact(BLOCK).enumerate() {
        let others: Vec<_> = (0..further).map(|i| Voice::at(x, place(i))).collect();
        for engine in &mut *engines {
            engine.process(&[x], &others, [&mut left, &mut right], &params, |i| walk(b * BLOCK + i));
        }
    }
    black_box((&left, &right));
    start.elapsed().as_secs_f64() / (input.len() as f64 / RATE)
}

type Engine = Box<dyn FnMut(usize, &[f32], [&mut [f32]; 2])>;

fn engines(scene: &Arc<Scene>) -> Vec<(String, Engine)> {
    let (n, hop) = (scene.grid().n_fft, scene.grid().hop);
    let (forward, inverse) = (promenade_fourier::forward::<f32>(n), promenade_fourier::inverse::<f32>(n));
    let (mut time, mut spectrum) = (forward.make_input_vec(), forward.make_output_vec());
    let mut scratch = forward.make_scratch_vec();
    let mut filled = 0;
    let stft = move |_: usize, x: &[f32], _: [&mut [f32]; 2]| {
        for v in x {
            filled += 1;
            if filled == hop {
                filled = 0;
                time.fill(*v);
                forward.process_with_scratch(&mut time, &mut spectrum, &mut scratch).unwrap();
                let kept = spectrum.clone();
                for _ in 0..2 {
                    spectrum.copy_from_slice(&kept);
                    spectrum[0].im = 0.0;
                    spectrum[n / 2].im = 0.0;
                    inverse.process_with_scratch(&mut spectrum, &mut time, &mut scratch).unwrap();
                }
            }
        }
    };
    let decay = |i: usize| 10.0_f32.powf(-3.0 * i as f32 / RATE as f32);
    let response: Vec<f32> = noise(5, RATE as usize).iter().enumerate().map(|(i, v)| v * decay(i)).collect();
    let mut ears = [TwoStageFFTConvolver::<f32>::default(), TwoStageFFTConvolver::default()];
    let mut ready = 0;
    let convolver = move |_: usize, x: &[f32], [left, right]: [&mut [f32]; 2]| {
        for (ear, out) in ears.iter_mut().zip([left, right]) {
            if ready < 2 {
                ear.init(x.len(), 4096, &response).unwrap();
                ready += 1;
            }
            ear.process(x, out).unwrap();
        }
    };
    let ours_with = |scene: &Arc<Scene>, moving: bool, latency: Latency| -> Engine {
        let mut s = Spatializer::new(RATE);
        let carriers = Arc::new(Carriers::with_latency(scene, RATE, latency));
        s.install(Box::new(Renderer::new(Arc::clone(scene), (RATE, carriers)).unwrap()));
        let walk = walk(RATE);
        let still = Pose::IDENTITY;
        let params = BlockParams::default();
        Box::new(move |at: usize, x: &[f32], out: [&mut [f32]; 2]| {
            s.process(&[x], &[], out, &params, |i| if moving { walk(at + i) } else { still });
        })
    };
    let ours = |scene: &Arc<Scene>, moving: bool| ours_with(scene, moving, Latency::Frame);
    let images = room_with_images(RATE, 1.0, 0.05, 60);
    let mut engines: Vec<(String, Engine)> = vec![
        ("bare STFT, 1 forward, 2 inverse".to_owned(), Box::new(stft)),
        ("fft-convolver, 2 ears of 1 s, standing still".to_owned(), Box::new(convolver)),
        ("standing still".to_owned(), ours(scene, false)),
        ("moving".to_owned(), ours(scene, true)),
        ("60 images, standing still".to_owned(), ours(&images, false)),
        ("60 images, moving".to_owned(), ours(&images, true)),
    ];
    for file in files() {
        let scene = read(&file);
        engines.push((format!("moving: {file}"), ours(&scene, true)));
        engines.push((format!("standing still: {file}"), ours(&scene, false)));
        for latency in [Latency::Samples64, Latency::None] {
            for (moving, how) in [(false, "standing still"), (true, "moving")] {
                let engine = ours_with(&scene, moving, latency);
                engines.push((format!("latency {}, {how}: {file}", latency.name()), engine));
            }
        }
    }
    engines
}
