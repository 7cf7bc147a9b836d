//! Ambisonic room responses, heard with a head that turns.
//!
//! The direct sound and early reflections come from their own directions, each sample from that of the active intensity around
//! it (the spatial decomposition method with the window lengths of BinauralSDM; see `direction.rs`). What this leaves of the
//! channels at low frequencies, which the order resolves, and what comes later are decoded for the head by filters (see
//! `decoder.rs`). All of it turns with the head, so that one response becomes binaural responses at any orientation.

mod arrivals;
mod decoder;
mod direction;
mod ears;
mod load;

use crate::sources::simulation::Hrtf;
use crate::{BakeError, Response, Responses};
use arrivals::Arrivals;
use decoder::filters;
use ears::{Frame, spectra};
use promenade_core::glam::{Quat, Vec3};
use promenade_core::head::Incidence;
use promenade_core::head::{RESOLVED_HZ, channels, degree, order_of, turning};
use promenade_core::{AmbisonicHead, Pose};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{signal, spectrum};
use promenade_metrics::onset;
use rayon::prelude::*;
use std::path::PathBuf;

/// Early reflections have directions up to this long after the direct sound, seconds: later, the windows of the intensity hold
/// several in rooms of usual size, and decoding them measures better than BinauralSDM's 80 ms. Then come so many seconds in
/// which the late part fades in.
const MIXING_S: f64 = 0.025;
const FADE_S: f64 = 0.005;
/// How far the direct sound may come from beside its stated source, degrees.
const MAX_OFF_DEG: f32 = 30.0;

/// How the channels of a response are ordered and scaled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Normalisation {
    /// No channel louder than the first for one plane wave, as in AmbiX.
    #[default]
    Sn3d,
    /// All channels of equal energy in a diffuse field.
    N3d,
    /// Furse and Malham's: channels in the order W, X, Y, Z, R ... Q, the first 3 dB lower, to order 3.
    Fuma,
}

/// Where each channel of AmbiX is among those of Furse and Malham, and its gain to SN3D (Malham, "Higher order Ambisonic
/// systems", 2003).
const FUMA: [(usize, f32); 16] = {
    // Square roots of 2, 3/4, 5/8, 5/9 and 32/45.
    const W: f32 = std::f32::consts::SQRT_2;
    const S: f32 = 0.866_025_4;
    const P: f32 = 0.790_569_4;
    const N: f32 = 0.745_356;
    const L: f32 = 0.843_274;
    [
        (0, W),
        (2, 1.0),
        (3, 1.0),
        (1, 1.0),
        (8, S),
        (6, S),
        (4, 1.0),
        (5, S),
        (7, S),
        (15, P),
        (13, N),
        (11, L),
        (9, 1.0),
        (10, L),
        (12, N),
        (14, P),
    ]
};

/// An Ambisonic response.
#[derive(Clone, Debug, PartialEq)]
pub struct AmbisonicResponse {
    /// The microphone: its centre, and its axes x ahead, y left, z up.
    pub listener: Pose,
    /// The source, world metres; without it one at `distance_m` where the direct sound comes from.
    pub source: Option<Vec3>,
    /// Metres to the source where its place is not known.
    pub distance_m: Option<f32>,
    /// Impulse responses of the channels, all of one length.
    pub channels: Vec<Vec<f32>>,
    /// File or index it came from.
    pub name: String,
}

/// A head as image sources are heard with.
pub(crate) fn ambisonic_head(hrtf: &Hrtf) -> AmbisonicHead {
    let frame = Frame::short(hrtf);
    let filters =
        filters(3, Incidence::Horizontal, hrtf, frame, |d| spectra(hrtf, d)).into_iter().flatten().flatten().collect();
    AmbisonicHead { sample_rate_hz: f64::from(hrtf.sample_rate_hz()), lead: frame.lead, filters }
}

/// What both ears hear of a direction of unit length, forward, left and up, as impulse responses.
pub(crate) fn head_responses(hrtf: &Hrtf, direction: Vec3) -> [Vec<f32>; 2] {
    Frame::of(hrtf).heard(hrtf, direction)
}

