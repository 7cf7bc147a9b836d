//! The parameters of further sources, which instances of many sources have beside their own.

use crate::parameter::row::{AWAY, LEVEL, METRES, QUARTER, Row, TURN};

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
    /// How far it is along y from the scene's emitter, metres.
    Y,
    /// How far it is along z from the scene's emitter, metres.
    Z,
    /// Its level, dB; the least is silence.
    Level,
    /// Its azimuth from where the scene's listener starts, degrees, positive to the left.
    Azimuth,
    /// Its elevation, degrees.
    Elevation,
    /// Its distance, metres.
    Distance,
}

impl Part {
    /// All of them, in the order of their parameters.
    pub const ALL: [Self; 7] = [Self::X, Self::Y, Self::Z, Self::Level, Self::Azimuth, Self::Elevation, Self::Distance];
}

/// A parameter of a further source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceKnob {
    /// The source, 0 for the first further one, below [`MOST_FURTHER`].
    pub further: usize,
    /// What of it.
    pub part: Part,
}

/// A row of a source, which users count from 1.
macro_rules! row {
    ($n:literal, $id:literal, $name:literal, $values:expr, $default:expr, $label:literal, $help:literal) => {
        Row {
            id: concat!($id, $n),
            name: concat!("Source ", $n, $name),
            module: concat!("Source ", $n),
            values: $values,
            default: $default,
            label: $label,
            help: $help,
        }
    };
}

/// Rows of the parameters of each source, and the sources' names.
macro_rules! sources {
    ($($number:literal)*) => {
        static ROWS: [[Row; Part::ALL.len()]; MOST_FURTHER] = [$([
            row!($number, "ex", " Offset X", METRES, at_first($number).0, "x",
                "Moves this source ahead from the place of the scene's source"),
            row!($number, "ey", " Offset Y", METRES, at_first($number).1, "y",
                "Moves this source to the left from the place of the scene's source"),
            row!($number, "ez", " Offset Z", METRES, 0.0, "z", "Moves this source up from the place of the scene's source"),
            row!($number, "level", " Level", LEVEL, 0.0, "Level",
                "How loud this source's input is taken; all the way down it is silent"),
            row!($number, "azimuth", " Azimuth", TURN, at_first_polar($number).0, "Azimuth",
                "Direction of this source from where the scene's listener starts, positive to the left"),
            row!($number, "elevation", " Elevation", QUARTER, 0.0, "Elevation",
                "Angle of this source above where the scene's listener starts"),
            row!($number, "distance", " Distance", AWAY, at_first_polar($number).1, "Distance",
                "Distance of this source from where the scene's listener starts"),
        ],)*];
        /// Names of the sources and of their inputs.
        pub const SOURCES: [&str; MOST_FURTHER] = [$(concat!("Source ", $number),)*];
    };
}

/// How far the sources of an arc about a listener 1.5 m behind the emitter are from it along x and y, metres: 11.25 degrees
/// apart.
const ARC: [(f32, f32); 8] =
    [(-0.03, 0.29), (-0.11, 0.57), (-0.25, 0.83), (-0.44, 1.06), (-0.67, 1.25), (-0.93, 1.39), (-1.21, 1.47), (-1.5, 1.5)];

/// Where a source of this number stands along x and y at first, metres from the emitter: by turns to the left and to the right,
/// on an arc before the listener, then in rows of eight behind. All stand within the loft that a new instance plays.
const fn at_first(number: usize) -> (f32, f32) {
    let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    if number < 2 * ARC.len() + 2 {
        let (x, y) = ARC[number / 2 - 1];
        return (x, side * y);
    }
    let beyond = number - 2 * ARC.len() - 2;
    (-2.7 - 0.8 * (beyond / 8) as f32, side * 0.5 * (1 + beyond % 8 / 2) as f32)
}

/// Its azimuth and distance at first, degrees and metres, by turns to the left and to the right: on an arc, then on rings
/// behind where the listener starts; all in the loft, too.
const fn at_first_polar(number: usize) -> (f32, f32) {
    let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    match number.checked_sub(2 * ARC.len() + 2) {
        None => (side * 11.25 * (number / 2) as f32, 1.25),
        Some(beyond) => (side * (101.25 + 10.0 * (beyond % 16 / 2) as f32), 1.5 + 0.45 * (beyond / 16) as f32),
    }
}

sources!(
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
    pub fn number(self) -> usize {
        self.further * Part::ALL.len() + self.part as usize
    }

    /// What there is to know about it.
    pub(super) fn row(self) -> &'static Row {
        &ROWS[self.further][self.part as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_stand_apart_within_the_loft_and_are_counted_from_two() {
        let of = |further, part| SourceKnob { further, part }.row();
        let at = |further| [Part::X, Part::Y].map(|part| of(further, part).default);
        assert_eq!([at(0), at(1), at(15), at(16)], [[-0.03, 0.29], [-0.03, -0.29], [-1.5, -1.5], [-2.7, 0.5]]);
        // The walls of `loft.obj` about its emitter at (1.5, 0), on this side of its corner.
        let inside = |[x, y]: [f32; 2]| (-7.6..1.4).contains(&x) && (-2.6..2.4).contains(&y);
        for further in 0..MOST_FURTHER {
            let [x, y] = at(further);
            assert!(inside([x, y]), "source {} is outside: {x}, {y}", further + 2);
            let near = |other: &usize| (at(*other)[0] - x).hypot(at(*other)[1] - y) < 0.25;
            assert!(!(0..further).any(|other| near(&other)), "source {} is on another", further + 2);
        }
        assert_eq!((of(0, Part::X).id, of(14, Part::Level).id), ("ex2", "level16"));
        assert_eq!(of(MOST_FURTHER - 1, Part::Z).id, "ez64");
        assert_eq!((of(1, Part::Z).name, of(1, Part::Z).module), ("Source 3 Offset Z", SOURCES[1]));
        for (number, knob) in KNOBS.into_iter().enumerate() {
            assert_eq!(knob.number(), number);
        }
    }
}
