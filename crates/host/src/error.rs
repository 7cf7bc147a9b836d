//! What can go wrong with somebody else's plugin.

use promenade_fault::Fault;
use std::fmt::Display;
use std::path::Path;

/// What was to be loaded is not there, is no plugin, or refuses to be loaded.
pub(crate) fn unloaded(path: &Path, reason: impl Display) -> Fault {
    Fault::new(format!("{}: cannot be loaded: {reason}", path.display()))
}

/// The plugin does not do something that not all plugins do.
pub(crate) fn missing(plugin: &str, what: &str) -> Fault {
    Fault::new(format!("{plugin} has no {what}"))
}

/// The plugin fails in something that it should do.
pub(crate) fn failed(plugin: &str, what: &str, reason: impl Display) -> Fault {
    Fault::new(format!("{plugin} fails to {what}: {reason}"))
}

/// There is no parameter, preset or the like (`kind`) of a name or number; the hint says which name is the closest.
pub(crate) fn no_such(plugin: &str, (count, kind): (usize, &str), wanted: &str, hint: &str) -> Fault {
    Fault::argument(plugin, format_args!("one of its {count} {kind}"), format_args!("{wanted:?}{hint}"))
}
