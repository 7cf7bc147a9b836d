//! Scenes made of numbers, and a way to render them.

use crate::clouds::{self, Sizes};
use promenade_core::decode::InlineWorker;
use promenade_core::glam::Vec3;
use promenade_core::network::CloudKind;
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{
    AMBISONIC_CHANNELS, AmbisonicHead, Anchor, AnchorCloud, Axis, Bands, BlockParams, Facing, Field, FieldGrid, ImageSource,
    ImageSources, MeasuredRoom, Pose, Provenance, Renderer, RendererConfig, Rows, Scene, SceneParts, Site, Spatializer,
    StftGrid, TailModel, TransferShape, Trim,
};
use std::f32::consts::PI;
use std::sync::Arc;

/// Explicit taps of [`room`].
const TAPS: usize = 24;
/// Explicit taps of [`room_of_responses`].
pub const RESPONSE_TAPS: usize = 8;
/// Hops of the responses of [`room_of_responses`].
pub const RESPONSE_HOPS: usize = 20;

/// A room with a spherical-head-like direct sound and an exponential tail of `t60_s`, emitter 1.5 m ahead of the origin.
///
/// # Panics
/// The rate is too low for a window.
#[must_use]
pub fn room(sample_rate_hz: f64, t60_s: f32, tail_gain: f32) -> Arc<Scene> {
    room_with_taps(sample_rate_hz, t60_s, tail_gain, TAPS)
}

/// A [`room`] with so many explicit taps.
///
/// # Panics
/// The rate is too low for a window.
#[must_use]
pub fn room_with_taps(sample_rate_hz: f64, t60_s: f32, tail_gain: f32, taps: usize) -> Arc<Scene> {
    Arc::new(Scene::new(parts(sample_rate_hz, t60_s, tail_gain, taps)).unwrap())
}

/// A [`room`] with a small anchor cloud besides, whose convolution layers look ahead.
///
/// # Panics
/// The rate is too low for a window.
#[must_use]
pub fn room_with_cloud(sample_rate_hz: f64, t60_s: f32, tail_gain: f32) -> Arc<Scene> {
    let mut parts = parts(sample_rate_hz, t60_s, tail_gain, TAPS);
    let sizes = Sizes { anchors: 8, bands: parts.grid.bins(), frames: 40, width: 32, hyper: 4 };
    parts.cloud = Some(AnchorCloud {
        model: clouds::sounding(CloudKind::Full, sizes),
        conv: ConvMode::LookAhead,
        projection: Projection::Diagonal,
        emitter: None,
    });
    Arc::new(Scene::new(parts).unwrap())
}

/// The scene with its cloud played by other convolution layers, or without its cloud.
///
/// # Panics
/// It is no scene then.
#[must_use]
pub fn played_by(scene: &Arc<Scene>, conv: Option<ConvMode>) -> Arc<Scene> {
    let mut parts = scene.parts().clone();
    parts.cloud = conv.and_then(|conv| Some(AnchorCloud { conv, ..parts.cloud? }));
    Arc::new(Scene::new(parts).unwrap())
}

/// The direct sound alone.
pub const DIRECT: Trim = Trim { early: 0.0, late: 0.0, ..Trim::NEUTRAL };

/// A [`room`] with `count` image sources all around it, 3 to 20 m away, seen from everywhere. The head hears each channel for 5
/// ms.
///
/// # Panics
/// The rate is too low for a window.
#[must_use]
pub fn room_with_images(sample_rate_hz: f64, t60_s: f32, tail_gain: f32, count: usize) -> Arc<Scene> {
    let mut parts = parts(sample_rate_hz, t60_s, tail_gain, TAPS);
    let image = |i: usize| {
        let turn = 2.4 * i as f32;
        let distance = 3.0 + 17.0 * i as f32 / count as f32;
        let position = distance * Vec3::new(turn.cos(), turn.sin(), 0.3 * (3.0 * turn).sin());
        let gains = std::array::from_fn(|octave| 0.9 - 0.05 * octave as f32 - 0.3 * i as f32 / count as f32);
        ImageSource::new(position, gains)
    };
    let length = (0.005 * sample_rate_hz) as usize;
    let mut filters = crate::noise(9, 2 * AMBISONIC_CHANNELS * length);
    for filter in filters.chunks_mut(length) {
        for (i, x) in filter.iter_mut().enumerate() {
            *x *= 0.1 * (-(i as f32) / 20.0).exp();
        }
    }
    parts.images = Some(ImageSources {
        images: (0..count).map(image).collect(),
        air_db_per_m: [0.0, 0.001, 0.003, 0.005, 0.01, 0.03, 0.1],
        places: [Axis::uniform(-2.0, 2.0, 3), Axis::uniform(-2.0, 4.0, 2), Axis::single(0.0)],
        seen: vec![1.0; 6 * count],
        direct: vec![1.0; 6],
        head: AmbisonicHead { sample_rate_hz, lead: 0, filters },
        turning: None,
        emission: None,
    });
    Arc::new(Scene::new(parts).unwrap())
}

