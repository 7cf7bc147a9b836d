//! Carriers of a whole scene, shared by its renderers.

use crate::bands::{BandPlace, Bands};
use crate::number::{single, whole};
use crate::render::carrier::{EarSpectra, Shaper, band_places, hop_carriers};
use crate::render::decay_curve::DecayCurve;
use crate::render::direct::TAKES_OVER_FROM;
use crate::render::images::ImageFilters;
use crate::render::lanes::{EarBlocks, LANES, blocks_for};
use crate::render::late::LATE_HOPS;
use crate::scene::MeasuredRoom;
use crate::{Facing, NEAREST_M, Scene, Shares, StftGrid, TailModel};
use promenade_fourier::num_complex::Complex32;
use std::sync::Arc;

/// From this share of the highest frequency on, the level of that noise is measured.
const LEVEL_FROM: f64 = 0.75;

/// The bass of a measured direct sound is whole up to this long after its first hop began, and has faded out by then, seconds.
const BASS_WHOLE_S: f64 = 0.01;
const BASS_END_S: f64 = 0.02;
/// Length of the window that is its low pass, seconds: half of 200 Hz is left, nothing from 400 Hz on.
const LOW_PASS_S: f64 = 0.005;
/// Cut into hops it has parts up to here, Hz.
const BASS_BELOW_HZ: f64 = 3_000.0;

/// Hops by which the noise of one response differs from that of the one before.
const STRIDE: usize = 7;

/// The carriers of a scene at one sample rate, which all its renderers at that rate share.
pub struct Carriers {
    /// From here on masks and bands are held, Hz; infinite within the scene's own band.
    pub(crate) top_hz: f32,
    /// Where every bin lies among the scene's bands.
    pub(crate) places: Vec<BandPlace>,
    /// Of the explicit taps.
    pub(crate) taps: CarrierSet,
    /// Of the late part.
    pub(crate) late: CarrierSet,
    /// What measured responses have instead of noise.
    pub(crate) measured: Option<MeasuredCarriers>,
    /// How the room dies away.
    pub(crate) curve: Arc<DecayCurve>,
    /// Filters of the image sources.
    pub(crate) images: Option<Arc<ImageFilters>>,
}

/// Hops of measured responses that are heard besides the taps.
pub(crate) struct MeasuredCarriers {
    /// The hop of the direct sound.
    pub(crate) first: CarrierSet,
    /// Hops after the taps, of the lowest block of bins.
    pub(crate) low: CarrierSet,
    /// The bass of the direct sound after its first hop, at a distance of 1 m.
    pub(crate) bass: CarrierSet,
}

/// Spectra of hops in blocks of bins.
pub(crate) struct CarrierSet {
    hops: usize,
    blocks: usize,
    /// `[response][hop][block]`
    spectra: Vec<EarBlocks>,
}

impl CarrierSet {
    /// Packs spectra, `[response][hop]`, of `bins` bins or of as many as the spectra have.
    pub(crate) fn pack(spectra: impl Iterator<Item = EarSpectra>, hops: usize, bins: usize) -> Self {
        let blocks = blocks_for(bins);
        let mut packed = Vec::new();
        for ears in spectra {
            let start = packed.len();
            packed.resize(start + blocks, EarBlocks::default());
            for (ear, spectrum) in ears.iter().enumerate() {
                for (k, x) in spectrum.iter().take(bins).enumerate() {
                    let block = &mut packed[start + k / LANES].ears[ear];
                    block.re[k % LANES] = x.re;
                    block.im[k % LANES] = x.im;
                }
            }
        }
        Self { hops, blocks, spectra: packed }
    }

    /// Hops of each response.
    pub(crate) fn hops(&self) -> usize {
        self.hops
    }

    /// Blocks of each hop.
    pub(crate) fn blocks(&self) -> usize {
        self.blocks
    }

    /// One hop of a response, block by block.
    pub(crate) fn hop(&self, response: u32, hop: usize) -> &[EarBlocks] {
        let start = (response as usize * self.hops + hop) * self.blocks;
        &self.spectra[start..start + self.blocks]
    }

    /// Energy of one hop of carriers, each with its share, by band.
    fn carried(&self, hop: usize, shares: &Shares, places: &[BandPlace]) -> Vec<f64> {
        let bands = places.iter().map(|place| place.band + 2).max().unwrap_or(0);
        let (mut sums, mut weights) = (vec![0.0; bands], vec![1e-9; bands]);
        for (response, share) in shares.entries() {
            let blocks = self.hop(*response, hop);
            for (k, place) in places.iter().enumerate() {
                let block = &blocks[k / LANES];
                let power: f32 = block.ears.iter().map(|ear| ear.re[k % LANES].powi(2) + ear.im[k % LANES].powi(2)).sum();
                for (band, weight) in [(place.band, 1.0 - place.fraction), (place.band + 1, place.fraction)] {
                    sums[band] += f64::from(0.5 * share * weight * power);
                    weights[band] += f64::from(share * weight);
                }
            }
        }
        sums.iter().zip(weights).map(|(sum, weight)| sum / weight).collect()
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(&*self.spectra)
    }
}

