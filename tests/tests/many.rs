//! The plugin of many sources: what its inputs play comes from their places in one room.

use crate::directions::along_axes;
use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Pose, Renderer, RendererConfig, Scene, Spatializer, Voice};
use promenade_host::{Lane, Point, bounce};
use promenade_tests::signal::{difference_db, impulse, noise, peak, peak_index};
use promenade_tests::{ClapHost, Host, Knob, Setup, edit_state, host_id, in_both_formats, render};
use std::sync::Arc;

in_both_formats!(
    sources_sound_as_the_engine_plays_them,
    the_first_source_is_that_of_the_plugin_of_one,
    a_further_source_begins_as_an_instance_of_its_own,
    levels_and_places_are_heard_and_saved,
    all_inputs_arrive_and_those_without_a_track_are_silent,
    dry_sounds_add_up_at_the_reported_latency,
    every_source_is_heard_with_a_short_latency,
    microphones_hear_further_sources,
    a_project_of_one_source_opens_with_many,
    a_project_of_many_sources_opens_with_most,
    every_source_has_its_parameters,
    muted_sources_are_silent_and_a_solo_is_heard_alone,
);

const RATE: f64 = 48_000.0;
const LEN: usize = 30_000;

fn setup(further: usize) -> Setup {
    Setup { inputs: 1, further, offline: true, ..Setup::default() }
}

/// Sets a parameter to what its text says.
pub(crate) fn set<H: Host>(host: &mut H, id: &str, value: &str) {
    let normalized = host.instance().from_text(host_id(id), value).unwrap();
    host.set(id, normalized);
}

/// Different sounds of one length, samples.
pub(crate) fn sounds(count: usize, len: usize) -> Vec<Vec<f32>> {
    (0..count).map(|number| noise(len + 7_919 * number)[7_919 * number..].to_vec()).collect()
}

pub(crate) fn tracks(sounds: &[Vec<f32>]) -> Vec<&[f32]> {
    sounds.iter().map(Vec::as_slice).collect()
}

/// The engine by itself, on the scene of a new instance.
fn engine(further: usize) -> Spatializer {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade");
    let scene = Arc::new(Scene::from_bytes(&std::fs::read(scene).unwrap()).unwrap());
    let mut engine = Spatializer::new(RATE);
    engine.install(Box::new(Renderer::new(scene, RendererConfig { voices: 1 + further, ..RATE.into() }).unwrap()));
    engine
}

fn sources_sound_as_the_engine_plays_them<H: Host>() {
    // Places of the third source along x, metres, that parameters hold exactly; else both stay at their own.
    let steps = [(0, 0.0_f32), (4_801, -1.5625), (9_990, 3.125), (20_000, -3.125), (20_001, 1.5625)];
    let mut host = H::open_many(setup(2));
    let x = host.instance().parameter("Source 3 Offset X").unwrap().clone();
    let value = |x: f32| 0.5 + f64::from(x) / 100.0;
    let point = |&(at, x): &(usize, f32)| Point { seconds: at as f64 / RATE, value: value(x), hold: true };
    let lanes = [Lane::new(&x, &steps.iter().map(point).collect::<Vec<_>>(), RATE).unwrap()];
    let sounds = sounds(3, LEN);
    let heard = bounce(host.instance(), &tracks(&sounds), &lanes, 0).unwrap();

    let mut engine = engine(2);
    let late = engine.latency_samples();
    let padded: Vec<_> = sounds.iter().map(|sound| [&sound[..], &vec![0.0; late]].concat()).collect();
    let mut wanted = [vec![0.0; LEN + late], vec![0.0; LEN + late]];
    let ends = steps.iter().skip(1).map(|(at, _)| *at).chain([LEN + late]);
    for ((start, x), end) in steps.into_iter().zip(ends) {
        let further = [(&padded[1], Vec3::new(-0.03, 0.29, 0.0)), (&padded[2], Vec3::new(x, -0.29, 0.0))]
            .map(|(sound, offset)| Voice::at(&sound[start..end], offset));
        let [left, right] = &mut wanted;
        let ears = [&mut left[start..end], &mut right[start..end]];
        engine.process(&[&padded[0][start..end]], &further, ears, &BlockParams::default(), |_| Pose::IDENTITY);
    }
    let wanted = wanted.map(|ear| ear[late..].to_vec());
    assert!(peak(&wanted[0]) > 0.01);
    let difference = difference_db(&wanted, &heard);
    assert!(difference < -120.0, "{difference} dB from the engine by itself");
}

