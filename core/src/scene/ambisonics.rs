//! A scene heard by Ambisonic microphones in the place of the head.

use super::{
    AMBISONIC_CHANNELS, AmbisonicHead, BassEars, BassField, Corners, Emission, ImageSource, ImageSources, Scene, SceneParts,
};
use crate::decode::field::{Facing, Field, FieldGrid, Rows};
use crate::head::{degree, harmonics};
use crate::number::single;
use crate::octave::OCTAVES;
use crate::{Axis, StftGrid, TailModel};
use glam::{Mat3, Vec3};
use promenade_fourier::num_complex::Complex64;
use std::f64::consts::TAU;
use std::ops::Range;
use thiserror::Error;

/// Here every head hears nearly what is there, Hz.
const TRANSPARENT_HZ: Range<f64> = 200.0..800.0;
/// Rate at which one sample is flat at every host's rate, Hz.
const FLAT_RATE_HZ: f64 = 768_000.0;

/// A scene that has no Ambisonic form.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("expected a scene of image sources for Ambisonics, found one whose sound has the ears of a head in it")]
pub struct NotAmbisonicError;

/// What the channels of a pair, as in [`Scene::ambisonic_pair`], have of a dry left and right channel, `[output][channel]`:
/// plane waves from 90 degrees to either side of the listener, each with half of its amplitude. The same in both is as loud in
/// the first channel as one.
///
/// # Panics
/// When `pair` is not below half of [`AMBISONIC_CHANNELS`].
#[must_use]
pub fn ambisonic_dry(pair: usize) -> [[f32; 2]; 2] {
    let sides = [Vec3::Y, Vec3::NEG_Y].map(|side| harmonics(AMBISONIC_CHANNELS.isqrt() - 1, side));
    [2 * pair, 2 * pair + 1].map(|channel| [0, 1].map(|side| 0.5 * sn3d(channel) * sides[side][channel]))
}

impl Scene {
    /// The scene with two channels of AmbiX (ACN, SN3D: Nachbar et al. 2011) for ears: `2 * pair` and the one after it,
    /// along the axes of the listener's head. All pairs rendered alike are the sound field in third order; its first channels
    /// are a lower one.
    ///
    /// The bass of waves is heard in first order. The emitter and its images sound from their directions, with the amplitude of
    /// their distance. What noise carries comes from everywhere alike: each channel has its own noise, with the energy that the
    /// ears hear, which are equalised for such a field. The head's levels by octave that image sources bring along
    /// stay.
    ///
    /// # Errors
    /// A scene without image sources.
    ///
    /// # Panics
    /// When `pair` is not below half of [`AMBISONIC_CHANNELS`].
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn ambisonic_pair(&self, pair: usize) -> Result<Self, NotAmbisonicError> {
        assert!(pair < AMBISONIC_CHANNELS / 2, "a pair of the channels of third order");
        let parts = &self.parts;
        let (Some(images), Some(field), Some(room)) = (&parts.images, &parts.field, &parts.room) else {
            return Err(NotAmbisonicError);
        };
        if images.turning.is_some() {
            return Err(NotAmbisonicError);
        }
        let (Facing::Emitter { position: emitter, .. }, Rows::Whole(direct), Some(filters)) =
            (&field.grid().facing, field.rows(), room.rows().whole(&room.shape()))
        else {
            return Err(NotAmbisonicError);
        };
        let weights = [2 * pair, 2 * pair + 1].map(sn3d);
        let gain = emitter_gain(direct, field, &parts.grid, &images.head);
        let seen = images.direct.iter().zip(images.seen.chunks(images.images.len()));
        let with_emitter = ImageSources {
            images: [&[ImageSource::new(*emitter, [gain; OCTAVES])], &*images.images].concat(),
            seen: seen.flat_map(|(direct, seen)| [&[*direct], seen].concat()).collect(),
            head: one_pair(pair, weights),
            emission: images
                .emission
                .as_ref()
                .map(|emission| Emission { turns: [&[Mat3::IDENTITY], &*emission.turns].concat(), ..emission.clone() }),
            ..images.clone()
        };
        let filters = diffuse(&filters, room, diffuse_level(&parts.grid, &images.head), weights);
        // Both tables are of the shapes they had.
        let (Some(field), Some(room)) = (silent(field), Field::new(room.grid().clone(), room.shape(), Rows::Whole(filters)))
        else {
            return Err(NotAmbisonicError);
        };
        let tail = TailModel {
            seed: parts.tail.seed.wrapping_add(pair as u64),
            coherence: vec![0.0; parts.bands.count()],
            by_phase: false,
            ..parts.tail.clone()
        };
        Ok(Self {
            parts: SceneParts {
                tail,
                field: Some(field),
                room: Some(room),
                images: Some(with_emitter),
                // The emitter is seen as its own table says, whatever stands here.
                corners: parts
                    .corners
                    .as_ref()
                    .map(|corners| Corners { seen: corners.seen.iter().map(|seen| 2.0 * seen).collect(), ..corners.clone() }),
                bass: parts.bass.as_ref().map(|bass| BassField { ears: BassEars::Pair(pair), ..bass.clone() }),
                cloud: None,
                measured_head: None,
                held_out: Vec::new(),
                ..parts.clone()
            },
        })
    }
}

