//! Values that a host sets, each at its sample of a block.
//!
//! The framework would post a task for each of them, whether an editor is open or not: to a thread that all instances share, or
//! to the host's main thread. So it is handed their places only, where it splits the block, and they reach the parameters here.

use crate::parameter::Parameter;
use crate::project::{params::PromenadeParams, state::saved_value};
use crate::worker::{lock::try_lock, repaint::Repaint};
use nice_plug::plugin::ParamValue;
use nice_plug::prelude::{Param, ParamPtr};
use nice_plug::util::permit_alloc;
use std::sync::{Arc, Mutex};

/// Changes of one block that are taken without an allocation; as many as in the framework.
const USUAL: usize = 1024;
/// A number that no parameter has: theirs are below it.
pub(crate) const NO_PARAMETER: u32 = 1 << 31;

/// The number by which hosts know a parameter, as the framework makes it of the id.
pub(crate) fn host_id(id: &str) -> u32 {
    id.bytes().fold(0_u32, |hash, byte| hash.wrapping_mul(31).wrapping_add(u32::from(byte))) & !NO_PARAMETER
}

/// What a host does to a parameter, as a share of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Change {
    /// Another value.
    Value(f32),
    /// Another distance from the value.
    Modulation(f32),
}

/// A parameter as hosts and the framework know it.
struct Known {
    host_id: u32,
    /// None for the revision, which is no parameter of a user's.
    parameter: Option<Parameter>,
    pointer: ParamPtr,
}

/// The host's way to an instance's parameters. An empty one knows none.
#[derive(Default)]
pub(crate) struct HostValues {
    /// By their numbers.
    known: Vec<Known>,
    /// The owner of what the pointers lead to.
    params: Option<Arc<PromenadeParams>>,
    repaint: Repaint,
    block: Mutex<Block>,
}

/// What has arrived with a stretch of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Arrived {
    /// Where the stretch begins in its block, samples.
    pub(crate) at: usize,
    /// Whether anything changes at its beginning.
    pub(crate) any: bool,
    /// Whether anything in its block has a sample of its own, and does not come with the first one.
    pub(crate) is_placed: bool,
}

/// The changes of a block.
#[derive(Default)]
struct Block {
    /// In order.
    changes: Vec<(u32, ParamPtr, Change)>,
    /// How many have been made.
    made: usize,
    /// Where the next stretch of it begins, samples.
    at: usize,
}

impl HostValues {
    /// Of an instance with these parameters.
    pub(crate) fn new(params: Arc<PromenadeParams>, repaint: Repaint) -> Self {
        let of = |p: Parameter| Known { host_id: host_id(p.id()), parameter: Some(p), pointer: params.of(p).as_ptr() };
        let mut known: Vec<_> = params.parameters().map(of).collect();
        known.push(Known { host_id: host_id("revision"), parameter: None, pointer: params.revision.as_ptr() });
        known.sort_by_key(|known| known.host_id);
        let block = Mutex::new(Block { changes: Vec::with_capacity(USUAL), ..Block::default() });
        Self { known, params: Some(params), repaint, block }
    }

    fn find(&self, host_id: u32) -> Option<&Known> {
        let place = self.known.binary_search_by_key(&host_id, |known| known.host_id).ok()?;
        Some(&self.known[place])
    }

    /// The value that a parameter of a number has when it is set to a share of its range.
    pub(crate) fn landed(&self, host_id: u32, share: f32) -> Option<f32> {
        let parameter = self.find(host_id)?.parameter;
        let params = self.params.as_ref()?;
        Some(parameter.map_or(share, |parameter| params.of(parameter).landed(share)))
    }

    /// Has an open editor show that values have changed.
    pub(crate) fn show(&self) {
        self.repaint.request_repaint();
    }

    /// Changes a parameter at once, on any thread. An unknown one and a value that is no number change nothing.
    pub(crate) fn change(&self, host_id: u32, change: Change) {
        if let Some(known) = self.find(host_id) {
            make(known.pointer, change);
            self.show();
        }
    }

    /// Steps of a discrete parameter between its ends, in which CLAP counts; 1 for others.
    #[expect(unsafe_code, reason = "the framework's parameters are pointers")]
    pub(crate) fn steps(&self, host_id: u32) -> f32 {
        // SAFETY: its owner is held.
        let steps = self.find(host_id).and_then(|known| unsafe { known.pointer.step_count() });
        steps.map_or(1.0, |steps| steps as f32)
    }

    /// How a parameter is saved in a state when it is set to a share of its range, with its id.
    pub(crate) fn saved(&self, host_id: u32, share: f32) -> Option<(&'static str, ParamValue)> {
        let (parameter, params) = (self.find(host_id)?.parameter?, self.params.as_ref()?);
        Some((parameter.id(), saved_value(parameter, params.of(parameter).plain_at(share))))
    }

