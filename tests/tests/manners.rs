//! Hosts without manners: instances that go while anything of theirs waits, and states that are restored in the middle of
//! anything. A process of its own: what goes wrong here may end it.
#![cfg(target_os = "linux")]

use promenade_tests::bare::{BLOCK, Bare, BareClap, BareVst3, Part, Plugin};
use promenade_tests::host_id;
use promenade_tests::memory::resident_bytes;
use promenade_tests::screen::wait_until;
use promenade_tests::signal::{difference_db, noise};
use serde_json::Value;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The longest that a host is told nothing of a change, on a machine that others keep busy or under valgrind; nothing but a
/// failure waits for it.
const PATIENCE: Duration = Duration::from_secs(300);
/// Instances that go one after the other.
const MANY: usize = 100;
/// Changes in the last block of each.
const CHANGES: u32 = 500;

/// Both formats: `fn name<B: Bare>()` becomes `clap::name` and `vst3::name`.
macro_rules! in_both_formats {
    ($($name:ident),+ $(,)?) => {
        mod clap {
            $(#[test] fn $name() { super::$name::<super::BareClap>(); })+
        }
        mod vst3 {
            $(#[test] fn $name() { super::$name::<super::BareVst3>(); })+
        }
    };
}

in_both_formats!(
    what_goes_with_changes_takes_nothing_with_it,
    instances_go_in_every_order,
    no_change_is_posted_while_no_editor_is_open,
    a_state_is_restored_after_anything,
    a_state_of_many_is_restored_after_anything,
);

/// An instance that plays.
fn playing<B: Bare>() -> B {
    let mut instance = B::make(Plugin::One);
    instance.activate();
    instance.play(true);
    instance
}

/// Plays blocks on another thread, as hosts do.
fn elsewhere<T: Send>(done: impl FnOnce() -> T + Send) -> T {
    thread::scope(|scope| scope.spawn(done).join().expect("the thread ends"))
}

/// Changes the latency in a block on another thread, and waits until the host is told; it activates the plugin again then.
fn tells_its_host<B: Bare>(instance: &mut B, latency: f64) -> bool {
    let before = instance.told();
    elsewhere(|| instance.block(&noise(BLOCK), &[(host_id("latency"), 0, latency)]));
    let is_told = wait_until(PATIENCE, || {
        elsewhere(|| instance.block(&noise(BLOCK), &[]));
        instance.told() > before
    });
    instance.play(false);
    instance.deactivate();
    instance.activate();
    instance.play(true);
    is_told
}

/// Held by each test: instances of others would wake the threads that one counts.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn what_goes_with_changes_takes_nothing_with_it<B: Bare>() {
    let _alone = alone();
    let mut stays: B = playing();
    for number in 0..MANY {
        let mut goes: B = playing();
        elsewhere(|| goes.busy_block(host_id("yaw"), CHANGES));
        match number % 4 {
            // As it is: active, and playing.
            0 => drop(goes),
            1 => elsewhere(|| drop(goes)),
            2 => {
                goes.play(false);
                drop(goes);
            }
            _ => {
                goes.play(false);
                goes.deactivate();
                elsewhere(|| drop(goes));
            }
        }
    }
    assert!(tells_its_host(&mut stays, 1.0), "the host of what stays is told nothing any more");
    assert!(tells_its_host(&mut stays, 0.0), "the host of what stays is told nothing any more");
}

/// All orders of some numbers.
fn orders(count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let shorter = orders(count - 1);
    let longer =
        |order: &Vec<usize>| (0..count).map(|at| [&order[..at], &[count - 1], &order[at..]].concat()).collect::<Vec<_>>();
    shorter.iter().flat_map(longer).collect()
}

fn instances_go_in_every_order<B: Bare>() {
    let _alone = alone();
    for order in orders(4) {
        let mut instances: Vec<Option<B>> = (0..4).map(|_| Some(playing())).collect();
        elsewhere(|| instances.iter_mut().flatten().for_each(|instance| instance.busy_block(host_id("x"), CHANGES)));
        for number in order {
            instances[number] = None;
        }
    }
}

#[test]
fn references_go_in_every_order() {
    let _alone = alone();
    let parts = [Part::Component, Part::Processor, Part::Controller];
    for order in orders(parts.len()) {
        for is_active in [false, true] {
            let mut instance: BareVst3 = if is_active { playing() } else { Bare::make(Plugin::One) };
            if is_active {
                elsewhere(|| instance.busy_block(host_id("x"), CHANGES));
            }
            order.iter().for_each(|part| instance.release(parts[*part]));
        }
    }
}

/// How often the threads of a name have waited, all together.
fn waits_of(name: &str) -> u64 {
    let tasks = std::fs::read_dir("/proc/self/task").expect("the system lists threads").flatten().map(|task| task.path());
    let read = |path: std::path::PathBuf| std::fs::read_to_string(path).unwrap_or_default();
    let named = tasks.filter(|task| read(task.join("comm")).trim() == name);
    let waits =
        |text: String| text.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:")?.trim().parse::<u64>().ok());
    named.filter_map(|task| waits(read(task.join("status")))).sum()
}

fn no_change_is_posted_while_no_editor_is_open<B: Bare>() {
    let _alone = alone();
    let mut instance: B = playing();
    elsewhere(|| instance.busy_block(host_id("yaw"), CHANGES));
    let before = (instance.told(), waits_of("bg-worker"));
    elsewhere(|| (0..20).for_each(|_| instance.busy_block(host_id("yaw"), CHANGES)));
    thread::sleep(Duration::from_millis(50));
    assert_eq!((instance.told(), waits_of("bg-worker")), before);
    let last = instance.value(host_id("yaw"));
    assert!((last - f64::from(CHANGES) / f64::from(CHANGES + 2)).abs() < 0.01, "the last change is {last}");
}

/// What a host does between two states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Activates it, also where it is active.
    Activate,
    /// Plays a block, and deactivates it.
    Process,
    /// Plays a block and stays active.
    ProcessOn,
    /// Opens and closes the editor.
    Editor,
    /// Sets values between blocks and in one, if it is active.
    Automate,
    /// Chooses another scene.
    Scene,
}