impl Carriers {
    /// Prepares the carriers of a scene at a host's sample rate where it is [`Scene::playable_at`]: its responses, or noise
    /// where it has none.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn new(scene: &Scene, sample_rate_hz: f64) -> Self {
        let (grid, scene_grid, taps) = (scene.grid().at_rate(sample_rate_hz), scene.grid(), scene.shape().taps);
        let noise = Self::of_noise(&grid, scene_grid, taps, scene.bands(), scene.tail(), scene.top_hz());
        let images = scene.images().map(|images| Arc::new(ImageFilters::new(images, &grid)));
        let carriers = match scene.measured() {
            Some(room) => noise.carrying(room, &distances(scene, room), &grid, scene_grid, taps),
            None => noise,
        };
        let curve =
            Arc::new(DecayCurve::of_scene(scene, &grid, |hop, shares| carriers.taps.carried(hop, shares, &carriers.places)));
        Self { curve, images, ..carriers }
    }

    /// Noise for explicit `taps` on a host grid.
    pub(crate) fn of_noise(
        grid: &StftGrid,
        scene_grid: &StftGrid,
        taps: usize,
        bands: &Bands,
        tail: &TailModel,
        top_hz: f32,
    ) -> Self {
        // Within the scene's own band the masks hold up to its Nyquist frequency, where anti-alias filters close;
        // a wider host band must not inherit that closing edge.
        let wider = grid.sample_rate_hz > 1.05 * scene_grid.sample_rate_hz;
        let top_hz = if wider { top_hz } else { f32::INFINITY };
        let set = |set, hops| {
            let spectra = hop_carriers(grid, scene_grid, bands, tail, set, hops);
            CarrierSet::pack(spectra.into_iter(), hops, grid.bins())
        };
        Self {
            top_hz,
            places: band_places(grid, bands, top_hz),
            taps: set(0, taps),
            late: set(1, LATE_HOPS),
            measured: None,
            curve: Arc::new(DecayCurve::exponential(tail, grid.hop_s(), taps)),
            images: None,
        }
    }

    /// Puts responses in the place of the taps' noise, which is left above the data's highest frequency.
    fn carrying(mut self, room: &MeasuredRoom, distances: &[f32], grid: &StftGrid, scene_grid: &StftGrid, taps: usize) -> Self {
        let shaper = Shaper::new(scene_grid);
        let spectra = |response: usize, hop: usize| -> EarSpectra {
            [0, 1].map(|ear| shaper.spectrum_at(grid, room.hop(scene_grid, response, ear, hop)))
        };
        let count = room.count(scene_grid);
        let all = |hops: std::ops::Range<usize>| (0..count).flat_map(move |r| hops.clone().map(move |hop| (r, hop)));
        let (bins, top_hz) = (grid.bins(), f64::from(self.top_hz));
        let low = all(taps + 1..room.hops).map(|(r, hop)| spectra(r, hop));
        let low = CarrierSet::pack(low, room.hops - taps - 1, LANES.min(bins));
        let first = all(0..1).map(|(r, hop)| {
            let mut ears = spectra(r, hop);
            ears.iter_mut().for_each(|ear| fade_out(ear, grid, top_hz));
            ears
        });
        let first = CarrierSet::pack(first, 1, bins);
        let carried = all(1..taps + 1).map(|(r, hop)| {
            // Another hop's noise for each response: mixed with one another they lose as much energy as responses do.
            let other = (hop - 1 + STRIDE * r) % taps;
            let mut ears = spectra(r, hop);
            for (ear, spectrum) in ears.iter_mut().enumerate() {
                let level = level_below(spectrum, grid, top_hz);
                fade_out(spectrum, grid, top_hz);
                for (k, x) in spectrum.iter_mut().enumerate() {
                    let noise = &self.taps.hop(0, other)[k / LANES].ears[ear];
                    let share = 1.0 - kept(grid.bin_hz(k), top_hz).powi(2);
                    *x += Complex32::new(noise.re[k % LANES], noise.im[k % LANES]) * (level * share.max(0.0).sqrt());
                }
            }
            ears
        });
        self.taps = CarrierSet::pack(carried, taps, bins);
        let bass_hops = whole(((BASS_END_S + LOW_PASS_S) / scene_grid.hop_s()).ceil()).min(taps + 1);
        let bass = distances.iter().enumerate().flat_map(|(r, distance)| {
            let ears = [0, 1].map(|ear| bass_of(room, scene_grid, r, ear, bass_hops));
            let hop = |hop: usize| {
                ears.each_ref().map(|ear| {
                    let scaled: Vec<f32> = ear[hop * scene_grid.hop..][..scene_grid.hop].iter().map(|v| v * distance).collect();
                    shaper.spectrum_at(grid, &scaled)
                })
            };
            (0..bass_hops).map(hop).collect::<Vec<_>>()
        });
        let bass = CarrierSet::pack(bass, bass_hops, whole(BASS_BELOW_HZ / grid.bin_hz(1)).clamp(1, bins));
        self.measured = Some(MeasuredCarriers { first, low, bass });
        self
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let measured =
            self.measured.as_ref().map_or(0, |m| m.first.memory_bytes() + m.low.memory_bytes() + m.bass.memory_bytes());
        let images = self.images.as_ref().map_or(0, |i| i.memory_bytes());
        self.taps.memory_bytes() + self.late.memory_bytes() + measured + images + self.places.len() * size_of::<BandPlace>()
    }
}

