//! What a training is set up with besides weights: the grid, the room's bands, the anchors, the emitter.

use crate::responses::{ClipResponses, Decay, decay_times, grid};
use crate::settings::TrainSettings;
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::{Capture, reverberation_times};
use promenade_core::glam::Vec3;
use promenade_core::network::{CloudEmitter, HEAD_RADIUS_M, Placement, SPEED_OF_SOUND_M_S};
use promenade_core::{Bands, Pose, StftGrid, TailModel};

/// Reverberation time of bands in which nothing sounds, seconds.
const SILENT_T60_S: f32 = 0.4;

/// The anchors that the network attends to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cloud {
    /// Anchor positions, cloud units.
    pub(crate) anchors: Vec<Vec3>,
    /// `[anchor][feature]`.
    pub(crate) features: Vec<f32>,
    /// Distance that relative vectors are divided by, cloud units.
    pub(crate) max_norm: f32,
    /// Whether the last anchor is the emitter that is heard; its features are its own.
    pub(crate) has_emitter: bool,
}

/// What an emitter has instead of an anchor's colours.
const EMITTER_FEATURE: f32 = 1.0;

/// Everything around the weights that does not change.
pub(crate) struct Setup {
    /// Transform of the masks.
    pub(crate) grid: StftGrid,
    /// Bands of the taps.
    pub(crate) bands: Bands,
    /// Reverberation of the late part.
    pub(crate) tail: TailModel,
    /// Query frequencies.
    pub(crate) queries: Bands,
    /// Cloud as the network sees them.
    pub(crate) cloud: Cloud,
    /// Where they lie in the scene.
    pub(crate) placement: Placement,
    /// The capture's emitters, where they are known and used.
    pub(crate) emitters: Vec<CloudEmitter>,
}

impl Setup {
    /// For a capture and anchors: masks at `bands` frequencies as the ear spaces them.
    pub(crate) fn new(capture: &Capture, responses: &ClipResponses, anchors: &AnchorSet, settings: &TrainSettings) -> Self {
        let rate = capture.sample_rate_hz;
        let grid = grid(rate);
        let bands = Bands::for_rate(rate);
        let told = decay_times(responses, bands.count(), grid.hop_s());
        // What the responses do not tell, the recordings' energies do.
        let blind = if told.iter().any(Option::is_none) { reverberation_times(capture, &grid, &bands) } else { Vec::new() };
        let or_blind = |(band, decay): (usize, Option<Decay>)| {
            decay.map(|decay| decay.time_s as f32).or_else(|| blind[band]).unwrap_or(SILENT_T60_S)
        };
        let t60_s = told.into_iter().enumerate().map(or_blind).collect();
        let tail = TailModel { seed: settings.seed, t60_s, coherence: diffuse_coherence(&bands), by_phase: false };
        let network = &settings.network;
        let centre = anchors.positions.iter().sum::<Vec3>() / anchors.positions.len().max(1) as f32;
        let farthest = anchors.positions.iter().map(|p| p.distance(centre)).fold(0.0_f32, f32::max);
        let known = capture.emitters.iter().filter(|_| network.emitter);
        let emitters: Vec<_> = known.map(|e| CloudEmitter::with_sphere(e.position, HEAD_RADIUS_M)).collect();
        let mut cloud = Cloud {
            anchors: anchors.positions.clone(),
            features: anchors.features.clone(),
            max_norm: farthest.max(1e-3),
            has_emitter: emitters.len() > 1,
        };
        if let (true, [first, ..]) = (cloud.has_emitter, &emitters[..]) {
            let features = cloud.features.len() / cloud.anchors.len();
            cloud.anchors.push(in_cloud(&anchors.placement, first.position));
            cloud.features.extend(std::iter::repeat_n(EMITTER_FEATURE, features));
        }
        Self { queries: queries(&grid, network.bands), cloud, placement: anchors.placement, emitters, grid, bands, tail }
    }
}

/// A place of the scene's world in the cloud's.
pub(crate) fn in_cloud(placement: &Placement, position: Vec3) -> Vec3 {
    placement.listener(&Pose { position, ..Pose::IDENTITY }).centre
}

/// Query frequencies: all bins, or fewer, evenly spaced in ERB numbers (Glasberg and Moore 1990).
fn queries(grid: &StftGrid, count: usize) -> Bands {
    let nyquist = 0.5 * grid.sample_rate_hz;
    let number = |hz: f64| 21.4 * (1.0 + 0.00437 * hz).log10();
    let hz = |number: f64| (10.0_f64.powf(number / 21.4) - 1.0) / 0.00437;
    let centres = (0..count).map(|i| {
        let share = i as f64 / (count.max(2) - 1) as f64;
        if count >= grid.bins() { (share * nyquist) as f32 } else { hz(share * number(nyquist)) as f32 }
    });
    let centres: Vec<f32> = centres.collect();
    Bands::new(centres).unwrap_or_else(|| Bands::for_rate(grid.sample_rate_hz))
}

/// Interaural coherence of a diffuse field about a head (Lindevald and Benade 1986), real.
fn diffuse_coherence(bands: &Bands) -> Vec<f32> {
    let of = |hz: f32| {
        let kd = std::f32::consts::TAU * hz / SPEED_OF_SOUND_M_S * 0.15;
        let x = 2.2 * kd;
        let sinc = if x > 1e-6 { x.sin() / x } else { 1.0 };
        sinc / (1.0 + (0.5 * kd).powi(4)).sqrt()
    };
    bands.centres_hz().iter().map(|hz| of(*hz)).collect()
}

/// A hash that identifies a capture and its anchors: FNV-1a over what is learnt from.
pub(crate) fn fingerprint(capture: &Capture, setup: &Setup) -> u64 {
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    let mut mix = |value: u32| hash = (hash ^ u64::from(value)).wrapping_mul(0x0100_0000_01B3);
    for track in &capture.tracks {
        let samples = track.voices.iter().flat_map(|voice| &voice.dry).chain(track.binaural.iter().flatten());
        samples.for_each(|x| mix(x.to_bits()));
    }
    for clip in &capture.clips {
        [clip.track, clip.start, clip.len, clip.split as usize].iter().for_each(|v| mix(*v as u32));
        clip.pose.position.to_array().iter().chain(&clip.pose.orientation.to_array()).for_each(|x| mix(x.to_bits()));
    }
    if capture.emitters.len() > 1 {
        let voices = capture.tracks.iter().flat_map(|track| &track.voices);
        voices.for_each(|voice| mix(voice.emitter.map_or(u32::MAX, |number| number as u32)));
        capture.emitters.iter().flat_map(|e| e.position.to_array()).for_each(|x| mix(x.to_bits()));
    }
    let place = setup.cloud.anchors.iter().flat_map(|a| a.to_array());
    place.chain(setup.cloud.features.iter().copied()).for_each(|x| mix(x.to_bits()));
    hash
}