/// Ambisonic responses of one room at one sample rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AmbisonicResponses {
    /// Name of the set.
    pub title: String,
    /// Who measured it.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Samples per second, a whole number.
    pub sample_rate_hz: f64,
    /// How the channels are scaled.
    pub normalisation: Normalisation,
    /// The responses.
    pub responses: Vec<AmbisonicResponse>,
    /// Notes to the user about the loading.
    pub notes: Vec<String>,
    /// What they were loaded from, for errors.
    pub path: PathBuf,
}

impl AmbisonicResponses {
    /// Binaural responses of a level head in the place of each microphone, at `yaws` directions evenly around, the first along
    /// the world's x. Their names are the responses' with the yaw in degrees. Sounds begin 1.5 ms later than in the channels.
    /// `done` is called with the number of finished responses.
    ///
    /// # Errors
    /// Channels that are not 4, 9, 16 or 25 or of different lengths, a silent first channel, a source that is neither stated
    /// nor has a distance, dipoles that are scaled otherwise, a direct sound that comes from more than 30 degrees beside its
    /// stated source; a number of yaws out of 4 to 360; an HRTF of another rate.
    pub fn binaural(&self, hrtf: &Hrtf, yaws: usize, mut done: impl FnMut(usize)) -> Result<Responses, BakeError> {
        if !(4..=360).contains(&yaws) {
            return Err(BakeError::argument("yaws", "4 to 360", yaws));
        }
        if f64::from(hrtf.sample_rate_hz()) != self.sample_rate_hz {
            let expected = format!("that of the responses, {} Hz", self.sample_rate_hz);
            return Err(BakeError::argument("sample rate of the HRTF", expected, hrtf.sample_rate_hz()));
        }
        let mut decoder: Option<(usize, Vec<[Vec<f32>; 2]>)> = None;
        let (mut responses, mut notes) = (Vec::with_capacity(yaws * self.responses.len()), self.notes.clone());
        for (index, response) in self.responses.iter().enumerate() {
            let wrong = |expected: String, found: String| BakeError::entry(&self.path, &response.name, expected, found);
            let order = response.order(self.normalisation).map_err(|(e, f)| wrong(e, f))?;
            let (_, filters) = match &decoder {
                Some(kept) if kept.0 == order => kept,
                _ => decoder.insert((order, filters(order, Incidence::Diffuse, hrtf, Frame::of(hrtf), |d| spectra(hrtf, d)))),
            };
            let split = Split::of(response, self.normalisation, order, self.sample_rate_hz)
                .ok_or_else(|| wrong("a direct sound in its first channel".to_owned(), "silence".to_owned()))?;
            self.normalisation.check(split.arrivals.dipoles_db).map_err(|(e, f)| wrong(e, f))?;
            let source = response.place(split.arrivals.direct, &mut notes).map_err(|(e, f)| wrong(e, f))?;
            let decoding = Decoding::new(&split, filters, order, hrtf);
            let heads = (0..yaws).into_par_iter().map(|i| {
                let degrees = 360.0 * i as f32 / yaws as f32;
                let listener = Pose::from_ypr(response.listener.position, degrees.to_radians(), 0.0, 0.0);
                let head = response.listener.orientation.inverse() * listener.orientation;
                let [left, right] = decoding.heard(&split.arrivals, hrtf, head);
                Response { listener, source, left, right, name: format!("{}-yaw-{degrees}", response.name) }
            });
            responses.extend(heads.collect::<Vec<_>>());
            done(index + 1);
        }
        notes.push(format!(
            "Ambisonic responses as {yaws} binaural ones each: directions by the intensity up to {:.0} ms, decoded after that",
            1e3 * MIXING_S
        ));
        Ok(Responses {
            title: self.title.clone(),
            credit: self.credit.clone(),
            licence: self.licence.clone(),
            sample_rate_hz: self.sample_rate_hz,
            responses,
            notes,
            ..Responses::default()
        })
    }
}

/// What was expected and what was found.
type Mistake = (String, String);

impl Normalisation {
    /// Every one, its name, and how much louder the dipoles together are than the omnidirectional channel in one plane wave,
    /// dB.
    const ALL: [(Self, &str, f64); 3] = [(Self::Sn3d, "sn3d", 0.0), (Self::Fuma, "fuma", 3.010_3), (Self::N3d, "n3d", 4.771_2)];

