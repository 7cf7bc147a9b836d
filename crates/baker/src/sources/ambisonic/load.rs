//! Ambisonic responses from files.

use super::{AmbisonicResponse, AmbisonicResponses, Normalisation};
use crate::sources::file::ending;
use crate::sources::responses::{About, Recorded, ambisonic};
use crate::{BakeError, LoadOptions, wav};
use promenade_core::Pose;
use std::path::Path;

impl AmbisonicResponses {
    /// Loads a SOFA file, a manifest or a folder with one, as `Responses::load`, whose files have the channels of an Ambisonic
    /// microphone, or a single WAV file. Where nothing says how far the source is, it is `distance_m`.
    ///
    /// # Errors
    /// Files that are missing or damaged or disagree in their sample rate; capsules of a microphone instead of Ambisonic
    /// channels; samples that are not finite. The message names the file.
    pub fn load(
        path: &Path,
        options: &LoadOptions,
        normalisation: Normalisation,
        distance_m: Option<f32>,
    ) -> Result<Self, BakeError> {
        let (about, recorded) = if ending(path) == "wav" { one(path)? } else { ambisonic(path, options)? };
        let responses = recorded.into_iter().map(|Recorded { listener, source, distance_m: stated, channels, name }| {
            let finite = |c: &Vec<f32>| c.iter().all(|v| v.is_finite());
            if !channels.iter().all(finite) {
                return Err(BakeError::entry(path, name, "finite samples", "others"));
            }
            Ok(AmbisonicResponse { listener, source, distance_m: stated.or(distance_m), channels, name })
        });
        Ok(Self {
            title: about.title,
            credit: about.credit,
            licence: about.licence,
            sample_rate_hz: about.sample_rate_hz,
            normalisation,
            responses: responses.collect::<Result<_, _>>()?,
            notes: Vec::new(),
            path: path.to_path_buf(),
        })
    }
}

/// A WAV file by itself: a microphone at the origin, a source whose direction its direct sound tells.
fn one(path: &Path) -> Result<(About, Vec<Recorded>), BakeError> {
    let wav = wav::read(path)?;
    let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let recorded =
        Recorded { listener: Pose::IDENTITY, source: None, distance_m: None, channels: wav.channels, name: name.clone() };
    let about =
        About { title: name, credit: String::new(), licence: String::new(), sample_rate_hz: f64::from(wav.sample_rate_hz) };
    Ok((about, vec![recorded]))
}
