//! Values in a host's list of events: they reach the parameters by [`HostValues`], and the framework is shown their places
//! only.

use super::{further_ports, hosted};
use crate::export::{guard::guard, kind::KINDS};
use crate::parameter::cast::narrow;
use crate::project::host_values::{Change, HostValues, NO_PARAMETER};
use clap_sys::events::{
    CLAP_CORE_EVENT_SPACE_ID, CLAP_EVENT_PARAM_MOD, CLAP_EVENT_PARAM_VALUE, clap_event_header, clap_event_param_mod,
    clap_event_param_value, clap_input_events,
};
use clap_sys::process::{CLAP_PROCESS_ERROR, clap_process};
use nice_plug::wrapper::clap::clap_plugin;
use std::cell::UnsafeCell;

/// Plays a block.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
pub(super) unsafe extern "C" fn process(plugin: *const clap_plugin, process: *const clap_process) -> i32 {
    guard(CLAP_PROCESS_ERROR, || {
        // SAFETY: the host hands over a block or none, and its list of events lives through the call.
        unsafe {
            let (Some(hosted), Some(block)) = (hosted(plugin), process.as_ref()) else { return CLAP_PROCESS_ERROR };
            let values = &hosted.side.values;
            let events = block.in_events.as_ref();
            values.begin(block.frames_count, events.into_iter().flat_map(|events| changes(values, events)));
            let places = events.map(|events| Places::of(events, block.frames_count));
            let list = places.as_ref().map(Places::list);
            let in_events = list.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
            let block = clap_process { in_events, ..*block };
            let result = match KINDS[hosted.kind].further {
                0 => (hosted.theirs.process)(plugin, &raw const block),
                further => further_ports::process(hosted, plugin, &block, 1 + further),
            };
            values.end();
            result
        }
    })
}

/// The changes in a list of events: sample, number and change.
///
/// # Safety
/// The list is as hosts hand it over.
pub(super) unsafe fn changes(values: &HostValues, events: &clap_input_events) -> impl Iterator<Item = (u32, u32, Change)> {
    // SAFETY: the caller's; there are as many events as the list says.
    let count = events.size.map_or(0, |size| unsafe { size(events) });
    (0..count).filter_map(move |index| {
        // SAFETY: as above; an event of a kind is as long as its kind.
        unsafe {
            let event = events.get.map_or(std::ptr::null(), |get| get(events, index));
            let header = event.as_ref().filter(|header| header.space_id == CLAP_CORE_EVENT_SPACE_ID)?;
            let (id, change) = match header.type_ {
                CLAP_EVENT_PARAM_VALUE => {
                    let event = &*event.cast::<clap_event_param_value>();
                    (event.param_id, Change::Value(narrow(event.value) / values.steps(event.param_id)))
                }
                CLAP_EVENT_PARAM_MOD => {
                    let event = &*event.cast::<clap_event_param_mod>();
                    (event.param_id, Change::Modulation(narrow(event.amount) / values.steps(event.param_id)))
                }
                _ => return None,
            };
            Some((header.time, id, change))
        }
    })
}

/// A host's events, in which changes are those of a parameter that does not exist.
struct Places<'a> {
    events: &'a clap_input_events,
    /// The block's last sample: the framework goes wrong at a later one.
    last: u32,
    /// The last change that was asked for.
    shown: UnsafeCell<clap_event_param_value>,
}

impl<'a> Places<'a> {
    fn of(events: &'a clap_input_events, samples: u32) -> Self {
        let header = clap_event_header {
            size: u32::try_from(size_of::<clap_event_param_value>()).unwrap_or(0),
            time: 0,
            space_id: CLAP_CORE_EVENT_SPACE_ID,
            type_: CLAP_EVENT_PARAM_VALUE,
            flags: 0,
        };
        let shown = clap_event_param_value {
            header,
            param_id: NO_PARAMETER,
            cookie: std::ptr::null_mut(),
            note_id: -1,
            port_index: -1,
            channel: -1,
            key: -1,
            value: 0.0,
        };
        Self { events, last: samples.saturating_sub(1), shown: UnsafeCell::new(shown) }
    }

    /// The list. It must not be used after this.
    fn list(&self) -> clap_input_events {
        clap_input_events { ctx: std::ptr::from_ref(self).cast_mut().cast(), size: Some(size), get: Some(get) }
    }
}

unsafe extern "C" fn size(list: *const clap_input_events) -> u32 {
    // SAFETY: the framework has the list from `process`.
    unsafe {
        let Places { events, .. } = &*(*list).ctx.cast::<Places<'_>>();
        events.size.map_or(0, |size| size(*events))
    }
}

unsafe extern "C" fn get(list: *const clap_input_events, index: u32) -> *const clap_event_header {
    // SAFETY: as in `size`. The framework looks at an event before it asks for the next one.
    unsafe {
        let Places { events, last, shown } = &*(*list).ctx.cast::<Places<'_>>();
        let event = events.get.map_or(std::ptr::null(), |get| get(*events, index));
        let is_change = |header: &&clap_event_header| {
            header.space_id == CLAP_CORE_EVENT_SPACE_ID
                && [CLAP_EVENT_PARAM_VALUE, CLAP_EVENT_PARAM_MOD].contains(&header.type_)
        };
        let Some(header) = event.as_ref().filter(is_change) else { return event };
        (*shown.get()).header.time = header.time.min(*last);
        shown.get().cast()
    }
}
