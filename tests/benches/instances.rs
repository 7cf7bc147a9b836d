//! Memory and processor time of many instances of one bundle in one process, all with the same scene and a listener who moves.
//!
//! `cargo bench --bench instances -p promenade-tests`. The plugin is the one that cargo builds beside it, or that of
//! `PROMENADE_BUNDLES`. Time: processor seconds of the one thread that plays all instances in turn, per second of sound, at 48
//! kHz in blocks of 512, with `-- --blocks` of Room A and the loft in blocks of 64, 128 and 512, median of the runs; input is
//! white noise, and every listener turns by 90 degrees a second and walks at
//! 1 m/s with automation every 32 samples; then without automation, and then without input too, once the room has died away.
//! Memory: what is resident of the process (Linux), of which before the first instance is taken off. Before that, seconds by
//! the clock from the first instance that is opened to the last that plays, for each number and sample rate in a process of its
//! own.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use cpu_time::ThreadTime;
use promenade_host::{Instance, Lane, Point};
use promenade_tests::memory::resident_bytes;
use promenade_tests::signal::noise;
use promenade_tests::{ClapHost, Host, Setup, Vst3};
use std::env;
use std::io::Write;
use std::process::Command;
use std::time::Instant;

/// The variable with the format, in the process that plays it.
const FORMAT: &str = "PROMENADE_BENCH_FORMAT";
/// The variable with sample rate and number of the instances that are only opened there.
const OPENED: &str = "PROMENADE_BENCH_OPENED";

const RATE: f64 = 48_000.0;
const BLOCK: usize = 512;
const BLOCKS: [usize; 3] = [64, 128, 512];
const COUNTS: [usize; 4] = [1, 10, 25, 50];
const SECONDS: f64 = 2.0;
const RUNS: usize = 5;

/// To and fro at the speeds that the head of this file states.
fn lanes(instance: &mut Instance) -> Vec<Lane> {
    let mut lane = |name: &str, from: &str, to: &str, period_s: f64| {
        let parameter = instance.parameter(name).expect("the plugin has the parameter").clone();
        let ends = [from, to].map(|text| instance.from_text(parameter.id, text).expect("the plugin understands its own unit"));
        let point = |turn: usize| Point { seconds: period_s * turn as f64, value: ends[turn % 2], hold: false };
        Lane::new(&parameter, &(0..100).map(point).collect::<Vec<_>>(), RATE).expect("times rise")
    };
    vec![lane("Yaw", "-90", "90", 2.0), lane("Listener Y", "-1", "1", 2.0)]
}

/// Plays all instances for the seconds, block by block in turn; returns processor seconds per second.
fn play(hosts: &mut [impl Host], lanes: &[Lane], signal: &[f32], at: &mut u64) -> f64 {
    play_blocks(hosts, lanes, (signal, BLOCK), at)
}

