//! Keeps the plugin's library in memory once a host has loaded it.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Threads of the host that have run code of the plugin run its thread-local destructors when they end. On Linux a host that
    // has unloaded the library by then crashes there; the linker flag turns unloading into a no-op, as it is on macOS.
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
