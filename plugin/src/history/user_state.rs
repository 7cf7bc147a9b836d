//! What presets, undo and the A/B comparison restore: the parameters, the scene, the drawn room, the camera path, the paths of
//! sources and the head.

use crate::library::{drawn_room::DrawnRoom, scene_key::SceneKey};
use crate::listener::snapshot::values_of;
use crate::parameter::{Parameter, cast::index, choices::SceneChoice};
use crate::project::state::{migrate, saved_value};
use crate::project::{
    matching::Matching, params::PromenadeParams, saved_head::SavedHead, source_walks::SavedSourceWalks, sources::SavedSources,
    walk::SavedWalk,
};
use nice_plug::params::persist::{deserialize_field, serialize_field};
use nice_plug::plugin::{ParamValue, PluginState};
use nice_plug::prelude::Enum;
use promenade_core::Pose;

/// Declares what is restored besides the parameters, in the order in which it is: of each part its type, its field in saved
/// states, where a project has it, how that takes another, and whether states of before there was such a part have one.
macro_rules! parts {
    ($($part:ident: $type:ty = $field:literal, $($held:ident).+, $take:ident, $always:literal;)*) => {
        /// Everything that a user sets for the sound, as it was at one time.
        #[derive(Clone, Debug, PartialEq)]
        pub struct UserState {
            values: [f32; Parameter::EVERY.len()],
            $($part: $type,)*
        }

        impl UserState {
            fn with_values(values: [f32; Parameter::EVERY.len()], params: &PromenadeParams) -> Self {
                Self { values, $($part: params.$($held).+.get().0,)* }
            }

            fn take_parts(&mut self, saved: &PluginState, had: &[String]) {
                $(if $always || had.iter().any(|had| had == $field) {
                    let part = saved.fields.get($field).and_then(|json| deserialize_field(json).ok());
                    part.into_iter().for_each(|part| self.$part = part);
                })*
            }

            fn parts(&self) -> serde_json::Result<Vec<(String, String)>> {
                Ok(vec![$(($field.to_owned(), serialize_field(&self.$part)?)),*])
            }

            fn restore_parts(&self, params: &PromenadeParams) {
                $(if params.$($held).+.get().0 != self.$part {
                    params.$($held).+.$take(self.$part.clone());
                })*
                params.sources.follow();
            }
        }
    };
}

parts! {
    matching: Matching = "matching", matching, supersede, true;
    scene: SceneKey = "scene", scene_key, restore, true;
    room: Option<DrawnRoom> = "room", room, restore, true;
    walk: SavedWalk = "walk", saved_walk, restore, true;
    source_walks: SavedSourceWalks = "walks", source_walks, restore, false;
    sources: SavedSources = "sources", sources.saved, supersede, false;
    head: SavedHead = "head", head, restore, false;
}

impl UserState {
    /// The present state.
    pub fn of(params: &PromenadeParams) -> Self {
        let value = |parameter| match parameter {
            Parameter::Source(_) if !params.has(parameter) => parameter.row().default,
            _ if is_for_sound(parameter) => params.heard(parameter),
            _ => 0.0,
        };
        Self::with_values(Parameter::EVERY.map(value), params)
    }

    /// What a saved state holds; what it lacks is as in `base`.
    pub fn from_saved(mut saved: PluginState, base: &Self) -> Self {
        let had: Vec<_> = saved.fields.keys().cloned().collect();
        migrate(&mut saved);
        let mut state = base.clone();
        for parameter in Parameter::EVERY.into_iter().filter(|parameter| is_for_sound(*parameter)) {
            let (least, greatest) = parameter.limits();
            if let Some(value) = saved.params.get(parameter.id()).and_then(|value| plain(parameter, value)) {
                state.values[parameter.number()] = value.clamp(least, greatest);
            }
        }
        state.take_parts(&saved, &had);
        state
    }

    /// The plain value of a parameter.
    pub fn value(&self, parameter: Parameter) -> f32 {
        self.values[parameter.number()]
    }

    /// The camera path of the project.
    pub fn walk(&self) -> &SavedWalk {
        &self.walk
    }

    /// The scene's slot in the library, and its file.
    pub fn scene(&self) -> (u32, &SceneKey) {
        (u32::try_from(index(self.value(Parameter::Slot))).unwrap_or(0), &self.scene)
    }

    /// The state with another scene, from a file, and the listener where the scene's makers let it begin.
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
        migrate(saved);
        for parameter in Parameter::EVERY.into_iter().filter(|parameter| is_for_sound(*parameter)) {
            // An instance of one source has none of those.
            if matches!(parameter, Parameter::Source(_)) && !saved.params.contains_key(parameter.id()) {
                continue;
            }
            saved.params.insert(parameter.id().to_owned(), saved_value(parameter, self.value(parameter)));
        }
        saved.fields.extend(self.parts()?);
        Ok(())
    }

    /// Restores it: `set` is called for each parameter that differs, with its plain value.
    ///
    /// Scene and path go first, so that the choices by slot find what they belong to.
    pub fn restore(&self, params: &PromenadeParams, mut set: impl FnMut(Parameter, f32)) {
        self.restore_parts(params);
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
