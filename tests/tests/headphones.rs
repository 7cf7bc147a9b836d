//! What headphones need, in a host.

use promenade_core::headphones::Headphones;
use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{Host, Setup, edit_state, in_both_formats, render};
use serde_json::json;

in_both_formats!(headphones_are_compensated_at_every_rate_and_not_in_bypass);

const TEXT: &str =
    "Preamp: -6.2 dB\nFilter 1: ON LSC Fc 105 Hz Gain 5.5 dB Q 0.70\nFilter 2: ON PK Fc 2300 Hz Gain -4.1 dB Q 1.8";

fn headphones_are_compensated_at_every_rate_and_not_in_bypass<H: Host>() {
    let headphones = Headphones::from_text(TEXT).unwrap();
    let mut levels = [[0.0_f32; promenade_core::headphones::HEADPHONE_POINTS]; 2];
    levels[1].fill(-3.0);
    let uneven = Headphones::from_levels(levels).unwrap();
    for rate in [44_100.0, 48_000.0, 96_000.0] {
        let signal = noise(12_000);
        let setup = Setup { rate, ..Setup::default() };
        let mut host = H::open(setup);
        let fresh = host.state();
        let plain = render(&mut host, &[&signal, &signal], &[512]);
        for (name, headphones) in [("HD 600", &headphones), ("Uneven", &uneven)] {
            assert!(host.load(&edit_state(&fresh, "headphones", &json!({ "name": name, "headphones": headphones }))));
            host.reopen(setup);
            let heard = render(&mut host, &[&signal, &signal], &[512, 17]);
            let mut wanted = plain.clone();
            let [left, right] = &mut wanted;
            headphones.filter(rate).process([left, right]);
            let off = difference_db(&wanted, &heard);
            assert!(off < -100.0 && difference_db(&plain, &heard) > -20.0, "{name} at {rate} Hz: {off:.1} dB");
        }
        // The plugin is as it was, and in bypass what comes in goes out.
        let worn = host.state();
        host.set("bypass", 1.0);
        host.reopen(setup);
        let bypassed = render(&mut host, &[&signal, &signal], &[512]);
        assert!(host.load(&fresh.to_string().into_bytes()));
        host.set("bypass", 1.0);
        host.reopen(setup);
        assert!(bypassed == render(&mut host, &[&signal, &signal], &[512]), "{rate} Hz: bypass is not as without headphones");
        assert!(worn["fields"]["headphones"].as_str().unwrap().contains("Uneven"));
        assert!(host.load(&fresh.to_string().into_bytes()));
        host.reopen(setup);
        assert!(plain == render(&mut host, &[&signal, &signal], &[512]), "{rate} Hz: none is not none");
    }
}
