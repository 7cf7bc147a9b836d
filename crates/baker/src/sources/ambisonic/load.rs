//! Ambisonic responses from files.

use super::{AmbisonicResponse, AmbisonicResponses, Normalisation};
use crate::sources::file::ending;
use crate::sources::responses::{About, Recorded, ambisonic};
use crate::{BakeError, LoadOptions, sound};
use promenade_core::Pose;
use std::path::Path;

impl AmbisonicResponses {
    /// Loads a SOFA file, a manifest or a folder with one, as `Responses::load`, whose files have the channels of an Ambisonic
    /// microphone, or a single sound file. Where nothing says how far the source is, it is `distance_m`. Without a
    /// normalisation it is SN3D, and of a file `.amb` that of Furse and Malham.
    ///
    /// # Errors
    /// Files that are missing or damaged or disagree in their sample rate; capsules of a microphone instead of Ambisonic
    /// channels; samples that are not finite. The message names the file.
    pub fn load(
        path: &Path,
        options: &LoadOptions,
        normalisation: Option<Normalisation>,
        distance_m: Option<f32>,
    ) -> Result<Self, BakeError> {
        let ending = ending(path);
        let is_amb = ending == "amb";
        let of_file = if is_amb { Normalisation::Fuma } else { Normalisation::Sn3d };
        let is_sound = is_amb || sound::ENDINGS.contains(&ending.as_str());
        let (about, recorded) = if is_sound { one(path)? } else { ambisonic(path, options)? };
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
            normalisation: normalisation.unwrap_or(of_file),
            responses: responses.collect::<Result<_, _>>()?,
            notes: Vec::new(),
            path: path.to_path_buf(),
        })
    }
}

/// A sound file by itself: a microphone at the origin, a source whose direction its direct sound tells.
fn one(path: &Path) -> Result<(About, Vec<Recorded>), BakeError> {
    let wav = sound::read(path)?;
    let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let recorded =
        Recorded { listener: Pose::IDENTITY, source: None, distance_m: None, channels: wav.channels, name: name.clone() };
    let about =
        About { title: name, credit: String::new(), licence: String::new(), sample_rate_hz: f64::from(wav.sample_rate_hz) };
    Ok((about, vec![recorded]))
}
