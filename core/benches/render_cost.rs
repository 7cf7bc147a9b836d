//! Cost of the render head, beside a bare short-time transform and a partitioned convolver, in one run.
//!
//! `cargo bench --bench render_cost -p promenade-core [-- SCENE...]`; scenes given by their files are measured too. Unit:
//! processor seconds per second of audio of the one thread, median over runs. Input: white noise at 48 kHz; a scene with a tail
//! of 1 s; a listener who walks at 1 m/s and turns at 90 degrees a second.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use fft_convolver::TwoStageFFTConvolver;
use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer, Tier};
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
    println!("| block | engine | real time | x STFT | x convolver | worst block / median block with a hop |");
    println!("|---|---|---|---|---|---|");
    for block in [512, 128] {
        let mut rows: Vec<(String, Vec<f64>, Vec<f64>)> = Vec::new();
        let mut engines = engines(&scene);
        for _ in 0..RUNS {
            for (i, (name, engine)) in engines.iter_mut().enumerate() {
                let (total, blocks) = cost(&input, block, engine);
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
    let ours = |scene: &Arc<Scene>, tier: Tier, moving: bool| -> Engine {
        let mut s = Spatializer::new(RATE);
        s.install(Box::new(Renderer::new(Arc::clone(scene), RATE).unwrap()));
        let walk = walk(RATE);
        let still = Pose::IDENTITY;
        let params = BlockParams { tier, ..BlockParams::default() };
        Box::new(move |at: usize, x: &[f32], out: [&mut [f32]; 2]| {
            s.process(&[x], out, &params, |i| if moving { walk(at + i) } else { still });
        })
    };
    let images = room_with_images(RATE, 1.0, 0.05, 60);
    let mut engines: Vec<(String, Engine)> = vec![
        ("bare STFT, 1 forward, 2 inverse".to_owned(), Box::new(stft)),
        ("fft-convolver, 2 ears of 1 s, standing still".to_owned(), Box::new(convolver)),
        ("draft, moving".to_owned(), ours(scene, Tier::Draft, true)),
        ("standard, standing still".to_owned(), ours(scene, Tier::Standard, false)),
        ("standard, moving".to_owned(), ours(scene, Tier::Standard, true)),
        ("standard with 60 images, standing still".to_owned(), ours(&images, Tier::Standard, false)),
        ("standard with 60 images, moving".to_owned(), ours(&images, Tier::Standard, true)),
    ];
    for file in std::env::args().skip(1).filter(|a| !a.starts_with("--")) {
        let scene = Arc::new(Scene::from_bytes(&std::fs::read(&file).unwrap()).unwrap());
        for tier in [Tier::Draft, Tier::Standard] {
            engines.push((format!("{} moving: {file}", tier.name()), ours(&scene, tier, true)));
        }
    }
    engines
}
