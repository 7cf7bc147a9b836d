//! Pictures of the editor, to be looked at, and what is to be seen in them.

use super::*;

/// Colour of the lowest values of a map, where what the colours mean is said.
const LOWEST_OF_THE_MAP: [u8; 3] = [68, 1, 84];

mod needs_screen {
    use super::*;

    /// A picture of each view and panel, from the CLAP.
    #[test]
    #[ignore = "needs a screen"]
    fn pictures_of_every_view() {
        let screen = Screen::new(1400, 900);
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes");
        let fill = |folder: &Path| {
            std::fs::copy(scenes.join("box.promenade"), folder.join("box.promenade")).unwrap();
            let loft = scenes.join("../library/l-shaped-loft.promenade");
            std::fs::copy(loft, folder.join("loft.promenade")).unwrap();
        };
        in_library(fill, |home| {
            let walk: Value = serde_json::from_slice(&std::fs::read(scenes.join("../paths/walk.json")).unwrap()).unwrap();
            let kept = json!({ "keyframes": walk, "speed": 1.0, "looping": true, "slot": 0 });
            for (name, boxed, settings) in [
                ("top-dark", true, json!({ "view": "top", "tab": "Direct sound" })),
                ("top-light", false, json!({ "view": "top", "tab": "Direct sound" })),
                ("orbit-dark", true, json!({ "view": "orbit", "tab": "Direct sound" })),
                ("orbit-light", true, json!({ "view": "orbit", "tab": "Path" })),
                ("top-simulated", false, json!({ "tab": "Response" })),
                ("map", false, json!({ "tab": "Response", "map": "level" })),
                ("map-light", false, json!({ "tab": "Response", "map": "c50" })),
                ("panel-response", false, json!({ "tab": "Response" })),
                ("panel-sound", false, json!({ "tab": "Sound" })),
                ("panel-path", false, json!({ "tab": "Path" })),
                ("panel-osc", false, json!({ "tab": "OSC and group" })),
                ("panel-quality", false, json!({ "tab": "Quality" })),
                ("smallest", false, json!({ "width": 720.0, "height": 480.0 })),
                ("smallest-response", false, json!({ "width": 720.0, "height": 480.0, "tab": "Response" })),
                ("larger-response", false, json!({ "width": 900.0, "height": 590.0, "tab": "Response" })),
            ] {
                let theme = if name.ends_with("light") { "light" } else { "dark" };
                prefer(home, theme, if name.starts_with("larger") { 1.5 } else { 1.0 });
                let mut host = <promenade_tests::ClapHost as Host>::open(Setup::default());
                let state = host.state();
                let state = serde_json::from_slice(&edit_state(&state, "editor", &settings)).unwrap();
                assert!(host.load(&edit_state(&state, "walk", &kept)));
                let (scene, slot) = match name {
                    "top-simulated" | "map" | "map-light" => (1.0, 2.0 / 64.0),
                    _ if boxed => (1.0, 1.0 / 64.0),
                    _ => (0.5, 0.0),
                };
                host.set("scene", scene);
                host.set("slot", slot);
                host.set("yaw", 0.57);
                open(&mut host, &screen, 1.0);
                let mut picture = drawn(&mut host, &screen);
                if name.starts_with("map") {
                    // What the colours mean is said once there are some.
                    let measured = wait_until(GREAT_PATIENCE, || {
                        picture = drawn(&mut host, &screen);
                        !picture.places_of(LOWEST_OF_THE_MAP).is_empty()
                    });
                    assert!(measured, "{name}");
                }
                picture.keep(name);
            }
        });
    }

