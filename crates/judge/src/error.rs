//! Why a setting has no figures.

use crate::measures::Unmeasurable;
use promenade_core::RenderError;
use promenade_fault::Fault;
use thiserror::Error;

/// Why a setting has no figures.
#[derive(Debug, Error, PartialEq)]
pub enum JudgeError {
    /// It cannot be played at this rate.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A response of it has no measures.
    #[error("a response cannot be measured")]
    Unmeasurable(#[from] Unmeasurable),
    /// The figures are no longer asked for.
    #[error("given up")]
    Unwanted,
}

impl From<JudgeError> for Fault {
    fn from(error: JudgeError) -> Self {
        Self::of(error)
    }
}
