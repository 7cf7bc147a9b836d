//! Head tracking and remote control over Open Sound Control, and the listener group.

use super::controls::{list, toggle};
use super::theme::{CONTROL, Palette};
use super::widgets::{button, columns, drop_down, field, labelled, note, switch, words};
use super::{ctx::Ctx, panel::Panel, words::Word};
use crate::listener::group;
use crate::osc::{Counts, Listening, OscStatus, Sending};
use crate::parameter::{Parameter, choices::GroupChoice};
use crate::project::adm_config::METRE_LIMITS;
use crate::project::osc_config::{Interface, OscConfig};
use crate::telemetry::members::{self, Member};
use crate::tracker::{Recenter, axes::AxisMap, custom::CustomArguments, format::TrackerFormat};
use egui::{ComboBox, DragValue, ScrollArea, Ui, Vec2};
use nice_plug::prelude::Enum;
use std::time::Duration;

/// How often what has come in is looked at, times a second.
const LOOKS_PER_S: f64 = 4.0;
const AXES: [Word; 3] = [Word::TrackerYaw, Word::TrackerPitch, Word::TrackerRoll];
const FULL_AXES: [&str; 3] = ["Yaw", "Pitch", "Roll"];

/// The settings of Open Sound Control, and what comes in.
#[derive(Default)]
pub(super) struct OscPanel {
    /// Text fields while they are typed in; taken when they are left.
    name: Option<String>,
    host: Option<String>,
    address: Option<String>,
    /// Why networks could not be allowed.
    refused: Option<String>,
    status: OscStatus,
    looked_s: f64,
}

impl Panel for OscPanel {
    fn title(&self) -> Word {
        Word::OscAndGroup
    }

    fn show(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>) {
        if ctx.now_s - self.looked_s >= 1.0 / LOOKS_PER_S {
            self.status = ctx.instance.osc.status();
            self.looked_s = ctx.now_s;
        }
        let (config, _) = ctx.params().osc.get();
        if ctx.params().receives_osc() || config.out.on {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(1.0 / LOOKS_PER_S));
        }
        columns(ui, [200.0, 252.0, 216.0], |ui, column| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| match column {
                0 => self.listening(ui, ctx, &config),
                1 => self.tracker(ui, ctx, &config),
                _ => {
                    self.sending(ui, ctx, &config);
                    group_of(ui, ctx);
                }
            });
        });
    }
}

/// Changes the settings and puts them in force.
fn change(ctx: &Ctx<'_>, change: impl FnOnce(&mut OscConfig)) {
    ctx.keep(&ctx.params().osc, change);
    ctx.instance.osc.apply();
}

/// A text that is taken when its field is left.
fn text(ui: &mut Ui, draft: &mut Option<String>, kept: &str, hint: &str) -> Option<String> {
    let mut shown = draft.clone().unwrap_or_else(|| kept.to_owned());
    let response = field(ui, &mut shown, hint);
    if response.changed() {
        *draft = Some(shown);
    }
    if response.lost_focus() { draft.take() } else { None }
}

/// A port that is taken when it has been typed or dragged.
fn port(ui: &mut Ui, kept: u16) -> Option<u16> {
    let mut port = kept;
    let drag = DragValue::new(&mut port).range(1..=u16::MAX).speed(0.2).update_while_editing(false);
    let response = ui.add_sized(Vec2::new(72.0, CONTROL), drag);
    (response.changed() && port != kept).then_some(port)
}

impl OscPanel {
    fn listening(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, config: &OscConfig) {
        ui.horizontal(|ui| {
            toggle(ui, ctx, Parameter::Osc);
            // Also where the host asks for no sound.
            ctx.instance.osc.apply();
            if let Some(port) = port(ui, config.port) {
                change(ctx, |c| c.port = port);
            }
        });
        labelled(ui, ctx.palette, Word::From, |ui| {
            let chosen = usize::from(config.interface == Interface::Any);
            if let Some(index) = words(ui, ctx.palette, &[Word::Here, Word::Network], chosen) {
                if index == 1 {
                    self.permit(ctx);
                } else {
                    change(ctx, |c| (c.interface, c.permit) = (Interface::Loopback, String::new()));
                }
            }
        });
        if self.status.confined {
            ui.colored_label(
                ctx.palette.warn,
                "The project asks for packets from networks. Until you allow it, only this machine is heard.",
            );
            if button(ui, ctx.palette, Word::Allow).clicked() {
                self.permit(ctx);
            }
        }
        if let Some(error) = &self.refused {
            ui.colored_label(ctx.palette.error, error);
        }
        labelled(ui, ctx.palette, Word::Name, |ui| {
            if let Some(name) = text(ui, &mut self.name, &config.name, "Instance name") {
                change(ctx, |c| c.name = name);
            }
        });
        labelled(ui, ctx.palette, Word::AdmObject, |ui| {
            let mut adm = config.adm;
            let object = DragValue::new(&mut adm.object).range(0..=9_999).speed(0.1).update_while_editing(false);
            ui.add_sized(Vec2::new(44.0, CONTROL), object);
            let metres = METRE_LIMITS.0..=METRE_LIMITS.1;
            let metres = DragValue::new(&mut adm.metres).range(metres).speed(0.05).suffix(" m").update_while_editing(false);
            ui.add_sized(Vec2::new(ui.available_width(), CONTROL), metres);
            if adm != config.adm {
                change(ctx, |c| c.adm = adm);
            }
        });
        self.heard(ui, ctx.palette);
    }

