//! Instances under a host without manners: each call by itself, in any order, on any thread, and let go of at any time.
//!
//! Such a host has no safe interface, so the interfaces of the formats are called here as they are.

mod clap;
mod vst3;

pub use clap::BareClap;
pub use vst3::{BareVst3, Part};

use crate::signal::noise;

/// A change of a parameter in a block: its number, the sample, and the value from 0 to 1.
pub type Change = (u32, u32, f64);

/// Samples a second of all of them.
pub const RATE: f64 = 48_000.0;
/// Samples of each block.
pub const BLOCK: usize = 512;

/// Which plugin an instance is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plugin {
    /// Promenade, with a stereo input.
    One,
    /// Promenade Many; its first three inputs are fed.
    Many,
}

impl Plugin {
    /// Channels that are fed, and those of each input.
    fn channels(self) -> (usize, usize) {
        match self {
            Self::One => (2, 2),
            Self::Many => (3, 1),
        }
    }
}

/// One instance. Nothing is done when it is dropped but that its references are given back.
pub trait Bare: Send + Sized {
    /// Makes one.
    fn make(plugin: Plugin) -> Self;

    /// Tells the rate and activates it, or activates it again.
    fn activate(&mut self);

    /// Deactivates it.
    fn deactivate(&mut self);

    /// Says that blocks come, or come no more.
    fn play(&mut self, plays: bool);

    /// Plays a block, the same on each channel that is fed, into left and right.
    fn block(&mut self, input: &[f32], changes: &[Change]) -> [Vec<f32>; 2];

    /// Sets a value beside any block: on the controller, or by a flush.
    fn set(&mut self, id: u32, value: f64);

    /// A value as the plugin reports it.
    fn value(&mut self, id: u32) -> f64;

    /// The numbers of its parameters.
    fn ids(&mut self) -> Vec<u32>;

    /// The saved state.
    fn save(&mut self) -> Vec<u8>;

    /// Restores a state.
    fn load(&mut self, state: &[u8]);

    /// How often the plugin has told its host anything, or asked it for a call.
    fn told(&self) -> usize;

    /// A block of noise with so many changes of a parameter, all of them different.
    fn busy_block(&mut self, id: u32, changes: u32) {
        let change = |number: u32| (id, number % BLOCK as u32, f64::from(number + 1) / f64::from(changes + 2));
        self.block(&noise(BLOCK), &(0..changes).map(change).collect::<Vec<_>>());
    }
}
