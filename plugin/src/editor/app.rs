//! The open editor: what it keeps between two pictures, and the layout of its panels.

use super::ctx::{Ctx, Instance, Owed, Selection};
use super::drawer::{self, panels};
use super::dropped::{self, DropTarget};
use super::host::{Host, landed};
use super::theme::{Palette, dress, set_fonts};
use super::{banner, header, mapping, side};
use super::{
    estimate::estimate, geometry::Geometry, gesture::Gestures, meter::Meters, panel::Panel, presets::Presets, pump::Pump,
    scenes::Scenes, source_path::SourcePath, view::View, views::Views,
};
use crate::history::{Session, user_state::UserState};
use crate::library::{lister::Lister, outline::Outline};
use crate::parameter::cast::narrow;
use crate::project::settings::{EditorSettings, Theme};
use crate::project::{exchange::Choices, preferences::Preferences, walk::SavedWalk};
use crate::telemetry::Frame;
use crate::worker::{LOADER, TaskHandle, lock::lock};
use egui::{CentralPanel, Event, InputState, Key, KeyboardShortcut, Margin, Modifiers, Ui};
use nice_plug::context::gui::GuiContext;
use nice_plug::nice_error;
use nice_plug_egui::NiceEguiApp;
use nice_plug_egui::baseview::{HandlerError, WindowSize};
use promenade_core::Scene;
use std::cell::RefCell;
use std::path::Path;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
const REDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);

/// Whether the user begins a change.
fn acts(input: &InputState) -> bool {
    let begins = |event: &Event| {
        matches!(
            event,
            Event::Key { pressed: true, .. } | Event::Text(_) | Event::MouseWheel { .. } | Event::PointerButton { .. }
        )
    };
    input.events.iter().any(begins)
}

/// The host is taken not to ask for sound when the audio thread has sent no picture for this long, seconds.
const SILENT_S: f64 = 0.4;

/// Sample rate of sound that is to come from a host that has not told it, Hz.
const USUAL_HZ: f64 = 48_000.0;

/// A window narrower than this is narrow, points.
const NARROW: f32 = 880.0;

/// Until hosts have taken a value, a change looks as if it were none: it is recorded when they have, this long after it was
/// made at least, and at most, seconds. Busy ones take some time, and those that play nothing take none.
const LANDING_S: f64 = 0.25;
const LONGEST_LANDING_S: f64 = 3.0;

/// How often it is looked whether the host has taken a slot.
const OWED_REST: Duration = Duration::from_millis(30);

/// A picture that is drawn before a host has brought up its own window is lost: this long after it was opened ...
const OPENING_S: f64 = 2.0;
/// ... it is drawn this often, whether anything is new or not.
const OPENING_REST: Duration = Duration::from_millis(200);

thread_local! {
    /// Dropped when the window's thread has ended.
    static THREAD: RefCell<Option<Sender<()>>> = const { RefCell::new(None) };
}

/// Everything that lives as long as one window.
pub(super) struct App {
    instance: Instance,
    geometry: Arc<Geometry>,
    gui: Option<GuiContext>,
    task: Option<TaskHandle>,
    /// What the window's thread holds until it ends.
    thread: Option<Sender<()>>,
    frame: Box<Frame>,
    gestures: Gestures,
    selection: Selection,
    settings: EditorSettings,
    preferences: Preferences,
    /// Times that a host has restored the settings.
    restores: u64,
    dressed: Option<Theme>,
    choices: Option<Choices>,
    opened: Instant,
    /// Whether a picture was drawn. Before that nothing may ask for one: the window library waits for ever for the answer to a
    /// request that it makes before the window is on the screen, and the editor would stay blank.
    is_shown: bool,
    pump: Option<Pump>,
    dropped: Option<DropTarget>,
    /// When the audio thread last sent a picture, seconds since the window was opened.
    heard_s: f64,
    parts: Parts,
    /// From the first picture on.
    views: Option<Arc<Views>>,
    /// What is kept between two windows, from the first picture on.
    session: Session,
    /// The walls of the scene that is played.
    outline: (Weak<Scene>, Outline),
    owed: Option<Owed>,
    owed_walk: Option<SavedWalk>,
    /// The state before the change that the user is making.
    before: Option<UserState>,
    /// When the user last did something, seconds since the window was opened.
    acted_s: f64,
}

