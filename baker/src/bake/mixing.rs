//! Measured responses as carriers of the time filters: which are mixed at a node, and the gains that give the mix its energy.

use crate::bake::direct::Direct;
use crate::bake::kriging::{Site, weights};
use crate::bake::room::Room;
use crate::signal::spectrum::{Analyser, band_means};
use glam::Vec3;
use promenade_core::{MOST_SHARES, MeasuredRoom, StftGrid, glam};
use promenade_fourier::num_complex::{Complex32, Complex64};

/// Responses that are mixed at one node, at most.
pub(crate) const PER_NODE: usize = 4;
const _: () = assert!(PER_NODE <= MOST_SHARES);
/// Smaller shares of a node's mix are left out.
const SMALLEST_SHARE: f64 = 0.1;
/// Hops to either side over which energies are added up for a gain: gains that differ wildly from hop to hop would be heard as
/// a modulation of tones while the listener turns (-50 dB instead of -66).
const NEAR_HOPS: usize = 2;
/// The largest gain that makes up for what a mix has lost, and its inverse.
const LARGEST_GAIN: f64 = 2.0;

/// Of a tap's energy, at least this share stays its own where the late part begins before the taps end.
const LEAST_LEFT: f64 = 0.25;

/// A response's share of a mix.
pub(crate) type ResponseShare = (usize, f64);

/// Shares of the measurements around a node: their kriging weights as far as those are worth mentioning.
///
/// A `level` node is looked for at the height of the measurements, since those of a ring say nothing of other heights.
pub(crate) fn shares(sites: &[Site], node: &Site, level: bool) -> Vec<ResponseShare> {
    let across = Vec3::new(node.direction.x, node.direction.y, 0.0);
    let node = if level { Site { direction: across.normalize_or(Vec3::X), ..*node } } else { *node };
    let mut found = weights(sites, &node);
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    found.truncate(PER_NODE);
    let sum: f64 = found.iter().map(|s| s.1.max(0.0)).sum();
    found.retain(|s| s.1 > SMALLEST_SHARE * sum);
    let sum: f64 = found.iter().map(|s| s.1).sum();
    found.iter_mut().for_each(|s| s.1 /= sum);
    found
}

/// Hops of all responses without their direct sound.
pub(crate) struct Hops {
    grid: StftGrid,
    room: MeasuredRoom,
    /// Spectra, `[response][ear][hop]`; after the taps of the lowest bins only.
    spectra: Vec<[Vec<Vec<Complex32>>; 2]>,
}

impl Hops {
    /// Cuts responses into hops, each times `gain`; the first is brought to a distance of 1 m.
    pub(crate) fn of(directs: &[&Direct], distances: &[f32], grid: &StftGrid, room: &Room, gain: f32) -> Self {
        let analyser = Analyser::new(*grid);
        let mut samples = Vec::with_capacity(directs.len() * 2 * room.low_hops * grid.hop);
        let low_bins = (0..grid.bins()).take_while(|k| grid.bin_hz(*k) <= room.low_hz).count();
        let mut spectra = Vec::new();
        for (direct, distance) in directs.iter().zip(distances) {
            spectra.push([0, 1].map(|ear| {
                let mut hops = Vec::with_capacity(room.low_hops);
                for hop in 0..room.low_hops {
                    let gain = f64::from(if hop == 0 { gain * distance } else { gain });
                    let piece: Vec<f64> = direct.hop(grid, ear, hop).map(|x| gain * x).collect();
                    samples.extend(piece.iter().map(|x| *x as f32));
                    let mut spectrum: Vec<Complex32> =
                        analyser.spectrum(&piece).iter().map(|x| Complex32::new(x.re as f32, x.im as f32)).collect();
                    if hop > room.shape.taps {
                        spectrum.truncate(low_bins);
                    }
                    hops.push(spectrum);
                }
                hops
            }));
        }
        Self { grid: *grid, room: MeasuredRoom { samples, hops: room.low_hops }, spectra }
    }

