//! Hosts without a screen that load the built plugin, for the tests in `tests/`.
//!
//! `PROMENADE_BUNDLES` names the folder with `Promenade.clap` and `Promenade.vst3`; without it the shared library that cargo has just
//! built beside the tests is loaded.

mod bundle;
mod clap_host;
mod host;
mod library;
pub mod signal;
mod vst3;

pub use clap_host::ClapHost;
pub use host::{Host, Knob, Setup, edit_state, host_id, render};
pub use library::in_library;
pub use vst3::Vst3;

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
