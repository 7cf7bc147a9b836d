//! The animation of a camera or of a node in glTF 2.0, as a path.
//!
//! glTF's world is right-handed with y up, and its cameras look along -z. Here -z becomes x, -x becomes y and y becomes z, so
//! that a camera that nothing turns is a head that nothing turns.

mod accessor;
mod curve;
mod document;
mod node;
mod subject;

use crate::options::Beside;
use crate::waypoint::{Track, Waypoint};
use crate::{ImportOptions, PathFileError};
use document::Document;
use glam::{DMat3, DQuat, DVec3};
use node::Chain;
use promenade_core::MAX_KEYFRAMES;

/// Samples of an animation a second.
const SAMPLES_PER_SECOND: f64 = 60.0;

pub(crate) fn read(file: &str, bytes: &[u8], options: &ImportOptions, beside: &mut Beside<'_>) -> Result<Track, PathFileError> {
    let mut document = Document::new(file, bytes, beside)?;
    let mut notes = Vec::new();
    let subject = subject::find(&document, options.animation.as_deref(), &mut notes)?;
    let chain = Chain::new(&mut document, &subject)?;
    let rate = options.fps.unwrap_or(SAMPLES_PER_SECOND);
    let times = times(file, &chain, rate)?;
    let waypoint = |t_s: &f64| {
        let world = chain.world(*t_s);
        let [ahead, up] = [DVec3::NEG_Z, DVec3::Y].map(|axis| listener_axes(world.matrix3 * axis));
        let left = up.cross(ahead).try_normalize();
        let (Some(ahead), Some(left)) = (ahead.try_normalize(), left) else {
            let found = "one scaled to nothing or beyond numbers";
            return Err(PathFileError::entry(file, subject.name(&document), format!("a direction at {t_s} s"), found));
        };
        // Square again where a parent scales its axes unevenly.
        let orientation = DQuat::from_mat3(&DMat3::from_cols(ahead, left, ahead.cross(left))).normalize();
        Ok(Waypoint { t_s: *t_s, position: listener_axes(world.translation), orientation })
    };
    let waypoints: Vec<Waypoint> = times.iter().map(waypoint).collect::<Result<_, _>>()?;
    notes.push(format!(
        "the path follows {} in {} steps, at least {rate} a second, within 1 mm and 0.1 degrees",
        subject.name(&document),
        waypoints.len()
    ));
    Ok(Track { waypoints, place: Box::new(|index| format!("keyframe {index}")), notes })
}

/// From y up and -z ahead to z up and x ahead.
fn listener_axes(v: DVec3) -> DVec3 {
    DVec3::new(-v.z, -v.x, v.y)
}

/// Every key of the curves, and as many times between them as make the rate.
fn times(file: &str, chain: &Chain, rate: f64) -> Result<Vec<f64>, PathFileError> {
    let keys = chain.keys();
    let steps = |from: f64, to: f64| ((to - from) * rate).ceil().max(1.0);
    let total = 1.0 + keys.windows(2).map(|pair| steps(pair[0], pair[1])).sum::<f64>();
    if total > MAX_KEYFRAMES as f64 {
        let expected = format!("an animation of at most {MAX_KEYFRAMES} steps");
        return Err(PathFileError::content(
            file,
            expected,
            format!("{total}, at {rate} a second; the option fps changes that"),
        ));
    }
    let mut times = Vec::new();
    for pair in keys.windows(2) {
        let steps = steps(pair[0], pair[1]);
        let counted = (0_u32..).map(f64::from).take_while(|step| *step < steps);
        times.extend(counted.map(|step| pair[0] + (pair[1] - pair[0]) * step / steps));
    }
    times.extend(keys.last());
    Ok(times)
}
