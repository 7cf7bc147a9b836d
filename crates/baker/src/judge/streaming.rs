//! The cost of streaming an anchor cloud, whose time filters and convolution layers were trained on whole clips: distances
//! between what its scene can be played as and clips.

mod clips;
mod distance;
mod signal;

pub use distance::Distance;
pub use promenade_judge::poses_within;
pub use signal::{bursts_and_clicks, test_sound};

use crate::error::BakeError;
use clips::Clips;
use cpu_time::ThreadTime;
use promenade_core::decode::CloudDecoder;
use promenade_core::published::ConvMode;
use promenade_core::{AnchorCloud, Pose, Scene, SceneParts, StftGrid};
use promenade_metrics::statistics::median;
use promenade_player::{Player, Playing};
use std::sync::Arc;

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
    /// Of a player's distances and costs at all poses; the dry sound has none.
    fn of(stream: Option<&(&'static str, Player)>, (distances, costs): (Vec<Distance>, Vec<f64>), grid: &StftGrid) -> Self {
        let latency = stream.map_or(0, |(_, player)| player.latency_samples());
        Self {
            name: name(stream),
            latency_s: latency as f64 / grid.sample_rate_hz,
            lookahead_hops: latency.saturating_sub(grid.n_fft) / grid.hop,
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
    /// Processor seconds of decoding a pose median.
    pub decode_s: Option<f64>,
    /// What was left out and why, and what was assumed.
    pub notes: Vec<String>,
}

/// Renders `dry`, a mono sound at the scene's own rate, by the table, the decoder and the published head of a scene with an
/// anchor cloud, for a listener who stands still at each of `poses`. Compares that, and the dry sound at both ears, with the
/// model's own clips. `progress` is given the share that is done, 0 to 1.
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
    // The dry sound comes first.
    let mut streams = vec![None];
    for played in ways(scene) {
        streams.push(Some((played.0, Player::new(&played.1, grid.sample_rate_hz, Playing::Stream)?)));
    }
    report.decode_s = decode_s(scene, poses);

    let (seconds, count) = (dry.len() as f64 / grid.sample_rate_hz, streams.len() as f64);
    let mut found: Vec<(Vec<Distance>, Vec<f64>)> = vec![Default::default(); streams.len()];
    let (mut clip_costs, mut silent) = (Vec::new(), 0);
    for (number, pose) in poses.iter().enumerate() {
        let mut wanted = None;
        if let Some(clips) = &mut clips {
            let (ears, cost) = clips.render(dry, pose)?;
            clip_costs.push(cost);
            let heard = ears.iter().flatten().flatten().any(|v| *v != 0.0);
            silent += usize::from(!heard);
            wanted = heard.then_some(ears);
        }
        for (index, (stream, (distances, costs))) in streams.iter_mut().zip(&mut found).enumerate() {
            let ears = match stream {
                None => [dry.to_vec(), dry.to_vec()],
                Some((_, player)) => {
                    let ears = player.render(dry, &mut |_| *pose)?;
                    costs.push(player.processor_s() / seconds);
                    ears
                }
            };
            if let (Some(clips), Some(wanted)) = (&clips, &wanted) {
                let distance = Distance::between(&clips.cut(&ears), wanted, &grid);
                let what = || format!("stream '{}' at pose {number}", name(stream.as_ref()));
                distances.push(distance.map_err(|why| crate::error::unmeasurable(&what(), why))?);
            }
            progress((number as f64 + (index + 1) as f64 / count) / poses.len() as f64);
        }
    }
    if silent > 0 {
        report.notes.push(format!("at {silent} of {} poses the clips are silent: not compared", poses.len()));
    }
    report.clip_real_time = median(clip_costs);
    report.streams = streams.iter().zip(found).map(|(player, found)| StreamResult::of(player.as_ref(), found, &grid)).collect();
    Ok(report)
}

/// What a scene with an anchor cloud can be played as, each with its name.
fn ways(scene: &Arc<Scene>) -> Vec<(&'static str, Arc<Scene>)> {
    let with = |cloud: Option<AnchorCloud>| Scene::new(SceneParts { cloud, ..scene.parts().clone() }).ok().map(Arc::new);
    let table = scene.field().and_then(|_| with(None));
    let conv = |conv: ConvMode| with(scene.cloud().map(|cloud| AnchorCloud { conv, ..cloud.clone() }));
    let published = scene.cloud().filter(|cloud| cloud.conv != ConvMode::Off).map(|_| Arc::clone(scene));
    let all = [("table", table), ("decoded", conv(ConvMode::Off)), ("published", published)];
    all.into_iter().filter_map(|(name, scene)| Some((name, scene?))).collect()
}

/// What a stream is called.
fn name(stream: Option<&(&'static str, Player)>) -> String {
    stream.map_or("source", |(name, _)| name).to_owned()
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