/// What is shown, with what it keeps between two pictures.
struct Parts {
    meters: Meters,
    presets: Presets,
    source_path: SourcePath,
    view: View,
    scenes: Scenes,
    panels: Vec<Box<dyn Panel>>,
}

impl Parts {
    /// Takes a file that was dropped onto the window.
    fn take(&mut self, ctx: &mut Ctx<'_>, file: &Path) {
        let taken = dropped::take(ctx, &mut self.scenes, &mut self.presets, file);
        self.scenes.tell(taken.err());
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        header::show(ui, ctx, &mut self.presets);
        banner::show(ui, ctx);
        if *ctx.list_is_open() {
            self.scenes.show(ui, ctx);
        }
        side::right(ui, ctx, &mut self.source_path, &mut self.meters);
        drawer::show(ui, ctx, &mut self.panels);
        let centre = egui::Frame::new().fill(ctx.palette.ground).inner_margin(Margin::ZERO);
        let attention = ctx.scene.and_then(|scene| ctx.instance.loader.attention.in_scene(scene));
        CentralPanel::default().frame(centre).show(ui, |ui| self.view.show(ui, ctx, attention.as_deref()));
        if std::mem::take(&mut ctx.selection.relist) {
            self.scenes.list();
        }
    }
}

/// Undo and redo by their keys, which a text that is being written has for itself.
fn undo_or_redo(ui: &Ui, ctx: &mut Ctx<'_>) {
    if !ui.ctx().text_edit_focused() {
        if ui.input_mut(|input| input.consume_shortcut(&REDO)) {
            ctx.redo();
        } else if ui.input_mut(|input| input.consume_shortcut(&UNDO)) {
            ctx.undo();
        }
    }
}

impl App {
    /// An editor that has no window yet.
    pub(super) fn new(instance: Instance, geometry: Arc<Geometry>, thread: Sender<()>) -> Self {
        let (settings, restores) = instance.params.editor.get();
        let scenes = Scenes::new(Lister::new(instance.repaint.clone()));
        let settings = settings.within_reason();
        Self {
            settings,
            preferences: Preferences::now(),
            instance,
            geometry,
            gui: None,
            task: None,
            thread: Some(thread),
            frame: Box::default(),
            gestures: Gestures::default(),
            selection: Selection::default(),
            restores,
            dressed: None,
            choices: None,
            opened: Instant::now(),
            is_shown: false,
            pump: None,
            dropped: None,
            heard_s: f64::NEG_INFINITY,
            parts: Parts {
                meters: Meters::default(),
                presets: Presets::default(),
                source_path: SourcePath::default(),
                view: View::default(),
                scenes,
                panels: panels(),
            },
            views: None,
            session: Session::default(),
            outline: <(Weak<Scene>, Outline)>::default(),
            owed: None,
            owed_walk: None,
            before: None,
            acted_s: 0.0,
        }
    }

    /// Takes what the host has restored, or gives what the user has changed.
    fn keep_settings(&mut self) {
        let editor = &self.instance.params.editor;
        let (kept, restores) = editor.get();
        if restores != self.restores {
            (self.settings, self.restores) = (kept.within_reason(), restores);
        } else if kept != self.settings {
            let _restored_meanwhile = editor.replace(self.settings.clone(), restores);
        }
    }

    /// Starts what an open window keeps running.
    fn begin(&mut self, egui_ctx: &egui::Context) {
        let Instance { repaint, telemetry, loader, .. } = &self.instance;
        let rate_hz = loader.sample_rate_hz().unwrap_or(USUAL_HZ);
        self.views = Some(Arc::new(Views::new(repaint, &telemetry.sound, rate_hz)));
        self.instance.params.project.look_at();
        self.session = std::mem::take(&mut lock(&self.instance.session));
        telemetry.watched.set(true);
        loader.attention.watched.set(true);
        self.parts.scenes.list();
        let pump = Pump::start(repaint.clone(), egui_ctx.clone());
        self.pump = pump.inspect_err(|error| nice_error!("no thread to wake the editor: {error}")).ok();
    }

