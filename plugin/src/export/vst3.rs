//! The VST3 entry: the framework's plugins, with what it lacks put beside it.

#![expect(unsafe_code, reason = "hosts and the framework hand over pointers, and are asked through tables of functions")]

mod block_room;
mod controller;
mod controller_values;
mod further_buses;
mod hosted;
mod make;
mod places;
mod processor;
mod stream;
mod view;

use crate::export::{Promenade, PromenadeMany, PromenadeMany64, guard::guard, kind::COUNT};
use crate::parameter::source_knob::{MANY_FURTHER, MOST_FURTHER};
use make::make;
use nice_plug::wrapper::setup_logger;
use nice_plug::wrapper::vst3::PluginInfo;
use nice_plug::wrapper::vst3::vst3::Steinberg::{
    FIDString, FUnknown, IPluginFactory, IPluginFactory2, IPluginFactory2Trait, IPluginFactory3, IPluginFactory3Trait,
    IPluginFactoryTrait, PClassInfo, PClassInfo2, PClassInfoW, PFactoryInfo, TUID, kInvalidArgument, kResultFalse, kResultOk,
    tresult,
};
use nice_plug::wrapper::vst3::vst3::{Class, ComWrapper};
use std::ffi::c_void;

/// Makes the plugins, in the order of [`KINDS`](crate::export::kind::KINDS).
struct Factory([PluginInfo; COUNT]);

/// Makes a plugin of a kind whose interface of a number goes where the host wants it.
type Make = unsafe fn(kind: usize, iid: *const TUID, obj: *mut *mut c_void) -> Option<tresult>;

/// Those of all plugins, in the same order.
const MAKERS: [Make; COUNT] = [make::<0>, make::<MANY_FURTHER>, make::<MOST_FURTHER>];

impl Class for Factory {
    type Interfaces = (IPluginFactory, IPluginFactory2, IPluginFactory3);
}

impl Factory {
    /// Fills in what a host asks of the class of a number.
    fn fill<T>(&self, number: i32, info: *mut T, make: impl FnOnce(&PluginInfo) -> T) -> tresult {
        let class = usize::try_from(number).ok().and_then(|number| self.0.get(number));
        // SAFETY: the host hands over room for it or none.
        match (unsafe { info.as_mut() }, class) {
            (Some(info), Some(class)) => {
                *info = make(class);
                kResultOk
            }
            _ => kInvalidArgument,
        }
    }
}

impl IPluginFactoryTrait for Factory {
    unsafe fn getFactoryInfo(&self, info: *mut PFactoryInfo) -> tresult {
        self.fill(0, info, PluginInfo::create_factory_info)
    }

    unsafe fn countClasses(&self) -> i32 {
        i32::try_from(COUNT).unwrap_or(0)
    }

    unsafe fn getClassInfo(&self, index: i32, info: *mut PClassInfo) -> tresult {
        self.fill(index, info, PluginInfo::create_class_info)
    }

    unsafe fn createInstance(&self, cid: FIDString, iid: FIDString, obj: *mut *mut c_void) -> tresult {
        if obj.is_null() || iid.is_null() {
            return kInvalidArgument;
        }
        // SAFETY: the host hands over a class's number or none.
        let wanted = unsafe { cid.cast::<[u8; 16]>().as_ref() };
        let Some(kind) = self.0.iter().position(|class| Some(class.cid) == wanted) else { return kInvalidArgument };
        // SAFETY: the host hands over what else it wants.
        guard(None, || unsafe { MAKERS[kind](kind, iid.cast(), obj) }).unwrap_or(kResultFalse)
    }
}

impl IPluginFactory2Trait for Factory {
    unsafe fn getClassInfo2(&self, index: i32, info: *mut PClassInfo2) -> tresult {
        self.fill(index, info, PluginInfo::create_class_info_2)
    }
}

impl IPluginFactory3Trait for Factory {
    unsafe fn getClassInfoUnicode(&self, index: i32, info: *mut PClassInfoW) -> tresult {
        self.fill(index, info, PluginInfo::create_class_info_unicode)
    }

    unsafe fn setHostContext(&self, _context: *mut FUnknown) -> tresult {
        kResultOk
    }
}

/// Where hosts find the plugin.
#[unsafe(no_mangle)]
extern "system" fn GetPluginFactory() -> *mut c_void {
    let factory = ComWrapper::new(Factory([
        PluginInfo::for_plugin::<Promenade>(),
        PluginInfo::for_plugin::<PromenadeMany>(),
        PluginInfo::for_plugin::<PromenadeMany64>(),
    ]));
    factory.to_com_ptr::<IPluginFactory>().map_or(std::ptr::null_mut(), |factory| factory.into_raw().cast())
}

/// Declares what hosts call when they load the library and let go of it.
macro_rules! module {
    ($system:meta, $abi:literal, $enter:ident ($($handle:ty)?), $leave:ident) => {
        #[cfg($system)]
        #[unsafe(no_mangle)]
        extern $abi fn $enter($(_library: $handle)?) -> bool {
            setup_logger::<Promenade>();
            true
        }

        #[cfg($system)]
        #[unsafe(no_mangle)]
        extern $abi fn $leave() -> bool {
            true
        }
    };
}

module!(all(target_family = "unix", not(target_os = "macos")), "C", ModuleEntry(*mut c_void), ModuleExit);
module!(target_os = "macos", "C", bundleEntry(*mut c_void), bundleExit);
module!(target_os = "windows", "system", InitDll(), ExitDll);
