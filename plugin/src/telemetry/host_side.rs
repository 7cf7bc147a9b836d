//! What a host states and offers of an instance beside its parameters: the track that it is on, marks of mappings and
//! automation, and its own menu of a parameter. That goes between the host's main thread and the editor, never to the audio
//! thread. What hosts are told of an instance besides is here too: its latency and its tail, which any thread may read.

use crate::parameter::Parameter;
use crate::project::{host_values::HostValues, params::PromenadeParams};
use crate::worker::{lock::lock, marks::Marks, repaint::Repaint};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};

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
    /// What it does to parameters.
    pub(crate) values: HostValues,
    /// Marks among the tasks that the framework has for this instance and others.
    pub(crate) marks: Marks,
    state: Mutex<State>,
    repaint: Repaint,
    /// Samples by which the sound is late, since the last activation.
    latency: AtomicU32,
    /// The latency that the host was last told, and one more; 0 before.
    told: AtomicU32,
    /// Samples for which it sounds on after its input.
    tail: AtomicU32,
    /// How the host is called; not at all where it is not connected.
    calls: OnceLock<HostCalls>,
    /// Loads what is chosen for a sample rate, Hz, and finds its latency and tail, samples.
    prepare: OnceLock<Prepare>,
    /// Whether the host has said that it renders offline.
    offline: AtomicBool,
    /// Bits of the scale of the host's windows; 0 where it has named none.
    scale: AtomicU32,
    /// Whether it has started since the last activation, and whether it is starting again now.
    started: AtomicBool,
    resuming: AtomicBool,
}

/// From a sample rate, Hz, to latency and tail, samples.
type Prepare = Box<dyn Fn(f64, u32) -> Option<[u32; 2]> + Send + Sync>;

/// How a host is called beside what the framework does.
pub struct HostCalls {
    /// Says that the latency is another one; main thread, while the plugin is activated.
    pub latency_changed: Box<dyn Fn() + Send + Sync>,
    /// Says that the tail is another one; audio thread.
    pub tail_changed: Box<dyn Fn() + Send + Sync>,
}