    /// What has come in at the port.
    fn heard(&self, ui: &mut Ui, palette: &Palette) {
        let status = &self.status;
        match &status.port.listening {
            Listening::Off => note(ui, palette, "Not listening"),
            Listening::Opening => note(ui, palette, "Opening the port"),
            Listening::At(address) => {
                let last = if status.port.last_address.is_empty() { "nothing yet" } else { &status.port.last_address };
                note(ui, palette, format!("At {address}: {:.0} messages/s, last {last}", status.port.messages_per_s));
            }
            Listening::Failed(reason) => {
                ui.colored_label(palette.error, reason);
            }
        }
        let Counts { clamped, garbage, last_garbage, unknown } = &status.counts;
        if garbage + unknown + clamped > 0 {
            let counts = [(*unknown, "not for this format"), (*garbage, "damaged"), (*clamped, "out of range")];
            let counts = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect::<Vec<_>>();
            note(ui, palette, counts.join(", "));
            if !last_garbage.is_empty() {
                note(ui, palette, last_garbage);
            }
        }
        if !status.note.is_empty() {
            ui.colored_label(palette.warn, &status.note);
        }
    }

    /// The user of this machine lets packets from networks in.
    fn permit(&mut self, ctx: &Ctx<'_>) {
        match ctx.instance.osc.permit() {
            Ok(permit) => {
                self.refused = None;
                change(ctx, |c| (c.interface, c.permit) = (Interface::Any, permit));
            }
            Err(error) => self.refused = Some(format!("the permission cannot be noted on this machine: {error}")),
        }
    }

    fn tracker(&mut self, ui: &mut Ui, ctx: &mut Ctx<'_>, config: &OscConfig) {
        labelled(ui, ctx.palette, Word::Format, |ui| {
            let chosen = TrackerFormat::ALL.iter().position(|format| *format == config.format).unwrap_or(0);
            let names = TrackerFormat::ALL.map(TrackerFormat::title);
            if let Some(format) = drop_down(ui, "format", names[chosen], names, chosen, |_| Word::Format.help())
                .map(|index| TrackerFormat::ALL[index])
            {
                change(ctx, |c| (c.format, c.port) = (format, format.port()));
            }
        });
        if config.format == TrackerFormat::Custom {
            self.custom(ui, ctx, config);
        }
        labelled(ui, ctx.palette, Word::UsedAs, |ui| list(ui, ctx, Parameter::Tracking));
        for (axis, name) in AXES.into_iter().enumerate() {
            labelled(ui, ctx.palette, name, |ui| axis_of(ui, ctx, config.axes, axis));
        }
        labelled(ui, ctx.palette, Word::Recentre, |ui| {
            let kinds =
                [(Word::RecentreYaw, Recenter::Yaw), (Word::RecentreAll, Recenter::Full), (Word::RecentreOff, Recenter::Off)];
            if button(ui, ctx.palette, Word::Now).clicked() {
                ctx.instance.osc.recenter(None);
            }
            let chosen = kinds.iter().position(|(_, kind)| *kind == config.recenter).unwrap_or(0);
            if let Some(index) = words(ui, ctx.palette, &kinds.map(|(word, _)| word), chosen) {
                change(ctx, |c| c.recenter = kinds[index].1);
            }
        });
        match self.status.tracker_s {
            Some(seconds) if seconds < 1.0 => note(ui, ctx.palette, "The tracker is heard"),
            Some(seconds) => {
                ui.colored_label(ctx.palette.warn, format!("The tracker was last heard {seconds:.0} s ago"));
            }
            None => note(ui, ctx.palette, "No tracker yet"),
        }
    }

