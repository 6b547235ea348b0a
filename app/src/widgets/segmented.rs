//! A row of exclusive choices.

use eframe::egui::{self, CornerRadius, Role, WidgetInfo};

use crate::theme;

/// Draws the choices side by side; gives the one that was pressed, if it is another than `chosen`.
pub fn segmented(ui: &mut egui::Ui, group: &str, labels: &[String], chosen: usize) -> Option<usize> {
    let p = theme::palette(ui);
    let mut pressed = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 1.0;
        let last = labels.len().saturating_sub(1);
        for (i, label) in labels.iter().enumerate() {
            let on = i == chosen;
            let ink = if on { p.on_accent } else { p.text };
            let round = |first: bool, last: bool| CornerRadius {
                nw: if first { 4 } else { 0 },
                sw: if first { 4 } else { 0 },
                ne: if last { 4 } else { 0 },
                se: if last { 4 } else { 0 },
            };
            let button = egui::Button::new(egui::RichText::new(label).color(ink))
                .fill(if on { p.accent } else { p.button })
                .corner_radius(round(i == 0, i == last))
                .min_size(egui::vec2(0.0, theme::PRESS));
            let response = ui.add(button);
            response.widget_info(|| {
                WidgetInfo::selected(Role::RadioButton, true, on, format!("{group}: {label}"))
            });
            if response.clicked() && !on {
                pressed = Some(i);
            }
        }
    });
    pressed
}
