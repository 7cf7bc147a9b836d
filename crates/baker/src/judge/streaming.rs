//! The cost of streaming an anchor cloud, whose time filters and convolution layers were trained on whole clips: distances
//! between streams and clips.

mod clips;
mod distance;
mod signal;
mod stream;

pub use distance::Distance;
pub use promenade_judge::poses_within;
pub use signal::{bursts_and_clicks, test_sound};

use crate::error::BakeError;
use clips::Clips;
use cpu_time::ThreadTime;
use promenade_core::decode::CloudDecoder;
use promenade_core::network::{Masks, Network};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{AnchorCloud, Pose, Scene, StftGrid};
use promenade_metrics::statistics::median;
use std::sync::Arc;
use stream::{Contender, PoseMasks, name_of, single_frames};

/// Decodes of each pose that are timed.
const DECODES: usize = 3;

/// One stream beside the clips.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamResult {
    /// Name in tables and files.
    pub name: String,
    /// Latency, seconds.
    pub latency_s: f64,
    /// Hops of it beyond a frame of the transform.
    pub lookahead_hops: usize,
    /// Mean over poses; `None` where there are no clips to compare with.
    pub distance: Option<Distance>,
    /// Processor seconds per second of sound, median over poses, without decoding; `None` where nothing is rendered.
    pub real_time: Option<f64>,
}

impl StreamResult {
    /// Of a stream's distances and costs at all poses.
    fn of(stream: &Contender, (distances, costs): (Vec<Distance>, Vec<f64>), grid: &StftGrid) -> Self {
        Self {
            name: stream.name.clone(),
            latency_s: stream.latency_samples() as f64 / grid.sample_rate_hz,
            lookahead_hops: stream.latency_samples().saturating_sub(grid.n_fft) / grid.hop,
            distance: Distance::mean(&distances),
            real_time: median(costs),
        }
    }
}

/// A scene's streams beside the clips of its model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamReport {
    /// The streams, in the order of the table.
    pub streams: Vec<StreamResult>,
    /// Clips that were compared at each pose.
    pub clips: usize,
    /// Length of a clip, seconds.
    pub clip_s: f64,
    /// Length of the part of each clip that was compared, seconds.
    pub inner_s: f64,
    /// Processor seconds per second of sound of rendering clips, median over poses.
    pub clip_real_time: Option<f64>,
    /// Processor seconds of decoding a pose for the tiers High and Reference, median.
    pub decode_s: Option<f64>,
    /// What was left out and why, and what was assumed.
    pub notes: Vec<String>,
}

/// Renders `dry`, a mono sound at the scene's own rate, as every stream that the scene's anchor cloud can be played as, for a
/// listener who stands still at each of `poses`, and compares it with the model's own clips. `progress` is given the share that
/// is done, 0 to 1.
///
/// Clips begin where frames of the streams do, and follow each other so that their inner parts cover the sound.
///
/// # Errors
/// The scene has no anchor cloud, or the sound is shorter than a clip. Where the model has no clips or no time filters, streams
/// and distances are left out and a note says why.
pub fn compare_streams(
    scene: &Arc<Scene>,
    dry: &[f32],
    poses: &[Pose],
    progress: impl Fn(f64),
) -> Result<StreamReport, BakeError> {
    let cloud = scene.cloud().ok_or_else(|| BakeError::argument("scene", "one with an anchor cloud", "a field only"))?;
    let grid = *scene.grid();
    let mut report = StreamReport::default();
    let mut clips = match Clips::new(cloud, grid) {
        Ok(clips) => Some(clips),
        Err(why) => {
            report.notes.push(format!("nothing to compare with: {why}"));
            None
        }
    };
    if let Some(clips) = &mut clips {
        clips.lay(dry.len())?;
        (report.clips, report.clip_s, report.inner_s) = (clips.count(), clips.length_s(), clips.inner_s());
    }
    let mut streams = streams(scene, cloud, &mut report.notes)?;
    report.decode_s = decode_s(scene, poses);

    let (seconds, count) = (dry.len() as f64 / grid.sample_rate_hz, streams.len() as f64);
    let mut network = Network::new(&cloud.model);
    let mut found: Vec<(Vec<Distance>, Vec<f64>)> = vec![Default::default(); streams.len()];
    let (mut clip_costs, mut silent) = (Vec::new(), 0);
    for (number, pose) in poses.iter().enumerate() {
        let listener = cloud.model.listener(pose);
        let mut at = PoseMasks { pose: *pose, listener, masks: Masks::new(&cloud.model.sizes()) };
        network.decode(&listener, &mut at.masks);
        let mut wanted = None;
        if let Some(clips) = &mut clips {
            let (ears, cost) = clips.render(dry, pose)?;
            clip_costs.push(cost);
            let heard = ears.iter().flatten().flatten().any(|v| *v != 0.0);
            silent += usize::from(!heard);
            wanted = heard.then_some(ears);
        }
        for (index, (stream, (distances, costs))) in streams.iter_mut().zip(&mut found).enumerate() {
            let (ears, took_s) = stream.render(dry, &at)?;
            costs.extend(took_s.map(|t| t / seconds));
            if let (Some(clips), Some(wanted)) = (&clips, &wanted) {
                let distance = Distance::between(&clips.cut(&ears), wanted, &grid);
                let what = || format!("stream '{}' at pose {number}", stream.name);
                distances.push(distance.map_err(|why| crate::error::unmeasurable(&what(), why))?);
            }
            progress((number as f64 + (index + 1) as f64 / count) / poses.len() as f64);
        }
    }
    if silent > 0 {
        report.notes.push(format!("at {silent} of {} poses the clips are silent: not compared", poses.len()));
    }
    report.clip_real_time = median(clip_costs);
    report.streams = streams.iter().zip(found).map(|(stream, found)| StreamResult::of(stream, found, &grid)).collect();
    Ok(report)
}

