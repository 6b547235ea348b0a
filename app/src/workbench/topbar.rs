//! The bar above the panes, the bar below them, and notices.

use std::sync::LazyLock;

use eframe::egui::{self, Align, Layout, RichText};
use vasos_engine::document::{Document, DocumentCommand, SourceChoice};
use vasos_engine::plant::{Measurement, Text};
use vasos_engine::session::Snapshot;
use vasos_io::rig::PRESETS;

use super::Workbench;
use super::settings::ZOOM;
use crate::action::{Action, Table};
use crate::i18n::{self, Language};
use crate::widgets::{Icon, icon_button, segmented};
use crate::{journal, text, theme, tr};

/// Fastest the simulation is asked to go, in times real time.
const FASTEST: f64 = 1000.0;

impl Workbench {
    pub(super) fn top_bar(&self, ui: &mut egui::Ui, snapshot: &Snapshot, document: &Document) -> Vec<Action> {
        let mut actions = vec![];
        let p = theme::palette(ui);
        let frame = egui::Frame::NONE.fill(p.pane).inner_margin(egui::Margin::symmetric(10, 5));
        egui::Panel::top("top").frame(frame).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.label(RichText::new("Vasos").family(theme::bold()).size(17.0));
                self.menus(ui, document, &mut actions);
                ui.separator();
                let mut sources = vec![(SourceChoice::Simulated, tr!("top.simulated"))];
                sources.extend(document.log.as_ref().map(|_| (SourceChoice::Log, tr!("top.log"))));
                let replay = || (SourceChoice::Replay, tr!("top.replay"));
                sources.extend(document.recording.as_ref().map(|_| replay()));
                if sources.len() > 1 {
                    let names: Vec<String> = sources.iter().map(|(_, name)| name.clone()).collect();
                    let chosen = sources.iter().position(|(s, _)| *s == document.source).unwrap_or(0);
                    if let Some(chosen) = segmented(ui, &tr!("top.source"), &names, chosen) {
                        actions.push(Action::Document(DocumentCommand::Source(sources[chosen].0)));
                    }
                }
                let language = i18n::current().tag();
                let spec = &document.rig.network.spec;
                if spec.configurations.len() > 1 {
                    let titles: Vec<String> =
                        spec.configurations.iter().map(|c| c.title.get(language).to_owned()).collect();
                    // A recording shows which one it was at its time.
                    let replay = snapshot.span_s.is_some();
                    let chosen = if replay { snapshot.configuration } else { document.rig.configuration };
                    let clicked = ui
                        .add_enabled_ui(!replay, |ui| {
                            segmented(ui, &tr!("top.configuration"), &titles, chosen)
                        })
                        .inner;
                    if let Some(i) = clicked {
                        actions.push(Action::Document(DocumentCommand::Configuration(i)));
                    }
                }
                self.transport(ui, snapshot, &mut actions);
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| self.right_end(ui, &mut actions));
            });
        });
        actions
    }

    fn menus(&self, ui: &mut egui::Ui, document: &Document, actions: &mut Vec<Action>) {
        ui.scope(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            ui.visuals_mut().widgets.inactive.weak_bg_fill = egui::Color32::TRANSPARENT;
            ui.visuals_mut().widgets.inactive.bg_stroke = egui::Stroke::NONE;
            ui.menu_button(tr!("menu.file"), |ui| {
                if ui.add(egui::Button::new(tr!("menu.open")).shortcut_text("Ctrl+O")).clicked() {
                    actions.push(Action::AskFile);
                }
                ui.menu_button(tr!("menu.recent"), |ui| {
                    if self.settings.recent.is_empty() {
                        ui.weak(tr!("menu.no_recent"));
                    }
                    for path in &self.settings.recent {
                        let name = path
                            .file_name()
                            .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
                        if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                            actions.push(Action::OpenFile(path.clone()));
                        }
                    }
                });
                ui.separator();
                let record =
                    if self.recording.is_some() { tr!("top.stop_recording") } else { tr!("top.record") };
                if ui.add(egui::Button::new(record).shortcut_text("Ctrl+R")).clicked() {
                    actions.push(Action::ToggleRecording);
                }
                let mut always = self.settings.record_always;
                if ui.checkbox(&mut always, tr!("menu.record_always")).changed() {
                    actions.push(Action::RecordAlways(always));
                }
                let shown = self.recording.is_some() || !self.recorded.is_empty();
                let button = egui::Button::new(tr!("menu.rerun"));
                let hint = if shown { tr!("menu.rerun_hint") } else { tr!("menu.rerun_none") };
                if ui.add_enabled(shown, button).on_hover_text(&hint).on_disabled_hover_text(hint).clicked() {
                    actions.push(Action::OpenInRerun);
                }
                ui.separator();
                for (name, table) in [("trend.export", Table::Csv), ("menu.export_parquet", Table::Parquet)] {
                    if ui.button(tr!(name)).clicked() {
                        actions.push(Action::ExportTrend(table));
                    }
                }
            });
            ui.menu_button(tr!("menu.edit"), |ui| {
                let undo = self.history.undo_key();
                let redo = self.history.redo_key();
                let name = |verb: &str, key: Option<&str>| {
                    key.map_or_else(|| tr!(verb), |k| format!("{}: {}", tr!(verb), journal::change(k)))
                };
                let button = egui::Button::new(name("menu.undo", undo)).shortcut_text("Ctrl+Z");
                if ui.add_enabled(undo.is_some(), button).clicked() {
                    actions.push(Action::Undo);
                }
                let button = egui::Button::new(name("menu.redo", redo)).shortcut_text("Ctrl+Shift+Z");
                if ui.add_enabled(redo.is_some(), button).clicked() {
                    actions.push(Action::Redo);
                }
            });
            ui.menu_button(tr!("menu.rig"), |ui| rig_menu(ui, document, actions));
            ui.menu_button(tr!("menu.view"), |ui| self.view_menu(ui, actions));
        });
    }

    fn view_menu(&self, ui: &mut egui::Ui, actions: &mut Vec<Action>) {
        ui.weak(tr!("menu.language"));
        for (language, name) in [(Language::English, "English"), (Language::Portuguese, "Português")] {
            if ui.selectable_label(i18n::current() == language, name).clicked() {
                actions.push(Action::Language(language));
            }
        }
        ui.separator();
        let theme = if self.settings.dark { tr!("top.light") } else { tr!("top.dark") };
        if ui.button(theme).clicked() {
            actions.push(Action::ToggleTheme);
        }
        ui.horizontal(|ui| {
            let name = ui.label(tr!("menu.size"));
            for (sign, factor) in [("−", 1.0 / 1.1), ("+", 1.1)] {
                if ui.button(sign).labelled_by(name.id).clicked() {
                    actions.push(Action::Zoom((self.settings.zoom() * factor).clamp(ZOOM[0], ZOOM[1])));
                }
            }
            ui.label(format!("{} %", text::fixed(f64::from(self.settings.zoom()) * 100.0, 0)));
        });
        if ui.button(tr!("menu.reset_layout")).clicked() {
            actions.push(Action::ResetLayout);
        }
    }

    fn transport(&self, ui: &mut egui::Ui, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        ui.spacing_mut().item_spacing.x = 4.0;
        let (icon, name) =
            if snapshot.running { (Icon::Pause, tr!("top.pause")) } else { (Icon::Run, tr!("top.run")) };
        if icon_button(ui, icon, &name, true).clicked() {
            actions.push(Action::ToggleRunning);
        }
        if icon_button(ui, Icon::Step, &tr!("top.step"), true).clicked() {
            actions.push(Action::Step);
        }
        if icon_button(ui, Icon::Restart, &tr!("top.restart"), true).clicked() {
            actions.push(Action::Restart);
        }
        let mut speed = snapshot.speed;
        ui.spacing_mut().slider_width = 84.0;
        let slider = egui::Slider::new(&mut speed, 1.0..=FASTEST)
            .logarithmic(true)
            .custom_formatter(|v, _| text::fixed(v, if v < 9.95 { 1 } else { 0 }))
            .suffix(" ×");
        let slider = ui.add(slider).on_hover_text(tr!("top.speed"));
        slider.widget_info(|| egui::WidgetInfo::slider(true, speed, tr!("top.speed")));
        if slider.changed() {
            actions.push(Action::Speed(speed));
        }
        if icon_button(ui, Icon::Undo, &tr!("menu.undo"), self.history.undo_key().is_some()).clicked() {
            actions.push(Action::Undo);
        }
        if icon_button(ui, Icon::Redo, &tr!("menu.redo"), self.history.redo_key().is_some()).clicked() {
            actions.push(Action::Redo);
        }
    }

    fn right_end(&self, ui: &mut egui::Ui, actions: &mut Vec<Action>) {
        let p = theme::palette(ui);
        let name = if self.settings.dark { tr!("top.light") } else { tr!("top.dark") };
        if icon_button(ui, Icon::Theme, &name, true).clicked() {
            actions.push(Action::ToggleTheme);
        }
        let chosen = usize::from(i18n::current() == Language::Portuguese);
        let names = ["EN".to_owned(), "PT".to_owned()];
        // The layout runs from right to left; the choice must not.
        let size = egui::vec2(74.0, theme::PRESS);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            if let Some(i) = segmented(ui, &tr!("menu.language"), &names, chosen) {
                actions.push(Action::Language(Language::ALL[i]));
            }
        });
        match &self.recording {
            Some(recording) => {
                if icon_button(ui, Icon::Stop, &tr!("top.stop_recording"), true).clicked() {
                    actions.push(Action::ToggleRecording);
                }
                let file =
                    recording.path().file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
                let size = text::brief(recording.bytes() as f64 / 1e6);
                let words = tr!("top.recording", rows = recording.rows(), size = size);
                let hover = tr!(
                    "top.recording_hint",
                    file = file,
                    viewer = recording.address().unwrap_or("–"),
                    lost = recording.lost()
                );
                ui.label(RichText::new(words).color(p.text)).on_hover_text(hover);
                let (rect, _) = ui.allocate_exact_size(egui::Vec2::splat(10.0), egui::Sense::hover());
                ui.painter().circle_filled(rect.center(), 5.0, p.alarm);
            }
            None => {
                if icon_button(ui, Icon::Record, &tr!("top.record"), true).clicked() {
                    actions.push(Action::ToggleRecording);
                }
            }
        }
    }

    pub(super) fn status_bar(
        &self,
        ui: &mut egui::Ui,
        snapshot: &Snapshot,
        document: &Document,
    ) -> Vec<Action> {
        let p = theme::palette(ui);
        let frame = egui::Frame::NONE.fill(p.pane).inner_margin(egui::Margin::symmetric(10, 3));
        egui::Panel::bottom("status").frame(frame).show(ui, |ui| {
            ui.horizontal(|ui| {
                let small = |words: String| RichText::new(words).size(theme::SMALL).color(p.weak);
                let state = if snapshot.running {
                    let reached = if snapshot.achieved_speed.is_finite() {
                        snapshot.achieved_speed
                    } else {
                        snapshot.speed
                    };
                    tr!("status.running", speed = text::fixed(reached, if reached < 9.95 { 1 } else { 0 }))
                } else {
                    tr!("status.paused")
                };
                let sample_ms = document.rig.network.spec.sample_time_s * 1000.0;
                let balance =
                    if snapshot.balance_error_cm3.abs() < 5e-5 { 0.0 } else { snapshot.balance_error_cm3 };
                let mut parts = vec![
                    state,
                    format!("t {}", text::clock(snapshot.time_s)),
                    tr!("status.sample", ms = text::brief(sample_ms)),
                ];
                if snapshot.span_s.is_none() {
                    parts.push(tr!("status.balance", error = text::fixed(balance, 4)));
                }
                ui.label(small(parts.join("  ·  ")));
                if let Some(alarm) = snapshot.alarms.first() {
                    let more = snapshot.alarms.len() - 1;
                    let words = tr!(&format!("alarm.{}", alarm.key()), tag = alarm.tag());
                    let words = if more > 0 { format!("{words} +{more}") } else { words };
                    egui::Frame::NONE
                        .fill(p.alarm)
                        .corner_radius(3)
                        .inner_margin(egui::Margin::symmetric(6, 1))
                        .show(ui, |ui| {
                            ui.label(
                                RichText::new(format!("! {words}")).size(theme::SMALL).color(p.on_alarm),
                            );
                        });
                } else {
                    ui.label(small(tr!("faceplate.no_alarm")));
                }
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    let language = i18n::current().tag();
                    let spec = &document.rig.network.spec;
                    let note =
                        spec.note.as_ref().map_or(String::new(), |n| format!(" · {}", n.get(language)));
                    ui.label(small(format!("{}{note}", spec.title.get(language))));
                });
            });
        });
        vec![]
    }

    /// The last thing that was refused, until it is put away.
    pub(super) fn notice_ui(&mut self, ui: &mut egui::Ui) {
        let Some(words) = self.notice.clone() else { return };
        let p = theme::palette(ui);
        let mut away = false;
        egui::Area::new(egui::Id::unique("notice"))
            .anchor(egui::Align2::CENTER_BOTTOM, egui::vec2(0.0, -40.0))
            .order(egui::Order::Foreground)
            .show(ui.ctx(), |ui| {
                egui::Frame::NONE.fill(p.alarm).corner_radius(5).inner_margin(10).show(ui, |ui| {
                    ui.set_max_width(620.0);
                    ui.horizontal(|ui| {
                        ui.add(
                            egui::Label::new(RichText::new(format!("! {words}")).color(p.on_alarm)).wrap(),
                        );
                        away = ui.button(tr!("window.understood")).clicked();
                    });
                });
            });
        if away {
            self.notice = None;
        }
    }
}

