//! Carriers of a whole scene, shared by its renderers.

use crate::bands::{BandPlace, Bands};
use crate::decode::sites::Sites;
use crate::latency::{Latency, Pace};
use crate::number::single;
use crate::render::carrier::beside_waves::beside_waves;
use crate::render::carrier::likeness::Meeting;
use crate::render::carrier::noise::{EarSpectra, LATE_SET, Shaper, TAP_SET, band_places, hop_carriers};
use crate::render::carrier::set::CarrierSet;
use crate::render::early::direct_sound::TAKES_OVER_FROM;
use crate::render::early::images::ImageFilters;
use crate::render::early::taps::Lost;
use crate::render::late::decay_curve::DecayCurve;
use crate::render::late::network::LATE_HOPS;
use crate::render::low::bass_filters::BassFilters;
use crate::render::transform::lanes::LANES;
use crate::scene::MeasuredRoom;
use crate::{Scene, Shares, StftGrid, TailModel};
use promenade_fourier::num_complex::{Complex32, Complex64};
use std::sync::Arc;

/// From this share of the highest frequency on, the level of that noise is measured.
const LEVEL_FROM: f64 = 0.75;

/// Hops by which the noise of one response differs from that of the one before.
const STRIDE: usize = 7;

/// The carriers of a scene at one sample rate, which all its renderers at that rate share.
pub struct Carriers {
    /// How streams are cut up.
    pub(crate) pace: Pace,
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
    /// The bass that waves have.
    pub(crate) waves: Option<Arc<BassFilters>>,
}

/// Hops of measured responses that are heard besides the taps.
pub(crate) struct MeasuredCarriers {
    /// The hop of the direct sound.
    pub(crate) first: CarrierSet,
    /// What the hops from the first on lose where image sources play their reflections.
    pub(crate) lifted: Option<CarrierSet>,
    /// Hops after the taps, of the lowest block of bins.
    pub(crate) low: CarrierSet,
    /// Energies of mixes.
    pub(crate) meeting: Meeting,
}

