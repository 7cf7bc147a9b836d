//! SOFA files: responses of two ears or of an Ambisonic microphone.

use super::{LoadOptions, Response, Responses, check};
use crate::BakeError;
use promenade_sofa::{About, Recorded, Sofa, SofaOptions};
use std::path::Path;

/// Responses of two ears.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Responses, BakeError> {
    let mut responses = Vec::new();
    let (about, exchanged) = Sofa::open(path)?.of_ears(chosen(options), |recorded| {
        let [left, right] = recorded.channels.try_into().unwrap_or_default();
        let Some(source) = recorded.source else { return };
        responses.push(Response { listener: recorded.listener, source, left, right, name: recorded.name });
    })?;
    let mut set = Responses::of(about, responses);
    // Labels in the unusual order are sometimes wrong: the ears themselves tell.
    if exchanged && check::ears_contradict(&set) {
        set.responses.iter_mut().for_each(|r| std::mem::swap(&mut r.left, &mut r.right));
        set.notes.push(
            "ReceiverPosition lists the right ear first, but the first receiver hears as a left ear and was taken as one"
                .to_owned(),
        );
    }
    Ok(set)
}

/// Responses of an Ambisonic microphone, whose channels are the receivers.
pub(super) fn ambisonic(path: &Path, options: &LoadOptions) -> Result<(About, Vec<Recorded>), BakeError> {
    let mut recorded = Vec::new();
    let about = Sofa::open(path)?.of_harmonics(chosen(options), |one| recorded.push(one))?;
    Ok((about, recorded))
}

fn chosen(options: &LoadOptions) -> SofaOptions {
    SofaOptions { azimuth_positive: options.azimuth_positive, source: options.source }
}
