//! A room whose sound is corrected by responses: its direct sound by one colour, images by one gain each in every octave, all
//! else place by place. The bass of waves is the room's.

use crate::signal::spectrum::{Analyser, at, band_means};
use crate::sources::simulation::OCTAVES_HZ;
use promenade_acoustics::{Air, Octaves, speed_m_s};
use promenade_core::glam::{DVec3, Mat3, Vec3};
use promenade_core::{Axis, Emission};
use promenade_metrics::statistics::median_high;
use promenade_room::{HopEnergies, SceneHead, Surfaces};
use std::f32::consts::PI;

/// The direct sound is cut out from so long before it arrives to so long after, seconds.
const DIRECT_S: (f64, f64) = (0.0015, 0.0035);
/// Energies so far below a place's loudest tell no gain.
const SILENCE: f64 = 1e-9;
/// A colour that changes less than this over octaves is none, dB.
const LEAST_COLOUR_DB: f32 = 0.5;
/// Octave at 63 Hz.
const LOW_HZ: f32 = 62.5;

/// Responses at a place with a turn of the head: sound pressure of both ears from the moment on at which the emitter sounds.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectedResponse {
    /// Place of the listener, world metres.
    pub at: Vec3,
    /// As the room is simulated.
    pub simulated: [Vec<f32>; 2],
    /// As it should be.
    pub corrected: [Vec<f32>; 2],
}

/// What a correction makes of energies at a place.
struct Gains {
    at: DVec3,
    /// Of the direct sound, `[band]`.
    direct: Vec<f64>,
    /// Of what follows, `[hop][band]`; after the last it stays.
    hops: HopEnergies,
}

impl Gains {
    /// A gain of energy at a frequency, from those of bands.
    fn at_hz(gains: &[f64], head: &SceneHead, hz: f32) -> f64 {
        let weights = head.bands().weights(hz);
        weights.into_iter().map(|(band, weight)| f64::from(weight) * gains[band].ln()).sum::<f64>().exp()
    }

    fn hop(&self, hop: usize) -> &[f64] {
        &self.hops[hop.min(self.hops.len() - 1)]
    }
}

/// Corrects what a room gives, and says the gain of energy that the direct sound has of it in the mean over octaves, which
/// nothing is multiplied by; of responses at one place with several turns of the head the energies count together.
pub(super) fn correct(surfaces: &mut Surfaces, responses: &[CorrectedResponse], head: &SceneHead, air: Option<Air>) -> f64 {
    let hops = surfaces.late.iter().map(|late| late.energies.len()).max().unwrap_or(0).max(2);
    let gains = gains(responses, surfaces.emitter, (hops, speed_m_s(air)), head);
    let nearest =
        |place: DVec3| gains.iter().min_by(|a, b| a.at.distance_squared(place).total_cmp(&b.at.distance_squared(place)));
    let seeing: Vec<&Gains> = surfaces
        .places
        .at
        .iter()
        .zip(&surfaces.direct)
        .filter(|(_, seen)| **seen > 0.0)
        .filter_map(|(place, _)| nearest(*place))
        .collect();
    let colour: Vec<f64> =
        (0..head.bands().count()).map(|band| median_high(seeing.iter().map(|g| g.direct[band])).unwrap_or(1.0)).collect();
    let octaves = OCTAVES_HZ.map(|hz| Gains::at_hz(&colour, head, hz));
    let level = (octaves.iter().map(|gain| gain.ln()).sum::<f64>() / octaves.len() as f64).exp();
    for (late, place) in surfaces.late.iter_mut().zip(&surfaces.places.at) {
        let Some(gains) = nearest(*place) else { continue };
        for (hop, energies) in late.energies.iter_mut().enumerate() {
            energies.iter_mut().zip(gains.hop(hop)).for_each(|(energy, gain)| *energy *= gain / level);
        }
    }
    let hop_m = head.grid().hop_s() * speed_m_s(air);
    let emitter = surfaces.emitter.as_dvec3();
    for image in &mut surfaces.played.images {
        let mean = |hz: f32, of_direct: f64| {
            let of = |g: &Gains| {
                let hop = (g.at.distance(image.position) - g.at.distance(emitter)) / hop_m;
                Gains::at_hz(g.hop(hop.max(0.0) as usize), head, hz).ln()
            };
            let mean = gains.iter().map(of).sum::<f64>() / gains.len().max(1) as f64;
            (0.5 * (mean - of_direct.ln())).exp() as f32
        };
        let walls: Octaves = std::array::from_fn(|octave| mean(OCTAVES_HZ[octave], octaves[octave]));
        image.gains.iter_mut().zip(walls).for_each(|(gain, by)| *gain *= by);
        image.gain_63 *= mean(LOW_HZ, octaves[0]);
    }
    let colour = octaves.map(|gain| (0.5 * (gain / level).ln()) as f32);
    if colour.iter().any(|nepers| (8.686 * nepers).abs() > LEAST_COLOUR_DB) {
        let images = surfaces.played.images.len();
        let emission = surfaces.emission.get_or_insert_with(|| Emission {
            elevation: Axis::uniform(-0.5 * PI, PI, 2),
            azimuth: Axis::circle(-PI, 2),
            levels: vec![[0.0; OCTAVES_HZ.len()]; 4],
            turns: vec![Mat3::IDENTITY; images],
        });
        emission.levels.iter_mut().flat_map(|level| level.iter_mut().zip(colour)).for_each(|(level, more)| *level += more);
    }
    level
}

