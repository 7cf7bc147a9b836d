//! The parameters of further sources, which instances of many sources have beside their own.

/// The most further sources of an instance.
pub const MOST_FURTHER: usize = 63;
/// The further sources of Promenade Many, which has fewer than Promenade Many 64.
pub const MANY_FURTHER: usize = 15;
/// Inputs of an instance with the most further sources, the main one first.
pub const MOST_INPUTS: usize = 1 + MOST_FURTHER;

/// What is set of a further source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// How far it is along x from the scene's emitter, metres.
    X,
    /// The same along y.
    Y,
    /// The same along z.
    Z,
    /// Its level, dB; the least is silence.
    Level,
}

impl Part {
    /// All of them, in the order of their parameters.
    pub const ALL: [Self; 4] = [Self::X, Self::Y, Self::Z, Self::Level];
}

/// A parameter of a further source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceKnob {
    /// The source, 0 for the first further one, below [`MOST_FURTHER`].
    pub further: usize,
    /// What of it.
    pub part: Part,
}

/// Ids and names of the parameters of each source; users count the first input's as 1.
macro_rules! names {
    ($($number:literal)*) => {
        const IDS: [[&str; Part::ALL.len()]; MOST_FURTHER] =
            [$([concat!("ex", $number), concat!("ey", $number), concat!("ez", $number), concat!("level", $number)],)*];
        const NAMES: [[&str; Part::ALL.len()]; MOST_FURTHER] = [$([
            concat!("Source ", $number, " Offset X"),
            concat!("Source ", $number, " Offset Y"),
            concat!("Source ", $number, " Offset Z"),
            concat!("Source ", $number, " Level"),
        ],)*];
        /// Names of the sources and of their inputs.
        pub const SOURCES: [&str; MOST_FURTHER] = [$(concat!("Source ", $number),)*];
    };
}

names!(
    2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32 33 34 35 36 37 38 39 40 41 42 43 44
    45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64
);

/// All of them, source by source.
pub const KNOBS: [SourceKnob; MOST_FURTHER * Part::ALL.len()] = {
    let mut knobs = [SourceKnob { further: 0, part: Part::X }; MOST_FURTHER * Part::ALL.len()];
    let mut number = 0;
    while number < knobs.len() {
        let (further, part) = (number / Part::ALL.len(), Part::ALL[number % Part::ALL.len()]);
        knobs[number] = SourceKnob { further, part };
        number += 1;
    }
    knobs
};

impl SourceKnob {
    /// Its number among [`KNOBS`].
    #[must_use]
    pub fn number(self) -> usize {
        self.further * Part::ALL.len() + self.part as usize
    }

    /// The id in saved states and in addresses of Open Sound Control; it never changes.
    #[must_use]
    pub fn id(self) -> &'static str {
        IDS[self.further][self.part as usize]
    }

    /// The name that hosts show.
    #[must_use]
    pub fn name(self) -> &'static str {
        NAMES[self.further][self.part as usize]
    }

    /// The name of the source.
    #[must_use]
    pub fn source(self) -> &'static str {
        SOURCES[self.further]
    }

    /// The plain value of a new instance, in which the sources stand in a row: by turns to the left and to the right of the
    /// emitter, half a metre apart.
    #[must_use]
    pub fn default_value(self) -> f32 {
        if self.part != Part::Y {
            return 0.0;
        }
        let (steps, side) = (self.further / 2 + 1, if self.further.is_multiple_of(2) { 0.5 } else { -0.5 });
        side * steps as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_stand_in_a_row_and_are_counted_from_two() {
        let of = |further, part| SourceKnob { further, part };
        let row: Vec<_> = (0..4).map(|further| of(further, Part::Y).default_value()).collect();
        assert_eq!(row, [0.5, -0.5, 1.0, -1.0]);
        assert_eq!((of(0, Part::X).id(), of(14, Part::Level).id()), ("ex2", "level16"));
        assert_eq!(of(MOST_FURTHER - 1, Part::Z).id(), "ez64");
        assert_eq!((of(1, Part::Z).name(), of(1, Part::Z).source()), ("Source 3 Offset Z", "Source 3"));
        for (number, knob) in KNOBS.into_iter().enumerate() {
            assert_eq!(knob.number(), number);
        }
    }
}
