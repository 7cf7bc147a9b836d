//! Sources that move along paths of their own: what is heard is what the engine plays of the same moves.

use crate::many::{set, sounds, tracks};
use promenade_core::glam::Vec3;
use promenade_core::{
    BlockParams, CameraPath, EmitterParams, Keyframe, KeyframeEntry, Pose, Renderer, RendererConfig, Scene, Spatializer, Voice,
};
use promenade_tests::signal::{difference_db, noise, peak};
use promenade_tests::{ClapHost, Format, Host, Setup, edit_state, in_both_formats, in_library, render};
use serde_json::{Value, json};
use std::sync::Arc;

in_both_formats!(
    sources_on_paths_sound_as_the_engine_moves_them,
    the_position_parameter_moves_listener_and_sources_alike,
    without_following_the_knobs_say_where_sources_are,
    paths_are_saved_and_an_older_project_has_none,
);

const RATE: f64 = 48_000.0;
const LEN: usize = 20_000;
/// Far below what can be heard: not more than roundings.
const SAME_DB: f32 = -120.0;
const TRANSPORT: f64 = 1.0;
const POSITION: f64 = 0.5;

fn setup(further: usize) -> Setup {
    Setup { inputs: 1, further, offline: true, ..Setup::default() }
}

/// A walk through places at times, seconds and metres.
fn path(places: &[(f64, [f32; 3])]) -> CameraPath {
    let keyframe = |&(t_s, at): &(f64, [f32; 3])| Keyframe { t_s, pose: Pose::from_ypr(at.into(), t_s as f32, 0.0, 0.0) };
    CameraPath::new(places.iter().map(keyframe).collect()).unwrap()
}

/// As states have it.
fn saved(path: &CameraPath) -> Value {
    let keyframes: Vec<_> = path.keyframes().iter().map(|keyframe| KeyframeEntry::from(*keyframe)).collect();
    json!({ "keyframes": keyframes, "speed": 1.0, "looping": false, "slot": 0 })
}

fn across() -> CameraPath {
    path(&[(0.0, [1.5, 2.0, 0.0]), (0.1, [1.0, 0.5, 0.25]), (0.35, [2.0, -2.0, 0.5])])
}

fn around() -> CameraPath {
    path(&[(0.05, [-1.0, 1.0, 0.0]), (0.2, [-1.5, -1.0, 0.0]), (0.3, [1.0, -1.5, 1.0])])
}

/// An instance whose first and third source follow these paths.
fn on_paths<H: Host>(mut host: H) -> H {
    let state = edit_state(&host.state(), "walks", &json!({ "1": saved(&across()), "3": saved(&around()) }));
    assert!(host.load(&state));
    host
}

/// The time at which a block begins as a host of a format tells it, of the time that it is: the CLAP's counts in steps of half
/// a nanosecond, and what comes of that in places of single precision is 96 dB below the sound.
fn told(format: Format, t_s: f64) -> f64 {
    match format {
        Format::Clap => (t_s * 2_f64.powi(31)).round() / 2_f64.powi(31),
        Format::Vst3 => t_s,
    }
}

/// Where the block of a sample begins.
fn block_of(at: usize, sizes: &[usize]) -> usize {
    let mut next = 0;
    let ends = sizes.iter().cycle().map(|size| {
        next += size;
        next
    });
    ends.take_while(|end| *end <= at).last().unwrap_or(0)
}

