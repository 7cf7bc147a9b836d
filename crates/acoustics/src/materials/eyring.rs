//! Eyring's reverberation time.

use crate::materials::air::{Air, speed_m_s};
use crate::materials::material::Material;
use crate::octave::BANDS;

/// Reverberation time by octave, seconds, of surfaces of some square metres about a volume (Eyring 1930), with what the air
/// takes; infinite where nothing absorbs and 0 where everything does.
pub(crate) fn t60_s<'a>(
    surfaces: impl Iterator<Item = (f64, &'a Material)> + Clone,
    volume_m3: f64,
    air: Option<Air>,
) -> [f64; BANDS] {
    let whole: f64 = surfaces.clone().map(|(area, _)| area).sum();
    let speed = speed_m_s(air);
    let air = air.map_or([0.0; BANDS], |air| air.decay_per_m());
    std::array::from_fn(|band| {
        let taken = surfaces.clone().map(|(area, m)| area * f64::from(m.absorption[band])).sum::<f64>();
        let walls = -whole / (4.0 * volume_m3) * (1.0 - taken / whole).max(0.0).ln();
        6.0 * std::f64::consts::LN_10 / (speed * (walls + f64::from(air[band])))
    })
}
