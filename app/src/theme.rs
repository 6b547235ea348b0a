//! Every colour and every distance of the window. Nothing else in the app names a colour.
//!
//! After ISA-101: a grey field, muted equipment, saturated colour for what is abnormal only.

use eframe::egui::{
    self, Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Stroke, TextStyle,
    vec2,
};

/// Gap between things that belong together.
pub const GAP: f32 = 6.0;
/// Gap between groups.
pub const WIDE_GAP: f32 = 12.0;
/// Inner margin of a pane.
pub const PANE_MARGIN: i8 = 8;
/// Smallest side of something to press.
pub const PRESS: f32 = 24.0;
/// Width of plotted lines.
pub const LINE: f32 = 1.8;

/// Width of a trend's lines, which carry noise.
pub const TREND_LINE: f32 = 1.4;

/// Size of small print.
pub const SMALL: f32 = 11.5;
/// Size of text in dense tables.
pub const TABLE: f32 = 12.0;
/// Size of body text.
pub const BODY: f32 = 13.0;

/// Bold face for headings and readings.
#[must_use]
pub fn bold() -> FontFamily {
    FontFamily::Name("bold".into())
}

/// A font of the bold face.
#[must_use]
pub fn bold_font(size: f32) -> FontId {
    FontId::new(size, bold())
}

/// Meaning of a colour; the theme gives its value in light and dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Palette {
    /// Behind the panes.
    pub field: Color32,
    /// A pane.
    pub pane: Color32,
    /// A pane's edge.
    pub edge: Color32,
    /// Where something is typed or plotted.
    pub well: Color32,
    /// Text.
    pub text: Color32,
    /// Text of second rank.
    pub weak: Color32,
    /// Something chosen or to be pressed next.
    pub accent: Color32,
    /// Text on the accent.
    pub on_accent: Color32,
    /// Accent as text.
    pub accent_text: Color32,
    /// Buttons at rest.
    pub button: Color32,
    /// Buttons under the pointer.
    pub button_hover: Color32,
    /// Equipment's outline.
    pub outline: Color32,
    /// Equipment's body.
    pub body: Color32,
    /// Inside of an empty tank.
    pub empty: Color32,
    /// Water at rest.
    pub water: Color32,
    /// Water's surface and moving streams.
    pub stream: Color32,
    /// A pipe without flow.
    pub dry_pipe: Color32,
    /// Process variable.
    pub pv: Color32,
    /// Setpoint.
    pub sp: Color32,
    /// Manipulated variable.
    pub mv: Color32,
    /// Abnormal, to act on.
    pub alarm: Color32,
    /// Text on alarm.
    pub on_alarm: Color32,
    /// Worth a look.
    pub caution: Color32,
    /// Lines of a plot's grid.
    pub grid: Color32,
    /// A curve kept for comparison.
    pub ghost: Color32,
    /// Shading of a chosen stretch or a forbidden circle.
    pub shade: Color32,
    /// A chosen row.
    pub row: Color32,
}

/// Dark.
pub const DARK: Palette = Palette {
    field: Color32::from_rgb(0x1b, 0x1e, 0x20),
    pane: Color32::from_rgb(0x26, 0x2a, 0x2d),
    edge: Color32::from_rgb(0x3a, 0x40, 0x44),
    well: Color32::from_rgb(0x1a, 0x1d, 0x1f),
    text: Color32::from_rgb(0xe4, 0xe6, 0xe7),
    weak: Color32::from_rgb(0xb2, 0xb9, 0xbd),
    accent: Color32::from_rgb(0x2f, 0x6f, 0xb0),
    on_accent: Color32::from_rgb(0xff, 0xff, 0xff),
    accent_text: Color32::from_rgb(0x7a, 0xb8, 0xf0),
    button: Color32::from_rgb(0x34, 0x3a, 0x3e),
    button_hover: Color32::from_rgb(0x40, 0x48, 0x4d),
    outline: Color32::from_rgb(0xc3, 0xc9, 0xcc),
    body: Color32::from_rgb(0x5a, 0x62, 0x67),
    empty: Color32::from_rgb(0x1a, 0x1d, 0x1f),
    water: Color32::from_rgb(0x3b, 0x62, 0x7c),
    stream: Color32::from_rgb(0x8f, 0xc3, 0xe0),
    dry_pipe: Color32::from_rgb(0x4d, 0x54, 0x58),
    pv: Color32::from_rgb(0x7f, 0xbb, 0xe8),
    sp: Color32::from_rgb(0xd9, 0xbd, 0x6a),
    mv: Color32::from_rgb(0x88, 0xc9, 0x94),
    alarm: Color32::from_rgb(0xd3, 0x3b, 0x35),
    on_alarm: Color32::from_rgb(0xff, 0xff, 0xff),
    caution: Color32::from_rgb(0xf0, 0xa8, 0x5a),
    grid: Color32::from_rgb(0x3a, 0x40, 0x44),
    ghost: Color32::from_rgb(0x9a, 0x9f, 0xa3),
    shade: Color32::from_rgba_premultiplied(0x1b, 0x2e, 0x40, 0x60),
    row: Color32::from_rgb(0x2c, 0x3f, 0x52),
};

