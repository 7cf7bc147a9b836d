//! Which responses are kept out of a bake, to judge it by.

use super::pattern::Field;
use super::{Response, Responses};
use crate::BakeError;

/// How the grammar is said in an error.
const GRAMMAR: &str = "none, every=N+K, names=A,B or FIELD=VALUES, several joined by ';', where FIELD is azimuth, elevation, \
    distance, \
                       yaw, pitch, roll, x, y or z and VALUES is 5,15 or -85..85/10 or odd5";

/// A rule that selects responses, from a text such as `azimuth=odd5` or `every=5+2`.
///
/// - `none` selects nothing.
/// - `every=N+K`: those whose index leaves the remainder K when divided by N; `every=N` is `every=N+0`.
/// - `names=A,B`: those with these names.
/// - `azimuth=5,15,-25`: those whose source the head sees at one of these azimuths, degrees, positive to the left.
/// - `azimuth=-85..85/10`: from -85 to 85 in steps of 10.
/// - `azimuth=odd5`: the odd multiples of 5.
/// - `elevation`, `distance` (metres), and of the listener `yaw`, `pitch`, `roll` (degrees), `x`, `y`, `z` (metres) work as
///   `azimuth`.
/// - Rules joined by `;` select what any of them selects. `:` may stand for `=`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HoldOut {
    rules: Vec<Rule>,
}

#[derive(Clone, Debug, PartialEq)]
enum Rule {
    Every { step: usize, remainder: usize },
    Names(Vec<String>),
    Field { field: Field, values: Values },
}

#[derive(Clone, Debug, PartialEq)]
enum Values {
    List(Vec<f64>),
    Range { first: f64, last: f64, step: f64 },
    Odd(f64),
}

impl HoldOut {
    /// Reads a rule.
    ///
    /// # Errors
    /// A text outside the grammar.
    pub fn parse(text: &str) -> Result<Self, BakeError> {
        let wrong = |found: &str| BakeError::argument("hold-out", GRAMMAR, format!("\"{found}\""));
        let mut rules = Vec::new();
        for part in text.split(';').map(str::trim) {
            if part == "none" {
                continue;
            }
            let (name, values) = part.split_once(['=', ':']).ok_or_else(|| wrong(part))?;
            let rule = match name.trim() {
                "every" => every(values.trim()),
                "names" => Some(Rule::Names(values.split(',').map(|n| n.trim().to_owned()).collect())),
                name => Field::named(name).and_then(|field| Some(Rule::Field { field, values: Values::parse(values.trim())? })),
            };
            rules.push(rule.ok_or_else(|| wrong(part))?);
        }
        Ok(Self { rules })
    }

    /// Whether the response at `index` of its set is kept out.
    #[must_use]
    pub fn selects(&self, response: &Response, index: usize) -> bool {
        self.rules.iter().any(|rule| match rule {
            Rule::Every { step, remainder } => index % step == *remainder,
            Rule::Names(names) => names.contains(&response.name),
            Rule::Field { field, values } => {
                let (value, is_angle) = field.of(response);
                values.contain(value, is_angle)
            }
        })
    }

    /// Indices to bake from and indices kept out, both rising.
    ///
    /// # Errors
    /// A rule that selects no response, unless it is `none`, or that leaves none to bake from.
    pub fn split(&self, set: &Responses) -> Result<(Vec<usize>, Vec<usize>), BakeError> {
        let (out, kept): (Vec<usize>, Vec<usize>) = (0..set.responses.len()).partition(|&i| self.selects(&set.responses[i], i));
        let expected = format!("a rule that selects some of the {} responses", set.responses.len());
        let wrong = |found: &str| BakeError::argument("hold-out", expected, found);
        if kept.is_empty() {
            return Err(wrong("one that leaves none to bake from"));
        }
        if out.is_empty() && !self.rules.is_empty() {
            return Err(wrong("one that selects none"));
        }
        Ok((kept, out))
    }
}

fn every(values: &str) -> Option<Rule> {
    let (step, remainder) = values.split_once('+').unwrap_or((values, "0"));
    let (step, remainder) = (step.parse().ok()?, remainder.parse().ok()?);
    (remainder < step).then_some(Rule::Every { step, remainder })
}