/// What the engine plays on the scene of a new instance, sample by sample: at `jump` the transport goes to another time. The
/// host has blocks of some sizes.
fn engine(sounds: &[Vec<f32>], jump: (usize, f64), sizes: &[usize], format: Format) -> [Vec<f32>; 2] {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade");
    let scene = Arc::new(Scene::from_bytes(&std::fs::read(scene).unwrap()).unwrap());
    let home = scene.emitter().unwrap();
    let mut engine = Spatializer::new(RATE);
    engine.install(Box::new(Renderer::new(scene, RendererConfig { voices: 3, ..RATE.into() }).unwrap()));
    let [first, third] = [across(), around()];
    let mut heard = [vec![0.0; LEN], vec![0.0; LEN]];
    for at in 0..LEN {
        if at == jump.0 {
            engine.jump();
        }
        let (played, from_s) = if at < jump.0 { (at, 0.0) } else { (at - jump.0, jump.1) };
        let block = block_of(played, sizes);
        let t_s = told(format, from_s + block as f64 / RATE) + (played - block) as f64 / RATE;
        let on = |path: &CameraPath| path.pose_at(path.keyframes()[0].t_s + t_s).position - home;
        let further = [Vec3::new(0.0, 1.5625, 0.0), on(&third) + Vec3::new(0.0, -1.5625, 0.0)];
        let further: Vec<_> =
            further.into_iter().zip(&sounds[1..]).map(|(offset, sound)| Voice::at(&sound[at..=at], offset)).collect();
        let emitters = EmitterParams { offset: on(&first) + Vec3::new(0.0, 0.0, 1.5625), spread: 0.0 };
        let params = BlockParams { emitters, ..BlockParams::default() };
        let [left, right] = &mut heard;
        let ears = [&mut left[at..=at], &mut right[at..=at]];
        engine.process(&[&sounds[0][at..=at]], &further, ears, &params, |_| Pose::IDENTITY);
    }
    heard
}

fn sources_on_paths_sound_as_the_engine_moves_them<H: Host>() {
    // The transport goes back, between two poses that are asked for.
    const JUMP: (usize, f64) = (11_111, 0.0625);
    let sounds = sounds(3, LEN);
    for sizes in [&[512][..], &[64, 500, 1, 333]] {
        let wanted = engine(&sounds, JUMP, sizes, H::FORMAT);
        let mut host = on_paths(H::open_many(setup(2)));
        host.set("follow", TRANSPORT);
        // Shares that single precision has exactly.
        for (id, share) in [("ez", 0.515_625), ("ex2", 0.5), ("ey2", 0.515_625), ("ex3", 0.5), ("ey3", 0.484_375)] {
            host.set(id, share);
        }
        let mut heard = [Vec::new(), Vec::new()];
        for (start, end, from_s) in [(0, JUMP.0, 0.0), (JUMP.0, LEN, JUMP.1)] {
            host.play_from(from_s);
            let part: Vec<_> = sounds.iter().map(|sound| &sound[start..end]).collect();
            heard.iter_mut().zip(render(&mut host, &part, sizes)).for_each(|(all, new)| all.extend(new));
        }
        let difference = difference_db(&wanted, &heard);
        assert!(peak(&wanted[0]) > 0.01 && difference < SAME_DB, "blocks of {sizes:?}: {difference} dB from the engine");
    }
}

fn the_position_parameter_moves_listener_and_sources_alike<H: Host>() {
    let sounds = sounds(3, LEN);
    for (share, spread) in [(0.0, "0"), (0.5, "60 deg"), (1.0, "0")] {
        let mut host = on_paths(H::open_many(setup(2)));
        let state = edit_state(&host.state(), "walk", &saved(&around()));
        assert!(host.load(&state));
        let mut still = H::open_many(setup(2));
        for host in [&mut host, &mut still] {
            set(host, "spread", spread);
            set(host, "ey3", "-0.5 m");
        }
        host.set("follow", POSITION);
        host.set("path", share);
        host.instance().settle().unwrap();
        let [first, third] = [across(), around()].map(|path| {
            let [from, to] = [path.keyframes()[0].t_s, path.keyframes()[2].t_s];
            path.pose_at(from + share * (to - from))
        });
        let home = Vec3::new(1.5, 0.0, 0.0);
        let (yaw, ..) = third.ypr();
        for (ids, at) in [
            (["ex", "ey", "ez"], first.position - home),
            (["ex3", "ey3", "ez3"], third.position - home + Vec3::new(-0.03, -0.5, 0.0)),
            (["x", "y", "z"], third.position),
        ] {
            ids.into_iter().zip(at.to_array()).for_each(|(id, metres)| still.set(id, 0.5 + f64::from(metres) / 100.0));
        }
        still.set("yaw", 0.5 + f64::from(yaw.to_degrees()) / 360.0);
        still.instance().settle().unwrap();
        let [wanted, heard] = [&mut still, &mut host].map(|host| render(host, &tracks(&sounds), &[512]));
        let difference = difference_db(&wanted, &heard);
        assert!(difference < -70.0, "at {share} of the way: {difference} dB");
    }
}