    /// Takes theme and scale as they are set, here or in another window.
    fn dress(&mut self, egui_ctx: &egui::Context, frame: &mut nice_plug_egui::Frame) -> &'static Palette {
        let Preferences { theme, scale } = self.preferences;
        let palette = Palette::of(theme);
        if self.dressed != Some(theme) {
            self.dressed = Some(theme);
            dress(egui_ctx, palette);
            frame.set_clear_color(palette.panel.into());
            egui_ctx.request_repaint();
        }
        // The framework then asks the host for a window that is as much larger.
        if egui_ctx.zoom_factor() != scale {
            egui_ctx.set_zoom_factor(scale);
        }
        palette
    }

    /// Takes what the audio thread has sent. Whether the host asks for sound.
    fn hear(&mut self, views: &Views, now_s: f64) -> bool {
        if self.instance.telemetry.fetch(&mut self.frame) {
            self.heard_s = now_s;
            views.measure_loudness();
            if self.frame.playing {
                let [left, right] = self.frame.input_peak;
                self.session.waveform.add(self.frame.transport_s, left.max(right));
            }
        } else {
            (self.frame.input_peak, self.frame.output_peak) = ([0.0; 2], [0.0; 2]);
        }
        self.parts.meters.advance(self.frame.input_peak, self.frame.output_peak, now_s);
        now_s - self.heard_s < SILENT_S
    }

    /// Asks for the next picture, where one is due although nothing happens: in `rest_s` seconds for a gesture.
    fn ask_again(&self, egui_ctx: &egui::Context, rest_s: Option<f64>, now_s: f64) {
        if let Some(rest_s) = [rest_s, self.parts.meters.rest_s()].into_iter().flatten().min_by(f64::total_cmp) {
            egui_ctx.request_repaint_after(Duration::from_secs_f64(rest_s));
        }
        if self.owed.is_some() || self.owed_walk.is_some() || self.instance.loader.exchange.restoring.is_on() {
            egui_ctx.request_repaint_after(OWED_REST);
        }
        if now_s < OPENING_S {
            egui_ctx.request_repaint_after(OPENING_REST);
        }
    }

    /// Records the change that the user has made, once hosts have taken it.
    fn record_change(&mut self, ui: &Ui, now_s: f64) {
        let params = &self.instance.params;
        if self.before.is_some() && self.gestures.are_over() && !ui.input(|input| input.pointer.any_down()) {
            let past_s = now_s - self.acted_s;
            let has = |parameter, value| params.hosted(parameter) == landed(params, parameter, value);
            if past_s < LANDING_S || !self.gestures.have_landed(has) && past_s < LONGEST_LANDING_S {
                let rest_s = (LANDING_S - past_s).max(OWED_REST.as_secs_f64());
                ui.ctx().request_repaint_after(Duration::from_secs_f64(rest_s));
            } else if let Some(before) = self.before.take() {
                self.gestures.forget_sent();
                self.session.history.record(before, &UserState::of(params));
            }
        }
    }
}

impl NiceEguiApp for App {
    fn build(
        &mut self,
        egui_ctx: egui::Context,
        gui: GuiContext,
        frame: &mut nice_plug_egui::Frame,
    ) -> Result<(), HandlerError> {
        THREAD.set(self.thread.take());
        set_fonts(&egui_ctx);
        egui_ctx.options_mut(|options| options.zoom_with_keyboard = false);
        let size = frame.baseview_window().size();
        self.geometry.resized(size.physical.into(), size.scale_factor);
        self.geometry.held().window = mapping::number(frame.baseview_window());
        mapping::map(frame.baseview_window());
        self.dropped = DropTarget::new(frame.baseview_window(), self.instance.repaint.clone());
        self.gui = Some(gui);
        self.task = LOADER
            .add(self.instance.loader.clone())
            .inspect_err(|error| nice_error!("no thread to load scenes from the editor: {error}"))
            .ok();
        Ok(())
    }

