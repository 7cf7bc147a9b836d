//! Many instances of one scene: it is in memory once, and each plays as if it were alone.

use promenade_core::{Audible, FrontPoint, Measure, Scene, Setting};
use promenade_testing::scenes;
use promenade_tests::memory::resident_bytes;
use promenade_tests::screen::wait_until;
use promenade_tests::signal::{difference_db, noise, peak};
use promenade_tests::{Host, Setup, in_both_formats, in_library, render};
use std::path::Path;
use std::time::{Duration, Instant};

in_both_formats!(
    instances_do_not_hear_each_other,
    a_search_for_less_of_a_scene_holds_nobody_up,
    less_of_a_scene_is_played_once_it_is_found,
    accuracy_changes_without_a_click,
);

/// Other systems do not tell how much of a process is in memory.
#[cfg(target_os = "linux")]
mod in_memory {
    use super::*;
    in_both_formats!(a_scene_is_in_memory_once);
}

const SCENE: &str = "big.promenade";
const INSTANCES: usize = 20;

fn fill(folder: &Path) {
    std::fs::write(folder.join(SCENE), scenes::room(96_000.0, 0.3, 0.05).to_bytes().unwrap()).unwrap();
}

fn opened<H: Host>() -> H {
    let mut host = H::open(Setup::default());
    host.set("scene", 1.0);
    host.set("slot", 1.0 / 64.0);
    host.instance().settle().unwrap();
    host
}

fn a_scene_is_in_memory_once<H: Host>() {
    in_library(fill, |folder| {
        let scene = Scene::from_bytes(&std::fs::read(folder.join(SCENE)).unwrap()).unwrap();
        let table = scene.field().unwrap().memory_bytes() as u64;
        drop(scene);
        assert!(table > 10 << 20, "{table} bytes are too few to be found among everything else");
        let signal = noise(2048);
        let mut hosts: Vec<H> = Vec::new();
        let mut after_two = None;
        while hosts.len() < INSTANCES {
            hosts.push(opened());
            for host in &mut hosts {
                let out = render(host, &[&signal, &signal], &[512]);
                assert!(peak(&out[0]) > 1e-3, "the scene is not heard");
            }
            if hosts.len() == 2 {
                after_two = resident_bytes();
            }
        }
        let (before, now) = (after_two.unwrap(), resident_bytes().unwrap());
        // An instance has filters and rings of its own, and its wrapper and host queues: below 4 MB together. A copy of the
        // scene for each would take the whole of it; a quarter is far from both.
        let each = now.saturating_sub(before) / (INSTANCES as u64 - 2);
        assert!(each < table / 4, "each instance takes {each} bytes, the scene's table has {table}");
    });
}

fn instances_do_not_hear_each_other<H: Host>() {
    let yaws = [0.25, 0.5, 0.75];
    let signals = [0, 1, 2].map(|number| noise(12_000 + number)[number..].to_vec());
    let alone = |number: usize| {
        let mut host = H::open(Setup::default());
        host.set("yaw", yaws[number]);
        render(&mut host, &[&signals[number], &signals[number]], &[480])
    };
    let wanted = [0, 1, 2].map(alone);
    // In one process, of one bundle, at blocks and rates of their own, in turn.
    let bundle = H::bundle();
    let mut other = H::from(bundle.open(Setup { rate: 44_100.0, block: 64, ..Setup::default() }).unwrap());
    let mut hosts: Vec<H> = yaws.iter().map(|_| bundle.open(Setup::default()).unwrap().into()).collect();
    let mut heard = [const { [Vec::new(), Vec::new()] }; 3];
    for start in (0..12_000).step_by(480) {
        other.process(&[&[0.3; 64], &[0.3; 64]]);
        for ((host, signal), (all, yaw)) in hosts.iter_mut().zip(&signals).zip(heard.iter_mut().zip(yaws)) {
            host.set("yaw", yaw);
            let block = &signal[start..start + 480];
            all.iter_mut().zip(host.process(&[block, block])).for_each(|(ear, new)| ear.extend(new));
        }
    }
    for (wanted, heard) in wanted.iter().zip(&heard) {
        let difference = difference_db(wanted, heard);
        assert!(difference < -120.0, "{difference} dB");
    }
    assert!(difference_db(&wanted[0], &wanted[2]) > -40.0);
}

/// The loft without what it knows of less of itself, which then has to be searched for, and a small room.
fn fill_to_search(folder: &Path) {
    let loft = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes/loft.promenade");
    let mut parts = Scene::from_bytes(&std::fs::read(loft).unwrap()).unwrap().parts().clone();
    parts.front.clear();
    std::fs::write(folder.join("1.promenade"), Scene::new(parts).unwrap().to_bytes().unwrap()).unwrap();
    let small = scenes::room_with_images(8_000.0, 0.2, 0.05, 20);
    std::fs::write(folder.join("2.promenade"), small.to_bytes().unwrap()).unwrap();
}

/// Instances of a scene of the library by its slot, in one process.
fn of_slot<H: Host>(slot: f64) -> H {
    let mut host = H::open(Setup::default());
    host.set("scene", 1.0);
    host.set("slot", slot / 64.0);
    host.instance().settle().unwrap();
    host
}

