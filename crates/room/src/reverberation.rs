//! The reverberation of a box, and walls that absorb as much as a measured one asks for.
//!
//! T20 by octave is that of the energy in the whole room, as the mean of decay curves at many places (ISO 3382-2:2008, ensemble
//! averaging). The same particles fly for any absorption, so that T20 changes smoothly with it.

use crate::error::RoomError;
use promenade_acoustics::{Air, BANDS, Echogram, Material, OCTAVES_HZ, ParticleOptions, Shoebox, decay_time_s, octave_place};
#[cfg(feature = "meshes")]
use promenade_acoustics::{Mesh, RayOptions, Room, Source, late_field};
use std::f64::consts::LN_10;
use std::fmt::{self, Display, Formatter};

/// Reverberation times that a room can be given, seconds.
pub const T20_S: (f64, f64) = (0.05, 20.0);
/// Particles that fly for a second, and the least and greatest number of them: where walls differ much, the few that meet hard
/// ones only decide how the rest decays.
const PARTICLES_A_SECOND: f64 = 49_152.0;
const PARTICLES: (f64, f64) = (8192.0, 98_304.0);
/// Rays in the room of a mesh.
#[cfg(feature = "meshes")]
const RAYS: usize = 8192;
/// Bins of a trace at least and at most, and of the shortest T20.
const BINS: (f64, f64, f64) = (240.0, 4000.0, 60.0);
/// Steps at most.
const STEPS: usize = 10;
/// A T20 this near to the one that is asked for is it, as a share.
const NEAR: f64 = 0.002;
/// A T20 farther than this from the one that is asked for was not reached, as a share.
const MISSED: f64 = 0.03;
/// The least and the greatest factor.
const FACTORS: (f64, f64) = (1e-3, 200.0);
/// A factor changes by no more than this in one step.
const STEP: f64 = 4.0;
/// Walls to be changed absorb at least and at most this: what absorbs nothing, or all, would do so with any factor.
const SHARES: (f64, f64) = (0.002, 0.995);
/// Trace's length as a share of the longest T20: to -54 dB.
const LENGTH: f64 = 0.9;
/// Length of the bins that measured decays are cut by, seconds.
const MEASURED_BIN_S: f64 = 0.005;
/// Share of a measured response, at its end, that is taken for noise, and dB that the decay has to be above it.
const NOISE: (f64, f64) = (0.1, 30.0);

/// Numbers by octave from 125 Hz, each where there is one.
pub type Some7 = [Option<f64>; BANDS];

/// How much more or less the walls absorb than their materials.
#[derive(Clone, Debug, PartialEq)]
pub struct Matched {
    /// By octave; see [`factored`].
    pub factors: [f64; BANDS],
    /// T20 that the walls then have, seconds; `None` where nothing decays by 25 dB.
    pub t20_s: Some7,
    /// Octaves whose T20 was not reached.
    pub missed: Vec<Missed>,
}

/// A T20 that walls cannot have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missed {
    /// The octave, hertz.
    pub hz: f64,
    /// What was asked for, seconds.
    pub wanted_s: f64,
    /// What comes nearest, seconds.
    pub nearest_s: Option<f64>,
    /// What the air alone leaves, seconds.
    pub air_s: f64,
}

impl Display for Missed {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { hz, wanted_s, nearest_s, air_s } = self;
        write!(f, "{hz} Hz: {wanted_s:.2} s cannot be reached")?;
        match nearest_s {
            Some(nearest) if nearest < wanted_s && *air_s < 1.05 * wanted_s => {
                write!(f, "; with walls that absorb nothing air leaves {nearest:.2} s")
            }
            Some(nearest) if nearest < wanted_s => write!(f, "; the hardest walls leave {nearest:.2} s"),
            Some(nearest) => write!(f, "; walls that absorb all they can leave {nearest:.2} s"),
            None => write!(f, "; so little is reflected that nothing decays along a line"),
        }
    }
}

