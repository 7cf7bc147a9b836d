//! What a scene must be better than to be worth anything.

use super::hrtf::DistanceAndHrtf;
use super::nearest::{NearestRecording, NearestTransfer};
use super::{Method, energy, fitted_gain};
use crate::player::Ears;
use crate::{BakeError, Capture, Clip, Responses, Split};

/// The baselines that a capture allows; a note for each that it does not.
pub(super) fn baselines(
    capture: &Capture,
    fit: &[&Clip],
    head: Option<&Responses>,
    notes: &mut Vec<String>,
) -> Result<Vec<Box<dyn Method>>, BakeError> {
    let mut mono = Mono { gain: 1.0 };
    mono.gain = fitted_gain(&mut mono, capture, fit)?;
    let mut all: Vec<Box<dyn Method>> = vec![Box::new(mono), Box::new(MonoEnergy), Box::new(StereoEnergy)];
    if capture.split(Split::Train).next().is_some() {
        all.push(Box::new(NearestRecording));
        all.push(Box::new(NearestTransfer));
    } else {
        notes.push("there are no training clips: levels are not fitted, and nearest recordings are left out".to_owned());
    }
    if let Some(emitter) = capture.emitter {
        let mut free = DistanceAndHrtf::new(capture, emitter, head)?;
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

/// The dry sound at both ears, with one gain for all clips.
struct Mono {
    gain: f32,
}

impl Method for Mono {
    fn name(&self) -> &'static str {
        "mono-mono"
    }

    fn note(&self) -> &'static str {
        ""
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        let dry: Vec<f32> = capture.dry(clip, 0).iter().map(|v| self.gain * v).collect();
        Ok([dry.clone(), dry])
    }
}

/// The dry sound at both ears, with the energy of the recording, mean of both ears.
struct MonoEnergy;

impl Method for MonoEnergy {
    fn name(&self) -> &'static str {
        "mono-energy"
    }

    fn note(&self) -> &'static str {
        "knows the recording's energy"
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        let dry = with_energy(capture.dry(clip, 0), 0.5 * energy(capture.binaural(clip)));
        Ok([dry.clone(), dry])
    }
}

/// The dry sound at both ears, each with the energy of the recording.
struct StereoEnergy;

impl Method for StereoEnergy {
    fn name(&self) -> &'static str {
        "stereo-energy"
    }

    fn note(&self) -> &'static str {
        "knows the energy of each of the recording's ears"
    }

    fn predict(&mut self, capture: &Capture, clip: &Clip) -> Result<Ears, BakeError> {
        Ok(capture.binaural(clip).map(|ear| with_energy(capture.dry(clip, 0), energy([ear, &[]]))))
    }
}

fn with_energy(mut x: Vec<f32>, wanted: f64) -> Vec<f32> {
    let given = energy([&x, &[]]);
    let gain = if given > 0.0 { (wanted / given).sqrt() as f32 } else { 0.0 };
    x.iter_mut().for_each(|v| *v *= gain);
    x
}
