//! Gains that give a mix of measured responses the energy that its parts have in the mean.

use crate::Bands;
use crate::bands::BandPlace;
use crate::number::whole;
use crate::render::carrier::set::CarrierSet;
use crate::render::transform::lanes::{EarBlocks, LANES};
use crate::transfer::MOST_SHARES;
use pulp::{Arch, WithSimd};

/// Hops to either side over which energies are averaged for a gain: gains that differ wildly from hop to hop would be heard as
/// a modulation of tones while the listener turns (-50 dB instead of -66).
const NEAR_HOPS: usize = 2;
/// Reach of the smoothing over bands, in the lowest bins and above.
const NEAR_BANDS: [usize; 2] = [1, 2];
/// The largest gain that makes up for what a mix has lost, and its inverse: that of six with nothing in common.
const LARGEST_GAIN: f32 = 2.5;
/// Of a tap's energy, at least this share stays its own where the late part begins before the taps end.
const LEAST_LEFT: f32 = 0.25;
/// Bands up to the first of these keep the mix as it is, from the second on its energy is met, Hz: ...
const PLAIN_HZ: (f32, f32) = (200.0, 320.0);
/// ... but where the responses have so little in common that a mix keeps less than the first of these shares of their energy
/// over its whole length, from the second on it is as above.
const KEPT: (f32, f32) = (0.85, 0.97);

/// Pairs of the responses of a mix, at most.
const MOST_PAIRS: usize = MOST_SHARES * (MOST_SHARES - 1) / 2;