/// Those that need no screen.
const STEPS: [Step; 5] = [Step::Activate, Step::Process, Step::ProcessOn, Step::Automate, Step::Scene];

/// Automated: a float of each end of the list, a switch and a choice; or values of further sources.
fn automated(plugin: Plugin) -> [&'static str; 5] {
    match plugin {
        Plugin::One => ["x", "yaw", "gain", "wetsolo", "follow"],
        Plugin::Many => ["x", "ey2", "level2", "ez3", "ex16"],
    }
}

/// An instance on its way through steps.
struct Walked<B> {
    instance: B,
    automated: [&'static str; 5],
    is_active: bool,
    plays: bool,
    random: u64,
}

impl<B> Walked<B> {
    /// A value from 0 to 1, another one each time.
    fn next(&mut self) -> f64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from((self.random >> 33) as u32 % 1000) / 999.0
    }
}

impl<B: Bare> Walked<B> {
    fn activate(&mut self) {
        if self.plays {
            self.instance.play(false);
        }
        if self.is_active {
            self.instance.deactivate();
        }
        self.instance.activate();
        self.instance.play(true);
        (self.is_active, self.plays) = (true, true);
    }

    /// Values that the host sets beside any block are read back at once.
    fn set(&mut self, id: &str, value: f64) {
        self.instance.set(host_id(id), value);
        let read = self.instance.value(host_id(id));
        assert!(
            (read - value).abs() < 0.5 && (id != "x" || (read - value).abs() < 1e-3),
            "{id} is {read}, and was set to {value}"
        );
    }

    fn step(&mut self, step: Step, editor: &mut dyn FnMut(&mut B)) {
        match step {
            Step::Activate => self.activate(),
            Step::Process | Step::ProcessOn => {
                if !self.plays {
                    self.activate();
                }
                elsewhere(|| self.instance.block(&noise(BLOCK), &[]));
                if step == Step::Process {
                    self.instance.play(false);
                    self.instance.deactivate();
                    (self.is_active, self.plays) = (false, false);
                }
            }
            Step::Editor => editor(&mut self.instance),
            Step::Automate => {
                let values = self.automated.map(|id| (id, self.next()));
                if self.plays {
                    let changes = values.map(|(id, value)| (host_id(id), 100, value));
                    elsewhere(|| self.instance.block(&noise(BLOCK), &changes));
                }
                for id in self.automated {
                    let value = self.next();
                    self.set(id, value);
                }
            }
            Step::Scene => {
                let value = self.next();
                self.set("scene", value);
            }
        }
    }

