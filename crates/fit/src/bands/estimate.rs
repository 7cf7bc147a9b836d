//! A number that was found, and how sure that is; shares of 1 as logits.

use serde::Serialize;

/// A number with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// Whether the data say so, and not what was assumed before.
    pub determined: bool,
}

impl Estimate {
    /// A number that is stated.
    pub(crate) fn stated(value: f64) -> Self {
        Self { value, error: 0.0, determined: true }
    }

    /// A share of 1, of its logit and the standard error of that.
    pub(crate) fn of_logit(logit: f64, error: f64, determined: bool) -> Self {
        let value = logistic(logit);
        Self { value, error: error * value * (1.0 - value), determined }
    }
}

pub(crate) fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// The logit of a share, which is held off 0 and 1 by 1e-4.
pub(crate) fn logit(p: f64) -> f64 {
    let p = p.clamp(1e-4, 1.0 - 1e-4);
    (p / (1.0 - p)).ln()
}
