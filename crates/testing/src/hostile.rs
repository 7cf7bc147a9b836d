//! What no well-behaved host sends, and scenes at the edge of what a scene may be.

use crate::clouds::{self, Sizes};
use crate::heads;
use crate::scenes::{full_renderer, room, room_of_responses, room_with_cloud, room_with_images};
use fastrand::Rng;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::CloudKind;
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{
    AnchorCloud, Bands, BlockParams, EmitterParams, Emitters, LiveParams, Pose, Scene, SceneParts, Spatializer, StftGrid,
    TailModel, TransferShape, Trim,
};
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

/// Sample rates from the lowest to the highest that are supported, Hz.
pub const RATES_HZ: [f64; 9] = [2_000.0, 3_999.5, 8_000.0, 11_025.0, 44_100.0, 48_000.0, 192_000.0, 384_000.0, 768_000.0];

/// Kinds of input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Zeros.
    Silence,
    /// Full scale without change.
    Dc,
    /// Full-scale noise.
    Noise,
    /// Noise of which single samples are of the four kinds below.
    Broken,
    /// +200 dB full scale.
    Absurd,
    /// No number.
    Nan,
    /// Infinite, of either sign.
    Infinite,
    /// Subnormal numbers.
    Subnormal,
    /// A full-scale impulse at the start of the block.
    Impulse,
}

impl Input {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Silence,
        Self::Dc,
        Self::Noise,
        Self::Broken,
        Self::Absurd,
        Self::Nan,
        Self::Infinite,
        Self::Subnormal,
        Self::Impulse,
    ];

    /// Fills a block.
    pub fn fill(self, rng: &mut Rng, block: &mut [f32]) {
        for (i, x) in block.iter_mut().enumerate() {
            *x = match self {
                Self::Broken if rng.u8(0..4) > 0 => 2.0 * rng.f32() - 1.0,
                Self::Broken => {
                    rng.choice([Self::Absurd, Self::Nan, Self::Infinite, Self::Subnormal]).map_or(0.0, |k| k.value(rng, i))
                }
                kind => kind.value(rng, i),
            };
        }
    }

    fn value(self, rng: &mut Rng, index: usize) -> f32 {
        let sign = if rng.bool() { 1.0 } else { -1.0 };
        match self {
            Self::Silence => 0.0,
            Self::Dc => 1.0,
            Self::Noise | Self::Broken => 2.0 * rng.f32() - 1.0,
            Self::Absurd => sign * 1e10,
            Self::Nan => f32::NAN,
            Self::Infinite => sign * f32::INFINITY,
            Self::Subnormal => sign * 1e-39 * rng.f32(),
            Self::Impulse => f32::from(u8::from(index == 0)),
        }
    }
}

/// Whether a sample of the input is heard: what is no number, below -240 or above +120 dB full scale is silence.
#[must_use]
pub fn is_sound(x: f32) -> bool {
    (1e-12..1e6).contains(&x.abs())
}

/// Ways to be somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Walk {
    /// Stays at a place.
    At(Vec3),
    /// 1e9 m away.
    Far,
    /// 100 turns a second.
    Spinning,
    /// Looking straight up or down while turning.
    Upright,
    /// Somewhere else at every hop.
    Teleports,
    /// A position that is no number.
    Nowhere,
    /// Farther away than distances can be told.
    Beyond,
    /// A quaternion of length 2.
    Long,
    /// A quaternion of zeros.
    NoOrientation,
}

impl Walk {
    /// Those that are poses; the places are the origin, the scene's emitter and one of its anchors.
    #[must_use]
    pub fn valid(scene: &Scene) -> Vec<Self> {
        let anchor = scene.anchors().first().map_or(Vec3::X, |a| a.position);
        let image = scene.images().map_or(Vec3::Y, |i| i.images[0].position);
        let places = [Vec3::ZERO, anchor, image, scene.emitter().unwrap_or(Vec3::Z)].map(Self::At);
        [&places[..], &[Self::Far, Self::Spinning, Self::Upright, Self::Teleports]].concat()
    }

    /// Those that are no poses.
    pub const INVALID: [Self; 4] = [Self::Nowhere, Self::Beyond, Self::Long, Self::NoOrientation];