fn the_first_source_is_that_of_the_plugin_of_one<H: Host>() {
    let sound = noise(LEN);
    let mut one = H::open(setup(0));
    let mut many = H::open_many(setup(0));
    assert_eq!((many.latency(), many.tail()), (one.latency(), one.tail()));
    let [one, many] = [one, many].map(|mut host| {
        set(&mut host, "ey", "1.5 m");
        render(&mut host, &[&sound], &[512, 100])
    });
    let difference = difference_db(&one, &many);
    assert!(peak(&one[0]) > 0.01 && difference < -120.0, "{difference} dB");
}

fn a_further_source_begins_as_an_instance_of_its_own<H: Host>() {
    let (click, silence) = (impulse(4_000, 8_000), vec![0.0; 8_000]);
    let places = [("ex", "-0.6 m"), ("ey", "0.8 m"), ("ez", "0.1 m")];
    let mut one = H::open(setup(0));
    places.iter().for_each(|(id, value)| set(&mut one, id, value));
    let mut many = H::open_many(setup(4));
    places.iter().for_each(|(id, value)| set(&mut many, &format!("{id}5"), value));
    let wanted = render(&mut one, &[&click], &[512]);
    let found = render(&mut many, &[&silence, &silence, &silence, &silence, &click], &[512]);
    // A frame, and what is the source's own of the room's response.
    let early = |ears: [Vec<f32>; 2]| ears.map(|ear| ear[..4_000 + 780 + 2_640].to_vec());
    let difference = difference_db(&early(wanted), &early(found));
    assert!(difference < -80.0, "{difference} dB");
}

fn levels_and_places_are_heard_and_saved<H: Host>() {
    let sounds = sounds(2, LEN);
    let heard = |host: &mut H| {
        host.instance().settle().unwrap();
        render(host, &tracks(&sounds), &[512])
    };
    let mut host = H::open_many(setup(1));
    let plain = heard(&mut host);
    set(&mut host, "level2", "-60 dB");
    let without = heard(&mut host);
    let mut first = H::open_many(setup(0));
    let alone = render(&mut first, &[&sounds[0]], &[512]);
    let difference = difference_db(&alone, &without);
    assert!(difference < -120.0, "a silent level leaves {difference} dB");
    set(&mut host, "level2", "-6 dB");
    set(&mut host, "ex2", "-3 m");
    let moved = heard(&mut host);
    assert!(difference_db(&plain, &moved) > -20.0, "neither place nor level is heard");
    let state = host.save();
    let mut again = H::open_many(setup(1));
    assert!(again.load(&state), "the plugin takes its own state");
    let difference = difference_db(&moved, &heard(&mut again));
    assert!(difference < -120.0, "{difference} dB after it was opened again");
    assert_eq!(again.state()["params"]["ex2"]["f32"].as_f64().map(f64::round), Some(-3.0));
    assert!(H::open(setup(0)).state()["params"].get("ex2").is_none(), "one source has none of these");
}

fn all_inputs_arrive_and_those_without_a_track_are_silent<H: Host>() {
    let (click, silence) = (impulse(1_000, 4_000), vec![0.0; 4_000]);
    for further in [1, 8, 15, 16, 40, 63] {
        let mut host = H::open_many(setup(further));
        let mut tracks = vec![&silence[..]; 1 + further];
        tracks[further] = &click;
        assert!(peak(&render(&mut host, &tracks, &[300])[0]) > 0.01, "source {} is not heard", 1 + further);
    }
    let mut host = H::open_many(setup(0));
    let heard = render(&mut host, &[&silence], &[300]);
    assert!(heard.iter().flatten().all(|x| *x == 0.0));
}

