//! Further sounds of `promenade render`, each from its place in the room.

use crate::args::{Place, RenderArgs};
use crate::{path, report};
use anyhow::{Context, Result};
use promenade_baker::player::{Source, Voice};
use promenade_core::Scene;
use promenade_paths::ImportOptions;
use std::path::Path;

/// Opens them at a sample rate, Hz.
pub(super) fn open(args: &RenderArgs, scene: &Scene, rate_hz: u32) -> Result<Vec<Voice>> {
    args.source.iter().map(|(place, sound)| one(place, sound, scene, rate_hz)).collect()
}

fn one(place: &Place, sound: &Path, scene: &Scene, rate_hz: u32) -> Result<Voice> {
    let emitter = scene.emitter().context("--source: expected a scene that knows where its emitter is")?;
    let sound = Source::open(sound, Some(rate_hz))?;
    match place {
        Place::Point(point) => {
            let offset = *point - emitter;
            Ok(Voice::new(sound, move |_| offset))
        }
        Place::Path(file) => {
            let imported = path::read(file, &ImportOptions::default())?;
            report::notes(&imported.notes);
            Ok(Voice::new(sound, move |seconds| imported.path.pose_at(seconds).position - emitter))
        }
    }
}
