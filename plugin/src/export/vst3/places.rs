//! Where a block is split: a list of changes that change nothing, for the framework.

use crate::project::host_values::NO_PARAMETER;
use crate::telemetry::host_side::HostSide;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    IParamValueQueue, IParamValueQueueTrait, IParameterChanges, IParameterChangesTrait,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{kResultFalse, kResultOk, tresult};
use nice_plug::wrapper::vst3::vst3::{Class, ComPtr, ComWrapper};
use std::sync::Arc;

/// The places of changes in the block that an instance is handed.
pub(super) struct Places {
    list: ComPtr<IParameterChanges>,
    side: Arc<HostSide>,
}

impl Places {
    /// Of an instance that shows this of its host.
    pub(super) fn of(side: &Arc<HostSide>) -> Option<Self> {
        let queue = ComWrapper::new(Queue(Arc::clone(side))).to_com_ptr()?;
        Some(Self { list: ComWrapper::new(List(queue)).to_com_ptr()?, side: Arc::clone(side) })
    }

    /// The list; null where the block has no changes.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn list(&self) -> *mut IParameterChanges {
        if self.side.values.count() > 0 { self.list.as_ptr() } else { std::ptr::null_mut() }
    }
}

/// One queue of changes.
struct List(ComPtr<IParamValueQueue>);

impl Class for List {
    type Interfaces = (IParameterChanges,);
}

impl IParameterChangesTrait for List {
    unsafe fn getParameterCount(&self) -> i32 {
        1
    }

    unsafe fn getParameterData(&self, _index: i32) -> *mut IParamValueQueue {
        self.0.as_ptr()
    }

    unsafe fn addParameterData(&self, _id: *const u32, _index: *mut i32) -> *mut IParamValueQueue {
        std::ptr::null_mut()
    }
}

/// The changes of a parameter that does not exist.
struct Queue(Arc<HostSide>);

impl Class for Queue {
    type Interfaces = (IParamValueQueue,);
}

impl IParamValueQueueTrait for Queue {
    unsafe fn getParameterId(&self) -> u32 {
        NO_PARAMETER
    }

    unsafe fn getPointCount(&self) -> i32 {
        i32::try_from(self.0.values.count()).unwrap_or(i32::MAX)
    }

    unsafe fn getPoint(&self, index: i32, sample: *mut i32, value: *mut f64) -> tresult {
        let found = usize::try_from(index).ok().and_then(|place| self.0.values.sample(place));
        // SAFETY: the framework hands over room for both.
        match (found.and_then(|found| i32::try_from(found).ok()), unsafe { (sample.as_mut(), value.as_mut()) }) {
            (Some(found), (Some(sample), Some(value))) => {
                (*sample, *value) = (found, 0.0);
                kResultOk
            }
            _ => kResultFalse,
        }
    }

    unsafe fn addPoint(&self, _sample: i32, _value: f64, _index: *mut i32) -> tresult {
        kResultFalse
    }
}