    /// All plugins in both themes, at scales of the user.
    #[test]
    #[ignore = "needs a screen"]
    fn pictures_at_every_scale() {
        let screen = Screen::new(1400, 900);
        in_library(
            |_| (),
            |home| {
                let views = [
                    ("one", None, "dark", 1.0),
                    ("one", None, "light", 2.0),
                    ("many", Some(15), "dark", 1.5),
                    ("many", Some(15), "light", 1.0),
                    ("many-64", Some(63), "dark", 2.0),
                    ("many-64", Some(63), "light", 1.5),
                ];
                for (plugin, further, theme, scale) in views {
                    prefer(home, theme, scale);
                    let mut host = match further {
                        None => <promenade_tests::ClapHost as Host>::open(Setup::default()),
                        Some(further) => {
                            <promenade_tests::ClapHost as Host>::open_many(Setup { inputs: 1, further, ..Setup::default() })
                        }
                    };
                    let size = open(&mut host, &screen, 1.0);
                    let wanted = ((1200.0 * scale) as u32, (760.0 * scale) as u32);
                    assert_eq!((size.width, size.height), wanted, "{plugin} at {scale}");
                    settled(&mut host, &screen, further).keep(&format!("{plugin}-{theme}-{scale}"));
                }
            },
        );
    }

    /// Three named sources in the loft, as a user has them after a minute.
    #[test]
    #[ignore = "needs a screen"]
    fn picture_of_three_sources_in_the_loft() {
        let screen = Screen::new(1400, 900);
        let mut host = <promenade_tests::ClapHost as Host>::open_many(Setup { inputs: 1, further: 2, ..Setup::default() });
        let sources = json!({
            "1": { "name": "Voice", "colour": [0xE5, 0x48, 0x5D] },
            "2": { "name": "Guitar", "colour": [0xA8, 0x80, 0x14] },
            "3": { "name": "Piano", "colour": [0x3F, 0x83, 0xE0] },
        });
        let state = host.state();
        let state = serde_json::from_slice(&edit_state(&state, "sources", &sources)).unwrap();
        let paths = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/paths/loft.json");
        let walk: Value = serde_json::from_slice(&std::fs::read(paths).unwrap()).unwrap();
        let kept = json!({ "keyframes": walk, "speed": 1.0, "looping": true, "slot": 0 });
        let state = serde_json::from_slice(&edit_state(&state, "walk", &kept)).unwrap();
        assert!(host.load(&edit_state(&state, "editor", &json!({ "tab": "Sources" }))));
        for (id, value) in [("ex", -2.5), ("ey", 1.4), ("ex2", -1.2), ("ey2", -1.8), ("ex3", -5.6), ("ey3", -6.5), ("x", -3.4)]
        {
            host.set(id, 0.5 + value / 100.0);
        }
        open(&mut host, &screen, 1.0);
        settled(&mut host, &screen, Some(2)).keep("loft-sources");
    }

    /// The picture once it has come to rest while a sound plays on each input.
    fn settled(host: &mut promenade_tests::ClapHost, screen: &Screen, further: Option<usize>) -> Picture {
        let input = noise(512);
        let soft: Vec<f32> = input.iter().map(|x| 0.2 * x).collect();
        let tracks = vec![&soft[..]; further.map_or(2, |further| 1 + further)];
        let mut picture = screen.picture();
        for _ in 0..150 {
            host.process(&tracks);
            host.instance().serve().expect("the plugin is served");
            std::thread::sleep(Duration::from_millis(10));
            picture = screen.picture();
        }
        assert!(picture.colours(COLOURS) == COLOURS, "the editor shows {} colours", picture.colours(COLOURS));
        picture
    }

