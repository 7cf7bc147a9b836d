//! A window for an editor on X11, what is seen in it, and a hand on mouse and keyboard.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use x11rb::connection::{Connection, RequestConnection};
use x11rb::protocol::Event;
use x11rb::protocol::damage::{ConnectionExt as _, ReportLevel};
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ClientMessageEvent, ConfigureWindowAux, ConnectionExt as _,
    CreateWindowAux, EventMask, ImageFormat, KEY_PRESS_EVENT, KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT, PropMode,
    SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, WindowClass,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// There is one mouse: tests with windows take turns.
static TURN: Mutex<()> = Mutex::new(());

/// A window of the host.
pub struct Screen {
    x11: RustConnection,
    root: u32,
    window: u32,
    _turn: MutexGuard<'static, ()>,
}

/// What is seen.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Red, green and blue, row by row.
    pub rgb: Vec<u8>,
}

impl Screen {
    /// A window at the screen's corner. Tests that need it are ignored by default, in a module `needs_screen`.
    ///
    /// # Panics
    /// There is no screen.
    #[must_use]
    pub fn new(width: u16, height: u16) -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let (x11, number) = x11rb::connect(None).expect("the X server answers");
        let (root, depth, visual) = {
            let screen = &x11.setup().roots[number];
            (screen.root, screen.root_depth, screen.root_visual)
        };
        let window = x11.generate_id().expect("the X server has room");
        let aux = CreateWindowAux::new().event_mask(EventMask::STRUCTURE_NOTIFY);
        let made = x11.create_window(depth, window, root, 0, 0, width, height, 0, WindowClass::INPUT_OUTPUT, visual, &aux);
        made.expect("the X server listens").check().expect("there is a window");
        x11.map_window(window).expect("the X server listens").check().expect("the window is shown");
        Self { x11, root, window, _turn: turn }
    }

    /// The window's number, for an editor.
    #[must_use]
    pub fn window(&self) -> u32 {
        self.window
    }

    /// Gives the window another size.
    pub fn resize(&self, width: u32, height: u32) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.x11.configure_window(self.window, &size).expect("the X server listens").check().expect("the window has a size");
    }

    /// What is seen in the window, with everything inside it.
    #[must_use]
    pub fn picture(&self) -> Picture {
        let size = self.x11.get_geometry(self.window).expect("the X server listens").reply().expect("the window has a size");
        // From the root, because children draw over their parents.
        let cookie = self.x11.get_image(ImageFormat::Z_PIXMAP, self.root, 0, 0, size.width, size.height, u32::MAX);
        let image = cookie.expect("the X server listens").reply().expect("the window is on the screen");
        let rgb = image.data.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect();
        Picture { width: size.width.into(), height: size.height.into(), rgb }
    }

    fn fake(&self, kind: u8, detail: u8, x: i16, y: i16) {
        let sent = self.x11.xtest_fake_input(kind, detail, 0, self.root, x, y, 0);
        sent.expect("the X server listens").check().expect("the X server has a mouse");
        self.x11.flush().expect("the X server listens");
    }

    /// Begins to note what is drawn in the window, and in what is inside it.
    ///
    /// # Panics
    /// The X server does not tell.
    pub fn watch(&self) {
        let version = self.x11.damage_query_version(1, 1).expect("the X server listens").reply();
        version.expect("the X server tells what is drawn");
        let damage = self.x11.generate_id().expect("the X server has room");
        let watched = self.x11.damage_create(damage, self.window, ReportLevel::RAW_RECTANGLES);
        watched.expect("the X server listens").check().expect("what is drawn is told");
    }

    /// How many times something was drawn since the last call, after [`Screen::watch`]. A window of OpenGL draws once a
    /// picture.
    pub fn drawings(&self) -> usize {
        let next = || self.x11.poll_for_event().expect("the X server listens");
        std::iter::from_fn(next).filter(|event| matches!(event, Event::DamageNotify(_))).count()
    }

    /// Moves the mouse.
    pub fn point(&self, x: i16, y: i16) {
        self.fake(MOTION_NOTIFY_EVENT, 0, x, y);
    }

    /// Presses or releases a button: 1 left, 2 middle, 3 right, 4 wheel up, 5 wheel down.
    pub fn press(&self, button: u8, down: bool) {
        self.fake(if down { BUTTON_PRESS_EVENT } else { BUTTON_RELEASE_EVENT }, button, 0, 0);
    }

    /// Presses and releases a key by its number on the keyboard.
    pub fn key(&self, code: u8) {
        self.chord(&[code]);
    }

    /// Presses keys one after the other and releases them from the last to the first.
    pub fn chord(&self, codes: &[u8]) {
        codes.iter().for_each(|code| self.fake(KEY_PRESS_EVENT, *code, 0, 0));
        codes.iter().rev().for_each(|code| self.fake(KEY_RELEASE_EVENT, *code, 0, 0));
    }
}

/// A way into X11 as far as it is needed to drop a file.
type Dragged<T> = Result<T, Box<dyn std::error::Error>>;

impl Screen {
    /// Drops a file onto what is at a place of the window, as a file manager does (XDND): onto the deepest window there that
    /// takes files, or the one that it names in its place. Says whether it was taken.
    ///
    /// # Panics
    /// The X server does not listen.
    #[must_use]
    pub fn drop_file(&self, file: &std::path::Path, x: i16, y: i16) -> bool {
        self.dragged(file, x, y).expect("the X server listens")
    }

