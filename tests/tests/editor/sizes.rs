//! Windows of other sizes and scales.

use super::*;

fn the_window_is_resized<H: Host>() {
    let screen = Screen::new(1400, 900);
    let mut host = H::open(Setup::default());
    let first = open(&mut host, &screen, 1.0);
    assert!(editor(&mut host).can_resize());
    for (width, height) in [(900, 600), (1300, 800), (first.width, first.height)] {
        let given = editor(&mut host).resize(EditorSize { width, height }).expect("the editor takes a size");
        assert_eq!((given.width, given.height), (width, height));
        screen.resize(width, height);
        drawn(&mut host, &screen);
        let full = wait_until(PATIENCE, || {
            play(&mut host, &noise(512));
            !screen.picture().rgb.ends_with(&[0, 0, 0])
        });
        assert!(full, "the corner at {width} x {height} is black");
    }
    let least = editor(&mut host).resize(EditorSize { width: 10, height: 10 }).expect("the editor takes a size");
    assert!(least.width >= 400 && least.height >= 300, "{least:?}");
    // The size comes back with the project.
    editor(&mut host).resize(EditorSize { width: 940, height: 640 }).expect("the editor takes a size");
    screen.resize(940, 640);
    drawn(&mut host, &screen);
    let state = host.save();
    let mut other = H::open(Setup::default());
    assert!(other.load(&state));
    drop(host);
    let size = open(&mut other, &screen, 1.0);
    assert_eq!((size.width, size.height), (940, 640));
}

/// An editor is drawn to the corners of its window, and everything in it is larger, at each scale that a host names before it
/// opens the editor or while it is open.
fn an_editor_fills_its_window_at_every_scale<H: Host>() {
    let screen = Screen::new(1500, 1000);
    let (width, height) = (720, 480);
    let state = H::open(Setup::default()).state();
    let small = edit_state(&state, "editor", &json!({ "width": f64::from(width), "height": f64::from(height) }));
    let scaled = |points: u32, scale: f64| (f64::from(points) * scale).round() as u32;
    // Where the first panel ends, points; nothing as long as a corner is not drawn.
    let border = |picture: &Picture, scale: f64| {
        let (right, low) = (scaled(width, scale) - 2, scaled(height, scale) - 2);
        let pixel = |x: u32, y: u32| &picture.rgb[3 * (y * picture.width + x) as usize..][..3];
        let all = [(1, 1), (right, 1), (1, low), (right, low)].iter().all(|(x, y)| pixel(*x, *y) != [0, 0, 0]);
        let row = low + 2 - scaled(4, scale);
        let end = (0..right).find(|x| pixel(*x, row) != pixel(0, row)).filter(|_| all)?;
        Some(f64::from(end) / scale)
    };
    let fits = |size: EditorSize, scale: f64| {
        assert_eq!((size.width, size.height), (scaled(width, scale), scaled(height, scale)), "at scale {scale}");
        screen.resize(size.width, size.height);
    };
    let mut host = H::open(Setup::default());
    assert!(host.load(&small));
    fits(open(&mut host, &screen, 1.0), 1.0);
    let usual = border(&drawn(&mut host, &screen), 1.0).expect("there are two panels");
    drop(host);
    // A window that still shows the scale before stands as still as one that is drawn: what counts is where the panel ends.
    let fills = |host: &mut H, size: EditorSize, scale: f64| {
        fits(size, scale);
        let mut end = None;
        let filled = wait_until(PATIENCE, || {
            (0..4).for_each(|_| play(host, &noise(512)));
            end = border(&screen.picture(), scale);
            end.is_some_and(|end| (end - usual).abs() < 2.0)
        });
        screen.picture().keep(&format!("scale-{scale}-{:?}", H::FORMAT).to_lowercase());
        assert!(filled, "at scale {scale} the panel ends at {end:?} points, and at {usual} at 1");
    };
    for scale in [1.25, 1.5, 2.0] {
        let mut host = H::open(Setup::default());
        assert!(host.load(&small));
        let size = open(&mut host, &screen, scale);
        fills(&mut host, size, scale);
        for other in [2.0, 1.0, 1.5] {
            let size = editor(&mut host).rescale(other).expect("the editor has a size");
            fills(&mut host, size, other);
        }
        // And opened again.
        editor(&mut host).close().expect("the editor closes");
        let size = open(&mut host, &screen, 1.25);
        fills(&mut host, size, 1.25);
    }
}

/// Scale and theme are the user's: another window that is opened brings them, and an open one asks its host for room.
fn a_larger_scale_asks_for_a_larger_window<H: Host>() {
    in_library(
        |_| (),
        |home| {
            let screen = Screen::new(1900, 1200);
            let mut host = H::open(Setup::default());
            let size = open(&mut host, &screen, 1.0);
            assert_eq!((size.width, size.height), (1200, 760));
            drawn(&mut host, &screen);
            prefer(home, "light", 1.5);
            // Hosts ask for the size of the next window before they open it.
            let mut other = H::open(Setup::default());
            let next = editor(&mut other).open(screen.window(), 1.0).expect("the editor opens");
            editor(&mut other).close().expect("the editor closes");
            assert_eq!((next.width, next.height), (1800, 1140));
            let mut asked = None;
            let grows = wait_until(PATIENCE, || {
                (0..4).for_each(|_| play(&mut host, &noise(512)));
                asked = editor(&mut host).take_resize_request().or(asked);
                asked.is_some_and(|asked| (asked.width, asked.height) == (1800, 1140))
            });
            assert!(grows, "the host is asked for {asked:?}");
        },
    );
}

mod needs_screen {
    use super::*;

    in_both_formats!(
        #[ignore = "needs a screen"]
        the_window_is_resized,
        an_editor_fills_its_window_at_every_scale,
        a_larger_scale_asks_for_a_larger_window,
    );
}
