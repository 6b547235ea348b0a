//! Rules and the best gains compared on the model in use; one is looked at, and applied to the loop with one action.

mod in_view;
mod limits;
mod map;
mod setpoint;

use eframe::egui::{self, RichText};
use egui_extras::{Column, TableBuilder};
use vasos_engine::document::{Candidate, DocumentCommand};
use vasos_engine::tune::ControllerKind;

use crate::action::Action;
use crate::panes::View;
use crate::tuning::{DETUNED, OPTIMAL, PRESENT, Refusal, Refused, Row, same_units};
use crate::widgets::segmented;
use crate::{text, theme, tr};

pub(super) use in_view::applied;

/// Width of a column of figures.
const COLUMN: f32 = 35.0;
/// Height of a row.
const ROW: f32 = 24.0;
/// Height of the two lines of titles.
const HEAD: f32 = 32.0;

/// Height of what stands below the table before it has been drawn once.
const BELOW: f32 = 58.0;

/// Form in which gains are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Form {
    #[default]
    Ideal,
    Parallel,
}

/// State of the pane.
#[derive(Default)]
pub struct State {
    kind: usize,
    form: Form,
    map: bool,
    /// Height of what stands below the table, as it was drawn last.
    below: Option<f32>,
    on_map: map::State,
}

/// The row in view: the candidate, else the tuning in use.
#[must_use]
pub fn row_in_view<'a>(view: &View<'a>) -> Option<&'a Row> {
    match &view.document.candidate {
        Some(c) => view.tuning.find(&c.rule, &c.controller).or(view.tuning.rows.first()),
        None => view.tuning.rows.first(),
    }
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    if view.tuning.model.is_none() {
        ui.add(egui::Label::new(RichText::new(tr!("tune.no_model")).color(theme::palette(ui).weak)).wrap());
        return actions;
    }
    ui.horizontal_wrapped(|ui| {
        let views = [tr!("tune.table"), tr!("tune.map")];
        if let Some(chosen) = segmented(ui, &tr!("tune.view"), &views, usize::from(state.map)) {
            state.map = chosen == 1;
        }
        if state.map {
            map::head(ui, &mut state.on_map);
            return;
        }
        let kinds = [tr!("tune.all"), "PI".to_owned(), "PID".to_owned(), "P, PD".to_owned()];
        if let Some(kind) = segmented(ui, &tr!("tune.controller"), &kinds, state.kind) {
            state.kind = kind;
        }
        let forms = [tr!("tune.ideal"), tr!("tune.parallel")];
        if let Some(form) =
            segmented(ui, &tr!("tune.form"), &forms, usize::from(state.form == Form::Parallel))
        {
            state.form = if form == 1 { Form::Parallel } else { Form::Ideal };
        }
    });
    limits::ui(ui, view, &mut actions);
    ultimate(ui, view, &mut actions);
    // Buttons wrap where the pane is narrow, and the table gives them the room they took.
    let below = state.below.unwrap_or(BELOW);
    let height = (ui.available_height() - below).max(60.0);
    if state.map {
        map::ui(ui, view, &mut state.on_map, height, &mut actions);
        in_view::below_table(ui, view, state, &mut actions);
        return actions;
    }
    egui::ScrollArea::horizontal().max_height(height).auto_shrink([false, false]).show(ui, |ui| {
        ui.set_min_width(88.0 + 9.0 * (COLUMN + 3.0) + 14.0);
        ui.spacing_mut().item_spacing = egui::vec2(3.0, 0.0);
        table(ui, view, state, height, &mut actions);
    });
    in_view::below_table(ui, view, state, &mut actions);
    actions
}

fn shown(state: &State, kind: ControllerKind) -> bool {
    match state.kind {
        1 => kind == ControllerKind::Pi,
        2 => kind == ControllerKind::Pid,
        3 => matches!(kind, ControllerKind::P | ControllerKind::Pd),
        _ => true,
    }
}

