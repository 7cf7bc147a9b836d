//! The scale that VST3 hosts name to a plugin's view.
//!
//! Hosts name it before there is a window. The framework declines it then, and opens the window at scale 1.

use super::hosted::table;
use crate::export::{guard::guard, kind::COUNT};
use crate::telemetry::host_side::HostSide;
use crate::worker::lock::lock;
use nice_plug::wrapper::vst3::vst3::ComRef;
use nice_plug::wrapper::vst3::vst3::Steinberg::{
    FIDString, IPlugView, IPlugViewContentScaleSupport, IPlugViewContentScaleSupport_::ScaleFactor,
    IPlugViewContentScaleSupportVtbl, Vst::IEditController, kResultFalse, kResultOk, tresult,
};
use std::sync::{Arc, Mutex, OnceLock, Weak};

/// The functions of views of a kind of plugin. They live as long as the library: a host may keep a view longer than its plugin.
#[repr(C)]
struct Table {
    /// First, so that a pointer to it is one to the whole.
    ours: IPlugViewContentScaleSupportVtbl,
    theirs: IPlugViewContentScaleSupportVtbl,
}

static TABLES: [OnceLock<Table>; COUNT] = [const { OnceLock::new() }; COUNT];
/// Addresses of views, and what their instances show of their host.
static VIEWS: Mutex<Vec<(usize, Weak<HostSide>)>> = Mutex::new(Vec::new());

pub(super) unsafe extern "system" fn create_view(this: *mut IEditController, name: FIDString) -> *mut IPlugView {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let view = unsafe { (table.theirs.createView)(this, name) };
    let hosted = table.hosted();
    // SAFETY: it is a new view or none.
    guard(None, || unsafe { watch(view, hosted.kind, &hosted.side) });
    view
}

/// Puts our table in the place of a view's own.
unsafe fn watch(view: *mut IPlugView, kind: usize, side: &Arc<HostSide>) -> Option<()> {
    // SAFETY: the view is alive, and nobody else knows it yet.
    unsafe {
        let scaled = ComRef::from_raw(view)?.cast::<IPlugViewContentScaleSupport>()?;
        let place = scaled.as_ptr().cast::<*const IPlugViewContentScaleSupportVtbl>();
        let theirs = **place;
        let ours = IPlugViewContentScaleSupportVtbl { setContentScaleFactor: set_content_scale_factor, ..theirs };
        *place = &raw const TABLES[kind].get_or_init(|| Table { ours, theirs }).ours;
        let mut views = lock(&VIEWS);
        views.retain(|(other, side)| *other != place.addr() && side.strong_count() > 0);
        views.push((place.addr(), Arc::downgrade(side)));
    }
    Some(())
}

unsafe extern "system" fn set_content_scale_factor(this: *mut IPlugViewContentScaleSupport, factor: ScaleFactor) -> tresult {
    // SAFETY: hosts call it by the table that `watch` has put there.
    let table = unsafe { &**this.cast::<*const Table>() };
    // SAFETY: the view is the framework's.
    let result = unsafe { (table.theirs.setContentScaleFactor)(this, factor) };
    guard(kResultFalse, || {
        if !(factor.is_finite() && factor > 0.0) {
            return result;
        }
        let side = lock(&VIEWS).iter().find(|(view, _)| *view == this.addr()).and_then(|(_, side)| side.upgrade());
        side.map_or(result, |side| {
            side.set_scale(factor);
            kResultOk
        })
    })
}
