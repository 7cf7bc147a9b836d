//! Headphones as a project keeps them.

use promenade_core::headphones::Headphones;
use serde::{Deserialize, Serialize};

/// What the listener's headphones need, by content, and what they are called. By default nothing is done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedHeadphones {
    /// The file's name without its ending.
    pub name: String,
    /// What they need.
    pub headphones: Option<Headphones>,
}