fn muted_sources_are_silent_and_a_solo_is_heard_alone<H: Host>() {
    let sounds = sounds(2, LEN);
    let silence = vec![0.0; LEN];
    let heard = |sources: serde_json::Value, tracks: &[&[f32]]| {
        let mut host = H::open_many(setup(1));
        let state = host.state();
        assert!(host.load(&edit_state(&state, "sources", &sources)));
        host.instance().settle().unwrap();
        render(&mut host, tracks, &[512])
    };
    let both = [&sounds[0][..], &sounds[1]];
    let (first, second) = ([&sounds[0][..], &silence], [&silence[..], &sounds[1]]);
    for (sources, wanted) in [
        (serde_json::json!({ "1": { "mute": true } }), second),
        (serde_json::json!({ "2": { "mute": true, "name": "Choir" } }), first),
        (serde_json::json!({ "2": { "solo": true } }), second),
    ] {
        let difference = difference_db(&heard(serde_json::json!({}), &wanted), &heard(sources.clone(), &both));
        assert!(difference < -100.0, "{sources}: {difference} dB");
    }
}

fn dry_sounds_add_up_at_the_reported_latency<H: Host>() {
    let mut host = H::open_many(setup(2));
    host.set("mix", 0.0);
    set(&mut host, "level3", "-20 dB");
    let late = host.latency();
    let clicks = [1_000, 1_500, 2_000].map(|at| impulse(at, 4_000));
    let [left, right] = render(&mut host, &[&clicks[0], &clicks[1], &clicks[2]], &[512]);
    assert_eq!(left, right);
    for (at, gain) in [(1_000, 1.0), (1_500, 1.0), (2_000, 0.1)] {
        assert!((left[at + late] - gain).abs() < 1e-4, "{} at {at}", left[at + late]);
    }
    assert_eq!(left.iter().filter(|x| **x != 0.0).count(), 3);
}

fn every_source_is_heard_with_a_short_latency<H: Host>() {
    let (click, silence) = (impulse(1_000, 6_000), vec![0.0; 6_000]);
    let mut host = H::open_many(setup(1));
    set(&mut host, "latency", "None");
    host.instance().settle().unwrap();
    for inputs in [[&click, &silence], [&silence, &click]] {
        let heard = render(&mut host, &inputs.map(|input| &input[..]), &[512]);
        assert!(peak(&heard[0]) > 0.01 && peak_index(&heard[0]) < 1_000 + 700);
    }
}

fn microphones_hear_further_sources<H: Host>() {
    let (click, silence) = (impulse(1_000, 4_000), vec![0.0; 4_000]);
    let mut host = H::open_many(Setup { outputs: 4, ..setup(1) });
    let mut field = vec![vec![0.0; 4_000]; 4];
    for start in (0..4_000).step_by(500) {
        let span = start..start + 500;
        let mut out: Vec<_> = field.iter_mut().map(|channel| &mut channel[span.clone()]).collect();
        host.instance().process_into(&[&silence[span.clone()], &click[span.clone()]], &mut out).unwrap();
    }
    assert!(peak(&field[0]) > 0.01 && field[3] != field[0], "{}", peak(&field[0]));
}

fn a_project_of_one_source_opens_with_many<H: Host>() {
    let sound = noise(LEN);
    let mut one = H::open(setup(0));
    set(&mut one, "yaw", "50 deg");
    set(&mut one, "ex", "-2 m");
    one.instance().settle().unwrap();
    let wanted = render(&mut one, &[&sound], &[512]);
    let mut many = H::open_many(setup(3));
    assert!(many.load(&one.save()));
    many.instance().settle().unwrap();
    let silence = vec![0.0; LEN];
    let difference = difference_db(&wanted, &render(&mut many, &[&sound, &silence, &silence, &silence], &[512]));
    assert!(difference < -120.0, "{difference} dB");
}