impl Field {
    /// The value, and whether it is an angle that comes round at 360 degrees.
    fn of(self, response: &Response) -> (f64, bool) {
        let (yaw, pitch, roll) = response.listener.ypr();
        let position = response.listener.position;
        let (value, is_angle) = match self {
            Self::Azimuth => (response.direction_deg().0, true),
            Self::Elevation => (response.direction_deg().1, true),
            Self::Yaw => (yaw.to_degrees(), true),
            Self::Pitch => (pitch.to_degrees(), true),
            Self::Roll => (roll.to_degrees(), true),
            Self::Distance => (response.distance_m(), false),
            Self::X => (position.x, false),
            Self::Y => (position.y, false),
            Self::Z => (position.z, false),
        };
        (f64::from(value), is_angle)
    }
}

impl Values {
    fn parse(text: &str) -> Option<Self> {
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        if let Some(unit) = text.strip_prefix("odd") {
            return Some(Self::Odd(number(unit).filter(|u| *u > 0.0)?));
        }
        if let Some((first, rest)) = text.split_once("..") {
            let (last, step) = rest.split_once('/')?;
            let (first, last, step) = (number(first)?, number(last)?, number(step)?);
            return (step > 0.0 && first <= last).then_some(Self::Range { first, last, step });
        }
        text.split(',').map(number).collect::<Option<_>>().map(Self::List)
    }

    fn contain(&self, value: f64, is_angle: bool) -> bool {
        // An angle is met at any number of turns; a degree value may be written either side of the seam.
        let turns = if is_angle { [0.0, 360.0, -360.0] } else { [0.0; 3] };
        // Angles and positions pass through single precision rotations.
        let grain = if is_angle { 0.05 } else { 1e-3 };
        turns.iter().map(|turn| value + turn).any(|v| match self {
            Self::List(list) => list.iter().any(|x| (v - x).abs() < grain),
            Self::Range { first, last, step } => {
                let steps = (v - first) / step;
                v > first - grain && v < last + grain && (steps - steps.round()).abs() * step < grain
            }
            Self::Odd(unit) => {
                let half_steps = (v / unit - 1.0) / 2.0;
                (half_steps - half_steps.round()).abs() * 2.0 * unit < grain
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::Pose;
    use promenade_core::glam::Vec3;

    fn ring() -> Responses {
        let at = |deg: i32| Response {
            listener: Pose::IDENTITY,
            source: promenade_sofa::to_cartesian(deg as f32, 0.0, 1.5, super::super::Side::Left),
            left: vec![1.0],
            right: vec![1.0],
            name: format!("r{deg}"),
        };
        Responses { sample_rate_hz: 16e3, responses: (-90..=90).step_by(5).map(at).collect(), ..Responses::default() }
    }

    fn names(rule: &str) -> Vec<String> {
        let set = ring();
        let (_, out) = HoldOut::parse(rule).unwrap().split(&set).unwrap();
        out.iter().map(|&i| set.responses[i].name.clone()).collect()
    }

    #[test]
    fn every_tenth_degree_is_kept_and_the_rest_is_held_out() {
        let odd: Vec<String> = (-85..=85).step_by(10).map(|d| format!("r{d}")).collect();
        assert_eq!(odd.len(), 18);
        assert_eq!(names("azimuth=odd5"), odd);
        assert_eq!(names("azimuth:-85..85/10"), odd);
        assert_eq!(names("every=2+1"), odd);
        assert_eq!(names("azimuth=5,-90,270"), ["r-90", "r5"], "270 degrees is -90");
        assert_eq!(names("names=r0; azimuth=85"), ["r0", "r85"]);
        assert_eq!(names("none"), [""; 0]);
    }

    #[test]
    fn fields_of_the_listener() {
        let mut set = ring();
        set.responses[3].listener = Pose::from_ypr(Vec3::new(0.5, 0.0, 0.0), -40.0_f32.to_radians(), 0.0, 0.0);
        for rule in ["yaw=-40", "yaw=320", "x=0.5", "x=0.25..1/0.25"] {
            assert_eq!(HoldOut::parse(rule).unwrap().split(&set).unwrap().1, [3], "{rule}");
        }
        assert_eq!(HoldOut::parse("distance=1.5").unwrap().split(&set).unwrap().1.len(), 36);
    }

    #[test]
    fn refuses_nonsense() {
        for rule in [
            "",
            "azimuth",
            "azimuth=",
            "azimuth=five",
            "azimuth=10..0/5",
            "azimuth=0..10/0",
            "azimuth=0..10",
            "every=0",
            "every=2+2",
            "bearing=5",
        ] {
            assert!(HoldOut::parse(rule).is_err(), "{rule:?}");
        }
        assert!(HoldOut::parse("azimuth=2").unwrap().split(&ring()).is_err(), "selects none");
        assert!(HoldOut::parse("every=1").unwrap().split(&ring()).is_err(), "leaves none");
    }
}
