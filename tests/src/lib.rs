//! The built plugin in a host without a screen, for the tests in `tests/`.
//!
//! `PROMENADE_BUNDLES` names the folder with `Promenade.clap` and `Promenade.vst3`; without it the shared library that cargo has just
//! built beside the tests is loaded.

pub mod bundle;
mod library;
pub mod memory;
mod played;
pub mod screen;
pub mod signal;

pub use library::in_library;
pub use played::{ClapHost, Host, Knob, Vst3, edit_state, host_id, render};
pub use promenade_host::{Format, Setup};

/// Runs generic tests in both formats: `fn name<H: Host>()` becomes `clap::name` and `vst3::name`.
#[macro_export]
macro_rules! in_both_formats {
    ($($name:ident),+ $(,)?) => {
        mod clap {
            $(#[test]
            fn $name() {
                super::$name::<promenade_tests::ClapHost>();
            })+
        }
        mod vst3 {
            $(#[test]
            fn $name() {
                super::$name::<promenade_tests::Vst3>();
            })+
        }
    };
}
