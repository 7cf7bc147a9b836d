//! What options name, opened: the scene, the listener's walk, the player with all that it plays.

use super::options::{Options, Place};
use super::read::{read_path, read_scene};
use super::terminal;
use crate::error::of;
use crate::{Player, PlayerError, Source, Voice, read_head, read_headphones};
use promenade_audio::FileError;
use promenade_core::glam::Vec3;
use promenade_core::{Audible, CameraPath, LiveParams, Playback, Pose, Scene};
use promenade_judge::trade::scene_within;
use promenade_paths::ImportOptions;
use std::path::PathBuf;
use std::sync::Arc;

/// Farther than this outside of a small scene, metres, or than half of its diagonal, is far.
const FAR_M: f32 = 2.0;

/// Where the listener is over time.
pub(super) enum Walk {
    Still(Pose),
    Along(CameraPath, Playback),
}

impl Walk {
    pub(super) fn pose_at(&self, seconds: f64) -> Pose {
        match self {
            Self::Still(pose) => *pose,
            Self::Along(path, playback) => path.pose_after(seconds, *playback),
        }
    }
}

/// The scene with the head and the emitter that are asked for.
pub(super) fn scene(options: &Options) -> Result<Arc<Scene>, PlayerError> {
    let mut scene = read_scene(&options.files[0])?;
    if let Some(jnds) = options.within {
        let (kept, point) = scene_within(&scene, jnds, &|| true).map_err(of(&options.files[0]))?;
        let Audible { jnds, measure } = point.error;
        terminal::note(format_args!(
            "--within: {:.0} % of the operations of all of the scene, {jnds:.2} JND by {}",
            100.0 * point.cost,
            measure.name()
        ));
        scene = kept;
    }
    if let Some(file) = &options.head {
        let head = read_head(file)?;
        terminal::notes(head.notes());
        let heard = scene.with_head(&head).map_err(of(&options.files[0]))?;
        scene = Arc::new(heard);
    }
    if let Some(position) = options.emitter {
        let expected = "a scene that was trained with several emitters";
        let moved = scene.with_emitter(position)?;
        let moved = moved.ok_or_else(|| PlayerError::argument("--emitter", expected, "one that holds for its own"));
        scene = Arc::new(moved.map_err(of(&options.files[0]))?);
    }
    Ok(scene)
}

/// Where the listener is; a place that is far outside of the scene is told.
pub(super) fn walk(options: &Options, scene: &Scene) -> Result<Walk, PlayerError> {
    let Some(file) = &options.path else {
        let pose = options.pose.unwrap_or_else(|| scene.start_pose());
        tell_outside("--pose", scene, [pose]);
        return Ok(Walk::Still(pose));
    };
    let imported = read_path(file, &ImportOptions::default())?;
    terminal::notes(&imported.notes);
    tell_outside("--path", scene, imported.path.keyframes().iter().map(|keyframe| keyframe.pose));
    Ok(Walk::Along(imported.path, Playback { speed: options.speed.unwrap_or(1.0), looping: options.looping }))
}

/// Says how far outside of the scene the farthest of poses is, if that is far.
fn tell_outside(option: &str, scene: &Scene, poses: impl IntoIterator<Item = Pose>) {
    let (low, high) = scene.bounds();
    let outside = |pose: Pose| pose.position.distance(pose.position.clamp(low, high));
    let farthest = poses.into_iter().map(outside).fold(0.0, f32::max);
    if farthest > FAR_M.max(0.5 * low.distance(high)) {
        let corner = |v: Vec3| format!("{:.1},{:.1},{:.1}", v.x, v.y, v.z);
        let (low, high) = (corner(low), corner(high));
        terminal::note(format_args!(
            "{option}: {farthest:.1} m outside of the scene, known from {low} to {high} m: what is heard there is a guess"
        ));
    }
}

/// A player of the scene for a sound.
pub(super) fn player(options: &Options, scene: &Arc<Scene>, source: &Source) -> Result<Player, PlayerError> {
    let spread = options.stereo_spread;
    if spread != 0.0 && source.channels() != 2 {
        let expected = "2 channels for --stereo-spread";
        return Err(FileError::content(&options.files[1], expected, source.channels().to_string()));
    }
    let rate_hz = source.sample_rate_hz();
    let voices = options.sources.iter().map(|source| voice(source, scene, rate_hz)).collect::<Result<_, _>>()?;
    let player = Player::at_latency(scene, f64::from(rate_hz), options.playing, options.latency)
        .and_then(|player| {
            let rate_hz = options.decode_rate_hz.unwrap_or(LiveParams::default().rate_hz);
            player.with_decode_rate(rate_hz).with_trim(options.trim)
        })
        .and_then(|player| player.with_voices(voices)?.with_stereo_spread(spread))
        .map_err(of(&options.files[0]))?;
    match &options.headphones {
        Some(file) => Ok(player.with_headphones(&read_headphones(file)?)),
        None => Ok(player),
    }
}

/// A further sound at a sample rate, Hz.
fn voice((place, gain, sound): &(Place, f32, PathBuf), scene: &Scene, rate_hz: u32) -> Result<Voice, PlayerError> {
    let expected = "a scene that knows where its emitter is";
    let emitter = scene.emitter().ok_or_else(|| PlayerError::argument("--further", expected, "one that does not"))?;
    let sound = Source::open(sound, Some(rate_hz))?;
    let voice = match place {
        Place::Point(point) => {
            let offset = *point - emitter;
            Voice::new(sound, move |_| offset)
        }
        Place::Path(file) => {
            let imported = read_path(file, &ImportOptions::default())?;
            terminal::notes(&imported.notes);
            Voice::new(sound, move |seconds| imported.path.pose_at(seconds).position - emitter)
        }
    };
    Ok(voice.with_level(*gain))
}
