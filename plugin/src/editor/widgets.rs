//! Controls that belong to no parameter, in the editor's own look.

use super::theme::{CONTROL, Palette, ROUND, SPACE, faded};
use super::words::Word;
use egui::{Align2, Color32, ComboBox, CornerRadius, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo};

/// A line around a control that has the keyboard.
pub fn focus_ring(ui: &Ui, palette: &Palette, response: &Response, rect: Rect, radius: u8) {
    if response.has_focus() {
        let stroke = Stroke::new(1.5, palette.accent);
        ui.painter().rect_stroke(rect, CornerRadius::same(radius), stroke, StrokeKind::Outside);
    }
}

/// Title of a section.
pub fn heading(ui: &mut Ui, palette: &Palette, word: Word) {
    ui.add_space(SPACE);
    title(ui, palette, word);
}

/// Title without the space before it.
pub fn title(ui: &mut Ui, palette: &Palette, word: Word) {
    let text = egui::RichText::new(word.label()).font(Palette::heading()).color(palette.text);
    ui.label(text).on_hover_text(word.help());
}

/// Text of less weight, on as many lines as it needs.
pub fn note(ui: &mut Ui, palette: &Palette, text: impl Into<String>) {
    ui.label(egui::RichText::new(text).font(Palette::caption()).color(palette.soft));
}

/// A text field as wide as what is left.
pub fn field(ui: &mut Ui, text: &mut String, hint: &str) -> Response {
    ui.add_sized(Vec2::new(ui.available_width(), CONTROL), egui::TextEdit::singleline(text).hint_text(hint))
}

/// A line of label and control: the label takes [`LABEL_WIDTH`], the control what is left.
pub fn labelled<R>(ui: &mut Ui, palette: &Palette, word: Word, add: impl FnOnce(&mut Ui) -> R) -> R {
    let width = LABEL_WIDTH.min(ui.available_width() * 0.4);
    row(ui, palette, word, width, add)
}

/// A line of a label of some width, points, and a control.
pub fn row<R>(ui: &mut Ui, palette: &Palette, word: Word, width: f32, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.horizontal(|ui| {
        let size = Vec2::new(width, CONTROL);
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        let galley = ui.painter().layout_no_wrap(word.label().to_owned(), Palette::body(), palette.soft);
        let at = rect.left_center() - Vec2::new(0.0, galley.size().y / 2.0);
        ui.painter().with_clip_rect(rect).galley(at, galley, palette.soft);
        response.on_hover_text(word.help());
        add(ui)
    })
    .inner
}

/// Space between two columns, points.
const GAP: f32 = 4.0 * SPACE;

/// Width of columns with the space between them.
fn needed<const N: usize>(least: [f32; N]) -> f32 {
    least.iter().sum::<f32>() + GAP * N.saturating_sub(1) as f32
}

/// Whether columns of these least widths need no scrolling.
pub fn fits<const N: usize>(width: f32, least: [f32; N]) -> bool {
    needed(least) <= width
}

/// Columns side by side in what is left of the window, each at least as wide as in `least`, points; where there is less room,
/// they are scrolled.
pub fn columns<const N: usize>(ui: &mut Ui, least: [f32; N], mut add: impl FnMut(&mut Ui, usize)) {
    let gap = GAP;
    let needed = needed(least);
    let spare = (ui.available_width() - needed).max(0.0) / least.len().max(1) as f32;
    let height = ui.available_height();
    egui::ScrollArea::horizontal().id_salt("columns").auto_shrink(false).show(ui, |ui| {
        let (whole, _) = ui.allocate_exact_size(Vec2::new(needed + spare * least.len() as f32, height), Sense::hover());
        let mut left = whole.left();
        for (index, least) in least.into_iter().enumerate() {
            let place = Rect::from_min_size(egui::pos2(left, whole.top()), Vec2::new(least + spare, height));
            left = place.right() + gap;
            let builder = egui::UiBuilder::new().id_salt(("column", index)).max_rect(place);
            // What is higher than its column is cut, and does not push the panel up.
            let mut column = ui.new_child(builder);
            // Room for the line around what has the keyboard.
            column.shrink_clip_rect(place.expand2(Vec2::new(gap / 2.0, 0.0)));
            column.spacing_mut().item_spacing.x = 2.0 * SPACE;
            add(&mut column, index);
        }
    });
}

/// Width of the labels of [`labelled`], points.
pub const LABEL_WIDTH: f32 = 76.0;

