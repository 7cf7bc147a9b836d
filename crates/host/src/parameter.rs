//! Parameters as a plugin lists them.

use crate::Fault;
use crate::error::no_such;

/// A parameter as a plugin lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its number for hosts.
    pub id: u32,
    /// Name.
    pub name: String,
    /// Unit; of CLAP plugins, which have none, what follows the number in the default's text.
    pub unit: String,
    /// The default, 0 to 1.
    pub default: f64,
    /// The default as the plugin writes it, with the unit.
    pub default_text: String,
    /// Steps from the least value to the greatest, 0 where it is continuous.
    pub steps: u32,
    /// Whether hosts may automate it.
    pub automatable: bool,
    /// The module that it belongs to, with `/` between modules within modules; empty for none, and in VST3.
    pub module: String,
    /// Whether its greatest value is its least again, as an angle's. VST3 has no such thing.
    pub periodic: bool,
    /// The plugin's own least value; VST3 has none: 0.
    pub(crate) least: f64,
    /// The plugin's own greatest value; VST3 has none: 1.
    pub(crate) greatest: f64,
}

impl Parameter {
    /// From 0 to 1 to the plugin's own range.
    pub(crate) fn plain(&self, normalized: f64) -> f64 {
        let value = self.least + normalized * (self.greatest - self.least);
        if self.steps > 0 { value.round() } else { value }
    }

    /// From the plugin's own range to 0 to 1.
    pub(crate) fn normalized(&self, plain: f64) -> f64 {
        let span = self.greatest - self.least;
        if span == 0.0 { 0.0 } else { ((plain - self.least) / span).clamp(0.0, 1.0) }
    }
}

/// What follows the number in a text.
pub(crate) fn unit_of(text: &str) -> &str {
    let number = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | ',' | ' ' | '\u{2212}');
    let end = text.find(|c| !number(c)).unwrap_or(text.len());
    // A text that begins with a letter is a name, such as that of a mode.
    if text[..end].contains(|c: char| c.is_ascii_digit()) { text[end..].trim() } else { "" }
}

/// The parameter of a name, or of a number where no name is so.
pub(crate) fn find<'a>(parameters: &'a [Parameter], wanted: &str, plugin: &str) -> Result<&'a Parameter, Fault> {
    let unknown = |hint: String| no_such(plugin, (parameters.len(), "parameters"), wanted, &hint);
    let mut named = parameters.iter().filter(|p| p.name == wanted);
    match (named.next(), named.next()) {
        (Some(found), None) => Ok(found),
        (Some(found), Some(other)) => {
            Err(unknown(format!("; several have this name, by number {} and {}", found.id, other.id)))
        }
        (None, _) => {
            let numbered = wanted.parse().ok().and_then(|id: u32| parameters.iter().find(|p| p.id == id));
            let alike = || parameters.iter().find(|p| p.name.eq_ignore_ascii_case(wanted.trim()));
            numbered.ok_or_else(|| unknown(alike().map_or_else(String::new, |p| format!("; did you mean {:?}?", p.name))))
        }
    }
}

/// A plugin's own change of a parameter, such as by a knob in its editor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edit {
    /// The parameter's number.
    pub id: u32,
    /// What happens to it.
    pub kind: EditKind,
}

/// The kinds of changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EditKind {
    /// A hand takes the knob.
    Begin,
    /// The knob has this value, 0 to 1.
    Value(f64),
    /// The hand lets go.
    End,
}

#[cfg(test)]
pub(crate) mod tests;