/// What is mixed at a pose: responses with their shares, and the likeness of each with those before it.
pub(crate) struct Mixture<'a> {
    meeting: &'a Meeting,
    count: usize,
    /// Of each response, its share and its `roots`.
    parts: [(f32, &'a [[f32; LANES]]); MOST_SHARES],
    likenesses: [&'a [[i8; LANES]]; MOST_PAIRS],
    /// How much of the mix is left as it is, `[ear][band]`.
    plain: &'a [[f32; LANES]],
}

/// Rows of numbers in whole vectors; what is left of the last vector of a row is zero.
struct Rows<T> {
    vectors: usize,
    values: Vec<[T; LANES]>,
}

impl<T: Copy + Default> Rows<T> {
    /// Of rows of so many numbers.
    fn new(row_len: usize, values: &[T]) -> Self {
        let padded = |part: &[T]| std::array::from_fn(|i| part.get(i).copied().unwrap_or_default());
        let values = values.chunks(row_len).flat_map(|row| row.chunks(LANES).map(padded)).collect();
        Self { vectors: row_len.div_ceil(LANES), values }
    }

    /// As many rows from one of them on.
    fn of(&self, first: usize, count: usize) -> &[[T; LANES]] {
        &self.values[first * self.vectors..(first + count) * self.vectors]
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(&*self.values)
    }
}

/// Energies that a mix should have, and those it has.
struct Energies {
    wanted: [f32; LANES],
    found: [f32; LANES],
}

impl Energies {
    /// The gains that bring one to the other, but for a share that is left as it is.
    #[inline(always)]
    fn gains(&self, plain: &[f32; LANES]) -> [f32; LANES] {
        std::array::from_fn(|i| {
            let (wanted, found) = (self.wanted[i], self.found[i]);
            let gain = (wanted / found.max(1e-30)).sqrt().clamp(1.0 / LARGEST_GAIN, LARGEST_GAIN);
            // What is silent needs none.
            let gain = if wanted > 1e-18 { gain } else { 1.0 };
            gain + plain[i] * (1.0 - gain)
        })
    }
}

/// Energies of responses and what each two have in common, by hop, ear and band.
pub(crate) struct Meeting {
    bands: usize,
    /// Bands of the lowest bins.
    low_bands: usize,
    /// Of a mix that is left as it is, one row of `[ear][band]`.
    plain: Rows<f32>,
    taps: usize,
    /// Square roots of mean energy densities, `[response][row][ear][band]`; a row a tap, then one of all hops after the taps,
    /// in the lowest bins, and one of all hops.
    roots: Rows<f32>,
    /// Pairs of responses, the lower number first; in order.
    pairs: Vec<(u32, u32)>,
    /// Likeness of each pair, -127 to 127, as `roots`.
    likeness: Rows<i8>,
    /// Energy density of the late part before it is at its level, for an amplitude of 1, `[tap][ear][band]` of the last taps,
    /// above the lowest bins.
    late_before: Rows<f32>,
}

impl Meeting {
    /// Of carriers on bins that lie among `bands` as `places` say; `low` are those after the taps.
    pub(crate) fn new(
        taps: &CarrierSet,
        low_set: &CarrierSet,
        places: &[BandPlace],
        bands: &Bands,
        pairs: Vec<(u32, u32)>,
        late_before: &[f32],
    ) -> Self {
        let count = bands.count();
        let low_bands = places.iter().take(LANES).map(|p| p.band + 2).max().unwrap_or(0).min(count);
        let along = |hz: f32| ((hz - PLAIN_HZ.0) / (PLAIN_HZ.1 - PLAIN_HZ.0)).clamp(0.0, 1.0);
        let plain: Vec<f32> = bands.centres_hz().iter().map(|hz| 1.0 - along(*hz)).collect();
        let row_len = 2 * count;
        let mut late_before = late_before.to_vec();
        let low = |ear: &mut [f32]| ear[..low_bands].fill(0.0);
        late_before.chunks_exact_mut(count).for_each(low);
        let mut meeting = Self {
            bands: count,
            low_bands,
            plain: Rows::new(row_len, &[&plain[..], &plain].concat()),
            taps: taps.hops(),
            roots: Rows::new(row_len, &[]),
            pairs,
            likeness: Rows::new(row_len, &[]),
            late_before: Rows::new(row_len, &late_before),
        };
        let mut work = Work::new(row_len, places, count);
        let energies: Vec<Vec<f32>> = (0..u32::try_from(taps.count()).unwrap_or(u32::MAX))
            .map(|r| meeting.products(&mut work, taps, low_set, (r, r)))
            .collect();
        let mut likeness = Vec::with_capacity(meeting.pairs.len() * (taps.hops() + 2) * row_len);
        for &(a, b) in &meeting.pairs {
            let products = meeting.products(&mut work, taps, low_set, (a, b));
            let of = |response: u32| energies[whole(response.into())].iter();
            for (product, (a, b)) in products.iter().zip(of(a).zip(of(b))) {
                let likeness_here = product / (a * b).sqrt().max(1e-30);
                #[expect(clippy::cast_possible_truncation, reason = "-127 to 127")]
                likeness.push((127.0 * likeness_here).round().clamp(-127.0, 127.0) as i8);
            }
        }
        let roots: Vec<f32> = energies.iter().flatten().map(|energy| energy.sqrt()).collect();
        (meeting.roots, meeting.likeness) = (Rows::new(row_len, &roots), Rows::new(row_len, &likeness));
        meeting
    }

    /// Rows of a response or of a pair.
    fn rows(&self) -> usize {
        self.taps + 2
    }

    /// What two responses have in common, averaged over near hops and bands.
    fn products(&self, work: &mut Work<'_>, taps: &CarrierSet, low: &CarrierSet, (a, b): (u32, u32)) -> Vec<f32> {
        let (len, count) = (2 * self.bands, self.taps);
        let mut plain = vec![0.0; (count + low.hops()) * len];
        for (hop, row) in plain.chunks_exact_mut(len).enumerate() {
            let set = if hop < count { (taps, hop) } else { (low, hop - count) };
            work.product(set.0.hop(a, set.1), set.0.hop(b, set.1), row);
        }
        let mut values = Vec::with_capacity(self.rows() * len);
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
        let at = |response: u32, i: usize| {
            let row = self.roots.of(whole(response.into()) * self.rows() + tap, 1);
            f64::from(row.as_flattened()[i]).powi(2)
        };
        let band = |b: usize| shares.iter().map(|(r, w)| 0.5 * f64::from(*w) * (at(*r, b) + at(*r, self.bands + b))).sum();
        (0..self.bands).map(band).collect()
    }

    /// Vectors of a row.
    pub(crate) fn vectors(&self) -> usize {
        self.plain.vectors
    }

    /// What is mixed at a pose; `plain` is room for a row.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn mixture<'a>(&'a self, shares: &[(u32, f32)], plain: &'a mut [[f32; LANES]]) -> Mixture<'a> {
        let mut mixture = Mixture {
            meeting: self,
            count: shares.len().min(MOST_SHARES),
            parts: [(0.0, &[]); MOST_SHARES],
            likenesses: [&[]; MOST_PAIRS],
            plain: &[],
        };
        for (part, (response, share)) in mixture.parts.iter_mut().zip(shares) {
            *part = (*share, self.roots.of(whole((*response).into()) * self.rows(), self.rows()));
        }
        let pairs = shares.iter().enumerate().flat_map(|(i, (a, _))| shares[..i].iter().map(move |(b, _)| (*a, *b)));
        for (likeness, (a, b)) in mixture.likenesses.iter_mut().zip(pairs) {
            *likeness = self.likeness_of(a, b);
        }
        plain.fill([0.0; LANES]);
        if mixture.count > 1 {
            for (vector, (plain, stated)) in plain.iter_mut().zip(&self.plain.values).enumerate() {
                if stated.iter().any(|stated| *stated > 0.0) {
                    let Energies { wanted, found } = mixture.energies((self.taps + 1) * self.vectors() + vector);
                    for (i, (plain, stated)) in plain.iter_mut().zip(stated).enumerate() {
                        let kept = ((found[i] / wanted[i].max(1e-30) - KEPT.0) / (KEPT.1 - KEPT.0)).clamp(0.0, 1.0);
                        *plain = kept * stated;
                    }
                }
            }
        }
        Mixture { plain, ..mixture }
    }

    /// Likeness of two responses; nothing where they were not expected to be mixed.
    fn likeness_of(&self, a: u32, b: u32) -> &[[i8; LANES]] {
        let found = self.pairs.binary_search(&(a.min(b), a.max(b)));
        found.map_or(&[], |i| self.likeness.of(i * self.rows(), self.rows()))
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let rows = [&self.roots, &self.late_before, &self.plain].map(Rows::memory_bytes);
        rows.iter().sum::<usize>() + size_of_val(&*self.pairs) + self.likeness.memory_bytes()
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
        let before = (row + late_before.values.len() / late_before.vectors).checked_sub(*taps).filter(|_| row < *taps);
        let before = before.map(|i| late_before.of(i, 1));
        if self.count > 1 || before.is_some() {
            arch.dispatch(Apply { mixture: self, row, before, late, gains });
        }
    }

    /// Energies that the mix should have in one vector of the rows, and those it has.
    #[inline(always)]
    fn energies(&self, at: usize) -> Energies {
        let mut out = Energies { wanted: [0.0; LANES], found: [0.0; LANES] };
        let mut heard = [[0.0_f32; LANES]; MOST_SHARES];
        let mut pairs = self.likenesses.iter();
        for (i, (share, roots)) in self.parts[..self.count].iter().enumerate() {
            let (others, rest) = heard.split_at_mut(i);
            let (own, root) = (&mut rest[0], &roots[at]);
            let mut alike = [0.0_f32; LANES];
            for (other, likeness) in others.iter().zip(&mut pairs) {
                if let Some(likeness) = likeness.get(at) {
                    for k in 0..LANES {
                        alike[k] += other[k] * f32::from(likeness[k]);
                    }
                }
            }
            for k in 0..LANES {
                own[k] = share * root[k];
                out.wanted[k] += own[k] * root[k];
                out.found[k] += own[k] * (own[k] + (2.0 / 127.0) * alike[k]);
            }
        }
        out
    }
}

struct Apply<'a> {
    mixture: &'a Mixture<'a>,
    row: usize,
    before: Option<&'a [[f32; LANES]]>,
    late: &'a [f32],
    gains: &'a mut [f32],
}

impl WithSimd for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { mixture, row, before, late, gains } = self;
        let mixed = mixture.count > 1;
        let first = row * mixture.meeting.vectors();
        for (vector, (gains, late)) in gains.chunks_mut(LANES).zip(late.chunks(LANES)).enumerate() {
            let energies = mixture.energies(first + vector);
            let mut factors = if mixed { energies.gains(&mixture.plain[vector]) } else { [1.0; LANES] };
            if let Some(before) = before {
                for (i, late) in late.iter().enumerate() {
                    let wanted = energies.wanted[i];
                    let left = (1.0 - late * late * before[vector][i] / wanted).max(LEAST_LEFT).sqrt();
                    factors[i] *= if wanted > 0.0 { left } else { 1.0 };
                }
            }
            gains.iter_mut().zip(&factors).for_each(|(gain, factor)| *gain *= factor);
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
