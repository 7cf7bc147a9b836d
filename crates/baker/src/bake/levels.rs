//! Responses that were normalised one by one, brought back to the levels that they have in one room.

use crate::bake::layout::{Layout, SAME_PLACE_M};
use crate::sources::responses::{Levels, Response, Responses};
use promenade_metrics::onset;
use std::borrow::Cow;

/// The late sound, seconds after the onset, ...
const LATE_S: (f64, f64) = (0.08, 0.28);
/// ... and the shortest piece of it that has a level, seconds.
const SHORTEST_S: f64 = 0.04;
/// Where its level is taken, Hz.
const BAND_HZ: (f64, f64) = (500.0, 4000.0);
/// It is this much over the end of the response, as a ratio of energies (6 dB), or it is noise.
const OVER_NOISE: f64 = 4.0;
/// In one place the late level hardly depends on the direction. Where its standard deviation over directions is more than this,
/// dB, responses were not left as they were measured.
const MOST_DB: f64 = 1.5;
/// Responses that a place has at least, to be asked.
const FEWEST: usize = 4;

/// Responses at the levels that they have in one room, and what was done about it, in words; `used` are those that say how loud
/// the room is.
pub(crate) fn levelled<'a>(responses: &'a Responses, layout: &Layout, used: &[usize]) -> (Cow<'a, Responses>, Option<String>) {
    if responses.levels == Some(Levels::Measured) {
        return (Cow::Borrowed(responses), None);
    }
    let late: Vec<Option<f64>> =
        responses.responses.iter().map(|response| late_db(response, responses.sample_rate_hz)).collect();
    let mean_db = |at: usize| {
        let same = |i: &&usize| layout.sites[**i].position.distance(layout.sites[at].position) < SAME_PLACE_M;
        let levels: Vec<f64> = used.iter().filter(same).filter_map(|i| late[*i]).collect();
        (levels.len() >= FEWEST).then(|| levels.iter().sum::<f64>() / levels.len() as f64)
    };
    let off_db = |at: usize| Some(late[at]? - mean_db(at)?);
    let known: Vec<f64> = used.iter().filter_map(|i| off_db(*i)).collect();
    let deviation_db = (known.iter().map(|db| db * db).sum::<f64>() / known.len().max(1) as f64).sqrt();
    if responses.levels.is_none() && deviation_db <= MOST_DB {
        return (Cow::Borrowed(responses), None);
    }
    let mut even = responses.clone();
    for (i, response) in even.responses.iter_mut().enumerate() {
        let gain = 10.0_f64.powf(-0.05 * off_db(i).unwrap_or(0.0)) as f32;
        response.left.iter_mut().chain(&mut response.right).for_each(|sample| *sample *= gain);
    }
    let note = format!(
        "late levels of a place differ by {deviation_db:.1} dB from one direction to another (standard deviation), as where \
         each response was normalised by itself: each was given one gain, by its late level"
    );
    (Cow::Owned(even), Some(note))
}

/// Level of the late sound of both ears, dB; `None` where there is none above the noise.
fn late_db(response: &Response, rate_hz: f64) -> Option<f64> {
    let start = onset(&response.left)?.min(onset(&response.right)?);
    let sample = |seconds: f64| (seconds * rate_hz) as usize;
    let len = response.left.len();
    let late = start + sample(LATE_S.0)..(start + sample(LATE_S.1)).min(len);
    if late.len() < sample(SHORTEST_S) {
        return None;
    }
    let density = |range: std::ops::Range<usize>| -> f64 {
        let n = range.len().next_power_of_two();
        let bin = |hz: f64| ((hz * n as f64 / rate_hz).round() as usize).min(n / 2);
        let energy = |ear: &[f32]| -> f64 {
            let piece = ear[range.clone()].iter().map(|v| f64::from(*v));
            promenade_fourier::spectrum(piece, n)[bin(BAND_HZ.0)..bin(BAND_HZ.1)].iter().map(|x| x.norm_sqr()).sum()
        };
        // By Parseval's theorem a sum over bins grows with the transform's length.
        (energy(&response.left) + energy(&response.right)) / (range.len() as f64 * n as f64)
    };
    let (found, end) = (density(late), density(len - len / 10..len));
    (found > OVER_NOISE * end).then(|| 10.0 * found.log10())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use promenade_core::glam;
    use promenade_core::{Pose, random::Random};

    /// A ring of responses of a made room, each times a gain.
    fn ring(gain: impl Fn(usize) -> f32) -> Responses {
        let rate = 16_000.0;
        let response = |i: usize| {
            let mut random = Random::new(i as u64);
            let mut ear = || -> Vec<f32> {
                let decay = |n: usize| 10.0_f32.powf(-3.0 * n as f32 / (0.4 * rate as f32));
                let mut samples: Vec<f32> = (0..8_000).map(|n| gain(i) * 0.1 * decay(n) * (random.uniform() - 0.5)).collect();
                samples[10] = gain(i);
                samples
            };
            let listener = Pose::from_ypr(Vec3::ZERO, (15.0 * i as f32).to_radians(), 0.0, 0.0);
            Response { listener, source: 2.0 * Vec3::X, left: ear(), right: ear(), name: i.to_string() }
        };
        Responses { sample_rate_hz: rate, responses: (0..24).map(response).collect(), ..Responses::default() }
    }

    fn spread_db(set: &Responses) -> f64 {
        let levels: Vec<f64> = set.responses.iter().map(|r| late_db(r, set.sample_rate_hz).unwrap()).collect();
        levels.iter().copied().fold(f64::MIN, f64::max) - levels.iter().copied().fold(f64::MAX, f64::min)
    }

    #[test]
    fn responses_normalised_one_by_one_are_brought_to_one_level() {
        let sideways = |i: usize| 1.0 - 0.5 * (15.0 * i as f32).to_radians().sin().abs();
        let mut set = ring(sideways);
        let used: Vec<usize> = (0..24).step_by(2).collect();
        let layout = Layout::of(&set).unwrap();
        assert!(spread_db(&set) > 5.0);
        let (even, note) = levelled(&set, &layout, &used);
        assert!(spread_db(&even) < 0.01 && note.unwrap().contains("differ by"), "held-out ones too");
        set.levels = Some(Levels::Measured);
        assert!(matches!(levelled(&set, &layout, &used), (Cow::Borrowed(_), None)));
    }

    #[test]
    fn a_room_as_it_was_measured_stays() {
        let mut set = ring(|_| 1.0);
        let (layout, used) = (Layout::of(&set).unwrap(), (0..24).collect::<Vec<_>>());
        assert!(matches!(levelled(&set, &layout, &used), (Cow::Borrowed(_), None)));
        set.levels = Some(Levels::Even);
        assert!(spread_db(&levelled(&set, &layout, &used).0) < 0.01, "asked for");
        // Where responses are over before the late sound begins, nothing is known.
        set.responses.iter_mut().flat_map(|r| [&mut r.left, &mut r.right]).for_each(|ear| ear.truncate(1_400));
        let short = levelled(&set, &layout, &used).0;
        assert_eq!(*short, set);
    }
}
