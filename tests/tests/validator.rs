//! What validators of plugins check, in both formats: states, texts, subnormal numbers, and a host that does as it likes.
//!
//! `PROMENADE_FUZZ_MINUTES` makes the last of them go on for as long, with other seeds.

use promenade_tests::signal::Noise;
use promenade_tests::{Host, Setup, in_both_formats};
use std::time::{Duration, Instant};

in_both_formats!(
    a_state_is_what_was_set_however_it_was_set,
    bytes_that_are_no_state_are_refused,
    texts_go_there_and_back,
    subnormal_numbers_end_here,
    starting_again_forgets_the_sound,
    whatever_a_host_does_is_harmless,
);

/// The largest magnitude that is put out.
const LOUDEST: f32 = 1e6;

/// Draws of a host that does as it likes.
struct Draws(Noise);

impl Draws {
    fn new(seed: u64) -> Self {
        Self(Noise::new(seed))
    }

    /// 0 to 1.
    fn share(&mut self) -> f64 {
        f64::from(0.5 + 0.5 * self.0.value())
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count - 1)
    }

    /// A value that a knob has often an end of its range.
    fn value(&mut self) -> f64 {
        match self.below(8) {
            0 => 0.0,
            1 => 1.0,
            _ => self.share(),
        }
    }
}

fn ids<H: Host>(host: &mut H) -> Vec<u32> {
    host.knobs().iter().map(|knob| knob.host_id).collect()
}

/// Values of all parameters.
fn values<H: Host>(host: &mut H) -> Vec<f64> {
    ids(host).into_iter().map(|id| host.instance().value(id).unwrap()).collect()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn a_state_is_what_was_set_however_it_was_set<H: Host>() {
    for seed in 1..=2 {
        let mut draws = Draws::new(seed);
        let mut host = H::open(Setup::default());
        let wanted: Vec<_> = ids(&mut host).into_iter().map(|id| (id, draws.value())).collect();
        let set = |host: &mut H| {
            for (id, value) in &wanted {
                host.instance().set_at(*id, *value, 0).unwrap();
            }
        };
        // With a block, and without sound.
        set(&mut host);
        host.process(&[&[0.0; 64], &[0.0; 64]]);
        let mut flushed = H::open(Setup::default());
        set(&mut flushed);
        flushed.instance().settle().unwrap();
        let (saved, expected) = (host.save(), values(&mut host));
        assert_eq!(text(&flushed.save()), text(&saved), "seed {seed}");
        // Into one that has played something else.
        let mut other = H::open(Setup { rate: 44_100.0, ..Setup::default() });
        other.set("yaw", 0.1);
        other.set("osc", 1.0);
        other.process(&[&[0.5; 64], &[0.5; 64]]);
        assert!(other.load(&saved), "seed {seed}");
        for (found, expected) in values(&mut other).into_iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-6, "seed {seed}: {found} for {expected}");
        }
        assert_eq!(text(&other.save()), text(&saved), "seed {seed}");
        other.process(&[&[0.0; 64], &[0.0; 64]]);
        assert_eq!(text(&other.save()), text(&saved), "seed {seed}, after a block");
    }
}

fn bytes_that_are_no_state_are_refused<H: Host>() {
    let mut host = H::open(Setup::default());
    host.set("yaw", 0.3);
    host.process(&[&[0.0; 64], &[0.0; 64]]);
    let before = values(&mut host);
    for seed in 1..=20 {
        let mut draws = Draws::new(seed);
        let bytes: Vec<u8> = (0..draws.below(5_000)).map(|_| draws.below(256) as u8).collect();
        let taken = host.instance().load(&bytes).is_ok();
        assert!(!taken, "seed {seed}: {} random bytes are taken as a state", bytes.len());
        assert_eq!(values(&mut host), before, "seed {seed}");
    }
}

fn texts_go_there_and_back<H: Host>() {
    let mut host = H::open(Setup::default());
    let mut draws = Draws::new(1);
    for (id, name) in host.knobs().into_iter().map(|knob| (knob.host_id, knob.name)) {
        for value in [0.0, 1.0, draws.share(), draws.share(), draws.share()] {
            let written = host.instance().text(id, value).unwrap();
            assert!(!written.trim().is_empty(), "{name} at {value} has no text");
            let read = host.instance().from_text(id, &written).unwrap_or_else(|e| panic!("{name} at {value}: {e}"));
            let again = host.instance().text(id, read).unwrap();
            assert_eq!(again, written, "{name} at {value} is read as {read}");
        }
        for nonsense in ["", "certainly no value", "\u{1F3A7}\u{0}"] {
            let read = host.instance().from_text(id, nonsense);
            assert!(read.is_err(), "{name} takes {nonsense:?} for {read:?}");
        }
    }
}