/// A material whose exponents of absorption, `-ln(1 - absorption)`, are multiplied by a factor for each octave: walls that
/// absorb twice or half as much as each other go on doing so, and none absorbs more than all. 1 leaves an octave as it is.
#[must_use]
pub fn factored(material: &Material, factors: &[f64; BANDS]) -> Material {
    let multiplied = |share: f32, factor: f64| {
        if factor == 1.0 {
            return share;
        }
        (1.0 - (1.0 - f64::from(share).clamp(SHARES.0, SHARES.1)).powf(factor)) as f32
    };
    let absorption = std::array::from_fn(|b| multiplied(material.absorption[b], factors[b]));
    let absorption_63 = material.absorption_63.map(|share| multiplied(share, factors[0]));
    let factor = |hz: f32| {
        let (below, fraction) = octave_place(f64::from(hz));
        let [a, b] = [factors[below], factors[below + 1]];
        a * (b / a).powf(fraction)
    };
    let fine = [material.fine[0].map(|hz, share| multiplied(share, factor(hz))), material.fine[1].clone()];
    Material { absorption, absorption_63, fine, ..material.clone() }
}

fn changed(walls: &Shoebox, factors: &[f64; BANDS]) -> Shoebox {
    Shoebox { size: walls.size, materials: walls.materials.each_ref().map(|m| factored(m, factors)) }
}

/// Reverberation times of a box with a source, its corner at the origin; an octave whose walls reflect too little for a decay
/// of 25 dB has none. The same input has the same result.
///
/// # Errors
/// A box, a material or a source that is none.
pub fn t20_s(walls: &Shoebox, air: Air, source: [f64; 3], seed: u64) -> Result<Some7, RoomError> {
    Ok(octaves(&decaying(walls, air, source, seed)?))
}

/// The energy in a box over time, as long as its octaves decay after Eyring.
pub(crate) fn decaying(walls: &Shoebox, air: Air, source: [f64; 3], seed: u64) -> Result<Echogram, RoomError> {
    let eyring = walls.eyring_t60_s(Some(air));
    let longest = eyring.into_iter().fold(T20_S.0, f64::max).min(T20_S.1);
    let shortest = eyring.into_iter().fold(longest, f64::min).max(T20_S.0);
    traced(walls, air, source, (shortest, 1.5 * longest), seed)
}

fn traced(
    walls: &Shoebox,
    air: Air,
    source: [f64; 3],
    (shortest_s, longest_s): (f64, f64),
    seed: u64,
) -> Result<Echogram, RoomError> {
    let reach_s = walls.size.iter().map(|l| l * l).sum::<f64>().sqrt() / air.speed_m_s();
    let length_s = LENGTH * longest_s + reach_s;
    let options = ParticleOptions {
        particles: (PARTICLES_A_SECOND / length_s).clamp(PARTICLES.0, PARTICLES.1) as usize,
        length_s,
        bin_s: (length_s / BINS.0).min(shortest_s / BINS.2).max(length_s / BINS.1),
        cells: [1; 3],
        air: Some(air),
        seed,
    };
    Ok(walls.late_field(source, &[], &options)?.swap_remove(0))
}

fn octaves(echogram: &Echogram) -> Some7 {
    std::array::from_fn(|band| echogram.t20_s(band))
}

/// Finds factors with which a box has the reverberation times that are asked for; octaves of which nothing is asked stay as
/// they are. Takes a fraction of a second, a second for times of many seconds.
///
/// # Errors
/// A box that [`t20_s`] refuses; a time outside [`T20_S`], none at all.
pub fn match_t20(walls: &Shoebox, air: Air, source: [f64; 3], wanted_s: &Some7, seed: u64) -> Result<Matched, RoomError> {
    let eyring = |factors: &_| Ok(changed(walls, factors).eyring_t60_s(None));
    matched(air, wanted_s, &eyring, &|factors, span_s| {
        Ok(octaves(&traced(&changed(walls, factors), air, source, span_s, seed)?))
    })
}

/// Finds factors with which the room of a mesh has the reverberation times that are asked for, as [`match_t20`] does for a box;
/// T20 is that of the energy at all of the listeners together. Says the room with these walls too. Takes seconds.
///
/// # Errors
/// Those of [`match_t20`]; no listener, or one that is not finite.
#[cfg(feature = "meshes")]
pub fn match_room_t20(
    (mesh, room): (&Mesh, &Room),
    air: Air,
    (source, listeners): (&Source, &[[f64; 3]]),
    wanted_s: &Some7,
    seed: u64,
) -> Result<(Matched, Room), RoomError> {
    let changed = |factors: &[f64; BANDS]| {
        let walls: Vec<Material> = room.materials().iter().map(|m| factored(m, factors)).collect();
        Room::new(mesh, &walls)
    };
    let closed_m3 = mesh.report().volume_m3;
    let t20 = |factors: &[f64; BANDS], (_, longest_s): (f64, f64)| {
        let length_s = LENGTH * longest_s.max(0.3);
        let options = RayOptions { rays: RAYS, length_s, bin_s: 0.01, images: None, radius_m: None, air: Some(air), seed };
        let late = late_field(&changed(factors)?, source.clone(), listeners, &options, |_| ())?;
        let energy = |band: usize| {
            let bins = late.echograms.first().map_or(0, |e| e.bins.len());
            let sum = |i: usize| late.echograms.iter().filter_map(|e| e.bins.get(i)).map(|b| f64::from(b.energy[band])).sum();
            (0..bins).map(sum).collect::<Vec<f64>>()
        };
        Ok(std::array::from_fn(|band| decay_time_s(&energy(band), options.bin_s, -25.0)))
    };
    let eyring = |factors: &_| Ok(changed(factors)?.eyring_t60_s(closed_m3, None));
    let matched = matched(air, wanted_s, &eyring, &t20)?;
    let room = changed(&matched.factors)?;
    Ok((matched, room))
}

