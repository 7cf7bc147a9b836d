//! The inputs of further sources, as the framework takes them. It looks for no more of them than there are outputs, takes every
//! pointer that a host has for granted, and writes to the outputs before it reads them, though many hosts use one buffer for
//! both.

use crate::export::silence;
use crate::parameter::source_knob::MOST_INPUTS;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{AudioBusBuffers, AudioBusBuffers__type0, ProcessData};

/// Room for inputs whose buffers are outputs too.
pub(super) struct Aside {
    samples: Vec<f32>,
    /// Inputs, the main one too.
    inputs: usize,
    /// Samples for each input.
    longest: usize,
}

impl Aside {
    /// For a plugin of so many inputs, the main one and [`MOST_INPUTS`] at most, and no block yet.
    pub(super) fn new(inputs: usize) -> Self {
        Self { samples: Vec::new(), inputs: inputs.min(MOST_INPUTS), longest: 0 }
    }

    /// Makes room for blocks of up to so many samples.
    pub(super) fn resize(&mut self, longest: i32) {
        self.longest = usize::try_from(longest).unwrap_or(0);
        self.samples.resize(self.longest * self.inputs, 0.0);
    }
}

/// The inputs of a block.
pub(super) struct Buses {
    /// Of which there are so many.
    count: usize,
    all: [AudioBusBuffers; MOST_INPUTS],
    /// Where each one's only channel is, for those that lie aside.
    channels: [*mut f32; MOST_INPUTS],
}

impl Buses {
    /// Those of a block; what the host does not feed is silent.
    ///
    /// # Safety
    /// The block is as hosts hand it over.
    pub(super) unsafe fn of(block: &ProcessData, aside: &mut Aside) -> Self {
        let samples = usize::try_from(block.numSamples).unwrap_or(0);
        let silent = mono(silence::channel(samples));
        let none = [std::ptr::null_mut(); MOST_INPUTS];
        let mut buses = Self { count: aside.inputs, all: [silent; MOST_INPUTS], channels: none };
        let count = if block.inputs.is_null() { 0 } else { usize::try_from(block.numInputs).unwrap_or(0) };
        let rooms = aside.samples.chunks_exact_mut(aside.longest.max(1));
        for (number, room) in rooms.enumerate().take(count.min(aside.inputs)) {
            // SAFETY: there are so many inputs, each with a list of so many channels or without one, and each channel has the
            // samples of the block.
            unsafe {
                let theirs = *block.inputs.add(number);
                let list = theirs.__field0.channelBuffers32;
                if theirs.numChannels <= 0 || list.is_null() || (*list).is_null() {
                    continue;
                }
                // Of more channels than one the framework takes the first.
                buses.all[number] = AudioBusBuffers { numChannels: 1, ..theirs };
                if number > 0 && samples <= room.len() && is_output(block, *list) {
                    room[..samples].copy_from_slice(std::slice::from_raw_parts(*list, samples));
                    buses.channels[number] = room.as_mut_ptr();
                }
            }
        }
        buses
    }

    /// The block with these inputs. It must not be used after them.
    pub(super) fn handed_on(&mut self, block: &ProcessData) -> ProcessData {
        for (bus, channel) in self.all[..self.count].iter_mut().zip(&mut self.channels) {
            if !channel.is_null() {
                *bus = mono(channel);
            }
        }
        let most = i32::try_from(self.count).unwrap_or(0);
        // The framework compares the numbers of inputs with that of outputs; without any the block is one of values alone.
        let outputs = if block.numOutputs > 0 { block.numOutputs.max(most) } else { block.numOutputs };
        ProcessData { numInputs: most, inputs: self.all.as_mut_ptr(), numOutputs: outputs, ..*block }
    }
}

fn mono(channel: *mut *mut f32) -> AudioBusBuffers {
    let channels = i32::from(!channel.is_null());
    AudioBusBuffers { numChannels: channels, silenceFlags: 0, __field0: AudioBusBuffers__type0 { channelBuffers32: channel } }
}

/// Whether a channel is one of the main output too.
///
/// # Safety
/// The block is as hosts hand it over.
unsafe fn is_output(block: &ProcessData, channel: *mut f32) -> bool {
    if block.numOutputs <= 0 {
        return false;
    }
    // SAFETY: there is an output, with a list of so many channels or without one.
    unsafe {
        let Some(main) = block.outputs.as_ref() else { return false };
        let list = main.__field0.channelBuffers32;
        let count = if list.is_null() { 0 } else { usize::try_from(main.numChannels).unwrap_or(0) };
        (0..count).any(|output| *list.add(output) == channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bus of the first channel of a list.
    fn bus(list: &mut [*mut f32]) -> AudioBusBuffers {
        let channels = i32::try_from(list.len()).unwrap();
        AudioBusBuffers {
            numChannels: channels,
            silenceFlags: 0,
            __field0: AudioBusBuffers__type0 { channelBuffers32: list.as_mut_ptr() },
        }
    }

    #[test]
    fn inputs_that_are_outputs_lie_aside_and_others_are_silent() {
        let mut sound = [[1.0_f32; 4], [2.0; 4], [3.0; 4]];
        let [left, right, third] = sound.each_mut().map(|channel| channel.as_mut_ptr());
        let (mut main, mut second, mut stereo, mut lost) = ([left], [right], [third, third], [std::ptr::null_mut::<f32>()]);
        let mut ears = [left, right];
        let mut inputs = [bus(&mut main), bus(&mut second), bus(&mut stereo), bus(&mut lost)];
        let mut outputs = [bus(&mut ears)];
        // SAFETY: all zeros are a block without anything.
        let mut block: ProcessData = unsafe { std::mem::zeroed() };
        (block.numSamples, block.numInputs, block.numOutputs) = (4, 4, 1);
        (block.inputs, block.outputs) = (inputs.as_mut_ptr(), outputs.as_mut_ptr());
        let mut aside = Aside::new(16);
        aside.resize(4);
        // SAFETY: everything that the block points to is alive.
        let heard = unsafe {
            let mut buses = Buses::of(&block, &mut aside);
            let block = buses.handed_on(&block);
            assert_eq!((block.numInputs, block.numOutputs), (16, 16));
            // As the framework does.
            std::slice::from_raw_parts_mut(right, 4).fill(0.0);
            let all = std::slice::from_raw_parts(block.inputs, 16);
            all.iter().map(|bus| (bus.numChannels, **bus.__field0.channelBuffers32)).collect::<Vec<_>>()
        };
        assert_eq!(heard[..5], [(1, 1.0), (1, 2.0), (1, 3.0), (1, 0.0), (1, 0.0)]);
    }
}
