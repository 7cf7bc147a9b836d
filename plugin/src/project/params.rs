//! Everything that a host sets or saves, and nothing else.

use crate::budget::limit::SavedLimit;
use crate::library::{drawn_room::DrawnRoom, scene_key::SceneKey};
use crate::parameter::choices::{Follow, LatencyChoice, SceneChoice};
use crate::parameter::{Parameter, cast::index, remote::Remote, source_knob::Part};
use crate::project::{
    hosted::Hosted, leader::GroupLeader, matching::Matching, osc_config::OscConfig, persisted::Persisted,
    project_id::ProjectId, saved_head::SavedHead, saved_headphones::SavedHeadphones, settings::EditorSettings,
    slots::ProjectSlots, source_walks::SavedSourceWalks, sources::ProjectSources, state::StateVersion, walk::SavedWalk,
};
use nice_plug::prelude::*;

/// The revision after which counting begins anew.
pub const REVISIONS: i32 = 9_999;

/// Everything a host can set or save. The ids never change; [`Parameter`] describes them, `docs/parameters.md` lists them.
#[derive(Params)]
pub struct PromenadeParams {
    /// Those that the instance has, by their numbers.
    all: Vec<Hosted>,
    /// Counts what the editor changes beside the parameters, so that the host knows that the project has changed.
    #[id = "revision"]
    pub revision: IntParam,
    /// The version of the saved state.
    #[persist = "version"]
    pub state_version: StateVersion,
    /// Which project the instance belongs to.
    #[persist = "project"]
    pub project: ProjectId,
    /// What moved the leader of the group, which is followed where none leads.
    #[persist = "leader"]
    pub leader: GroupLeader,
    /// The library's files that slots stand for.
    #[persist = "slots"]
    pub slots: ProjectSlots,
    /// The library scene that the project plays.
    #[persist = "scene"]
    pub scene_key: Persisted<SceneKey>,
    /// The camera path of the project.
    #[persist = "walk"]
    pub saved_walk: Persisted<SavedWalk>,
    /// The paths of the sources.
    #[persist = "walks"]
    pub source_walks: Persisted<SavedSourceWalks>,
    /// Names and colours of the sources, and which of them are heard.
    #[persist = "sources"]
    pub sources: ProjectSources,
    /// The user's own head, where it takes the place of the scene's.
    #[persist = "head"]
    pub head: Persisted<SavedHead>,
    /// What the listener's headphones need.
    #[persist = "headphones"]
    pub headphones: Persisted<SavedHeadphones>,
    /// The room that the user has drawn, the project's own scene where there is one.
    #[persist = "room"]
    pub room: Persisted<Option<DrawnRoom>>,
    /// At which level scenes are played.
    #[persist = "matching"]
    pub matching: Persisted<Matching>,
    /// How Open Sound Control is set up.
    #[persist = "osc"]
    pub osc: Persisted<OscConfig>,
    /// Values that have come over Open Sound Control and stand in place of the host's; a restored state puts them into its
    /// parameters.
    #[persist = "remote"]
    pub remote: Remote,
    /// The budget of processor time, which all instances share.
    #[persist = "budget"]
    pub budget: SavedLimit,
    /// How the editor was left.
    #[persist = "editor"]
    pub editor: Persisted<EditorSettings>,
}

impl Default for PromenadeParams {
    fn default() -> Self {
        Self::beginning_on(None)
    }
}

impl PromenadeParams {
    /// Defaults; with a camera path, defaults that follow it along the transport.
    pub fn beginning_on(walk: Option<&SavedWalk>) -> Self {
        let slots = ProjectSlots::default();
        let begun = Self {
            all: Parameter::ALL.into_iter().map(|of| Hosted::new(of, of.row().default, &slots)).collect(),
            slots,
            revision: IntParam::new("Revision", 0, IntRange::Linear { min: 0, max: REVISIONS }).hide().non_automatable(),
            state_version: StateVersion,
            project: ProjectId::default(),
            leader: GroupLeader::default(),
            scene_key: Persisted::new(SceneKey::loft()),
            saved_walk: Persisted::new(walk.cloned().unwrap_or_default()),
            source_walks: Persisted::default(),
            sources: ProjectSources::default(),
            head: Persisted::default(),
            headphones: Persisted::default(),
            room: Persisted::default(),
            matching: Persisted::default(),
            osc: Persisted::default(),
            remote: Remote::default(),
            budget: SavedLimit,
            editor: Persisted::default(),
        };
        if walk.is_some() { begun.beginning_with(Parameter::Follow, Follow::Transport) } else { begun }
    }

    /// The parameters of an instance with so many further sources, at most
    /// [`MOST_FURTHER`](crate::parameter::source_knob::MOST_FURTHER).
    pub fn with_further(mut self, count: usize) -> Self {
        self.all.extend(
            Parameter::of_instance(count).skip(self.all.len()).map(|of| Hosted::new(of, of.row().default, &self.slots)),
        );
        self
    }

    /// The parameters with another latency to begin with.
    pub fn beginning_at(self, latency: LatencyChoice) -> Self {
        self.beginning_with(Parameter::Latency, latency)
    }

    fn beginning_with(mut self, choice: Parameter, variant: impl Enum) -> Self {
        self.all[choice.number()] = Hosted::new(choice, variant.to_index() as f32, &self.slots);
        self
    }

    /// How many further sources the instance has.
    pub fn further(&self) -> usize {
        (self.all.len() - Parameter::ALL.len()) / Part::ALL.len()
    }

    /// All parameters that the instance has, but the revision.
    pub fn parameters(&self) -> impl Iterator<Item = Parameter> + use<> {
        Parameter::of_instance(self.further())
    }

    /// Whether the instance has a parameter.
    pub fn has(&self, parameter: Parameter) -> bool {
        parameter.number() < self.all.len()
    }

    /// A parameter that the instance has, as the framework holds it.
    pub(crate) fn of(&self, parameter: Parameter) -> &Hosted {
        &self.all[parameter.number()]
    }

    /// Whether the parameters choose the project's own scene, not a built-in one or a file of the library.
    pub fn chooses_own_scene(&self) -> bool {
        SceneChoice::from_index(self.index(Parameter::Scene)) == SceneChoice::Library && self.index(Parameter::Slot) == 0
    }

    /// How often a host has restored the parts of a state that say what is played and where the listener is. They come one
    /// after the other: a scene that changes between two of them was not chosen for itself.
    pub fn restores(&self) -> u64 {
        let Self { scene_key, room, head, matching, remote, .. } = self;
        scene_key.restores() + room.restores() + head.restores() + matching.restores() + remote.restores()
    }

    /// A parameter's plain value as the host has it.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn hosted(&self, parameter: Parameter) -> f32 {
        self.of(parameter).plain()
    }

    /// A parameter's plain value as it is heard: what came last, from the host or over Open Sound Control.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn heard(&self, parameter: Parameter) -> f32 {
        self.remote.latest(parameter, self.hosted(parameter))
    }

    /// Whether Open Sound Control is switched on.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn receives_osc(&self) -> bool {
        self.heard(Parameter::Osc) > 0.5
    }

    /// The index of a choice, or a slot's number.
    pub(crate) fn index(&self, parameter: Parameter) -> usize {
        index(self.heard(parameter))
    }
}
