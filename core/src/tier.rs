//! Speed against accuracy: named points on the curve, and how often poses are decoded.

/// Step of a hop by which the room and the published head fade when the tier changes.
pub(crate) const TIER_FADE_STEP: f32 = 0.125;

/// How much of a scene is rendered. Cost rises and error falls in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Tier {
    /// Masks and interaural delay only: direct sound, no room.
    Draft,
    /// Masks, delay and time filters.
    #[default]
    Standard,
    /// As `Standard`, masks from the scene's live decoder.
    High,
    /// As `High`, with the scene's convolution layers.
    Reference,
}

impl Tier {
    /// All tiers, cheapest first.
    pub const ALL: [Self; 4] = [Self::Draft, Self::Standard, Self::High, Self::Reference];

    /// The name used in files, on the command line and in the plugin.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Standard => "standard",
            Self::High => "high",
            Self::Reference => "reference",
        }
    }

    /// The tier of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }
}

/// How often poses are decoded while the listener moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiveParams {
    /// Decodes a second, above 0; answers are cross-faded over the time from one to the next.
    pub rate_hz: f32,
    /// Wait for every decode, as offline: the sound does not depend on the machine then.
    pub wait: bool,
}

impl Default for LiveParams {
    fn default() -> Self {
        Self { rate_hz: 40.0, wait: false }
    }
}

/// How well a stream is rendered.
///
/// Passed with each block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Point on the curve of speed against accuracy; one that the scene lacks is played as [`crate::Scene::played_tier`] says.
    pub tier: Tier,
    /// How often a live decoder is asked.
    pub live: LiveParams,
}

impl From<Tier> for Quality {
    fn from(tier: Tier) -> Self {
        Self { tier, ..Self::default() }
    }
}
