//! What publications call loudness, C50, EDT and T60. The same words mean different numbers, so each table names its
//! convention.

use promenade_metrics::{backward_integral, slope};

/// Whose definitions are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Convention {
    /// AV-DAR (Jin et al. 2025) on Hearing Anything Anywhere: two points of the decay, three times the time from -5 to -25 dB;
    /// EDT from where the decay crosses -10 dB; C50 from the first sample of the file; loudness in dB.
    #[default]
    AvDar,
    /// AVR (Lan et al. 2024) on Real Acoustic Fields: a regression between -5 and -25 dB over energies with 1e-9 added to every
    /// sample; EDT from the sample nearest to -10 dB; C50 from the first sample of the file.
    Avr,
}

/// Added to energies, as published.
const FLOOR: f64 = 1e-9;

impl Convention {
    /// How it is called in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AvDar => "AV-DAR/HAA",
            Self::Avr => "AVR/RAF",
        }
    }

    /// Loudness in dB, C50 in dB, EDT and T60 in seconds.
    pub(super) fn measure(self, response: &[f32], sample_rate_hz: f64) -> [f64; 4] {
        let added = if self == Self::Avr { FLOOR } else { 0.0 };
        let left = backward_integral(response.iter().map(|v| f64::from(*v).powi(2) + added));
        let sum = left.first().copied().unwrap_or(0.0);
        let energy: f64 = response.iter().map(|v| f64::from(*v).powi(2)).sum();
        let early_end = (0.05 * sample_rate_hz) as usize;
        let early: f64 = response.iter().take(early_end).map(|v| f64::from(*v).powi(2)).sum();
        let loudness = 10.0 * (energy / sample_rate_hz + FLOOR).log10();
        let c50 = 10.0 * ((early + FLOOR) / (energy - early + FLOOR)).log10();
        if sum <= 0.0 {
            return [loudness, c50, f64::NAN, f64::NAN];
        }
        let db: Vec<f64> = left.iter().map(|e| 10.0 * (e / sum).max(1e-30).log10()).collect();
        let crossing = |level: f64| db.iter().position(|d| *d <= level).map(|i| i as f64 / sample_rate_hz);
        let [edt, t60] = match self {
            Self::AvDar => [
                crossing(-10.0).map(|t| 6.0 * t),
                crossing(-5.0).zip(crossing(-25.0)).map(|(upper, lower)| 3.0 * (lower - upper)),
            ],
            Self::Avr => {
                let nearest = (0..db.len()).min_by(|a, b| (db[*a] + 10.0).abs().total_cmp(&(db[*b] + 10.0).abs()));
                let inside = db.iter().enumerate().filter(|(_, d)| (-25.0..=-5.0).contains(*d));
                let points: Vec<(f64, f64)> = inside.map(|(i, d)| (i as f64 / sample_rate_hz, *d)).collect();
                let decay = slope(&points).filter(|s| *s < 0.0 && db.last().is_some_and(|d| *d <= -25.0));
                [nearest.map(|i| 6.0 * i as f64 / sample_rate_hz), decay.map(|s| -60.0 / s)]
            }
        };
        [loudness, c50, edt.unwrap_or(f64::NAN), t60.unwrap_or(f64::NAN)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_has_the_figures_of_its_closed_forms_in_both() {
        let (rate, t60) = (16_000.0, 0.6);
        let decay = 3.0 * std::f64::consts::LN_10 / (t60 * rate);
        let h: Vec<f32> = (0..24_000).map(|i| (-decay * f64::from(i)).exp() as f32).collect();
        let power_left = (-0.05 * 6.0 * std::f64::consts::LN_10 / t60).exp();
        let c50 = 10.0 * ((1.0 - power_left) / power_left).log10();
        for convention in [Convention::AvDar, Convention::Avr] {
            let [_, found_c50, edt, found_t60] = convention.measure(&h, rate);
            assert!((found_t60 - t60).abs() < 2e-3 && (edt - t60).abs() < 2e-3, "{convention:?}: {edt} {found_t60}");
            assert!((found_c50 - c50).abs() < 0.02, "{convention:?}: {found_c50} for {c50}");
        }
        let [loudness, ..] = Convention::AvDar.measure(&[1.0], 1.0);
        assert!(loudness.abs() < 1e-6);
        assert!(Convention::AvDar.measure(&[0.0; 100], rate)[3].is_nan(), "silence has no decay");
    }

    #[test]
    fn the_conventions_differ_where_they_say() {
        // Two slopes: a chord between -5 and -25 dB is not the line of least squares.
        let rate = 8000.0;
        let h: Vec<f32> = (0..16_000)
            .map(|i| {
                let t = f64::from(i) / rate;
                ((-t * 40.0).exp() + 0.05 * (-t * 5.0).exp()) as f32
            })
            .collect();
        let [_, _, _, chord] = Convention::AvDar.measure(&h, rate);
        let [_, _, _, line] = Convention::Avr.measure(&h, rate);
        assert!((chord / line - 1.0).abs() > 0.02, "{chord} {line}");
    }
}
