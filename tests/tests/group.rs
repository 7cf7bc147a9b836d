//! Instances of one listener group hear with the leader's listener.

use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{Format, Host, Setup, edit_state, in_both_formats};

in_both_formats!(a_follower_sounds_as_its_leader, projects_have_groups_of_their_own, a_follower_alone_hears_as_it_was_saved);

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
    // The third has no group.
    let mut hosts = [member::<H>(setup, 0x4440), member(setup, 0x4440), H::open(setup)];
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

/// An instance in a group of a project; each test and format has projects of its own, for all run in one process.
fn member<H: Host>(setup: Setup, project: u32) -> H {
    let mut host = H::open(setup);
    let id = format!("{:x}", project + if H::FORMAT == Format::Vst3 { 0x800 } else { 0 });
    let state = host.state();
    assert!(host.load(&edit_state(&state, "project", &serde_json::json!(id))));
    host.set("group", GROUP_A);
    host
}

fn projects_have_groups_of_their_own<H: Host>() {
    let setup = Setup { block: BLOCK, ..Setup::default() };
    let mut hosts = [0x1110, 0x1110, 0x2220].map(|project| member::<H>(setup, project));
    hosts[0].set("lead", 1.0);
    let input = noise(48_000);
    play(&mut hosts, 0.0, &input);
    let [leader, follower, other] = <[_; 3]>::try_from(play(&mut hosts, 10.0, &input)).unwrap();
    let (same, apart) = (difference_db(&leader, &follower), difference_db(&leader, &other));
    assert!(same < -60.0, "in the project it is {same:.1} dB off its leader");
    assert!(apart > -20.0, "an instance of another project is only {apart:.1} dB off");
}

fn a_follower_alone_hears_as_it_was_saved<H: Host>() {
    let setup = Setup { block: BLOCK, ..Setup::default() };
    let mut hosts = [0x3330, 0x3330].map(|project| member::<H>(setup, project));
    hosts[0].set("lead", 1.0);
    hosts[0].set("yaw", 0.7);
    let input = noise(24_000);
    let heard = |hosts: &mut [H], from: f64| {
        let mut out = [Vec::new(), Vec::new()];
        hosts.iter_mut().for_each(|host| host.play_from(from));
        for block in input.chunks(BLOCK) {
            for host in &mut *hosts {
                let ears = host.process(&[block, block]);
                // What the last of them gives.
                out.iter_mut().zip(ears).for_each(|(all, ear)| all.extend(ear));
            }
        }
        let last = |ear: Vec<f32>| ear.chunks(BLOCK).skip(hosts.len() - 1).step_by(hosts.len()).flatten().copied().collect();
        out.map(last)
    };
    heard(&mut hosts, 0.0);
    let wanted = heard(&mut hosts, 5.0);
    let saved = hosts[1].save();
    drop(hosts);
    let mut alone = [H::open(setup)];
    let still = heard(&mut alone, 0.0);
    assert!(alone[0].load(&saved));
    alone[0].instance().settle().unwrap();
    heard(&mut alone, 0.0);
    let found = heard(&mut alone, 5.0);
    let late = |ears: &[Vec<f32>; 2]| [ears[0][12_000..23_000].to_vec(), ears[1][12_000..23_000].to_vec()];
    let (same, apart) = (difference_db(&late(&wanted), &late(&found)), difference_db(&late(&wanted), &late(&still)));
    assert!(same < -60.0 && apart > -20.0, "alone it is {same:.1} dB off, and {apart:.1} dB without what was saved");
}
