//! Which parameters belong together, as hosts show them: in modules, and on pages of remote controls.

use crate::parameter::source_knob::{KNOBS, Part, SOURCES};
use crate::parameter::{Parameter, SOUND};
use crate::project::params::PromenadeParams;
use nice_plug::prelude::{Param, ParamPtr, Params, RemoteControlsContext, RemoteControlsPage, RemoteControlsSection};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The module of what the editor alone moves.
const EDITOR: &str = "Editor";

/// Pages of eight knobs with their sections; `None` leaves a knob free. [`SOUND`] has a page of its own, or as many as it
/// needs.
const PAGES: [(&str, &str, [Option<Parameter>; 8]); 4] = {
    use Parameter::*;
    [
        ("Listener", "Pose", [Some(X), Some(Y), Some(Z), Some(Tracking), Some(Yaw), Some(Pitch), Some(Roll), None]),
        ("Source", "Offset", [Some(Ex), Some(Ey), Some(Ez), Some(Spread), Some(Group), Some(Lead), Some(Scene), Some(Slot)]),
        ("Source", "Direction", [Some(Place), Some(Azimuth), Some(Elevation), Some(Distance), None, None, None, None]),
        ("Listener", "Path", [Some(Path), Some(Follow), Some(Offset), Some(Walk), None, None, None, Some(Osc)]),
    ]
};

/// Declares the pages of remote controls, eight knobs each.
pub(crate) fn remote_controls(params: &PromenadeParams, context: &mut impl RemoteControlsContext) {
    fn fill<P: RemoteControlsPage>(page: &mut P, params: &PromenadeParams, knobs: impl Iterator<Item = Option<Parameter>>) {
        for knob in knobs {
            match knob {
                Some(parameter) => params.of(parameter).put_onto(page),
                None => page.add_spacer(),
            }
        }
    }
    for (section, name, knobs) in PAGES {
        context.add_section(section, |section| section.add_page(name, |page| fill(page, params, knobs.into_iter())));
    }
    let sound = Parameter::ALL.into_iter().filter(|parameter| parameter.row().module == SOUND);
    context.add_section(SOUND, |section| section.add_page(SOUND, |page| fill(page, params, sound.map(Some))));
    let knobs = KNOBS.map(|knob| Some(Parameter::Source(knob)));
    for (source, knobs) in SOURCES.into_iter().zip(knobs.chunks(Part::ALL.len())).take(params.further()) {
        context.add_section("Sources", |section| section.add_page(source, |page| fill(page, params, knobs.iter().copied())));
    }
}

/// The parameters as the framework lists them, each in its module.
pub(crate) struct InModules(pub(crate) Arc<PromenadeParams>);

// SAFETY: the pointers are those of the parameters within, which live as long as this.
#[expect(unsafe_code, reason = "the framework's list of parameters holds pointers to them")]
unsafe impl Params for InModules {
    fn param_map(&self) -> Vec<(String, ParamPtr, String)> {
        let of = |parameter: Parameter| {
            (parameter.id().to_owned(), self.0.of(parameter).as_ptr(), parameter.row().module.to_owned())
        };
        let mut all: Vec<_> = self.0.parameters().map(of).collect();
        all.insert(Parameter::ALL.len(), ("revision".to_owned(), self.0.revision.as_ptr(), EDITOR.to_owned()));
        all
    }

    fn serialize_fields(&self) -> BTreeMap<String, String> {
        self.0.serialize_fields()
    }

    fn deserialize_fields(&self, serialized: &BTreeMap<String, String>) {
        self.0.deserialize_fields(serialized);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_is_on_one_page() {
        for parameter in Parameter::ALL {
            let count = PAGES.iter().flat_map(|(.., knobs)| knobs).filter(|knob| **knob == Some(parameter)).count();
            assert_eq!(count, usize::from(parameter.row().module != SOUND), "{parameter:?}");
        }
    }
}
