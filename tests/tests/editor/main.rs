//! The editor in a host's window: what it shows, what it writes, and that it leaves nothing behind.
//!
//! `cargo xtask test` brings a screen and runs them.

mod edits;
mod openings;
mod pictures;
mod sizes;

use promenade_host::{EditKind, Editor, EditorSize};
use promenade_tests::screen::{Picture, Screen, wait_until};
use promenade_tests::signal::noise;
use promenade_tests::{Format, Host, Setup, edit_state, host_id, in_both_formats, in_library};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// A pleasant while for a window to come up on a slow machine.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long a machine that others keep busy may take for a window; nothing but a failure waits for that.
const GREAT_PATIENCE: Duration = Duration::from_secs(120);
/// An editor that shows something has more colours than this; a blank one has one.
const COLOURS: usize = 40;

fn editor<H: Host>(host: &mut H) -> &mut dyn Editor {
    host.instance().editor().expect("there is an editor")
}

fn open<H: Host>(host: &mut H, screen: &Screen, scale: f64) -> EditorSize {
    let editor = editor(host);
    let size = editor.open(screen.window(), scale).expect("the editor opens");
    editor.show().expect("the editor is shown");
    screen.resize(size.width, size.height);
    size
}

/// Plays a block as fast as it is played live, and serves the editor.
fn play<H: Host>(host: &mut H, input: &[f32]) {
    host.process(&[&input[..512], &input[..512]]);
    host.instance().serve().expect("the plugin is served");
    std::thread::sleep(Duration::from_millis(10));
}

/// Waits until the window shows the editor and nothing moves in it.
fn drawn<H: Host>(host: &mut H, screen: &Screen) -> Picture {
    let input = noise(512);
    let mut last = screen.picture();
    let mut still = 0;
    let shown = wait_until(PATIENCE, || {
        (0..4).for_each(|_| play(host, &input));
        let now = screen.picture();
        still = if now == last { still + 1 } else { 0 };
        last = now;
        last.colours(COLOURS) == COLOURS && still >= 3
    });
    // Meters may go on moving; a blank window may not go on being one.
    assert!(shown || last.colours(COLOURS) == COLOURS, "the editor shows {} colours", last.colours(COLOURS));
    last
}

/// How the user wants editors to look, in the home that is a folder.
fn prefer(home: &Path, theme: &str, scale: f64) {
    let folder = home.join(".config/promenade");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("editor.json"), json!({ "theme": theme, "scale": scale }).to_string()).unwrap();
}

/// What the host is told of a parameter, in order: `(`, values as `v`, `)`.
fn gestures<H: Host>(host: &mut H, id: &str) -> String {
    let id = host_id(id);
    let edits = host.instance().take_edits();
    let letter = |kind| match kind {
        EditKind::Begin => '(',
        EditKind::Value(_) => 'v',
        EditKind::End => ')',
    };
    edits.into_iter().filter(|edit| edit.id == id).map(|edit| letter(edit.kind)).collect()
}

/// The middle of the window, where nothing but the place is shown: red, green and blue by row and column, and where it begins.
fn place(screen: &Screen) -> (Vec<Vec<[u8; 3]>>, (usize, usize)) {
    let picture = screen.picture();
    let (width, height) = (picture.width as usize, picture.height as usize);
    let pixel = |x: usize, y: usize| std::array::from_fn(|channel| picture.rgb[3 * (y * width + x) + channel]);
    let rows = height / 8..height / 2 + height / 8;
    (rows.clone().map(|y| (width / 3..2 * width / 3).map(|x| pixel(x, y)).collect()).collect(), (width / 3, rows.start))
}

/// Where the listener is drawn, pixels: what changes in the view when the head turns.
fn find_listener<H: Host>(host: &mut H, screen: &Screen) -> (i16, i16) {
    let input = noise(512);
    screen.point(2, 2);
    drawn(host, screen);
    let (ahead, (left, top)) = place(screen);
    host.set("yaw", 1.0);
    let (mut behind, mut still) = (ahead.clone(), 0);
    let turned = wait_until(PATIENCE, || {
        (0..4).for_each(|_| play(host, &input));
        let now = place(screen).0;
        still = if now == behind { still + 1 } else { 0 };
        behind = now;
        behind != ahead && still >= 3
    });
    assert!(turned, "the head is not seen to turn");
    let rows = ahead.iter().zip(&behind).enumerate();
    let changed = rows.flat_map(|(y, (before, after))| {
        before
            .iter()
            .zip(after)
            .enumerate()
            .filter(|(_, (before, after))| before != after)
            .map(move |(x, _)| (left + x, top + y))
    });
    let (mut low, mut high) = ((usize::MAX, usize::MAX), (0, 0));
    for (x, y) in changed {
        (low, high) = ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)));
    }
    let middle = |low: usize, high: usize| i16::try_from(low.midpoint(high)).unwrap();
    (middle(low.0, high.0), middle(low.1, high.1))
}
