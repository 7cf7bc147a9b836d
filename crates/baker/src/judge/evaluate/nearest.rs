//! Baselines made of the training recordings: the nearest one itself, and what it did to its dry sound.

use super::Method;
use crate::signal::convolve::shape;
use crate::{BakeError, Capture, Clip, Split};
use promenade_core::Pose;
use promenade_metrics::band_powers;
use promenade_player::Ears;

/// A radian of turning counts like so many metres.
const METRES_PER_RADIAN: f32 = 1.0;
/// Lowest edge of the third-octaves, hertz.
const LOWEST_HZ: f64 = 44.5;
/// Bands whose dry sound is further below the loudest say nothing, dB.
const AUDIBLE_DB: f64 = 60.0;
/// Dry sound before a clip that is filtered with it, seconds, so that filters have settled.
const PRE_ROLL_S: f64 = 0.25;

/// How far apart two listeners are: metres between their heads, and the angle between them, a radian counting as a metre.
fn apart(a: &Pose, b: &Pose) -> f32 {
    a.position.distance(b.position) + METRES_PER_RADIAN * a.orientation.angle_between(b.orientation)
}

/// The training clip whose pose is nearest.
fn nearest<'a>(capture: &'a Capture, pose: &Pose) -> Option<&'a Clip> {
    capture.split(Split::Train).min_by(|a, b| apart(&a.pose, pose).total_cmp(&apart(&b.pose, pose)))
}

fn cut(ear: &[f32], len: usize) -> Vec<f32> {
    let mut ear = ear.to_vec();
    ear.resize(len, 0.0);
    ear
}

/// The nearest training recording itself, whatever was said in it.
pub(super) struct NearestRecording;

impl Method for NearestRecording {
    fn name(&self) -> &'static str {
        "nearest-recording"
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        let found = nearest(capture, &clip.pose);
        Ok(found.map_or_else(|| [vec![0.0; clip.len], vec![0.0; clip.len]], |n| capture.binaural(n).map(|e| cut(e, clip.len))))
    }
}

/// The dry sound with the energy ratios of wet over dry, ear by ear and third-octave by third-octave, of the nearest training
/// clip.
pub(super) struct NearestTransfer;

impl Method for NearestTransfer {
    fn name(&self) -> &'static str {
        "nearest-transfer"
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        let rate = capture.sample_rate_hz;
        let before = (PRE_ROLL_S * rate) as usize;
        let Some(found) = nearest(capture, &clip.pose) else {
            return Ok([vec![0.0; clip.len], vec![0.0; clip.len]]);
        };
        let bands = third_octaves(rate);
        let dry = band_powers(&capture.dry(found, 0), rate, &bands);
        let [left, right] = capture.binaural(found).map(|ear| gains_db(&dry, &band_powers(ear, rate, &bands)));
        let middles: Vec<f64> = bands.iter().map(|(low, high)| (low * high).sqrt().ln()).collect();
        let at = |gains: &[f64], hz: f64| {
            let gain = 10.0_f64.powf(between(&middles, gains, hz.max(1e-3).ln()) / 20.0) as f32;
            gain.into()
        };
        let ears = shape(&capture.dry(clip, before), rate, |hz| [at(&left, hz), at(&right, hz)]);
        Ok(ears.map(|mut ear| ear.split_off(before)))
    }
}

/// Edges of the third-octaves below half of a sample rate, hertz.
fn third_octaves(sample_rate_hz: f64) -> Vec<(f64, f64)> {
    let third = 2.0_f64.powf(1.0 / 3.0);
    let edges = (0..).map(|b| LOWEST_HZ * third.powi(b)).take_while(|low| low * third <= sample_rate_hz / 2.0);
    edges.map(|low| (low, low * third)).collect()
}

/// Level of wet over dry, dB; a band that the dry sound does not excite takes the value of the nearest that it does.
fn gains_db(dry: &[f64], wet: &[f64]) -> Vec<f64> {
    let loudest = dry.iter().fold(0.0_f64, |m, v| m.max(*v));
    let heard: Vec<usize> = (0..dry.len()).filter(|&b| dry[b] > loudest * 10.0_f64.powf(-AUDIBLE_DB / 10.0)).collect();
    (0..dry.len())
        .map(|b| {
            let near = heard.iter().min_by_key(|h| h.abs_diff(b));
            near.map_or(0.0, |&n| 10.0 * ((wet[n] + 1e-20) / dry[n]).log10())
        })
        .collect()
}

/// A value between those at rising places; the ends hold beyond the ends.
fn between(places: &[f64], values: &[f64], at: f64) -> f64 {
    match places.partition_point(|p| *p <= at) {
        0 => values.first().copied().unwrap_or(0.0),
        n if n == places.len() => values.last().copied().unwrap_or(0.0),
        n => {
            let share = (at - places[n - 1]) / (places[n] - places[n - 1]);
            values[n - 1] + share * (values[n] - values[n - 1])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_hold_beyond_the_ends() {
        let of = |at| between(&[1.0, 2.0, 4.0], &[10.0, 20.0, 0.0], at);
        assert_eq!([of(0.0), of(1.5), of(3.0), of(9.0)], [10.0, 15.0, 10.0, 0.0]);
        assert_eq!(gains_db(&[1.0, 0.0, 4.0], &[1.0, 5.0, 0.4])[1], 0.0, "nothing was played there");
        assert!((gains_db(&[1.0, 0.0, 4.0], &[1.0, 5.0, 0.4])[2] + 10.0).abs() < 1e-9);
    }
}
