//! The built plugin in a host without a screen, for the tests in `tests/`.
//!
//! `PROMENADE_BUNDLES` names the folder with `Promenade.clap` and `Promenade.vst3`; without it the shared library that cargo
//! has just built beside the tests is loaded.

#[cfg(target_os = "linux")]
pub mod bare;
pub mod bundle;
mod library;
pub mod listener;
pub mod memory;
mod played;
pub mod screen;
pub mod signal;
pub mod sources;

pub use library::in_library;
pub use played::{ClapHost, Host, Knob, Vst3, edit_state, host_id, render};
pub use promenade_host::{Format, Setup};

/// Runs generic tests in both formats: `fn name<H: Host>()` becomes `clap::name` and `vst3::name`. An attribute `ignore` before
/// the names is that of all.
#[macro_export]
macro_rules! in_both_formats {
    (#[ignore = $why:literal] $($name:ident),+ $(,)?) => {
        $crate::in_both_formats!(@modules [#[ignore = $why]] $($name)+);
    };
    (@modules $ignore:tt $($name:ident)+) => {
        mod clap {
            $($crate::in_both_formats!(@test $ignore ClapHost $name);)+
        }
        mod vst3 {
            $($crate::in_both_formats!(@test $ignore Vst3 $name);)+
        }
    };
    (@test [$($ignore:tt)*] $host:ident $name:ident) => {
        #[test]
        $($ignore)*
        fn $name() {
            super::$name::<$crate::$host>();
        }
    };
    ($($name:ident),+ $(,)?) => {
        $crate::in_both_formats!(@modules [] $($name)+);
    };
}