    /// The response is drawn once it is worked out, the quality's figures when they are measured, and another pose has another
    /// response.
    #[test]
    #[ignore = "needs a screen"]
    fn the_response_follows_the_pose() {
        let screen = Screen::new(1400, 900);
        let mut host = <promenade_tests::ClapHost as Host>::open(Setup::default());
        let state = host.state();
        assert!(host.load(&edit_state(&state, "editor", &json!({ "tab": "Response" }))));
        open(&mut host, &screen, 1.0);
        let silence = vec![0.0; 512];
        let panel = |host: &mut promenade_tests::ClapHost| {
            (0..4).for_each(|_| play(host, &silence));
            let picture = screen.picture();
            let (width, from) = (picture.width as usize, picture.height as usize * 3 / 4);
            // Left of the controls, below the tabs.
            let row = |y: usize| picture.rgb[3 * y * width..3 * (y * width + width * 3 / 4)].to_vec();
            (from..picture.height as usize).flat_map(row).collect::<Vec<u8>>()
        };
        // How much is orange, and how much blue: both ears' curves.
        let curves = |panel: &[u8]| {
            let more = |a: usize, b: usize| panel.chunks_exact(3).filter(|p| p[a].saturating_sub(p[b]) > 90).count();
            more(0, 2).min(more(2, 0))
        };
        let mut ahead = Vec::new();
        assert!(
            wait_until(PATIENCE, || {
                ahead = panel(&mut host);
                curves(&ahead) > 300
            }),
            "no curves: {} pixels",
            curves(&ahead)
        );
        // In this scene what is behind sounds as what is ahead.
        host.set("yaw", 0.75);
        assert!(
            wait_until(PATIENCE, || {
                let turned = panel(&mut host);
                curves(&turned) > 300 && turned.chunks_exact(3).zip(ahead.chunks_exact(3)).filter(|(a, b)| a != b).count() > 300
            }),
            "another pose has the same response"
        );
        screen.picture().keep("response");
    }

    /// The drawn room from above, in 3-D and in the smallest window, from the CLAP.
    #[test]
    #[ignore = "needs a screen"]
    fn pictures_of_a_drawn_room() {
        let screen = Screen::new(1400, 900);
        for (name, settings) in [
            ("room", json!({ "view": "top", "tab": "Room" })),
            ("room-orbit", json!({ "view": "orbit", "tab": "Room" })),
            ("room-smallest", json!({ "tab": "Room", "width": 720.0, "height": 480.0 })),
        ] {
            let mut host = <promenade_tests::ClapHost as Host>::open(Setup::default());
            let mut state = host.state();
            state["params"]["scene"] = json!({ "string": "library" });
            let state = serde_json::from_slice(&edit_state(&state, "editor", &settings)).unwrap();
            assert!(host.load(&edit_state(&state, "room", &json!({}))));
            open(&mut host, &screen, 1.0);
            drawn(&mut host, &screen).keep(name);
        }
    }

    /// Times that a project has typed for its room, in a wide window and in the smallest: the walls come to absorb as much as
    /// that takes, and the project says so.
    #[test]
    #[ignore = "needs a screen"]
    fn the_walls_of_a_drawn_room_follow_its_reverberation_times() {
        let screen = Screen::new(1400, 900);
        let times = json!({ "t20_s": [0.5, 0.5, 0.4, null, 0.45, 0.4, 9.0] });
        for (name, settings) in [
            ("room-times", json!({ "view": "top", "tab": "Room" })),
            ("room-times-smallest", json!({ "tab": "Room", "width": 720.0, "height": 480.0 })),
        ] {
            let mut host = <promenade_tests::ClapHost as Host>::open(Setup::default());
            let mut state = host.state();
            state["params"]["scene"] = json!({ "string": "library" });
            let state = serde_json::from_slice(&edit_state(&state, "editor", &settings)).unwrap();
            assert!(host.load(&edit_state(&state, "room", &times)));
            open(&mut host, &screen, 1.0);
            let input = noise(512);
            let mut factors = Value::Null;
            let follows = |factors: &Value| factors[2].as_f64().is_some_and(|f| f > 1.3);
            assert!(
                wait_until(PATIENCE, || {
                    play(&mut host, &input);
                    let room = host.state()["fields"]["room"].as_str().map(str::to_owned).unwrap_or_default();
                    factors = serde_json::from_str::<Value>(&room).unwrap_or_default()["factors"].clone();
                    follows(&factors)
                }),
                "{factors}"
            );
            assert_eq!(factors[3], 1.0, "nothing was typed there");
            assert!(factors[6].as_f64().unwrap() < 0.01, "{factors}");
            drawn(&mut host, &screen).keep(name);
        }
    }
}
