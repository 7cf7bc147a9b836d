use super::*;

pub(crate) fn with(parameter: Parameter, value: f32) -> UserState {
    let mut state = UserState::of(&PromenadeParams::default());
    state.values[parameter.number()] = value;
    state
}

#[test]
fn a_saved_state_is_read_and_what_it_lacks_stays() {
    let params = [
        ("x", ParamValue::F32(2.5)),
        ("yaw", ParamValue::F32(1e9)),
        ("follow", ParamValue::String("transport".to_owned())),
        ("bypass", ParamValue::Bool(true)),
        ("slot", ParamValue::I32(7)),
        ("group", ParamValue::String("no such".to_owned())),
    ];
    let state = PluginState {
        version: String::new(),
        params: params.map(|(id, value)| (id.to_owned(), value)).into_iter().collect(),
        fields: [("walk".to_owned(), r#"{"speed": 0.5}"#.to_owned())].into(),
    };
    let mut base = with(Parameter::Gain, -6.0);
    base.source_walks.set(3, Some(SavedWalk::default()));
    let restored = UserState::from_saved(state, &base);
    let found = [
        Parameter::X,
        Parameter::Yaw,
        Parameter::Follow,
        Parameter::Bypass,
        Parameter::Slot,
        Parameter::Group,
        Parameter::Gain,
    ]
    .map(|p| restored.value(p));
    assert_eq!(found, [2.5, 180.0, 2.0, 1.0, 7.0, 0.0, -6.0]);
    assert_eq!(restored.walk.speed, 0.5);
    assert!(restored.source_walks.of(3).is_some(), "a preset that knows no paths of sources leaves them");
}

#[test]
fn only_what_differs_is_set() {
    let params = PromenadeParams::default();
    let mut restored = with(Parameter::Pitch, 12.0);
    restored.walk.looping = true;
    restored.source_walks.set(1, Some(SavedWalk::default()));
    restored.room = Some(DrawnRoom::default());
    let mut set = Vec::new();
    restored.restore(&params, |parameter, value| set.push((parameter, value)));
    assert_eq!(set, [(Parameter::Pitch, 12.0)]);
    assert!(params.saved_walk.get().0.looping);
    assert!(params.source_walks.get().0.of(1).is_some());
    assert_eq!(params.room.get().0, Some(DrawnRoom::default()));
}

#[test]
fn put_into_a_saved_state_it_is_read_again_and_the_rest_stays() {
    let mut wanted = with(Parameter::Yaw, -20.0);
    wanted.walk.looping = true;
    wanted.source_walks.set(0, Some(SavedWalk::default()));
    wanted = wanted.in_scene(SceneKey { title: "Hall".to_owned(), ..SceneKey::default() }, Pose::IDENTITY);
    let fields = [("osc", r#"{"on": true}"#), ("remote", r#"{"gain": -3.0}"#)].map(|(n, json)| (n.to_owned(), json.to_owned()));
    let params = [("osc".to_owned(), ParamValue::Bool(true))];
    let mut saved =
        PluginState { version: String::new(), params: params.into_iter().collect(), fields: fields.into_iter().collect() };
    wanted.put_into(&mut saved).unwrap();
    assert!(matches!(saved.params["osc"], ParamValue::Bool(true)));
    let base = with(Parameter::Pitch, 3.0);
    assert_eq!(UserState::from_saved(saved, &base), wanted);
}
