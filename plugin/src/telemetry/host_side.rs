//! What a host knows and offers of an instance beside its parameters: the track that it is on, marks of mappings and
//! automation, and its own menu of a parameter. It goes between the host's main thread and the editor, never to the audio
//! thread.

use crate::parameter::Parameter;
use crate::worker::lock::lock;
use crate::worker::repaint::Repaint;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// Red, green and blue.
pub type Colour = [u8; 3];

/// The track that an instance is on, as far as the host tells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Track {
    /// Its name; empty where the host names none.
    pub name: String,
    /// Its colour.
    pub colour: Option<Colour>,
}

/// What automation does to a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Automation {
    /// There is none.
    #[default]
    None,
    /// There is some, which is not played.
    Present,
    /// It moves the parameter.
    Playing,
    /// It is written.
    Recording,
    /// The user moves the parameter against it.
    Overriding,
}

/// A control outside that a parameter is mapped to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    /// A word, such as "CC 7".
    pub label: String,
    /// A sentence.
    pub description: String,
    /// The colour in which the host shows it.
    pub colour: Option<Colour>,
}

/// What the host marks a parameter with.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mark {
    /// What it is mapped to.
    pub mapping: Option<Mapping>,
    /// What automation does.
    pub automation: Automation,
    /// The colour in which the host shows its automation.
    pub automation_colour: Option<Colour>,
}

/// A line of the host's menu.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MenuItem {
    /// Something to do.
    Entry {
        /// What it says.
        label: String,
        /// Whether it can be done now.
        enabled: bool,
        /// Whether it is ticked; `None` for what is never ticked.
        checked: Option<bool>,
        /// The number by which the host knows it.
        action: u32,
    },
    /// A line between others.
    Separator,
    /// A heading.
    Title(String),
    /// A menu within the menu.
    Submenu {
        /// What it says.
        label: String,
        /// Whether it can be opened.
        enabled: bool,
        /// Its lines.
        items: Vec<MenuItem>,
    },
}

/// What the editor asks of the host's menu, to be done on the host's main thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MenuRequest {
    /// The lines for a parameter; or that the host shows its own menu at a place in the window, pixels.
    Show(Parameter, [i32; 2]),
    /// A line was clicked.
    Perform(Parameter, u32),
}

/// One instance's part of it.
#[derive(Default)]
pub struct HostSide {
    state: Mutex<State>,
    repaint: Repaint,
    /// Has the host activate the plugin again.
    restart: OnceLock<Box<dyn Fn() + Send + Sync>>,
}

#[derive(Default)]
struct State {
    track: Track,
    marks: BTreeMap<&'static str, Mark>,
    menu: Option<(Parameter, Vec<MenuItem>)>,
    requests: Vec<MenuRequest>,
    /// Has the host call on its main thread; none where nobody answers.
    wake: Option<Arc<dyn Fn() + Send + Sync>>,
}

impl HostSide {
    /// Nothing is known yet; `repaint` is asked for a picture whenever something is.
    #[must_use]
    pub fn new(repaint: Repaint) -> Self {
        Self { state: Mutex::default(), repaint, restart: OnceLock::new() }
    }

    /// The track.
    #[must_use]
    pub fn track(&self) -> Track {
        lock(&self.state).track.clone()
    }

    /// Takes over what the host says of the track.
    pub fn set_track(&self, track: Track) {
        lock(&self.state).track = track;
        self.repaint.request_repaint();
    }

    /// What a parameter is marked with.
    #[must_use]
    pub fn mark(&self, parameter: Parameter) -> Mark {
        lock(&self.state).marks.get(parameter.id()).cloned().unwrap_or_default()
    }

    /// Changes what a parameter is marked with.
    pub fn change_mark(&self, parameter: Parameter, change: impl FnOnce(&mut Mark)) {
        change(lock(&self.state).marks.entry(parameter.id()).or_default());
        self.repaint.request_repaint();
    }

    /// Connects the host, once: `wake` has it call on its main thread soon, `restart` has it activate the plugin again; any
    /// thread may call them.
    pub fn connect(&self, wake: impl Fn() + Send + Sync + 'static, restart: impl Fn() + Send + Sync + 'static) {
        lock(&self.state).wake = Some(Arc::new(wake));
        let _first = self.restart.set(Box::new(restart));
    }

