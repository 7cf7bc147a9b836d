//! What every set of responses must satisfy, wherever it came from.

use super::{Response, Responses};
use crate::BakeError;
use promenade_metrics::{ild_db, itd_s};
use promenade_sofa::{Sided, check_size};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::{Path, PathBuf};

/// Poses closer than this, in metres and in quaternion components, are the same.
const GRAIN: f32 = 1e-4;

/// The farthest source that is believed, metres.
const MAX_DISTANCE_M: f32 = 100.0;

/// Refuses a set that memory should not hold, before it is allocated.
pub(super) fn size(path: &Path, responses: usize, frames: usize) -> Result<(), BakeError> {
    check_size(path, responses, frames)
}

/// Refuses a file whose rate is another than that of the first, which is kept with its rate.
pub(super) fn rate(file: &Path, hz: u32, first: &mut Option<(PathBuf, u32)>) -> Result<(), BakeError> {
    let (first_file, first_hz) = first.get_or_insert_with(|| (file.to_path_buf(), hz));
    if *first_hz == hz {
        return Ok(());
    }
    Err(BakeError::content(file, format!("{first_hz} Hz as in {}", first_file.display()), format!("{hz} Hz")))
}

/// Checks the samples and poses, pads all responses with zeros to one length and leaves out repeated measurements.
///
/// Ears that contradict the directions are an error, but only a note where the user has said how azimuths run.
pub(super) fn finish(path: &Path, set: &mut Responses, azimuths_are_certain: bool) -> Result<(), BakeError> {
    let longest = set.responses.iter().map(|r| r.left.len().max(r.right.len())).max().unwrap_or(0);
    size(path, set.responses.len(), longest)?;
    for response in &mut set.responses {
        whole(path, response)?;
        response.left.resize(longest, 0.0);
        response.right.resize(longest, 0.0);
    }
    let mut seen: HashMap<[i64; 10], String> = HashMap::new();
    let mut repeated = Vec::new();
    set.responses.retain(|response| match seen.entry(key(response)) {
        Entry::Vacant(slot) => {
            slot.insert(response.name.clone());
            true
        }
        Entry::Occupied(first) => {
            repeated.push(format!("{} has the listener and source of {} and was left out", response.name, first.get()));
            false
        }
    });
    set.notes.append(&mut repeated);
    if let Some((name, itd_s)) = beyond_any_head(set) {
        let expected = "directions that delays between the ears fit (are numbers in the names those of loudspeakers?)";
        let found = format!("{:.0} us in '{name}' and as far off in others", 1e6 * itd_s);
        return Err(BakeError::content(path, expected, found));
    }
    if ears_contradict(set) {
        let found = "sources on one side that are earlier and louder at the ear of the other";
        if !azimuths_are_certain {
            let expected = "ears that agree with the directions (do azimuths grow to the other side?)";
            return Err(BakeError::content(path, expected, found));
        }
        set.notes.push(format!("the ears contradict the directions: {found}"));
    }
    Ok(())
}

/// A response with its interaural delay, seconds, where a quarter of all, and at least three, have longer ones than any head
/// has in their directions: then these are not directions.
fn beyond_any_head(set: &Responses) -> Option<(&str, f64)> {
    /// The delays of a rigid sphere (Woodworth 1938) as wide as a head, and this much more, seconds: echoes move delays too.
    const HEAD_S: f64 = 0.0875 / 343.0;
    const MORE_S: f64 = 250e-6;
    let asked: Vec<_> = jury(set, |_| true).collect();
    let far_off = asked.iter().filter(|(_, lateral, itd_s)| {
        let lateral = f64::from(*lateral).abs().min(1.0);
        itd_s.abs() > HEAD_S * (lateral.asin() + lateral) + MORE_S
    });
    let far_off: Vec<_> = far_off.collect();
    (far_off.len() >= 3 && 4 * far_off.len() > asked.len()).then(|| (&far_off[0].0.name[..], far_off[0].2))
}

/// Some of the responses whose source's lateral part, -1 to 1 to the left, is chosen, with it and the delay between their ears.
fn jury(set: &Responses, chosen: impl Fn(f32) -> bool) -> impl Iterator<Item = (&Response, f32, f64)> {
    /// Responses that are asked.
    const JURY: usize = 24;
    let lateral = |r: &Response| r.listener.to_head(r.source).try_normalize().map_or(0.0, |v| v.y);
    let jury: Vec<(&Response, f32)> =
        set.responses.iter().map(|r| (r, lateral(r))).filter(|(_, lateral)| chosen(*lateral)).collect();
    let step = jury.len().div_ceil(JURY).max(1);
    let asked = jury.into_iter().step_by(step);
    asked.filter_map(|(r, lateral)| Some((r, lateral, itd_s(&r.left, &r.right, set.sample_rate_hz).ok()?)))
}

/// Whether most sources well to one side are both earlier and louder at the other side's ear: mirrored azimuths or swapped
/// ears, which real files have. Small differences are no evidence.
pub(super) fn ears_contradict(set: &Responses) -> bool {
    /// The sine of the lateral angle from which on a source is to one side.
    const LATERAL: f32 = 0.5;
    let sided = jury(set, |lateral| lateral.abs() > LATERAL);
    let sided = sided.filter_map(|(r, lateral, itd_s)| Some(Sided { lateral, itd_s, ild_db: ild_db(&r.left, &r.right).ok()? }));
    promenade_sofa::ears_contradict(sided)
}

fn whole(path: &Path, response: &Response) -> Result<(), BakeError> {
    let name = &response.name;
    if !response.listener.is_valid() || !response.source.is_finite() {
        let found = format!("{:?} and {}", response.listener, response.source);
        return Err(BakeError::entry(path, name, "a finite pose of listener and source", found));
    }
    if response.distance_m() > MAX_DISTANCE_M {
        let expected = format!("a source within {MAX_DISTANCE_M} m of the listener (positions and distances are in metres)");
        return Err(BakeError::entry(path, name, expected, format!("{} m", response.distance_m())));
    }
    for (ear, samples) in [("left", &response.left), ("right", &response.right)] {
        if let Some(at) = samples.iter().position(|v| !v.is_finite()) {
            return Err(BakeError::entry(path, format!("{name}, {ear} ear, sample {at}"), "a finite number", samples[at]));
        }
        if samples.iter().all(|&v| v == 0.0) {
            return Err(BakeError::entry(path, format!("{name}, {ear} ear"), "a response", "silence"));
        }
    }
    Ok(())
}

/// Listener and source on a grid, so that equal poses meet in a map. A quaternion and its negative are the same rotation.
fn key(response: &Response) -> [i64; 10] {
    let grain = |v: f32| (f64::from(v) / f64::from(GRAIN)).round() as i64;
    let (p, q, s) = (response.listener.position, response.listener.orientation, response.source);
    let mut turn = [q.x, q.y, q.z, q.w].map(grain);
    if turn.iter().rev().find(|&&v| v != 0).is_some_and(|&v| v < 0) {
        turn = turn.map(|v| -v);
    }
    [grain(p.x), grain(p.y), grain(p.z), turn[0], turn[1], turn[2], turn[3], grain(s.x), grain(s.y), grain(s.z)]
}