/// Distance from the emitter at which each response was measured, metres: that of the node where its share is largest. 1 where
/// fields know no emitter, as the direct sound of theirs has no distance either.
fn distances(scene: &Scene, room: &MeasuredRoom) -> Vec<f32> {
    let mut found = vec![(0.0, 1.0); room.count(scene.grid())];
    if let Some(field) = scene.field()
        && let (Some(shares), Facing::Emitter { position, .. }) = (field.shares(), &field.grid().facing)
    {
        let entries = shares.responses().iter().zip(shares.weights()).enumerate();
        for (i, (response, share)) in entries {
            let best = &mut found[*response as usize];
            if *share > best.0 {
                let (listener, _) = field.grid().node(i / shares.per_node());
                *best = (*share, listener.distance(*position).max(NEAREST_M));
            }
        }
    }
    found.into_iter().map(|(_, distance)| distance).collect()
}

/// What sounds in one ear of a response below some 200 Hz after its first hop, `hops` hops long with the first.
///
/// Low sound outlasts a hop, whose cut would leave the direct sound thin. What follows soon cannot be told from it, by the ear
/// neither.
fn bass_of(room: &MeasuredRoom, grid: &StftGrid, response: usize, ear: usize, hops: usize) -> Vec<f32> {
    let second = |i: usize| i as f64 / grid.sample_rate_hz;
    let along = |i: usize| ((second(i) - BASS_WHOLE_S) / (BASS_END_S - BASS_WHOLE_S)).clamp(0.0, 1.0);
    let rest = (0..room.hops.min(hops)).flat_map(|hop| room.hop(grid, response, ear, hop)).enumerate().map(|(i, v)| {
        let heard = if i < grid.hop { 0.0 } else { 0.5 + 0.5 * (std::f64::consts::PI * along(i)).cos() };
        f64::from(*v) * heard
    });
    let rest: Vec<f64> = rest.collect();
    let reach = whole(0.5 * LOW_PASS_S * grid.sample_rate_hz);
    let window: Vec<f64> = (0..2 * reach + 1)
        .map(|i| 0.5 - 0.5 * (std::f64::consts::TAU * (i + 1) as f64 / (2 * reach + 2) as f64).cos())
        .collect();
    let sum: f64 = window.iter().sum();
    let at = |i: usize| rest.get(i.wrapping_sub(reach)).unwrap_or(&0.0);
    (0..hops * grid.hop).map(|i| single(window.iter().enumerate().map(|(k, w)| w * at(i + k)).sum::<f64>() / sum)).collect()
}

/// Amplitude that is kept of a response at a frequency: 1, and 0 above the highest frequency of the data.
fn kept(hz: f64, top_hz: f64) -> f32 {
    let along = ((hz / top_hz - TAKES_OVER_FROM) / (1.0 - TAKES_OVER_FROM)).clamp(0.0, 1.0);
    single((0.5 * std::f64::consts::PI * along).cos())
}

fn fade_out(spectrum: &mut [Complex32], grid: &StftGrid, top_hz: f64) {
    for (k, x) in spectrum.iter_mut().enumerate() {
        *x *= kept(grid.bin_hz(k), top_hz);
    }
}

/// Amplitude of a spectrum just below the highest frequency of the data, root mean square; 0 where the data have no end.
fn level_below(spectrum: &[Complex32], grid: &StftGrid, top_hz: f64) -> f32 {
    let near = |k: &usize| (LEVEL_FROM * top_hz..TAKES_OVER_FROM * top_hz).contains(&grid.bin_hz(*k));
    let energies: Vec<f32> = (0..spectrum.len()).filter(near).map(|k| spectrum[k].norm_sqr()).collect();
    (energies.iter().sum::<f32>() / energies.len().max(1) as f32).sqrt()
}
