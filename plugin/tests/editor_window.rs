//! The editor's window, opened and closed as hosts do.

use nice_plug::context::PluginApi;
use nice_plug::context::gui::{GuiContext, GuiContextInner};
use nice_plug::editor::{Editor, EditorHandle};
use nice_plug::plugin::PluginState;
use nice_plug::prelude::ParamPtr;
use promenade_plugin::editor::{Instance, PromenadeEditor};
use promenade_plugin::osc::Osc;
use promenade_plugin::playing::loader::Loader;
use promenade_plugin::project::params::PromenadeParams;
use promenade_plugin::telemetry::Telemetry;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A host that takes no notice.
struct Deaf;

#[expect(unsafe_code, reason = "the framework's own signatures; nothing is dereferenced")]
impl GuiContextInner for Deaf {
    fn plugin_api(&self) -> PluginApi {
        PluginApi::Standalone
    }
    unsafe fn raw_begin_set_parameter(&self, _param: ParamPtr) {}
    unsafe fn raw_set_parameter_normalized(&self, _param: ParamPtr, _normalized: f32) {}
    unsafe fn raw_end_set_parameter(&self, _param: ParamPtr) {}
    fn get_state(&self) -> PluginState {
        PluginState { version: String::new(), params: [].into(), fields: [].into() }
    }
    fn set_state(&self, _state: PluginState) {}
    fn request_restart(&self) {}
}

/// Waits until something is so.
fn comes(what: impl Fn() -> bool) -> bool {
    let started = Instant::now();
    while !what() && started.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
    }
    what()
}

/// Pages of memory that the process has.
fn resident_pages() -> usize {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split_whitespace().nth(1).and_then(|pages| pages.parse().ok()).unwrap_or(0)
}

mod needs_screen {
    use super::*;

    #[test]
    #[cfg_attr(target_os = "linux", ignore = "needs a screen")]
    fn a_closed_editor_leaves_nothing_behind() {
        let times = std::env::var("PROMENADE_EDITOR_OPENINGS").ok().and_then(|text| text.parse().ok()).unwrap_or(8);
        let params = Arc::new(PromenadeParams::default());
        let loader = Loader::new(Arc::clone(&params));
        loader.activate(48_000.0, promenade_plugin::playing::output::Output::Binaural);
        let telemetry = Telemetry::new();
        let repaint = loader.repaint.clone();
        let plugin = Arc::new(());
        let editor = PromenadeEditor::new(Instance {
            params: Arc::clone(&params),
            loader: Arc::clone(&loader),
            telemetry: Arc::clone(&telemetry),
            osc: Osc::new(Arc::clone(&params), Arc::clone(&loader.exchange), Arc::default(), Arc::clone(&telemetry)),
            host_side: Arc::default(),
            account: Arc::default(),
            session: Arc::default(),
            repaint,
            plugin: Arc::downgrade(&plugin),
        });
        let size = editor.size();
        let counts = || (Arc::strong_count(&params), Arc::strong_count(&loader), Arc::strong_count(&telemetry));
        let before = counts();
        for opening in 0..times {
            let gui = Arc::new(Deaf);
            let spawned = editor.spawn(None, false, None, GuiContext::new(gui.clone()), None).unwrap();
            spawned.handle.show(&spawned.window).unwrap();
            assert!(comes(|| telemetry.watched.is_on()), "the window was not built");
            assert!(counts() > before);
            assert_eq!(editor.size(), size, "the window is as large as the host was told");
            drop(spawned);
            assert!(comes(|| counts() == before), "opening {opening} leaves {:?}, {before:?} were there before", counts());
            assert!(comes(|| Arc::strong_count(&gui) == 1), "opening {opening} keeps the host's context");
            assert!(!telemetry.watched.is_on() && !loader.attention.watched.is_on());
            eprintln!("after opening {opening}: {} pages", resident_pages());
        }
    }
}