/// Seconds pass before it is known what less of a scene may be played: other instances, projects that are opened and a host
/// that is closed do not wait for that.
fn a_search_for_less_of_a_scene_holds_nobody_up<H: Host>() {
    in_library(fill_to_search, |_| {
        let signal = noise(4_800);
        let mut searching: H = of_slot(1.0);
        searching.set("accuracy", 0.25);
        searching.process(&[&signal[..480], &signal[..480]]);
        std::thread::sleep(Duration::from_millis(500));
        let began = Instant::now();
        let mut other: H = of_slot(2.0);
        assert!(peak(&render(&mut other, &[&signal, &signal], &[480])[0]) > 1e-3, "the other instance plays nothing");
        let saved = searching.save();
        drop(searching);
        let mut opened = H::open(Setup::default());
        assert!(opened.load(&saved));
        opened.reopen(Setup::default());
        assert!(peak(&render(&mut opened, &[&signal, &signal], &[480])[0]) > 1e-3, "all of the scene is not heard meanwhile");
        drop(opened);
        drop(other);
        assert!(began.elapsed() < Duration::from_secs(5), "it took {:?}", began.elapsed());
    });
}

fn less_of_a_scene_is_played_once_it_is_found<H: Host>() {
    in_library(fill_to_search, |_| {
        let signal = noise(4_800);
        let mut all: H = of_slot(2.0);
        let mut less: H = of_slot(2.0);
        less.set("accuracy", 1.0);
        let mut difference = f32::NEG_INFINITY;
        let found = wait_until(Duration::from_secs(120), || {
            let [wanted, heard] = [&mut all, &mut less].map(|host| render(host, &[&signal, &signal], &[480]));
            difference = difference_db(&wanted, &heard);
            difference > -60.0
        });
        assert!(found && difference < 0.0, "{difference} dB");
    });
}

/// Samples of a block, blocks, and blocks between changes.
const BLOCK: usize = 64;
const BLOCKS: usize = 1_000;
const CHANGE: usize = 40;

/// Sixteen that walk while somebody turns their accuracy: no more is heard of it than of walking.
fn accuracy_changes_without_a_click<H: Host>() {
    let fill = |folder: &Path| {
        let scene = scenes::room_with_images(48_000.0, 0.3, 0.05, 40);
        let mut parts = scene.parts().clone();
        let all = Setting::ALL.of(&scene);
        let point = |(step, jnds): (usize, f32)| FrontPoint {
            setting: Setting { images: (all.images >> (2 * step)).max(1), order: 3 - step, refresh: 1 + step, ..all },
            error: Audible { jnds, measure: Measure::Levels },
            cost: 1.0 / (1 + step) as f32,
        };
        parts.front = [0.0, 0.25, 1.0, 2.0].into_iter().enumerate().map(point).collect();
        std::fs::write(folder.join("1.promenade"), Scene::new(parts).unwrap().to_bytes().unwrap()).unwrap();
    };
    in_library(fill, |_| {
        let setup = Setup { block: BLOCK, ..Setup::default() };
        let bundle = H::bundle();
        // The greatest bend of a tone from sample to sample.
        let bend = |turned: bool| {
            let mut hosts: Vec<H> = (0..16).map(|_| bundle.open(setup).unwrap().into()).collect();
            for host in &mut hosts {
                host.set("scene", 1.0);
                host.set("slot", 1.0 / 64.0);
                host.instance().settle().unwrap();
            }
            let (mut most, mut longest, mut late) = (0.0_f32, Duration::ZERO, 0);
            let mut last = [[0.0_f32; 2]; 16];
            for block in 0..BLOCKS {
                let tone: Vec<f32> = (0..BLOCK)
                    .map(|n| 0.2 * (std::f32::consts::TAU * 220.0 * (block * BLOCK + n) as f32 / 48_000.0).sin())
                    .collect();
                let began = Instant::now();
                for (number, (host, last)) in hosts.iter_mut().zip(&mut last).enumerate() {
                    let along = (block + 50 * number) as f64 / 400.0;
                    host.set("x", 0.5 + 0.01 * along.sin());
                    host.set("y", 0.5 + 0.01 * along.cos());
                    if turned && (block + number) % CHANGE == 0 {
                        host.set("accuracy", ((block / CHANGE + number) % 5) as f64 / 4.0);
                    }
                    for sample in host.process(&[&tone, &tone])[0].iter().copied() {
                        assert!(sample.is_finite());
                        if block > 100 {
                            most = most.max((sample - 2.0 * last[1] + last[0]).abs());
                        }
                        *last = [last[1], sample];
                    }
                }
                let took = began.elapsed();
                longest = longest.max(took);
                late += usize::from(took.as_secs_f64() > BLOCK as f64 / 48_000.0);
                // As fast as a host plays, so that what is changed is loaded meanwhile.
                std::thread::sleep(Duration::from_secs_f64(BLOCK as f64 / 48_000.0).saturating_sub(took));
            }
            println!("turned {turned}: bend {most:.2e}, {late} of {BLOCKS} blocks late, the longest took {longest:?}");
            most
        };
        let [still, turned] = [false, true].map(bend);
        assert!(turned < 1.5 * still, "{turned} where {still} is heard of walking alone");
    });
}
