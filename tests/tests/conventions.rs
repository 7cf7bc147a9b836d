//! What hosts and plugins tell each other beside sound and values: modules, pages of remote controls, names instead of numbers,
//! the host's menu, its marks and its tracks.

use promenade_host::{AutomationMark, Mark, MenuAction, Track};
use promenade_tests::screen::{Picture, Screen, wait_until};
use promenade_tests::{ClapHost, Host, Setup, Vst3, edit_state, host_id, in_both_formats, in_library};
use serde_json::json;
use std::fs;
use std::path::Path;
use std::time::Duration;

in_both_formats!(slots_have_the_names_of_their_files, values_are_taken_as_they_are_typed);

/// A pleasant while for a window to come up on a slow machine.
const PATIENCE: Duration = Duration::from_secs(20);

#[test]
fn parameters_are_in_modules_and_angles_go_round() {
    let mut host = ClapHost::open(Setup::default());
    let all = host.instance().parameters().to_vec();
    let of = |id: &str| all.iter().find(|p| p.id == host_id(id)).unwrap();
    let modules = ["x", "roll", "path", "ex", "lead", "gain", "slot", "osc"].map(|id| of(id).module.clone());
    assert_eq!(modules, ["Pose", "Pose", "Path", "Emitter", "Group", "Sound", "Scene", "Remote"]);
    assert!(all.iter().all(|p| !p.module.is_empty()), "{all:?}");
    let periodic: Vec<_> = all.iter().filter(|p| p.periodic).map(|p| p.name.as_str()).collect();
    assert_eq!(periodic, ["Yaw", "Roll", "Source Azimuth"]);
}

#[test]
fn remote_controls_have_every_parameter_on_a_page() {
    let mut host = ClapHost::open(Setup::default());
    let pages = host.instance().remote_pages();
    let named = |name: &str| pages.iter().find(|page| page.name.starts_with(name)).unwrap_or_else(|| panic!("{pages:?}"));
    let on = |name: &str| named(name).parameters.into_iter().flatten().collect::<Vec<_>>();
    assert_eq!(on("Pose"), ["x", "y", "z", "tracking", "yaw", "pitch", "roll"].map(host_id));
    assert_eq!(on("Path"), ["path", "follow", "offset", "walk", "osc"].map(host_id));
    assert_eq!(on("Offset"), ["ex", "ey", "ez", "spread", "group", "lead", "scene", "slot"].map(host_id));
    assert!(
        ["mix", "gain"]
            .iter()
            .all(|id| pages.iter().any(|p| p.name.starts_with("Sound") && p.parameters.contains(&Some(host_id(id)))))
    );
    // But the one that only the editor moves.
    for parameter in host.instance().parameters().to_vec() {
        let count = pages.iter().flat_map(|page| page.parameters).filter(|knob| *knob == Some(parameter.id)).count();
        assert_eq!(count, usize::from(parameter.name != "Revision"), "{}", parameter.name);
    }
    assert!(Vst3::open(Setup::default()).instance().remote_pages().is_empty());
}

fn values_are_taken_as_they_are_typed<H: Host>() {
    let mut host = H::open(Setup::default());
    let mut share = |id, text| host.instance().from_text(host_id(id), text);
    for (id, text, value) in [
        ("gain", "-6dB", 54.0 / 72.0),
        ("x", "2m", 52.0 / 100.0),
        ("rate", "0.05k", 45.0 / 95.0),
        ("pitch", "30°", 120.0 / 180.0),
        ("yaw", "370", 190.0 / 360.0),
    ] {
        let taken = share(id, text).unwrap();
        assert!((taken - value).abs() < 1e-5, "{text} is {taken} of {id}");
    }
    assert!(share("gain", "nan").is_err());
}

fn slots_have_the_names_of_their_files<H: Host>() {
    let fill = |folder: &Path| {
        for name in ["attic", "hall"] {
            let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes/iosr-room-a.promenade");
            fs::copy(scene, folder.join(format!("{name}.promenade"))).unwrap();
        }
    };
    in_library(fill, |_| {
        let mut host = H::open(Setup::default());
        let slot = host_id("slot");
        let texts = [0.0, 1.0, 2.0, 3.0].map(|n| host.instance().text(slot, n / 64.0).unwrap());
        assert_eq!(texts, ["Project's scene", "attic", "hall", "Empty slot 3"]);
        let value = |host: &mut H, text: &str| (host.instance().from_text(slot, text).unwrap() * 64.0).round();
        assert_eq!((value(&mut host, "Hall"), value(&mut host, "2"), value(&mut host, "64")), (2.0, 2.0, 64.0));
        assert!(host.instance().from_text(slot, "cellar").is_err());
    });
}

/// Opens the editor in a window.
fn open(host: &mut ClapHost, screen: &Screen) {
    let editor = host.instance().editor().unwrap();
    let size = editor.open(screen.window(), 1.0).unwrap();
    editor.show().unwrap();
    screen.resize(size.width, size.height);
}