impl MeasuredCarriers {
    /// What a hop of direct sound and taps, the first of number 0, loses, with how much of it; `None` where it loses nothing.
    pub(crate) fn lifted(&self, hop: usize, shares: &Shares) -> Option<Lost<'_>> {
        let carriers = self.lifted.as_ref().filter(|set| shares.lifted > 0.0 && hop < set.hops())?;
        Some(Lost { carriers, hop, share: shares.lifted })
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
        Self::with_latency(scene, sample_rate_hz, Latency::Frame)
    }

    /// Carriers for a chosen latency. A scene whose frames are not four hops long, whose hop has no divisor from 2 to 7, or
    /// which has less than 11 taps, keeps its frame's ([`Carriers::latency`]).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn with_latency(scene: &Scene, sample_rate_hz: f64, latency: Latency) -> Self {
        let (grid, scene_grid, taps) = (scene.grid().at_rate(sample_rate_hz), scene.grid(), scene.shape().taps);
        let pace = Pace::new(latency, &grid, taps);
        let noise = Self::of_noise(&grid, scene_grid, taps, scene.bands(), scene.tail(), scene.top_hz());
        let images = scene.images().map(|images| Arc::new(ImageFilters::new(images, &grid, &pace)));
        let waves = scene.bass().zip(scene.emitter());
        let waves = waves.map(|(bass, at)| Arc::new(BassFilters::new(bass, at, scene.weather().speed_m_s(), &grid, &pace)));
        let carriers = match scene.measured() {
            Some(room) => noise.carrying(room, scene, &grid),
            None => noise,
        };
        let curve = DecayCurve::of_scene(scene, &grid, |hop, shares| match &carriers.measured {
            Some(measured) => measured.meeting.energy(hop, shares.entries()),
            None => carriers.taps.carried(hop, shares, &carriers.places),
        });
        let curve = Arc::new(curve);
        let carriers = match scene.bass() {
            Some(bass) if carriers.measured.is_none() => {
                let [taps, late] = [&carriers.taps, &carriers.late].map(|set| beside_waves(set, &grid, bass.crossover_hz));
                Self { taps, late, ..carriers }
            }
            _ => carriers,
        };
        Self { pace, curve, images, waves, ..carriers }
    }

    /// The latency that renderers have.
    #[must_use]
    pub fn latency(&self) -> Latency {
        self.pace.latency
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
            pace: Pace::new(Latency::Frame, grid, taps),
            top_hz,
            places: band_places(grid, bands, top_hz),
            taps: set(TAP_SET, taps),
            late: set(LATE_SET, LATE_HOPS),
            measured: None,
            curve: Arc::new(DecayCurve::exponential(tail, grid.hop_s(), taps)),
            images: None,
            waves: None,
        }
    }

    /// Puts responses in the place of the taps' noise, which is left above the data's highest frequency.
    fn carrying(mut self, room: &MeasuredRoom, scene: &Scene, grid: &StftGrid) -> Self {
        let (scene_grid, taps, bands) = (scene.grid(), scene.shape().taps, scene.bands());
        let shaper = Shaper::new(scene_grid);
        let (count, hops) = (room.count(bands), room.hops(bands, scene_grid));
        let spectra = |response: usize, hop: usize| -> EarSpectra {
            [0, 1].map(|ear| shaper.spectrum_at(grid, room.hop(scene_grid, hops, response, ear, hop)))
        };
        let all = |hops: std::ops::Range<usize>| (0..count).flat_map(move |r| hops.clone().map(move |hop| (r, hop)));
        let (bins, top_hz) = (grid.bins(), f64::from(self.top_hz));
        let low_hops = room.low_hops.saturating_sub(taps + 1);
        let low = all(taps + 1..taps + 1 + low_hops)
            .map(|(r, hop)| [0, 1].map(|ear| low_spectrum(room, scene_grid, grid, r, ear, hop)));
        let low = CarrierSet::pack(low, low_hops, LANES.min(bins));
        let first = all(0..1).map(|(r, hop)| {
            let mut ears = spectra(r, hop);
            ears.iter_mut().for_each(|ear| fade_out(ear, grid, top_hz));
            ears
        });
        let first = CarrierSet::pack(first, 1, bins);
        let lifted_hops = room.lifted_hops(bands, scene_grid);
        let lifted = all(0..lifted_hops).map(|(r, hop)| {
            let lost = |ear: usize| shaper.spectrum_at(grid, room.lifted_hop(scene_grid, lifted_hops, r, ear, hop));
            let mut ears = [0, 1].map(lost);
            ears.iter_mut().for_each(|ear| fade_out(ear, grid, top_hz));
            ears
        });
        let lifted = room.lifted.as_ref().map(|_| CarrierSet::pack(lifted, lifted_hops, bins));
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
        let meeting = Meeting::new(&self.taps, &low, &self.places, bands, Sites::new(&room.sites).pairs(), &room.late_before);
        self.measured = Some(MeasuredCarriers { first, lifted, low, meeting });
        self
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let measured = self.measured.as_ref().map_or(0, |m| {
            let sets = [&m.first, &m.low].into_iter().chain(&m.lifted);
            sets.map(CarrierSet::memory_bytes).sum::<usize>() + m.meeting.memory_bytes()
        });
        let images = self.images.as_ref().map_or(0, |i| i.memory_bytes());
        let waves = self.waves.as_ref().map_or(0, |waves| waves.memory_bytes());
        self.taps.memory_bytes()
            + self.late.memory_bytes()
            + measured
            + images
            + waves
            + self.places.len() * size_of::<BandPlace>()
    }
}

/// Spectrum of the bass of one hop of a response at a host's lowest bins.
fn low_spectrum(
    room: &MeasuredRoom,
    scene_grid: &StftGrid,
    grid: &StftGrid,
    response: usize,
    ear: usize,
    hop: usize,
) -> Vec<Complex32> {
    let per_sample = std::f64::consts::TAU / scene_grid.sample_rate_hz;
    (0..LANES.min(grid.bins()))
        .map(|k| {
            let turn = per_sample * grid.bin_hz(k);
            let samples = room.low_hop(scene_grid, response, ear, hop);
            let sum: Complex64 =
                samples.map(|(at, x)| Complex64::from_polar(f64::from(x), turn * (scene_grid.lead() as f64 - at as f64))).sum();
            let sum = sum * room.low_step as f64;
            Complex32::new(single(sum.re), single(sum.im))
        })
        .collect()
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
