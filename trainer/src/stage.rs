//! What a training is about, besides weights: the grid, the room's bands, the anchors, the emitter.

use crate::network::Place;
use crate::settings::TrainSettings;
use promenade_baker::anchors::AnchorSet;
use promenade_baker::capture::Capture;
use promenade_core::cloud::{Alignment, CloudEmitter};
use promenade_core::glam::Vec3;
use promenade_core::{Bands, StftGrid, TailModel};

/// Mean radius of a head, metres.
const HEAD_RADIUS_M: f32 = 0.0875;

/// Everything around the weights that does not change.
pub(crate) struct Stage {
    /// Transform of the masks.
    pub(crate) grid: StftGrid,
    /// Bands of the taps.
    pub(crate) bands: Bands,
    /// Reverberation of the late part.
    pub(crate) tail: TailModel,
    /// Query frequencies.
    pub(crate) queries: Bands,
    /// Anchors as the network sees them.
    pub(crate) place: Place,
    /// Where they lie in the scene.
    pub(crate) alignment: Alignment,
    /// The emitter, where it is known and used.
    pub(crate) emitter: Option<CloudEmitter>,
}

impl Stage {
    /// For a capture and anchors: a grid of four hops of about 5.8 ms, masks at `bands` frequencies as the ear spaces them.
    #[must_use]
    pub(crate) fn new(capture: &Capture, anchors: &AnchorSet, settings: &TrainSettings) -> Self {
        let rate = capture.sample_rate_hz;
        let grid = StftGrid::four_hops(rate, 128.0 * rate / 22_050.0);
        let bands = Bands::for_rate(rate);
        let tail = TailModel { seed: settings.seed, t60_s: vec![0.4; bands.count()], coherence: diffuse_coherence(&bands) };
        let network = &settings.network;
        let centre = anchors.positions.iter().sum::<Vec3>() / anchors.positions.len().max(1) as f32;
        let farthest = anchors.positions.iter().map(|p| p.distance(centre)).fold(0.0_f32, f32::max);
        let features = if network.colour { anchors.features.clone() } else { vec![0.0; anchors.features.len()] };
        Self {
            queries: queries(&grid, network.bands),
            place: Place { anchors: anchors.positions.clone(), features, max_norm: farthest.max(1e-3) },
            alignment: anchors.alignment,
            emitter: (capture.emitter.filter(|_| network.emitter))
                .map(|position| CloudEmitter { position, head_radius_m: HEAD_RADIUS_M }),
            grid,
            bands,
            tail,
        }
    }
}

/// Query frequencies: all bins, or fewer, evenly spaced in ERB numbers (Glasberg and Moore 1990).
fn queries(grid: &StftGrid, count: usize) -> Bands {
    let nyquist = 0.5 * grid.sample_rate_hz;
    let number = |hz: f64| 21.4 * (1.0 + 0.00437 * hz).log10();
    let hz = |number: f64| (10.0_f64.powf(number / 21.4) - 1.0) / 0.00437;
    #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
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
        let kd = std::f32::consts::TAU * hz / 343.0 * 0.15;
        let x = 2.2 * kd;
        let sinc = if x > 1e-6 { x.sin() / x } else { 1.0 };
        sinc / (1.0 + (0.5 * kd).powi(4)).sqrt()
    };
    bands.centres_hz().iter().map(|hz| of(*hz)).collect()
}

/// Tells captures and anchors apart (FNV-1a over what is learnt from).
pub(crate) fn fingerprint(capture: &Capture, stage: &Stage) -> u64 {
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    let mut mix = |value: u32| hash = (hash ^ u64::from(value)).wrapping_mul(0x0100_0000_01B3);
    for track in &capture.tracks {
        let samples = track.dry.iter().chain(track.binaural.iter().flatten());
        samples.for_each(|x| mix(x.to_bits()));
    }
    for clip in &capture.clips {
        #[expect(clippy::cast_possible_truncation, reason = "a hash")]
        [clip.track, clip.start, clip.len, clip.split as usize].iter().for_each(|v| mix(*v as u32));
        clip.pose.position.to_array().iter().chain(&clip.pose.orientation.to_array()).for_each(|x| mix(x.to_bits()));
    }
    let place = stage.place.anchors.iter().flat_map(|a| a.to_array());
    place.chain(stage.place.features.iter().copied()).for_each(|x| mix(x.to_bits()));
    hash
}
