//! Streams of bytes that VST3 hosts and the framework write to.

use crate::worker::lock::lock;
use nice_plug::wrapper::vst3::vst3::Steinberg::{
    IBStream, IBStreamTrait, kInvalidArgument, kNotImplemented, kResultFalse, kResultOk, tresult,
};
use nice_plug::wrapper::vst3::vst3::{Class, ComRef, ComWrapper};
use std::ffi::c_void;
use std::sync::{Arc, Mutex};

/// What is written to a stream of ours.
#[derive(Default)]
pub(super) struct Written(Arc<Mutex<Vec<u8>>>);

impl Written {
    /// Hands a stream to someone who says whether it was written to the end; the bytes then.
    pub(super) fn by(self, write: impl FnOnce(*mut IBStream) -> bool) -> Option<Vec<u8>> {
        let stream = ComWrapper::new(Stream(Arc::clone(&self.0)));
        let written = write(stream.as_com_ref::<IBStream>()?.as_ptr());
        written.then(|| std::mem::take(&mut *lock(&self.0)))
    }
}

/// Takes bytes, one after the other.
struct Stream(Arc<Mutex<Vec<u8>>>);

impl Class for Stream {
    type Interfaces = (IBStream,);
}

impl IBStreamTrait for Stream {
    unsafe fn read(&self, _buffer: *mut c_void, _count: i32, _read: *mut i32) -> tresult {
        kNotImplemented
    }

    unsafe fn write(&self, buffer: *mut c_void, count: i32, written: *mut i32) -> tresult {
        let Ok(length) = usize::try_from(count) else { return kInvalidArgument };
        if buffer.is_null() {
            return kInvalidArgument;
        }
        // SAFETY: the framework hands over so many bytes, and a number or none.
        unsafe {
            lock(&self.0).extend_from_slice(std::slice::from_raw_parts(buffer.cast::<u8>(), length));
            if let Some(written) = written.as_mut() {
                *written = count;
            }
        }
        kResultOk
    }

    unsafe fn seek(&self, _position: i64, _mode: i32, _result: *mut i64) -> tresult {
        kNotImplemented
    }

    unsafe fn tell(&self, _position: *mut i64) -> tresult {
        kNotImplemented
    }
}

/// Writes bytes to a host's stream.
///
/// # Safety
/// The stream is one or null.
pub(super) unsafe fn write(stream: *mut IBStream, bytes: &[u8]) -> tresult {
    // SAFETY: as the caller says; the bytes are only read.
    unsafe {
        let (Some(stream), Ok(count)) = (ComRef::from_raw(stream), i32::try_from(bytes.len())) else { return kInvalidArgument };
        let mut written = 0;
        let result = stream.write(bytes.as_ptr().cast_mut().cast(), count, &raw mut written);
        if result == kResultOk && written != count { kResultFalse } else { result }
    }
}