/// Plays and serves until the picture is as wanted; fails when it never is.
fn shown<R>(host: &mut ClapHost, screen: &Screen, what: &str, mut wanted: impl FnMut(&Picture) -> Option<R>) -> R {
    let mut found = None;
    wait_until(PATIENCE, || {
        host.process(&[&[0.0; 512], &[0.0; 512]]);
        host.instance().serve().unwrap();
        found = wanted(&screen.picture());
        found.is_some()
    });
    found.unwrap_or_else(|| {
        screen.picture().keep("conventions-failed");
        panic!("{what} is not seen")
    })
}

mod needs_screen {
    use super::*;

    #[test]
    #[ignore = "needs a screen"]
    fn the_hosts_menu_and_marks_are_on_the_controls() {
        const MAPPED: [u8; 3] = [255, 0, 254];
        const WRITTEN: [u8; 3] = [0, 255, 253];
        let screen = Screen::new(1400, 900);
        let mut host = ClapHost::open(Setup::default());
        let gain = host_id("gain");
        let mapping = Some(("CC 7".to_owned(), "Knob 1".to_owned(), MAPPED));
        host.instance().mark(gain, &Mark::Mapping(mapping)).unwrap();
        host.instance().mark(gain, &Mark::Automation(AutomationMark::Recording, Some(WRITTEN))).unwrap();
        open(&mut host, &screen);
        shown(&mut host, &screen, "the line of automation", |picture| picture.places_of(WRITTEN).first().copied());
        // The control's slider and its number have one each; the number's is the last.
        let (x, y) = shown(&mut host, &screen, "the dot of the mapping", |picture| picture.places_of(MAPPED).first().copied());
        screen.picture().keep("marks");
        let mut chosen = Vec::new();
        // The menu opens above, at the window's lower edge: its lines one after the other, until it is the first of the host's.
        for above in (40..136).rev().step_by(8) {
            screen.point(x - 20, y + 4);
            for down in [true, false] {
                screen.press(3, down);
            }
            let before = screen.picture();
            shown(&mut host, &screen, "the menu", |picture| (*picture != before).then_some(()));
            // The host's lines come with the next pictures.
            (0..12).for_each(|_| {
                host.instance().serve().unwrap();
                std::thread::sleep(Duration::from_millis(20));
            });
            if above == 135 {
                screen.picture().keep("host-menu");
            }
            screen.point(x - 60, y + 4 - above);
            (0..4).for_each(|_| {
                host.instance().serve().unwrap();
                std::thread::sleep(Duration::from_millis(20));
            });
            for down in [true, false] {
                screen.press(1, down);
                std::thread::sleep(Duration::from_millis(40));
            }
            wait_until(Duration::from_millis(300), || {
                host.instance().serve().unwrap();
                chosen = host.instance().take_chosen();
                !chosen.is_empty()
            });
            if !chosen.is_empty() {
                break;
            }
            // Closes what is still open.
            screen.point(300, 300);
            for down in [true, false] {
                screen.press(3, down);
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        assert_eq!(chosen, [(gain, MenuAction::ShowAutomation)]);
        // Taken away, they are gone.
        host.instance().mark(gain, &Mark::Mapping(None)).unwrap();
        host.instance().mark(gain, &Mark::Automation(AutomationMark::None, None)).unwrap();
        shown(&mut host, &screen, "a control without marks", |picture| {
            (picture.places_of(MAPPED).is_empty() && picture.places_of(WRITTEN).is_empty()).then_some(())
        });
    }

    #[test]
    #[ignore = "needs a screen"]
    fn a_group_lists_the_tracks_of_its_instances() {
        const VIOLIN: [u8; 3] = [255, 1, 200];
        const CHOIR: [u8; 3] = [1, 255, 200];
        let screen = Screen::new(1400, 900);
        let mut violin = ClapHost::open(Setup::default());
        let mut choir = ClapHost::open(Setup::default());
        for (host, name, colour) in [(&mut violin, "Violin", VIOLIN), (&mut choir, "Choir", CHOIR)] {
            host.instance().set_track(Track { name: name.to_owned(), colour }).unwrap();
            let state = host.state();
            assert!(host.load(&edit_state(&state, "editor", &json!({ "tab": "OSC and group" }))));
            host.set("group", 0.25);
            host.process(&[&[0.0; 512], &[0.0; 512]]);
        }
        open(&mut violin, &screen);
        shown(&mut violin, &screen, "the tracks of the group", |picture| {
            [VIOLIN, CHOIR].iter().all(|colour| !picture.places_of(*colour).is_empty()).then_some(())
        });
        screen.picture().keep("group");
        drop(choir);
        shown(&mut violin, &screen, "the end of a member", |picture| picture.places_of(CHOIR).is_empty().then_some(()));
    }
}
