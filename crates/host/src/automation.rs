//! Automation: values of a parameter over time, as events at samples.

use crate::parameter::Parameter;
use crate::{Fault, rounded};

/// Samples between two events on the way from one point to the next.
pub const AUTOMATION_STEP: u64 = 32;

/// A value at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Seconds from the start of the sound.
    pub seconds: f64,
    /// The value, 0 to 1.
    pub value: f64,
    /// Whether the value is kept until the next point, instead of moving there in a straight line.
    pub hold: bool,
}

/// The automation of one parameter.
///
/// A point is an event at its sample; on the way to the next there is one every [`AUTOMATION_STEP`] samples. The first value
/// holds from the start, the last to the end. A parameter with steps is held at each point.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    id: u32,
    points: Vec<Event>,
}

/// A point at its sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Event {
    at: u64,
    value: f64,
    hold: bool,
}

impl Event {
    /// The value on the way to the next point.
    fn towards(self, next: Self, at: u64) -> f64 {
        let share = (at - self.at) as f64 / (next.at - self.at) as f64;
        self.value + share * (next.value - self.value)
    }
}

impl Lane {
    /// Points for a parameter, at a sample rate in hertz.
    ///
    /// # Errors
    /// No point; times that are not finite, negative or not rising; values outside 0 to 1. The message names the point by its
    /// number, from 0.
    pub fn new(parameter: &Parameter, points: &[Point], rate: f64) -> Result<Self, Fault> {
        let wrong = |expected: String, found: String| Err(Fault::unexpected(expected, found));
        if points.is_empty() {
            return Err(Fault::unexpected("at least one point", "none"));
        }
        let mut before = None;
        for (number, point) in points.iter().enumerate() {
            let t = point.seconds;
            if !(0.0..=1e9).contains(&t) {
                return wrong(format!("a time of 0 to 1000000000 s at point {number}"), format!("{t} s"));
            }
            if let Some(before) = before.filter(|&before| t <= before) {
                return wrong(format!("a time after {before} s at point {number}"), format!("{t} s"));
            }
            if !(0.0..=1.0).contains(&point.value) {
                return wrong(format!("a value from 0 to 1 at point {number}"), point.value.to_string());
            }
            before = Some(t);
        }
        let event = |point: &Point| Event {
            at: rounded(point.seconds * rate).unsigned_abs(),
            value: point.value,
            hold: point.hold || parameter.steps > 0,
        };
        Ok(Self { id: parameter.id, points: points.iter().map(event).collect() })
    }

    /// The parameter's number.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Calls `set` with the samples of a block, counted from its start, and their values, in order. The events are the same for
    /// every division into blocks.
    ///
    /// # Errors
    /// That of `set`, which is not called any more then.
    pub fn events<E>(&self, start: u64, len: usize, mut set: impl FnMut(usize, f64) -> Result<(), E>) -> Result<(), E> {
        let end = start + len as u64;
        let mut at = |sample: u64, value: f64| match usize::try_from(sample - start) {
            Ok(offset) => set(offset, value),
            Err(_) => Ok(()),
        };
        if start == 0 && len > 0 && self.points[0].at > 0 {
            at(0, self.points[0].value)?;
        }
        // From the point whose way to the next reaches into the block.
        let first = self.points.partition_point(|point| point.at < start).saturating_sub(1);
        for (index, &point) in self.points.iter().enumerate().skip(first).take_while(|(_, point)| point.at < end) {
            let next = self.points.get(index + 1).copied();
            // Of several points that round to one sample the last counts.
            if point.at >= start && next.is_none_or(|next| next.at > point.at) {
                at(point.at, point.value)?;
            }
            let Some(next) = next.filter(|next| !point.hold && point.value != next.value) else { continue };
            let passed = start.saturating_sub(point.at).div_ceil(AUTOMATION_STEP).max(1);
            let mut sample = point.at + passed * AUTOMATION_STEP;
            while sample < next.at.min(end) {
                at(sample, point.towards(next, sample))?;
                sample += AUTOMATION_STEP;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    const RATE: f64 = 1000.0;

    fn parameter(steps: u32) -> Parameter {
        Parameter { steps, ..crate::parameter::tests::parameter(5, "Yaw") }
    }

    fn point(seconds: f64, value: f64) -> Point {
        Point { seconds, value, hold: false }
    }

    fn played(lane: &Lane, blocks: &[usize]) -> Vec<(u64, f64)> {
        let (mut start, mut all) = (0, Vec::new());
        for &len in blocks {
            let done = lane.events(start, len, |offset, value| {
                assert!(offset < len, "{offset} in a block of {len}");
                all.push((start + offset as u64, value));
                Ok::<(), Infallible>(())
            });
            assert!(done.is_ok());
            start += len as u64;
        }
        all
    }

    #[test]
    fn points_are_at_their_sample_and_the_way_between_is_straight() {
        let lane = Lane::new(&parameter(0), &[point(0.01, 0.0), point(0.11, 1.0), point(0.2, 1.0)], RATE).unwrap();
        let events = played(&lane, &[300]);
        assert_eq!(events, [(0, 0.0), (10, 0.0), (42, 0.32), (74, 0.64), (106, 0.96), (110, 1.0), (200, 1.0)]);
    }

    #[test]
    fn the_division_into_blocks_changes_nothing() {
        let points = [point(0.0, 0.2), point(0.05, 0.9), point(0.0501, 0.1), point(0.0503, 0.4), point(0.29, 0.0)];
        let lane = Lane::new(&parameter(0), &points, RATE).unwrap();
        let whole = played(&lane, &[300]);
        let jumped: Vec<_> = whole.iter().filter(|(at, _)| *at == 50).collect();
        assert_eq!(jumped, [&(50, 0.4)], "the last of three points on one sample");
        for blocks in [&[1; 300][..], &[7; 43], &[32; 10], &[33; 10], &[0, 299, 0, 1], &[64, 1, 235]] {
            let events: Vec<_> = played(&lane, blocks).into_iter().filter(|(at, _)| *at < 300).collect();
            assert_eq!(events, whole, "{blocks:?}");
        }
    }

    #[test]
    fn what_is_held_or_has_steps_jumps() {
        let held = [Point { hold: true, ..point(0.0, 0.0) }, point(0.1, 1.0)];
        assert_eq!(played(&Lane::new(&parameter(0), &held, RATE).unwrap(), &[200]), [(0, 0.0), (100, 1.0)]);
        let stepped = [point(0.0, 0.0), point(0.1, 1.0)];
        assert_eq!(played(&Lane::new(&parameter(3), &stepped, RATE).unwrap(), &[200]), [(0, 0.0), (100, 1.0)]);
    }

    #[test]
    fn nonsense_is_refused_by_the_number_of_its_point() {
        let refused = |points: &[Point]| Lane::new(&parameter(0), points, RATE).unwrap_err().to_string();
        assert_eq!(refused(&[]), "expected at least one point, found none");
        assert_eq!(refused(&[point(1.0, 0.0), point(1.0, 0.5)]), "expected a time after 1 s at point 1, found 1 s");
        assert!(refused(&[point(-1.0, 0.0)]).contains("point 0"));
        assert!(refused(&[point(f64::NAN, 0.0)]).contains("point 0"));
        assert!(refused(&[point(0.0, 1.5)]).contains("a value from 0 to 1"));
    }
}
