//! Channels that a fit sees of what was recorded.

use super::set::{Clock, Measurement, Place};
use crate::error::FitError;

/// From the middle of a head to an ear, metres.
const EAR_M: f64 = 0.0875;
/// How far a head's diffraction moves what an ear hears from where it is, as a standard deviation, metres.
const HEAD_SD_M: f64 = 0.05;

/// What kind of microphone recorded channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// One channel of several, counted from 0.
    One(usize),
    /// Left and right ear.
    Ears,
    /// Channels of Ambisonics in the order ACN, of which the first is sound pressure.
    Ambix,
}

/// A response before it is said what the channels are; `left` points to the left of the head.
pub(super) struct Recorded {
    pub(super) name: String,
    pub(super) source: Place,
    pub(super) microphone: Place,
    pub(super) left: [f64; 3],
    pub(super) clock: Clock,
    pub(super) channels: Vec<Vec<f32>>,
}

/// The measurements that a recording makes.
///
/// # Errors
/// Fewer channels than the kind has.
pub(super) fn measurements(mut of: Recorded, kind: Kind) -> Result<Vec<Measurement>, FitError> {
    let needed = match kind {
        Kind::One(n) => n + 1,
        Kind::Ears => 2,
        Kind::Ambix => 1,
    };
    if of.channels.len() < needed {
        return Err(crate::error::measurement(&of.name, format!("at least {needed} channels"), of.channels.len()));
    }
    let one = |name: String, microphone: Place, samples: Vec<f32>| Measurement {
        name,
        source: of.source,
        microphone,
        clock: of.clock,
        samples,
    };
    Ok(match kind {
        Kind::One(n) => vec![one(of.name.clone(), of.microphone, of.channels.swap_remove(n))],
        Kind::Ambix => vec![one(of.name.clone(), of.microphone, of.channels.swap_remove(0))],
        Kind::Ears => {
            let ear = |side: f64| Place {
                at_m: std::array::from_fn(|a| of.microphone.at_m[a] + side * EAR_M * of.left[a]),
                sd_m: of.microphone.sd_m.hypot(HEAD_SD_M),
                facing: Some(of.left.map(|c| side * c)),
            };
            let mut channels = of.channels.into_iter();
            [("left", 1.0), ("right", -1.0)]
                .into_iter()
                .zip(channels.by_ref())
                .map(|((name, side), samples)| one(format!("{} {name}", of.name), ear(side), samples))
                .collect()
        }
    })
}

/// Of unit length; none of nothing.
pub(super) fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    (length > 1e-9 && length.is_finite()).then(|| v.map(|c| c / length))
}
