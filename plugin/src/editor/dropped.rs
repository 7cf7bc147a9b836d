//! Files that are dropped onto the window: scenes, heads, headphones, camera paths and presets.
//!
//! The window library is told of them, and its toolkit drops them. On X11 a window may name another in its place as the one
//! that dragged files are offered to ("Drag-and-Drop Protocol for the X Window System", version 5, "XdndProxy"), which is done
//! here. On other systems nothing can be dropped.

use super::{ctx::Ctx, path_panel, presets::Presets, scenes::Scenes};
use crate::history::presets::EXTENSION;
use crate::library::{SCENES, WALKS};
use std::path::Path;

/// Takes a file for what its name says that it is.
///
/// # Errors
/// It is none of these, or cannot be read.
pub(super) fn take(ctx: &mut Ctx<'_>, scenes: &mut Scenes, presets: &mut Presets, file: &Path) -> Result<(), String> {
    let exchange = &ctx.instance.loader.exchange;
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let name = file.display();
    match ending.as_str() {
        scene if SCENES.contains(&scene) => return scenes.open_file(ctx, file),
        EXTENSION => return presets.load_file(ctx, file),
        walk if WALKS.contains(&walk) => {
            let walk = path_panel::read(file)?.0;
            ctx.undoable(|ctx| path_panel::take(ctx, walk));
            return Ok(());
        }
        "sofa" => exchange.head_wish.ask(&name.to_string()),
        "txt" => exchange.headphones_wish.ask(&name.to_string()),
        _ => {
            let kinds = "a scene (.promenade), a head (.sofa), headphones (.txt), a camera path or a preset";
            return Err(format!("{name}: expected {kinds}, found .{ending}"));
        }
    }
    ctx.refresh();
    Ok(())
}

#[cfg(target_os = "linux")]
pub(super) use x11::DropTarget;

/// Receives nothing.
#[cfg(not(target_os = "linux"))]
pub(super) struct DropTarget;

#[cfg(not(target_os = "linux"))]
impl DropTarget {
    pub(super) fn new(_: &nice_plug_egui::baseview::WindowContext, _: crate::worker::repaint::Repaint) -> Option<Self> {
        None
    }

    pub(super) fn files(&self) -> Vec<std::path::PathBuf> {
        Vec::new()
    }
}

#[cfg(target_os = "linux")]
mod x11 {
    use crate::editor::mapping::number;
    use crate::worker::repaint::Repaint;
    use nice_plug_egui::baseview::WindowContext;
    use std::error::Error;
    use std::ffi::OsString;
    use std::os::unix::ffi::OsStringExt;
    use std::path::PathBuf;
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::thread::JoinHandle;
    use x11rb::connection::Connection;
    use x11rb::protocol::Event;
    use x11rb::protocol::xproto::{
        Atom, AtomEnum, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode, WindowClass,
    };
    use x11rb::rust_connection::RustConnection;
    use x11rb::wrapper::ConnectionExt as _;

    /// Bytes of a list of files, in units of four.
    const LONGEST_LIST: u32 = 1 << 18;

    /// What messages and properties are called.
    struct Atoms {
        proxy: Atom,
        position: Atom,
        status: Atom,
        dropped: Atom,
        finished: Atom,
        selection: Atom,
        copy: Atom,
        list: Atom,
    }

    impl Atoms {
        fn of(x11: &RustConnection) -> Result<Self, Box<dyn Error>> {
            let atom = |name: &str| Ok::<_, Box<dyn Error>>(x11.intern_atom(false, name.as_bytes())?.reply()?.atom);
            Ok(Self {
                proxy: atom("XdndProxy")?,
                position: atom("XdndPosition")?,
                status: atom("XdndStatus")?,
                dropped: atom("XdndDrop")?,
                finished: atom("XdndFinished")?,
                selection: atom("XdndSelection")?,
                copy: atom("XdndActionCopy")?,
                list: atom("text/uri-list")?,
            })
        }
    }

    /// The window in whose place files are offered to another, and the files that were dropped.
    pub(in crate::editor) struct DropTarget {
        x11: Arc<RustConnection>,
        proxy: u32,
        files: Receiver<PathBuf>,
        thread: Option<JoinHandle<()>>,
    }

    impl DropTarget {
        /// Has files dropped onto a window, until it is dropped itself; `repaint` is asked for a picture for each.
        pub(in crate::editor) fn new(window: &WindowContext, repaint: Repaint) -> Option<Self> {
            let made = Self::made(number(window)?, repaint);
            made.inspect_err(|error| nice_plug::nice_warn!("no file can be dropped onto the editor: {error}")).ok()
        }