/// A room of two responses, a quarter turn to either side of the emitter, that hears nothing but them; and their samples,
/// `[response][ear][hop * sample]`.
///
/// # Panics
/// The rate is too low for a window.
#[must_use]
pub fn room_of_responses(rate: f64) -> (Arc<Scene>, Vec<f32>) {
    let grid = StftGrid::four_hops(rate, rate / 200.0);
    let bands = Bands::for_rate(rate);
    let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps: RESPONSE_TAPS };
    let direct = TransferShape { taps: 0, ..shape };
    let nodes = FieldGrid {
        position: [Axis::single(0.0), Axis::single(0.0), Axis::single(0.0)],
        facing: Facing::Emitter { position: Vec3::X, elevation: Axis::single(0.0), azimuth: Axis::circle(-0.5 * PI, 2) },
    };
    let samples: Vec<f32> = crate::noise(5, 2 * 2 * RESPONSE_HOPS * grid.hop).iter().map(|v| 0.1 * v).collect();
    let ears = || samples.chunks_exact(RESPONSE_HOPS * grid.hop);
    let low_step = MeasuredRoom::step_of(&grid);
    let measured = MeasuredRoom {
        sites: [-1.0, 1.0]
            .map(|side| Site { direction: Vec3::new(0.0, side, 0.0), position: Vec3::ZERO, response: u32::from(side > 0.0) })
            .to_vec(),
        samples: ears().flat_map(|ear| &ear[..(RESPONSE_TAPS + 1) * grid.hop]).copied().collect(),
        low: ears().flat_map(|ear| MeasuredRoom::bass_of(ear, low_step, &grid, RESPONSE_HOPS)).collect(),
        low_step,
        low_hops: RESPONSE_HOPS,
        late: vec![0.0; 2 * shape.tap_len()],
        late_before: Vec::new(),
        gains: vec![1.0; shape.tap_len()],
        lifted: None,
    };
    let field = Field::new(nodes, direct, Rows::Whole(vec![direct.silent().to_row(); 2].concat()));
    let parts = room(rate, 0.5, 0.0).parts().clone();
    let scene = Scene::new(SceneParts {
        grid,
        tail: TailModel { seed: 1, t60_s: vec![0.5; bands.count()], coherence: vec![0.0; bands.count()], by_phase: false },
        bands,
        taps: RESPONSE_TAPS,
        measured: Some(measured),
        field,
        ..parts
    });
    (Arc::new(scene.unwrap()), samples)
}

