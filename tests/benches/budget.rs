//! What a budget of processor time keeps to, and what it costs in sound: twenty talkers of one process, played in real time.
//!
//! `cargo bench --bench budget -p promenade-tests`. Every instance speaks from another place of `data/speech.wav` at another
//! level, down to -38 dB, with pauses, and its listener turns by 90 degrees a second and walks at 1 m/s. Limits are shares of
//! what all take without one. Printed: the limit and what was taken, processor time of the thread that plays all in turn, by
//! the sound's; energy of the difference to the mix without a limit, below the mix.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use promenade_host::{Lane, Point};
use promenade_tests::{ClapHost, Host, Setup, edit_state};
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant};

const RATE: f64 = 48_000.0;
const BLOCK: usize = 512;
const COUNT: usize = 20;
const SECONDS: f64 = 12.0;
/// Costs are found and shared out within this time, which does not count, seconds.
const SETTLED_S: f64 = 2.0;
const SHARES: [f64; 5] = [0.9, 0.75, 0.5, 0.35, 0.2];

/// What every instance is given.
fn talkers(blocks: usize) -> Vec<Vec<f32>> {
    let speech = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/speech.wav");
    let speech = promenade_audio::sound::read(&speech).expect("the speech can be read");
    let [speech] = &speech.channels[..] else { panic!("the speech has one channel") };
    let talks = |number: usize, at: usize| !(at / 72_000 + number).is_multiple_of(3);
    let talker = |number: usize| {
        let gain = 10_f32.powf(-0.1 * number as f32);
        let sample = |at: usize| if talks(number, at) { gain * speech[(at / 3 + 17_000 * number) % speech.len()] } else { 0.0 };
        (0..blocks * BLOCK).map(sample).collect()
    };
    (0..COUNT).map(talker).collect()
}

/// Plays all in real time. Returns the mix and the processor seconds per second.
fn play(hosts: &mut [ClapHost], lanes: &[Lane], inputs: &[Vec<f32>]) -> ([Vec<f32>; 2], f64) {
    let (mut left, mut right) = (vec![0.0; BLOCK], vec![0.0; BLOCK]);
    let mut mix = [Vec::new(), Vec::new()];
    let (began, mut took, mut counted) = (Instant::now(), Duration::ZERO, 0.0);
    for at in (0..inputs[0].len()).step_by(BLOCK) {
        let from = ThreadTime::now();
        mix.iter_mut().for_each(|ear| ear.resize(at + BLOCK, 0.0));
        for (host, input) in hosts.iter_mut().zip(inputs) {
            let instance = host.instance();
            for lane in lanes {
                let set = lane.events(at as u64, BLOCK, |offset, value| instance.set_at(lane.id(), value, offset));
                set.expect("the plugin takes the value");
            }
            let input = &input[at..at + BLOCK];
            instance.process_into(&[input, input], &mut [&mut left, &mut right]).expect("the plugin plays");
            for (ear, out) in mix.iter_mut().zip([&left, &right]) {
                ear[at..].iter_mut().zip(out).for_each(|(sum, x)| *sum += x);
            }
        }
        let played_s = (at + BLOCK) as f64 / RATE;
        if played_s > SETTLED_S {
            took += from.elapsed();
            counted += BLOCK as f64 / RATE;
        }
        std::thread::sleep(Duration::from_secs_f64(played_s).saturating_sub(began.elapsed()));
    }
    (mix, took.as_secs_f64() / counted)
}

fn limit(host: &mut ClapHost, percent: f64) {
    let state = edit_state(&host.state(), "budget", &json!(percent));
    assert!(host.load(&state), "the plugin takes a state");
}

fn main() {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
    let inputs = talkers((SECONDS * RATE) as usize / BLOCK);
    let setup = Setup { rate: RATE, block: BLOCK, ..Setup::default() };
    let mut hosts: Vec<ClapHost> = (0..COUNT).map(|_| ClapHost::open(setup)).collect();
    let mut lane = |name: &str, from: &str, to: &str| {
        let instance = hosts[0].instance();
        let parameter = instance.parameter(name).expect("the plugin has the parameter").clone();
        let ends = [from, to].map(|text| instance.from_text(parameter.id, text).expect("the plugin understands its own unit"));
        let point = |turn: usize| Point { seconds: 2.0 * turn as f64, value: ends[turn % 2], hold: false };
        Lane::new(&parameter, &(0..100).map(point).collect::<Vec<_>>(), RATE).expect("times rise")
    };
    let lanes = [lane("Yaw", "-90", "90"), lane("Listener Y", "-1", "1")];
    play(&mut hosts, &lanes, &inputs);
    let (whole, free) = play(&mut hosts, &lanes, &inputs);
    println!("{COUNT} instances without a limit: {:.2} % of one core\n", 100.0 * free);
    println!("| Limit | Taken | Difference |\n|---:|---:|---:|");
    let energy = |ears: &[Vec<f32>; 2]| ears.iter().flatten().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    let row = |limit: &str, mix: &[Vec<f32>; 2], taken: f64| {
        let apart = [0, 1].map(|ear| mix[ear].iter().zip(&whole[ear]).map(|(a, b)| a - b).collect::<Vec<_>>());
        let below_db = 10.0 * (energy(&apart) / energy(&whole)).log10();
        println!("| {limit} | {:.2} % | {below_db:.1} dB |", 100.0 * taken);
    };
    let (again, taken) = play(&mut hosts, &lanes, &inputs);
    row("none, again", &again, taken);
    for share in SHARES {
        limit(&mut hosts[0], 100.0 * share * free);
        let (mix, taken) = play(&mut hosts, &lanes, &inputs);
        row(&format!("{:.2} %", 100.0 * share * free), &mix, taken);
    }
}
