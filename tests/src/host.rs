//! What the tests ask of a host, whatever the format.

use serde_json::Value;

/// How an instance is opened.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// Sample rate, Hz.
    pub rate: f64,
    /// The largest block, samples.
    pub block: usize,
    /// Input channels, 1 or 2.
    pub inputs: usize,
    /// Offline instead of real-time processing.
    pub offline: bool,
}

impl Default for Setup {
    fn default() -> Self {
        Self { rate: 48_000.0, block: 512, inputs: 2, offline: false }
    }
}

/// A parameter as a host lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct Knob {
    /// The number by which the host knows it.
    pub host_id: u32,
    /// Name.
    pub name: String,
    /// The default as text, with the unit.
    pub default: String,
    /// Whether the host may automate it.
    pub automatable: bool,
}

/// One running instance of the plugin.
pub trait Host: Sized {
    /// Name of the format.
    const FORMAT: &'static str;

    /// Loads, activates and starts an instance.
    fn open(setup: Setup) -> Self;

    /// Stops and deactivates it, and starts it again with another setup of the same number of inputs.
    fn reopen(&mut self, setup: Setup);

    /// All parameters in the plugin's order.
    fn knobs(&mut self) -> Vec<Knob>;

    /// Sets a parameter at a sample of the next block, 0 to 1.
    fn set_at(&mut self, id: &str, normalized: f64, offset: usize);

    /// The value of a parameter, 0 to 1.
    fn value(&mut self, id: &str) -> f64;

    /// Puts a running transport at a position, seconds; it then moves with the blocks.
    fn play_from(&mut self, seconds: f64);

    /// Processes a block.
    fn process(&mut self, input: &[&[f32]]) -> [Vec<f32>; 2];

    /// The reported latency, samples.
    fn latency(&mut self) -> usize;

    /// The state as JSON text.
    fn save(&mut self) -> Vec<u8>;

    /// Restores a state; says whether the plugin took it.
    fn load(&mut self, json: &[u8]) -> bool;

    /// Sets a parameter at the start of the next block, 0 to 1.
    fn set(&mut self, id: &str, normalized: f64) {
        self.set_at(id, normalized, 0);
    }

    /// The state, parsed.
    fn state(&mut self) -> Value {
        serde_json::from_slice(&self.save()).expect("a saved state is JSON")
    }
}

/// The number that stands for a parameter id in both formats.
#[must_use]
pub fn host_id(id: &str) -> u32 {
    id.bytes().fold(0_u32, |hash, byte| hash.wrapping_mul(31).wrapping_add(u32::from(byte))) & !(1 << 31)
}

/// Processes a signal in blocks whose sizes come from `sizes` in turn.
pub fn render<H: Host>(host: &mut H, input: &[&[f32]], sizes: &[usize]) -> [Vec<f32>; 2] {
    let len = input[0].len();
    let mut out = [Vec::with_capacity(len), Vec::with_capacity(len)];
    let (mut at, mut turn) = (0, 0);
    while at < len {
        let n = sizes[turn % sizes.len()].min(len - at);
        let block = input.iter().map(|channel| &channel[at..at + n]).collect::<Vec<_>>();
        for (all, new) in out.iter_mut().zip(host.process(&block)) {
            all.extend(new);
        }
        at += n;
        turn += 1;
    }
    out
}

/// A saved state with one of its fields replaced; fields are JSON within JSON.
#[must_use]
pub fn edit_state(state: &Value, field: &str, value: &Value) -> Vec<u8> {
    let mut state = state.clone();
    state["fields"][field] = Value::String(value.to_string());
    state.to_string().into_bytes()
}