fn play_blocks(hosts: &mut [impl Host], lanes: &[Lane], (signal, len): (&[f32], usize), at: &mut u64) -> f64 {
    let (mut left, mut right) = (vec![0.0; len], vec![0.0; len]);
    let began = ThreadTime::now();
    let mut played = 0;
    for block in signal.chunks_exact(len) {
        for host in hosts.iter_mut() {
            let instance = host.instance();
            for lane in lanes {
                let set = lane.events(*at, len, |offset, value| instance.set_at(lane.id(), value, offset));
                set.expect("the plugin takes the value");
            }
            instance.process_into(&[block, block], &mut [&mut left, &mut right]).expect("the plugin plays");
        }
        *at += len as u64;
        played += len;
    }
    began.elapsed().as_secs_f64() / (played as f64 / RATE)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table<H: Host>() {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few seconds")]
    let signal = noise((SECONDS * RATE) as usize);
    let bundle = H::bundle();
    let before = resident_bytes();
    let mut hosts: Vec<H> = Vec::new();
    for count in COUNTS {
        while hosts.len() < count {
            let setup = Setup { rate: RATE, block: BLOCK, ..Setup::default() };
            hosts.push(bundle.open(setup).expect("the plugin opens").into());
        }
        let lanes = lanes(hosts[0].instance());
        let mut at = 0;
        play(&mut hosts, &lanes, &signal[..signal.len() / 4], &mut at);
        let cost = median((0..RUNS).map(|_| play(&mut hosts, &lanes, &signal, &mut at)).collect());
        let still = median((0..RUNS).map(|_| play(&mut hosts, &[], &signal, &mut at)).collect());
        let silence = vec![0.0; signal.len()];
        play(&mut hosts, &[], &silence, &mut at);
        let silent = median((0..RUNS).map(|_| play(&mut hosts, &[], &silence, &mut at)).collect());
        let memory = match (before, resident_bytes()) {
            (Some(before), Some(now)) => format!("{:.1} MiB", (now - before.min(now)) as f64 / f64::from(1 << 20)),
            _ => "unknown".to_owned(),
        };
        let row = [cost, cost / count as f64, still, silent].map(|share| format!("{:.2} %", 100.0 * share)).join(" | ");
        println!("| {} | {count} | {memory} | {row} |", H::FORMAT);
    }
}

/// One and fifty instances that move, by the length of blocks, which take turns.
fn by_blocks<H: Host>() {
    let seconds = 0.5;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a second")]
    let signal = noise((seconds * RATE) as usize);
    let bundle = H::bundle();
    println!("| scene | instances |{}", BLOCKS.map(|block| format!(" {block} |")).concat());
    println!("|---|---|{}", "---|".repeat(BLOCKS.len()));
    for (name, scene) in [("Room A", 0.0), ("loft", 1.0)] {
        for count in [1, 50] {
            let mut hosts = BLOCKS.map(|block| {
                let setup = Setup { rate: RATE, block, ..Setup::default() };
                let open = |_| -> H { bundle.open(setup).expect("the plugin opens").into() };
                (0..count).map(open).collect::<Vec<_>>()
            });
            for host in hosts.iter_mut().flatten() {
                host.set("scene", scene);
                host.instance().settle().expect("the plugin starts again");
            }
            let lanes = lanes(hosts[0][0].instance());
            let (mut costs, mut at) = ([const { Vec::new() }; BLOCKS.len()], [0; BLOCKS.len()]);
            // The first does not count.
            for run in 0..=2 * RUNS {
                for (i, block) in BLOCKS.into_iter().enumerate() {
                    let cost = play_blocks(&mut hosts[i], &lanes, (&signal, block), &mut at[i]);
                    costs[i].extend((run > 0).then_some(cost));
                }
            }
            let row = costs.map(|costs| format!(" {:.2} % |", 100.0 * median(costs))).concat();
            println!("| {name} | {count} |{row}");
        }
    }
}

/// Opens and activates instances; returns the seconds until all can play.
fn opening<H: Host>(rate: f64, count: usize) -> f64 {
    let bundle = H::bundle();
    let began = Instant::now();
    let setup = Setup { rate, block: BLOCK, ..Setup::default() };
    let mut hosts: Vec<H> = (0..count).map(|_| bundle.open(setup).expect("the plugin opens").into()).collect();
    for host in &mut hosts {
        host.process(&[&[0.0; BLOCK], &[0.0; BLOCK]]);
    }
    began.elapsed().as_secs_f64()
}

/// The processor, as the system names it.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| env::consts::ARCH.to_owned(), |(_, name)| name.to_owned())
}

/// Each format in a process of its own, so that neither finds memory that the other has left.
fn main() {
    if let Ok(opened) = env::var(OPENED) {
        let (rate, count) = opened.split_once(' ').expect("rate and number");
        let (rate, count) = (rate.parse().expect("a rate"), count.parse().expect("a number"));
        let clap = env::var(FORMAT).is_ok_and(|format| format == "clap");
        let seconds = if clap { opening::<ClapHost>(rate, count) } else { opening::<Vst3>(rate, count) };
        return print!(" {seconds:.2} s |");
    }
    match env::var(FORMAT).as_deref() {
        Ok("clap") => return table::<ClapHost>(),
        Ok(_) => return table::<Vst3>(),
        Err(_) => (),
    }
    println!("{}, {}, {RUNS} runs of {SECONDS} s, of one core\n", machine(), env::consts::OS);
    if env::args().any(|argument| argument == "--blocks") {
        return by_blocks::<ClapHost>();
    }
    let this = env::current_exe().expect("a bench has its own file");
    println!("| format | rate | opening 1 | 50 | 200 |");
    println!("|---|---|---|---|---|");
    for (format, rate) in ["clap", "vst3"].into_iter().flat_map(|format| [(format, 48_000), (format, 192_000)]) {
        print!("| {format} | {} kHz |", rate / 1000);
        // The others write to the same line.
        std::io::stdout().flush().expect("a table can be printed");
        for count in [1, 50, 200] {
            let mut opened = Command::new(&this);
            let done =
                opened.env(FORMAT, format).env(OPENED, format!("{rate} {count}")).status().expect("a bench can be run again");
            assert!(done.success(), "{format}: {done}");
        }
        println!();
    }
    println!("\n| format | instances | memory | moving, all | moving, each | still, all | silent, all |");
    println!("|---|---|---|---|---|---|---|");
    for format in ["clap", "vst3"] {
        let done = Command::new(&this).env(FORMAT, format).status().expect("a bench can be run again");
        assert!(done.success(), "{format}: {done}");
    }
}
