//! The context that the editor's panels show and change.

use super::host::{Host, landed};
use super::{gesture::Gestures, theme::Palette, views::Views, words::Word};
use crate::budget::Account;
use crate::history::{History, Session, user_state::UserState};
use crate::library::{drawn_room::DrawnRoom, lister::Listing, outline::Outline, scene_key::SceneKey};
use crate::listener::snapshot::{offset_of, sources_of};
use crate::osc::Osc;
use crate::parameter::{Parameter, cast::index, choices::SceneChoice};
use crate::playing::loader::Loader;
use crate::project::scene_frame::{SceneFrame, to_polar};
use crate::project::walk::{SavedWalk, Walk};
use crate::project::{
    params::PromenadeParams, persisted::Persisted, preferences::Preferences, settings::EditorSettings,
    source_walks::SourceWalks, sources::SavedSources,
};
use crate::telemetry::{Frame, Telemetry, host_side::HostSide, waveform::Waveform};
use crate::worker::{TaskHandle, repaint::Repaint};
use egui::Color32;
use nice_plug::context::gui::GuiContext;
use nice_plug::prelude::Enum;
use promenade_core::Scene;
use promenade_core::glam::{Vec2, Vec3};
use std::sync::{Arc, Mutex, Weak};

/// Distance of sources that are arranged from walls and from each other, metres.
const CLEAR_M: f32 = 0.3;
const APART_M: f32 = 0.8;
/// Sources on each side of an arc before the listener, and the angle between two of them, degrees.
const ON_ARC: usize = 8;
const ARC_DEG: f32 = 11.25;

/// Places for so many sources beside one at `home`: on an arc about the listener by turns to the left and to the right, then in
/// rows, the nearest to the listener first, as far as `is_free` lets them.
fn arranged(home: Vec3, listener: Vec3, around: [Vec2; 2], count: usize, is_free: impl Fn(Vec3) -> bool) -> Vec<Vec3> {
    let from = (home - listener).truncate();
    let from = if from.length() > 0.5 { from } else { Vec2::X };
    let turned = |n: usize, side: f32| Vec2::from_angle(side * (n as f32 * ARC_DEG).to_radians()).rotate(from);
    let arc = (1..=ON_ARC).flat_map(|n| [1.0, -1.0].map(|side| turned(n, side) + listener.truncate()));
    let steps = ((around[1] - around[0]) / APART_M).floor().max(Vec2::ZERO);
    let [columns, lines] = [steps.x, steps.y].map(crate::parameter::cast::index);
    let mut rows: Vec<Vec2> =
        (0..=columns).flat_map(|x| (0..=lines).map(move |y| around[0] + APART_M * Vec2::new(x as f32, y as f32))).collect();
    rows.sort_by(|a, b| a.distance(listener.truncate()).total_cmp(&b.distance(listener.truncate())));
    let mut taken = vec![home];
    for place in arc.chain(rows).map(|place| place.extend(home.z)).filter(|place| is_free(*place)) {
        let is_apart =
            taken.iter().chain([&listener]).all(|other| other.truncate().distance(place.truncate()) >= 0.9 * CLEAR_M);
        if taken.len() <= count && is_apart {
            taken.push(place);
        }
    }
    taken.split_off(1)
}

/// The instance that an editor belongs to.
#[derive(Clone)]
pub struct Instance {
    /// The parameters and what is saved beside them.
    pub params: Arc<PromenadeParams>,
    /// Finds and reads scenes and camera paths.
    pub loader: Arc<Loader>,
    /// What the audio thread reports.
    pub telemetry: Arc<Telemetry>,
    /// Head tracking and remote control.
    pub osc: Arc<Osc>,
    /// Asks for the next picture, from any thread.
    pub repaint: Repaint,
    /// What the host states and offers beside parameters.
    pub host_side: Arc<HostSide>,
    /// What it has of the budget of processor time.
    pub account: Arc<Account>,
    /// What is kept between two windows.
    pub session: Arc<Mutex<Session>>,
    /// There as long as the plugin is.
    pub plugin: Weak<()>,
}