    fn ui(&mut self, ui: &mut Ui, frame: &mut nice_plug_egui::Frame) {
        if self.geometry.held().closing {
            return ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        let Some(gui) = self.gui.clone().filter(|_| self.instance.plugin.strong_count() > 0) else { return };
        let now_s = self.opened.elapsed().as_secs_f64();
        if !std::mem::replace(&mut self.is_shown, true) {
            self.begin(ui.ctx());
        }
        let Some(views) = self.views.clone() else { return };
        self.keep_settings();
        self.preferences = Preferences::now();
        let preferences = self.preferences;
        let palette = self.dress(ui.ctx(), frame);
        let sounding = self.hear(&views, now_s);
        let listing = self.parts.scenes.listing();
        let loader = &self.instance.loader;
        let (scene, walk, source_walks) = (loader.scene(), loader.walk(), loader.source_walks());
        let params = Arc::clone(&self.instance.params);
        let sources = params.sources.saved.get().0;
        let now = scene.as_ref().map_or_else(Weak::new, Arc::downgrade);
        if !Weak::ptr_eq(&self.outline.0, &now) {
            let outline = scene.as_ref().map_or_else(Outline::default, |scene| Outline::of(scene.anchors()));
            self.outline = (now, outline);
        }
        if !sounding {
            estimate(&mut self.frame, &params, &self.gestures, walk.as_deref());
        }
        let mut ctx = Ctx {
            instance: &self.instance,
            host: Host { params: &params, setter: gui.param_setter(), plugin: &self.instance.plugin },
            gui: &gui,
            frame: &self.frame,
            scene: scene.as_ref(),
            listing: &listing,
            walk: walk.as_ref(),
            source_walks: source_walks.as_ref(),
            palette,
            settings: &mut self.settings,
            preferences: &mut self.preferences,
            selection: &mut self.selection,
            history: &mut self.session.history,
            preset: &mut self.session.preset,
            waveform: &self.session.waveform,
            sources: &sources,
            outline: &self.outline.1,
            owed: &mut self.owed,
            owed_walk: &mut self.owed_walk,
            gestures: &mut self.gestures,
            views: &views,
            task: self.task.as_ref(),
            now_s,
            sounding,
            shows_time: false,
            narrow: ui.available_width() < NARROW,
        };
        if ui.input(acts) {
            self.acted_s = now_s;
            self.before.get_or_insert_with(|| UserState::of(&params));
        }
        undo_or_redo(ui, &mut ctx);
        ctx.report_remote();
        ctx.pay();
        for file in self.dropped.as_ref().map(DropTarget::files).unwrap_or_default() {
            self.parts.take(&mut ctx, &file);
        }
        self.parts.show(ui, &mut ctx);
        self.instance.telemetry.shows_time.set(ctx.shows_time);
        let choices = ctx.instance.loader.choices();
        if self.choices.replace(choices) != Some(choices) {
            ctx.refresh();
        }
        let rest_s = ctx.gestures.end_frame(&ctx.host, now_s);
        self.ask_again(ui.ctx(), rest_s, now_s);
        self.record_change(ui, now_s);
        self.geometry.types(ui.ctx().text_edit_focused());
        self.keep_settings();
        if self.preferences != preferences {
            self.preferences.set();
            ui.ctx().request_repaint();
        }
    }

    fn resized(&mut self, size: WindowSize) {
        let own = f64::from(self.preferences.scale);
        self.geometry.resized(size.physical.into(), size.scale_factor / own);
        (self.settings.width, self.settings.height) = (narrow(size.logical.width), narrow(size.logical.height));
    }
}

impl Drop for App {
    /// The window is gone: nothing is watched any more, and no gesture stays open in the host.
    fn drop(&mut self) {
        drop(self.pump.take());
        drop(self.dropped.take());
        self.instance.telemetry.watched.set(false);
        if self.views.take().is_some() {
            *lock(&self.instance.session) = std::mem::take(&mut self.session);
        }
        self.instance.loader.attention.watched.set(false);
        self.instance.loader.exchange.restoring.set(false);
        self.geometry.closed();
        if let Some(gui) = self.gui.take() {
            let host = Host { params: &self.instance.params, setter: gui.param_setter(), plugin: &self.instance.plugin };
            self.gestures.close(&host);
        }
    }
}
