//! How much of a scene is played: accuracy against processor time.

use super::{AMBISONIC_CHANNELS, Scene};
use crate::decode::TURNS;
use crate::latency::EARLY_HOPS;
use crate::number::{single, whole};
use crate::render::late::network::LATE_HOPS;

/// Taps that every latency can be played with.
const FEWEST_TAPS: usize = EARLY_HOPS + LATE_HOPS;
/// The highest order of image sources.
const ORDER: usize = AMBISONIC_CHANNELS.isqrt() - 1;

/// How much of a scene is played. More than a scene has is all of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Setting {
    /// Explicit taps, at least the 11 that short latencies need. The late part begins where they end.
    pub taps: usize,
    /// Image sources, at least 1, the first of which are the strongest.
    pub images: usize,
    /// Ambisonic order in which image sources are heard, 0 to 3.
    pub order: usize,
    /// Times as many hops over which the time filters follow a listener who moves, 1 to [`Setting::SLOWEST`].
    pub refresh: usize,
    /// Whether waves have the bass; images and noise have it otherwise.
    pub waves: bool,
    /// Decodes a second of a scene that is decoded live; with 0 its table is played instead, where it has one.
    pub decodes: usize,
}

impl Setting {
    /// All of a scene.
    pub const ALL: Self =
        Self { taps: usize::MAX, images: usize::MAX, order: ORDER, refresh: 1, waves: true, decodes: usize::MAX };
    /// The slowest that time filters follow.
    pub const SLOWEST: usize = TURNS;

    /// The part of this setting that a scene has.
    #[must_use]
    pub fn of(self, scene: &Scene) -> Self {
        let parts = scene.parts();
        let (count, order) = parts.images.as_ref().map_or((0, 0), |images| (images.images.len(), images.head.order()));
        Self {
            taps: self.taps.max(FEWEST_TAPS).min(parts.taps),
            images: self.images.clamp(1, count.max(1)),
            order: self.order.min(order),
            refresh: self.refresh.clamp(parts.refresh, Self::SLOWEST),
            waves: self.waves && parts.bass.is_some(),
            decodes: self.decodes.max(usize::from(parts.field.is_none() || parts.cloud.is_none())).min(parts.decodes),
        }
    }
}

impl Default for Setting {
    fn default() -> Self {
        Self::ALL
    }
}

/// Declares the measures, each with its name.
macro_rules! measures {
    ($($(#[$doc:meta])* $measure:ident = $name:literal,)*) => {
        /// What renderings are told apart by.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Measure {
            $($(#[$doc])* $measure,)*
        }

        impl Measure {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$measure),*];

            /// What it is called.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$measure => $name,)*
                }
            }
        }
    };
}

measures! {
    /// Interaural time difference of a listener who stands.
    Itd = "ITD",
    /// Interaural level difference.
    Ild = "ILD",
    /// Reverberation time.
    T20 = "T20",
    /// Early decay time.
    Edt = "EDT",
    /// Clarity.
    C50 = "C50",
    /// Coherence of the ears.
    Coherence = "coherence",
    /// Levels in critical bands.
    Levels = "levels",
    /// Levels in critical bands over 100 ms, of a listener who walks and turns.
    MovingLevels = "moving levels",
    /// Interaural level difference over 100 ms.
    MovingIld = "moving ILD",
    /// Modulation of held tones while the head turns.
    Modulation = "modulation",
}

/// An error in differences that are just noticed, by the measure that has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Audible {
    /// Times what is just noticed, from 0 on.
    pub jnds: f32,
    /// Which measure.
    pub measure: Measure,
}

/// A setting of a scene, what it costs and how far it is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontPoint {
    /// What is played.
    pub setting: Setting,
    /// How far that is from all of the scene, at most at nine of ten poses.
    pub error: Audible,
    /// Operations over those of all of the scene, 0 to 1, of a listener who moves.
    pub cost: f32,
}

/// Numbers up to this one are exact in a file; larger ones stand for no limit.
const EXACT: usize = 1 << 24;

impl FrontPoint {
    /// The cheapest of some within an error, differences that are just noticed.
    #[must_use]
    pub fn within(front: &[Self], jnds: f32) -> Option<&Self> {
        front.iter().filter(|point| point.error.jnds <= jnds).min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Numbers that a file has of one.
    pub const NUMBERS: usize = 9;

    /// It as a file has it: `front.points` of a scene file.
    #[must_use]
    pub fn numbers(&self) -> [f32; Self::NUMBERS] {
        let Setting { taps, images, order, refresh, waves, decodes } = self.setting;
        let measure = Measure::ALL.iter().position(|measure| *measure == self.error.measure).unwrap_or_default();
        let counts = [taps, images, order, refresh, usize::from(waves), decodes, measure];
        let [taps, images, order, refresh, waves, decodes, measure] = counts.map(|count| single(count.min(EXACT) as f64));
        [taps, images, order, refresh, waves, decodes, self.error.jnds, measure, self.cost]
    }

    /// One that a file has; `None` for a measure that there is not.
    #[must_use]
    pub fn of_numbers(numbers: &[f32; Self::NUMBERS]) -> Option<Self> {
        let [taps, images, order, refresh, waves, decodes, measure] = [0, 1, 2, 3, 4, 5, 7].map(|n| {
            let count = whole(numbers[n].max(0.0).into());
            if count < EXACT { count } else { usize::MAX }
        });
        let setting = Setting { taps, images, order, refresh, waves: waves > 0, decodes };
        let error = Audible { jnds: numbers[6], measure: *Measure::ALL.get(measure)? };
        Some(Self { setting, error, cost: numbers[8] })
    }
}
