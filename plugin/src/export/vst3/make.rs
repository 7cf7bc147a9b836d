//! Makes a plugin as VST3 hosts hold it.

use super::controller::{amend_component, amend_controller};
use super::hosted::{Hosted, amend, framework_plugin, keep_queue};
use super::processor;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    ChannelContext::IInfoListener, IAudioProcessor, IComponent, IEditController, IMidiMapping, INoteExpressionController,
    IProcessContextRequirements, IUnitInfo,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{FUnknown, TUID, tresult};
use std::ffi::c_void;

/// Makes a plugin with so many further sources, of a kind, whose interface of a number goes where the host wants it.
pub(super) unsafe fn make<const FURTHER: usize>(kind: usize, iid: *const TUID, obj: *mut *mut c_void) -> Option<tresult> {
    keep_queue::<FURTHER>(kind)?;
    let (plugin, side) = framework_plugin::<FURTHER>()?;
    let unknown = plugin.as_com_ref::<FUnknown>()?.as_ptr();
    let hosted = Box::into_raw(Box::new(Hosted::new(&plugin, kind, side)?));
    amend::<IComponent, _>(&plugin, hosted, amend_component);
    amend::<IEditController, _>(&plugin, hosted, amend_controller);
    amend::<IAudioProcessor, _>(&plugin, hosted, processor::amend);
    amend::<IMidiMapping, _>(&plugin, hosted, |_| ());
    amend::<INoteExpressionController, _>(&plugin, hosted, |_| ());
    amend::<IProcessContextRequirements, _>(&plugin, hosted, |_| ());
    amend::<IUnitInfo, _>(&plugin, hosted, |_| ());
    amend::<IInfoListener, _>(&plugin, hosted, |_| ());
    drop(plugin);
    // SAFETY: the plugin is alive; the host hands over an interface's number and room for the plugin, which has a reference
    // more then. The one of this function goes after that.
    unsafe {
        let table = (*unknown).vtbl;
        let made = ((*table).queryInterface)(unknown, iid, obj);
        ((*table).release)(unknown);
        Some(made)
    }
}