    /// The pose at a sample of a stream.
    #[must_use]
    pub fn pose(self, sample: usize, rate_hz: f64) -> Pose {
        let seconds = sample as f64 / rate_hz;
        let turn = |per_second: f64| (std::f64::consts::TAU * (seconds * per_second).fract()) as f32;
        match self {
            Self::At(position) => Pose::from_ypr(position, turn(0.1), 0.0, 0.0),
            Self::Far => Pose::from_ypr(Vec3::new(1e9, -1e9, 1e9), turn(0.1), 0.0, 0.0),
            Self::Spinning => Pose::from_ypr(Vec3::new(0.3, -0.2, 0.1), turn(100.0), 0.0, 0.0),
            Self::Upright => {
                let pitch = if (seconds * 20.0).fract() < 0.5 { FRAC_PI_2 } else { -FRAC_PI_2 };
                Pose::from_ypr(Vec3::new(-0.4, 0.0, 0.2), turn(1.0), pitch, 0.0)
            }
            Self::Teleports => {
                let mut rng = Rng::with_seed(sample as u64);
                let mut place = || 20.0 * rng.f32() - 10.0;
                Pose::from_ypr(Vec3::new(place(), place(), place()), place(), place(), place())
            }
            Self::Nowhere => Pose { position: Vec3::NAN, ..Pose::IDENTITY },
            Self::Beyond => Pose { position: Vec3::new(-1e20, 0.0, 3e38), ..Pose::IDENTITY },
            Self::Long => Pose { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 2.0), ..Pose::IDENTITY },
            Self::NoOrientation => Pose { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..Pose::IDENTITY },
        }
    }
}

/// Settings of a block, sensible and not.
#[must_use]
pub fn settings(rng: &mut Rng) -> BlockParams {
    let mut gain = || rng.choice([f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-30, 1e-3, 0.5, 1.0, 1.0, 1e3, 1e30]).unwrap_or(1.0);
    let (mix, gain) = (gain(), gain());
    let rate_hz = rng.choice([f32::NAN, -1.0, 0.0, 40.0, 1e9, f32::INFINITY]).unwrap_or(40.0);
    let live = LiveParams { rate_hz, wait: rng.bool() };
    let (wet_solo, bypass) = (rng.u8(0..8) == 0, rng.u8(0..8) == 0);
    BlockParams { live, mix, gain, wet_solo, bypass, trim: trim(rng), emitters: emitters(rng) }
}

/// Where a scene may be played from, sensible and not; half of the time where it is.
fn emitters(rng: &mut Rng) -> EmitterParams {
    if rng.bool() {
        return EmitterParams::default();
    }
    let offset = Vec3::splat(rng.choice([f32::NAN, f32::INFINITY, 0.0, 0.5, -20.0, 1e-30, 1e30]).unwrap_or(0.0));
    let spread = rng.choice([f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-30, 1.0, 3.0, 1e30]).unwrap_or(0.0);
    EmitterParams { offset, spread }
}

/// What a user may change about a scene's sound, sensible and not; half of the time nothing.
fn trim(rng: &mut Rng) -> Trim {
    if rng.bool() {
        return Trim::NEUTRAL;
    }
    let mut value = || rng.choice([f32::NAN, f32::INFINITY, -1.0, 0.0, 0.3, 0.5, 1.0, 1.7, 2.0, 1e-30, 1e30]).unwrap_or(1.0);
    let (direct, early, late, decay, distance_law, width) = (value(), value(), value(), value(), value(), value());
    let low_cut_hz = rng.choice([f32::NAN, -1.0, 0.0, 1e-30, 20.0, 300.0, 1e30]).unwrap_or(0.0);
    Trim { direct, early, late, decay, distance_law, width, low_cut_hz }
}

/// A scene in which every pose hears a mask and as much of the room, in the fewest bands that there may be, on hops of 5 ms.
///
/// # Panics
/// A scene may not be so.
#[must_use]
pub fn one_transfer(sample_rate_hz: f64, mask: f32, taps: usize, t60_s: f32) -> Arc<Scene> {
    let grid = StftGrid::four_hops(sample_rate_hz, 0.005 * sample_rate_hz);
    let mut transfer = TransferShape { bins: grid.bins(), bands: 2, taps }.silent();
    [&mut transfer.mixture, &mut transfer.taps, &mut transfer.late].into_iter().for_each(|gains| gains.fill(mask));
    let tail = TailModel { seed: 1, t60_s: vec![t60_s; 2], coherence: vec![0.0; 2], by_phase: false };
    let bands = Bands::new(vec![0.0, 1_000.0]).unwrap();
    Arc::new(Scene::of_transfer(&transfer, grid, bands, tail, 0.45 * sample_rate_hz as f32).unwrap())
}

/// A [`room`] besides a cloud of that many anchors, without convolution layers.
///
/// # Panics
/// A cloud may not have so many.
#[must_use]
pub fn room_of_anchors(sample_rate_hz: f64, anchors: usize) -> Arc<Scene> {
    let room = room(sample_rate_hz, 0.3, 0.1);
    let sizes = Sizes { anchors, bands: room.grid().bins(), frames: 40, width: 32, hyper: 4 };
    let model = clouds::sounding(CloudKind::SimpleSh, sizes);
    let cloud = AnchorCloud { model, conv: ConvMode::Off, projection: Projection::Diagonal, emitter: None };
    Arc::new(Scene::new(SceneParts { cloud: Some(cloud), ..room.parts().clone() }).unwrap())
}