    fn values(&mut self) -> Vec<f64> {
        self.instance.ids().into_iter().map(|id| self.instance.value(id)).collect()
    }

    /// What is heard of a new activation, by which time all is loaded.
    fn sound(&mut self) -> [Vec<f32>; 2] {
        self.activate();
        let input = noise(16 * BLOCK);
        elsewhere(|| {
            let mut heard = [Vec::new(), Vec::new()];
            for block in input.chunks(BLOCK) {
                heard.iter_mut().zip(self.instance.block(block, &[])).for_each(|(ear, new)| ear.extend(new));
            }
            heard
        })
    }
}

fn walked<B: Bare>(plugin: Plugin) -> Walked<B> {
    Walked { instance: B::make(plugin), automated: automated(plugin), is_active: false, plays: false, random: 1 }
}

/// Every sequence of up to two steps; every one of three, and some of four.
fn sequences() -> [Vec<Vec<Step>>; 2] {
    let longer = |all: &[Vec<Step>]| -> Vec<Vec<Step>> {
        all.iter().flat_map(|one| STEPS.map(|step| [&one[..], &[step]].concat())).collect()
    };
    let (ones, mut some) = (longer(&[Vec::new()]), Vec::new());
    let (twos, mut number) = (longer(&ones), 0_usize);
    let threes = longer(&twos);
    for four in longer(&threes) {
        number += 1;
        if number.is_multiple_of(7) {
            some.push(four);
        }
    }
    [[ones, twos].concat(), [threes, some].concat()]
}

/// All of a state but a scene's level, which comes when the scene has been read.
fn saved(state: &[u8]) -> Value {
    // CLAP's has its length before it.
    let start = state.windows(10).position(|text| text == b"{\"version\"").expect("a state is JSON");
    let mut state: Value = serde_json::from_slice(&state[start..]).expect("a state is JSON");
    let scene = state["fields"]["scene"].as_str().expect("a scene is saved");
    let mut scene: Value = serde_json::from_str(scene).expect("a field is JSON");
    scene.as_object_mut().expect("a scene has fields").remove("level_cb");
    state["fields"]["scene"] = scene;
    state
}

/// Restores after each sequence what was saved by another instance, and what this one saves.
fn restore_after<B: Bare>(plugin: Plugin, sequences: &[Vec<Step>], editor: &mut dyn FnMut(&mut B)) {
    let mut model: Walked<B> = walked(plugin);
    let further = match plugin {
        Plugin::One => &[][..],
        Plugin::Many => &[("ey2", 0.52), ("level2", 0.7), ("ez3", 0.48), ("ex16", 0.6)],
    };
    let values = [("x", 0.75), ("yaw", 0.3), ("gain", 0.6), ("wetsolo", 1.0), ("accuracy", 0.5)];
    for (id, value) in values.iter().chain(further) {
        model.set(id, *value);
    }
    let state = model.instance.save();
    let (values, sound) = (model.values(), model.sound());
    for (number, sequence) in sequences.iter().enumerate() {
        let mut walked: Walked<B> = walked(plugin);
        walked.random = number as u64;
        sequence.iter().for_each(|step| walked.step(*step, editor));
        // Its own state has what the host reads.
        let read = walked.values();
        let own = walked.instance.save();
        let to = walked.next();
        walked.instance.set(host_id("x"), to);
        walked.instance.load(&own);
        assert_eq!(walked.values(), read, "values of its own state after {sequence:?}");
        assert_eq!(saved(&walked.instance.save()), saved(&own), "after {sequence:?}");
        walked.instance.load(&state);
        assert_eq!(walked.values(), values, "values after {sequence:?}");
        assert_eq!(saved(&walked.instance.save()), saved(&state), "after {sequence:?}");
        // All of what is heard is compared where it is new: each sequence of two, and some of the others.
        if sequence.len() <= 2 || number % 5 == 0 {
            let difference = difference_db(&sound, &walked.sound());
            assert!(difference < -120.0, "{difference} dB after {sequence:?}");
        }
    }
}

