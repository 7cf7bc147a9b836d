//! Ambisonics out of the plugin, in a host.

use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_core::head::{degree, harmonics};
use promenade_host::Bounce;
use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{Host, Setup, edit_state, host_id, in_both_formats, render};
use serde_json::json;

in_both_formats!(
    a_drawn_room_is_heard_by_microphones,
    a_turn_of_the_head_turns_the_field,
    what_has_no_field_passes_the_dry_sound_from_the_sides,
);

const EMITTER: Vec3 = Vec3::new(1.5, 0.5, 0.25);
/// Where the click is, samples.
const CLICK: usize = 100;

fn setup(outputs: usize) -> Setup {
    Setup { outputs, offline: true, ..Setup::default() }
}

/// An instance that plays a drawn room.
fn in_a_room<H: Host>(outputs: usize) -> H {
    let mut host = H::open(setup(outputs));
    let room = json!({
        "size": [5.0, 4.0, 2.5], "corner": [-2.0, -2.0, -1.0], "emitter": EMITTER.to_array(),
        "materials": ["marble_floor", "plasterboard", "0.2", "0.3:0.4", "carpet_thin", "plasterboard"],
    });
    let mut state = host.state();
    state["params"]["scene"] = json!({ "string": "library" });
    assert!(host.load(&edit_state(&state, "room", &room)));
    for (id, value) in [("x", "0 m"), ("y", "0 m"), ("z", "0 m"), ("pitch", "0 deg"), ("roll", "0 deg")] {
        set(&mut host, id, value);
    }
    host
}

fn set<H: Host>(host: &mut H, id: &str, value: &str) {
    let normalized = host.instance().from_text(host_id(id), value).unwrap();
    host.set(id, normalized);
}

/// All channels that come out, in time with what goes in.
fn heard<H: Host>(host: &mut H, outputs: usize, input: [&[f32]; 2]) -> Vec<Vec<f32>> {
    host.reopen(setup(outputs));
    let mut channels = vec![Vec::new(); outputs];
    let mut bounce = Bounce::new(host.instance(), &[]).unwrap();
    // Blocks that no hop fits.
    for start in (0..input[0].len()).step_by(500) {
        let block = input.map(|channel| &channel[start..(start + 500).min(channel.len())]);
        bounce.play(&block, &mut channels).unwrap();
    }
    channels
}

fn a_drawn_room_is_heard_by_microphones<H: Host>() {
    let mut click = vec![0.0; 9_600];
    click[CLICK] = 1.0;
    let mut fields = Vec::new();
    for outputs in [16, 9, 4] {
        let mut host = in_a_room::<H>(outputs);
        set(&mut host, "yaw", "30 deg");
        assert_eq!(host.instance().main_output(), "ambisonic, ACN, SN3D");
        fields.push(heard(&mut host, outputs, [&click, &click]));
    }
    // The direct sound with the click, along the channels of its direction.
    let towards = Pose::from_ypr(Vec3::ZERO, 30.0_f32.to_radians(), 0.0, 0.0).to_head(EMITTER).normalize();
    let wanted = harmonics(3, towards);
    let third = &fields[0];
    let first = third[0][CLICK];
    assert!(third[0][..CLICK - 1].iter().all(|x| x.abs() < 0.02 * first), "silence before it");
    for (channel, sound) in third.iter().enumerate() {
        let share = wanted[channel] / (2.0 * degree(channel) as f32 + 1.0).sqrt();
        assert!((sound[CLICK] / first - share).abs() < 0.02, "{channel}: {} of {first}, not {share}", sound[CLICK]);
    }
    // The room rings in all channels, with the energy of a field that comes from everywhere.
    let late = |channel: usize| third[channel][CLICK + 2_400..].iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    for channel in 1..16 {
        let db = 10.0 * (late(channel) * (2.0 * degree(channel) as f64 + 1.0) / late(0)).log10();
        assert!(db.abs() < 3.0, "{channel}: {db:.1} dB");
    }
    assert!(fields[1][..] == third[..9] && fields[2][..] == third[..4], "a lower order is not its first channels");
}

fn a_turn_of_the_head_turns_the_field<H: Host>() {
    // The room is some 6 dB louder than what it is played.
    let signal: Vec<f32> = noise(9_600).iter().map(|x| 0.5 * x).collect();
    let mut host = in_a_room::<H>(16);
    set(&mut host, "yaw", "0 deg");
    let still = heard(&mut host, 16, [&signal, &signal]);
    set(&mut host, "yaw", "90 deg");
    let turned = heard(&mut host, 16, [&signal, &signal]);
    // Up and everywhere stay; ahead comes from where the right was.
    for (channel, was, sign) in [(0, 0, 1.0), (2, 2, 1.0), (3, 1, 1.0), (1, 3, -1.0)] {
        let wanted: Vec<f32> = still[was].iter().map(|x| sign * x).collect();
        let off = difference_db(&[wanted.clone(), wanted], &[turned[channel].clone(), turned[channel].clone()]);
        // What noise carries is drawn anew for each channel and does not turn.
        assert!(off < -3.0, "{channel}: {off:.1} dB");
    }
}

fn what_has_no_field_passes_the_dry_sound_from_the_sides<H: Host>() {
    let (left, right) = (noise(4_000), noise(8_000)[4_000..].to_vec());
    let sides = |host: &mut H, at_unity: bool| {
        let field = heard(host, 4, [&left, &right]);
        let len = field[0].len();
        for (channel, sign) in [1.0, -1.0].into_iter().enumerate() {
            let dry = |n: usize| 0.5 * (left[n] + sign * right[n]);
            let sum = |of: &dyn Fn(usize) -> f32| (0..len).map(of).sum::<f32>();
            // At the scene's level, as the scene would be heard.
            let gain = sum(&|n| field[channel][n] * dry(n)) / sum(&|n| dry(n).powi(2));
            assert!(if at_unity { (gain - 1.0).abs() < 1e-6 } else { (0.1..2.0).contains(&gain) }, "{channel}: gain {gain}");
            let off = |n: usize| (field[channel][n] - gain * dry(n)).abs();
            assert!(len > 2_000 && (0..len).all(|n| off(n) < 1e-6), "{channel}: not from the sides");
        }
        assert!(field[2..].iter().flatten().all(|x| x.abs() < 1e-6), "from elsewhere");
    };
    // A measured room has a head in it.
    let mut host = H::open(setup(4));
    set(&mut host, "scene", "IoSR room A");
    sides(&mut host, false);
    let mut host = in_a_room::<H>(4);
    host.set("bypass", 1.0);
    sides(&mut host, true);
    // Ears are as they were.
    let mut host = in_a_room::<H>(2);
    assert_eq!(host.instance().main_output(), "stereo");
    host.reopen(setup(2));
    let ears = render(&mut host, &[&left, &right], &[512]);
    assert!(ears.iter().flatten().all(|x| x.is_finite()) && ears[0] != ears[1]);
}