    /// Begins a block of so many samples, with its changes in any order: sample, number and change.
    ///
    /// # Real-time
    /// Audio thread; no lock or I/O, and no allocation up to the usual number of changes.
    pub(crate) fn begin(&self, samples: u32, changes: impl Iterator<Item = (u32, u32, Change)>) {
        let Some(mut block) = try_lock(&self.block) else { return };
        block.forget();
        for (sample, host_id, change) in changes {
            let Some(known) = self.find(host_id) else { continue };
            let sample = sample.min(samples.saturating_sub(1));
            let place = block.changes.partition_point(|(other, ..)| *other <= sample);
            permit_alloc(|| block.changes.insert(place, (sample, known.pointer, change)));
        }
        if !block.changes.is_empty() {
            self.show();
        }
    }

    /// Sample of a change of the block, by its place among them.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn sample(&self, place: usize) -> Option<u32> {
        try_lock(&self.block)?.changes.get(place).map(|(sample, ..)| *sample)
    }

    /// Changes of the block.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn count(&self) -> usize {
        try_lock(&self.block).map_or(0, |block| block.changes.len())
    }

    /// Makes the changes at the beginning of the block's next stretch, which has so many samples, and says what they are.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn advance(&self, samples: usize) -> Arrived {
        let Some(mut block) = try_lock(&self.block) else { return Arrived::default() };
        let (at, made) = (block.at, block.made);
        block.make_until(|sample| sample as usize <= at);
        block.at += samples;
        let is_placed = block.changes.last().is_some_and(|(sample, ..)| *sample > 0);
        Arrived { at, any: block.made > made, is_placed }
    }

    /// Ends the block: makes what changes are left, also where none of it was played.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn end(&self) {
        if let Some(mut block) = try_lock(&self.block) {
            block.make_until(|_| true);
            block.forget();
        }
    }
}

impl Block {
    fn make_until(&mut self, is_due: impl Fn(u32) -> bool) {
        for (_, pointer, change) in self.changes[self.made..].iter().take_while(|(sample, ..)| is_due(*sample)) {
            make(*pointer, *change);
            self.made += 1;
        }
    }

    fn forget(&mut self) {
        self.changes.clear();
        (self.made, self.at) = (0, 0);
    }
}

#[expect(unsafe_code, reason = "the framework's parameters are pointers")]
fn make(pointer: ParamPtr, change: Change) {
    // SAFETY: whoever holds the pointer holds its owner.
    unsafe {
        match change {
            Change::Value(share) if share.is_finite() => pointer._internal_set_normalized_value(share),
            Change::Modulation(share) if share.is_finite() => pointer._internal_modulate_value(share),
            _ => false,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::source_knob::MOST_FURTHER;

    fn instance() -> (Arc<PromenadeParams>, HostValues, Repaint) {
        let (params, repaint) = (Arc::new(PromenadeParams::default().with_further(MOST_FURTHER)), Repaint::default());
        (Arc::clone(&params), HostValues::new(params, repaint.clone()), repaint)
    }

    #[test]
    fn each_change_of_a_block_is_made_at_its_sample() {
        let (params, values, repaint) = instance();
        let x = || params.of(Parameter::X).shares()[0];
        let begun = x();
        let at = |sample, share| (sample, host_id("x"), Change::Value(share));
        values
            .begin(512, [at(100, 0.25), at(0, 0.75), at(9999, 1.0), at(200, f32::NAN), (0, 7, Change::Value(0.0))].into_iter());
        assert!(repaint.take());
        assert_eq!([0, 1, 2, 3, 4].map(|place| values.sample(place)), [Some(0), Some(100), Some(200), Some(511), None]);
        assert_eq!(x(), begun, "nothing is made before the block is played");
        let heard = [100, 100, 311, 1].map(|samples| {
            let arrived = values.advance(samples);
            assert!(arrived.any && arrived.is_placed, "{arrived:?}");
            x()
        });
        assert_eq!(heard, [0.75, 0.25, 0.25, 1.0]);
        assert!(!values.advance(1).any);
        values.begin(512, [at(0, 0.5)].into_iter());
        assert_eq!(values.advance(512), Arrived { at: 0, any: true, is_placed: false });
        values.begin(0, [at(0, 0.5)].into_iter());
        values.end();
        assert_eq!((x(), values.count()), (0.5, 0), "without samples too");
    }

    #[test]
    fn modulation_is_put_on_top_of_a_value() {
        let (params, values, _) = instance();
        values.change(host_id("gain"), Change::Value(0.5));
        values.change(host_id("gain"), Change::Modulation(0.25));
        let gain = params.of(Parameter::Gain).shares();
        assert!((gain[0] - 0.5).abs() < 1e-6 && (gain[1] - 0.75).abs() < 1e-6, "{gain:?}");
    }

    #[test]
    fn what_a_value_will_be_is_what_it_is_then_and_how_it_is_saved() {
        let (params, values, _) = instance();
        for parameter in Parameter::EVERY {
            for share in [0.0, 0.123, 0.5, 0.77, 1.0] {
                let id = host_id(parameter.id());
                let landed = values.landed(id, share);
                let (name, saved) = values.saved(id, share).unwrap();
                values.change(id, Change::Value(share));
                let [now, _] = params.of(parameter).shares();
                assert_eq!((landed, name), (Some(now), parameter.id()));
                assert_eq!(format!("{saved:?}"), format!("{:?}", values.saved(id, now).unwrap().1));
            }
        }
        assert_eq!(values.landed(7, 0.5), None);
    }
}
