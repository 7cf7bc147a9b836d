//! Gains that give a mix of measured responses the energy that its parts have in the mean.

use crate::Bands;
use crate::bands::BandPlace;
use crate::number::whole;
use crate::render::carrier_set::CarrierSet;
use crate::render::lanes::{EarBlocks, LANES};
use crate::transfer::MOST_SHARES;
use pulp::{Arch, WithSimd};

/// Hops to either side over which energies are averaged for a gain: gains that differ wildly from hop to hop would be heard as
/// a modulation of tones while the listener turns (-50 dB instead of -66).
const NEAR_HOPS: usize = 2;
/// The same for bands, in the lowest bins and above.
const NEAR_BANDS: [usize; 2] = [1, 2];
/// The largest gain that makes up for what a mix has lost, and its inverse: that of six with nothing in common.
const LARGEST_GAIN: f32 = 2.5;
/// Of a tap's energy, at least this share stays its own where the late part begins before the taps end.
const LEAST_LEFT: f32 = 0.25;
/// Bands up to the first of these keep the mix as it is, from the second on its energy is met, Hz: ...
const PLAIN_HZ: (f32, f32) = (200.0, 320.0);
/// ... but where the responses have so little in common that a mix keeps less than the first of these shares of their energy
/// over its whole length, from the second on it is as above.
const KEPT: (f32, f32) = (0.6, 0.85);

/// Pairs of the responses of a mix, at most.
const MOST_PAIRS: usize = MOST_SHARES * (MOST_SHARES - 1) / 2;

/// What is mixed at a pose: responses with their shares, and the likeness of each with those before it.
pub(crate) struct Mixture<'a> {
    meeting: &'a Meeting,
    shares: &'a [(u32, f32)],
    likenesses: [&'a [i8]; MOST_PAIRS],
    /// How much of the mix is left as it is, `[ear][band]`.
    plain: &'a [f32],
}

/// Energies that a mix should have, and those it has.
struct Energies {
    wanted: [f32; LANES],
    found: [f32; LANES],
}

impl Energies {
    /// The gain that brings one to the other.
    #[inline(always)]
    fn gain(&self, i: usize) -> f32 {
        let (wanted, found) = (self.wanted[i], self.found[i]);
        // What is silent needs none.
        if wanted > 1e-18 { (wanted / found.max(1e-30)).sqrt().clamp(1.0 / LARGEST_GAIN, LARGEST_GAIN) } else { 1.0 }
    }
}

/// Energies of responses and what each two have in common, by hop, ear and band.
pub(crate) struct Meeting {
    bands: usize,
    /// Bands of the lowest bins.
    low_bands: usize,
    /// Of a mix that is left as it is, by band.
    plain: Vec<f32>,
    taps: usize,
    /// Mean energy density, `[response][row][ear][band]`; a row a tap, then one of all hops after the taps, in the lowest bins,
    /// and one of all hops.
    energies: Vec<f32>,
    /// Pairs of responses, the lower number first; in order.
    pairs: Vec<(u32, u32)>,
    /// Likeness of each pair, -127 to 127, as `energies`.
    likeness: Vec<i8>,
    /// Energy density of the late part before it is at its level, for an amplitude of 1, `[tap][ear][band]` of the last taps.
    late_before: Vec<f32>,
}

impl Meeting {
    /// Of carriers on bins that lie among `bands` as `places` say; `low` are those after the taps.
    pub(crate) fn new(
        taps: &CarrierSet,
        low: &CarrierSet,
        places: &[BandPlace],
        bands: &Bands,
        pairs: Vec<(u32, u32)>,
        late_before: &[f32],
    ) -> Self {
        let count = bands.count();
        let low_bands = places.iter().take(LANES).map(|p| p.band + 2).max().unwrap_or(0).min(count);
        let along = |hz: f32| ((hz - PLAIN_HZ.0) / (PLAIN_HZ.1 - PLAIN_HZ.0)).clamp(0.0, 1.0);
        let mut meeting = Self {
            bands: count,
            low_bands,
            plain: bands.centres_hz().iter().map(|hz| 1.0 - along(*hz)).collect(),
            taps: taps.hops(),
            energies: Vec::new(),
            pairs,
            likeness: Vec::new(),
            late_before: late_before.to_vec(),
        };
        let mut work = Work::new(meeting.row_len(), places, count);
        let energies: Vec<f32> = (0..u32::try_from(taps.count()).unwrap_or(u32::MAX))
            .flat_map(|r| meeting.products(&mut work, taps, low, (r, r)))
            .collect();
        meeting.energies = energies;
        let mut likeness = Vec::with_capacity(meeting.pairs.len() * meeting.response_len());
        for &(a, b) in &meeting.pairs {
            let products = meeting.products(&mut work, taps, low, (a, b));
            for (product, (a, b)) in products.iter().zip(meeting.of(a).iter().zip(meeting.of(b))) {
                let likeness_here = product / (a * b).sqrt().max(1e-30);
                #[expect(clippy::cast_possible_truncation, reason = "-127 to 127")]
                likeness.push((127.0 * likeness_here).round().clamp(-127.0, 127.0) as i8);
            }
        }
        meeting.likeness = likeness;
        meeting
    }

