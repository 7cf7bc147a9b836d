//! Values of texts, which VST3's edit controllers have and vst3-host does not hand on.
//!
//! They are asked of a second instance of the same class that is never activated, made in the library that the first has
//! loaded.
#![expect(unsafe_code, reason = "VST3's interfaces are C++ objects")]

use super::module::Module;
use std::ffi::{c_char, c_void};
use std::ptr;
use std::sync::Arc;
use vst3::Steinberg::Vst::{
    IComponent, IComponentTrait, IEditController, IEditControllerTrait, IHostApplication, IHostApplicationTrait, String128,
};
use vst3::Steinberg::{
    FUnknown, IPluginBaseTrait, IPluginFactory, IPluginFactory3, IPluginFactory3Trait, IPluginFactoryTrait, TUID,
    kNotImplemented, kResultOk, tresult,
};
use vst3::{Class, ComPtr, ComWrapper, Interface};

/// UTF-16 units of a text, with the zero at its end, that VST3's strings hold.
const TEXT_UNITS: usize = 128;

/// The host as a plugin sees it.
struct Application;

impl Class for Application {
    type Interfaces = (IHostApplication,);
}

impl IHostApplicationTrait for Application {
    unsafe fn getName(&self, name: *mut String128) -> tresult {
        // SAFETY: a plugin hands a string of its own or nothing.
        if let Some(name) = unsafe { name.as_mut() } {
            let text = "Promenade".encode_utf16().chain([0]);
            name.iter_mut().zip(text).for_each(|(unit, from)| *unit = from);
        }
        kResultOk
    }

    unsafe fn createInstance(&self, _class: *mut TUID, _interface: *mut TUID, object: *mut *mut c_void) -> tresult {
        // SAFETY: as above.
        if let Some(object) = unsafe { object.as_mut() } {
            *object = ptr::null_mut();
        }
        kNotImplemented
    }
}

/// A second instance of a plugin, asked about texts only.
pub(crate) struct Controller {
    controller: ComPtr<IEditController>,
    /// The component, where the controller is an object of its own.
    component: Option<ComPtr<IComponent>>,
    _application: ComWrapper<Application>,
    _factory: ComPtr<IPluginFactory>,
    _module: Arc<Module>,
}

impl Controller {
    /// Makes a second instance of a class, by its id in hexadecimal digits, while the first is alive.
    pub(crate) fn of_loaded(module: Arc<Module>, class: &str) -> Result<Self, String> {
        let class = class_id(class).ok_or("the class id is no 32 hexadecimal digits")?;
        let factory = module.factory()?;
        let application = ComWrapper::new(Application);
        let context = application.to_com_ptr::<IHostApplication>().ok_or("there is no host application")?;
        let context: *mut FUnknown = context.as_ptr().cast();
        // SAFETY: the objects are alive, and each is initialised once before it is used.
        unsafe {
            if let Some(factory) = factory.cast::<IPluginFactory3>() {
                factory.setHostContext(context);
            }
            let component: ComPtr<IComponent> = create(&factory, &class).ok_or("the component is not made")?;
            if component.initialize(context) != kResultOk {
                return Err("the component is not initialised".to_owned());
            }
            if let Some(controller) = component.cast::<IEditController>() {
                return Ok(Self { controller, component: None, _application: application, _factory: factory, _module: module });
            }
            let mut class: TUID = [0; 16];
            let found = component.getControllerClassId(&mut class) == kResultOk;
            let controller: Option<ComPtr<IEditController>> = found.then(|| create(&factory, &class)).flatten();
            match controller.filter(|controller| controller.initialize(context) == kResultOk) {
                Some(controller) => {
                    let component = Some(component);
                    Ok(Self { controller, component, _application: application, _factory: factory, _module: module })
                }
                None => {
                    component.terminate();
                    Err("the controller is not made".to_owned())
                }
            }
        }
    }

    /// The value of a text, 0 to 1 if the plugin keeps to the format; `None` where it does not understand it.
    pub(crate) fn value_of(&mut self, id: u32, text: &str) -> Option<f64> {
        let mut units: Vec<u16> = text.encode_utf16().chain([0]).collect();
        if units.len() > TEXT_UNITS {
            return None;
        }
        let mut value = f64::NAN;
        // SAFETY: the text ends in a zero, and the plugin writes one number.
        let result = unsafe { self.controller.getParamValueByString(id, units.as_mut_ptr().cast(), &mut value) };
        (result == kResultOk).then_some(value)
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        // SAFETY: both were initialised; where they are one object it is terminated once.
        unsafe {
            self.controller.terminate();
            if let Some(component) = &self.component {
                component.terminate();
            }
        }
    }
}

/// # Safety
/// The factory is alive.
unsafe fn create<I: Interface>(factory: &ComPtr<IPluginFactory>, class: &TUID) -> Option<ComPtr<I>> {
    let mut object: *mut c_void = ptr::null_mut();
    // SAFETY: both ids are 16 bytes, and an object of that interface comes back or none.
    unsafe {
        let interface: *const c_char = I::IID.as_ptr().cast();
        let result = factory.createInstance(class.as_ptr(), interface, &mut object);
        (result == kResultOk).then(|| ComPtr::from_raw(object.cast())).flatten()
    }
}

/// The bytes of a class id as they are in memory: on Windows its first three fields are little-endian.
fn class_id(text: &str) -> Option<TUID> {
    const FIELDS: [usize; 16] = [3, 2, 1, 0, 5, 4, 7, 6, 8, 9, 10, 11, 12, 13, 14, 15];
    if text.len() != 32 || !text.is_ascii() {
        return None;
    }
    let mut id: TUID = [0; 16];
    for (index, byte) in id.iter_mut().enumerate() {
        let from = if cfg!(windows) { FIELDS[index] } else { index };
        let value = u8::from_str_radix(&text[2 * from..2 * from + 2], 16).ok()?;
        *byte = c_char::from_ne_bytes([value]);
    }
    Some(id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_id_is_32_hexadecimal_digits() {
        let id = class_id("000102030405060708090A0B0C0D0EFF").unwrap();
        assert_eq!(id[15].to_ne_bytes(), [0xFF]);
        assert_eq!(id[8].to_ne_bytes(), [0x08]);
        for wrong in ["", "00", "zz0102030405060708090A0B0C0D0EFF", "äääääääääääääääää"] {
            assert!(class_id(wrong).is_none(), "{wrong}");
        }
    }
}