/// Small scenes of every kind at a sample rate of their own, each with a name.
///
/// # Panics
/// The rate is too low for a window.
#[must_use]
pub fn scenes(sample_rate_hz: f64) -> Vec<(&'static str, Arc<Scene>)> {
    let with_images = |count: usize, place: fn(&Scene) -> Vec3| {
        let scene = room_with_images(sample_rate_hz, 0.3, 0.1, count);
        let mut parts = scene.parts().clone();
        if let Some(images) = &mut parts.images {
            images.images[0].position = place(&scene);
        }
        Arc::new(Scene::new(parts).unwrap())
    };
    let plain = room(sample_rate_hz, 0.3, 0.1);
    let other_head = Arc::new(plain.with_head(&heads::sphere(0.1)).unwrap());
    vec![
        ("a room", plain),
        ("another head", other_head),
        ("no taps", one_transfer(sample_rate_hz, 0.5, 0, 0.1)),
        ("masks of nothing", one_transfer(sample_rate_hz, 0.0, 8, 0.3)),
        ("masks of a million", one_transfer(sample_rate_hz, 1e6, 8, 0.3)),
        ("measured responses", room_of_responses(sample_rate_hz).0),
        ("one image, on the listener", with_images(1, |_| Vec3::ZERO)),
        ("many images, one on the emitter", with_images(40, |scene| scene.emitter().unwrap())),
        ("one anchor", room_of_anchors(sample_rate_hz, 1)),
        ("a cloud and a table", room_with_cloud(sample_rate_hz, 0.3, 0.1)),
    ]
}

/// The largest magnitude of a [`Spatializer`]'s output: +120 dB full scale.
pub const LOUDEST: f32 = 1e6;

/// Whether a sample may leave a [`Spatializer`]: finite, not subnormal, at most [`LOUDEST`].
#[must_use]
pub fn is_output(x: f32) -> bool {
    (x == 0.0 || x.is_normal()) && x.abs() <= LOUDEST
}

/// A block of 1 to 16,384 samples, short ones as often as long ones.
pub fn block(rng: &mut Rng) -> usize {
    (16_384.0_f32.powf(rng.f32()) as usize).clamp(1, 16_384)
}

/// Plays one stream to which all of this happens, `samples` long or a block longer, at a rate and with scenes that are drawn:
/// other inputs, settings and poses for every block, clocks that jump, scenes that change while they sound.
///
/// # Errors
/// A sample that is not [`is_output`], and what led to it.
pub fn wild(rng: &mut Rng, scenes: &[(&str, Arc<Scene>)], samples: usize) -> Result<(), String> {
    let rate = rng.choice(RATES_HZ).unwrap_or(48_000.0);
    let mut spare: Vec<_> = (0..3)
        .filter_map(|_| rng.choice(scenes))
        .filter(|(_, scene)| scene.playable_at(rate).is_ok())
        .map(|(_, scene)| Box::new(Emitters::from(full_renderer(scene, rate, 2)).with_second()))
        .collect();
    let mut s = Spatializer::new(rate);
    let mut at = 0;
    while at < samples {
        match rng.u8(0..16) {
            0 => s.jump(),
            1 => s.reset(),
            2 => s = Spatializer::new(rate),
            _ => {
                let refused = spare.pop().and_then(|next| s.swap_in(next).err());
                spare.extend(refused);
            }
        }
        let size = block(rng);
        let [mut first, mut second, mut left, mut right] = [(); 4].map(|()| vec![0.0; size]);
        let inputs = [(); 2].map(|()| rng.choice(Input::ALL).unwrap_or(Input::Nan));
        inputs[0].fill(rng, &mut first);
        inputs[1].fill(rng, &mut second);
        let stereo = [&first[..], &second];
        let walks = s.renderer().map_or(vec![Walk::Far], |r| [Walk::valid(r.scene()), Walk::INVALID.into()].concat());
        let (walk, params) = (rng.choice(walks).unwrap_or(Walk::Far), settings(rng));
        // The poses of this block may belong to another time.
        let start = if rng.bool() { at } else { rng.usize(0..1 << 40) };
        s.process(&stereo[..rng.usize(0..3)], &[], [&mut left, &mut right], &params, |i| walk.pose(start + i, rate));
        if let Some(x) = left.iter().chain(&right).find(|x| !is_output(**x)) {
            return Err(format!("{x:e} at {rate} Hz, {size} samples of {inputs:?}, {walk:?}, {params:?}"));
        }
        spare.extend(s.take_retired());
        at += size;
    }
    Ok(())
}