    /// Values of a row: both ears.
    fn row_len(&self) -> usize {
        2 * self.bands
    }

    fn response_len(&self) -> usize {
        (self.taps + 2) * self.row_len()
    }

    /// Energies of a response.
    fn of(&self, response: u32) -> &[f32] {
        let len = self.response_len();
        &self.energies[whole(response.into()) * len..][..len]
    }

    /// What two responses have in common, averaged over near hops and bands.
    fn products(&self, work: &mut Work<'_>, taps: &CarrierSet, low: &CarrierSet, (a, b): (u32, u32)) -> Vec<f32> {
        let (len, count) = (self.row_len(), self.taps);
        let mut plain = vec![0.0; (count + low.hops()) * len];
        for (hop, row) in plain.chunks_exact_mut(len).enumerate() {
            let set = if hop < count { (taps, hop) } else { (low, hop - count) };
            work.product(set.0.hop(a, set.1), set.0.hop(b, set.1), row);
        }
        let mut values = Vec::with_capacity(self.response_len());
        for tap in 0..count {
            let near = tap.min(NEAR_HOPS);
            let hops = tap - near..(tap + near + 1).min(count);
            for i in 0..len {
                let (ear, band) = (i / self.bands, i % self.bands);
                let reach = NEAR_BANDS[usize::from(band >= self.low_bands)];
                let bands = band.saturating_sub(reach)..(band + reach + 1).min(self.bands);
                let over = (hops.len() * bands.len()) as f32;
                let sum: f32 =
                    hops.clone().map(|hop| plain[hop * len + ear * self.bands..][bands.clone()].iter().sum::<f32>()).sum();
                values.push(sum / over);
            }
        }
        let sum = |rows: &[f32], i: usize| rows.chunks_exact(len).map(|row| row[i]).sum::<f32>();
        let after = &plain[count * len..];
        values.extend((0..len).map(|i| if i % self.bands < self.low_bands { sum(after, i) } else { 0.0 }));
        values.extend((0..len).map(|i| sum(&plain, i)));
        values
    }

    /// Energy by band, mean of both ears, of a tap of a mix.
    pub(crate) fn energy(&self, tap: usize, shares: &[(u32, f32)]) -> Vec<f64> {
        let at = |response: u32, i: usize| f64::from(self.of(response)[tap * self.row_len() + i]);
        let band = |b: usize| shares.iter().map(|(r, w)| 0.5 * f64::from(*w) * (at(*r, b) + at(*r, self.bands + b))).sum();
        (0..self.bands).map(band).collect()
    }

    /// What is mixed at a pose; `plain` is room for a value of each ear and band.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn mixture<'a>(&'a self, shares: &'a [(u32, f32)], plain: &'a mut [f32]) -> Mixture<'a> {
        let mut likenesses: [&[i8]; MOST_PAIRS] = [&[]; MOST_PAIRS];
        let pairs = shares.iter().enumerate().flat_map(|(i, (a, _))| shares[..i].iter().map(move |(b, _)| (*a, *b)));
        for (likeness, (a, b)) in likenesses.iter_mut().zip(pairs) {
            *likeness = self.likeness_of(a, b);
        }
        plain.fill(0.0);
        if shares.len() > 1 {
            let whole_at = (self.taps + 1) * self.row_len();
            let all = Mixture { meeting: self, shares, likenesses, plain: &[] };
            for (chunk, plain) in plain.chunks_mut(LANES).enumerate() {
                let first = chunk * LANES;
                let stated = |i: usize| self.plain[(first + i) % self.bands];
                if (0..plain.len()).any(|i| stated(i) > 0.0) {
                    let Energies { wanted, found } = all.energies(whole_at + first, plain.len());
                    for (i, plain) in plain.iter_mut().enumerate() {
                        let kept = ((found[i] / wanted[i].max(1e-30) - KEPT.0) / (KEPT.1 - KEPT.0)).clamp(0.0, 1.0);
                        *plain = kept * stated(i);
                    }
                }
            }
        }
        Mixture { meeting: self, shares, likenesses, plain }
    }

    /// Likeness of two responses; nothing where they were not expected to be mixed.
    fn likeness_of(&self, a: u32, b: u32) -> &[i8] {
        let len = self.response_len();
        self.pairs.binary_search(&(a.min(b), a.max(b))).map_or(&[], |i| &self.likeness[i * len..][..len])
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        4 * (self.energies.len() + self.late_before.len()) + size_of_val(&*self.pairs) + self.likeness.len()
    }
}

