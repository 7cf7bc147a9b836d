//! A CLAP host may put a silent instance to sleep, and only a silent one. VST3 has no such status.

use promenade_tests::signal::noise;
use promenade_tests::{ClapHost, Host, Setup, in_both_formats};

const BLOCK: usize = 4096;

in_both_formats!(silence_after_the_tail_is_exact);

fn silent<H: Host>(host: &mut H) -> bool {
    let out = host.process(&[&[0.0; BLOCK], &[0.0; BLOCK]]);
    out.iter().flatten().all(|sample| *sample == 0.0)
}

#[test]
fn a_host_may_sleep_once_nothing_sounds_any_more() {
    let mut host = ClapHost::open(Setup { block: BLOCK, ..Setup::default() });
    let signal = noise(BLOCK);
    // Asleep, awake with the next sound, and asleep again.
    for _ in 0..2 {
        host.process(&[&signal, &signal]);
        let tail = host.tail();
        assert!(tail > BLOCK, "{tail} samples");
        assert_eq!(host.instance().may_sleep(), Some(false));
        let mut quiet = 0;
        while quiet <= 1_000_000 {
            let is_silent = silent(&mut host);
            quiet += BLOCK;
            let sleeps = host.instance().may_sleep() == Some(true);
            assert!(!sleeps || (is_silent && quiet > tail), "it would be cut off after {quiet} of {tail} samples");
            if sleeps {
                break;
            }
            assert_eq!(host.tail(), tail);
        }
        assert!(quiet <= 1_000_000, "it never sleeps");
    }
}

#[test]
fn a_leader_of_a_group_stays_awake() {
    let mut host = ClapHost::open(Setup { block: BLOCK, ..Setup::default() });
    host.set("group", 0.25);
    host.set("lead", 1.0);
    for _ in 0..60 {
        silent(&mut host);
        assert_eq!(host.instance().may_sleep(), Some(false), "its followers need its pose");
    }
    host.set("lead", 0.0);
    silent(&mut host);
    assert_eq!(host.instance().may_sleep(), Some(true));
}

fn silence_after_the_tail_is_exact<H: Host>() {
    let mut host = H::open(Setup { block: BLOCK, ..Setup::default() });
    let signal = noise(BLOCK);
    host.process(&[&signal, &signal]);
    assert!((0..240).any(|_| silent(&mut host)), "it sounds on for ever");
}