/// A rule that gives nothing for this model, with its reason under the pointer.
fn refusal(line: &mut egui_extras::TableRow<'_, '_>, refusal: &Refusal, ink: egui::Color32) {
    let why = refusal.why.say();
    line.col(|ui| {
        let words = format!("{} · {}", tr!(refusal.title_key), refusal.kind);
        ui.add(egui::Label::new(RichText::new(words).size(theme::TABLE).color(ink)).truncate())
            .on_hover_text(&why);
    });
    for _ in 0..9 {
        line.col(|ui| {
            let mark = if matches!(refusal.why, Refused::Pending) { "…" } else { "–" };
            ui.label(RichText::new(mark).size(theme::TABLE).color(ink)).on_hover_text(&why);
        });
    }
}

fn table(ui: &mut egui::Ui, view: &View, state: &State, height: f32, actions: &mut Vec<Action>) {
    let p = theme::palette(ui);
    let chosen = row_in_view(view).map(|r| (r.rule, r.kind));
    let rows: Vec<&Row> =
        view.tuning.rows.iter().filter(|r| shown(state, r.kind) || r.rule == PRESENT).collect();
    let place = |row: &Row| view.tuning.compared.iter().position(|c| same(c, row));
    let refusals: Vec<&Refusal> = view.tuning.refusals.iter().filter(|r| shown(state, r.kind)).collect();
    // Best gains that cannot be had stand where they would stand.
    let (first, last): (Vec<&Refusal>, Vec<&Refusal>) =
        refusals.into_iter().partition(|r| r.title_key == "rules.optimal");
    let leading = |r: &Row| [PRESENT, OPTIMAL, DETUNED].contains(&r.rule);
    let lead = rows.iter().take_while(|r| leading(r)).count();
    let entry = view.document.model();
    let (pv, mv) = entry.map_or(("", ""), |e| (e.pv_unit.as_str(), e.mv_unit.as_str()));
    // A long unit has no room above a narrow column; the pointer over the title shows it whole.
    let short = |unit: String| if unit.chars().count() > 6 { "…".to_owned() } else { unit };
    let (gain, inverse) = (short(text::quotient(mv, pv)), short(format!("{}·s", text::quotient(pv, mv))));
    let gains = match state.form {
        Form::Ideal => [format!("Kc\n{gain}"), "Ti\ns".to_owned(), "Td\ns".to_owned()],
        Form::Parallel => [format!("Kp\n{gain}"), format!("Ki\n{gain}/s"), format!("Kd\n{gain}·s")],
    };
    let rest = [
        ("Ms".to_owned(), tr!("tune.ms_hint")),
        ("Mt".to_owned(), tr!("tune.mt_hint")),
        (format!("Jv\n{inverse}"), tr!("tune.jv_hint")),
        (format!("Ju\n{gain}"), tr!("tune.ju_hint")),
        (tr!("tune.iae_header"), tr!("tune.iae_hint")),
        (tr!("tune.overshoot_header"), tr!("tune.overshoot_hint")),
    ];
    TableBuilder::new(ui)
        .striped(true)
        .sense(egui::Sense::click())
        .cell_layout(egui::Layout::left_to_right(egui::Align::Center))
        .column(Column::remainder().at_least(88.0).clip(true))
        .columns(Column::exact(COLUMN), 8)
        .column(Column::exact(COLUMN + 6.0))
        .min_scrolled_height(40.0)
        .max_scroll_height(((height - HEAD - 4.0) / ROW).floor().max(1.0) * ROW)
        .auto_shrink([false, true])
        .header(HEAD, |mut header| {
            let small = |words: &str| RichText::new(words).size(theme::SMALL).color(p.weak);
            let head = |words: &str| egui::Label::new(small(words)).extend();
            header.col(|ui| {
                ui.add(head(&tr!("tune.rule")));
            });
            for title in &gains {
                header.col(|ui| {
                    ui.add(head(title)).on_hover_text(title.replace('\n', " "));
                });
            }
            for (title, hint) in &rest {
                header.col(|ui| {
                    ui.add(head(title)).on_hover_text(hint);
                });
            }
        })
        .body(|body| {
            body.rows(ROW, rows.len() + first.len() + last.len(), |mut line| {
                let index = line.index();
                if index >= lead && index < lead + first.len() {
                    refusal(&mut line, first[index - lead], p.weak);
                    return;
                }
                let index = if index < lead { index } else { index - first.len() };
                let Some(row) = rows.get(index) else {
                    refusal(&mut line, last[index - rows.len()], p.weak);
                    return;
                };
                let selected = chosen == Some((row.rule, row.kind));
                line.set_selected(selected);
                let ink = if selected { p.on_accent } else { p.text };
                cells(&mut line, row, state, ink, place(row).map(|k| theme::series(&p, k + 1)));
                if line.response().clicked() {
                    choose(row, actions);
                }
            });
        });
}