impl Mixture<'_> {
    /// Multiplies gains, `[ear][band]`, of a tap (or, after the last, of all hops to come) by those that bring a mix to the
    /// mean energy of its parts, less what the late part of amplitudes `late`, `[ear][band]`, plays there already.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn apply(&self, arch: Arch, row: usize, late: &[f32], gains: &mut [f32]) {
        let Meeting { taps, late_before, .. } = self.meeting;
        let row_len = self.meeting.row_len();
        let before = (row + late_before.len() / row_len).checked_sub(*taps).filter(|_| row < *taps);
        let before = before.map(|i| &late_before[i * row_len..][..row_len]);
        if self.shares.len() > 1 || before.is_some() {
            arch.dispatch(Apply { mixture: self, at: row * row_len, before, late, gains });
        }
    }

    /// Energies that the mix should have from a place of the tables on, and those it has.
    #[inline(always)]
    fn energies(&self, at: usize, count: usize) -> Energies {
        let len = self.meeting.response_len();
        let mut out = Energies { wanted: [0.0; LANES], found: [0.0; LANES] };
        let mut roots = [[0.0_f32; LANES]; MOST_SHARES];
        let mut pair = 0;
        for (i, (response, share)) in self.shares.iter().enumerate() {
            let energies = &self.meeting.energies[whole((*response).into()) * len + at..][..count];
            let (others, rest) = roots.split_at_mut(i);
            let own = &mut rest[0];
            for (k, energy) in energies.iter().enumerate() {
                own[k] = share * energy.sqrt();
                out.wanted[k] += share * energy;
                out.found[k] += own[k] * own[k];
            }
            for other in others {
                if let Some(likeness) = self.likenesses[pair].get(at..at + count) {
                    for (k, likeness) in likeness.iter().enumerate() {
                        out.found[k] += own[k] * other[k] * (2.0 / 127.0) * f32::from(*likeness);
                    }
                }
                pair += 1;
            }
        }
        out
    }
}

struct Apply<'a> {
    mixture: &'a Mixture<'a>,
    /// Place of the row in the tables.
    at: usize,
    before: Option<&'a [f32]>,
    late: &'a [f32],
    gains: &'a mut [f32],
}

impl WithSimd for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { mixture, at, before, late, gains } = self;
        let Meeting { bands, low_bands, .. } = mixture.meeting;
        let mixed = mixture.shares.len() > 1;
        for (chunk, gains) in gains.chunks_mut(LANES).enumerate() {
            let first = chunk * LANES;
            let energies = mixture.energies(at + first, gains.len());
            for (i, gain) in gains.iter_mut().enumerate() {
                let wanted = energies.wanted[i];
                let mut factor = if mixed { energies.gain(i) } else { 1.0 };
                factor += mixture.plain[first + i] * (1.0 - factor);
                if let Some(before) = before
                    && wanted > 0.0
                    && (first + i) % bands >= *low_bands
                {
                    let late = late[first + i];
                    factor *= (1.0 - late * late * before[first + i] / wanted).max(LEAST_LEFT).sqrt();
                }
                *gain *= factor;
            }
        }
    }
}

/// Room to multiply spectra in.
struct Work<'a> {
    places: &'a [BandPlace],
    /// Weights of bins in each band, added up.
    weights: Vec<f32>,
    bins: Vec<f32>,
    row_len: usize,
}

impl<'a> Work<'a> {
    fn new(row_len: usize, places: &'a [BandPlace], bands: usize) -> Self {
        let mut weights = vec![1e-9; bands];
        for place in places {
            weights[place.band] += 1.0 - place.fraction;
            weights[place.band + 1] += place.fraction;
        }
        Self { places, weights, bins: vec![0.0; places.len() + LANES], row_len }
    }

    /// Adds up the products of two spectra by ear and band: means over the bins.
    fn product(&mut self, a: &[EarBlocks], b: &[EarBlocks], out: &mut [f32]) {
        let bands = self.row_len / 2;
        out.fill(0.0);
        for (ear, out) in out.chunks_exact_mut(bands).enumerate() {
            for ((a, b), bins) in a.iter().zip(b).zip(self.bins.chunks_exact_mut(LANES)) {
                let (a, b) = (&a.ears[ear], &b.ears[ear]);
                for (i, x) in bins.iter_mut().enumerate() {
                    *x = a.re[i] * b.re[i] + a.im[i] * b.im[i];
                }
            }
            for (x, place) in self.bins.iter().zip(self.places).take(a.len() * LANES) {
                let above = place.fraction * x;
                out[place.band] += x - above;
                out[place.band + 1] += above;
            }
            out.iter_mut().zip(&self.weights).for_each(|(v, w)| *v /= w);
        }
    }
}