    fn custom(&mut self, ui: &mut Ui, ctx: &Ctx<'_>, config: &OscConfig) {
        labelled(ui, ctx.palette, Word::Address, |ui| {
            if let Some(address) = text(ui, &mut self.address, &config.custom.address, "/head/ypr") {
                change(ctx, |c| c.custom.address = address);
            }
        });
        labelled(ui, ctx.palette, Word::Sends, |ui| {
            let kinds = CustomArguments::ALL;
            let chosen = kinds.iter().position(|kind| *kind == config.custom.arguments).unwrap_or(0);
            let names = kinds.map(CustomArguments::title);
            if let Some(index) = drop_down(ui, "arguments", names[chosen], names, chosen, |_| Word::Sends.help()) {
                change(ctx, |c| c.custom.arguments = kinds[index]);
            }
        });
    }

    fn sending(&mut self, ui: &mut Ui, ctx: &Ctx<'_>, config: &OscConfig) {
        ui.horizontal(|ui| {
            if switch(ui, ctx.palette, Word::SendToPort, config.out.on).clicked() {
                change(ctx, |c| c.out.on = !c.out.on);
            }
            if let Some(port) = port(ui, config.out.port) {
                change(ctx, |c| c.out.port = port);
            }
        });
        labelled(ui, ctx.palette, Word::Host, |ui| {
            if let Some(host) = text(ui, &mut self.host, &config.out.host, "127.0.0.1") {
                change(ctx, |c| c.out.host = host);
            }
        });
        if config.out.on && switch(ui, ctx.palette, Word::SendAdm, config.out.adm).clicked() {
            change(ctx, |c| c.out.adm = !c.out.adm);
        }
        match &self.status.sending {
            Sending::Off => (),
            Sending::Resolving => note(ui, ctx.palette, "Looking the host up"),
            Sending::To(address) => note(ui, ctx.palette, format!("To {address}: {} poses", self.status.sent)),
            Sending::Failed(reason) => {
                ui.colored_label(ctx.palette.error, reason);
            }
        }
    }
}

/// Which of the tracker's angles one of the head's is, and which way it counts.
fn axis_of(ui: &mut Ui, ctx: &Ctx<'_>, axes: AxisMap, axis: usize) {
    let source = usize::from(axes.order[axis]).min(2);
    let shown = FULL_AXES[source];
    ComboBox::from_id_salt(("axis", axis)).selected_text(shown).width(88.0).show_ui(ui, |ui| {
        for (number, name) in (0_u8..).zip(FULL_AXES) {
            if ui.selectable_label(axes.order[axis] == number, name).clicked() {
                change(ctx, |c| c.axes.order[axis] = number);
            }
        }
    });
    if switch(ui, ctx.palette, Word::Invert, axes.invert[axis]).clicked() {
        change(ctx, |c| c.axes.invert[axis] = !c.axes.invert[axis]);
    }
}

/// The listener group.
fn group_of(ui: &mut Ui, ctx: &mut Ctx<'_>) {
    labelled(ui, ctx.palette, Word::Of(Parameter::Group), |ui| super::controls::choice(ui, ctx, Parameter::Group, |_| None));
    let chosen = GroupChoice::from_index(ctx.index(Parameter::Group));
    let Some(number) = chosen.number() else {
        note(ui, ctx.palette, "Instances of one group share one listener");
        return;
    };
    toggle(ui, ctx, Parameter::Lead);
    let key = ctx.params().project.group(number);
    let words = match (ctx.frame.leads, ctx.is_on(Parameter::Lead), group::is_led(key)) {
        (true, ..) => "This instance's listener is the group's",
        (false, true, true) => "Another instance leads already; this one follows it",
        (false, false, true) => "Another instance leads; this one hears with its listener",
        (false, _, false) => "Nobody leads: this instance hears with its own listener",
    };
    note(ui, ctx.palette, words);
    // As many lines as the window has room for, and the others scrolled.
    egui::ScrollArea::vertical().id_salt("members").show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            for member in members::of_group(key) {
                named(ui, ctx, &member);
            }
        });
    });
}

/// An instance of a group by its track.
fn named(ui: &mut Ui, ctx: &Ctx<'_>, Member { track, leads }: &Member) {
    let (dot, _) = ui.allocate_exact_size(egui::Vec2::new(8.0, 14.0), egui::Sense::hover());
    let colour = track.colour.map_or(ctx.palette.soft, |[r, g, b]| egui::Color32::from_rgb(r, g, b));
    ui.painter().circle_filled(dot.center(), 3.5, colour);
    let name = if track.name.is_empty() { "Unnamed track" } else { &track.name };
    note(ui, ctx.palette, if *leads { format!("{name}, leads") } else { name.to_owned() });
}
