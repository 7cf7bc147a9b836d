//! What the host adds to a parameter's control: its own menu on a right click, and marks of mappings and automation.

use super::{ctx::Ctx, host::default_value, theme::Palette, widgets::button, words::Word};
use crate::parameter::Parameter;
use crate::telemetry::host_side::{Automation, Colour, Mark, MenuItem, MenuRequest};
use egui::{Color32, Rect, Response, Ui};

/// Height of the line of automation, points.
const LINE: f32 = 2.0;
/// Radius of the dot of a mapping, points.
const DOT: f32 = 3.0;

/// Adds menu and marks to a control in its place.
pub(super) fn add(ui: &mut Ui, ctx: &mut Ctx<'_>, parameter: Parameter, response: &Response, place: Rect) {
    marks(ui, ctx.palette, &ctx.instance.host_side.mark(parameter), place);
    if response.secondary_clicked() {
        let at = response.interact_pointer_pos().unwrap_or_else(|| place.center());
        let pixels = |points: f32| crate::parameter::cast::rounded(points * ui.ctx().pixels_per_point());
        ctx.instance.host_side.ask(MenuRequest::Show(parameter, [pixels(at.x), pixels(at.y)]));
    }
    response.context_menu(|ui| {
        ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
        if button(ui, ctx.palette, Word::UsualValue).clicked() {
            let usual = default_value(ctx.params(), parameter);
            ctx.set(parameter, usual);
            ui.close();
        }
        let items = ctx.instance.host_side.menu(parameter);
        if !items.is_empty() {
            ui.separator();
        }
        if let Some(action) = lines(ui, &items) {
            ctx.instance.host_side.ask(MenuRequest::Perform(parameter, action));
            ui.close();
        }
    });
}

/// What the marks of a parameter say, a line each; nothing without marks.
pub(super) fn words(mark: &Mark) -> String {
    let mapping = mark.mapping.as_ref().map(|mapping| match (mapping.label.as_str(), mapping.description.as_str()) {
        ("", "") => "Mapped by the host".to_owned(),
        (label, "") => format!("Mapped: {label}"),
        ("", description) => format!("Mapped: {description}"),
        (label, description) => format!("Mapped: {label}, {description}"),
    });
    let automation = match mark.automation {
        Automation::None => None,
        Automation::Present => Some("Has automation, which is not played"),
        Automation::Playing => Some("Automation moves it"),
        Automation::Recording => Some("Its automation is written"),
        Automation::Overriding => Some("Moved by hand against its automation"),
    };
    let lines = mapping.into_iter().chain(automation.map(str::to_owned));
    lines.map(|line| format!("\n{line}")).collect()
}

/// The host's lines; returns the number of the one that was clicked.
fn lines(ui: &mut Ui, items: &[MenuItem]) -> Option<u32> {
    let mut clicked = None;
    for item in items {
        match item {
            MenuItem::Entry { label, enabled, checked, action } => {
                let line = egui::Button::selectable(*checked == Some(true), label.as_str());
                if ui.add_enabled(*enabled, line).clicked() {
                    clicked = Some(*action);
                }
            }
            MenuItem::Separator => drop(ui.separator()),
            MenuItem::Title(title) => drop(ui.strong(title)),
            MenuItem::Submenu { label, enabled, items } => {
                let opened = ui.add_enabled_ui(*enabled, |ui| ui.menu_button(label.as_str(), |ui| lines(ui, items))).inner;
                clicked = opened.inner.flatten().or(clicked);
            }
        }
    }
    clicked
}

/// A dot at the upper right for a mapping, a line below for automation, in the host's colours where it has some.
fn marks(ui: &Ui, palette: &Palette, mark: &Mark, place: Rect) {
    let colour = |host: Option<Colour>, ours: Color32| host.map_or(ours, |[r, g, b]| Color32::from_rgb(r, g, b));
    if let Some(mapping) = &mark.mapping {
        let at = place.right_top() + egui::vec2(-DOT - 1.0, DOT + 1.0);
        ui.painter().circle_filled(at, DOT, colour(mapping.colour, palette.accent));
    }
    let ours = match mark.automation {
        Automation::None => return,
        Automation::Present => palette.soft,
        Automation::Playing => palette.accent,
        Automation::Recording => palette.error,
        Automation::Overriding => palette.warn,
    };
    let line = place.with_min_y(place.bottom() - LINE).shrink2(egui::vec2(3.0, 0.0));
    ui.painter().rect_filled(line, 1.0, colour(mark.automation_colour, ours));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::host_side::Mapping;

    #[test]
    fn marks_are_told_in_words() {
        assert_eq!(words(&Mark::default()), "");
        let mapping = Mapping { label: "CC 7".to_owned(), description: "Knob 1".to_owned(), colour: None };
        let mark = Mark { mapping: Some(mapping), automation: Automation::Recording, automation_colour: None };
        assert_eq!(words(&mark), "\nMapped: CC 7, Knob 1\nIts automation is written");
    }
}
