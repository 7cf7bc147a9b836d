//! Baselines, which a scene has to beat.

use super::hrtf::DistanceAndHrtf;
use super::nearest::{NearestRecording, NearestTransfer};
use super::{Method, energy, fitted_gain};
use crate::{BakeError, Capture, Clip, Responses, Split};
use promenade_player::Ears;

/// The baselines that a capture allows; a note for each that it does not.
pub(super) fn baselines(
    capture: &Capture,
    fit: &[&Clip],
    head: Option<&Responses>,
    notes: &mut Vec<String>,
) -> Result<Vec<Box<dyn Method>>, BakeError> {
    let gain = fitted_gain(&mut Dry::Gain(1.0), capture, fit)?;
    let mut all: Vec<Box<dyn Method>> = vec![Box::new(Dry::Gain(gain)), Box::new(Dry::MeanEnergy), Box::new(Dry::EarEnergy)];
    if capture.split(Split::Train).next().is_some() {
        all.push(Box::new(NearestRecording));
        all.push(Box::new(NearestTransfer));
    } else {
        notes.push("there are no training clips: levels are not fitted, and nearest recordings are left out".to_owned());
    }
    if capture.tracks.iter().flat_map(|track| &track.voices).all(|voice| voice.emitter.is_some()) {
        let mut free = DistanceAndHrtf::new(capture, head)?;
        free.gain = fitted_gain(&mut free, capture, fit)?;
        notes.push(match head {
            Some(set) => format!("distance-and-head: nearest of the {} responses of {}", set.responses.len(), set.title),
            None => "distance-and-head: a sphere of 87.5 mm radius for a head".to_owned(),
        });
        all.push(Box::new(free));
    } else {
        notes.push("distance-and-head is left out: the capture does not say where the emitter is".to_owned());
    }
    Ok(all)
}

/// The dry sound at both ears.
enum Dry {
    /// With one gain for all clips.
    Gain(f32),
    /// With the energy of the recording, mean of both ears.
    MeanEnergy,
    /// Each ear with the energy of the recording.
    EarEnergy,
}

impl Method for Dry {
    fn name(&self) -> &'static str {
        match self {
            Self::Gain(_) => "mono-mono",
            Self::MeanEnergy => "mono-energy",
            Self::EarEnergy => "stereo-energy",
        }
    }

    fn note(&self) -> &'static str {
        match self {
            Self::Gain(_) => "",
            Self::MeanEnergy => "knows the recording's energy",
            Self::EarEnergy => "knows the energy of each of the recording's ears",
        }
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        let (mut dry, recorded) = (capture.dry(clip, 0), capture.binaural(clip));
        Ok(match self {
            Self::Gain(gain) => {
                dry.iter_mut().for_each(|v| *v *= *gain);
                [dry.clone(), dry]
            }
            Self::MeanEnergy => {
                let dry = with_energy(dry, 0.5 * energy(recorded));
                [dry.clone(), dry]
            }
            Self::EarEnergy => recorded.map(|ear| with_energy(dry.clone(), energy([ear, &[]]))),
        })
    }
}

fn with_energy(mut x: Vec<f32>, wanted: f64) -> Vec<f32> {
    let given = energy([&x, &[]]);
    let gain = if given > 0.0 { (wanted / given).sqrt() as f32 } else { 0.0 };
    x.iter_mut().for_each(|v| *v *= gain);
    x
}
