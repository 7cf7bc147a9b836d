//! Admittances of walls that absorb.

/// Cosines of angles that a random incidence is a mean over.
const ANGLES: usize = 48;
/// The admittance that takes most of what comes from everywhere.
const GREATEST: f64 = 0.6;

/// Share of the energy of sound from everywhere that a locally reacting wall takes, whose admittance over that of air is this
/// complex number (H. Kuttruff, *Room Acoustics*, section 2.5).
pub(crate) fn absorbed(real: f64, imaginary: f64) -> f64 {
    let of = |i: usize| {
        let cosine = (i as f64 + 0.5) / ANGLES as f64;
        let sum = (cosine + real).powi(2) + imaginary * imaginary;
        let difference = (cosine - real).powi(2) + imaginary * imaginary;
        2.0 * cosine * (1.0 - difference / sum)
    };
    (0..ANGLES).map(of).sum::<f64>() / ANGLES as f64
}

/// The real admittance of a wall, over that of air, that takes a share of the energy of sound from everywhere; of shares that
/// none takes the admittance that takes most.
#[must_use]
pub fn admittance(absorption: f64) -> f64 {
    let (mut low, mut high) = (0.0, GREATEST);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if absorbed(middle, 0.0) < absorption { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// [`admittance`] where it is asked for again and again: by the closed form of the mean over angles, to some thousandths.
pub(crate) fn quick_admittance(absorption: f64) -> f64 {
    let (mut low, mut high) = (0.0, GREATEST);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if absorbed_from_everywhere(middle) < absorption { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Closed form of [`absorbed`] for a real admittance above 0 (Kuttruff, the same section).
fn absorbed_from_everywhere(admittance: f64) -> f64 {
    let b = admittance;
    8.0 * b * (1.0 + b / (1.0 + b) - 2.0 * b * ((1.0 + b) / b).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn admittances_take_what_they_are_asked_to() {
        for absorption in [0.01, 0.05, 0.15, 0.4, 0.8] {
            let found = absorbed_from_everywhere(admittance(absorption));
            assert!((found / absorption - 1.0).abs() < 2e-3, "{absorption}");
            assert!((quick_admittance(absorption) / admittance(absorption) - 1.0).abs() < 4e-3, "{absorption}");
        }
        assert!(quick_admittance(0.0) < 1e-8);
        assert!(admittance(1.0) <= GREATEST);
    }
}