/// What makes a channel in N3D one in SN3D.
fn sn3d(channel: usize) -> f32 {
    single((2.0 * degree(channel) as f64 + 1.0).sqrt().recip())
}

/// Amplitude of the emitter at 1 m: what the field has of it over what the head hears of a gain of 1, where heads do little,
/// both over all directions.
fn emitter_gain(rows: &[f32], field: &Field, grid: &StftGrid, head: &AmbisonicHead) -> f32 {
    let (bins, row_len) = (field.shape().bins, field.shape().row_len());
    let near: Vec<usize> = (0..bins).filter(|k| TRANSPARENT_HZ.contains(&grid.bin_hz(*k))).collect();
    let heard: Vec<_> = near.iter().map(|k| head.at(grid.bin_hz(*k))).collect();
    let (mut found, mut plain) = (0.0, 0.0);
    for (node, row) in rows.chunks_exact(row_len).enumerate() {
        let (_, direction) = field.grid().node(node);
        let level = f64::from(direction.truncate().length());
        let shares = harmonics(AMBISONIC_CHANNELS.isqrt() - 1, direction);
        for (k, channels) in near.iter().zip(&heard) {
            let (mixture, difference) = (f64::from(row[*k]), f64::from(row[bins + k]));
            found += level * 2.0 * mixture * mixture * (1.0 + difference * difference);
            for ear in 0..2 {
                let sum: Complex64 = channels.iter().zip(&shares).map(|(h, y)| h[ear] * f64::from(*y)).sum();
                plain += level * sum.norm_sqr();
            }
        }
    }
    if plain > 0.0 { single((found / plain).sqrt()) } else { 0.0 }
}

/// Amplitude that a head has of a field that comes from everywhere, where heads do little. Scenes' heads are equalised for
/// such a field: it is the same at all frequencies, also where the filters of third order have less of it.
fn diffuse_level(grid: &StftGrid, head: &AmbisonicHead) -> f32 {
    // Channels of such a field are unlike each other and, in N3D, of one energy.
    let made = |hz: f64| 0.5 * head.at(hz).iter().flatten().map(Complex64::norm_sqr).sum::<f64>();
    let near = (0..grid.bins()).map(|k| grid.bin_hz(k)).filter(|hz| TRANSPARENT_HZ.contains(hz));
    let (sum, count) = near.fold((0.0, 0.0), |(sum, count), hz| (sum + made(hz), count + 1.0));
    single((sum / f64::max(count, 1.0)).max(1e-9).sqrt())
}

/// Gains of time filters, each row of them, for channels of a field that comes from everywhere and that a head has at a level.
fn diffuse(rows: &[f32], room: &Field, level: f32, weights: [f32; 2]) -> Vec<f32> {
    let mut rows = rows.to_vec();
    for row in rows.chunks_exact_mut(room.shape().row_len()) {
        for gains in row[room.shape().direct_len()..].chunks_exact_mut(2 * room.shape().bands) {
            let (left, right) = gains.split_at_mut(room.shape().bands);
            for (left, right) in left.iter_mut().zip(right) {
                let both = (0.5 * (*left * *left + *right * *right)).sqrt() / level;
                [*left, *right] = weights.map(|weight| weight * both);
            }
        }
    }
    rows
}

/// A field that hears nothing of the emitter.
fn silent(field: &Field) -> Option<Field> {
    let Facing::Emitter { position, .. } = &field.grid().facing else { return None };
    let [x, y, z, elevation, azimuth] = [(); 5].map(|()| Axis::single(0.0));
    let grid = FieldGrid { position: [x, y, z], facing: Facing::Emitter { position: *position, elevation, azimuth } };
    Field::new(grid, field.shape(), Rows::Whole(field.shape().silent().to_row()))
}

/// What hears one channel with the left ear and the next with the right, each with its weight.
fn one_pair(pair: usize, weights: [f32; 2]) -> AmbisonicHead {
    let mut filters = vec![0.0; 2 * AMBISONIC_CHANNELS];
    for (ear, weight) in weights.into_iter().enumerate() {
        filters[2 * (2 * pair + ear) + ear] = weight;
    }
    AmbisonicHead { sample_rate_hz: FLAT_RATE_HZ, lead: 0, filters }
}

impl AmbisonicHead {
    /// What both ears hear of each channel at a frequency, `[channel][ear]`.
    pub(crate) fn at(&self, hz: f64) -> [[Complex64; 2]; AMBISONIC_CHANNELS] {
        let step = Complex64::cis(-TAU * hz / self.sample_rate_hz);
        // Horner's rule, from the last sample on.
        let sum = |samples: &[f32]| samples.iter().rev().fold(Complex64::default(), |sum, x| sum * step + f64::from(*x));
        let filter = |channel: usize, ear: usize| sum(&self.filters[(2 * channel + ear) * self.len()..][..self.len()]);
        std::array::from_fn(|channel| [filter(channel, 0), filter(channel, 1)])
    }
}
