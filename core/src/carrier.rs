//! Fixed pseudo-random spectra that carry the time filters.

use crate::bands::{BandPlace, Bands};
use crate::{StftGrid, TailModel};
use realfft::num_complex::{Complex32, Complex64};

/// Bins from one random angle of [`smooth_phases`] to the next.
const PHASE_BINS: usize = 10;

/// Spectra of both ears for one hop of a room's response.
pub(crate) type EarSpectra = [Vec<Complex32>; 2];

/// Where every bin of a host grid lies among a scene's bands.
pub(crate) fn band_places(grid: &StftGrid, bands: &Bands, top_hz: f32) -> Vec<BandPlace> {
    #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
    (0..grid.bins()).map(|k| bands.place((grid.bin_hz(k) as f32).min(top_hz))).collect()
}

/// Carriers of explicit taps: noise one hop long, from [`StftGrid::lead`] before its tap on, of unit energy in every band. Sets
/// with different `set` numbers are unrelated.
///
/// Filters this short fit the room that frames leave for them, so they are time-invariant: no echo ahead of the direct sound, no
/// modulation at the hop rate, and tones stay tones, which phases drawn anew for every bin would not leave.
///
/// The noise is that of the scene's own grid at every host rate, so that a scene sounds and measures the same; above the
/// scene's Nyquist frequency its spectrum repeats.
pub(crate) fn hop_carriers(
    grid: &StftGrid,
    scene_grid: &StftGrid,
    bands: &Bands,
    top_hz: f32,
    tail: &TailModel,
    set: u64,
    hops: usize,
) -> Vec<EarSpectra> {
    let places = band_places(grid, bands, top_hz);
    let scene_places = band_places(scene_grid, bands, f32::INFINITY);
    let coherences = [&scene_places, &places].map(|p| per_bin(p, &tail.coherence));
    (0..hops)
        .map(|hop| {
            let noises = [2 * set, 2 * set + 1].map(|stream| {
                let mut noise = Noise::new(tail.seed, stream, hop as u64);
                let scale = 1.0 / (scene_grid.hop as f32).sqrt();
                (0..scene_grid.hop).map(|_| scale * noise.gaussian()).collect::<Vec<_>>()
            });
            let both_ears = |on: &StftGrid, coherence: &[f32]| {
                let [left, other] = noises.each_ref().map(|noise| spectrum_on(on, noise, scene_grid));
                let right = blend_ears(&left, &other, coherence);
                [left, right]
            };
            let on_scene = both_ears(scene_grid, &coherences[0]);
            let mut ears = if grid == scene_grid { on_scene.clone() } else { both_ears(grid, &coherences[1]) };
            for (ear, reference) in ears.iter_mut().zip(&on_scene) {
                let level = per_bin(&places, &band_levels(reference, &scene_places, bands.count()));
                ear.iter_mut().zip(level).for_each(|(x, g)| *x *= g);
            }
            ears
        })
        .collect()
}

/// Spectrum of noise sampled on the scene's grid, at the bins of another grid.
fn spectrum_on(grid: &StftGrid, noise: &[f32], scene_grid: &StftGrid) -> Vec<Complex32> {
    (0..grid.bins())
        .map(|k| {
            let turn = -std::f64::consts::TAU * grid.bin_hz(k) / scene_grid.sample_rate_hz;
            let step = Complex64::from_polar(1.0, turn);
            let mut phasor = Complex64::from_polar(1.0, -turn * scene_grid.lead() as f64);
            let mut sum = Complex64::default();
            for x in noise {
                sum += phasor * f64::from(*x);
                phasor *= step;
            }
            #[expect(clippy::cast_possible_truncation, reason = "a spectrum of single precision")]
            Complex32::new(sum.re as f32, sum.im as f32)
        })
        .collect()
}

/// Unit phasors that turn slowly over frequency: a random angle every [`PHASE_BINS`] bins of the scene's grid, with a raised cosine in
/// between.
pub(crate) fn smooth_phases(grid: &StftGrid, scene_grid: &StftGrid, seed: u64, stream: u64) -> Vec<Complex32> {
    let mut noise = Noise::new(seed, stream, 0);
    let knot_hz = scene_grid.bin_hz(PHASE_BINS);
    let place = |k: usize| grid.bin_hz(k) / knot_hz;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of knots")]
    let knots: Vec<f32> = (0..place(grid.bins()) as usize + 2).map(|_| noise.phase()).collect();
    (0..grid.bins())
        .map(|k| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a knot and a fraction")]
            let (knot, along) = (place(k) as usize, place(k).fract() as f32);
            let share = 0.5 - 0.5 * (std::f32::consts::PI * along).cos();
            Complex32::from_polar(1.0, knots[knot] + share * (knots[knot + 1] - knots[knot]))
        })
        .collect()
}

/// A value per band, spread over bins.
pub(crate) fn per_bin(places: &[BandPlace], bands: &[f32]) -> Vec<f32> {
    places.iter().map(|p| bands[p.band] + p.fraction * (bands[p.band + 1] - bands[p.band])).collect()
}

/// The right ear's carrier with the wanted interaural coherence (real, per bin) to the left's.
fn blend_ears(left: &[Complex32], other: &[Complex32], coherence: &[f32]) -> Vec<Complex32> {
    left.iter().zip(other).zip(coherence).map(|((l, o), c)| l * c + o * (1.0 - c * c).max(0.0).sqrt()).collect()
}

/// Gain per band that brings a spectrum's mean energy to 1 there, whatever the draw.
fn band_levels(spectrum: &[Complex32], places: &[BandPlace], bands: usize) -> Vec<f32> {
    let (mut energy, mut weight) = (vec![0.0_f32; bands], vec![1e-9_f32; bands]);
    for (x, p) in spectrum.iter().zip(places) {
        for (band, w) in [(p.band, 1.0 - p.fraction), (p.band + 1, p.fraction)] {
            energy[band] += w * x.norm_sqr();
            weight[band] += w;
        }
    }
    energy.iter().zip(&weight).map(|(e, w)| if *e > 0.0 { (w / e).sqrt() } else { 0.0 }).collect()
}

/// Counter-based noise: the same numbers for the same seed, stream and index on every machine.
struct Noise {
    state: u64,
}

impl Noise {
    fn new(seed: u64, stream: u64, index: u64) -> Self {
        Self { state: mix(mix(mix(seed) ^ stream) ^ index) }
    }

    /// Uniform in (0, 1).
    fn uniform(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        ((mix(self.state) >> 40) as f32 + 0.5) / 16_777_216.0
    }

    fn phase(&mut self) -> f32 {
        std::f32::consts::TAU * self.uniform()
    }

    /// Standard normal (Box and Muller 1958).
    fn gaussian(&mut self) -> f32 {
        (-2.0 * self.uniform().ln()).sqrt() * self.phase().cos()
    }
}

/// Finaliser of the splitmix64 generator (Steele, Lea and Flood 2014).
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
