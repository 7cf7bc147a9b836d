//! Why a setting has no figures.

use crate::measures::Unmeasurable;
use promenade_core::RenderError;
use promenade_fault::Fault;
use promenade_metrics::MetricError;
use thiserror::Error;

/// Why a setting has no figures.
#[derive(Debug, Error, PartialEq)]
pub enum JudgeError {
    /// It cannot be played at this rate.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A response of it has no measures.
    #[error("'{what}' cannot be measured")]
    Unmeasurable {
        /// Which response.
        what: String,
        /// Why.
        source: Unmeasurable,
    },
    /// What is heard while walking cannot be compared.
    #[error("noise that is heard while walking cannot be compared")]
    Walk(#[source] MetricError),
    /// The figures are no longer asked for.
    #[error("given up")]
    Unwanted,
}

impl From<JudgeError> for Fault {
    fn from(error: JudgeError) -> Self {
        Self::of(error)
    }
}