fn a_project_of_many_sources_opens_with_most<H: Host>() {
    let sounds = sounds(2, LEN);
    let mut many = H::open_many(setup(1));
    set(&mut many, "ex2", "-3 m");
    set(&mut many, "level2", "-6 dB");
    many.instance().settle().unwrap();
    let wanted = render(&mut many, &tracks(&sounds), &[512]);
    let mut most = H::open_many(setup(63));
    assert!(most.load(&many.save()));
    most.instance().settle().unwrap();
    let silence = vec![0.0; LEN];
    let all: Vec<_> = tracks(&sounds).into_iter().chain(vec![&silence[..]; 62]).collect();
    let difference = difference_db(&wanted, &render(&mut most, &all, &[512]));
    assert!(peak(&wanted[0]) > 0.01 && difference < -120.0, "{difference} dB");
}

fn every_source_has_its_parameters<H: Host>() {
    for (further, sources) in [(0, 16), (63, 64)] {
        has_parameters(&mut H::open_many(setup(further)), sources);
    }
}

/// What a parameter of a source is at first, metres or degrees.
fn default_of(knobs: &[Knob], source: usize, axis: &str) -> f64 {
    let knob = knobs.iter().find(|knob| knob.name == format!("Source {source} {axis}")).unwrap();
    knob.default.trim_end_matches([' ', 'm', 'd', 'e', 'g']).parse().unwrap()
}

/// Has the parameters of so many sources, and no others.
fn has_parameters<H: Host>(many: &mut H, sources: usize) {
    let (one, knobs) = (H::open(setup(0)).knobs(), many.knobs());
    assert_eq!(knobs[..one.len()], one, "the plugin of one source is within");
    let mut wanted = Vec::new();
    for source in 2..=sources {
        let [x, y] = ["Offset X", "Offset Y"].map(|axis| default_of(&knobs, source, axis));
        // The loft's walls about its source, on this side of the corner.
        let [azimuth, away] = ["Azimuth", "Distance"].map(|part| default_of(&knobs, source, part));
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let [polar_x, polar_y, _] = along_axes([away * cos, away * sin, 0.0]);
        assert!((-7.6..-3.1).contains(&polar_x) || polar_y > -2.6, "source {source} begins outside: {polar_x}, {polar_y}");
        assert!((-7.6..1.4).contains(&x) && (-2.6..2.4).contains(&y), "source {source} begins outside: {x}, {y}");
        for (id, name, default) in [
            ("ex", "Offset X", format!("{x:.3} m")),
            ("ey", "Offset Y", format!("{y:.3} m")),
            ("ez", "Offset Z", "0.000 m".to_owned()),
            ("level", "Level", "0.00 dB".to_owned()),
            ("azimuth", "Azimuth", format!("{azimuth:.2} deg")),
            ("elevation", "Elevation", "0.00 deg".to_owned()),
            ("distance", "Distance", format!("{away:.3} m")),
        ] {
            wanted.push((host_id(&format!("{id}{source}")), format!("Source {source} {name}"), default, true));
        }
    }
    let found = knobs[one.len()..].iter().map(|k| (k.host_id, k.name.clone(), k.default.clone(), k.automatable));
    assert_eq!(found.collect::<Vec<_>>(), wanted);
    let mut ids: Vec<_> = knobs.iter().map(|knob| knob.host_id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), knobs.len(), "two parameters have one number");
    let many_tracks = 1 + many.instance().setup().further;
    for (id, ..) in wanted {
        for value in [1.0, 0.0] {
            many.instance().set_at(id, value, 0).unwrap();
            many.process(&vec![&[0.0; 64][..]; many_tracks]);
            assert!((many.instance().value(id).unwrap() - value).abs() < 1e-6);
        }
    }
}