/// Makes a row the one in view.
fn choose(row: &Row, actions: &mut Vec<Action>) {
    actions.push(Action::Document(DocumentCommand::Candidate(Some(candidate(row)))));
    actions.push(Action::Seal);
}

fn candidate(row: &Row) -> Candidate {
    Candidate { rule: row.rule.to_owned(), controller: row.kind.id().to_owned(), gains: row.gains }
}

fn same(a: &Row, b: &Row) -> bool {
    a.rule == b.rule && a.kind == b.kind
}

/// What a row is called.
#[must_use]
pub fn title(row: &Row) -> String {
    format!("{} · {}", tr!(&row.title_key), row.kind)
}

/// Ku and Pu of a test, where rules start from them, with the way back to the model's.
fn ultimate(ui: &mut egui::Ui, view: &View, actions: &mut Vec<Action>) {
    let Some(found) = view.document.ultimate else { return };
    let p = theme::palette(ui);
    ui.horizontal_wrapped(|ui| {
        let used = view.document.model().is_some_and(|m| same_units(view.document, m, view.focus));
        let words = tr!("tune.ultimate", ku = text::brief(found.ku), pu = text::brief(found.pu_s));
        let words = if used { words } else { format!("! {}", tr!("tune.ultimate_other_units")) };
        let colour = if used { p.weak } else { p.caution };
        ui.add(egui::Label::new(RichText::new(words).size(theme::SMALL).color(colour)).wrap());
        if ui.small_button(tr!("tune.ultimate_of_model")).clicked() {
            actions.push(Action::Document(DocumentCommand::Ultimate(None)));
        }
    });
}

fn cells(
    line: &mut egui_extras::TableRow<'_, '_>,
    row: &Row,
    state: &State,
    ink: egui::Color32,
    compared: Option<egui::Color32>,
) {
    let flagged = !row.valid || !row.analysis.stable;
    line.col(|ui| {
        let sign = if flagged { "! " } else { "" };
        let words = format!("{sign}{}", title(row));
        if let Some(colour) = compared {
            let (place, dot) = ui.allocate_exact_size(egui::vec2(8.0, 8.0), egui::Sense::hover());
            ui.painter().circle_filled(place.center(), 3.5, colour);
            dot.on_hover_text(tr!("tune.compared"));
        }
        ui.add(egui::Label::new(RichText::new(&words).size(theme::TABLE).color(ink)).truncate())
            .on_hover_text(words);
    });
    let g = &row.gains;
    let none = |v: f64| if v == 0.0 || v.is_infinite() { "–".to_owned() } else { text::cell(v) };
    let gains = match state.form {
        Form::Ideal => [text::cell(g.kc), none(g.ti_s), none(g.td_s)],
        Form::Parallel => [text::cell(g.kc), none(g.ki()), none(g.kd())],
    };
    for cell in gains {
        line.col(|ui| {
            ui.label(RichText::new(cell).size(theme::TABLE).color(ink));
        });
    }
    if !row.analysis.stable {
        line.col(|ui| {
            ui.label(RichText::new(tr!("tune.unstable")).size(theme::TABLE).color(ink));
        });
        for _ in 0..5 {
            line.col(|_| {});
        }
        return;
    }
    let a = &row.analysis;
    for value in [a.ms, a.mt, a.jv, a.ju, row.figures.iae_load, row.figures.overshoot_percent] {
        line.col(|ui| {
            ui.label(
                RichText::new(value.map_or_else(|| "–".to_owned(), text::cell)).size(theme::TABLE).color(ink),
            );
        });
    }
}