    fn dragged(&self, file: &std::path::Path, x: i16, y: i16) -> Dragged<bool> {
        let atom = |name: &str| Dragged::Ok(self.x11.intern_atom(false, name.as_bytes())?.reply()?.atom);
        let [aware, proxy, selection] = [atom("XdndAware")?, atom("XdndProxy")?, atom("XdndSelection")?];
        let (mut at, mut target) = (self.window, None);
        loop {
            if self.x11.get_property(false, at, aware, AtomEnum::ANY, 0, 1)?.reply()?.value_len > 0 {
                target = Some(at);
            }
            let inside = self.x11.translate_coordinates(self.root, at, x, y)?.reply()?.child;
            if inside == 0 {
                break;
            }
            at = inside;
        }
        let Some(target) = target else { return Ok(false) };
        let property = self.x11.get_property(false, target, proxy, AtomEnum::ANY, 0, 1)?.reply()?;
        let to = property.value32().and_then(|mut values| values.next()).unwrap_or(target);
        self.x11.set_selection_owner(self.window, selection, x11rb::CURRENT_TIME)?.check()?;
        let list = atom("text/uri-list")?;
        let tell = |name: &str, data: [u32; 5]| {
            let message = ClientMessageEvent::new(32, target, atom(name)?, data);
            self.x11.send_event(false, to, EventMask::NO_EVENT, message)?;
            Dragged::Ok(self.x11.flush()?)
        };
        tell("XdndEnter", [self.window, 5 << 24, list, 0, 0])?;
        let place = u32::try_from(x)? << 16 | u32::try_from(y)?;
        tell("XdndPosition", [self.window, 0, place, 0, atom("XdndActionCopy")?])?;
        tell("XdndDrop", [self.window, 0, 0, 0, 0])?;
        let (status, finished) = (atom("XdndStatus")?, atom("XdndFinished")?);
        let (mut welcome, mut taken) = (false, false);
        wait_until(Duration::from_secs(5), || {
            while let Ok(Some(event)) = self.x11.poll_for_event() {
                match event {
                    Event::ClientMessage(answer) if answer.type_ == status => welcome = answer.data.as_data32()[1] & 1 == 1,
                    Event::ClientMessage(answer) if answer.type_ == finished => taken = answer.data.as_data32()[1] & 1 == 1,
                    Event::SelectionRequest(asked) => {
                        let text = format!("file://{}\r\n", file.display());
                        let sent = SelectionNotifyEvent {
                            response_type: SELECTION_NOTIFY_EVENT,
                            sequence: 0,
                            time: asked.time,
                            requestor: asked.requestor,
                            selection: asked.selection,
                            target: asked.target,
                            property: asked.property,
                        };
                        let given = self.x11.change_property8(
                            PropMode::REPLACE,
                            asked.requestor,
                            asked.property,
                            asked.target,
                            text.as_bytes(),
                        );
                        given.expect("the X server listens");
                        let told = self.x11.send_event(false, asked.requestor, EventMask::NO_EVENT, sent);
                        told.expect("the X server listens");
                        self.x11.flush().expect("the X server listens");
                    }
                    _ => {}
                }
            }
            taken
        });
        Ok(welcome && taken)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // The server may be gone.
        if let Ok(cookie) = self.x11.destroy_window(self.window) {
            let _ = cookie.check();
        }
        let _ = self.x11.maximum_request_bytes();
    }
}

impl Picture {
    /// Number of different colours, up to `most`.
    #[must_use]
    pub fn colours(&self, most: usize) -> usize {
        let mut seen = std::collections::HashSet::new();
        for pixel in self.rgb.chunks_exact(3) {
            seen.insert((pixel[0], pixel[1], pixel[2]));
            if seen.len() >= most {
                break;
            }
        }
        seen.len()
    }

    /// Where a colour is, pixels from the upper left corner, row by row.
    #[must_use]
    pub fn places_of(&self, colour: [u8; 3]) -> Vec<(i16, i16)> {
        let pixels = self.rgb.chunks_exact(3).zip(0_u32..).filter(|(pixel, _)| **pixel == colour);
        let place = |index: u32| Some(((index % self.width).try_into().ok()?, (index / self.width).try_into().ok()?));
        pixels.filter_map(|(_, index)| place(index)).collect()
    }

    /// Keeps the picture as NAME.png in the folder that `PROMENADE_SCREENSHOTS` names, if it does.
    pub fn keep(&self, name: &str) {
        let Some(folder) = std::env::var_os("PROMENADE_SCREENSHOTS").map(PathBuf::from) else { return };
        let file =
            std::fs::File::create(folder.join(format!("{name}.png"))).expect("the folder of screenshots can be written to");
        let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().expect("a picture can be written");
        writer.write_image_data(&self.rgb).expect("a picture can be written");
    }
}

/// Calls `step` until it says that it is content, at most for a while; says whether it was.
pub fn wait_until(longest: Duration, mut step: impl FnMut() -> bool) -> bool {
    let began = Instant::now();
    while began.elapsed() < longest {
        if step() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(15));
    }
    false
}
