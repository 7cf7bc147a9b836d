//! Named points on the curve of speed against accuracy.

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
