//! The direct sound of one clip, found with the help of the dry sound.

use promenade_metrics::{Arrival, arrival, deconvolve};

/// Dry sound before a clip that still sounds in it, seconds.
pub const DIRECT_PRE_ROLL_S: f64 = 0.5;
/// The direct sound comes within this of the dry sound, before it where the two are badly aligned, seconds.
const EARLIEST_S: f64 = 0.03;
const LATEST_S: f64 = 0.15;
/// The room sounds on for so long, seconds: without it all that is late would be taken for noise.
const ROOM_S: f64 = 0.5;

/// The direct sound of what the ears heard of a dry sound that begins `pre_roll` samples earlier, its time being that after the
/// dry sound; `None` where there is none. Of a pre-roll of [`DIRECT_PRE_ROLL_S`] all counts.
#[must_use]
pub fn direct_sound(dry: &[f32], pre_roll: usize, ears: [&[f32]; 2], rate: f64) -> Option<Arrival> {
    let [before, first, room] = [EARLIEST_S, EARLIEST_S + LATEST_S, ROOM_S].map(|s| (s * rate) as usize);
    let length = room.min(3 * ears[0].len() / 4).max(first);
    let responses = deconvolve(dry, pre_roll, ears, before, length)?;
    let found = arrival(responses.each_ref().map(|h| &h[..first]), rate)?;
    Some(Arrival { time_s: found.time_s - before as f64 / rate, ..found })
}