    /// Has the host activate the plugin again; does nothing where nobody answers.
    ///
    /// # Real-time
    /// Audio thread; nothing but the host's own call.
    pub fn request_restart(&self) {
        if let Some(restart) = self.restart.get() {
            restart();
        }
    }

    /// Nobody answers any more.
    pub fn disconnect(&self) {
        lock(&self.state).wake = None;
    }

    /// Asks the host; does nothing where nobody answers.
    pub fn ask(&self, request: MenuRequest) {
        let mut state = lock(&self.state);
        let Some(wake) = state.wake.clone() else { return };
        if let MenuRequest::Show(..) = request {
            state.menu = None;
        }
        state.requests.push(request);
        // A host may call at once.
        drop(state);
        wake();
    }

    /// What is asked, once.
    #[must_use]
    pub fn take_requests(&self) -> Vec<MenuRequest> {
        std::mem::take(&mut lock(&self.state).requests)
    }

    /// Answers with the lines for a parameter.
    pub fn show_menu(&self, parameter: Parameter, items: Vec<MenuItem>) {
        lock(&self.state).menu = Some((parameter, items));
        self.repaint.request_repaint();
    }

    /// The lines for a parameter, as far as they have come.
    #[must_use]
    pub fn menu(&self, parameter: Parameter) -> Vec<MenuItem> {
        let state = lock(&self.state);
        let known = state.menu.as_ref().filter(|(of, _)| *of == parameter);
        known.map(|(_, items)| items.clone()).unwrap_or_default()
    }
}

/// Asks an instance for its part of it: the framework leads from what a host holds to the plugin by its tasks alone.
#[derive(Clone, Default)]
pub struct Introduction(Arc<OnceLock<Arc<HostSide>>>);

impl Introduction {
    /// The instance's answer.
    pub(crate) fn answer(&self, side: &Arc<HostSide>) {
        self.0.get_or_init(|| Arc::clone(side));
    }

    /// What was answered.
    #[must_use]
    pub fn answered(&self) -> Option<Arc<HostSide>> {
        self.0.get().cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn a_menu_is_asked_for_on_the_main_thread_and_answered_for_its_parameter() {
        let side = HostSide::default();
        side.ask(MenuRequest::Show(Parameter::Gain, [3, 4]));
        assert_eq!(side.take_requests(), [], "nobody answers");
        let woken = Arc::new(AtomicU32::new(0));
        let counted = Arc::clone(&woken);
        let restarts = Arc::new(AtomicU32::new(0));
        let restarted = Arc::clone(&restarts);
        side.request_restart();
        let wake = move || {
            counted.fetch_add(1, Ordering::Relaxed);
        };
        side.connect(wake, move || {
            restarted.fetch_add(1, Ordering::Relaxed);
        });
        side.request_restart();
        assert_eq!(restarts.load(Ordering::Relaxed), 1);
        side.ask(MenuRequest::Show(Parameter::Gain, [3, 4]));
        assert_eq!(
            (side.take_requests(), woken.load(Ordering::Relaxed)),
            (vec![MenuRequest::Show(Parameter::Gain, [3, 4])], 1)
        );
        side.show_menu(Parameter::Gain, vec![MenuItem::Separator]);
        assert_eq!((side.menu(Parameter::Gain), side.menu(Parameter::Mix)), (vec![MenuItem::Separator], vec![]));
        side.ask(MenuRequest::Show(Parameter::Mix, [0, 0]));
        assert_eq!(side.menu(Parameter::Gain), [], "the next menu is another");
        side.disconnect();
        side.ask(MenuRequest::Perform(Parameter::Gain, 1));
        assert_eq!((side.take_requests(), woken.load(Ordering::Relaxed)), (vec![MenuRequest::Show(Parameter::Mix, [0, 0])], 2));
    }

    #[test]
    fn marks_are_kept_by_parameter() {
        let repaint = Repaint::default();
        let side = HostSide::new(repaint.clone());
        side.change_mark(Parameter::Yaw, |mark| mark.automation = Automation::Playing);
        side.change_mark(Parameter::Yaw, |mark| {
            mark.mapping = Some(Mapping { label: "CC 7".to_owned(), ..Mapping::default() })
        });
        let mark = side.mark(Parameter::Yaw);
        assert_eq!((mark.automation, mark.mapping.unwrap().label), (Automation::Playing, "CC 7".to_owned()));
        assert_eq!(side.mark(Parameter::Mix), Mark::default());
        assert!(repaint.take());
    }
}