fn a_state_is_restored_after_anything<B: Bare>() {
    let _alone = alone();
    restore_after::<B>(Plugin::One, &sequences().concat(), &mut |_| ());
}

fn a_state_of_many_is_restored_after_anything<B: Bare>() {
    let _alone = alone();
    restore_after::<B>(Plugin::Many, &sequences()[0], &mut |_| ());
}

/// Opens, automates and removes instances at random for so many minutes (`PROMENADE_MINUTES`, one unless told) on four threads
/// while one stays, whose host is told everything, and while memory does not grow.
#[test]
#[ignore = "takes as long as it is told"]
fn instances_come_and_go_at_random() {
    let _alone = alone();
    let minutes = std::env::var("PROMENADE_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(1.0);
    let (began, lasts) = (Instant::now(), Duration::from_secs_f64(60.0 * minutes));
    let is_over = || began.elapsed() >= lasts;
    let (mut told, mut settled) = (0, None);
    let gone = thread::scope(|scope| {
        let wander = |seed| scope.spawn(move || wander::<BareVst3>(seed, &is_over));
        let wanderers = [1, 2, 3, 4].map(wander);
        let mut stays: BareVst3 = playing();
        while !is_over() {
            assert!(tells_its_host(&mut stays, f64::from(u32::from(told % 2 == 0))), "a message is lost after {told}");
            told += 1;
            thread::sleep(Duration::from_millis(100));
            // By then caches and allocators have what they keep.
            if began.elapsed() > lasts / 4 && settled.is_none() {
                settled = resident_bytes();
            }
        }
        wanderers.map(|wanderer| wanderer.join().expect("the thread ends")).iter().sum::<usize>()
    });
    let (settled, now) = (settled.unwrap_or_default() >> 20, resident_bytes().unwrap_or_default() >> 20);
    println!("{minutes} minutes: {gone} instances have gone, {told} messages have come, {settled} MB, and {now} MB at the end");
    assert!(now < settled + 100, "memory grows from {settled} to {now} MB");
}

/// Does anything at random with up to six instances; returns how many have gone.
fn wander<B: Bare>(seed: u64, is_over: &(dyn Fn() -> bool + Sync)) -> usize {
    let (mut instances, mut gone): (Vec<Walked<B>>, usize) = (Vec::new(), 0);
    let mut random: Walked<()> =
        Walked { instance: (), automated: automated(Plugin::One), is_active: false, plays: false, random: seed };
    let mut dice = move |sides: u32| (random.next() * 0.999 * f64::from(sides)) as usize;
    while !is_over() {
        if instances.is_empty() || (instances.len() < 6 && dice(4) == 0) {
            let plugin = if dice(4) == 0 { Plugin::Many } else { Plugin::One };
            instances.push(walked(plugin));
            continue;
        }
        let which = dice(u32::try_from(instances.len()).unwrap_or(1));
        let walked = &mut instances[which];
        match dice(9) {
            0..3 => walked.step(STEPS[dice(5)], &mut |_| ()),
            3..5 if walked.plays => elsewhere(|| walked.instance.busy_block(host_id("x"), CHANGES)),
            5 => {
                let state = walked.instance.save();
                walked.instance.load(&state);
            }
            6 => walked.set("x", 0.5),
            7 => {
                drop(instances.swap_remove(which));
                gone += 1;
            }
            8 => {
                let one = instances.swap_remove(which);
                elsewhere(|| drop(one));
                gone += 1;
            }
            _ => walked.activate(),
        }
    }
    gone + instances.len()
}

mod needs_screen {
    use super::*;
    use promenade_tests::screen::Screen;
    use promenade_tests::{ClapHost, Host, Setup, Vst3};

    /// How many colours an editor shows, and no blank window.
    const COLOURS: usize = 40;

    /// An editor goes on showing what its host sets, while others go beside it.
    fn an_editor_is_told_while_others_go<H: Host, B: Bare>() {
        let screen = Screen::new(1400, 900);
        let mut host = H::open(Setup::default());
        let editor = host.instance().editor().expect("there is an editor");
        let size = editor.open(screen.window(), 1.0).expect("the editor opens");
        editor.show().expect("the editor is shown");
        screen.resize(size.width, size.height);
        let input = noise(BLOCK);
        let still = |host: &mut H| {
            let mut last = screen.picture();
            assert!(
                wait_until(PATIENCE, || {
                    for _ in 0..8 {
                        host.process(&[&input, &input]);
                        host.instance().serve().expect("the plugin is served");
                        thread::sleep(Duration::from_millis(10));
                    }
                    let now = screen.picture();
                    let is_still = now == last && now.colours(COLOURS) == COLOURS;
                    last = now;
                    is_still
                }),
                "the editor does not come to rest"
            );
            last
        };
        host.set("yaw", 0.5);
        let before = still(&mut host);
        for _ in 0..MANY / 2 {
            let mut goes: B = playing();
            elsewhere(|| goes.busy_block(host_id("yaw"), CHANGES));
            drop(goes);
        }
        host.set("yaw", 1.0);
        assert!(still(&mut host) != before, "the head is not seen to turn");
    }

    #[test]
    #[ignore = "needs a screen"]
    fn a_clap_editor_is_told_while_others_go() {
        an_editor_is_told_while_others_go::<ClapHost, BareClap>();
    }

    #[test]
    #[ignore = "needs a screen"]
    fn a_vst3_editor_is_told_while_others_go() {
        an_editor_is_told_while_others_go::<Vst3, BareVst3>();
    }

    /// With the editor open, and closed by nobody.
    #[test]
    #[ignore = "needs a screen"]
    fn references_go_in_every_order_with_an_editor() {
        let screen = Screen::new(1400, 900);
        let parts = [Part::Component, Part::Processor, Part::Controller, Part::View];
        for order in orders(parts.len()) {
            let mut instance: BareVst3 = playing();
            instance.open_editor(screen.window());
            elsewhere(|| instance.busy_block(host_id("x"), CHANGES));
            order.iter().for_each(|part| instance.release(parts[*part]));
        }
        let mut stays: BareVst3 = playing();
        assert!(tells_its_host(&mut stays, 1.0));
    }

    #[test]
    #[ignore = "needs a screen"]
    fn a_state_is_restored_after_an_editor_was_open() {
        let screen = Screen::new(1400, 900);
        use Step::{Activate, Automate, Editor, Process, ProcessOn, Scene};
        let sequences = [
            vec![Editor],
            vec![ProcessOn, Automate, Editor],
            vec![ProcessOn, Editor, Automate, Editor],
            vec![Process, Editor, Automate],
            vec![Activate, Editor, Scene, Automate],
            vec![Automate, Editor, ProcessOn],
            vec![Editor, Scene, Editor, Process],
            vec![Activate, Automate, Editor, Scene],
        ];
        restore_after::<BareVst3>(Plugin::One, &sequences, &mut |instance| {
            instance.open_editor(screen.window());
            thread::sleep(Duration::from_millis(300));
            instance.close_editor();
        });
    }
}

/// As Element did to 1.1.0.
#[test]
fn a_host_that_stops_and_starts_around_each_block_hears_the_same() {
    let _alone = alone();
    let heard = |pauses: bool| -> Vec<f32> {
        let mut instance: BareClap = playing();
        let blocks = (0..20).map(|block| {
            if pauses {
                instance.play(false);
                instance.play(true);
            }
            let input = if block < 4 { noise(BLOCK) } else { vec![0.0; BLOCK] };
            let [left, right] = instance.block(&input, &[]);
            [left, right].concat()
        });
        blocks.collect::<Vec<_>>().concat()
    };
    let (steady, pausing) = (heard(false), heard(true));
    assert!(steady.iter().any(|v| v.abs() > 1e-3));
    assert_eq!(steady, pausing);
}