/// What is chosen in the editor and belongs to no parameter; panels and view share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// A keyframe of the camera path, by its number.
    pub keyframe: Option<usize>,
    /// A source, 0 for the first.
    pub source: usize,
    /// Whether the list of scenes is open in a narrow window.
    pub list: bool,
    /// Whether the library is to be listed again.
    pub relist: bool,
}

/// A scene's file that is named as soon as the host has taken its slot. Before, the loader would put the slot's own file in its
/// place.
#[derive(Clone, Debug)]
pub struct Owed {
    /// The slot that goes with it.
    pub slot: u32,
    /// The file.
    pub key: SceneKey,
    /// The state before, where it is to be recorded.
    pub before: Option<UserState>,
}

/// One picture's worth of context.
pub struct Ctx<'a> {
    /// The instance.
    pub instance: &'a Instance,
    /// The host, to write to.
    pub host: Host<'a>,
    /// The framework's own context, for whole states.
    pub gui: &'a GuiContext,
    /// The newest picture from the audio thread.
    pub frame: &'a Frame,
    /// The scene that is played or about to be.
    pub scene: Option<&'a Arc<Scene>>,
    /// What the library has.
    pub listing: &'a Listing,
    /// The camera path that is ready, followed or not.
    pub walk: Option<&'a Arc<Walk>>,
    /// The paths of sources that are ready, followed or not.
    pub source_walks: Option<&'a SourceWalks>,
    /// The theme's colours.
    pub palette: &'static Palette,
    /// How the editor is left; saved with the project.
    pub settings: &'a mut EditorSettings,
    /// How every editor of the user looks.
    pub preferences: &'a mut Preferences,
    /// What is chosen.
    pub selection: &'a mut Selection,
    /// Undo, redo and the A/B comparison.
    pub history: &'a mut History,
    /// Name of the preset that was chosen last.
    pub preset: &'a mut Option<String>,
    /// What was heard over the time of the transport.
    pub waveform: &'a Waveform,
    /// What the project says of its sources, as this picture begins.
    pub sources: &'a SavedSources,
    /// The walls of the scene that is played.
    pub outline: &'a Outline,
    /// A scene's file that is still to be named.
    pub owed: &'a mut Option<Owed>,
    /// A camera path of the project that is still to be kept, for the same reason.
    pub owed_walk: &'a mut Option<SavedWalk>,
    /// Gestures that are going on; use the methods of this type.
    pub gestures: &'a mut Gestures,
    /// What is worked out in the background.
    pub views: &'a Views,
    /// Wakes the loader.
    pub task: Option<&'a TaskHandle>,
    /// Time since the window was opened, seconds.
    pub now_s: f64,
    /// Whether the host asks for sound; otherwise `frame` is what it would be.
    pub sounding: bool,
    /// Set by whatever shows the time of the transport in this picture: it is painted again while that runs.
    pub shows_time: bool,
    /// Whether the window is too narrow for everything at once.
    pub narrow: bool,
}

