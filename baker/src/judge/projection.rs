//! What it costs to stream an anchor cloud, whose time filters and convolution layers were trained on whole clips.

mod distance;
mod signal;
mod way;

pub use distance::Distance;
pub use signal::{bursts_and_clicks, poses_within};

use cpu_time::ThreadTime;
use distance::Ears;
use promenade_core::decode::CloudDecoder;
use promenade_core::network::{Masks, Network};
use promenade_core::published::{ClipRenderer, ConvMode, Projection, PublishedError};
use promenade_core::{AnchorCloud, Pose, RenderError, Scene, SceneError, StftGrid, Tier};
use promenade_metrics::MetricError;
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;
use way::{Spot, Way, rows, stream_name};

/// Hops at either end of a clip that are not compared, at least.
const EDGE_HOPS: usize = 8;
/// Hops that the convolution layers reach to either side.
const CONV_HOPS: usize = 5;
/// Decodes of each pose that are timed.
const DECODES: usize = 3;

/// One way to render a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectionRow {
    /// What it is.
    pub name: String,
    /// Delay of the output, seconds.
    pub latency_s: f64,
    /// Hops of that beyond a frame of the transform.
    pub lookahead_hops: usize,
    /// Mean over poses; none where there are no clips to compare with.
    pub distance: Option<Distance>,
    /// Processor seconds per second of sound, median over poses, decoding not counted; none where nothing is rendered.
    pub real_time: Option<f64>,
}

/// What a scene's streams are like beside the clips of its model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectionReport {
    /// Ways to render.
    pub rows: Vec<ProjectionRow>,
    /// Clips that were compared at each pose.
    pub clips: usize,
    /// Length of a clip, seconds.
    pub clip_s: f64,
    /// Length of the part of each clip that was compared, seconds.
    pub inside_s: f64,
    /// Processor seconds per second of sound of the clip path, median over poses.
    pub clip_real_time: Option<f64>,
    /// Processor seconds of decoding a pose for the tiers High and Reference, median.
    pub decode_s: Option<f64>,
    /// What the reader has to know.
    pub notes: Vec<String>,
}