/// Light.
pub const LIGHT: Palette = Palette {
    field: Color32::from_rgb(0xd8, 0xda, 0xd9),
    pane: Color32::from_rgb(0xec, 0xed, 0xeb),
    edge: Color32::from_rgb(0xc2, 0xc5, 0xc4),
    well: Color32::from_rgb(0xf8, 0xf8, 0xf7),
    text: Color32::from_rgb(0x1e, 0x22, 0x24),
    weak: Color32::from_rgb(0x52, 0x59, 0x5d),
    accent: Color32::from_rgb(0x24, 0x63, 0xa0),
    on_accent: Color32::from_rgb(0xff, 0xff, 0xff),
    accent_text: Color32::from_rgb(0x1b, 0x57, 0x92),
    button: Color32::from_rgb(0xfa, 0xfa, 0xf9),
    button_hover: Color32::from_rgb(0xe1, 0xe6, 0xea),
    outline: Color32::from_rgb(0x2b, 0x30, 0x33),
    body: Color32::from_rgb(0xb4, 0xb9, 0xbb),
    empty: Color32::from_rgb(0xf8, 0xf8, 0xf7),
    water: Color32::from_rgb(0x9c, 0xc0, 0xd8),
    stream: Color32::from_rgb(0x2f, 0x7d, 0xab),
    dry_pipe: Color32::from_rgb(0xb0, 0xb4, 0xb5),
    pv: Color32::from_rgb(0x1f, 0x66, 0x9c),
    sp: Color32::from_rgb(0x7d, 0x5f, 0x0e),
    mv: Color32::from_rgb(0x2b, 0x6e, 0x3a),
    alarm: Color32::from_rgb(0xbe, 0x2a, 0x25),
    on_alarm: Color32::from_rgb(0xff, 0xff, 0xff),
    caution: Color32::from_rgb(0x92, 0x4e, 0x05),
    grid: Color32::from_rgb(0xd2, 0xd5, 0xd4),
    ghost: Color32::from_rgb(0x6c, 0x72, 0x76),
    shade: Color32::from_rgba_premultiplied(0x05, 0x0e, 0x17, 0x26),
    row: Color32::from_rgb(0xc9, 0xda, 0xe8),
};

/// The palette in use.
#[must_use]
pub fn palette(ui: &egui::Ui) -> Palette {
    if ui.visuals().dark_mode { DARK } else { LIGHT }
}

/// Colours that tell overlaid curves apart, by number.
#[must_use]
pub fn series(palette: &Palette, index: usize) -> Color32 {
    [palette.pv, palette.sp, palette.mv, palette.caution, palette.ghost][index % 5]
}

