//! What playing a scene takes, from its sizes, before anything is allocated.

use super::{BassField, ImageSources, SceneParts};
use crate::head::channels;
use crate::network::{CONV_LAYERS, CloudSizes};
use crate::published::ConvMode;
use crate::render::late::network::LATE_HOPS;
use crate::render::transform::lanes::LANES;
use crate::{Field, StftGrid, TransferShape};
use glam::Vec3;
use thiserror::Error;

/// The most memory of a scene and one stream of it at a sample rate, bytes.
const MOST_MEMORY: f64 = 2_147_483_648.0;
/// The most work before the first sample and for each second of sound, multiplications: some seconds of one processor.
const MOST_WORK: f64 = 5e10;

/// Bytes of a bin of both ears' filters, and of one spectrum.
const EARS: f64 = 16.0;
const SPECTRUM: f64 = 8.0;
/// Multiplications per bin and hop of a frame that a tap takes with its share of following the listener, and the late part.
const TAP_WORK: f64 = 24.0;
const LATE_WORK: f64 = 200.0;
/// Metres per second, in the coldest air.
const SLOWEST_M_S: f64 = 299.0;
/// Responses that each is compared with.
const PAIRS: f64 = 24.0;
/// Multiplications of an image for a sample.
const IMAGE_WORK: f64 = 40.0;
/// Hops of the late part's delay lines, with those that it is coloured with.
const LATE_RING: f64 = 80.0;
/// The most nodes that a pose is interpolated between.
const MOST_CORNERS: usize = 128;
/// Decodes of an anchor cloud a second, as by default.
const DECODES: f64 = 40.0;

/// A scene is too large to be played, at its own sample rate or at the host's.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{what} of the scene at {sample_rate_hz} Hz: expected at most {most:.1e}, found about {found:.1e}")]
pub struct TooCostly {
    /// Which cost, with its unit.
    pub what: &'static str,
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    /// The limit.
    pub most: f64,
    /// The estimate.
    pub found: f64,
}

/// What a scene takes at a sample rate. Estimates, of which only the order of magnitude is meant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cost {
    /// Bytes of what is made of a scene and of one stream.
    memory: f64,
    /// Multiplications before the first sample.
    preparation: f64,
    /// Multiplications for a second of sound.
    per_second: f64,
}

impl Cost {
    /// Of a scene on a host's grid.
    pub(crate) fn new(parts: &SceneParts, grid: &StftGrid) -> Self {
        let mut cost = Self::default();
        cost.head(parts, grid);
        if let Some(field) = &parts.field {
            let corners = field.grid().nodes().min(MOST_CORNERS) as f64;
            // Direct sound at every hop, time filters by turns.
            let row = 4 * parts.shape().bins + parts.shape().tap_len() * (1 + parts.taps / 4);
            cost.per_second += corners * row as f64 / grid.hop_s();
        }
        if let (Some(images), Some(emitter)) = (&parts.images, parts.field.as_ref().and_then(Field::emitter)) {
            cost.images(images, emitter, grid);
        }
        if let Some(bass) = &parts.bass {
            cost.bass(bass, grid);
        }
        if let Some(cloud) = &parts.cloud {
            cost.cloud(&cloud.model.sizes(), &parts.shape());
            if cloud.conv != ConvMode::Off && *grid == parts.grid {
                let slots = (cloud.stream_options(parts.taps).lookahead_hops + parts.taps + 1) as f64;
                let bins = grid.bins() as f64;
                let layers: usize = CONV_LAYERS.iter().map(|(_, shape)| shape.iter().product::<usize>()).sum();
                cost.memory += bins * (24.0 * slots + 4.0 * layers as f64);
                cost.per_second += (bins * (layers as f64 + 3.0 * slots) + 4.0 * transform(grid)) / grid.hop_s();
            }
        }
        cost
    }

    /// Image sources: a delay line of six signals, kept twice, and a head of sixteen channels.
    fn images(&mut self, images: &ImageSources, emitter: Vec3, grid: &StftGrid) {
        let rate = grid.sample_rate_hz;
        let longest_s = f64::from(images.longest_m(emitter)) / SLOWEST_M_S + grid.n_fft as f64 / rate;
        let head = images.head.len() as f64 * rate / images.head.sample_rate_hz + grid.hop as f64;
        let channels = channels(images.head.order()) as f64;
        self.memory += 12.0 * 4.0 * longest_s * rate + channels * head * (EARS + SPECTRUM);
        self.preparation += 8.0 * channels * head * images.head.len() as f64;
        self.per_second += IMAGE_WORK * images.images.len() as f64 * rate + 4.0 * channels * transform(grid) / grid.hop_s();
    }

