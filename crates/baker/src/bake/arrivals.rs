//! Arrivals that contradict those of all other responses.

use crate::bake::direct::Direct;
use crate::sources::responses::Response;
use promenade_metrics::statistics::median_high;

/// A sphere in the place of a head, metres, and the speed of sound, metres a second.
const RADIUS_M: f64 = 0.0875;
const SOUND_M_S: f64 = 343.0;
/// The way of the sound explains arrivals if it leaves no more than this of half of them, seconds: files may have been cut one
/// by one.
const CONSISTENT_S: f64 = 5e-5;
/// What is so much off then was found wrong, seconds.
const WRONG_S: f64 = 1.5e-4;
/// Responses that tell it, at least.
const FEWEST: usize = 5;

/// Numbers of responses whose arrival is not where all others have theirs, and where it lies, in samples.
pub(crate) fn wrong(measured: &[&Response], directs: &[Direct], rate_hz: f64) -> Vec<(usize, i64)> {
    let way = |r: &Response| {
        let towards = r.listener.to_head(r.source);
        let sine = f64::from(towards.y / towards.length().max(1e-6)).abs().min(1.0);
        // The far ear hears it later round the head than the near ear hears it earlier: midway is after the centre.
        (f64::from(r.distance_m()) + 0.5 * RADIUS_M * (sine.asin() - sine)) / SOUND_M_S
    };
    let ways: Vec<f64> = measured.iter().map(|r| way(r)).collect();
    let begins: Vec<f64> = directs.iter().zip(&ways).map(|(d, way)| d.arrival as f64 / rate_hz - way).collect();
    let Some(begin) = median_high(begins.iter().copied()) else { return Vec::new() };
    let off = |begin_s: &f64| begin_s - begin;
    let usual = median_high(begins.iter().map(|b| off(b).abs()));
    if begins.len() < FEWEST || usual.is_none_or(|usual| usual > CONSISTENT_S) {
        return Vec::new();
    }
    let wrong = begins.iter().enumerate().filter(|(_, b)| off(b).abs() > WRONG_S);
    wrong.map(|(i, _)| (i, ((begin + ways[i]) * rate_hz).round() as i64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::spectrum::Analyser;
    use promenade_core::glam::Vec3;
    use promenade_core::{Pose, StftGrid};

    #[test]
    fn one_wrong_arrival_is_told_from_those_of_its_neighbours() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let analyser = Analyser::new(grid);
        // Straight ahead what comes 0.3 ms later is louder: its minimum phase begins there.
        let ring = |start: fn(i16) -> usize| -> (Vec<Response>, Vec<Direct>) {
            let response = |i: i16| {
                let listener = Pose::from_ypr(Vec3::ZERO, f32::from(i * 15).to_radians(), 0.0, 0.0);
                let side = listener.to_head(Vec3::X).y;
                let [left, right] = [1.0, -1.0].map(|ear| {
                    let mut samples = vec![0.0; 2_400];
                    let at = start(i) + (300.0 - 12.0 * ear * side).round() as usize;
                    (samples[at], samples[at + 14]) = if i == 0 { (0.5, 1.0) } else { (1.0, 0.5) };
                    samples
                });
                Response { listener, source: 2.0 * Vec3::X, left, right, name: i.to_string() }
            };
            let responses: Vec<Response> = (-6..=6).map(response).collect();
            let directs = responses.iter().map(|r| Direct::of([&r.left, &r.right], None, &grid, &analyser).unwrap());
            let directs = directs.collect();
            (responses, directs)
        };
        let (responses, directs) = ring(|_| 0);
        let measured: Vec<&Response> = responses.iter().collect();
        assert!(directs[6].arrival - directs[5].arrival > 10, "{} {}", directs[6].arrival, directs[5].arrival);
        let found = wrong(&measured, &directs, grid.sample_rate_hz);
        assert!(matches!(found[..], [(6, at)] if (at - 300).abs() <= 3), "{found:?}");
        let again = Direct::of([&responses[6].left, &responses[6].right], Some(found[0].1), &grid, &analyser).unwrap();
        assert_eq!(again.arrival, found[0].1);
        // Files that were cut one by one say nothing about each other.
        let (responses, directs) = ring(|i| 40 * (i * i % 7) as usize);
        assert!(wrong(&responses.iter().collect::<Vec<_>>(), &directs, grid.sample_rate_hz).is_empty());
    }
}