/// Two credits or licences, one where they are the same or one is empty.
pub(super) fn joined(a: &str, b: &str) -> String {
    let both = [a, b].into_iter().filter(|text| !text.is_empty());
    both.take(if a == b { 1 } else { 2 }).collect::<Vec<_>>().join("; ")
}

/// Gains at each place, of so many hops.
fn gains(responses: &[CorrectedResponse], emitter: Vec3, (hops, speed_m_s): (usize, f64), head: &SceneHead) -> Vec<Gains> {
    /// Energies as simulated and corrected, of the direct sound and of hops.
    type Both = [(Vec<f64>, HopEnergies); 2];
    let (grid, bands) = (*head.grid(), head.bands());
    let analyser = Analyser::new(grid);
    let samples = |s: f64| (s * grid.sample_rate_hz).round() as i64;
    let mut places: Vec<(Vec3, Both)> = Vec::new();
    for response in responses {
        let origin = samples(f64::from(response.at.distance(emitter)) / speed_m_s);
        let number = places.iter().position(|(at, _)| at.distance(response.at) < 1e-3).unwrap_or_else(|| {
            let silent = || (vec![0.0; bands.count()], vec![vec![0.0; bands.count()]; hops]);
            places.push((response.at, [silent(), silent()]));
            places.len() - 1
        });
        let both = [&response.simulated, &response.corrected];
        for ((direct, all), ears) in places[number].1.iter_mut().zip(both) {
            for ear in ears {
                let piece: Vec<f64> =
                    (origin - samples(DIRECT_S.0)..origin + samples(DIRECT_S.1)).map(|i| at(ear, i)).collect();
                add(direct, &band_means(&grid, bands, &analyser.spectrum(&piece)));
                let found = analyser.hop_energies(ear, origin, hops, bands);
                all.iter_mut().zip(&found).for_each(|(sum, hop)| add(sum, hop));
            }
        }
    }
    let ratio = |(at, [simulated, corrected]): (Vec3, Both)| {
        let loudest = simulated.1.iter().flatten().copied().fold(simulated.0.iter().copied().fold(0.0, f64::max), f64::max);
        let told = |own: f64, new: f64| (own > SILENCE * loudest && new > 0.0).then(|| new / own);
        let direct = simulated.0.iter().zip(&corrected.0).map(|(own, new)| told(*own, *new).unwrap_or(1.0)).collect();
        let mut last = vec![1.0; bands.count()];
        let mut by_hop: HopEnergies = Vec::with_capacity(hops);
        for (own, new) in simulated.1.iter().zip(&corrected.1) {
            last.iter_mut().zip(own.iter().zip(new)).for_each(|(last, (own, new))| *last = told(*own, *new).unwrap_or(*last));
            by_hop.push(last.clone());
        }
        // The first hop has most of the direct sound in it.
        by_hop[0] = by_hop[1].clone();
        Gains { at: at.as_dvec3(), direct, hops: by_hop }
    };
    places.into_iter().map(ratio).collect()
}

fn add(sum: &mut [f64], more: &[f64]) {
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}
