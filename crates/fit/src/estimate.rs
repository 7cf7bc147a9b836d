//! What was found, and how sure that is.

/// A number with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// Whether the data say so, and not what was assumed before.
    pub determined: bool,
}