/// Times that walls have with factors by octave.
type EyringOf<'a> = &'a dyn Fn(&[f64; BANDS]) -> Result<[f64; BANDS], RoomError>;
type T20Of<'a> = &'a dyn Fn(&[f64; BANDS], (f64, f64)) -> Result<Some7, RoomError>;

/// Factors by octave with which `t20` gives the times that are asked for; it is told the shortest and the longest of them, and
/// `eyring` gives the times without air.
fn matched(air: Air, wanted_s: &Some7, eyring: EyringOf<'_>, t20: T20Of<'_>) -> Result<Matched, RoomError> {
    let all: Vec<f64> = wanted_s.iter().flatten().copied().collect();
    if all.is_empty() || !all.iter().all(|t| (T20_S.0..=T20_S.1).contains(t)) {
        let expected = format!("{} to {} s, in one octave at least", T20_S.0, T20_S.1);
        return Err(RoomError::argument("reverberation time", expected, format!("{all:?}")));
    }
    let taken = air.decay_per_m().map(|decay| f64::from(decay) * air.speed_m_s());
    // What decays by a rate has a reverberation time of this over it.
    const FALL: f64 = 6.0 * LN_10;
    // Only octaves that are asked for say how long particles have to fly.
    // With air no time is longer than what it leaves.
    let can = |b: usize| wanted_s[b].map(|t| t.min(FALL / taken[b]));
    let longest = (0..BANDS).filter_map(can).fold(T20_S.0, f64::max);
    let shortest = (0..BANDS).filter_map(can).fold(longest, f64::min);
    let mut factors: [f64; BANDS] = std::array::from_fn(|b| if wanted_s[b].is_some() { 0.999 } else { 1.0 });
    let eyring = eyring(&factors)?;
    let moved = |factor: f64, by: f64| (factor * by.clamp(1.0 / STEP, STEP)).clamp(FACTORS.0, FACTORS.1);
    for b in 0..BANDS {
        if let Some(wanted) = wanted_s[b] {
            // Eyring's decay is proportional to the factor as long as it is the same everywhere.
            let walls = (FALL / wanted - taken[b]).max(0.0);
            factors[b] = (factors[b] * walls / (FALL / eyring[b])).clamp(FACTORS.0, FACTORS.1);
        }
    }
    let mut best: Option<([f64; BANDS], Some7, [f64; BANDS])> = None;
    for _ in 0..STEPS {
        let found = t20(&factors, (shortest, longest))?;
        let off = |b: usize| wanted_s[b].map_or(0.0, |w| found[b].map_or(f64::INFINITY, |t| (t / w).ln().abs()));
        let off: [f64; BANDS] = std::array::from_fn(off);
        match &mut best {
            None => best = Some((factors, found, off)),
            Some((kept, t20, least)) => {
                for b in 0..BANDS {
                    if wanted_s[b].is_none() || off[b] < least[b] {
                        (kept[b], t20[b], least[b]) = (factors[b], found[b], off[b]);
                    }
                }
            }
        }
        let mut still = false;
        for b in 0..BANDS {
            let Some(wanted) = wanted_s[b] else { continue };
            if off[b] <= NEAR {
                continue;
            }
            let next = match found[b] {
                // Of the rate air has its own part.
                Some(t) if FALL / t > taken[b] => {
                    moved(factors[b], ((FALL / wanted - taken[b]) / (FALL / t - taken[b])).max(0.0))
                }
                Some(_) => moved(factors[b], STEP.recip()),
                // It had not decayed when particles ended.
                None => moved(factors[b], 1.5),
            };
            still |= next != factors[b];
            factors[b] = next;
        }
        if !still {
            break;
        }
    }
    let Some((factors, t20_s, off)) = best else {
        return Err(RoomError::argument("steps", "one at least", "none"));
    };
    let missed = (0..BANDS).filter_map(|b| {
        let wanted_s = wanted_s[b].filter(|_| off[b] > MISSED)?;
        Some(Missed { hz: f64::from(OCTAVES_HZ[b]), wanted_s, nearest_s: t20_s[b], air_s: FALL / taken[b] })
    });
    let missed = missed.collect();
    Ok(Matched { factors, t20_s, missed })
}