/// Why nothing can be compared.
#[derive(Debug, Error)]
pub enum ProjectionFailure {
    /// The scene has none.
    #[error("expected a scene with an anchor cloud, found a field only")]
    NoCloud,
    /// There is no whole clip in the input.
    #[error("input: expected at least {expected_s:.2} s, a clip of the model, found {found_s:.2} s")]
    Input {
        /// Seconds of a clip.
        expected_s: f64,
        /// Seconds of the input.
        found_s: f64,
    },
    /// A variant of the scene is none.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The model cannot be rendered.
    #[error(transparent)]
    Head(#[from] PublishedError),
    /// A rendering cannot be compared.
    #[error("{name}, pose {pose}")]
    Metric {
        /// The way to render.
        name: String,
        /// Number of the pose.
        pose: usize,
        /// Why.
        source: MetricError,
    },
}

/// Renders `mono`, at the scene's own rate, in every way that the scene's anchor cloud can be streamed, for a listener who stands still
/// at each of `poses`, and compares with the model's own clips. `progress` is told the share that is done, 0 to 1.
///
/// Clips begin where frames of the streams do, and follow each other so that their inner parts cover the sound.
///
/// # Errors
/// The scene has no anchor cloud, or the input is shorter than a clip. Where the model has no clips or no time filters, rows and
/// distances are left out and a note says why.
pub fn compare_projections(
    scene: &Arc<Scene>,
    mono: &[f32],
    poses: &[Pose],
    progress: impl Fn(f64),
) -> Result<ProjectionReport, ProjectionFailure> {
    let cloud = scene.cloud().ok_or(ProjectionFailure::NoCloud)?;
    let grid = *scene.grid();
    let mut report = ProjectionReport::default();
    let mut clips = match Clips::new(cloud, grid) {
        Ok(clips) => Some(clips),
        Err(why) => {
            report.notes.push(format!("nothing to compare with: {why}"));
            None
        }
    };
    if let Some(clips) = &mut clips {
        clips.lay(mono.len())?;
        report.clips = clips.starts.len();
        report.clip_s = clips.length as f64 / grid.sample_rate_hz;
        report.inside_s = clips.inside.len() as f64 / grid.sample_rate_hz;
    }
    let (mut ways, notes) = ways(scene, cloud)?;
    report.notes.extend(notes);
    report.decode_s = decode_s(scene, poses);

    let (seconds, count) = (mono.len() as f64 / grid.sample_rate_hz, ways.len() as f64);
    let mut decoder = Network::new(&cloud.model);
    let mut found: Vec<(Vec<Distance>, Vec<f64>)> = vec![Default::default(); ways.len()];
    let (mut clip_costs, mut silent) = (Vec::new(), 0);
    for (number, pose) in poses.iter().enumerate() {
        let listener = cloud.model.listener(pose);
        let mut spot = Spot { pose: *pose, listener, masks: Masks::new(&cloud.model.sizes()) };
        decoder.decode(&listener, &mut spot.masks);
        let mut wanted = None;
        if let Some(clips) = &mut clips {
            let (ears, cost) = clips.render(mono, &spot)?;
            clip_costs.push(cost);
            let heard = ears.iter().flatten().flatten().any(|v| *v != 0.0);
            silent += usize::from(!heard);
            wanted = heard.then_some(ears);
        }
        for (index, (way, (distances, costs))) in ways.iter_mut().zip(&mut found).enumerate() {
            let (ears, took) = way.render(mono, &spot);
            costs.extend(took.map(|t| t / seconds));
            if let (Some(clips), Some(wanted)) = (&clips, &wanted) {
                let distance = Distance::between(&clips.cut(&ears), wanted, &grid);
                distances.push(distance.map_err(|source| ProjectionFailure::Metric {
                    name: way.name.clone(),
                    pose: number,
                    source,
                })?);
            }
            progress((number as f64 + (index + 1) as f64 / count) / poses.len() as f64);
        }
    }
    if silent > 0 {
        report.notes.push(format!("at {silent} of {} poses the clips are silent: not compared", poses.len()));
    }
    report.clip_real_time = median(clip_costs);
    report.rows = (ways.iter().zip(found))
        .map(|(way, (distances, costs))| ProjectionRow {
            name: way.name.clone(),
            latency_s: way.latency_samples() as f64 / grid.sample_rate_hz,
            lookahead_hops: way.latency_samples().saturating_sub(grid.n_fft) / grid.hop,
            distance: Distance::mean(&distances),
            real_time: median(costs),
        })
        .collect();
    Ok(report)
}

/// All ways to render a scene, and what there is to say about them.
fn ways(scene: &Arc<Scene>, cloud: &AnchorCloud) -> Result<(Vec<Way>, Vec<String>), ProjectionFailure> {
    let (sizes, grid) = (cloud.model.sizes(), scene.grid());
    let mut notes = Vec::new();
    // A scene whose tier Reference looks ahead delays all its tiers: here each is measured by itself.
    let mut parts = scene.parts().clone();
    parts.cloud = Some(AnchorCloud { conv: ConvMode::Off, ..cloud.clone() });
    let alone = Arc::new(Scene::new(parts)?);
    let mut ways = vec![Way::source()];
    let masks = Way::without_taps(scene, cloud, ConvMode::Off);
    let streams = masks.is_ok();
    match masks {
        Ok(way) => ways.push(way),
        Err(why) => notes.push(format!("the published head cannot be streamed: {why}")),
    }
    for tier in Tier::ALL.into_iter().filter(|t| alone.has_tier(*t)) {
        ways.push(Way::tier(&alone, tier)?);
    }
    if sizes.frames == 0 {
        notes.push("the model has no time filter: there is nothing to project".to_owned());
    }
    if !streams {
        return Ok((ways, notes));
    }
    let used = [ConvMode::Causal, ConvMode::LookAhead].into_iter().filter(|_| sizes.conv);
    if sizes.frames == 0 {
        for conv in used {
            ways.push(Way::without_taps(scene, cloud, conv)?);
        }
        return Ok((ways, notes));
    }
    let most = if sizes.conv { ConvMode::LookAhead } else { ConvMode::Off };
    for conv in [ConvMode::Off].into_iter().chain(used) {
        ways.push(Way::stream(scene, cloud, Projection::Diagonal, conv)?);
    }
    for row in rows(sizes.frames, grid.hop_s(), cloud.projection) {
        ways.push(Way::stream(scene, cloud, row, most)?);
    }
    notes.push(format!("taps reach {} hops back, as in the scene; clips have {} frames", scene.shape().taps, sizes.frames));
    if cloud.conv != ConvMode::Off {
        notes.push(format!("the scene's tier reference: {}", stream_name(cloud.projection, cloud.conv)));
    }
    Ok((ways, notes))
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
    median(times.collect())
}

/// The model's own clips.
struct Clips {
    renderer: ClipRenderer,
    grid: StftGrid,
    /// Samples of a clip's input.
    length: usize,
    /// Part of a clip's output that is compared.
    inside: Range<usize>,
    /// First samples of the clips.
    starts: Vec<usize>,
}

impl Clips {
    fn new(cloud: &AnchorCloud, grid: StftGrid) -> Result<Self, String> {
        let renderer = ClipRenderer::new(&cloud.model, grid).map_err(|e| e.to_string())?;
        let lengths = renderer.clip_samples();
        // A second, as in training, or the nearest length that is taken.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked when the scene was read")]
        let length = (grid.sample_rate_hz.round() as usize).clamp(*lengths.start(), *lengths.end());
        // Reflected at its ends, a clip's first and last frames hold what no stream knows; convolution carries it further.
        let edge = (EDGE_HOPS * grid.hop).max(grid.n_fft + CONV_HOPS * grid.hop);
        let samples = renderer.out_samples();
        if samples < 2 * edge + grid.n_fft {
            let least = 2 * edge + grid.n_fft;
            return Err(format!("clips have {samples} samples, expected {least} or more to leave out their edges"));
        }
        Ok(Self { renderer, grid, length, inside: edge..samples - edge, starts: Vec::new() })
    }

