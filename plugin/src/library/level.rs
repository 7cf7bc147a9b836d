//! How loud a scene is: what it makes of a dry sound where its listener begins.

use crate::library::cache::ContentHash;
use crate::parameter::cast::narrow;
use crate::worker::lock::lock;
use promenade_core::{BlockParams, Scene};
use promenade_player::Stream;
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex};

/// What comes later adds little to the level, seconds.
const LONGEST_S: f64 = 0.5;
/// The level is that of a sound which falls by 6 dB an octave from here on, as voices and instruments do, Hz.
const CORNER_HZ: f64 = 700.0;

/// Levels that were worked out, by content.
static KNOWN: LazyLock<Mutex<HashMap<ContentHash, Option<i32>>>> = LazyLock::new(Mutex::default);

/// The level of the scene of a content, worked out once in the process; see [`level_cb`].
pub fn level_of(scene: &Arc<Scene>, hash: &str) -> Option<i32> {
    if let Some(known) = lock(&KNOWN).get(hash) {
        return *known;
    }
    let level = level_cb(scene);
    lock(&KNOWN).insert(hash.to_owned(), level);
    level
}

/// The level of both ears' mean over that of the dry sound, in tenths of a decibel; none where it is silent or cannot be
/// played.
pub fn level_cb(scene: &Arc<Scene>) -> Option<i32> {
    let rate_hz = scene.grid().sample_rate_hz;
    let mut stream = Stream::new(scene, rate_hz, &BlockParams::default()).ok()?;
    let ears = stream.respond(scene.start_pose(), LONGEST_S, &|| true)?;
    let energy = ears.iter().map(|ear| weighted(ear, rate_hz)).sum::<f64>() / ears.len() as f64;
    let mut impulse = vec![0.0; ears[0].len()];
    *impulse.first_mut()? = 1.0;
    let level_db = 10.0 * (energy / weighted(&impulse, rate_hz)).log10();
    #[expect(clippy::cast_possible_truncation, reason = "a level in tenths")]
    level_db.is_finite().then(|| (10.0 * level_db).round() as i32)
}

/// The gain of a level in tenths of a decibel.
pub fn gain_of(level_cb: i32) -> f32 {
    narrow(10_f64.powf(f64::from(level_cb) / 200.0))
}

/// Energy below a corner, with what is above falling by 6 dB an octave.
fn weighted(signal: &[f32], rate_hz: f64) -> f64 {
    let share = 1.0 - (-std::f64::consts::TAU * CORNER_HZ / rate_hz).exp();
    let mut low = 0.0;
    let mut energy = 0.0;
    for sample in signal {
        low += share * (f64::from(*sample) - low);
        energy += low * low;
    }
    energy
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room;

    #[test]
    fn a_louder_room_has_a_higher_level() {
        let [soft, loud] = [0.02, 0.2].map(|tail| level_cb(&room(16_000.0, 0.4, tail)).unwrap());
        assert!(loud > soft + 10, "{soft} and {loud} tenths of a decibel");
        assert!((gain_of(-60) - 0.501).abs() < 1e-3);
    }
}
