//! What is done in the editor reaches the host and the project.

use super::*;

fn a_drag_writes_automation<H: Host>() {
    let screen = Screen::new(1400, 900);
    let input = noise(512);
    let mut host = H::open(Setup::default());
    open(&mut host, &screen, 1.0);
    // A drag from anywhere else would move the view, and the listener with it.
    let (x, y) = find_listener(&mut host, &screen);
    host.instance().take_edits();
    let before = host.value("x");
    let mut written = String::new();
    let mut hears = |host: &mut H, wanted: &dyn Fn(&str) -> bool| {
        let heard = wait_until(PATIENCE, || {
            play(host, &input);
            written += &gestures(host, "x");
            wanted(&written)
        });
        assert!(heard, "from {x}, {y} the host hears {written:?}");
        written.clone()
    };
    screen.point(x, y);
    screen.press(1, true);
    for step in 1..=20_i16 {
        screen.point(x + 2 * step, y + 3 * step);
        play(&mut host, &input);
    }
    // However rarely a busy machine draws, each place in turn is seen.
    hears(&mut host, &|written| written.contains('v'));
    screen.point(x + 60, y + 90);
    hears(&mut host, &|written| written.matches('v').count() > 1);
    screen.press(1, false);
    let written = hears(&mut host, &|written| written.ends_with(')'));
    assert!(written.starts_with("(v") && written.ends_with("v)"), "{written}");
    assert!(written.trim_matches(['(', ')']).chars().all(|c| c == 'v'), "one gesture, several values: {written}");
    assert!((host.value("x") - before).abs() > 1e-4, "the listener has not moved");
}

/// Whatever has come into the library since its list was made.
fn the_scene_that_is_clicked_is_played<H: Host>() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes");
    let copy = |folder: &Path, from: &str, to: &str| {
        std::fs::copy(scenes.join(from).with_extension("promenade"), folder.join(to).with_extension("promenade")).unwrap();
    };
    let fill = |folder: &Path| {
        copy(folder, "iosr-room-a", "020");
        copy(folder, "iosr-room-b", "030");
    };
    in_library(fill, |folder| {
        let screen = Screen::new(1400, 900);
        let mut host = H::open(Setup::default());
        open(&mut host, &screen, 1.0);
        drawn(&mut host, &screen);
        copy(folder, "box", "010");
        let input = noise(512);
        let (mut played, mut marked) = (Vec::new(), Vec::new());
        // Down the list of scenes, closer than its lines are.
        for y in (140..500).step_by(20) {
            screen.point(100, y);
            (0..4).for_each(|_| play(&mut host, &input));
            screen.press(1, true);
            (0..4).for_each(|_| play(&mut host, &input));
            screen.press(1, false);
            (0..12).for_each(|_| play(&mut host, &input));
            host.instance().settle().expect("the plugin settles");
            let state = host.state();
            let scene: Value = serde_json::from_str(state["fields"]["scene"].as_str().unwrap()).unwrap();
            let file = Path::new(scene["absolute"].as_str().unwrap()).file_stem().map(|stem| stem.to_owned());
            if let Some(file) = file.filter(|file| played.last() != Some(file)) {
                // The line has its mark at the left, which no other line has.
                (0..12).for_each(|_| play(&mut host, &input));
                let picture = screen.picture();
                let pixel = |y: i16| {
                    let at = 3 * (usize::try_from(y).unwrap() * picture.width as usize + 13);
                    picture.rgb[at..at + 3].to_vec()
                };
                marked.push((-20..=20).any(|off| pixel(y + off) != pixel(500)));
                played.push(file);
            }
        }
        assert_eq!(played, ["020", "030"]);
        assert_eq!(marked, [true, true], "what is played is not marked");
    });
}

