//! File names that say where a response was measured: `room_{azimuth}deg.wav`.

/// A number of a response that file names hold and rules ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Field {
    Azimuth,
    Elevation,
    Distance,
    Yaw,
    Pitch,
    Roll,
    X,
    Y,
    Z,
}

impl Field {
    const ALL: [Self; 9] = {
        use Field::*;
        [Azimuth, Elevation, Distance, Yaw, Pitch, Roll, X, Y, Z]
    };

    /// The variant in small letters.
    pub(super) fn name(self) -> String {
        format!("{self:?}").to_ascii_lowercase()
    }

    /// The field of that name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|field| field.name() == name)
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Text(String),
    Number(Field),
}

/// A file name with fields in braces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern(Vec<Part>);

impl Pattern {
    /// Takes a pattern apart; the error says what was expected and found.
    pub(super) fn parse(text: &str) -> Result<Self, (String, String)> {
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(open) = rest.find('{') {
            if open > 0 {
                parts.push(Part::Text(rest[..open].to_owned()));
            }
            let close = rest[open..].find('}').ok_or_else(|| ("a } after every {".to_owned(), format!("\"{text}\"")))? + open;
            let name = &rest[open + 1..close];
            let field = Field::named(name).ok_or_else(|| {
                let names = Field::ALL.map(|field| format!("{{{}}}", field.name())).join(", ");
                (format!("one of {names}"), format!("{{{name}}}"))
            })?;
            if parts.contains(&Part::Number(field)) {
                return Err(("every field once".to_owned(), format!("{{{name}}} twice")));
            }
            parts.push(Part::Number(field));
            rest = &rest[close + 1..];
        }
        if !rest.is_empty() {
            parts.push(Part::Text(rest.to_owned()));
        }
        Ok(Self(parts))
    }

    /// The numbers in `name`, or `None` where it does not fit.
    pub(super) fn numbers(&self, name: &str) -> Option<Vec<(Field, f64)>> {
        let mut rest = name;
        let mut found = Vec::new();
        for part in &self.0 {
            match part {
                Part::Text(text) => rest = rest.strip_prefix(text.as_str())?,
                Part::Number(field) => {
                    let length = number_length(rest);
                    found.push((*field, number(&rest[..length])?));
                    rest = &rest[length..];
                }
            }
        }
        rest.is_empty().then_some(found)
    }
}

/// A number of a name; decimals may follow a comma.
pub(super) fn number(text: &str) -> Option<f64> {
    text.replace(',', ".").parse().ok()
}

/// Bytes of the number at the start: a sign, digits, and a point or comma only where digits follow.
pub(super) fn number_length(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let sign = usize::from(text.starts_with(['+', '-']));
    let whole = sign + digits(sign);
    if whole > sign && text[whole..].starts_with(['.', ',']) {
        let decimals = digits(whole + 1);
        if decimals > 0 {
            return whole + 1 + decimals;
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_numbers_from_names() {
        let p = Pattern::parse("CortexBRIR_0_32s_{azimuth}deg_16k.wav").unwrap();
        assert_eq!(p.numbers("CortexBRIR_0_32s_-85deg_16k.wav"), Some(vec![(Field::Azimuth, -85.0)]));
        assert_eq!(p.numbers("CortexBRIR_0_32s_deg_16k.wav"), None);
        assert_eq!(p.numbers("CortexBRIR_0_32s_5deg_16k.wav.bak"), None);
        let p = Pattern::parse("x{x}_y{y}_yaw{yaw}.wav").unwrap();
        assert_eq!(p.numbers("x1.5_y-2_yaw+030.wav"), Some(vec![(Field::X, 1.5), (Field::Y, -2.0), (Field::Yaw, 30.0)]));
        assert_eq!(
            Pattern::parse("{azimuth}-{elevation}.wav").unwrap().numbers("10--20.wav"),
            Some(vec![(Field::Azimuth, 10.0), (Field::Elevation, -20.0)])
        );
    }

    #[test]
    fn refuses_what_it_does_not_know() {
        assert!(Pattern::parse("{angle}.wav").unwrap_err().0.contains("{azimuth}"));
        assert!(Pattern::parse("{azimuth.wav").is_err());
        assert!(Pattern::parse("{yaw}{yaw}").is_err());
    }
}