/// A name with its value at the right, of less weight.
pub fn fact(ui: &mut Ui, palette: &Palette, word: Word, value: &str) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 14.0), Sense::hover());
    ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, word.label(), Palette::caption(), palette.soft);
    ui.painter().text(rect.right_center(), Align2::RIGHT_CENTER, value, Palette::caption(), palette.text);
    response.on_hover_text(word.help());
}

/// Space on both sides of a button's text, points.
const PADDING: f32 = 10.0;

/// How wide a button of a word is, points.
pub fn button_width(ui: &Ui, word: Word) -> f32 {
    let text = ui.painter().layout_no_wrap(word.label().to_owned(), Palette::body(), Color32::WHITE);
    text.size().x + 2.0 * PADDING
}

/// A button, as wide as its word.
pub fn button(ui: &mut Ui, palette: &Palette, word: Word) -> Response {
    value_button(ui, palette, word.label(), word.help())
}

/// A button that shows a value.
pub fn value_button(ui: &mut Ui, palette: &Palette, value: &str, help: &str) -> Response {
    face(ui, palette, value, false, PADDING).on_hover_text(help).on_disabled_hover_text(help)
}

/// A button that is pressed while `on`.
pub fn tab(ui: &mut Ui, palette: &Palette, word: Word, on: bool) -> Response {
    tab_of(ui, palette, word, on, PADDING)
}

fn tab_of(ui: &mut Ui, palette: &Palette, word: Word, on: bool, padding: f32) -> Response {
    let response = face(ui, palette, word.label(), on, padding);
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, on, word.label()));
    response.on_hover_text(word.help())
}

/// Buttons of which one may be pressed, in what is left of the line: closer together where there is less room. Returns the one
/// that was clicked.
pub fn tabs(ui: &mut Ui, palette: &Palette, all: &[Word], on: Option<usize>) -> Option<usize> {
    let width = |word: &Word| ui.painter().layout_no_wrap(word.label().to_owned(), Palette::body(), palette.text).size().x;
    let texts: f32 = all.iter().map(width).sum();
    let count = all.len().max(1) as f32;
    let usual = ui.spacing().item_spacing.x;
    // Texts, padding on both sides of each, and half of one side's padding in between.
    let padding = ((ui.available_width() - texts) / (2.5 * count)).clamp(1.0, PADDING);
    ui.spacing_mut().item_spacing.x = usual.min(0.5 * padding);
    let clicked =
        |(index, word): (usize, &Word)| tab_of(ui, palette, *word, on == Some(index), padding).clicked().then_some(index);
    // All are drawn, whichever was clicked.
    all.iter().enumerate().map(clicked).collect::<Vec<_>>().into_iter().flatten().next()
}

fn face(ui: &mut Ui, palette: &Palette, text: &str, on: bool, padding: f32) -> Response {
    let colour = if ui.is_enabled() { palette.text } else { palette.soft };
    let galley = ui.painter().layout_no_wrap(text.to_owned(), Palette::body(), colour);
    let size = Vec2::new((galley.size().x + 2.0 * padding).max(CONTROL), CONTROL);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let (fill, text_colour) = match (on, response.hovered()) {
        (true, _) => (faded(palette.accent, 0.22), palette.accent),
        (false, true) => (palette.raised, palette.text),
        (false, false) => (palette.control, colour),
    };
    ui.painter().rect_filled(rect, CornerRadius::same(ROUND), fill);
    let at = rect.center() - galley.size() / 2.0;
    ui.painter().galley_with_override_text_color(at, galley, text_colour);
    focus_ring(ui, palette, &response, rect, ROUND);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, text));
    response
}

/// What a panel has done last, or what went wrong; `hint` before.
pub fn outcome(ui: &mut Ui, palette: &Palette, done: Option<&Result<String, String>>, hint: &str) {
    match done {
        Some(Ok(done)) => note(ui, palette, done),
        Some(Err(error)) => drop(ui.colored_label(palette.error, error)),
        None => note(ui, palette, hint),
    }
}

/// Controls that are dimmed while they have no effect.
pub fn dimmed<R>(ui: &mut Ui, dim: bool, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.scope(|ui| {
        if dim {
            ui.multiply_opacity(0.6);
        }
        add(ui)
    })
    .inner
}

/// A list that drops down, in what is left of the line; returns another choice than `chosen` when it was clicked.
pub fn drop_down<T: AsRef<str>>(
    ui: &mut Ui,
    id: &str,
    shown: &str,
    names: impl IntoIterator<Item = T>,
    chosen: usize,
    help: impl Fn(usize) -> &'static str,
) -> Option<usize> {
    let mut clicked = None;
    let list = ComboBox::from_id_salt(id).selected_text(shown).width(ui.available_width()).truncate().show_ui(ui, |ui| {
        for (index, name) in names.into_iter().enumerate() {
            let line = ui.selectable_label(index == chosen, name.as_ref()).on_hover_text(help(index));
            if line.clicked() && index != chosen {
                clicked = Some(index);
            }
        }
    });
    list.response.on_hover_text(help(chosen));
    clicked
}