fn without_following_the_knobs_say_where_sources_are<H: Host>() {
    let sounds = sounds(3, LEN);
    let mut plain = H::open_many(setup(2));
    let mut host = on_paths(H::open_many(setup(2)));
    let [wanted, heard] = [&mut plain, &mut host].map(|host| {
        host.play_from(0.0);
        render(host, &tracks(&sounds), &[512])
    });
    assert!(peak(&wanted[0]) > 0.01);
    assert_eq!(wanted, heard);
    host.set("follow", TRANSPORT);
    host.play_from(0.0);
    let followed = render(&mut host, &tracks(&sounds), &[512]);
    assert!(difference_db(&wanted, &followed) > -20.0, "the paths move nothing");
}

fn paths_are_saved_and_an_older_project_has_none<H: Host>() {
    let sound = noise(LEN);
    let heard = |host: &mut H| {
        host.set("follow", POSITION);
        host.set("path", 0.25);
        host.instance().settle().unwrap();
        render(host, &[&sound], &[512])
    };
    let mut plain = H::open(setup(0));
    let older = {
        let mut state = plain.state();
        assert_eq!(state["fields"]["walks"], "{}");
        state["fields"].as_object_mut().unwrap().remove("walks");
        state.to_string().into_bytes()
    };
    let still = heard(&mut plain);
    let mut host = on_paths(H::open(setup(0)));
    let moved = heard(&mut host);
    assert!(difference_db(&still, &moved) > -20.0, "the path is not followed");
    let state = host.state();
    let walks: Value = serde_json::from_str(state["fields"]["walks"].as_str().unwrap()).unwrap();
    // That of a source which is not there is kept too.
    for (number, path) in [("1", across()), ("3", around())] {
        let keyframes: Vec<KeyframeEntry> = serde_json::from_value(walks[number]["keyframes"].clone()).unwrap();
        assert_eq!(keyframes, path.keyframes().iter().map(|keyframe| KeyframeEntry::from(*keyframe)).collect::<Vec<_>>());
    }
    let mut again = H::open(setup(0));
    assert!(again.load(&host.save()));
    assert_eq!(again.state(), state);
    assert_eq!(heard(&mut again), moved);
    assert!(again.load(&older));
    let difference = difference_db(&still, &heard(&mut again));
    assert!(difference < SAME_DB, "the path of before is still followed: {difference} dB");
}

#[test]
fn a_preset_that_knows_no_paths_leaves_them() {
    let bundle = ClapHost::bundle();
    let preset = bundle.preset(bundle.find("Promenade").unwrap(), "Half dry, source on the left").unwrap();
    let mut host = on_paths(ClapHost::open(setup(0)));
    let walks = host.state()["fields"]["walks"].clone();
    host.instance().load_preset(&preset).unwrap();
    assert!((host.value("mix") - 0.5).abs() < 0.2, "half of it is dry");
    assert_eq!(host.state()["fields"]["walks"], walks);
}

mod needs_screen {
    use super::*;
    use promenade_tests::screen::{Picture, Screen, wait_until};
    use std::time::Duration;

    /// A pleasant while for a window to come up on a slow machine.
    const PATIENCE: Duration = Duration::from_secs(20);
    /// The emitter's colour on the dark ground.
    const EMITTER: [u8; 3] = [0xF5, 0x8F, 0xB4];

    /// Plays a silent block as it is played live, and serves the editor.
    fn play(host: &mut ClapHost) {
        let silence = [0.0; 512];
        host.process(&[&silence, &silence, &silence]);
        host.instance().serve().unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }

    /// Opens the editor in the window.
    fn open(host: &mut ClapHost, screen: &Screen) {
        let editor = host.instance().editor().unwrap();
        let size = editor.open(screen.window(), 1.0).unwrap();
        editor.show().unwrap();
        screen.resize(size.width, size.height);
    }

    /// The picture of an open editor once what is drawn in the emitter's colour stays.
    fn settled(host: &mut ClapHost, screen: &Screen) -> Picture {
        let (mut last, mut still) = (screen.picture(), 0);
        let shown = wait_until(PATIENCE, || {
            (0..4).for_each(|_| play(host));
            let now = screen.picture();
            still = if now.places_of(EMITTER) == last.places_of(EMITTER) { still + 1 } else { 0 };
            last = now;
            last.colours(40) == 40 && still >= 5
        });
        assert!(shown, "the editor does not come to rest");
        last
    }

    #[test]
    #[ignore = "needs a screen"]
    fn the_path_of_the_chosen_source_is_drawn_and_the_source_on_it() {
        let screen = Screen::new(1400, 900);
        screen.point(2, 2);
        let [plain, waiting, moved] = [(false, 0.0), (true, 0.0), (true, POSITION)].map(|(has_paths, follow)| {
            let host = ClapHost::open_many(Setup { offline: false, ..setup(2) });
            let mut host = if has_paths { on_paths(host) } else { host };
            host.set("follow", follow);
            host.set("path", 1.0);
            open(&mut host, &screen);
            let picture = settled(&mut host, &screen);
            picture.keep(&format!("source-path-{has_paths}-{follow}"));
            picture.places_of(EMITTER)
        });
        // Three keyframes, of which each fills more than 20 pixels, and one lies below a source.
        assert!(waiting.len() > plain.len() + 40, "{} pixels, {} without a path", waiting.len(), plain.len());
        assert!(waiting != moved, "the source stays where its offset puts it");
    }

    #[test]
    #[ignore = "needs a screen"]
    fn a_file_that_is_typed_becomes_the_path_of_the_source_and_is_let_go_again() {
        // The keys of v.csv and Enter, the field below the offset, and the button below that.
        const KEYS: [u8; 6] = [55, 60, 54, 39, 55, 36];
        const FIELD: (i16, i16) = (1040, 466);
        const NO_PATH: (i16, i16) = (998, 494);
        let rows = "t,x,y,z,yaw,pitch,roll\n0,1,2,0,0,0,0\n1,-1,2,0,0,0,0\n";
        in_library(
            |folder| {
                // Where typed names without a folder are looked up.
                let folder = folder.join(".local/share/promenade/scenes");
                std::fs::create_dir_all(&folder).unwrap();
                std::fs::write(folder.join("v.csv"), rows).unwrap();
            },
            |_| {
                let screen = Screen::new(1400, 900);
                screen.point(2, 2);
                let mut host = ClapHost::open_many(Setup { offline: false, ..setup(2) });
                open(&mut host, &screen);
                settled(&mut host, &screen);
                let click = |host: &mut ClapHost, (x, y)| {
                    screen.point(x, y);
                    (0..10).for_each(|_| play(host));
                    screen.press(1, true);
                    screen.press(1, false);
                    (0..10).for_each(|_| play(host));
                };
                let walks = |host: &mut ClapHost| {
                    play(host);
                    serde_json::from_str::<Value>(host.state()["fields"]["walks"].as_str().unwrap()).unwrap()
                };
                click(&mut host, FIELD);
                for key in KEYS {
                    screen.key(key);
                    play(&mut host);
                }
                let taken = wait_until(PATIENCE, || walks(&mut host)["1"]["name"] == "v");
                settled(&mut host, &screen).keep("source-path-typed");
                assert!(taken, "the project has {}", walks(&mut host));
                assert_eq!(walks(&mut host)["1"]["keyframes"].as_array().map(Vec::len), Some(2));
                click(&mut host, NO_PATH);
                let gone = wait_until(PATIENCE, || walks(&mut host) == json!({}));
                assert!(gone, "the project has {}", walks(&mut host));
            },
        );
    }
}