fn parts(sample_rate_hz: f64, t60_s: f32, tail_gain: f32, taps: usize) -> SceneParts {
    let hop = (0.005 * sample_rate_hz) as usize;
    let grid = StftGrid { sample_rate_hz, n_fft: 4 * hop, hop };
    let bands = Bands::for_rate(sample_rate_hz);
    let shape = TransferShape { bins: grid.bins(), bands: bands.count(), taps };
    let nodes = FieldGrid {
        position: [Axis::uniform(-2.0, 2.0, 3), Axis::uniform(-2.0, 4.0, 2), Axis::single(0.0)],
        facing: Facing::Emitter {
            position: Vec3::new(1.5, 0.0, 0.0),
            elevation: Axis::uniform(-PI / 2.0, PI / 4.0, 5),
            azimuth: Axis::circle(-PI, 36),
        },
    };
    let decay = 10.0_f32.powf(-3.0 * grid.hop_s() as f32 / t60_s);
    let rows = (0..nodes.nodes())
        .flat_map(|i| {
            let (position, direction) = nodes.node(i);
            let mut t = shape.silent();
            for k in 0..shape.bins {
                let shade = (k as f32 / shape.bins as f32).sqrt() * 0.8;
                t.mixture[k] = 0.7 + 0.1 * position.x / 2.0;
                t.difference[k] = -shade * direction.y;
            }
            t.delay_s = -(direction.y.asin() + direction.y) * 0.0875 / 343.0;
            for (l, tap) in t.taps.chunks_exact_mut(shape.tap_len()).enumerate() {
                tap.fill(tail_gain * decay.powi(l as i32 + 1) * (1.0 + 0.2 * direction.y));
            }
            t.late.fill(tail_gain * decay.powi(taps as i32 + 1));
            t.to_row()
        })
        .collect();
    let tail = TailModel { seed: 7, t60_s: vec![t60_s; shape.bands], coherence: vec![0.2; shape.bands], by_phase: false };
    let field = Field::new(nodes, shape, Rows::Whole(rows)).unwrap();
    SceneParts {
        provenance: Provenance { title: "Numbers".into(), ..Provenance::default() },
        taps: shape.taps,
        field: Some(field),
        top_hz: 0.45 * sample_rate_hz as f32,
        bounds: (Vec3::new(-2.0, -2.0, 0.0), Vec3::new(2.0, 2.0, 0.0)),
        anchors: vec![Anchor { position: Vec3::X, colour: Vec3::ONE }],
        ..SceneParts::new(grid, bands, tail)
    }
}

/// A renderer at `rate` Hz of one voice that decodes on the thread that renders.
///
/// # Panics
/// The scene cannot be played at that rate, or has no anchor cloud.
#[must_use]
pub fn live_renderer(scene: &Arc<Scene>, rate: f64) -> Renderer {
    assert!(scene.cloud().is_some(), "the scene has no anchor cloud");
    full_renderer(scene, rate, 1)
}

/// A renderer at `rate` Hz of some voices, which decodes on the thread that renders.
///
/// # Panics
/// The scene cannot be played at that rate.
#[must_use]
pub fn full_renderer(scene: &Arc<Scene>, rate: f64, voices: usize) -> Renderer {
    let config = RendererConfig { voices, workers: InlineWorker::several(scene, voices), ..rate.into() };
    Renderer::new(Arc::clone(scene), config).unwrap()
}

/// A spatializer at `rate` Hz that plays the scene.
///
/// # Panics
/// The scene cannot be played at that rate.
#[must_use]
pub fn spatializer(scene: &Arc<Scene>, rate: f64) -> Spatializer {
    let mut s = Spatializer::new(rate);
    s.install(Box::new(Renderer::new(Arc::clone(scene), rate).unwrap()));
    s
}

/// Renders a mono input in blocks whose sizes come from `sizes` in turn; `pose_at` counts samples from the start.
pub fn render(
    s: &mut Spatializer,
    input: &[f32],
    sizes: &[usize],
    params: &BlockParams,
    pose_at: impl Fn(usize) -> Pose,
) -> [Vec<f32>; 2] {
    let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
    let (mut at, mut turn) = (0, 0);
    while at < input.len() {
        let n = sizes[turn % sizes.len()].min(input.len() - at);
        let [l, r] = &mut out;
        s.process(&[&input[at..at + n]], &[], [&mut l[at..at + n], &mut r[at..at + n]], params, |i| pose_at(at + i));
        at += n;
        turn += 1;
    }
    out
}

/// A listener who walks at 1 m/s and turns at 90 degrees a second.
pub fn walk(rate: f64) -> impl Fn(usize) -> Pose {
    move |i| {
        // The walk repeats after four seconds, and so does the turn: a day later it is as exact.
        let t = ((i as f64 / rate) % 4.0) as f32;
        let x = if t < 2.0 { t } else { 4.0 - t };
        Pose::from_ypr(Vec3::new(x - 1.0, 0.3, 0.0), t * PI / 2.0, 0.0, 0.0)
    }
}
