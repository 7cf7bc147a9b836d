//! The system's own window to choose a file, and what the file holds, off the editor's thread.

use super::theme::{CONTROL, SPACE};
use super::widgets::{button, button_width, note};
use super::{ctx::Ctx, words::Word};
use crate::worker::repaint::Repaint;
use egui::{Key, TextEdit, Ui, Vec2};
use rfd::AsyncFileDialog;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

/// What is said when nothing was chosen: whether the user closed the window or there was none cannot be told apart.
const NONE_CHOSEN: &str = "No file was chosen. If no window came up to choose one, type the file's place instead.";

/// What kind of file is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileKind {
    /// What it is, as the window says.
    pub(super) name: &'static str,
    /// Extensions of its files, without dots.
    pub(super) extensions: &'static [&'static str],
}

/// Where a file comes from, or goes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The user has typed it.
    Typed(PathBuf),
    /// To be chosen among files that there are.
    Existing,
    /// To be chosen for a file that is written.
    New,
}

impl Place {
    /// As typed, or `otherwise` where nothing is.
    pub(super) fn typed_or(text: &str, otherwise: Self) -> Self {
        if text.trim().is_empty() { otherwise } else { Self::Typed(crate::library::place_of(text)) }
    }
}

/// Waits for the user's choice.
type Choose = Box<dyn FnOnce() -> Option<PathBuf> + Send>;

fn chosen(file: impl Future<Output = Option<rfd::FileHandle>> + Send + 'static) -> Choose {
    Box::new(move || Some(pollster::block_on(file)?.path().to_owned()))
}

/// Has one file at a time chosen and used.
///
/// The window belongs to the system and cannot be closed from here: where the editor closes first, its answer is dropped.
pub(super) struct Chooser<T> {
    answer: Option<Receiver<Result<T, String>>>,
}

impl<T> Default for Chooser<T> {
    fn default() -> Self {
        Self { answer: None }
    }
}

impl<T: Send + 'static> Chooser<T> {
    /// Whether a file is being chosen or used.
    pub(super) fn is_busy(&self) -> bool {
        self.answer.is_some()
    }

    /// Has a file chosen, unless it is named, and hands it to `take` on a thread of its own. One at a time: others are not
    /// asked for.
    ///
    /// # Errors
    /// There is no thread to do so on.
    pub(super) fn ask(
        &mut self,
        ctx: &Ctx<'_>,
        kind: FileKind,
        place: Place,
        take: impl FnOnce(&Path) -> Result<T, String> + Send + 'static,
    ) -> Result<(), String> {
        if self.is_busy() {
            return Ok(());
        }
        let dialog = AsyncFileDialog::new().set_title(kind.name).add_filter(kind.name, kind.extensions);
        // Some systems want the window to be made here, though not waited for.
        let choose: Choose = match place {
            Place::Typed(path) => Box::new(move || Some(path)),
            Place::Existing => chosen(dialog.pick_file()),
            Place::New => {
                let name = kind.extensions.first().map_or_else(String::new, |extension| format!("untitled.{extension}"));
                chosen(dialog.set_file_name(name).save_file())
            }
        };
        self.begin(ctx.instance.repaint.clone(), choose, take)
    }

    fn begin(
        &mut self,
        repaint: Repaint,
        choose: impl FnOnce() -> Option<PathBuf> + Send + 'static,
        take: impl FnOnce(&Path) -> Result<T, String> + Send + 'static,
    ) -> Result<(), String> {
        let (tell, answer) = channel();
        let work = move || {
            let done = choose().map_or_else(|| Err(NONE_CHOSEN.to_owned()), |path| take(&path));
            // The editor may be closed by now.
            let _ = tell.send(done);
            repaint.request_repaint();
        };
        let begun = thread::Builder::new().name("promenade-files".to_owned()).spawn(work);
        begun.map_err(|error: io::Error| format!("no thread to choose files on: {error}"))?;
        self.answer = Some(answer);
        Ok(())
    }

    /// What came of it, once.
    pub(super) fn take(&mut self) -> Option<Result<T, String>> {
        let done = match self.answer.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the file's reader has failed".to_owned()),
            Ok(done) => done,
        };
        self.answer = None;
        Some(done)
    }
}

