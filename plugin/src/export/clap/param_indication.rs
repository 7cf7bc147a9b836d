//! What a CLAP host marks parameters with: `clap.param-indication`, which the framework lacks.

use super::{host_side, parameter_of};
use crate::export::guard::guard;
use crate::telemetry::host_side::{Automation, Colour, Mapping, Mark};
use clap_sys::color::clap_color;
use clap_sys::ext::param_indication::{
    CLAP_EXT_PARAM_INDICATION, CLAP_EXT_PARAM_INDICATION_COMPAT, CLAP_PARAM_INDICATION_AUTOMATION_OVERRIDING,
    CLAP_PARAM_INDICATION_AUTOMATION_PLAYING, CLAP_PARAM_INDICATION_AUTOMATION_PRESENT,
    CLAP_PARAM_INDICATION_AUTOMATION_RECORDING, clap_plugin_param_indication,
};
use nice_plug::wrapper::clap::clap_plugin;
use std::ffi::{CStr, c_char};

/// Names of the extension, the present one first.
pub(super) const IDS: [&CStr; 2] = [CLAP_EXT_PARAM_INDICATION, CLAP_EXT_PARAM_INDICATION_COMPAT];

/// The extension.
pub(super) static EXTENSION: clap_plugin_param_indication =
    clap_plugin_param_indication { set_mapping: Some(set_mapping), set_automation: Some(set_automation) };

unsafe extern "C" fn set_mapping(
    plugin: *const clap_plugin,
    param_id: u32,
    has_mapping: bool,
    color: *const clap_color,
    label: *const c_char,
    description: *const c_char,
) {
    // SAFETY: texts end with a zero, or are not there.
    let text = |text: *const c_char| {
        let text = (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) });
        text.unwrap_or_default().to_string_lossy().into_owned()
    };
    // SAFETY: the host hands over a colour or none.
    let colour = unsafe { colour(color) };
    let mapping = has_mapping.then(|| Mapping { label: text(label), description: text(description), colour });
    mark(plugin, param_id, |mark| mark.mapping = mapping);
}

unsafe extern "C" fn set_automation(plugin: *const clap_plugin, param_id: u32, state: u32, color: *const clap_color) {
    let automation = match state {
        CLAP_PARAM_INDICATION_AUTOMATION_PRESENT => Automation::Present,
        CLAP_PARAM_INDICATION_AUTOMATION_PLAYING => Automation::Playing,
        CLAP_PARAM_INDICATION_AUTOMATION_RECORDING => Automation::Recording,
        CLAP_PARAM_INDICATION_AUTOMATION_OVERRIDING => Automation::Overriding,
        _ => Automation::None,
    };
    // SAFETY: the host hands over a colour or none.
    let colour = unsafe { colour(color) };
    mark(plugin, param_id, |mark| (mark.automation, mark.automation_colour) = (automation, colour));
}

fn mark(plugin: *const clap_plugin, param_id: u32, change: impl FnOnce(&mut Mark)) {
    guard((), || {
        if let (Some(side), Some(parameter)) = (host_side(plugin), parameter_of(param_id)) {
            side.change_mark(parameter, change);
        }
    });
}

/// The host's colour, if there is one.
unsafe fn colour(color: *const clap_color) -> Option<Colour> {
    // SAFETY: the caller's.
    let color = unsafe { color.as_ref() }?;
    // A colour that cannot be seen is none.
    (color.alpha > 0).then_some([color.red, color.green, color.blue])
}