/// The first sample that no host should be given.
fn unfit(out: &[Vec<f32>; 2]) -> Option<f32> {
    out.iter().flatten().copied().find(|x| !x.is_finite() || x.is_subnormal() || x.abs() > LOUDEST)
}

fn subnormal_numbers_end_here<H: Host>() {
    let subnormal = f32::from_bits(1 << 20);
    let faint: Vec<f32> = Noise::new(1).take(512).map(|v| v * 4.0 * subnormal).collect();
    assert!(faint.iter().filter(|v| v.is_subnormal()).count() > 100);
    for (id, value) in [("mix", 1.0), ("mix", 0.5), ("mix", 0.0), ("bypass", 1.0), ("gain", 0.0)] {
        let mut host = H::open(Setup::default());
        host.set(id, value);
        for loud in [0.0, 1.0, 0.0] {
            let block: Vec<f32> = faint.iter().map(|v| v + loud * 0.1).collect();
            for _ in 0..4 {
                let out = host.process(&[&block, &block]);
                assert_eq!(unfit(&out), None, "{id} at {value}");
            }
        }
        // The end of a sound is where such numbers arise.
        for _ in 0..100 {
            let out = host.process(&[&[0.0; 512], &[0.0; 512]]);
            assert_eq!(unfit(&out), None, "{id} at {value}, at the end");
        }
    }
}

fn starting_again_forgets_the_sound<H: Host>() {
    let signal: Vec<f32> = Noise::new(3).take(4 * 512).collect();
    let mut host = H::open(Setup { offline: true, ..Setup::default() });
    host.reopen(Setup { offline: true, ..Setup::default() });
    let play = |host: &mut H| -> Vec<[Vec<f32>; 2]> { signal.chunks(512).map(|block| host.process(&[block, block])).collect() };
    let first = play(&mut host);
    host.reopen(Setup { offline: true, ..Setup::default() });
    assert!(play(&mut host) == first, "what was played before is heard");
}

fn whatever_a_host_does_is_harmless<H: Host>() {
    let minutes = std::env::var("PROMENADE_FUZZ_MINUTES").ok().map(|text| text.parse().expect("a number of minutes"));
    let (longest, began) = (minutes.map(|minutes: f64| Duration::from_secs_f64(60.0 * minutes)), Instant::now());
    let seeds = (1..).take_while(|seed| longest.map_or(*seed <= 2, |longest| began.elapsed() < longest));
    for seed in seeds {
        println!("seed {seed}");
        one_host::<H>(seed);
    }
}

/// A host of one layout, and 40 things that it does; every second one has the plugin of many sources.
fn one_host<H: Host>(seed: u64) {
    let mut draws = Draws::new(seed);
    let further = [15, 0, 63, 0][usize::try_from(seed % 4).unwrap_or(0)];
    let setup = |draws: &mut Draws, inputs: usize| Setup {
        rate: [8_000.0, 22_050.0, 44_100.0, 48_000.0, 96_000.0, 192_000.0][draws.below(6)],
        block: [1, 17, 64, 512, 1_000][draws.below(5)],
        offline: draws.below(2) == 0,
        tempo: (draws.below(2) == 0).then_some(97.3),
        inputs,
        further,
        ..Setup::default()
    };
    let inputs = if further > 0 { 1 } else { 1 + draws.below(2) };
    let first = setup(&mut draws, inputs);
    let mut host = if further > 0 { H::open_many(first) } else { H::open(first) };
    let ids = ids(&mut host);
    let mut saved = host.save();
    for step in 0..40 {
        match draws.below(20) {
            0 => {
                let next = setup(&mut draws, inputs);
                host.reopen(next);
            }
            1 => saved = host.save(),
            2 => assert!(host.load(&saved), "seed {seed}, step {step}: its own state is refused"),
            3 => host.instance().settle().unwrap(),
            4 | 5 => {
                let seconds = [0.0, 1.0, 3_600.0, 1e6][draws.below(4)] * draws.share();
                host.play_from(seconds);
            }
            _ => (),
        }
        let len = 1 + draws.below(host.instance().setup().block);
        for _ in 0..draws.below(12) {
            let (id, value, at) = (ids[draws.below(ids.len())], draws.value(), draws.below(len));
            host.instance().set_at(id, value, at).unwrap();
        }
        let level = [0.0, 1e-39, 1e-20, 1e-3, 1.0, 1e10, f32::INFINITY][draws.below(7)];
        let input: Vec<f32> = (&mut draws.0).take(len).map(|v| level * v).collect();
        let out = host.process(&vec![&input[..]; inputs + further]);
        assert_eq!(unfit(&out), None, "seed {seed}, step {step}");
    }
}