/// T20 by octave of a measured response, the mean of its channels, seconds. The decay is cut where it meets the noise at the
/// response's end; an octave that does not rise 30 dB above that, or does not decay by 25 dB, has none.
#[must_use]
pub fn measured_t20_s(channels: &[Vec<f32>], sample_rate_hz: f64) -> Some7 {
    let of = |band: usize| {
        let hz = f64::from(OCTAVES_HZ[band]);
        if 1.2 * hz > 0.5 * sample_rate_hz {
            return None;
        }
        let all: Vec<f64> = channels.iter().filter_map(|x| octave_t20_s(x, sample_rate_hz, hz)).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    std::array::from_fn(of)
}

fn octave_t20_s(x: &[f32], sample_rate_hz: f64, hz: f64) -> Option<f64> {
    let octave = promenade_metrics::octave_of(x, sample_rate_hz, hz);
    let start = promenade_metrics::onset(&octave)?;
    let samples = ((MEASURED_BIN_S * sample_rate_hz).round() as usize).max(1);
    let energies: Vec<f64> = octave[start..].chunks(samples).map(|c| c.iter().map(|v| f64::from(*v).powi(2)).sum()).collect();
    let noise = &energies[energies.len() - ((energies.len() as f64 * NOISE.0) as usize).clamp(1, energies.len())..];
    let noise = noise.iter().sum::<f64>() / noise.len() as f64;
    let most = energies.iter().copied().fold(0.0, f64::max);
    if most < noise * 10f64.powf(0.1 * NOISE.1) {
        return None;
    }
    // Twice the noise's energy, over four bins, is where the decay itself has as much as the noise.
    let end = energies.windows(4).position(|w| w.iter().sum::<f64>() < 8.0 * noise).unwrap_or(energies.len());
    let decay: Vec<f64> = energies[..end].iter().map(|e| (e - noise).max(0.0)).collect();
    decay_time_s(&decay, samples as f64 / sample_rate_hz, -25.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_acoustics::Materials;
    use promenade_core::random::Random;

    const SOURCE: [f64; 3] = [1.3, 2.1, 1.4];

    fn living_room() -> Shoebox {
        let table = Materials::default();
        let names = ["plasterboard", "plasterboard", "curtains_cotton_0.5", "plasterboard", "carpet_thin", "plasterboard"];
        Shoebox { size: [6.0, 4.0, 3.0], materials: names.map(|name| table.material(name).unwrap()) }
    }

    #[test]
    fn walls_follow_the_times_that_are_typed_and_keep_their_differences() {
        let wanted = [0.5, 0.5, 0.4, 0.4, 0.35, 0.3, 0.3].map(Some);
        let room = living_room();
        let before = t20_s(&room, Air::default(), SOURCE, 1).unwrap();
        assert!((before[2].unwrap() / 0.4 - 1.0).abs() > 0.2, "{before:?}");
        let matched = match_t20(&room, Air::default(), SOURCE, &wanted, 1).unwrap();
        assert_eq!(matched.missed, []);
        assert!(matched.t20_s.iter().zip(wanted).all(|(t, w)| (t.unwrap() / w.unwrap() - 1.0).abs() < 0.005), "{matched:?}");
        // Particles of other seeds and from other places, whose T20 scatters by 1.5 % where walls differ as much as these.
        let after = changed(&room, &matched.factors);
        let others = [(SOURCE, 7), ([4.5, 1.0, 1.8], 8), ([3.0, 2.0, 1.5], 9)]
            .map(|(at, seed)| t20_s(&after, Air::default(), at, seed).unwrap());
        for (band, wanted) in wanted.iter().enumerate() {
            let mean = others.iter().map(|t| t[band].unwrap()).sum::<f64>() / 3.0;
            assert!((mean / wanted.unwrap() - 1.0).abs() < 0.03, "octave {band}: {mean} {wanted:?}");
        }
        let exponent = |walls: &Shoebox, wall: usize| -(1.0 - f64::from(walls.materials[wall].absorption[3])).ln();
        let ratio = |walls: &Shoebox| exponent(walls, 2) / exponent(walls, 0);
        assert!((ratio(&after) / ratio(&room) - 1.0).abs() < 1e-4);
        assert_eq!(after.materials[2].scattering, room.materials[2].scattering);
    }

    #[cfg(feature = "meshes")]
    #[test]
    fn a_mesh_follows_the_times_that_are_asked_for() {
        let (size, wall) = ([6.0, 4.0, 3.0], Materials::default().material("0.2:0.1").unwrap());
        let mesh = Shoebox { size, materials: std::array::from_fn(|_| wall.clone()) }.mesh().unwrap();
        let room = Room::new(&mesh, &vec![wall; mesh.groups.len()]).unwrap();
        let (wanted, source) = ([1.2, 1.1, 1.0, 0.9, 0.8, 0.7, 0.6].map(Some), Source::from(SOURCE));
        let at = [[4.5, 1.0, 1.8], [3.0, 3.0, 1.5]];
        let (found, made) = match_room_t20((&mesh, &room), Air::default(), (&source, &at), &wanted, 1).unwrap();
        assert!(found.t20_s.iter().zip(wanted).all(|(t, w)| (t.unwrap() / w.unwrap() - 1.0).abs() < 0.02), "{found:?}");
        assert!(made.materials()[0].absorption[3] < 0.15 && made.materials()[0].absorption[3] > 0.05);
    }

    #[test]
    fn what_is_not_asked_stays_and_what_cannot_be_is_said() {
        let room = living_room();
        let mut wanted = [None; BANDS];
        (wanted[1], wanted[4], wanted[6]) = (Some(0.6), Some(0.35), Some(9.0));
        let matched = match_t20(&room, Air::default(), SOURCE, &wanted, 1).unwrap();
        assert_eq!((matched.factors[0], matched.factors[3]), (1.0, 1.0));
        assert!((matched.t20_s[1].unwrap() / 0.6 - 1.0).abs() < 0.01 && (matched.t20_s[4].unwrap() / 0.35 - 1.0).abs() < 0.01);
        let words: Vec<String> = matched.missed.iter().map(ToString::to_string).collect();
        assert!(
            words.len() == 1 && words[0].starts_with("8000 Hz: 9.00 s cannot be reached; with walls that absorb"),
            "{words:?}"
        );
        wanted = [Some(0.05); BANDS];
        wanted[2] = None;
        for (text, hz) in
            match_t20(&room, Air::default(), SOURCE, &wanted, 1).unwrap().missed.iter().map(|m| (m.to_string(), m.hz))
        {
            assert!(text.contains("0.05 s cannot be reached") && hz != 500.0, "{text}");
        }
        for wrong in [[None; BANDS], [Some(0.01); BANDS], [Some(f64::NAN); BANDS]] {
            assert!(match_t20(&room, Air::default(), SOURCE, &wrong, 1).unwrap_err().to_string().contains("0.05 to 20 s"));
        }
    }

    #[test]
    fn a_measured_decay_is_cut_where_noise_begins() {
        let mut random = Random::new(3);
        let rate = 16_000.0;
        let decaying = |noise: f64, random: &mut Random| -> Vec<f32> {
            let fall = 3.0 * LN_10 / (0.6 * rate);
            (0..24_000)
                .map(|i| {
                    let decay = (-fall * f64::from(i)).exp() * f64::from(random.normal());
                    (decay + noise * f64::from(random.normal())) as f32
                })
                .collect()
        };
        for noise in [0.0, 0.003] {
            let t20 = measured_t20_s(&[decaying(noise, &mut random), decaying(noise, &mut random)], rate);
            for t in &t20[2..6] {
                assert!((t.unwrap() / 0.6 - 1.0).abs() < 0.1, "{noise}: {t20:?}");
            }
            assert_eq!(t20[6], None, "8 kHz has no octave at 16 kHz");
        }
        assert_eq!(measured_t20_s(&[decaying(0.2, &mut random)], rate), [None; BANDS], "it does not leave the noise");
        assert_eq!(measured_t20_s(&[decaying(0.0, &mut random)[..400].to_vec()], rate)[0], None, "it ends before it decays");
    }
}
