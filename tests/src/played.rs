//! Promenade in a host, for tests: parameters by the plugin's own ids, states as JSON, and a failed call a failed test.

use crate::bundle;
use promenade_host::{Bundle, Format, Instance, Setup};
use serde_json::Value;
use std::borrow::BorrowMut;
use std::path::Path;

/// Names of the plugins of many sources, with the further ones that each has at most.
const MANY: [(usize, &str); 2] = [(15, "Promenade Many"), (usize::MAX, "Promenade Many 64")];

/// A parameter as a host lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct Knob {
    /// Its number for the host.
    pub host_id: u32,
    /// Name.
    pub name: String,
    /// The default as text, with the unit.
    pub default: String,
    /// Whether the host may automate it.
    pub automatable: bool,
}

/// One running instance of the plugin in one format; the instance itself is there for everything else.
pub trait Host: Sized + From<Instance> + BorrowMut<Instance> {
    /// The format.
    const FORMAT: Format;

    /// The bundle that is tested.
    fn bundle() -> Bundle {
        let path = match Self::FORMAT {
            Format::Clap => bundle::clap(),
            Format::Vst3 => bundle::vst3(),
        };
        load(&path, Self::FORMAT)
    }

    /// Loads, activates and starts an instance.
    fn open(setup: Setup) -> Self {
        Self::bundle().open(setup).unwrap_or_else(|e| panic!("{e}")).into()
    }

    /// Loads, activates and starts an instance of the plugin of many sources, or of the one of most where the setup has further
    /// ones than that has, with a mono track on its main input.
    fn open_many(setup: Setup) -> Self {
        let bundle = Self::bundle();
        let name = MANY.into_iter().find_map(|(most, name)| (setup.further <= most).then_some(name)).unwrap_or_default();
        let many = bundle.find(name).unwrap_or_else(|e| panic!("{e}"));
        bundle.open_plugin(many, Setup { inputs: 1, ..setup }).unwrap_or_else(|e| panic!("{e}")).into()
    }

    /// The instance.
    fn instance(&mut self) -> &mut Instance {
        self.borrow_mut()
    }

    /// Stops and deactivates it, and starts it again with another setup of the same number of inputs.
    fn reopen(&mut self, setup: Setup) {
        self.instance().restart(setup).expect("the plugin starts again");
    }

    /// All parameters in the plugin's order.
    fn knobs(&mut self) -> Vec<Knob> {
        let knob = |p: &promenade_host::Parameter| Knob {
            host_id: p.id,
            name: p.name.clone(),
            default: p.default_text.clone(),
            automatable: p.automatable,
        };
        self.instance().parameters().iter().map(knob).collect()
    }

    /// Sets a parameter at a sample of the next block, 0 to 1.
    fn set_at(&mut self, id: &str, normalized: f64, offset: usize) {
        self.instance().set_at(host_id(id), normalized, offset).unwrap_or_else(|e| panic!("{id}: {e}"));
    }

    /// Sets a parameter at the start of the next block, 0 to 1.
    fn set(&mut self, id: &str, normalized: f64) {
        self.set_at(id, normalized, 0);
    }

    /// The value of a parameter, 0 to 1.
    fn value(&mut self, id: &str) -> f64 {
        self.instance().value(host_id(id)).unwrap_or_else(|e| panic!("{id}: {e}"))
    }

    /// Puts a running transport at a position, seconds; it then moves with the blocks.
    fn play_from(&mut self, seconds: f64) {
        self.instance().play_from(seconds);
    }

    /// Processes a block.
    fn process(&mut self, input: &[&[f32]]) -> [Vec<f32>; 2] {
        self.instance().process(input).expect("the plugin processes")
    }

    /// The reported latency, samples.
    fn latency(&mut self) -> usize {
        self.instance().latency().expect("the plugin has a latency")
    }

    /// The reported tail, samples.
    fn tail(&mut self) -> usize {
        self.instance().tail().expect("the tail ends")
    }

    /// The state as JSON text: CLAP puts the length before it, and the host of VST3 a header.
    fn save(&mut self) -> Vec<u8> {
        let bytes = self.instance().save().expect("the plugin saves");
        let start = bytes.windows(10).position(|w| w == b"{\"version\"").expect("the state is JSON");
        bytes[start..].to_vec()
    }

    /// Restores a state; says whether the plugin took it.
    fn load(&mut self, json: &[u8]) -> bool {
        let mut bytes = json.to_vec();
        if Self::FORMAT == Format::Clap {
            bytes.splice(..0, (json.len() as u64).to_le_bytes());
        }
        self.instance().load(&bytes).is_ok()
    }

    /// The state, parsed.
    fn state(&mut self) -> Value {
        serde_json::from_slice(&self.save()).expect("a saved state is JSON")
    }
}

fn load(path: &Path, format: Format) -> Bundle {
    // The library that cargo builds has no ending that tells.
    Bundle::load_as(path, format).unwrap_or_else(|e| panic!("{e}"))
}

macro_rules! played {
    ($name:ident, $format:expr, $doc:literal) => {
        #[doc = $doc]
        pub struct $name(Instance);

        impl Host for $name {
            const FORMAT: Format = $format;
        }

        impl From<Instance> for $name {
            fn from(instance: Instance) -> Self {
                Self(instance)
            }
        }

        impl std::borrow::Borrow<Instance> for $name {
            fn borrow(&self) -> &Instance {
                &self.0
            }
        }

        impl BorrowMut<Instance> for $name {
            fn borrow_mut(&mut self) -> &mut Instance {
                &mut self.0
            }
        }
    };
}

played!(ClapHost, Format::Clap, "A running CLAP instance.");
played!(Vst3, Format::Vst3, "A running VST3 instance.");

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
