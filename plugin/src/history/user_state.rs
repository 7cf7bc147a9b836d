//! What presets, undo and the A/B comparison restore: the parameters, the scene, the drawn room, the camera path, the paths of
//! sources and the head.

use crate::library::drawn_room::DrawnRoom;
use crate::library::scene_key::SceneKey;
use crate::listener::snapshot::values_of;
use crate::parameter::Parameter;
use crate::parameter::cast::index;
use crate::parameter::choices::SceneChoice;
use crate::project::matching::Matching;
use crate::project::params::PromenadeParams;
use crate::project::saved_head::SavedHead;
use crate::project::source_walks::SavedSourceWalks;
use crate::project::sources::SavedSources;
use crate::project::state::{SOURCE_WALKS_FIELD, saved_value};
use crate::project::walk::SavedWalk;
use nice_plug::params::persist::{deserialize_field, serialize_field};
use nice_plug::plugin::{ParamValue, PluginState};
use nice_plug::prelude::Enum;
use promenade_core::Pose;

/// Everything that a user sets for the sound, as it was at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct UserState {
    values: [f32; Parameter::EVERY.len()],
    scene: SceneKey,
    walk: SavedWalk,
    source_walks: SavedSourceWalks,
    sources: SavedSources,
    head: SavedHead,
    room: Option<DrawnRoom>,
    matching: Matching,
}

impl UserState {
    /// The present state.
    #[must_use]
    pub fn of(params: &PromenadeParams) -> Self {
        let value = |parameter| match parameter {
            Parameter::Source(_) if !params.has(parameter) => parameter.row().default,
            _ if is_for_sound(parameter) => params.heard(parameter),
            _ => 0.0,
        };
        Self {
            values: Parameter::EVERY.map(value),
            scene: params.scene_key.get().0,
            walk: params.saved_walk.get().0,
            source_walks: params.source_walks.get().0,
            sources: params.sources.saved.get().0,
            head: params.head.get().0,
            room: params.room.get().0,
            matching: params.matching.get().0,
        }
    }

    /// What a saved state holds; what it lacks is as in `base`.
    #[must_use]
    pub fn from_saved(mut saved: PluginState, base: &Self) -> Self {
        // A state without a head or paths of sources is one of before there were any.
        let [has_head, has_source_walks, has_sources] =
            ["head", SOURCE_WALKS_FIELD, "sources"].map(|name| saved.fields.contains_key(name));
        crate::project::state::migrate(&mut saved);
        let mut state = base.clone();
        for parameter in Parameter::EVERY.into_iter().filter(|parameter| is_for_sound(*parameter)) {
            let (least, greatest) = parameter.limits();
            if let Some(value) = saved.params.get(parameter.id()).and_then(|value| plain(parameter, value)) {
                state.values[parameter.number()] = value.clamp(least, greatest);
            }
        }
        let field = |name: &str| saved.fields.get(name);
        if let Some(scene) = field("scene").and_then(|json| deserialize_field(json).ok()) {
            state.scene = scene;
        }
        if let Some(walk) = field("walk").and_then(|json| deserialize_field(json).ok()) {
            state.walk = walk;
        }
        let source_walks = field(SOURCE_WALKS_FIELD).filter(|_| has_source_walks);
        if let Some(walks) = source_walks.and_then(|json| deserialize_field(json).ok()) {
            state.source_walks = walks;
        }
        if let Some(sources) = field("sources").filter(|_| has_sources).and_then(|json| deserialize_field(json).ok()) {
            state.sources = sources;
        }
        if let Some(head) = field("head").filter(|_| has_head).and_then(|json| deserialize_field(json).ok()) {
            state.head = head;
        }
        if let Some(matching) = field("matching").and_then(|json| deserialize_field(json).ok()) {
            state.matching = matching;
        }
        if let Some(room) = field("room").and_then(|json| deserialize_field(json).ok()) {
            state.room = room;
        }
        state
    }

    /// The plain value of a parameter.
    #[must_use]
    pub fn value(&self, parameter: Parameter) -> f32 {
        self.values[parameter.number()]
    }