/// Words side by side to choose from; returns the one that was clicked.
pub fn words(ui: &mut Ui, palette: &Palette, options: &[Word], chosen: usize) -> Option<usize> {
    let names = options.iter().map(|word| word.label()).collect::<Vec<_>>();
    segments(ui, palette, &names, chosen, |index| Ok(options[index].help().to_owned()))
}

/// Choices side by side; returns the one that was clicked. `tooltip` is asked for each, and for an error where it is not
/// available.
pub fn segments(
    ui: &mut Ui,
    palette: &Palette,
    options: &[&str],
    chosen: usize,
    tooltip: impl Fn(usize) -> Result<String, String>,
) -> Option<usize> {
    let width = ui.available_width();
    let mut clicked = None;
    let (whole, _) = ui.allocate_exact_size(Vec2::new(width, CONTROL), Sense::hover());
    ui.painter().rect_filled(whole, CornerRadius::same(ROUND), palette.control);
    // Each as wide as its text, and what is left over shared out.
    let lay = |text: &&str| ui.painter().layout_no_wrap((*text).to_owned(), Palette::body(), palette.text).size().x;
    let texts = options.iter().map(lay).collect::<Vec<_>>();
    let spare = (width - texts.iter().sum::<f32>()) / options.len().max(1) as f32;
    let mut left = whole.left();
    for (index, text) in options.iter().enumerate() {
        let part = texts[index] + spare;
        let rect = Rect::from_min_size(egui::pos2(left, whole.top()), Vec2::new(part, CONTROL));
        left += part;
        let response = ui.interact(rect, ui.scope_id().with((options, index)), Sense::click());
        let on = index == chosen;
        let tooltip = tooltip(index);
        let can = tooltip.is_ok();
        let inside = rect.shrink(2.0);
        if on {
            ui.painter().rect_filled(inside, CornerRadius::same(ROUND - 1), palette.accent);
        } else if response.hovered() {
            ui.painter().rect_filled(inside, CornerRadius::same(ROUND - 1), palette.raised);
        }
        let colour = match (on, can) {
            (true, _) => palette.on_accent,
            (false, true) => palette.text,
            (false, false) => palette.soft,
        };
        ui.painter().with_clip_rect(rect).text(rect.center(), Align2::CENTER_CENTER, text, Palette::body(), colour);
        focus_ring(ui, palette, &response, inside, ROUND - 1);
        response.widget_info(|| WidgetInfo::selected(Role::RadioButton, true, on, *text));
        if response.on_hover_text(tooltip.unwrap_or_else(|why_not| why_not)).clicked() && !on {
            clicked = Some(index);
        }
    }
    clicked
}

/// A switch; the response is clicked when it is flipped.
pub fn switch(ui: &mut Ui, palette: &Palette, word: Word, on: bool) -> Response {
    let size = Vec2::new(32.0, 16.0);
    let galley = ui.painter().layout_no_wrap(word.label().to_owned(), Palette::body(), palette.text);
    let wanted = Vec2::new(size.x + 2.0 * SPACE + galley.size().x, CONTROL);
    let (rect, response) = ui.allocate_exact_size(wanted, Sense::click());
    let place = Rect::from_center_size(rect.left_center() + Vec2::new(size.x / 2.0, 0.0), size);
    let at = ui.ctx().animate_bool(response.id, on);
    let radius = CornerRadius::same(8);
    ui.painter().rect_filled(place, radius, palette.raised);
    ui.painter().rect_filled(place, radius, faded(palette.accent, at));
    let line = if response.hovered() { palette.soft } else { palette.line };
    ui.painter().rect_stroke(place, radius, Stroke::new(1.0, line), StrokeKind::Inside);
    let centre = place.left_center() + Vec2::new(8.0 + at * 16.0, 0.0);
    let thumb: Color32 = if on { palette.on_accent } else { palette.text };
    ui.painter().circle_filled(centre, 5.0, thumb);
    let text = rect.left_center() + Vec2::new(size.x + 2.0 * SPACE, -galley.size().y / 2.0);
    ui.painter().galley(text, galley, palette.text);
    focus_ring(ui, palette, &response, place, 8);
    response.widget_info(|| WidgetInfo::selected(Role::Switch, true, on, word.label()));
    response.on_hover_text(word.help())
}
