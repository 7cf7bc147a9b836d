//! The editor's two sets of colours, its type and its spacing.

use crate::project::settings::Theme;
use egui::style::{ScrollStyle, Selection, WidgetVisuals, Widgets};
use egui::{
    Color32, Context, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Shadow, Stroke, Style, TextStyle,
    Vec2, Visuals,
};
use std::sync::Arc;

/// Every distance is a multiple of this, points.
pub const SPACE: f32 = 4.0;
/// Height of a control, points.
pub const CONTROL: f32 = 24.0;
/// Radius of a control's corners, points.
pub const ROUND: u8 = 5;

const REGULAR: &str = "Inter";
const SEMI_BOLD: &str = "Inter SemiBold";

const fn rgb(hex: u32) -> Color32 {
    let [_, r, g, b] = hex.to_be_bytes();
    Color32::from_rgb(r, g, b)
}

/// Declares the colours by their use, each in the dark and in the light theme.
macro_rules! palettes {
    ($($(#[$of:meta])* $colour:ident: $dark:literal, $light:literal;)*) => {
        /// Colours by their use. Text keeps a contrast of at least 4.5:1 on every ground.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct Palette {
            /// The theme that they belong to.
            pub theme: Theme,
            $($(#[$of])* pub $colour: Color32,)*
        }

        /// The dark theme.
        pub const DARK: Palette = Palette { theme: Theme::Dark, $($colour: rgb($dark)),* };
        /// The light theme.
        pub const LIGHT: Palette = Palette { theme: Theme::Light, $($colour: rgb($light)),* };
    };
}

palettes! {
    /// Behind the view and the plots.
    ground: 0x14171B, 0xFFFFFF;
    /// Behind panels.
    panel: 0x1B1F25, 0xF5F6F8;
    /// Behind controls.
    control: 0x272C34, 0xE6E9EE;
    /// Behind controls under the pointer.
    raised: 0x303641, 0xDBE0E6;
    /// Between panels, and around controls.
    line: 0x333943, 0xCFD5DC;
    /// Fine lines behind the view and the plots.
    hairline: 0x242930, 0xE9ECF0;
    /// Text.
    text: 0xE7EAEE, 0x171B21;
    /// Text of less weight.
    soft: 0xA7B0BC, 0x4C5664;
    /// The listener, and what is switched on.
    accent: 0x5FD3B4, 0x0A6B57;
    /// Text on the accent.
    on_accent: 0x0C1F1A, 0xFFFFFF;
    /// The left ear; apart from the right one in every kind of colour vision.
    left: 0x6CB6FF, 0x0B5CAD;
    /// The right ear.
    right: 0xF2A65A, 0x9A4A00;
    /// The emitter.
    emitter: 0xF58FB4, 0xB01E5A;
    /// The camera path.
    path: 0xB7A8FF, 0x5B45B8;
    /// Remarks.
    warn: 0xF0C05A, 0x7A5200;
    /// Errors.
    error: 0xFF8A80, 0xB3261E;
}

impl Palette {
    /// The colours of a theme.
    pub fn of(theme: Theme) -> &'static Self {
        match theme {
            Theme::Dark => &DARK,
            Theme::Light => &LIGHT,
        }
    }

    /// Text on the accent or on the panel, in the size of a caption.
    pub fn caption() -> FontId {
        FontId::new(11.0, FontFamily::Proportional)
    }

    /// Body text.
    pub fn body() -> FontId {
        FontId::new(12.5, FontFamily::Proportional)
    }

    /// Titles of sections.
    pub fn heading() -> FontId {
        FontId::new(12.5, FontFamily::Name(SEMI_BOLD.into()))
    }
}

/// Colours that a source may be given, each seen on either theme.
pub const SOURCE_COLOURS: [u32; 8] = [0xE5485D, 0xC96A28, 0xA88014, 0x4F9D4A, 0x1E9A9A, 0x3F83E0, 0x8A6BE0, 0xC25BB4];

/// A colour with a share of its opacity.
pub fn faded(colour: Color32, share: f32) -> Color32 {
    colour.gamma_multiply(share)
}

/// Sets the type. Once per window.
pub fn set_fonts(ctx: &Context) {
    let mut fonts = FontDefinitions::default();
    let inter: [(&str, &'static [u8]); 2] = [
        (REGULAR, include_bytes!("../../assets/fonts/Inter-Regular.ttf")),
        (SEMI_BOLD, include_bytes!("../../assets/fonts/Inter-SemiBold.ttf")),
    ];
    for (name, bytes) in inter {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
    }
    // The default type stays behind, for scripts that Inter does not have.
    let others = fonts.families.get(&FontFamily::Proportional).cloned().unwrap_or_default();
    for (family, first) in [(FontFamily::Proportional, REGULAR), (FontFamily::Name(SEMI_BOLD.into()), SEMI_BOLD)] {
        let chain = [first.to_owned()].into_iter().chain(others.iter().cloned()).collect();
        fonts.families.insert(family, chain);
    }
    ctx.set_fonts(fonts);
}

/// Dresses the window in a theme.
pub fn dress(ctx: &Context, palette: &Palette) {
    let (theme, base) = match palette.theme {
        Theme::Dark => (egui::Theme::Dark, Visuals::dark()),
        Theme::Light => (egui::Theme::Light, Visuals::light()),
    };
    ctx.set_theme(theme);
    let style = Style { visuals: visuals(palette, base), ..style() };
    ctx.set_style_of(theme, style);
}

fn style() -> Style {
    let mut style = Style {
        text_styles: [
            (TextStyle::Small, Palette::caption()),
            (TextStyle::Body, Palette::body()),
            (TextStyle::Button, Palette::body()),
            (TextStyle::Monospace, Palette::body()),
            (TextStyle::Heading, Palette::heading()),
        ]
        .into(),
        drag_value_text_style: TextStyle::Body,
        animation_time: 0.08,
        explanation_tooltips: false,
        compact_menu_style: false,
        ..Style::default()
    };
    let spacing = &mut style.spacing;
    spacing.item_spacing = Vec2::splat(SPACE);
    spacing.window_margin = Margin::same(12);
    spacing.menu_margin = Margin::same(8);
    spacing.button_padding = Vec2::new(8.0, 4.0);
    spacing.interact_size = Vec2::new(32.0, CONTROL);
    spacing.icon_width = 16.0;
    spacing.combo_height = 280.0;
    spacing.scroll = ScrollStyle { bar_width: 8.0, floating_width: 4.0, ..ScrollStyle::floating() };
    style.interaction.selectable_labels = false;
    style.interaction.tooltip_delay = 0.5;
    style
}

fn visuals(p: &Palette, base: Visuals) -> Visuals {
    let radius = CornerRadius::same(ROUND);
    let state = |fill: Color32, line: Color32, text: Color32| WidgetVisuals {
        bg_fill: fill,
        weak_bg_fill: fill,
        bg_stroke: Stroke::new(1.0, line),
        corner_radius: radius,
        fg_stroke: Stroke::new(1.0, text),
        expansion: 0.0,
    };
    let shadow = Shadow { offset: [0, 4], blur: 16, spread: 0, color: Color32::from_black_alpha(90) };
    Visuals {
        widgets: Widgets {
            noninteractive: state(p.panel, p.line, p.text),
            inactive: state(p.control, Color32::TRANSPARENT, p.text),
            hovered: state(p.raised, p.line, p.text),
            active: state(p.raised, p.accent, p.text),
            open: state(p.raised, p.line, p.text),
        },
        selection: Selection { bg_fill: faded(p.accent, 0.35), stroke: Stroke::new(1.0, p.text) },
        weak_text_color: Some(p.soft),
        hyperlink_color: p.accent,
        faint_bg_color: p.control,
        extreme_bg_color: p.ground,
        text_edit_bg_color: Some(p.control),
        code_bg_color: p.control,
        warn_fg_color: p.warn,
        error_fg_color: p.error,
        window_corner_radius: CornerRadius::same(8),
        window_fill: p.panel,
        window_stroke: Stroke::new(1.0, p.line),
        window_shadow: shadow,
        popup_shadow: shadow,
        menu_corner_radius: CornerRadius::same(8),
        panel_fill: p.panel,
        ..base
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(colour: Color32) -> f32 {
        let linear = |c: u8| {
            let c = f32::from(c) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(colour.r()) + 0.7152 * linear(colour.g()) + 0.0722 * linear(colour.b())
    }

    fn contrast(a: Color32, b: Color32) -> f32 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn every_colour_of_text_can_be_read_on_every_ground() {
        for p in [DARK, LIGHT] {
            for text in [p.text, p.soft, p.accent, p.left, p.right, p.emitter, p.path, p.warn, p.error] {
                for ground in [p.ground, p.panel, p.control, p.raised] {
                    let found = contrast(text, ground);
                    assert!(found >= 4.5, "{text:?} on {ground:?} of {:?}: {found}", p.theme);
                }
            }
            assert!(contrast(p.on_accent, p.accent) >= 4.5);
            // Graphics need less than text.
            for [_, r, g, b] in SOURCE_COLOURS.map(u32::to_be_bytes) {
                for ground in [p.ground, p.panel] {
                    assert!(contrast(Color32::from_rgb(r, g, b), ground) >= 3.0, "{r:x}{g:x}{b:x} of {:?}", p.theme);
                }
            }
        }
    }
}