        fn made(window: u32, repaint: Repaint) -> Result<Self, Box<dyn Error>> {
            let (x11, screen) = x11rb::connect(None)?;
            let (x11, root) = (Arc::new(x11), screen);
            let root = x11.setup().roots.get(root).ok_or("no screen")?.root;
            let atoms = Atoms::of(&x11)?;
            let proxy = x11.generate_id()?;
            let aux = CreateWindowAux::new().event_mask(EventMask::STRUCTURE_NOTIFY);
            x11.create_window(0, proxy, root, -1, -1, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &aux)?.check()?;
            for place in [proxy, window] {
                x11.change_property32(PropMode::REPLACE, place, atoms.proxy, AtomEnum::WINDOW, &[proxy])?.check()?;
            }
            let (tell, files) = channel();
            let theirs = Arc::clone(&x11);
            let serve = move || {
                // The server may be gone before the window.
                let _ended = serve(&theirs, proxy, &atoms, &tell, &repaint);
            };
            let thread = std::thread::Builder::new().name("promenade-drop".to_owned()).spawn(serve)?;
            Ok(Self { x11, proxy, files, thread: Some(thread) })
        }

        /// What was dropped since the last call.
        pub(in crate::editor) fn files(&self) -> Vec<PathBuf> {
            self.files.try_iter().collect()
        }
    }

    impl Drop for DropTarget {
        fn drop(&mut self) {
            let told = self.x11.destroy_window(self.proxy).is_ok() && self.x11.flush().is_ok();
            if let Some(thread) = self.thread.take().filter(|_| told) {
                let _ended = thread.join();
            }
        }
    }

    /// Answers those who drag, until the window is gone.
    fn serve(
        x11: &RustConnection,
        proxy: u32,
        atoms: &Atoms,
        tell: &Sender<PathBuf>,
        repaint: &Repaint,
    ) -> Result<(), Box<dyn Error>> {
        let (mut source, mut target) = (0, 0);
        loop {
            let answer = |source: u32, kind: Atom, data: [u32; 5]| {
                let message = ClientMessageEvent::new(32, source, kind, data);
                x11.send_event(false, source, EventMask::NO_EVENT, message).map(drop)
            };
            match x11.wait_for_event()? {
                Event::DestroyNotify(gone) if gone.window == proxy => return Ok(()),
                Event::ClientMessage(message) => {
                    let data = message.data.as_data32();
                    (source, target) = (data[0], message.window);
                    if message.type_ == atoms.position {
                        answer(source, atoms.status, [target, 1, 0, 0, atoms.copy])?;
                    } else if message.type_ == atoms.dropped {
                        x11.convert_selection(proxy, atoms.selection, atoms.list, atoms.selection, data[2])?;
                    }
                }
                Event::SelectionNotify(sent) => {
                    let list = x11.get_property(true, proxy, sent.property, AtomEnum::ANY, 0, LONGEST_LIST)?.reply();
                    let list = list.map(|list| list.value).unwrap_or_default();
                    for file in files_in(&list) {
                        tell.send(file)?;
                    }
                    repaint.request_repaint();
                    answer(source, atoms.finished, [target, 1, atoms.copy, 0, 0])?;
                }
                _ => {}
            }
            x11.flush()?;
        }
    }

    /// The files of this machine in a list of addresses (RFC 2483).
    fn files_in(list: &[u8]) -> Vec<PathBuf> {
        let lines = list.split(|byte| matches!(byte, b'\r' | b'\n'));
        let path = |line: &[u8]| {
            let address = line.strip_prefix(b"file://")?;
            let start = address.iter().position(|byte| *byte == b'/')?;
            Some(PathBuf::from(OsString::from_vec(decoded(&address[start..]))))
        };
        lines.filter_map(path).collect()
    }

    /// An address without its per cent signs (RFC 3986).
    fn decoded(address: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(address.len());
        let mut rest = address;
        while let [first, after @ ..] = rest {
            let digits = after.get(..2).filter(|_| *first == b'%').and_then(|two| std::str::from_utf8(two).ok());
            match digits.and_then(|two| u8::from_str_radix(two, 16).ok()) {
                Some(byte) => (bytes.push(byte), rest = &after[2..]),
                None => (bytes.push(*first), rest = after),
            };
        }
        bytes
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn files_are_read_of_a_list_of_addresses() {
            let list = b"# two\r\nfile:///a/My%20hall.promenade\r\nhttp://x/y\r\nfile://host/b%/c.sofa\r\nfile:nothing\r\n";
            assert_eq!(files_in(list), [PathBuf::from("/a/My hall.promenade"), PathBuf::from("/b%/c.sofa")]);
            assert!(files_in(b"").is_empty() && files_in(&[0xFF; 9]).is_empty());
        }
    }
}