impl Ctx<'_> {
    /// The parameters and what is saved beside them.
    pub fn params(&self) -> &PromenadeParams {
        &self.instance.params
    }

    /// Whether the list of scenes is open. A narrow window keeps its room for the view until the user asks for the list.
    pub fn list_is_open(&mut self) -> &mut bool {
        if self.narrow { &mut self.selection.list } else { &mut self.settings.scenes }
    }

    /// A parameter's plain value: the one that the user is setting, else the one that is heard.
    pub fn value(&self, parameter: Parameter) -> f32 {
        self.gestures.value(parameter).unwrap_or_else(|| self.instance.params.heard(parameter))
    }

    /// A choice's index or a slot's number.
    pub fn index(&self, parameter: Parameter) -> usize {
        index(self.value(parameter))
    }

    /// Whether a switch is on.
    pub fn is_on(&self, parameter: Parameter) -> bool {
        self.value(parameter) > 0.5
    }

    /// The path of a source, 0 for the first, followed or not.
    pub fn source_walk(&self, source: usize) -> Option<&Walk> {
        self.source_walks?.get(source)?.as_ref()
    }

    /// Where a source is in a scene that has its emitter at `home`, metres.
    pub fn source_at(&self, home: Vec3, source: usize) -> Vec3 {
        let value = |parameter| self.value(parameter);
        let walk = self.source_walk(source);
        let on_path = walk.and_then(|walk| sources_of(value).on(walk, self.frame.transport_s));
        on_path.map_or(home, |pose| pose.position) + self.offset(source)
    }

    /// Changes what the project says of its sources.
    pub fn change_sources(&self, change: impl FnOnce(&mut SavedSources)) {
        self.keep(&self.params().sources.saved, change);
        self.params().sources.follow();
    }

    /// Whether a source is heard, 0 for the first.
    pub fn is_heard(&self, source: usize) -> bool {
        self.params().sources.is_heard(source)
    }

    /// The colour of a source, 0 for the first.
    pub fn source_colour(&self, source: usize) -> Color32 {
        let own = self.sources.of(source).colour;
        own.map_or(self.palette.emitter, |[r, g, b]| Color32::from_rgb(r, g, b))
    }

    /// Whether a place is outside of the walls, where those are known.
    pub fn is_outside(&self, place: Vec3) -> bool {
        match self.drawn_room() {
            Some(room) => !room.holds(place),
            None => self.outline.is_inside(place) == Some(false),
        }
    }

    /// The sources that stand outside of the walls, 0 for the first.
    pub fn sources_outside(&self) -> Vec<usize> {
        let Some(home) = self.scene.and_then(|scene| scene.emitter()) else { return Vec::new() };
        (0..=self.params().further()).filter(|source| self.is_outside(self.source_at(home, *source))).collect()
    }

    /// Moves a source, 0 for the first, to a place of the world, while the pointer is down with `holds`.
    pub fn put_source(&mut self, home: Vec3, source: usize, place: Vec3, holds: bool) {
        let by = place - self.source_at(home, source);
        self.set_offset(source, self.offset(source) + by, self.is_polar(), holds);
    }

    /// Whether directions say where sources are.
    pub fn is_polar(&self) -> bool {
        self.is_on(Parameter::Place)
    }

    /// How far a source is from the scene's emitter, metres, without a path of its own.
    pub fn offset(&self, source: usize) -> Vec3 {
        let frame = self.scene.map(|scene| SceneFrame::of(scene));
        offset_of(source, |parameter| self.value(parameter), frame.as_ref())
    }

    /// Puts a source so far from the scene's emitter by the parameters along the axes, or by those of directions.
    pub fn set_offset(&mut self, source: usize, offset: Vec3, polar: bool, holds: bool) {
        let (parameters, values) = match self.scene.filter(|_| polar).map(|scene| SceneFrame::of(scene)) {
            Some(frame) => (Parameter::polar_of(source), to_polar(frame.from_world(frame.emitter + offset))),
            None => (Parameter::place_of(source), offset.to_array()),
        };
        for (parameter, value) in
            parameters.into_iter().zip(values).filter(|(p, v)| holds || self.value(*p) != *v).collect::<Vec<_>>()
        {
            if holds { self.hold(parameter, value) } else { self.set(parameter, value) }
        }
    }

    /// Has other parameters say where sources are, with all of them where they are.
    pub fn place_by(&mut self, choice: usize) {
        for source in 0..=self.params().further() {
            self.set_offset(source, self.offset(source), choice > 0, false);
        }
        self.set(Parameter::Place, choice as f32);
    }

    /// Puts all further sources where the room has place about the listener.
    pub fn arrange(&mut self) {
        let Some(home) = self.scene.and_then(|scene| scene.emitter()) else { return };
        let is_free = |place: Vec3| match self.drawn_room() {
            Some(room) => room.holds(place),
            None => self.outline.is_clear(place, CLEAR_M).unwrap_or(true),
        };
        let around = match (self.drawn_room().map(|room| room.corners()), self.outline.plan(), self.scene) {
            (Some(corners), ..) => corners.map(Vec3::truncate),
            (None, Some(corners), _) => corners,
            (None, None, Some(scene)) => [scene.bounds().0, scene.bounds().1].map(Vec3::truncate),
            (None, None, None) => return,
        };
        let places = arranged(home, self.frame.pose.position, around, self.params().further(), is_free);
        for (further, place) in places.into_iter().enumerate() {
            self.put_source(home, 1 + further, place, false);
        }
    }

    /// Sets a value at once, as a gesture of its own.
    pub fn set(&mut self, parameter: Parameter, value: f32) {
        let value = self.taken(parameter, value);
        self.gestures.set(&self.host, parameter, value);
    }

    /// Sets a value while the pointer is down. To be called in each frame until it is released, moved or not.
    pub fn hold(&mut self, parameter: Parameter, value: f32) {
        let value = self.taken(parameter, value);
        self.gestures.hold(&self.host, parameter, value);
    }

    /// Sets a value by a step of the wheel or a key.
    pub fn nudge(&mut self, parameter: Parameter, value: f32) {
        let value = self.taken(parameter, value);
        self.gestures.nudge(&self.host, parameter, value, self.now_s);
    }

    /// A value that the parameter can take. It replaces what came over Open Sound Control.
    fn taken(&self, parameter: Parameter, value: f32) -> f32 {
        self.instance.params.remote.clear(parameter);
        parameter.clamp(value)
    }

    /// Reports values that came over Open Sound Control to the host, as only an open editor can; values in quick succession are
    /// one gesture.
    pub fn report_remote(&mut self) {
        for parameter in self.params().parameters() {
            let params = &self.instance.params;
            if let Some(value) = params.remote.pending(parameter, params.hosted(parameter)) {
                let landed = landed(params, parameter, value);
                params.remote.announce(parameter, landed);
                // Hosts round: one that has it as nearly as it can is told no more, or the gesture would never end.
                if landed != params.hosted(parameter) {
                    self.gestures.nudge(&self.host, parameter, value, self.now_s);
                }
            }
        }
    }

    /// Tells the host that the project has changed beside the parameters, and wakes the loader.
    pub fn touch(&self) {
        self.host.touch();
        self.refresh();
    }

    /// Changes what is saved beside the parameters. A state that the host restores meanwhile wins.
    pub fn keep<T: Clone + PartialEq>(&self, field: &Persisted<T>, change: impl FnOnce(&mut T)) {
        let (old, restores) = field.get();
        let mut new = old.clone();
        change(&mut new);
        if new != old && field.replace(new, restores) {
            self.touch();
        }
    }

    /// The drawn room, if that is what the parameters choose.
    pub fn drawn_room(&self) -> Option<DrawnRoom> {
        let own = self.index(Parameter::Scene) == SceneChoice::Library.to_index() && self.index(Parameter::Slot) == 0;
        self.params().room.get().0.filter(|_| own)
    }

    /// Replaces the drawn room and has it loaded. The host is told by [`Ctx::touch`], once when all of a drag is done. A state
    /// that the host restores meanwhile wins.
    pub fn draw(&self, room: DrawnRoom) {
        let (old, restores) = self.params().room.get();
        let room = Some(room);
        if old != room && self.params().room.replace(room, restores) {
            self.refresh();
        }
    }

    /// Plays the drawn room and shows its panel. At first it is drawn about the listener.
    pub fn choose_room(&mut self) {
        if self.params().room.get().0.is_none() {
            self.draw(DrawnRoom::around(self.frame.pose.position));
        }
        *self.owed = None;
        // The slot first: the scene that was chosen before is not read again in between.
        self.set(Parameter::Slot, 0.0);
        self.set(Parameter::Scene, SceneChoice::Library.to_index() as f32);
        self.touch();
        self.settings.drawer = true;
        Word::Room.label().clone_into(&mut self.settings.tab);
    }

    /// Restores a state, as gestures of its own.
    pub fn restore(&mut self, state: &UserState) {
        self.instance.loader.exchange.restoring.set(true);
        let mut set = Vec::new();
        state.restore(&self.instance.params, |parameter, value| set.push((parameter, value)));
        for (parameter, value) in set {
            self.set(parameter, value);
        }
        let (slot, key) = state.scene();
        *self.owed = Some(Owed { slot, key: key.clone(), before: None });
        self.touch();
    }

    /// Makes a path the project's own, as soon as the host has let go of the library's.
    pub fn keep_walk(&mut self, walk: SavedWalk) {
        *self.owed_walk = Some(walk);
        self.set(Parameter::Walk, 0.0);
        self.pay();
    }

    /// Names the scene's file and keeps the path once the host has taken their slots.
    pub fn pay(&mut self) {
        let choices = self.instance.loader.choices();
        if choices.walk_slot == 0
            && let Some(walk) = self.owed_walk.take()
            && self.params().saved_walk.get().0 != walk
        {
            self.params().saved_walk.supersede(walk);
            self.touch();
        }
        if self.owed.is_none() && self.instance.loader.is_up_to_date() {
            self.instance.loader.exchange.restoring.set(false);
        }
        let taken = choices.scene_slot;
        let Some(Owed { key, before, .. }) = self.owed.take_if(|owed| owed.slot == taken) else { return };
        let held = &self.instance.params.scene_key;
        if held.get().0 != key {
            self.instance.loader.exchange.opened.set(before.is_some());
            // The loader may be about to write the former key back.
            held.supersede(key);
            self.touch();
        }
        if let Some(before) = before {
            self.history.record(before, &UserState::of(&self.instance.params));
        }
    }

    /// Does at once what can be undone.
    pub fn undoable(&mut self, change: impl FnOnce(&mut Self)) {
        let before = UserState::of(self.params());
        change(self);
        self.history.record(before, &UserState::of(&self.instance.params));
    }

    /// Takes the last change back, if there is one.
    pub fn undo(&mut self) {
        self.travel(History::undo);
    }

    /// Makes the change again that was taken back last, if there is one.
    pub fn redo(&mut self) {
        self.travel(History::redo);
    }

    /// Switches from A to B or back.
    pub fn compare(&mut self) {
        self.travel(|history, now| Some(history.compare(now)));
    }

    fn travel(&mut self, to: impl FnOnce(&mut History, UserState) -> Option<UserState>) {
        if let Some(state) = to(self.history, UserState::of(&self.instance.params)) {
            self.restore(&state);
        }
    }

    /// Wakes the loader to load what the parameters choose.
    pub fn refresh(&self) {
        if let Some(task) = self.task {
            task.schedule();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::factory;

    #[test]
    fn sources_are_arranged_within_the_walls_and_apart() {
        let scene = Scene::from_bytes(factory::LOFT.bytes).unwrap();
        let outline = Outline::of(scene.anchors());
        let is_free = |place| outline.is_clear(place, CLEAR_M) == Some(true);
        let home = scene.emitter().unwrap();
        let places = arranged(home, Vec3::ZERO, outline.plan().unwrap(), 63, is_free);
        assert_eq!(places.len(), 63);
        for (number, place) in places.iter().enumerate() {
            assert_eq!(outline.is_inside(*place), Some(true), "{place}");
            assert!(places[..number].iter().all(|other| other.distance(*place) > 0.25), "{place}");
        }
        assert!((places[0].y - 0.29).abs() < 0.01 && (places[1].y + 0.29).abs() < 0.01, "{:?}", &places[..2]);
    }
}