    /// Refuses channels that another one fits better: the direct sound is nearly one plane wave. `dipoles_db` is how much
    /// louder its dipoles are, with channels scaled as this one has it.
    fn check(self, dipoles_db: f64) -> Result<(), Mistake> {
        let own_db = Self::ALL.iter().find(|(n, ..)| *n == self).map_or(0.0, |n| n.2);
        let off_db = |n: &(Self, &str, f64)| (dipoles_db + own_db - n.2).abs();
        let Some((nearest, name, _)) = Self::ALL.iter().min_by(|a, b| off_db(a).total_cmp(&off_db(b))) else { return Ok(()) };
        if *nearest == self {
            return Ok(());
        }
        let expected = "dipoles as loud as the omnidirectional channel in the direct sound";
        Err((expected.to_owned(), format!("{dipoles_db:+.1} dB, as with `--normalisation {name}`")))
    }

    /// Where a channel of AmbiX is stored, and its gain to N3D.
    fn stored(self, channel: usize) -> (usize, f32) {
        let n3d = ((2 * degree(channel) + 1) as f32).sqrt();
        match self {
            Self::N3d => (channel, 1.0),
            Self::Sn3d => (channel, n3d),
            Self::Fuma => (FUMA[channel].0, FUMA[channel].1 * n3d),
        }
    }
}

impl AmbisonicResponse {
    /// The order of its channels.
    fn order(&self, normalisation: Normalisation) -> Result<usize, Mistake> {
        let (most, expected) = match normalisation {
            Normalisation::Fuma => (3, "4, 9 or 16 channels, the orders 1 to 3"),
            _ => (4, "4, 9, 16 or 25 channels, the orders 1 to 4"),
        };
        let wrong = || (expected.to_owned(), format!("{} channels", self.channels.len()));
        let order = order_of(self.channels.len()).filter(|order| *order <= most).ok_or_else(wrong)?;
        match self.channels.iter().find(|c| c.len() != self.channels[0].len()) {
            Some(other) => Err((format!("channels of {} samples", self.channels[0].len()), format!("one of {}", other.len()))),
            None => Ok(order),
        }
    }

    /// The place of the source, stated or found where the direct sound comes from.
    fn place(&self, direct: Vec3, notes: &mut Vec<String>) -> Result<Vec3, Mistake> {
        let Some(source) = self.source else {
            let Some(distance) = self.distance_m.filter(|d| d.is_finite() && *d > 0.0) else {
                return Err(("a source, or a distance to it above 0".to_owned(), "neither".to_owned()));
            };
            notes.push(format!("the source of '{}' was taken to be where its direct sound comes from: {direct:.2}", self.name));
            return Ok(self.listener.position + self.listener.orientation * direct * distance);
        };
        let stated = self.listener.to_head(source).normalize_or_zero();
        let off_deg = stated.angle_between(direct).to_degrees();
        if off_deg <= MAX_OFF_DEG {
            return Ok(source);
        }
        let expected = format!(
            "a direct sound from within {MAX_OFF_DEG} degrees of its source, {stated:.2} in the microphone's axes \
             (are the channels in the order W, Y, Z, X, and do azimuths grow to the left?)"
        );
        Err((expected, format!("one from {direct:.2}, {off_deg:.0} degrees beside it")))
    }
}

/// A response taken apart.
struct Split {
    arrivals: Arrivals,
    /// Channels with equal energy in a diffuse field (N3D): what of the early part is not in the arrivals, and the late part.
    early: Vec<Vec<f32>>,
    late: Vec<Vec<f32>>,
}

