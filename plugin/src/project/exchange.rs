//! What goes between the loader and whoever asks it for something; no part of the project.

use super::{file_wish::FileWish, params::PromenadeParams, persisted::Report, scene_frame::SceneFrame};
use crate::budget::limit::limit_percent;
use crate::library::front;
use crate::parameter::Parameter;
use crate::parameter::choices::{AccuracyChoice, LatencyChoice, SceneChoice};
use crate::worker::flag::Flag;
use nice_plug::prelude::Enum;
use std::sync::Mutex;

/// One instance's wishes to the loader, and the loader's reports.
#[derive(Default)]
pub struct Exchange {
    /// What is wrong with the scene.
    pub scene_report: Report,
    /// Why further sources are not heard.
    pub sources_report: Report,
    /// What is wrong with the camera path.
    pub walk_report: Report,
    /// What is wrong with the paths of sources.
    pub source_walks_report: Report,
    /// What is wrong with the head.
    pub head_report: Report,
    /// Name of the head that is heard; empty for the scene's own.
    pub head_name: Report,
    /// A head that has been asked for.
    pub head_wish: FileWish,
    /// What is wrong with the file of headphones.
    pub headphones_report: Report,
    /// Headphones that have been asked for.
    pub headphones_wish: FileWish,
    /// Where listener and emitter of the scene begin.
    pub frame: Mutex<SceneFrame>,
    /// A scene file was opened: the listener begins where it lets it, unless somebody has moved it.
    pub opened: Flag,
    /// A whole state is being restored, with a place of its own for the listener.
    pub restoring: Flag,
}

/// The choices of files; a change sends the loader to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choices {
    /// Where the scene comes from.
    pub scene: SceneChoice,
    /// Scene file of the library, 0 for the project's own.
    pub scene_slot: u32,
    /// Camera path file of the library, 0 for the project's own.
    pub walk_slot: u32,
    /// Whether a stereo input's channels have emitters of their own.
    pub stereo: bool,
    /// How late the sound is.
    pub latency: LatencyChoice,
    /// How near to all of the scene it stays.
    pub accuracy: AccuracyChoice,
    /// Whether there is a budget.
    pub limited: bool,
    /// How many searches for what less of a scene costs have ended.
    pub fronts: u32,
    /// How often a head has been asked for.
    pub heads: u32,
    /// How often headphones have been asked for.
    pub headphones: u32,
    /// How often the drawn room has changed.
    pub rooms: u32,
    /// How often the level of scenes has changed.
    pub levels: u32,
}

impl Exchange {
    /// The choices of files as they are now.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn choices(&self, params: &PromenadeParams) -> Choices {
        let slot = |parameter| u32::try_from(params.index(parameter)).unwrap_or(0);
        Choices {
            scene: SceneChoice::from_index(params.index(Parameter::Scene)),
            scene_slot: slot(Parameter::Slot),
            walk_slot: slot(Parameter::Walk),
            stereo: params.heard(Parameter::Spread) > 0.0,
            latency: LatencyChoice::from_index(params.index(Parameter::Latency)),
            accuracy: AccuracyChoice::from_index(params.index(Parameter::Accuracy)),
            limited: limit_percent().is_some(),
            fronts: front::ended(),
            heads: self.head_wish.asked(),
            headphones: self.headphones_wish.asked(),
            rooms: params.room.changes(),
            levels: params.matching.changes(),
        }
    }
}