thread_local! {
    /// That of the plugin which was made last on this thread.
    static NEWBORN: RefCell<Weak<HostSide>> = const { RefCell::new(Weak::new()) };
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
    pub fn new(repaint: Repaint, params: Arc<PromenadeParams>) -> Self {
        Self { values: HostValues::new(params, repaint.clone()), repaint, ..Self::default() }
    }

    /// Leaves it for [`HostSide::newborn`].
    pub(crate) fn introduce(self: &Arc<Self>) {
        NEWBORN.set(Arc::downgrade(self));
    }

    /// That of the plugin which this thread has just made: the framework's wrappers make theirs where they are, and lead to
    /// it in no other way.
    pub fn newborn() -> Option<Arc<Self>> {
        NEWBORN.take().upgrade()
    }

    /// Calls what starts the instance; the first time after an activation its sound begins anew.
    pub(crate) fn starting<T>(&self, start: impl FnOnce() -> T) -> T {
        self.resuming.store(self.started.swap(true, Ordering::AcqRel), Ordering::Release);
        let started = start();
        self.resuming.store(false, Ordering::Release);
        started
    }

    /// It is activated anew.
    pub(crate) fn activated(&self) {
        self.started.store(false, Ordering::Release);
    }

    /// Whether it starts again after a pause, when its sound goes on.
    pub(crate) fn is_resuming(&self) -> bool {
        self.resuming.load(Ordering::Acquire)
    }

    /// Samples by which the sound is late, as of the last activation.
    pub fn latency(&self) -> u32 {
        self.latency.load(Ordering::Acquire)
    }

    /// Takes over the latency at an activation, and tells the host where it is another one. Main thread.
    pub fn set_latency(&self, samples: u32) {
        if self.latency.swap(samples, Ordering::AcqRel) != samples
            && let Some(calls) = self.calls.get()
        {
            (calls.latency_changed)();
        }
    }

    /// The latency for a host that asks for it, and keeps what it is told.
    pub fn tell_latency(&self) -> u32 {
        let latency = self.latency();
        // One more, so that 0 stands for none.
        self.told.store(latency.saturating_add(1), Ordering::Release);
        latency
    }

    /// Whether the host was told another latency than there is.
    pub fn is_mistaken(&self) -> bool {
        let told = self.told.load(Ordering::Acquire);
        told != 0 && told != self.latency().saturating_add(1)
    }

    /// How latency and tail are found before an activation, once.
    pub(crate) fn prepare_by(&self, prepare: impl Fn(f64, u32) -> Option<[u32; 2]> + Send + Sync + 'static) {
        let _first = self.prepare.set(Box::new(prepare));
    }

    /// The host says how it renders from now on.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub(crate) fn announce(&self, offline: bool) {
        self.offline.store(offline, Ordering::Release);
    }

    /// Whether the host renders offline, as it has said last.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub(crate) fn is_offline(&self) -> bool {
        self.offline.load(Ordering::Acquire)
    }

    /// Takes over the scale of the host's windows, pixels per point.
    pub(crate) fn set_scale(&self, scale: f32) {
        self.scale.store(scale.to_bits(), Ordering::Release);
    }

    /// The scale of the host's windows, where it has named one before there is a window.
    pub(crate) fn scale(&self) -> Option<f64> {
        let scale = f32::from_bits(self.scale.load(Ordering::Acquire));
        (scale > 0.0).then(|| f64::from(scale))
    }

    /// Finds latency and tail at the sample rate of the next activation, Hz: hosts may ask before it. Main thread; loads files.
    pub fn prepare(&self, sample_rate_hz: f64, live_block: u32) {
        let found = self.prepare.get().and_then(|prepare| prepare(sample_rate_hz, live_block));
        if let Some([latency, tail]) = found {
            self.latency.store(latency, Ordering::Release);
            self.set_tail(tail);
        }
    }

    /// Samples for which the plugin sounds on after its input, latency included: as of the last activation or block.
    pub fn tail(&self) -> u32 {
        self.tail.load(Ordering::Acquire)
    }

    /// Takes over the tail at an activation. Main thread.
    pub fn set_tail(&self, samples: u32) {
        self.tail.store(samples, Ordering::Release);
    }

    /// Takes over the tail with a block, and tells the host where it is another one.
    ///
    /// # Real-time
    /// Audio thread; nothing but the host's own call.
    pub fn change_tail(&self, samples: u32) {
        if self.tail.swap(samples, Ordering::AcqRel) != samples
            && let Some(calls) = self.calls.get()
        {
            (calls.tail_changed)();
        }
    }

    /// The track.
    pub fn track(&self) -> Track {
        lock(&self.state).track.clone()
    }

    /// Takes over what the host says of the track.
    pub fn set_track(&self, track: Track) {
        lock(&self.state).track = track;
        self.repaint.request_repaint();
    }

    /// What a parameter is marked with.
    pub fn mark(&self, parameter: Parameter) -> Mark {
        lock(&self.state).marks.get(parameter.id()).cloned().unwrap_or_default()
    }

    /// Changes what a parameter is marked with.
    pub fn change_mark(&self, parameter: Parameter, change: impl FnOnce(&mut Mark)) {
        change(lock(&self.state).marks.entry(parameter.id()).or_default());
        self.repaint.request_repaint();
    }

    /// Connects the host, once: `wake` has it call on its main thread soon, and any thread may call it.
    pub fn connect(&self, wake: impl Fn() + Send + Sync + 'static, calls: HostCalls) {
        lock(&self.state).wake = Some(Arc::new(wake));
        let _first = self.calls.set(calls);
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
    pub fn take_requests(&self) -> Vec<MenuRequest> {
        std::mem::take(&mut lock(&self.state).requests)
    }

    /// Answers with the lines for a parameter.
    pub fn show_menu(&self, parameter: Parameter, items: Vec<MenuItem>) {
        lock(&self.state).menu = Some((parameter, items));
        self.repaint.request_repaint();
    }

    /// The lines for a parameter, as far as they have come.
    pub fn menu(&self, parameter: Parameter) -> Vec<MenuItem> {
        let state = lock(&self.state);
        let known = state.menu.as_ref().filter(|(of, _)| *of == parameter);
        known.map(|(_, items)| items.clone()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_menu_is_asked_for_on_the_main_thread_and_answered_for_its_parameter() {
        let side = HostSide::default();
        side.ask(MenuRequest::Show(Parameter::Gain, [3, 4]));
        assert_eq!(side.take_requests(), [], "nobody answers");
        let woken = Arc::new(AtomicU32::new(0));
        let counted = Arc::clone(&woken);
        let wake = move || {
            counted.fetch_add(1, Ordering::Relaxed);
        };
        side.connect(wake, HostCalls { latency_changed: Box::new(|| ()), tail_changed: Box::new(|| ()) });
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
    fn latency_and_tail_are_told_when_they_change() {
        let told = Arc::new([AtomicU32::new(0), AtomicU32::new(0)]);
        let count = |which: usize| {
            let told = Arc::clone(&told);
            Box::new(move || {
                told[which].fetch_add(1, Ordering::Relaxed);
            })
        };
        let side = Arc::new(HostSide::default());
        side.connect(|| (), HostCalls { latency_changed: count(0), tail_changed: count(1) });
        for (latency, tail) in [(780, 40_000), (780, 40_000), (900, 50_000)] {
            side.set_latency(latency);
            side.change_tail(tail);
            assert_eq!((side.latency(), side.tail()), (latency, tail));
        }
        assert_eq!([0, 1].map(|which: usize| told[which].load(Ordering::Relaxed)), [2, 2]);
        side.introduce();
        assert!(HostSide::newborn().is_some_and(|newborn| Arc::ptr_eq(&newborn, &side)));
        assert!(HostSide::newborn().is_none(), "it is born once");
    }

    #[test]
    fn marks_are_kept_by_parameter() {
        let repaint = Repaint::default();
        let side = HostSide::new(repaint.clone(), Arc::default());
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
