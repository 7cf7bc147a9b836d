//! Octaves, as scenes have them, and the one below them.

pub use promenade_core::octave::{OCTAVES as BANDS, OCTAVES_HZ, Octaves, octave_energy, octave_place};

/// The octave below those of scenes, Hz.
pub(crate) const LOW_HZ: f64 = 63.0;

/// Energy at a frequency, Hz, of energies by octave with that of the octave at 63 Hz beside them: [`octave_energy`] over eight
/// octaves.
#[must_use]
pub fn octave_energy_from_63(low: f64, energies: &[f64; BANDS], hz: f64) -> f64 {
    if hz >= 2.0 * LOW_HZ {
        return octave_energy(energies, hz);
    }
    // An octave lower, so that 63 Hz is the first of seven.
    let lower: [f64; BANDS] = std::array::from_fn(|b| if b == 0 { low } else { energies[b - 1] });
    octave_energy(&lower, 2.0 * hz)
}

/// Places within half an octave, from its centre on, at which a mean over it is taken.
const WITHIN: [f64; 4] = [0.0625, 0.1875, 0.3125, 0.4375];
/// Steps in which [`centred`] comes near to the means, and what it may change about an energy.
const STEPS: usize = 6;
const CHANGES: (f64, f64) = (0.05, 4.0);

/// Energies at the centres of octaves, and at 63 Hz, between which [`octave_energy_from_63`] has stated means over the octaves.
///
/// A trace states what an octave has as a whole. The line between two centres has more than that as soon as the octave beside
/// it is louder: late in a room whose octaves ring for unlike times, by as much as 10 dB.
#[must_use]
pub fn centred(low: f64, energies: &[f64; BANDS]) -> (f64, [f64; BANDS]) {
    const COUNT: usize = BANDS + 1;
    let wanted: [f64; COUNT] = std::array::from_fn(|i| if i == 0 { low } else { energies[i - 1] });
    if wanted.iter().all(|energy| *energy == wanted[0]) {
        return (low, *energies);
    }
    let mut at = wanted;
    for _ in 0..STEPS {
        let halves: [[f64; 2]; COUNT] = std::array::from_fn(|i| {
            // Beyond the first and the last centre energies stay.
            let beside = [at[i.saturating_sub(1)], at[(i + 1).min(COUNT - 1)]];
            let of = |(beside, way): (f64, f64)| half(at[i], beside, way);
            [of((beside[0], -1.0)), of((beside[1], 1.0))]
        });
        for ((at, wanted), [below, above]) in at.iter_mut().zip(wanted).zip(halves) {
            let mean = below + above;
            if mean > 0.0 {
                *at = (*at * wanted / mean).clamp(CHANGES.0 * wanted, CHANGES.1 * wanted);
            }
        }
    }
    (at[0], std::array::from_fn(|b| at[b + 1]))
}

/// What half an octave adds to the mean over it, upwards or downwards from its centre.
fn half(at: f64, beside: f64, way: f64) -> f64 {
    let of = |part: f64| if at > 0.0 && beside > 0.0 { at * (beside / at).powf(part) } else { at + part * (beside - at) };
    // Hertz, not octaves, have equal shares of a flat sound.
    let widths = |way: f64| WITHIN.map(|part| (way * part).exp2());
    let all: f64 = widths(1.0).iter().chain(&widths(-1.0)).sum();
    WITHIN.iter().zip(widths(way)).map(|(part, width)| width / all * of(*part)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_keep_their_energy_where_the_next_is_louder() {
        for energies in [[1.0; BANDS], [1.0, 0.3, 0.02, 0.5, 0.6, 0.2, 0.1], [1e-3, 1e-2, 0.1, 1.0, 0.1, 1e-2, 1e-3]] {
            let (low, at) = centred(0.7, &energies);
            for (octave, wanted) in OCTAVES_HZ.iter().zip(energies) {
                let (from, count) = (f64::from(*octave) / std::f64::consts::SQRT_2, 200);
                let hz = |i: usize| from * (1.0 + (f64::from(i as u32) + 0.5) / f64::from(count as u32));
                let mean = (0..count).map(|i| octave_energy_from_63(low, &at, hz(i))).sum::<f64>() / f64::from(count as u32);
                let off = 10.0 * (mean / wanted).log10();
                assert!(off.abs() < 0.3, "{octave}: {off} dB of {energies:?}");
            }
        }
        assert_eq!(centred(0.0, &[0.0; BANDS]), (0.0, [0.0; BANDS]));
    }
}