    /// Responses at a low rate, twice the one that they are kept at: both ears as they are and as they were, and their mix.
    fn bass(&mut self, bass: &BassField, grid: &StftGrid) {
        let (length, rate) = (2.0 * bass.len() as f64, 2.0 * bass.rate_hz);
        self.memory += 8.0 * bass.samples.len() as f64 + 24.0 * length + 16.0 * grid.hop as f64;
        self.preparation += 200.0 * bass.samples.len() as f64;
        self.per_second += 4.0 * length * rate + 64.0 * length / grid.hop_s() + 40.0 * grid.sample_rate_hz;
    }

    /// The streaming render head and its carriers.
    fn head(&mut self, parts: &SceneParts, grid: &StftGrid) {
        let (bins, noise_hops) = (grid.bins() as f64, (parts.taps + LATE_HOPS) as f64);
        let (responses, low) = parts
            .measured
            .as_ref()
            .map_or((0.0, 0.0), |room| (room.count(&parts.bands) as f64, room.low_hops.saturating_sub(parts.taps + 1) as f64));
        let low_bins = bins.min(LANES as f64);
        let lifted = parts.measured.as_ref().map_or(0, |room| room.lifted_hops(&parts.bands, &parts.grid));
        let responses_hops = responses * (parts.taps + 1 + lifted) as f64;
        self.memory += EARS * (bins * (2.0 * noise_hops + responses_hops) + low_bins * low * (responses + 1.0));
        self.memory += bins * (EARS * (noise_hops + 8.0) + SPECTRUM * (parts.taps as f64 + LATE_RING));
        self.memory += 32.0 * grid.n_fft as f64;
        // What each two responses have in common.
        let pairs = responses * responses.min(PAIRS);
        let hops = (parts.taps + 1) as f64 + low;
        self.memory += (4.0 * responses + pairs) * (parts.taps + 2) as f64 * parts.shape().tap_len() as f64;
        self.preparation += 6.0 * pairs * hops * bins;
        // Levels of noise are set in turns; hops are transformed at the host's rate.
        self.preparation += 40.0 * noise_hops * transform(&parts.grid);
        self.preparation += 4.0 * (noise_hops + responses_hops + responses * low) * transform(grid);
        let frame = 3.0 * transform(grid) + bins * (TAP_WORK * noise_hops + LATE_WORK) + TAP_WORK * low_bins * low;
        self.per_second += frame / grid.hop_s();
    }

    /// The network of an anchor cloud and what it answers.
    fn cloud(&mut self, sizes: &CloudSizes, shape: &TransferShape) {
        let [anchors, features, width, bands, frames, octaves, layers, wide, hyper, shapes] = [
            sizes.anchors,
            sizes.features,
            sizes.width,
            sizes.bands,
            sizes.frames,
            sizes.octaves,
            sizes.layers,
            sizes.feed_forward,
            sizes.hyper,
            sizes.tap_shapes,
        ]
        .map(|size| size as f64);
        let lags = frames + shape.taps as f64;
        let banded = if frames > 0.0 { 3.0 * lags * bands } else { 0.0 };
        self.memory += 4.0 * width * ((layers + 8.0) * anchors + 4.0 * bands) + 24.0 * banded;
        self.memory += 20.0 * shape.row_len() as f64 + 12.0 * hyper * lags;
        // Weights are folded in double precision.
        self.preparation += anchors * width * (20.0 * (layers + 2.0) * width + features);
        let positions = anchors * width * (6.0 * octaves + width);
        let attention = anchors * 2.0 * width * width + bands * width * (8.0 * width + 2.0 * (anchors + bands + wide));
        let filters =
            banded * (1.0 + hyper) + if frames > 0.0 { anchors * (bands * sizes.harmonics as f64 + 2.0 * lags) } else { 0.0 };
        let answer = positions + layers * attention + filters + 2.0 * shapes * bands * (width + lags);
        self.per_second += DECODES * answer;
    }

    /// Whether a scene may be played on that grid.
    pub(crate) fn check(&self, grid: &StftGrid) -> Result<(), TooCostly> {
        let costs = [
            ("memory (bytes)", self.memory, MOST_MEMORY),
            ("work (multiplications before the first sample)", self.preparation, MOST_WORK),
            ("work (multiplications for a second of sound)", self.per_second, MOST_WORK),
        ];
        match costs.into_iter().find(|(_, found, most)| found > most) {
            None => Ok(()),
            Some((what, found, most)) => Err(TooCostly { what, sample_rate_hz: grid.sample_rate_hz, most, found }),
        }
    }
}

