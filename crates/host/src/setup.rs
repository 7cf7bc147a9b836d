//! How an instance is played.

use crate::Fault;

/// More channels than any plugin has that is listened to.
const MOST_OUTPUTS: usize = 256;

/// More inputs than any plugin has that a track can be connected to.
const MOST_FURTHER: usize = 256;

/// How an instance is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Sample rate, hertz.
    pub rate: f64,
    /// The longest block, samples.
    pub block: usize,
    /// Channels of the track, 1 or 2. Where the plugin takes only the other number, a mono track feeds both of its inputs; two
    /// channels into one input are refused.
    pub inputs: usize,
    /// Mono tracks for the inputs after the main one, in their order: at most as many as the plugin has, and at most 256.
    pub further: usize,
    /// Channels that come out, 1 to 256: 2 are both ears, also where the plugin has one output. Any other number is asked of
    /// the plugin, and must be what it has then.
    pub outputs: usize,
    /// Offline instead of real-time processing.
    pub offline: bool,
    /// Tempo of the transport, quarter notes a minute. Without one, CLAP plugins get none and VST3 plugins 120.
    pub tempo: Option<f64>,
    /// Whether CLAP plugins are told that this host shows editors.
    pub editors: bool,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            rate: 48_000.0,
            block: 512,
            inputs: 2,
            further: 0,
            outputs: 2,
            offline: false,
            tempo: Some(120.0),
            editors: true,
        }
    }
}

impl Setup {
    /// Checks what is handed to plugins that may not.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        let wrong = |expected: &str, found: String| Err(Fault::unexpected(expected, found));
        if !(1.0..=10_000_000.0).contains(&self.rate) {
            return wrong("a sample rate of 1 to 10000000 Hz", format!("{} Hz", self.rate));
        }
        if !(1..=1 << 24).contains(&self.block) {
            return wrong("blocks of 1 to 16777216 samples", format!("{}", self.block));
        }
        if !(1..=2).contains(&self.inputs) {
            return wrong("a track of 1 or 2 channels", format!("{}", self.inputs));
        }
        if self.further > MOST_FURTHER {
            return wrong("at most 256 further tracks", format!("{}", self.further));
        }
        if !(1..=MOST_OUTPUTS).contains(&self.outputs) {
            return wrong("1 to 256 output channels", format!("{}", self.outputs));
        }
        match self.tempo {
            Some(tempo) if !(1.0..=10_000.0).contains(&tempo) => {
                wrong("a tempo of 1 to 10000 quarter notes a minute", format!("{tempo}"))
            }
            _ => Ok(()),
        }
    }
}

/// Where the transport is at the first sample of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Position {
    pub(crate) seconds: f64,
    pub(crate) samples: i64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_a_plugin_can_be_handed() {
        let good = Setup::default();
        assert!(good.check().is_ok());
        let bad = [
            Setup { rate: f64::NAN, ..good },
            Setup { rate: 0.0, ..good },
            Setup { block: 0, ..good },
            Setup { inputs: 3, ..good },
            Setup { outputs: 0, ..good },
            Setup { further: 257, ..good },
            Setup { tempo: Some(0.0), ..good },
        ];
        for setup in bad {
            assert!(setup.check().is_err_and(|error| error.to_string().starts_with("expected")), "{setup:?}");
        }
    }
}