    /// Lays clips over a sound so that their frames are frames of a stream.
    fn lay(&mut self, samples: usize) -> Result<(), ProjectionFailure> {
        let hop = self.grid.hop;
        let first = (hop - self.grid.n_fft / 2 % hop) % hop;
        let step = self.inside.len() / hop * hop;
        let seconds = |n: usize| n as f64 / self.grid.sample_rate_hz;
        let expected = first + self.length;
        if samples < expected {
            return Err(ProjectionFailure::Input { expected_s: seconds(expected), found_s: seconds(samples) });
        }
        self.starts = (first..=samples - self.length).step_by(step.max(1)).collect();
        Ok(())
    }

    /// The inner parts of all clips, and the processor seconds per second of sound.
    fn render(&mut self, mono: &[f32], spot: &Spot) -> Result<(Vec<Ears>, f64), PublishedError> {
        let samples = self.renderer.out_samples();
        let mut out = [vec![0.0; samples], vec![0.0; samples]];
        let (mut inner, mut took) = (Vec::new(), 0.0);
        for start in &self.starts {
            let [left, right] = &mut out;
            let began = ThreadTime::now();
            self.renderer.render(&mono[*start..][..self.length], &spot.masks, &spot.listener, [left, right])?;
            took += began.elapsed().as_secs_f64();
            inner.push([left, right].map(|ear| ear[self.inside.clone()].to_vec()));
        }
        let sound = (samples * self.starts.len()) as f64 / self.grid.sample_rate_hz;
        Ok((inner, took / sound))
    }

    /// The same parts of a rendering that is aligned with the input.
    fn cut(&self, ears: &Ears) -> Vec<Ears> {
        let inside = |start: &usize| start + self.inside.start..start + self.inside.end;
        self.starts.iter().map(|start| [0, 1].map(|e| ears[e][inside(start)].to_vec())).collect()
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
