//! The weight of the setpoint for a wanted overshoot: chosen after the loop itself is tuned.

use eframe::egui::{self, RichText};
use vasos_engine::document::DocumentCommand;

use crate::action::Action;
use crate::panes::View;
use crate::{text, theme, tr};

/// Overshoot in percent that is proposed first.
const PROPOSED: f64 = 5.0;

/// Draws the menu button and what is behind it.
pub(super) fn ui(ui: &mut egui::Ui, view: &View, actions: &mut Vec<Action>) {
    let wanted = view.document.overshoot_percent;
    let side = view.tuning.setpoint.flatten();
    let title = match side {
        Some(side) => tr!("tune.setpoint_b", b = text::brief(side.b)),
        None => tr!("tune.setpoint"),
    };
    let menu = egui::containers::menu::MenuConfig::new()
        .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    let button = egui::containers::menu::MenuButton::new(title).config(menu);
    let (button, _) = button.ui(ui, |ui| {
        ui.set_max_width(300.0);
        let p = theme::palette(ui);
        let mut on = wanted.is_some();
        let mut percent = wanted.unwrap_or(PROPOSED);
        ui.horizontal(|ui| {
            let check = ui.checkbox(&mut on, tr!("tune.setpoint_overshoot"));
            let field = egui::DragValue::new(&mut percent).range(0.0..=100.0).speed(0.2).suffix(" %");
            ui.add_enabled(on, field.max_decimals(1)).labelled_by(check.id);
        });
        let new = on.then_some(percent);
        if new != wanted {
            actions.push(Action::Document(DocumentCommand::Overshoot(new)));
        }
        let words = match view.tuning.setpoint {
            None => tr!("tune.setpoint_off"),
            Some(None) => tr!("tune.setpoint_none"),
            Some(Some(side)) if side.filter_s > 0.0 => tr!(
                "tune.setpoint_filter",
                filter = text::brief(side.filter_s),
                overshoot = text::fixed(side.overshoot_percent, 1)
            ),
            Some(Some(side)) => tr!(
                "tune.setpoint_found",
                b = text::brief(side.b),
                overshoot = text::fixed(side.overshoot_percent, 1)
            ),
        };
        ui.add(egui::Label::new(RichText::new(words).size(theme::SMALL).color(p.weak)).wrap());
    });
    button.on_hover_text(tr!("tune.setpoint_hint"));
}