/// A field for a file that is read, with a button beside it.
pub(super) struct FileField<T> {
    file: String,
    chooser: Chooser<T>,
    /// Why nothing was chosen.
    why_not: Option<String>,
}

impl<T> Default for FileField<T> {
    fn default() -> Self {
        Self { file: String::new(), chooser: Chooser::default(), why_not: None }
    }
}

impl<T: Send + 'static> FileField<T> {
    /// Shows it, with a hint in the empty field; what was read of a file, once.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        ctx: &Ctx<'_>,
        (hint, word, kind): (&str, Word, FileKind),
        read: impl FnOnce(&Path) -> Result<T, String> + Send + 'static,
    ) -> Option<T> {
        let free = !self.chooser.is_busy();
        let asked = ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            let place = Vec2::new((ui.available_width() - button_width(ui, word) - SPACE).max(CONTROL), CONTROL);
            let typed = ui.add_sized(place, TextEdit::singleline(&mut self.file).hint_text(hint));
            let entered = typed.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) && !self.file.trim().is_empty();
            ui.add_enabled_ui(free, |ui| button(ui, ctx.palette, word)).inner.clicked() || entered
        });
        if free && asked.inner {
            self.why_not = self.chooser.ask(ctx, kind, Place::typed_or(&self.file, Place::Existing), read).err();
        }
        let done = self.chooser.take().and_then(|done| done.map_err(|why| self.why_not = Some(why)).ok());
        if done.is_some() {
            (self.file, self.why_not) = (String::new(), None);
        }
        if let Some(why) = &self.why_not {
            note(ui, ctx.palette, why);
        }
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn waited<T: Send + 'static>(chooser: &mut Chooser<T>) -> Result<T, String> {
        let began = Instant::now();
        loop {
            match chooser.take() {
                Some(done) => return done,
                None => assert!(began.elapsed() < Duration::from_secs(20), "no answer"),
            }
            thread::sleep(Duration::from_millis(1));
        }
    }

    fn length(path: &Path) -> Result<usize, String> {
        Ok(path.as_os_str().len())
    }

    #[test]
    fn a_chosen_file_is_used_once_and_nothing_waits_for_the_choice() {
        let (choose, chosen) = channel::<Option<PathBuf>>();
        let repaint = Repaint::default();
        let mut chooser = Chooser::default();
        chooser.begin(repaint.clone(), move || chosen.recv().ok().flatten(), length).unwrap();
        assert!(chooser.is_busy() && chooser.take().is_none(), "the window is still open");
        assert!(!repaint.take());
        choose.send(Some(PathBuf::from("four"))).unwrap();
        assert_eq!(waited(&mut chooser), Ok(4));
        assert!(!chooser.is_busy() && chooser.take().is_none());
        let asked = Instant::now();
        while !repaint.take() {
            assert!(asked.elapsed() < Duration::from_secs(20), "no picture is asked for");
        }
    }

    #[test]
    fn where_nothing_is_chosen_the_user_is_told_what_to_do() {
        let mut chooser = Chooser::default();
        chooser.begin(Repaint::default(), || None, length).unwrap();
        let why = waited(&mut chooser).unwrap_err();
        assert!(why.contains("No file was chosen") && why.contains("type"), "{why}");
        chooser.begin(Repaint::default(), || panic!("as a damaged file may make it"), length).unwrap();
        assert!(waited(&mut chooser).unwrap_err().contains("failed"));
    }

    #[test]
    fn a_typed_place_is_not_asked_for() {
        assert_eq!(Place::typed_or(" ", Place::Existing), Place::Existing);
        assert_eq!(Place::typed_or("/a/walk.csv", Place::New), Place::Typed(PathBuf::from("/a/walk.csv")));
    }
}