    /// The responses as a scene holds them.
    pub(crate) fn into_room(self) -> MeasuredRoom {
        self.room
    }

    /// Gains per tap, ear and band that bring a mix to the mean energy of its parts, linear amplitude, less what the late part
    /// of the gains `late`, `[ear][band]`, plays in the last taps already.
    ///
    /// Responses of neighbours agree in the bass, and lose half their energy where they do not. The last tap's gains in the
    /// bass are those of all hops that follow, since they go on with them.
    pub(crate) fn gains(&self, shares: &[ResponseShare], late: &[f64], room: &Room) -> Vec<f32> {
        let (taps, bands) = (room.shape.taps, &room.bands);
        let ears: [Vec<[Vec<f64>; 2]>; 2] =
            [0, 1].map(|ear| (1..taps + 1).map(|hop| self.energies(shares, ear, hop, room)).collect());
        let mut gains = Vec::with_capacity(taps * room.shape.tap_len());
        for tap in 0..taps {
            for (ear, hops) in ears.iter().enumerate() {
                for band in 0..bands.count() {
                    let low = f64::from(bands.centres_hz()[band]) <= room.low_hz;
                    // The first taps decide where the sound comes from.
                    let (near, reach) = (tap.min(NEAR_HOPS), if low { 1 } else { 2 });
                    let hops = &hops[tap - near..(tap + near + 1).min(taps)];
                    let sum = |which: usize| -> f64 {
                        hops.iter()
                            .flat_map(|h| &h[which][band.saturating_sub(reach)..(band + reach + 1).min(bands.count())])
                            .sum()
                    };
                    let late = if low { 0.0 } else { late[ear * bands.count() + band] };
                    let early = late * late * room.late_unit[ear][tap + 1][band];
                    let wanted = ears[ear][tap][0][band];
                    let left: f64 = if wanted > 0.0 { 1.0 - early / wanted } else { 1.0 };
                    gains.push(gain(left.max(LEAST_LEFT) * sum(0), sum(1)));
                }
            }
        }
        let last = gains.len() - room.shape.tap_len();
        for ear in 0..2 {
            let low = (0..bands.count()).filter(|b| f64::from(bands.centres_hz()[*b]) <= room.low_hz);
            let hops: Vec<[Vec<f64>; 2]> = (taps..self.room.hops).map(|hop| self.energies(shares, ear, hop, room)).collect();
            for band in low {
                let sum = |which: usize| hops.iter().map(|e| e[which][band]).sum::<f64>();
                gains[last + ear * bands.count() + band] = gain(sum(0), sum(1));
            }
        }
        gains
    }

    /// Energy density per band that a hop of a mix should have, and the one it has.
    fn energies(&self, shares: &[ResponseShare], ear: usize, hop: usize, room: &Room) -> [Vec<f64>; 2] {
        let spectra = || shares.iter().map(|(response, share)| (&self.spectra[*response][ear][hop], *share));
        let bins = spectra().map(|s| s.0.len()).min().unwrap_or(0);
        let (mut wanted, mut mixed) = (vec![0.0; bins], vec![Complex64::default(); bins]);
        for (spectrum, share) in spectra() {
            for ((w, m), x) in wanted.iter_mut().zip(&mut mixed).zip(spectrum) {
                let x = Complex64::new(f64::from(x.re), f64::from(x.im));
                *w += share * x.norm_sqr();
                *m += share * x;
            }
        }
        let amplitudes: Vec<_> = wanted.iter().map(|w| w.sqrt().into()).collect();
        [band_means(&self.grid, &room.bands, &amplitudes), band_means(&self.grid, &room.bands, &mixed)]
    }
}

fn gain(wanted: f64, found: f64) -> f32 {
    // A hop of silence needs no gain.
    if wanted <= 1e-18 { 1.0 } else { (wanted / found.max(1e-30)).sqrt().clamp(1.0 / LARGEST_GAIN, LARGEST_GAIN) as f32 }
}
