//! A manifest for a folder of sound files, written from their names.

use super::names::pattern_of;
use super::pattern::Field;
use super::{LoadOptions, Responses, Side, check};
use crate::sources::file;
use crate::{BakeError, atomic};
use promenade_core::glam::Vec3;
use serde::Serialize;
use std::path::Path;

/// What names do not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Describe {
    /// Name of the set; without it the folder's.
    pub title: Option<String>,
    /// Metres to the sources where the names have azimuths and no distances.
    pub distance_m: Option<f32>,
    /// The source, world metres, where the names have no azimuths.
    pub source: Option<Vec3>,
}

#[derive(Serialize)]
struct Manifest<'a> {
    title: &'a str,
    pattern: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    distance_m: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    length_unit_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    azimuth_positive: Option<&'a str>,
}

/// Writes the `responses.json` of a folder of binaural sound files by their names, and loads what it describes. The notes of
/// what is returned say what was assumed.
///
/// Azimuths grow to the left unless the ears of the responses contradict that.
///
/// # Errors
/// A folder that has a manifest; names of several forms, or with numbers that no word explains; azimuths without distances or
/// names without azimuths where the options do not help; what [`Responses::load`] refuses: then nothing stays written.
pub fn describe(folder: &Path, options: &Describe) -> Result<Responses, BakeError> {
    let path = folder.join("responses.json");
    if path.exists() {
        return Err(BakeError::content(folder, "no responses.json, which is written here", "one"));
    }
    let sounds = file::sounds(folder)?.into_iter();
    let names: Vec<String> = sounds.filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned())).collect();
    let named = pattern_of(&names).map_err(|found| {
        let expected =
            "sound files of one form of name with its numbers after words, such as azi_30_dist_2.wav or x1_y2_yaw90.wav";
        BakeError::content(folder, expected, found)
    })?;
    let has = |field| named.fields.contains(&field);
    let distance_m = options.distance_m.filter(|_| has(Field::Azimuth) && !has(Field::Distance));
    if has(Field::Azimuth) && !has(Field::Distance) && distance_m.is_none() {
        return Err(BakeError::content(
            folder,
            "distances in the names, or one that is given in metres",
            format!("only {}", named.pattern),
        ));
    }
    if !has(Field::Azimuth) && options.source.is_none() {
        let expected = "azimuths in the names, or the place of the source that is given in metres";
        return Err(BakeError::content(folder, expected, format!("only {}", named.pattern)));
    }
    let title = folder.canonicalize().ok().and_then(|f| Some(f.file_name()?.to_string_lossy().into_owned()));
    let title = options.title.clone().or(title).unwrap_or_default();
    let mut manifest = Manifest {
        title: &title,
        pattern: &named.pattern,
        distance_m,
        source: options.source.filter(|_| !has(Field::Azimuth)).map(|s| s.to_array()),
        length_unit_m: (named.length_unit_m != 1.0).then_some(named.length_unit_m),
        azimuth_positive: None,
    };
    let mut notes = named.notes.clone();
    write(&path, &manifest)?;
    let loaded = (|| {
        // Told to which side azimuths grow, a set is loaded whatever the ears say.
        let certain = LoadOptions { azimuth_positive: has(Field::Azimuth).then_some(Side::Left), ..LoadOptions::default() };
        let set = Responses::load(&path, &certain)?;
        if !(has(Field::Azimuth) && check::ears_contradict(&set)) {
            return Ok(set);
        }
        notes.push("the ears say that azimuths grow to the right".to_owned());
        manifest.azimuth_positive = Some("right");
        write(&path, &manifest)?;
        Responses::load(&path, &LoadOptions::default())
    })();
    if loaded.is_err() {
        // What cannot be read is no manifest.
        let _ = std::fs::remove_file(&path);
    }
    let mut set = loaded?;
    notes.append(&mut set.notes);
    Ok(Responses { notes, ..set })
}

fn write(path: &Path, manifest: &Manifest<'_>) -> Result<(), BakeError> {
    let json = serde_json::to_string_pretty(manifest).map_err(BakeError::json(path))?;
    atomic::write(path, (json + "\n").as_bytes())
}
