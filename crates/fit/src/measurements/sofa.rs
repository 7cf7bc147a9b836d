//! Sets of responses as SOFA.

use super::recorded::{NO_HEAD, Recorded, unit};
use super::set::{Clock, LoadOptions, Measurements, Place};
use crate::error::FitError;
use promenade_acoustics::Air;
use promenade_sofa::{Sofa, SofaOptions};
use std::path::Path;

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Measurements, FitError> {
    let sofa = Sofa::open(path)?;
    let choice = SofaOptions { source: options.source_number, ..SofaOptions::default() };
    let mut recorded = Vec::new();
    // A microphone's capsules in one place first, one of them or Ambisonic channels; what has two places is a head.
    let (about, ears) = match sofa.of_harmonics(choice, |one| recorded.push(one)) {
        Ok(about) => (about, false),
        Err(no_harmonics) => {
            recorded.clear();
            match sofa.of_ears(choice, |one| recorded.push(one)) {
                Ok((about, _)) => (about, true),
                Err(_) => return Err(no_harmonics),
            }
        }
    };
    let channels = recorded.first().map_or(0, |one| one.channels.len());
    let number = match (ears, options.channel, channels) {
        (true, None, _) => return Err(FitError::content(path, NO_HEAD, "two ears")),
        (false, None, 4 | 9 | 16 | 25 | 36 | 49) => 0,
        (false, None, 1) => 0,
        (_, Some(n), count) if (1..=count).contains(&n) => n - 1,
        (_, channel, count) => {
            let found = channel.map_or("none chosen".to_owned(), |n| n.to_string());
            return Err(FitError::content(path, format!("the number of one of {count} receivers"), found));
        }
    };
    let mut all = Vec::new();
    for one in recorded {
        let turned = |v: [f32; 3]| one.listener.orientation.mul_vec3(v.into()).to_array().map(f64::from);
        let at = one.source.map(|s| s.to_array().map(f64::from)).or(options.source_m);
        let Some(at_m) = at else {
            return Err(FitError::content(path, "places of the source, or one that is given", format!("none of {}", one.name)));
        };
        let microphone = Place {
            at_m: one.listener.position.to_array().map(f64::from),
            sd_m: options.sd_m,
            facing: unit(turned([1.0, 0.0, 0.0])),
        };
        let recorded = Recorded {
            name: format!("{:05} {}", all.len(), one.name),
            source: Place { at_m, sd_m: options.sd_m, facing: None },
            microphone,
            clock: Clock::Known,
            channels: one.channels,
        };
        all.push(recorded.channel(number)?);
    }
    let rate = about.sample_rate_hz.round();
    if (rate - about.sample_rate_hz).abs() > 1e-3 {
        return Err(FitError::content(path, "a whole number of samples per second", about.sample_rate_hz));
    }
    Ok(Measurements { title: about.title, sample_rate_hz: rate as u32, all, notes: Vec::new(), air: Air::default() })
}