/// What each operation takes of a processor, nanoseconds (AMD EPYC with AVX2: least squares over times of settings of four
/// scenes, 6 % off): a point of a transform of frames, with all that is done to a bin whatever a scene holds; a bin of a tap,
/// applied and brought to a pose, of noise and of responses; a sample of an image, and of each channel that it is heard in; a
/// point of a transform of channels; a sample of the waves' bass and of its responses; a multiplication of a network.
const FRAME_NS: f64 = 0.78;
const TAP_NS: f64 = 0.24;
const REFRESH_NS: f64 = 0.65;
const MEASURED_REFRESH_NS: f64 = 1.1;
const MEASURED_BIN_NS: f64 = 22.0;
const IMAGE_NS: f64 = 1.9;
const CHANNEL_NS: f64 = 0.034;
const BUS_NS: f64 = 0.14;
const WAVE_NS: f64 = 160.0;
const WAVE_SAMPLE_NS: f64 = 0.094;
const NETWORK_NS: f64 = 0.03;

/// What playing a scene takes at a host's rate while the listener walks and turns, nanoseconds of a processor a second: counts
/// of what the renderer does, which are the same on every machine, each weighed.
pub(super) fn operations(parts: &SceneParts, grid: &StftGrid) -> f64 {
    let (hops, rate) = (1.0 / grid.hop_s(), grid.sample_rate_hz);
    let bins = grid.bins() as f64 * hops;
    let (of_bin, refresh) = if parts.measured.is_some() { (MEASURED_BIN_NS, MEASURED_REFRESH_NS) } else { (0.0, REFRESH_NS) };
    let of_tap = TAP_NS + refresh / parts.refresh as f64;
    let mut total = FRAME_NS * transform(grid) * hops + bins * (of_bin + parts.taps as f64 * of_tap);
    if let Some(images) = &parts.images {
        let channels = channels(images.head.order()) as f64;
        let length = grid.hop as f64 + images.head.len() as f64 * rate / images.head.sample_rate_hz;
        let of_bus = 4.0 * length * length.log2() * hops * (1.0 + channels / 2.0);
        total += images.images.len() as f64 * rate * (IMAGE_NS + CHANNEL_NS * channels) + BUS_NS * of_bus;
    }
    if let Some(bass) = &parts.bass {
        total += WAVE_NS * rate + WAVE_SAMPLE_NS * 16.0 * bass.len() as f64 * bass.rate_hz;
    }
    if let Some(cloud) = &parts.cloud {
        let mut cost = Cost::default();
        cost.cloud(&cloud.model.sizes(), &parts.shape());
        total += NETWORK_NS * cost.per_second * (parts.decodes as f64 / DECODES).min(1.0);
    }
    total
}

/// Multiplications of a transform, as many as take as long as those of the filters, which are vectors.
fn transform(grid: &StftGrid) -> f64 {
    let n = grid.n_fft as f64;
    4.0 * n * n.log2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bands, Carriers, Renderer, Scene, TailModel};
    use std::sync::Arc;

    #[test]
    fn memory_is_of_the_order_that_is_taken() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let tail = TailModel { seed: 1, t60_s: vec![0.5; 2], coherence: vec![0.0; 2], by_phase: false };
        for taps in [0, 32, 200] {
            let transfer = TransferShape { bins: grid.bins(), bands: 2, taps }.silent();
            let bands = Bands::new(vec![0.0, 1_000.0]).unwrap();
            let scene = Arc::new(Scene::of_transfer(&transfer, grid, bands, tail.clone(), 7_000.0).unwrap());
            for rate in [8_000.0, 48_000.0] {
                let taken = Carriers::new(&scene, rate).memory_bytes()
                    + Renderer::new(Arc::clone(&scene), rate).unwrap().memory_bytes();
                let ratio = Cost::new(scene.parts(), &grid.at_rate(rate)).memory / taken as f64;
                assert!((0.5..2.5).contains(&ratio), "{taps} taps at {rate} Hz: {ratio}");
            }
        }
    }

    #[test]
    fn clouds_are_limited_by_the_product_of_their_sizes() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let shape = TransferShape { bins: grid.bins(), bands: 20, taps: 32 };
        // As published, but for its convolution layers.
        let usual = CloudSizes {
            anchors: 1_024,
            features: 15,
            width: 128,
            bands: 257,
            frames: 200,
            harmonics: 9,
            octaves: 10,
            layers: 3,
            feed_forward: 512,
            hyper: 16,
            hyper_bias: 16,
            conv: false,
            tap_shapes: 0,
            tap_hops: 0,
            tap_bands: 0,
        };
        let check = |sizes: CloudSizes| {
            let mut cost = Cost::default();
            cost.cloud(&sizes, &shape);
            cost.check(&grid)
        };
        assert_eq!(check(usual), Ok(()));
        for sizes in [
            CloudSizes { anchors: 65_536, width: 1_024, layers: 16, ..usual },
            CloudSizes { anchors: 65_536, width: 512, bands: 512, ..usual },
            CloudSizes { frames: 1_024, hyper: 4_096, ..usual },
        ] {
            assert!(check(sizes).is_err(), "{sizes:?}");
        }
    }
}
