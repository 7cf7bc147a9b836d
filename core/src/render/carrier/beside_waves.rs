//! Noise beside waves.

use crate::number::single;
use crate::render::carrier::set::CarrierSet;
use crate::render::transform::lanes::ear_spectrum;
use crate::{StftGrid, noise_share, wave_share};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{signal, spectrum};

/// By how much noise is raised at most: with 4 noise and waves together are within a quarter of a decibel of either, and what
/// eight hops of the late part have of more would reach beyond them.
const MOST: f64 = 4.0;

/// Carriers of noise that hears what waves below a crossover leave, as loud as [`noise_share`] says: that falls half as fast as
/// what waves leave of one sound.
///
/// The noise of all hops is one line, which is raised where waves end and cut into hops again: within the bins of a frame
/// nothing rises so fast, and a hop that outlasts its length would wrap round in its frame.
pub(crate) fn beside_waves(carriers: &CarrierSet, grid: &StftGrid, crossover_hz: f64) -> CarrierSet {
    let (hops, hop, n_fft, lead) = (carriers.hops(), grid.hop, grid.n_fft, grid.lead());
    // A frame's transform is periodic: samples before its time lie at its end.
    let place = |sample: usize| (sample + n_fft - lead) % n_fft;
    let ears = [0, 1].map(|ear| {
        let mut line = vec![0.0_f32; hops * hop];
        for (number, samples) in line.chunks_exact_mut(hop).enumerate() {
            let mut bins = vec![Complex32::default(); grid.bins()];
            ear_spectrum(carriers.hop(0, number), ear, &mut bins);
            let frame = signal(bins, n_fft);
            samples.iter_mut().enumerate().for_each(|(i, sample)| *sample = frame[place(i)]);
        }
        // As much silence as a frame rings.
        let whole = (line.len() + n_fft).next_power_of_two();
        let mut bins = spectrum(line.iter().copied(), whole);
        for (k, bin) in bins.iter_mut().enumerate() {
            let hz = k as f64 * grid.sample_rate_hz / whole as f64;
            let left = (1.0 - wave_share(hz, crossover_hz)).max(1e-12);
            *bin *= single((noise_share(hz, crossover_hz) / left).min(MOST));
        }
        signal(bins, whole)
    });
    let of_hop = |number: usize| {
        ears.each_ref().map(|line| {
            let mut frame = vec![0.0; n_fft];
            line[number * hop..][..hop].iter().enumerate().for_each(|(i, sample)| frame[place(i)] = *sample);
            spectrum(frame, n_fft)
        })
    };
    CarrierSet::pack((0..hops).map(of_hop), hops, grid.bins())
}
