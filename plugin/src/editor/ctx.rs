//! What the editor's panels are given to show and to change.

use super::gesture::Gestures;
use super::host::Host;
use super::theme::Palette;
use crate::kept::Kept;
use crate::lister::Listing;
use crate::loader::Loader;
use crate::osc::Osc;
use crate::params::PromenadeParams;
use crate::recall::{History, Recall};
use crate::remote::Knob;
use crate::settings::EditorSettings;
use crate::telemetry::{Frame, Telemetry};
use crate::walk::Walk;
use crate::worker::Desk;
use nice_plug::context::gui::GuiContext;
use nice_plug_egui::RepaintNotifier;
use promenade_core::Scene;
use std::sync::Arc;

/// What an editor knows of the instance that it belongs to.
#[derive(Clone)]
pub struct Instance {
    /// The parameters and what is saved beside them.
    pub params: Arc<PromenadeParams>,
    /// Finds and reads scenes and camera paths.
    pub loader: Arc<Loader>,
    /// What the audio thread tells.
    pub telemetry: Arc<Telemetry>,
    /// Head tracking and remote control.
    pub osc: Arc<Osc>,
    /// Asks for the next picture, from any thread.
    pub repaint: RepaintNotifier,
}

/// What is chosen in the editor and belongs to no parameter; panels and view share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// A keyframe of the camera path, by its number.
    pub keyframe: Option<usize>,
    /// Whether the list of scenes is open in a narrow window.
    pub list: bool,
}

/// One picture's worth of context.
pub struct Ctx<'a> {
    /// The instance.
    pub instance: &'a Instance,
    /// The host, to write to.
    pub host: Host<'a>,
    /// The framework's own context, for whole states.
    pub gui: &'a GuiContext,
    /// The newest that the audio thread has told.
    pub frame: &'a Frame,
    /// The scene that is played or about to be.
    pub scene: Option<&'a Arc<Scene>>,
    /// What the library has.
    pub listing: &'a Listing,
    /// The camera path at hand, followed or not.
    pub walk: Option<&'a Arc<Walk>>,
    /// The theme's colours.
    pub palette: &'static Palette,
    /// How the editor is left; saved with the project.
    pub settings: &'a mut EditorSettings,
    /// What is chosen.
    pub selection: &'a mut Selection,
    /// What can be undone and compared.
    pub history: &'a mut History,
    /// Gestures that are going on; use the methods of this type.
    pub gestures: &'a mut Gestures,
    /// Sends the loader to work.
    pub desk: Option<&'a Desk>,
    /// Time since the window was opened, seconds.
    pub now_s: f64,
    /// Whether the host asks for sound; otherwise `frame` is what it would be.
    pub sounding: bool,
    /// Whether this picture shows the time of the transport; who shows it says so, and is painted again while it runs.
    pub shows_time: bool,
    /// Whether the window is too narrow for everything at once.
    pub narrow: bool,
}

impl Ctx<'_> {
    /// The parameters and what is saved beside them.
    #[must_use]
    pub fn params(&self) -> &PromenadeParams {
        &self.instance.params
    }

    /// Whether the list of scenes is open. A narrow window keeps its room for the view until the user asks for the list.
    pub fn list_is_open(&mut self) -> &mut bool {
        if self.narrow { &mut self.selection.list } else { &mut self.settings.scenes }
    }

    /// A parameter's plain value: the one that the user is setting, else the one that is heard.
    #[must_use]
    pub fn value(&self, knob: Knob) -> f32 {
        self.gestures.value(knob).unwrap_or_else(|| self.instance.params.heard(knob))
    }

    /// A choice's index or a slot's number.
    #[must_use]
    pub fn index(&self, knob: Knob) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
        let index = self.value(knob).max(0.0) as usize;
        index
    }

    /// Whether a switch is on.
    #[must_use]
    pub fn is_on(&self, knob: Knob) -> bool {
        self.value(knob) > 0.5
    }

    /// Sets a value at once, as a gesture of its own.
    pub fn set(&mut self, knob: Knob, value: f32) {
        let value = self.taken(knob, value);
        self.gestures.set(&self.host, knob, value);
    }

    /// Sets a value while the pointer is down. To be called in each frame until it is released, moved or not.
    pub fn hold(&mut self, knob: Knob, value: f32) {
        let value = self.taken(knob, value);
        self.gestures.hold(&self.host, knob, value);
    }

    /// Sets a value by a step of the wheel or a key.
    pub fn nudge(&mut self, knob: Knob, value: f32) {
        let value = self.taken(knob, value);
        self.gestures.nudge(&self.host, knob, value, self.now_s);
    }

    /// A value within the range. What came over Open Sound Control for the parameter gives way.
    fn taken(&self, knob: Knob, value: f32) -> f32 {
        self.instance.params.remote.clear(knob);
        let (least, greatest) = PromenadeParams::limits(knob);
        let value = if value.is_finite() { value.clamp(least, greatest) } else { least };
        if knob.is_whole() { value.round() } else { value }
    }

    /// A value with its unit, or the name of a choice, as hosts show it.
    #[must_use]
    pub fn text(&self, knob: Knob) -> String {
        super::host::text(&self.instance.params, knob, self.value(knob))
    }

    /// Tells the host that the project has changed beside the parameters, and sends the loader to look.
    pub fn touch(&self) {
        self.host.touch();
        self.refresh();
    }

    /// Changes what is saved beside the parameters. A state that the host restores meanwhile wins.
    pub fn keep<T: Clone + PartialEq>(&self, field: &Kept<T>, change: impl FnOnce(&mut T)) {
        let (old, restores) = field.get();
        let mut new = old.clone();
        change(&mut new);
        if new != old && field.replace(new, restores) {
            self.touch();
        }
    }

    /// Brings settings back, as gestures of their own.
    pub fn recall(&mut self, recall: &Recall) {
        let mut set = Vec::new();
        recall.apply(&self.instance.params, |knob, value| set.push((knob, value)));
        for (knob, value) in set {
            self.set(knob, value);
        }
        self.touch();
    }

    /// Takes the last change back, if there is one.
    pub fn undo(&mut self) {
        if let Some(before) = self.history.undo(Recall::of(&self.instance.params)) {
            self.recall(&before);
        }
    }

    /// Makes the change again that was taken back last, if there is one.
    pub fn redo(&mut self) {
        if let Some(after) = self.history.redo(Recall::of(&self.instance.params)) {
            self.recall(&after);
        }
    }

    /// Goes from A to B or back.
    pub fn compare(&mut self) {
        let other = self.history.compare(Recall::of(&self.instance.params));
        self.recall(&other);
    }

    /// Sends the loader to look for what the parameters ask for.
    pub fn refresh(&self) {
        if let Some(desk) = self.desk {
            desk.call();
        }
    }
}