    /// The camera path of the project.
    #[must_use]
    pub fn walk(&self) -> &SavedWalk {
        &self.walk
    }

    /// The scene's slot in the library, and its file.
    #[must_use]
    pub fn scene(&self) -> (u32, &SceneKey) {
        (u32::try_from(index(self.value(Parameter::Slot))).unwrap_or(0), &self.scene)
    }

    /// The state with another scene, from a file, and the listener where the scene's makers let it begin.
    #[must_use]
    pub fn in_scene(mut self, scene: SceneKey, start: Pose) -> Self {
        let own = [(Parameter::Scene, SceneChoice::Library.to_index() as f32), (Parameter::Slot, 0.0)];
        for (parameter, value) in values_of(&start).into_iter().chain(own) {
            self.values[parameter.number()] = value;
        }
        (self.scene, self.room) = (scene, None);
        self
    }

    /// Puts it into a saved state, whose other parts stay as they are.
    ///
    /// # Errors
    /// A part cannot be written as text.
    pub fn put_into(&self, saved: &mut PluginState) -> serde_json::Result<()> {
        crate::project::state::migrate(saved);
        for parameter in Parameter::EVERY.into_iter().filter(|parameter| is_for_sound(*parameter)) {
            // An instance of one source has none of those.
            if matches!(parameter, Parameter::Source(_)) && !saved.params.contains_key(parameter.id()) {
                continue;
            }
            saved.params.insert(parameter.id().to_owned(), saved_value(parameter, self.value(parameter)));
        }
        let fields = [
            ("scene", serialize_field(&self.scene)?),
            ("walk", serialize_field(&self.walk)?),
            (SOURCE_WALKS_FIELD, serialize_field(&self.source_walks)?),
            ("sources", serialize_field(&self.sources)?),
            ("head", serialize_field(&self.head)?),
            ("room", serialize_field(&self.room)?),
            ("matching", serialize_field(&self.matching)?),
        ];
        saved.fields.extend(fields.map(|(name, json)| (name.to_owned(), json)));
        Ok(())
    }

    /// Restores it: `set` is called for each parameter that differs, with its plain value.
    ///
    /// Scene and path go first, so that the choices by slot find what they belong to.
    pub fn restore(&self, params: &PromenadeParams, mut set: impl FnMut(Parameter, f32)) {
        if params.matching.get().0 != self.matching {
            params.matching.supersede(self.matching);
        }
        if params.scene_key.get().0 != self.scene {
            params.scene_key.restore(self.scene.clone());
        }
        if params.room.get().0 != self.room {
            params.room.restore(self.room.clone());
        }
        if params.saved_walk.get().0 != self.walk {
            params.saved_walk.restore(self.walk.clone());
        }
        if params.source_walks.get().0 != self.source_walks {
            params.source_walks.restore(self.source_walks.clone());
        }
        if params.sources.saved.get().0 != self.sources {
            params.sources.saved.supersede(self.sources.clone());
            params.sources.follow();
        }
        if params.head.get().0 != self.head {
            params.head.restore(self.head.clone());
        }
        for parameter in params.parameters().filter(|parameter| is_for_sound(*parameter)) {
            if params.heard(parameter) != self.value(parameter) {
                set(parameter, self.value(parameter));
            }
        }
    }
}

/// Whether presets and undo restore a parameter: they neither open a port nor close one.
fn is_for_sound(parameter: Parameter) -> bool {
    !matches!(parameter, Parameter::Osc | Parameter::Latency)
}

/// A saved value as a plain number; choices are saved by their ids.
fn plain(parameter: Parameter, value: &ParamValue) -> Option<f32> {
    match value {
        ParamValue::F32(number) => Some(*number),
        ParamValue::I32(number) => Some(*number as f32),
        ParamValue::Bool(on) => Some(f32::from(u8::from(*on))),
        ParamValue::String(id) => Some(parameter.variants()?.ids.iter().position(|known| known == id)? as f32),
    }
}

#[cfg(test)]
pub(crate) mod tests;
