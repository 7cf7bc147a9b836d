//! Saved states: their version, and how old and damaged ones are read.

use crate::library::{scene_key::SceneKey, slots::Slots};
use crate::parameter::{Parameter, cast::index, choices::Variants};
use crate::project::slots::SavedSlots;
use nice_plug::params::persist::{PersistentField, deserialize_field, serialize_field};
use nice_plug::plugin::{ParamValue, PluginState};
use serde_json::Value;
use std::collections::BTreeMap;

/// What fields stand for in states of before there were any: the scene's own head, no drawn room, scenes as loud as they are,
/// all sources heard, no leader, and sources without paths.
const FORMER: [(&str, &str); 6] =
    [("head", "\"\""), ("room", "null"), ("matching", "{}"), ("sources", "{}"), ("leader", "null"), ("walks", "{}")];
/// The scene of a new instance before the loft was built in.
const FORMER_SCENE: &str = "iosr-room-a";
/// The version of the states that this plugin writes.
pub const VERSION: u32 = 3;

/// Writes [`VERSION`] into every state.
#[derive(Default)]
pub struct StateVersion;

impl PersistentField<'_, u32> for StateVersion {
    fn set(&self, _saved: u32) {}

    fn map<F: Fn(&u32) -> R, R>(&self, f: F) -> R {
        f(&VERSION)
    }
}

/// Brings a saved state to the present version before it is read.
///
/// A state without a version is of version 1, the first. Version 2 added parameters and fields that are at their defaults where
/// a state lacks them, and at their defaults sound as version 1 did. Version 3 made a parameter of what switches Open Sound
/// Control on, and keeps what has come over it. A newer one is read as far as it is understood: unknown parameters and fields
/// are skipped by the reader. What the reader does not survive is dropped: numbers that are not finite could not be saved
/// again, and a choice by a number beyond its variants ends the host.
pub fn migrate(state: &mut PluginState) {
    let saved = state.fields.get("version").and_then(|json| deserialize_field::<u32>(json).ok()).unwrap_or(1);
    if saved > VERSION {
        nice_plug::nice_warn!("the state has version {saved}, this plugin knows {VERSION}: unknown parts are skipped");
    }
    // Versions 1 and 2 had the switch among the settings.
    let settings = state.fields.get("osc").and_then(|json| deserialize_field::<Value>(json).ok());
    if let Some(on) = settings.and_then(|settings| settings.get("on")?.as_bool()) {
        state.params.insert(Parameter::Osc.id().to_owned(), ParamValue::Bool(on));
    }
    for (field, json) in FORMER {
        state.fields.entry(field.to_owned()).or_insert_with(|| json.to_owned());
    }
    // States of before directions could say where sources are have them along the axes.
    let cartesian = || ParamValue::String("cartesian".to_owned());
    state.params.entry(Parameter::Place.id().to_owned()).or_insert_with(cartesian);
    // States of before slots kept their files have that of the one slot that is chosen.
    let saved = |field: &str| state.fields.get(field).and_then(|json| deserialize_field::<Value>(json).ok());
    if !state.fields.contains_key("slots") {
        let in_slot = |value: Option<Value>, name: &dyn Fn(&Value) -> Option<String>| {
            let value = value.unwrap_or_default();
            let slot = value["slot"].as_u64().and_then(|slot| u32::try_from(slot).ok()).unwrap_or(0);
            Slots::with(slot, &name(&value).unwrap_or_default())
        };
        let scenes = in_slot(saved("scene"), &|value| {
            serde_json::from_value::<SceneKey>(value.clone()).ok().map(|key| key.file_name().to_owned())
        });
        let walks = in_slot(saved("walk"), &|value| Some(value["name"].as_str()?.to_owned()));
        let slots = serialize_field(&SavedSlots { scenes, walks });
        state.fields.insert("slots".to_owned(), slots.unwrap_or_else(|_| "{}".to_owned()));
    }
    // The draft of before played no more than the direct sound and, in simulated rooms, eight reflections.
    let tier = state.params.remove("tier");
    if matches!(tier, Some(ParamValue::String(tier)) if tier == "draft") {
        for level in [Parameter::Early, Parameter::Late] {
            state.params.insert(level.id().to_owned(), saved_value(level, level.limits().0));
        }
    }
    // What was heard when the project was saved; without this field nothing would forget what has come since.
    let remote = state.fields.insert("remote".to_owned(), "{}".to_owned());
    let remote = remote.and_then(|json| deserialize_field::<BTreeMap<String, f32>>(&json).ok()).unwrap_or_default();
    for (id, value) in remote {
        if let Some(parameter) = Parameter::of_id(&id) {
            state.params.insert(id, saved_value(parameter, parameter.clamp(value)));
        }
    }
    state.params.retain(|id, value| match value {
        ParamValue::F32(number) => number.is_finite(),
        ParamValue::I32(_) => !is_choice(id),
        ParamValue::Bool(_) | ParamValue::String(_) => true,
    });
}

