//! What the open editor costs: pictures a second, and processor time by thread, while one plays, drags, or does nothing.
//!
//! `cargo bench --bench editor -p promenade-tests`, with a screen (`DISPLAY`). The CLAP, played live at 48 kHz in blocks of 512
//! with the factory scene, its editor at its own size. Time: processor seconds per second, of the thread with the editor's
//! window, of the threads that draw for a software OpenGL (`LIBGL_ALWAYS_SOFTWARE=1`), and of the thread that plays. Pictures
//! are counted by the X server.
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

use promenade_host::{EditKind, EditorSize};
use promenade_tests::screen::Screen;
use promenade_tests::signal::noise;
use promenade_tests::{ClapHost, Host, Setup, host_id};
use std::collections::HashMap;
use std::time::{Duration, Instant};

const RATE: f64 = 48_000.0;
const BLOCK: usize = 512;
const SECONDS: f64 = 6.0;

/// Processor seconds of each thread so far, by number and name (Linux).
fn threads() -> HashMap<String, f64> {
    let of = |folder: std::path::PathBuf| {
        let stat = std::fs::read_to_string(folder.join("stat")).ok()?;
        let (name, rest) = stat.split_once('(')?.1.rsplit_once(')')?;
        // User and system time, in hundredths of a second.
        let ticks: f64 = rest.split_whitespace().skip(11).take(2).map(|ticks| ticks.parse::<f64>().unwrap_or(0.0)).sum();
        Some((format!("{name} {}", folder.file_name()?.display()), ticks / 100.0))
    };
    let tasks = std::fs::read_dir("/proc/self/task").expect("this is Linux");
    tasks.filter_map(|task| of(task.ok()?.path())).collect()
}

struct Bench {
    host: ClapHost,
    screen: Screen,
    signal: Vec<f32>,
    /// Where the mouse is.
    hand: (i16, i16),
}

impl Bench {
    /// Plays as fast as it is heard and calls `each` with the number of every block; returns the pictures.
    fn play(&mut self, seconds: f64, sounds: bool, mut each: impl FnMut(&mut Self, usize)) -> usize {
        let began = Instant::now();
        let mut pictures = 0;
        for number in 0.. {
            let due = Duration::from_secs_f64((number * BLOCK) as f64 / RATE);
            if due.as_secs_f64() >= seconds {
                break;
            }
            std::thread::sleep(due.saturating_sub(began.elapsed()));
            if sounds {
                let at = number * BLOCK % self.signal.len();
                let block = self.signal[at..at + BLOCK].to_vec();
                self.host.process(&[&block, &block]);
            }
            each(self, number);
            self.host.instance().serve().expect("the plugin is served");
            pictures += self.screen.drawings();
        }
        pictures
    }

    /// Prints a row.
    fn row(&mut self, what: &str, sounds: bool, mut each: impl FnMut(&mut Self, usize)) {
        // What began before has come to rest.
        self.play(1.0, sounds, &mut each);
        let before = threads();
        let pictures = self.play(SECONDS, sounds, &mut each) as f64 / SECONDS;
        let (mut drawing, mut playing, mut window) = (0.0, 0.0, 0.0);
        let own = std::process::id().to_string();
        for (thread, now) in threads() {
            let used = (now - before.get(&thread).copied().unwrap_or(0.0)) / SECONDS;
            match thread.rsplit_once(' ') {
                Some((name, _)) if name.starts_with("llvmpipe") => drawing += used,
                Some((_, number)) if number == own => playing += used,
                _ => window += used,
            }
        }
        println!("| {what} | {pictures:.1} | {:.1} % | {:.1} % | {:.1} % |", 100.0 * window, 100.0 * drawing, 100.0 * playing);
    }

    fn drags(&mut self) -> bool {
        let edits = self.host.instance().take_edits();
        edits.iter().any(|edit| edit.id == host_id("x") && edit.kind == EditKind::Begin)
    }

    /// Takes hold of the listener, who is near the middle of the view.
    fn take_hold(&mut self, size: EditorSize) {
        let middle = |length: u32| i16::try_from(length / 2).expect("a window has fewer pixels");
        let mut places = (-8..=8_i16).flat_map(|x| (-8..=8_i16).map(move |y| (x * 16, y * 16))).collect::<Vec<_>>();
        places.sort_by_key(|(x, y)| x.unsigned_abs().max(y.unsigned_abs()));
        for (x, y) in places {
            let (x, y) = (middle(size.width) + x, middle(size.height) + y);
            self.screen.point(x, y);
            self.play(0.05, true, |_, _| ());
            self.screen.press(1, true);
            self.play(0.1, true, |bench, number| bench.screen.point(x + i16::try_from(number).unwrap_or(0), y));
            self.hand = (x, y);
            if self.drags() {
                return;
            }
            self.screen.press(1, false);
            self.play(0.05, true, |_, _| ());
        }
        panic!("the listener is not found");
    }
}

fn main() {
    let screen = Screen::new(1400, 900);
    screen.watch();
    let host = ClapHost::open(Setup { rate: RATE, block: BLOCK, ..Setup::default() });
    let mut bench = Bench { host, screen, signal: noise(BLOCK * 100), hand: (0, 0) };
    let closed = |bench: &mut Bench| bench.row("closed, playing", true, |_, _| ());
    println!("| editor | pictures a second | its thread | drawing by software | host and sound |");
    println!("|---|---|---|---|---|");
    closed(&mut bench);
    let editor = bench.host.instance().editor().expect("there is an editor");
    let size = editor.open(bench.screen.window(), 1.0).expect("the editor opens");
    editor.show().expect("the editor is shown");
    bench.screen.resize(size.width, size.height);
    bench.play(3.0, false, |_, _| ());
    bench.row("open, nothing playing, nothing moving", false, |_, _| ());
    bench.row("open, playing", true, |_, _| ());
    let turning = |bench: &mut Bench, number: usize| {
        bench.host.set("yaw", 0.5 + 0.25 * (number as f64 / 40.0).sin());
        bench.host.set("x", 0.5 + 0.01 * (number as f64 / 60.0).cos());
    };
    bench.row("open, playing, automation moves the listener", true, turning);
    bench.host.set("x", 0.5);
    bench.take_hold(size);
    bench.row("open, playing, the listener is dragged", true, |bench, number| {
        let angle = number as f32 / 30.0;
        #[expect(clippy::cast_possible_truncation, reason = "a hundred pixels")]
        let (x, y) = ((100.0 * angle.sin()) as i16, (100.0 * angle.cos()) as i16);
        bench.screen.point(bench.hand.0 + x, bench.hand.1 + y);
    });
    bench.screen.press(1, false);
    let editor = bench.host.instance().editor().expect("there is an editor");
    let least = editor.resize(EditorSize { width: 1, height: 1 }).expect("the editor takes a size");
    bench.screen.resize(least.width, least.height);
    bench.row("as small as can be, playing, automation moves the listener", true, turning);
    bench.host.instance().editor().expect("there is an editor").close().expect("the editor closes");
    closed(&mut bench);
    println!("\n{} x {} pixels, at least {} x {}", size.width, size.height, least.width, least.height);
}