impl Split {
    fn of(response: &AmbisonicResponse, from: Normalisation, order: usize, sample_rate_hz: f64) -> Option<Self> {
        let w = &response.channels[0];
        let onset = onset(w)?;
        let samples = |s: f64| (s * sample_rate_hz).round() as usize;
        let (mixing, fade) = (onset + samples(MIXING_S), samples(FADE_S));
        let share = |i: usize| {
            let passed = (i.saturating_sub(mixing) as f32 / fade as f32).min(1.0);
            (0.5 * std::f32::consts::PI * passed).cos().powi(2)
        };
        let end = (mixing + fade).min(w.len());
        let part = |of: &dyn Fn(usize) -> f32| -> Vec<Vec<f32>> {
            let one = |c: usize| {
                let (at, gain) = from.stored(c);
                response.channels[at].iter().enumerate().map(|(i, v)| gain * of(i) * v).collect()
            };
            (0..channels(order)).map(one).collect()
        };
        let (mut early, late) = (part(&share), part(&|i| 1.0 - share(i)));
        let unit = |c: usize| -> Vec<f32> { early[c].iter().map(|v| v / ((2 * degree(c) + 1) as f32).sqrt()).collect() };
        let first = [0, 1, 2, 3].map(unit);
        let arrivals = Arrivals::of(first.each_ref().map(|c| &c[..]), &early[0][..end], onset, sample_rate_hz)?;
        arrivals.take_from(order, &mut early);
        Some(Self { arrivals, early, late })
    }
}

/// Spectra that are decoded for any orientation of the head.
struct Decoding {
    order: usize,
    /// Of the channels, `[channel][bin]`: all of the late part, of the early part what the order resolves.
    channels: Vec<Vec<Complex32>>,
    /// Of the filters, `[channel][ear][bin]`.
    filters: Vec<[Vec<Complex32>; 2]>,
    /// Samples of the transform and of what is heard.
    n_fft: usize,
    length: usize,
}

impl Decoding {
    fn new(split: &Split, filters: &[[Vec<f32>; 2]], order: usize, hrtf: &Hrtf) -> Self {
        let frame = Frame::of(hrtf);
        let length = split.late.first().map_or(0, Vec::len) + frame.lead;
        let n_fft = (length + frame.length).next_power_of_two();
        let middle = order as f64 * RESOLVED_HZ;
        let bins = n_fft / 2 + 1;
        // How much of what is not in the arrivals is decoded: what the order resolves.
        let resolved: Vec<f32> = (0..bins)
            .map(|k| {
                let octaves = (k as f64 * f64::from(hrtf.sample_rate_hz()) / n_fft as f64 / middle).max(1e-9).log2();
                (0.5 * std::f64::consts::PI * (octaves + 0.5).clamp(0.0, 1.0)).cos().powi(2) as f32
            })
            .collect();
        let of = |x: &Vec<f32>| spectrum(x.iter().copied(), n_fft);
        let decoded = |(early, late): (&Vec<f32>, &Vec<f32>)| {
            let mut all = of(late);
            all.iter_mut().zip(of(early)).zip(&resolved).for_each(|((a, e), share)| *a += e * share);
            all
        };
        Self {
            order,
            channels: split.early.iter().zip(&split.late).map(decoded).collect(),
            filters: filters.iter().map(|ears| ears.each_ref().map(of)).collect(),
            n_fft,
            length,
        }
    }

    /// What both ears of a head hear that is turned by `head` from the axes of the microphone.
    fn heard(&self, arrivals: &Arrivals, hrtf: &Hrtf, head: Quat) -> [Vec<f32>; 2] {
        let turning = turning(self.order, head);
        let mut ears = arrivals.heard(hrtf, head).map(|ear| spectrum(ear, self.n_fft));
        let mut turned = vec![Complex32::default(); self.n_fft / 2 + 1];
        for (row, filters) in turning.iter().zip(&self.filters) {
            turned.fill(Complex32::default());
            for (gain, channel) in row.iter().zip(&self.channels).filter(|(gain, _)| **gain != 0.0) {
                turned.iter_mut().zip(channel).for_each(|(t, c)| *t += c * gain);
            }
            for (ear, filter) in ears.iter_mut().zip(filters) {
                for ((e, t), f) in ear.iter_mut().zip(&turned).zip(filter) {
                    *e += t * f;
                }
            }
        }
        ears.map(|mut bins| {
            if let [first, .., last] = &mut bins[..] {
                (first.im, last.im) = (0.0, 0.0);
            }
            let mut time = signal(bins, self.n_fft);
            time.truncate(self.length);
            time
        })
    }
}

#[cfg(test)]
mod tests;