/// Fonts, text sizes, spacing and both themes, once at the start.
pub fn install(ctx: &egui::Context) {
    let mut fonts = FontDefinitions::default();
    let faces: [(&str, &'static [u8]); 2] = [
        ("plex", include_bytes!("../../assets/fonts/IBMPlexSans-Regular.ttf")),
        ("plex-bold", include_bytes!("../../assets/fonts/IBMPlexSans-SemiBold.ttf")),
    ];
    for (name, bytes) in faces {
        fonts.font_data.insert(name.to_owned(), FontData::from_static(bytes).into());
    }
    let fallback = fonts.families.get(&FontFamily::Proportional).cloned().unwrap_or_default();
    let family =
        |first: &str| std::iter::once(first.to_owned()).chain(fallback.iter().cloned()).collect::<Vec<_>>();
    fonts.families.insert(bold(), family("plex-bold"));
    fonts.families.insert(FontFamily::Proportional, family("plex"));
    ctx.set_fonts(fonts);
    for (theme, palette) in [(egui::Theme::Dark, DARK), (egui::Theme::Light, LIGHT)] {
        ctx.style_mut_of(theme, |style| {
            style.visuals = visuals(theme, &palette);
            style.text_styles = [
                (TextStyle::Heading, bold_font(14.0)),
                (TextStyle::Body, FontId::proportional(BODY)),
                (TextStyle::Button, FontId::proportional(BODY)),
                (TextStyle::Small, FontId::proportional(SMALL)),
                (TextStyle::Monospace, FontId::monospace(12.5)),
            ]
            .into();
            style.spacing.item_spacing = vec2(GAP, GAP);
            style.spacing.button_padding = vec2(8.0, 3.0);
            style.spacing.interact_size = vec2(34.0, PRESS);
            style.spacing.window_margin = Margin::same(PANE_MARGIN);
            style.spacing.slider_width = 110.0;
            style.spacing.scroll = egui::style::ScrollStyle::thin();
            style.interaction.selectable_labels = false;
        });
    }
}

fn visuals(theme: egui::Theme, p: &Palette) -> egui::Visuals {
    let mut v = theme.default_visuals();
    v.panel_fill = p.field;
    v.window_fill = p.pane;
    v.window_stroke = Stroke::new(1.0, p.edge);
    v.extreme_bg_color = p.well;
    v.faint_bg_color = p.well;
    v.text_edit_bg_color = Some(p.well);
    v.override_text_color = None;
    v.weak_text_color = Some(p.weak);
    v.hyperlink_color = p.accent_text;
    v.warn_fg_color = p.caution;
    v.error_fg_color = p.alarm;
    v.selection.bg_fill = p.accent;
    v.selection.stroke = Stroke::new(1.0, p.on_accent);
    let round = CornerRadius::same(3);
    let widgets = &mut v.widgets;
    for (state, fill, edge, ink) in [
        (&mut widgets.noninteractive, p.pane, p.edge, p.text),
        (&mut widgets.inactive, p.button, p.edge, p.text),
        (&mut widgets.hovered, p.button_hover, p.weak, p.text),
        (&mut widgets.active, p.button_hover, p.accent_text, p.text),
        (&mut widgets.open, p.button_hover, p.edge, p.text),
    ] {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, edge);
        state.fg_stroke = Stroke::new(1.0, ink);
        state.corner_radius = round;
        state.expansion = 0.0;
    }
    v.window_corner_radius = CornerRadius::same(5);
    v.menu_corner_radius = CornerRadius::same(4);
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: Color32) -> f64 {
        let channel = |v: u8| {
            let s = f64::from(v) / 255.0;
            if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(c.r()) + 0.7152 * channel(c.g()) + 0.0722 * channel(c.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// The issue: contrast at least 4.5 : 1 (WCAG 2.2, 1.4.3), for every pair in which text is drawn.
    #[test]
    fn every_text_stands_out_from_what_is_behind_it() {
        for (name, p) in [("dark", DARK), ("light", LIGHT)] {
            let grounds = [
                ("pane", p.pane),
                ("well", p.well),
                ("field", p.field),
                ("button", p.button),
                ("row", p.row),
                ("hover", p.button_hover),
            ];
            let inks = [
                ("text", p.text),
                ("weak", p.weak),
                ("accent", p.accent_text),
                ("pv", p.pv),
                ("sp", p.sp),
                ("mv", p.mv),
                ("caution", p.caution),
            ];
            for (ground_name, ground) in grounds {
                for (ink_name, ink) in inks {
                    // Coloured and weak text never stands on a hovered button or a chosen row.
                    if ink_name != "text"
                        && matches!(ground_name, "hover" | "row" | "button" | "field")
                        && ink_name != "weak"
                    {
                        continue;
                    }
                    let c = contrast(ink, ground);
                    let wanted = 4.5;
                    assert!(c >= wanted, "{name}: {ink_name} on {ground_name} is {c:.2} : 1");
                }
            }
            for (what, ink, ground) in [
                ("accent", p.on_accent, p.accent),
                ("alarm", p.on_alarm, p.alarm),
                ("text on water", p.text, p.water),
            ] {
                let c = contrast(ink, ground);
                assert!(c >= 4.5, "{name}: {what} is {c:.2} : 1");
            }
        }
    }
}