/// Has a project without a scene play what it was saved with: the scene of a new instance before the loft was built in.
pub fn keep_former_scene(state: &mut PluginState) {
    state.params.entry(Parameter::Scene.id().to_owned()).or_insert_with(|| ParamValue::String(FORMER_SCENE.to_owned()));
    state.fields.entry("scene".to_owned()).or_insert_with(|| "{}".to_owned());
}

/// A plain value as a state has it.
pub(crate) fn saved_value(parameter: Parameter, value: f32) -> ParamValue {
    match parameter.variants() {
        Some(Variants { ids, .. }) => ParamValue::String(ids[index(value).min(ids.len() - 1)].to_owned()),
        None if parameter.is_switch() => ParamValue::Bool(value > 0.5),
        #[expect(clippy::cast_possible_truncation, reason = "within the limits of a slot")]
        None if parameter.is_whole() => ParamValue::I32(value as i32),
        None => ParamValue::F32(value),
    }
}

/// Whether a parameter is a choice, which a state has as a text.
fn is_choice(id: &str) -> bool {
    Parameter::of_id(id).is_some_and(|parameter| parameter.variants().is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::choices::SceneChoice;
    use crate::playing::{loader::Loader, output::Output};
    use crate::project::params::PromenadeParams;
    use nice_plug::prelude::{Enum, ParamPtr, Params};
    use std::path::Path;
    use std::sync::Arc;

    #[test]
    fn what_is_no_number_and_choices_by_number_are_dropped() {
        let mut params = [("x", f32::INFINITY), ("y", 1.0)].map(|(id, v)| (id.to_owned(), ParamValue::F32(v))).to_vec();
        params.extend([("accuracy".to_owned(), ParamValue::I32(99)), ("slot".to_owned(), ParamValue::I32(3))]);
        let mut state = PluginState { version: String::new(), params: params.into_iter().collect(), fields: [].into() };
        migrate(&mut state);
        assert_eq!(state.params.keys().collect::<Vec<_>>(), ["place", "slot", "y"]);
    }

    #[test]
    fn what_is_wrong_is_reported_and_stays_out_of_the_state() {
        let _alone = crate::library::cache::alone();
        let params = Arc::new(PromenadeParams::default());
        let loader = Loader::new(Arc::clone(&params));
        loader.activate(48_000.0, Output::Binaural);
        let choose = |parameter, value| {
            params.remote.set(parameter, value, params.hosted(parameter));
            loader.refresh();
            let fields = params.serialize_fields();
            assert_eq!(
                fields.keys().collect::<Vec<_>>(),
                [
                    "budget",
                    "editor",
                    "head",
                    "headphones",
                    "leader",
                    "matching",
                    "osc",
                    "project",
                    "remote",
                    "room",
                    "scene",
                    "slots",
                    "sources",
                    "version",
                    "walk",
                    "walks"
                ]
            );
            loader.exchange.scene_report.text()
        };
        params.scene_key.restore(SceneKey {
            title: "Hall".to_owned(),
            absolute: "/nowhere/hall.promenade".into(),
            ..SceneKey::default()
        });
        let missing = choose(Parameter::Scene, SceneChoice::Library.to_index() as f32);
        assert!(missing.contains("Hall") && missing.contains("is missing"), "{missing}");
        let changed = SceneKey {
            hash: "1".repeat(64),
            absolute: Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes/iosr-room-b.promenade"),
            ..SceneKey::default()
        };
        params.scene_key.restore(changed);
        let changed = loader.exchange.scene_report.text();
        assert!(changed.contains("has changed"), "{changed}");
        let empty = choose(Parameter::Slot, 64.0);
        assert!(empty.contains("slot 64 is empty"), "{empty}");
        assert_eq!(choose(Parameter::Scene, 0.0), "");
        choose(Parameter::Walk, 64.0);
        assert!(loader.exchange.walk_report.text().contains("slot 64 is empty"), "{}", loader.exchange.walk_report.text());
    }

    #[test]
    fn a_state_of_before_slots_kept_their_files_has_those_that_it_plays() {
        let fields =
            [("scene", r#"{"slot": 20, "absolute": "/x/020.promenade"}"#), ("walk", r#"{"slot": 3, "name": "round"}"#)];
        let fields = fields.map(|(name, json)| (name.to_owned(), json.to_owned())).into();
        let mut state = PluginState { version: String::new(), params: [].into(), fields };
        migrate(&mut state);
        let slots: SavedSlots = deserialize_field(&state.fields["slots"]).unwrap();
        assert_eq!((slots.scenes.name(20), slots.walks.name(3)), (Some("020.promenade"), Some("round")));
    }

    #[test]
    fn every_choice_is_known_as_one() {
        let params = PromenadeParams::default();
        for parameter in params.parameters() {
            let choice = matches!(params.of(parameter).as_ptr(), ParamPtr::EnumParam(_));
            assert_eq!(is_choice(parameter.id()), choice, "{parameter:?}");
        }
    }
}
