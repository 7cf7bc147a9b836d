//! Many instances of one scene: it is in memory once, and each plays as if it were alone.

use promenade_core::Scene;
use promenade_testing::scenes;
use promenade_tests::memory::resident_bytes;
use promenade_tests::signal::{difference_db, noise, peak};
use promenade_tests::{Host, Setup, in_both_formats, in_library, render};
use std::path::Path;

in_both_formats!(instances_do_not_hear_each_other);

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