/// A step that was made in one window is taken back in the next.
fn undo_survives_the_closing_of_the_window<H: Host>() {
    /// Keys of the X server: Control, and Z.
    const UNDO: [u8; 2] = [37, 52];
    let screen = Screen::new(1400, 900);
    let input = noise(512);
    let mut host = H::open(Setup::default());
    open(&mut host, &screen, 1.0);
    let (x, y) = find_listener(&mut host, &screen);
    host.set("yaw", 0.5);
    (0..20).for_each(|_| play(&mut host, &input));
    let before = host.value("x");
    let moved = wait_until(GREAT_PATIENCE, || {
        screen.point(x, y);
        screen.press(1, true);
        for step in 1..=20_i16 {
            screen.point(x + step, y + 3 * step);
            play(&mut host, &input);
        }
        screen.press(1, false);
        (0..40).for_each(|_| play(&mut host, &input));
        (host.value("x") - before).abs() > 1e-3
    });
    assert!(moved, "the listener has not moved");
    editor(&mut host).close().expect("the editor closes");
    open(&mut host, &screen, 1.0);
    drawn(&mut host, &screen);
    screen.point(600, 300);
    let undone = wait_until(GREAT_PATIENCE, || {
        screen.chord(&UNDO);
        (0..20).for_each(|_| play(&mut host, &input));
        (host.value("x") - before).abs() < 1e-6
    });
    assert!(undone, "x is {}, and was {before}", host.value("x"));
}

/// A file manager's scene, head, path and preset, dropped onto the view.
fn dropped_files_are_taken<H: Host>() {
    let presets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets");
    let fill = |folder: &Path| {
        std::fs::create_dir(folder.join("My files")).unwrap();
        std::fs::copy(presets.join("library/club.promenade"), folder.join("My files/club.promenade")).unwrap();
    };
    in_library(fill, |home| {
        let screen = Screen::new(1400, 900);
        let mut host = H::open(Setup::default());
        open(&mut host, &screen, 1.0);
        drawn(&mut host, &screen);
        let field = |host: &mut H, name: &str| {
            (0..20).for_each(|_| play(host, &noise(512)));
            serde_json::from_str::<Value>(host.state()["fields"][name].as_str().unwrap()).unwrap()
        };
        let mut scene = Value::Null;
        assert!(screen.drop_file(&home.join("My%20files/club.promenade"), 600, 300), "the scene is not taken");
        let plays = wait_until(PATIENCE, || {
            scene = field(&mut host, "scene");
            scene["absolute"].as_str().is_some_and(|file| file.ends_with("My files/club.promenade"))
        });
        assert!(plays, "{scene}");
        assert!(screen.drop_file(&presets.join("paths/loft.json"), 600, 300), "the path is not taken");
        let mut walk = Value::Null;
        let walks = wait_until(PATIENCE, || {
            walk = field(&mut host, "walk");
            walk["keyframes"].as_array().is_some_and(|keyframes| keyframes.len() > 10)
        });
        assert!(walks, "{walk}");
    });
}

fn what_osc_sets_is_told_to_the_host<H: Host>() {
    let screen = Screen::new(1400, 900);
    let socket = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let free = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let input = noise(512);
    let mut host = H::open(Setup::default());
    let state = host.state();
    assert!(host.load(&edit_state(&state, "osc", &json!({ "on": true, "port": free }))));
    open(&mut host, &screen, 1.0);
    drawn(&mut host, &screen);
    // "/promenade/param/gain" with one float of -12 dB.
    let mut packet = b"/promenade/param/gain\0\0\0,f\0\0".to_vec();
    packet.extend((-12.0_f32).to_be_bytes());
    let mut heard = String::new();
    let told = wait_until(PATIENCE, || {
        socket.send_to(&packet, ("127.0.0.1", free)).unwrap();
        (0..4).for_each(|_| play(&mut host, &input));
        heard += &gestures(&mut host, "gain");
        heard.contains("(v")
    });
    assert!(told, "the host hears {heard:?}");
    // -60 to 12 dB; the value may come with a later block than the gesture.
    let arrived = wait_until(PATIENCE, || {
        play(&mut host, &input);
        (host.value("gain") - 48.0 / 72.0).abs() < 1e-3
    });
    assert!(arrived, "{}", host.value("gain"));
}

mod needs_screen {
    use super::*;

    in_both_formats!(
        #[ignore = "needs a screen"]
        a_drag_writes_automation,
        the_scene_that_is_clicked_is_played,
        undo_survives_the_closing_of_the_window,
        dropped_files_are_taken,
        what_osc_sets_is_told_to_the_host,
    );
}
