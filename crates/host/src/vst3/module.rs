//! The library of a VST3 bundle.
#![expect(unsafe_code, reason = "loading a shared library runs its code")]

use libloading::Library;
use std::mem::ManuallyDrop;
use std::path::Path;
use vst3::ComPtr;
use vst3::Steinberg::IPluginFactory;
use vst3_host::discovery::get_vst3_binary_path;

/// A handle to the library of a bundle, which stays loaded for good: threads that an editor has left behind may still run its
/// code when the last instance is gone.
pub(crate) struct Module(ManuallyDrop<Library>);

impl Module {
    pub(crate) fn open(bundle: &Path) -> Result<Self, String> {
        let binary = get_vst3_binary_path(bundle).map_err(|e| e.to_string())?;
        // SAFETY: the caller names the plugin whose code is to run.
        let library = unsafe { Library::new(binary) }.map_err(|e| e.to_string())?;
        Ok(Self(ManuallyDrop::new(library)))
    }

    /// The factory of the module, which an instance elsewhere has entered.
    pub(crate) fn factory(&self) -> Result<ComPtr<IPluginFactory>, String> {
        // SAFETY: every VST3 module has this function with this signature.
        let factory = unsafe {
            let get = self.0.get::<unsafe extern "system" fn() -> *mut IPluginFactory>(b"GetPluginFactory");
            ComPtr::from_raw(get.map_err(|e| e.to_string())?())
        };
        factory.ok_or_else(|| "the module has no factory".to_owned())
    }
}
