//! Processor time and memory of further sources in one instance, beside those of an instance of one source.
//!
//! `cargo bench --bench sources -p promenade-tests`. The plugin is the one that cargo builds beside it, or that of
//! `PROMENADE_BUNDLES`. Time: of a processor for each hop of 5 ms, at 48 kHz in blocks of 512, median of the runs, which are
//! taken by turns; every input that sounds has white noise, and the listener turns by 90 degrees a second with automation every
//! 32 samples, or stands still. Memory: what is resident of the process more than before the instance (Linux).
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use promenade_host::{Lane, Point};
use promenade_tests::memory::resident_bytes;
use promenade_tests::signal::noise;
use promenade_tests::{ClapHost, Host, Setup, Vst3};

const RATE: f64 = 48_000.0;
const BLOCK: usize = 512;
const LEN: usize = 64 * 1024;
const RUNS: usize = 9;

/// A plugin with some tracks, of which some sound.
struct Played<H> {
    name: &'static str,
    host: H,
    tracks: usize,
    sounding: usize,
    lane: Lane,
    at: u64,
    memory_kib: i64,
}

/// An instance of one source, or of many with so many further tracks.
fn opened<H: Host>(name: &'static str, further: Option<usize>, sounding: usize, scene: f64) -> Played<H> {
    let resident = || i64::try_from(resident_bytes().unwrap_or(0) / 1024).unwrap_or(0);
    let before = resident();
    let setup = Setup { rate: RATE, block: BLOCK, inputs: 1, ..Setup::default() };
    let mut host = match further {
        Some(further) => H::open_many(Setup { further, ..setup }),
        None => H::open(setup),
    };
    host.set("scene", scene);
    host.instance().settle().expect("the plugin starts again");
    let parameter = host.instance().parameter("Yaw").expect("the plugin has the parameter").clone();
    let point = |turn: usize| Point { seconds: 2.0 * turn as f64, value: [0.25, 0.75][turn % 2], hold: false };
    let lane = Lane::new(&parameter, &(0..100).map(point).collect::<Vec<_>>(), RATE).expect("times rise");
    let tracks = 1 + further.unwrap_or(0);
    let mut played = Played { name, host, tracks, sounding, lane, at: 0, memory_kib: 0 };
    played.turn(&noise(LEN / 8), true);
    played.memory_kib = resident() - before;
    played
}

impl<H: Host> Played<H> {
    /// Processor seconds for a second of sound.
    fn turn(&mut self, signal: &[f32], moves: bool) -> f64 {
        let (silence, mut left, mut right) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        let began = ThreadTime::now();
        for block in signal.chunks_exact(BLOCK) {
            let instance = self.host.instance();
            let set = |offset, value| instance.set_at(self.lane.id(), value, offset);
            if moves {
                self.lane.events(self.at, BLOCK, set).expect("the plugin takes the value");
            }
            let mut tracks = [&silence[..]; 64];
            tracks[..self.sounding].fill(block);
            instance.process_into(&tracks[..self.tracks], &mut [&mut left, &mut right]).expect("the plugin plays");
            self.at += BLOCK as u64;
        }
        began.elapsed().as_secs_f64() / (signal.len() as f64 / RATE)
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table<H: Host>(scene: (&str, f64)) {
    // What all instances of a scene share is there before.
    drop(opened::<H>("", None, 1, scene.1));
    let _shared = opened::<H>("", None, 1, scene.1);
    let mut all = [
        opened::<H>("Promenade", None, 1, scene.1),
        opened("Many, no further track", Some(0), 1, scene.1),
        opened("Many, 15 silent tracks", Some(15), 1, scene.1),
        opened("Many, one of them sounds", Some(15), 2, scene.1),
        opened("Many, all sound", Some(15), 16, scene.1),
        opened("Many 64, 63 silent tracks", Some(63), 1, scene.1),
        opened("Many 64, all sound", Some(63), 64, scene.1),
    ];
    let signal = noise(LEN);
    let mut costs = vec![[Vec::new(), Vec::new()]; all.len()];
    for _ in 0..RUNS {
        for (played, costs) in all.iter_mut().zip(&mut costs) {
            costs.iter_mut().zip([true, false]).for_each(|(costs, moves)| costs.push(played.turn(&signal, moves)));
        }
    }
    for (played, costs) in all.iter().zip(&mut costs) {
        // A hop of the built-in scenes is 5 ms.
        let [moving, still] = costs.each_mut().map(|costs| 5e3 * median(costs));
        let row = format!("{moving:.1} us | {still:.1} us | {} KiB", played.memory_kib);
        println!("| {} | {} | {} | {row} |", H::FORMAT, scene.0, played.name);
    }
}

fn main() {
    println!("tier Standard, {RUNS} runs of {:.1} s, of one core\n", LEN as f64 / RATE);
    println!("| format | scene | instance | a hop, turning | standing still | memory |\n|---|---|---|---|---|---|");
    for scene in [("Room A", 0.0), ("loft", 1.0)] {
        table::<ClapHost>(scene);
        table::<Vst3>(scene);
    }
}