#[test]
fn a_host_lets_it_sleep_only_when_no_source_sounds() {
    // Shorter than a hop: when the sound goes in, nothing comes out yet.
    const BLOCK: usize = 64;
    let mut host = ClapHost::open_many(Setup { block: BLOCK, offline: false, ..setup(15) });
    let (signal, silence) = (noise(BLOCK), vec![0.0; BLOCK]);
    let (mut sounding, tail) = (vec![&silence[..]; 16], host.tail());
    sounding[15] = &signal;
    let sleeps = |host: &mut ClapHost, tracks: &[&[f32]]| {
        let out = host.process(tracks);
        (out.iter().flatten().all(|x| *x == 0.0), host.instance().may_sleep())
    };
    let silent = vec![&silence[..]; 16];
    for _ in 0..tail / BLOCK {
        assert_eq!(sleeps(&mut host, &silent), (true, Some(false)));
    }
    while sleeps(&mut host, &silent) != (true, Some(true)) {}
    assert_eq!(sleeps(&mut host, &sounding).1, Some(false), "the sound would be cut off");
    let mut quiet = 0;
    while sleeps(&mut host, &silent).1 != Some(true) {
        quiet += BLOCK;
        assert!(quiet < 1_000_000, "it never sleeps");
    }
    assert!(quiet > tail, "it would be cut off after {quiet} of {tail} samples");
}

#[test]
fn a_preset_leaves_further_sources_where_they_are() {
    let bundle = ClapHost::bundle();
    let many = bundle.find("Promenade Many").unwrap();
    let preset = bundle.preset(many, "Half dry, source on the left").unwrap();
    let mut host = ClapHost::open_many(setup(0));
    set(&mut host, "ex7", "2 m");
    host.instance().settle().unwrap();
    let before = host.value("ex7");
    host.instance().load_preset(&preset).unwrap();
    assert!((host.value("mix") - 0.5).abs() < 0.2, "half of it is dry");
    assert!((host.value("ex7") - before).abs() < 1e-6 && before > 0.51);
}

#[test]
fn sources_have_modules_and_pages_of_their_own() {
    let mut host = ClapHost::open_many(setup(0));
    let of = |id: &str| host_id(id);
    let all = host.instance().parameters().to_vec();
    let module = |id: &str| all.iter().find(|p| p.id == of(id)).unwrap().module.clone();
    assert_eq!([module("ex2"), module("level16"), module("ex")], ["Source 2", "Source 16", "Emitter"]);
    let pages = host.instance().remote_pages();
    let first = pages.iter().find(|page| page.name == "Source 2").unwrap_or_else(|| panic!("{pages:?}"));
    let wanted = ["ex2", "ey2", "ez2", "level2", "azimuth2", "elevation2", "distance2"].map(|id| Some(of(id)));
    assert_eq!((&first.parameters[..7], first.parameters[7]), (&wanted[..], None));
    for parameter in all {
        let count = pages.iter().flat_map(|page| page.parameters).filter(|knob| *knob == Some(parameter.id)).count();
        assert_eq!(count, usize::from(parameter.name != "Revision"), "{}", parameter.name);
    }
}

mod needs_screen {
    use super::*;
    use promenade_host::EditKind;
    use promenade_tests::screen::{Picture, Screen, wait_until};
    use std::time::Duration;

    /// A pleasant while for a window to come up on a slow machine.
    const PATIENCE: Duration = Duration::from_secs(20);

    /// Plays a block on the third input as it is played live, and serves the editor.
    fn play(host: &mut ClapHost, sound: &[f32]) {
        let silence = vec![0.0; sound.len()];
        host.process(&[&silence, &silence, sound]);
        host.instance().serve().unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }

    /// The picture once nothing moves in it.
    fn settled(host: &mut ClapHost, screen: &Screen, sound: &[f32], wanted: impl Fn(&Picture) -> bool) -> Picture {
        let (mut last, mut still) = (screen.picture(), 0);
        let shown = wait_until(PATIENCE, || {
            (0..4).for_each(|_| play(host, sound));
            let now = screen.picture();
            still = if middle(&now) == middle(&last) { still + 1 } else { 0 };
            last = now;
            last.colours(40) == 40 && still >= 5 && wanted(&last)
        });
        if !shown {
            last.keep("many-failed");
        }
        assert!(shown, "the editor does not come to rest");
        last
    }

    /// The middle of the window, where nothing but the place is shown, with where each pixel is.
    fn middle(picture: &Picture) -> Vec<((i16, i16), [u8; 3])> {
        let (width, height) = (picture.width as usize, picture.height as usize);
        let pixel = |x: usize, y: usize| std::array::from_fn(|channel| picture.rgb[3 * (y * width + x) + channel]);
        let at = |x: usize, y: usize| (i16::try_from(x).unwrap(), i16::try_from(y).unwrap());
        (height / 8..height / 2 + height / 8)
            .flat_map(|y| (width / 4..3 * width / 4).map(move |x| (x, y)))
            .map(|(x, y)| (at(x, y), pixel(x, y)))
            .collect()
    }

    #[test]
    #[ignore = "needs a screen"]
    fn a_further_source_lights_up_where_it_is_and_can_be_dragged() {
        let screen = Screen::new(1400, 900);
        let mut host = ClapHost::open_many(Setup { offline: false, ..setup(2) });
        screen.point(2, 2);
        let editor = host.instance().editor().unwrap();
        let size = editor.open(screen.window(), 1.0).unwrap();
        editor.show().unwrap();
        screen.resize(size.width, size.height);
        let (sound, silence) = (noise(512), vec![0.0; 512]);
        let dark = settled(&mut host, &screen, &silence, |_| true);
        let lit = settled(&mut host, &screen, &sound, |picture| middle(picture) != middle(&dark));
        lit.keep("many-sources");
        let changed: Vec<_> =
            middle(&dark).into_iter().zip(middle(&lit)).filter(|(a, b)| a != b).map(|((at, _), _)| at).collect();
        let centre = |of: fn(&(i16, i16)) -> i16| {
            let all = || changed.iter().map(of);
            i16::midpoint(all().min().unwrap(), all().max().unwrap())
        };
        let (x, y) = (centre(|at| at.0), centre(|at| at.1));
        let far = changed.iter().map(|at| (at.0 - x).abs().max((at.1 - y).abs())).max().unwrap();
        assert!(far <= 12, "more than the dot of one source lights up");
        host.instance().take_edits();
        let wanted = ["ex3", "ey3"].map(host_id);
        let mut edits = Vec::new();
        screen.point(x, y);
        screen.press(1, true);
        let moved = wait_until(PATIENCE, || {
            let step = i16::try_from(edits.len() % 20).unwrap();
            screen.point(x + 30 + step, y + 20 + step);
            play(&mut host, &sound);
            edits.extend(host.instance().take_edits());
            wanted.iter().all(|id| edits.iter().any(|edit| edit.id == *id && matches!(edit.kind, EditKind::Value(_))))
        });
        assert!(moved, "the host hears {edits:?}");
        screen.press(1, false);
        let ended = wait_until(PATIENCE, || {
            play(&mut host, &sound);
            edits.extend(host.instance().take_edits());
            wanted.iter().all(|id| edits.iter().any(|edit| edit.id == *id && edit.kind == EditKind::End))
        });
        assert!(ended && edits.iter().all(|edit| wanted.contains(&edit.id)), "{edits:?}");
        let [x, y] = ["ex3", "ey3"].map(|id| 100.0 * host.value(id) - 50.0);
        assert!((x + 0.03).abs() > 0.05 && (y + 0.29).abs() > 0.05, "the source is at {x}, {y}");
        settled(&mut host, &screen, &sound, |_| true).keep("many-dragged");
    }
}
