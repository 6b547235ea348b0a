//! What happened, newest first.

use eframe::egui;

use crate::action::Action;
use crate::journal::Weight;
use crate::panes::View;
use crate::{text, theme, tr};

/// State of the pane.
#[derive(Default)]
pub struct State {
    only_abnormal: bool,
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    let p = theme::palette(ui);
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut state.only_abnormal, tr!("log.only_abnormal"));
        if ui.button(tr!("log.copy")).clicked() {
            let lines = view.journal.iter().map(|e| {
                let time = e.time_s.map_or(String::new(), text::clock);
                format!("{time}\t{}", e.words)
            });
            actions.push(Action::Copy(lines.collect::<Vec<_>>().join("\n")));
        }
        if ui.button(tr!("log.clear")).clicked() {
            actions.push(Action::ClearLog);
        }
    });
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let entries = view.journal.iter().rev().filter(|e| !state.only_abnormal || e.weight != Weight::Note);
        let mut any = false;
        for entry in entries {
            any = true;
            let (sign, colour) = match entry.weight {
                Weight::Note => ("·", p.text),
                Weight::Caution => ("!", p.caution),
                Weight::Alarm => ("!", if ui.visuals().dark_mode { p.caution } else { p.alarm }),
            };
            ui.horizontal_top(|ui| {
                let time = entry.time_s.map_or_else(|| "–".to_owned(), text::clock);
                ui.add_sized([48.0, 16.0], egui::Label::new(egui::RichText::new(time).color(p.weak).small()));
                ui.label(egui::RichText::new(sign).family(theme::bold()).color(colour));
                ui.add(
                    egui::Label::new(egui::RichText::new(&entry.words).color(colour)).wrap().selectable(true),
                );
            });
        }
        if !any {
            ui.weak(tr!("log.empty"));
        }
    });
    actions
}