/// Titles of the presets, read once: a menu is drawn every frame.
static PRESET_TITLES: LazyLock<Vec<(&'static str, Option<Text>)>> = LazyLock::new(|| {
    let title = |id| vasos_io::rig::preset(id).ok().map(|n| n.spec.title.clone());
    PRESETS.iter().map(|p| (p.id, title(p.id))).collect()
});

fn rig_menu(ui: &mut egui::Ui, document: &Document, actions: &mut Vec<Action>) {
    let language = i18n::current().tag();
    for (id, title) in PRESET_TITLES.iter() {
        let title = title.as_ref().map_or(*id, |t| t.get(language));
        if ui.selectable_label(document.rig.network.spec.id == *id, title).clicked() {
            actions.push(Action::OpenPreset(id));
        }
    }
    ui.separator();
    let before = document.rig.measurement;
    let Measurement { mut noise, mut quantisation, mut resolution } = before;
    ui.checkbox(&mut noise, tr!("menu.noise"));
    ui.checkbox(&mut quantisation, tr!("menu.quantisation"));
    ui.checkbox(&mut resolution, tr!("menu.resolution"));
    let after = Measurement { noise, quantisation, resolution };
    if after != before {
        actions.push(Action::Document(DocumentCommand::Measurement(after)));
    }
    ui.horizontal(|ui| {
        let name = ui.label(tr!("menu.seed"));
        let mut seed = document.rig.seed;
        if ui.add(egui::DragValue::new(&mut seed)).labelled_by(name.id).changed() {
            actions.push(Action::Document(DocumentCommand::Seed(seed)));
        }
    });
}
