//! How the cost of a moving listener grows with what a scene holds and how a host plays it.
//!
//! `cargo bench --bench scaling -p promenade-core`. One thing is changed at a time from a noise scene with 24 taps (120 ms) and
//! no images at 48 kHz in blocks of 512. Unit: processor seconds per second of audio of the one thread, median of interleaved
//! runs on white noise; the listener walks at 1 m/s and turns at 90 degrees a second. The last column is the ratio to the
//! unchanged scene in the same run.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use promenade_core::{BlockParams, Renderer, Scene, Spatializer};
use promenade_testing::noise;
use promenade_testing::scenes::{room_with_images, room_with_taps, walk};
use std::hint::black_box;
use std::sync::Arc;

const RATE: f64 = 48_000.0;
const BLOCK: usize = 512;
const TAPS: usize = 24;
const SECONDS: f64 = 2.0;
const RUNS: usize = 7;

/// A scene as a host plays it.
struct Case {
    changed: String,
    spatializer: Spatializer,
    rate: f64,
    block: usize,
    times: Vec<f64>,
}

impl Case {
    fn new(changed: String, scene: &Arc<Scene>, rate: f64, block: usize) -> Self {
        let mut spatializer = Spatializer::new(rate);
        spatializer.install(Box::new(Renderer::new(Arc::clone(scene), rate).expect("the scene can be played")));
        Self { changed, spatializer, rate, block, times: Vec::new() }
    }

    fn run(&mut self) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
        let input = noise(1, (SECONDS * self.rate) as usize);
        let (mut left, mut right) = (vec![0.0; self.block], vec![0.0; self.block]);
        let walk = walk(self.rate);
        let began = ThreadTime::now();
        for (number, dry) in input.chunks_exact(self.block).enumerate() {
            let out = [&mut left[..], &mut right[..]];
            self.spatializer.process(&[dry], &[], out, &BlockParams::default(), |i| walk(number * self.block + i));
        }
        black_box((&left, &right));
        self.times.push(began.elapsed().as_secs_f64() / SECONDS);
    }

    fn median(&mut self) -> f64 {
        self.times.sort_by(f64::total_cmp);
        self.times[self.times.len() / 2]
    }
}

fn main() {
    let plain = room_with_taps(RATE, 1.0, 0.05, TAPS);
    let mut cases = vec![Case::new("nothing".to_owned(), &plain, RATE, BLOCK)];
    for taps in [6, 12, 48, 96, 192] {
        cases.push(Case::new(format!("{taps} taps"), &room_with_taps(RATE, 1.0, 0.05, taps), RATE, BLOCK));
    }
    for images in [1, 15, 60, 150, 500] {
        cases.push(Case::new(format!("{images} images"), &room_with_images(RATE, 1.0, 0.05, images), RATE, BLOCK));
    }
    for rate in [16_000.0, 96_000.0, 192_000.0] {
        cases.push(Case::new(format!("host at {} kHz", rate / 1e3), &plain, rate, BLOCK));
    }
    for block in [32, 128, 2048] {
        cases.push(Case::new(format!("blocks of {block}"), &plain, RATE, block));
    }
    for _ in 0..RUNS {
        cases.iter_mut().for_each(Case::run);
    }
    println!("| Changed | % of a core | Ratio |\n|---|---:|---:|");
    let base = cases[0].median();
    for case in &mut cases {
        let cost = case.median();
        println!("| {} | {:.2} | {:.2} |", case.changed, 100.0 * cost, cost / base);
    }
}
