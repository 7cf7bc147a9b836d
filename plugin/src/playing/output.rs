//! What comes out of the plugin: both ears, or Ambisonics.

use crate::parameter::source_knob::{MOST_FURTHER, SOURCES};
use nice_plug::prelude::{AudioIOLayout, PortNames};
use promenade_core::head::{channels, order_of};
use promenade_core::{AMBISONIC_CHANNELS, Emitters, Spatializer, ambisonic_dry};
use std::num::NonZeroU32;

/// Pairs of channels of the largest output.
const MOST_PAIRS: usize = AMBISONIC_CHANNELS / 2;

/// Layouts of channels that hosts are offered, the usual one first.
pub(crate) const LAYOUTS: &[AudioIOLayout] = &[
    layout(2, 2, "Stereo to binaural"),
    layout(1, 2, "Mono to binaural"),
    layout(2, 4, "Stereo to first-order Ambisonics"),
    layout(1, 4, "Mono to first-order Ambisonics"),
    layout(2, 9, "Stereo to second-order Ambisonics"),
    layout(1, 9, "Mono to second-order Ambisonics"),
    layout(2, 16, "Stereo to third-order Ambisonics"),
    layout(1, 16, "Mono to third-order Ambisonics"),
];

/// The layouts of instances with so many further sources: one mono input for each source.
pub(crate) const fn layouts_of_many(further: usize) -> [AudioIOLayout; 4] {
    const PORTS: &[NonZeroU32] = &[NonZeroU32::MIN; MOST_FURTHER];
    const NAMES: &[&str] = &SOURCES;
    let ((ports, _), (aux_inputs, _)) = (PORTS.split_at(further), NAMES.split_at(further));
    let mut layouts = [
        layout(1, 2, "Sources to binaural"),
        layout(1, 4, "Sources to first-order Ambisonics"),
        layout(1, 9, "Sources to second-order Ambisonics"),
        layout(1, 16, "Sources to third-order Ambisonics"),
    ];
    let mut number = 0;
    while number < layouts.len() {
        layouts[number].aux_input_ports = ports;
        layouts[number].names.aux_inputs = aux_inputs;
        number += 1;
    }
    layouts
}

const fn layout(inputs: u32, outputs: u32, name: &'static str) -> AudioIOLayout {
    AudioIOLayout {
        main_input_channels: NonZeroU32::new(inputs),
        main_output_channels: NonZeroU32::new(outputs),
        names: PortNames { layout: Some(name), ..PortNames::const_default() },
        ..AudioIOLayout::const_default()
    }
}

/// What comes out of an instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Output {
    /// Both ears.
    #[default]
    Binaural,
    /// AmbiX of an order, 1 to 3: all channels in ACN order, SN3D, in the axes of the listener's head.
    Ambisonic(usize),
}

impl Output {
    /// That of so many channels.
    pub fn of_channels(count: usize) -> Self {
        order_of(count).map_or(Self::Binaural, Self::Ambisonic)
    }

    /// Pairs of channels that are rendered; of an odd number the last pair's second channel goes nowhere.
    pub fn pairs(self) -> usize {
        match self {
            Self::Binaural => 1,
            Self::Ambisonic(order) => channels(order).div_ceil(2).min(MOST_PAIRS),
        }
    }

    /// Plays nothing yet: a spatializer for each pair.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn spatializers(self, sample_rate_hz: f64) -> Vec<Spatializer> {
        let one = |pair| match self {
            Self::Binaural => Spatializer::new(sample_rate_hz),
            Self::Ambisonic(_) => Spatializer::new(sample_rate_hz).with_dry(ambisonic_dry(pair)),
        };
        (0..self.pairs()).map(one).collect()
    }
}

/// What renders a scene, one for each pair of output channels, and whether it is faded in when its room sounds. It moves
/// without an allocation.
#[derive(Default)]
pub struct Pairs([Option<Box<Emitters>>; MOST_PAIRS], bool);

impl Pairs {
    /// Begins to play them in the place of others, if as many spatializers take them.
    ///
    /// # Errors
    /// They come back while one of them fades or holds what was retired.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn swap_into(mut self, spatializers: &mut [Spatializer]) -> Result<(), Self> {
        if spatializers.len() != self.count() || !spatializers.iter().all(Spatializer::is_free) {
            return Err(self);
        }
        for (place, spatializer) in self.0.iter_mut().zip(spatializers) {
            let swap = if self.1 { Spatializer::swap_in_sounding } else { Spatializer::swap_in };
            *place = place.take().and_then(|emitters| swap(spatializer, emitters).err());
        }
        if self.count() == 0 { Ok(()) } else { Err(self) }
    }

    /// Plays them from now on, without a fade.
    ///
    /// # Real-time
    /// Not real-time safe: drops what was played.
    pub fn install(self, spatializers: &mut [Spatializer]) {
        for (emitters, spatializer) in self.0.into_iter().flatten().zip(spatializers) {
            spatializer.install(emitters);
        }
    }

    /// Lets them be faded in when their room sounds: they are another setting of the place that is played.
    pub fn fade_in_sounding(&mut self) {
        self.1 = true;
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.iter().flatten().count()
    }

    /// The first of them.
    pub fn first(&self) -> Option<&Emitters> {
        self.0[0].as_deref()
    }
}

impl FromIterator<Emitters> for Pairs {
    /// # Panics
    /// There are more than the largest output has.
    fn from_iter<I: IntoIterator<Item = Emitters>>(all: I) -> Self {
        let mut pairs = Self::default();
        for (pair, emitters) in all.into_iter().enumerate() {
            pairs.0[pair] = Some(Box::new(emitters));
        }
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_layout_has_its_output() {
        let outputs: Vec<_> = LAYOUTS
            .iter()
            .filter_map(|layout| layout.main_output_channels)
            .map(|count| Output::of_channels(count.get() as usize))
            .collect();
        let expected =
            [0, 0, 1, 1, 2, 2, 3, 3].map(|order| if order == 0 { Output::Binaural } else { Output::Ambisonic(order) });
        assert_eq!(outputs, expected);
        for (layout, [_, of_mono]) in layouts_of_many(3).iter().zip(LAYOUTS.as_chunks().0) {
            assert_eq!(layout.main_input_channels, of_mono.main_input_channels);
            assert_eq!(layout.main_output_channels, of_mono.main_output_channels);
            assert_eq!((layout.aux_input_ports.len(), layout.names.aux_inputs), (3, &SOURCES[..3]));
        }
        assert_eq!([1, 2, 3].map(|order| Output::Ambisonic(order).pairs()), [2, 5, 8]);
    }
}