/// All streams of a scene; notes say what is left out.
fn streams(scene: &Arc<Scene>, cloud: &AnchorCloud, notes: &mut Vec<String>) -> Result<Vec<Contender>, BakeError> {
    let (sizes, grid) = (cloud.model.sizes(), scene.grid());
    // A scene whose tier Reference looks ahead delays all its tiers: here each is measured by itself.
    let mut parts = scene.parts().clone();
    parts.cloud = Some(AnchorCloud { conv: ConvMode::Off, ..cloud.clone() });
    let alone = Arc::new(Scene::new(parts)?);
    let mut streams = vec![Contender::dry()];
    let masks = Contender::without_taps(scene, cloud, ConvMode::Off);
    let published = masks.is_ok();
    match masks {
        Ok(stream) => streams.push(stream),
        Err(why) => notes.push(format!("the published head cannot be streamed: {why}")),
    }
    for tier in alone.tiers() {
        streams.push(Contender::tier(&alone, tier)?);
    }
    if sizes.frames == 0 {
        notes.push("the model has no time filter: there is nothing to project".to_owned());
    }
    if !published {
        return Ok(streams);
    }
    let used = [ConvMode::Causal, ConvMode::LookAhead].into_iter().filter(|_| sizes.conv);
    if sizes.frames == 0 {
        for conv in used {
            streams.push(Contender::without_taps(scene, cloud, conv)?);
        }
        return Ok(streams);
    }
    let most = if sizes.conv { ConvMode::LookAhead } else { ConvMode::Off };
    for conv in [ConvMode::Off].into_iter().chain(used) {
        streams.push(Contender::with_taps(scene, cloud, Projection::Diagonal, conv)?);
    }
    for projection in single_frames(sizes.frames, grid.hop_s(), cloud.projection) {
        streams.push(Contender::with_taps(scene, cloud, projection, most)?);
    }
    notes.push(format!("taps reach {} hops back, as in the scene; clips have {} frames", scene.shape().taps, sizes.frames));
    if cloud.conv != ConvMode::Off {
        notes.push(format!("the scene's tier reference: {}", name_of(cloud.projection, cloud.conv)));
    }
    Ok(streams)
}

/// Median processor seconds of decoding a pose.
fn decode_s(scene: &Arc<Scene>, poses: &[Pose]) -> Option<f64> {
    let mut decoder = CloudDecoder::new(scene)?;
    let mut answer = decoder.blank();
    let times = poses.iter().cycle().take(DECODES * poses.len()).map(|pose| {
        let began = ThreadTime::now();
        decoder.decode(pose, &mut answer);
        began.elapsed().as_secs_f64()
    });
    median(times)
}
