//! Instances of one listener group hear with the leader's listener.

use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{Host, Setup, in_both_formats};

in_both_formats!(a_follower_sounds_as_its_leader);

/// Group A among Off, A, B, C and D.
const GROUP_A: f64 = 0.25;
const BLOCK: usize = 512;

/// Plays all instances side by side, the first one turning its head, and returns what each gives.
fn play<H: Host>(hosts: &mut [H], seconds_from: f64, input: &[f32]) -> Vec<[Vec<f32>; 2]> {
    let mut out = vec![[Vec::new(), Vec::new()]; hosts.len()];
    hosts.iter_mut().for_each(|host| host.play_from(seconds_from));
    for (number, block) in input.chunks(BLOCK).enumerate() {
        hosts[0].set("yaw", 0.5 + 0.2 * (number as f64 * 0.05).sin());
        for (host, out) in hosts.iter_mut().zip(&mut out) {
            let ears = host.process(&[block, block]);
            out.iter_mut().zip(ears).for_each(|(all, ear)| all.extend(ear));
        }
    }
    out
}

fn a_follower_sounds_as_its_leader<H: Host>() {
    let setup = Setup { block: BLOCK, ..Setup::default() };
    let mut hosts = [H::open(setup), H::open(setup), H::open(setup)];
    // The third has no group.
    for host in &mut hosts[..2] {
        host.set("group", GROUP_A);
    }
    hosts[0].set("lead", 1.0);
    let input = noise(48_000);
    play(&mut hosts, 0.0, &input);
    let [leader, follower, other] = <[_; 3]>::try_from(play(&mut hosts, 10.0, &input)).unwrap();
    let difference = difference_db(&leader, &follower);
    assert!(difference < -60.0, "the follower is {difference:.1} dB off its leader");
    let difference = difference_db(&leader, &other);
    assert!(difference > -20.0, "an instance without the group is only {difference:.1} dB off");
    // A follower that is moved in its own scene hears another thing.
    hosts[1].set("ey", 0.52);
    let [leader, follower, _] = <[_; 3]>::try_from(play(&mut hosts, 20.0, &input)).unwrap();
    assert!(difference_db(&leader, &follower) > -20.0);
    // Without a leader it hears with its own listener.
    hosts[0].set("lead", 0.0);
    hosts[1].set("ey", 0.5);
    let [_, follower, other] = <[_; 3]>::try_from(play(&mut hosts, 40.0, &input)).unwrap();
    // The room still sounds of what was before.
    let late = |ears: &[Vec<f32>; 2]| [ears[0][24_000..].to_vec(), ears[1][24_000..].to_vec()];
    let difference = difference_db(&late(&follower), &late(&other));
    assert!(difference < -60.0, "alone it is {difference:.1} dB off one that never had a group");
}
