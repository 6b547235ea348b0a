//! The tuning in view below the table: what is to be known of it, and what can be done with it.

use eframe::egui::{self, RichText};
use vasos_engine::control::PidTuning;
use vasos_engine::document::{Applied, Candidate, DocumentCommand};
use vasos_engine::tune::{detuned, find_rule};

use super::{State, candidate, row_in_view, same, setpoint};
use crate::action::Action;
use crate::panes::View;
use crate::tuning::{DETUNED, PRESENT, Row, same_units};
use crate::{i18n, text, theme, tr};

/// Factor of one press of the button that makes gains calmer.
const CALMER: f64 = 1.25;

/// The row in view in words, with what can be done with it; how high that came out is kept.
pub(super) fn below_table(ui: &mut egui::Ui, view: &View, state: &mut State, actions: &mut Vec<Action>) {
    let shown = ui.scope(|ui| details(ui, view, actions)).response.rect;
    let below = shown.height() + ui.spacing().item_spacing.y;
    if state.below.is_none_or(|known| (known - below).abs() > 0.5) {
        state.below = Some(below);
        ui.ctx().request_repaint();
    }
}

fn details(ui: &mut egui::Ui, view: &View, actions: &mut Vec<Action>) {
    let Some(row) = row_in_view(view) else { return };
    let p = theme::palette(ui);
    let other_units = view.document.model().filter(|m| !same_units(view.document, m, view.focus));
    let units = other_units.map(|m| tr!("tune.other_units", unit = text::quotient(&m.mv_unit, &m.pv_unit)));
    let words = units.iter().cloned().chain(row.warnings.iter().map(|w| i18n::say(w)));
    let words = proof(row).into_iter().chain(words).collect::<Vec<_>>().join(" · ");
    let words = if row.analysis.stable { words } else { tr!("tune.unstable_hint") };
    let flagged = units.is_some() || !row.analysis.stable || row.warnings.iter().any(|w| w.limits_validity());
    let source = match (words.is_empty(), flagged) {
        (true, _) => row.source.to_owned(),
        (false, true) => format!("! {words}"),
        (false, false) => words,
    };
    let colour = if flagged { p.caution } else { p.weak };
    let line = ui.add(egui::Label::new(RichText::new(&source).size(theme::SMALL).color(colour)).truncate());
    let formula = find_rule(row.rule, row.kind).and_then(|rule| rule.formula_text(row.kind));
    let formula = formula.map_or_else(String::new, |f| format!("\n{f}\n{}", tr!("tune.formula_symbols")));
    line.on_hover_text(format!("{source}\n{}{formula}", row.source));
    ui.horizontal_wrapped(|ui| {
        let tag = view.snapshot.loops.get(view.focus).map(|l| l.tag.clone());
        let usable = row.gains.ti_s.is_finite() && row.analysis.stable;
        let able = tag.is_some() && row.rule != PRESENT && usable;
        let words = tag.as_ref().map_or_else(|| tr!("tune.apply"), |t| apply_words(view, row, t));
        let button = egui::Button::new(RichText::new(words).color(p.on_accent)).fill(p.accent);
        let hint = match (row.analysis.stable, row.gains.ti_s.is_finite()) {
            (false, _) => tr!("tune.unstable_hint"),
            (true, false) => tr!("tune.needs_integral"),
            (true, true) => tr!("tune.apply_hint"),
        };
        if ui.add_enabled(able, button).on_hover_text(&hint).on_disabled_hover_text(hint).clicked()
            && let Some(tag) = tag
        {
            actions.push(apply(view, row, tag));
        }
        if ui.button(tr!("tune.copy")).clicked() {
            actions.push(Action::Copy(as_text(row)));
        }
        let compared = view.tuning.compared.iter().any(|c| same(c, row));
        let button = egui::Button::selectable(compared, tr!("tune.compare"));
        if ui.add(button).on_hover_text(tr!("tune.compare_hint")).clicked() {
            actions.push(Action::Document(DocumentCommand::Compare(candidate(row))));
        }
        if ui.button(tr!("tune.detune")).on_hover_text(tr!("tune.detune_hint")).clicked() {
            let calmer =
                Candidate { rule: DETUNED.to_owned(), gains: detuned(&row.gains, CALMER), ..candidate(row) };
            actions.push(Action::Document(DocumentCommand::Candidate(Some(calmer))));
            actions.push(Action::Seal);
        }
        setpoint::ui(ui, view, actions);
        if let (Some(tau_c_s), Some(rule)) = (row.tau_c_s, find_rule(row.rule, row.kind)) {
            let name = ui.label("τc");
            let mut value = tau_c_s;
            let field = egui::DragValue::new(&mut value)
                .range(1e-3..=1e6)
                .speed(tau_c_s / 100.0)
                .max_decimals(3)
                .suffix(" s");
            let field = ui.add(field).labelled_by(name.id).on_hover_text(tr!("tune.tau_c_hint"));
            if field.changed() {
                actions.push(Action::Document(DocumentCommand::TauC(rule.id.to_owned(), Some(value))));
            }
            if field.drag_stopped() || field.lost_focus() {
                actions.push(Action::Seal);
            }
            if view.document.tau_c_s.contains_key(rule.id) && ui.button(tr!("tune.default")).clicked() {
                actions.push(Action::Document(DocumentCommand::TauC(rule.id.to_owned(), None)));
            }
        }
    });
}

/// What holds the best gains where they are.
fn proof(row: &Row) -> Option<String> {
    let certificate = row.certificate.as_ref()?;
    let active: Vec<String> = certificate.active.iter().map(ToString::to_string).collect();
    let held = if active.is_empty() { "–".to_owned() } else { active.join(", ") };
    Some(match certificate.gap {
        Some(gap) => tr!("tune.proof", limits = held, gap = text::brief(100.0 * gap.max(1e-7))),
        None => tr!("tune.proof_simulated", limits = held),
    })
}

/// The PV filter that a row brings along, in seconds, where it is not the one in use.
///
/// Unfiltered derivative action keeps the pump at its limits with a rig's noise: with the paper's AMIGO tuning of
/// STAD a filter of about Td (1 s) ends that.
fn new_filter_s(view: &View, row: &Row, tag: &str) -> Option<f64> {
    let now_s = view.document.rig.loops.get(tag).map_or(0.0, |s| s.pv_filter_s);
    (row.gains.td_s > 0.0 && now_s == 0.0).then_some(row.gains.td_s)
}

/// What the button does, said on it.
fn apply_words(view: &View, row: &Row, tag: &str) -> String {
    match new_filter_s(view, row, tag) {
        Some(filter_s) => tr!("tune.apply_filter", tag = tag, filter = text::brief(filter_s)),
        None => tr!("tune.apply_to", tag = tag),
    }
}

/// What a loop takes over with a row: the weight and the filter of the setpoint that were chosen for an overshoot, else
/// those it has.
pub(in crate::panes) fn applied(view: &View, row: &Row, tag: &str) -> Applied {
    let settings = view.document.rig.loops.get(tag);
    let (b, c) = settings.map_or((1.0, 0.0), |s| (s.tuning.b, s.tuning.c));
    let kept_s = settings.map_or(0.0, |s| s.pv_filter_s);
    let setpoint_s = settings.map_or(0.0, |s| s.options.setpoint.filter_s);
    let side = view.tuning.setpoint.flatten();
    let (b, c, setpoint_filter_s) = side.map_or((b, c, setpoint_s), |side| (side.b, 0.0, side.filter_s));
    Applied {
        tuning: PidTuning { gains: row.gains, b, c },
        pv_filter_s: new_filter_s(view, row, tag).unwrap_or(kept_s),
        setpoint_filter_s,
    }
}

fn apply(view: &View, row: &Row, tag: String) -> Action {
    let applied = applied(view, row, &tag);
    Action::Document(DocumentCommand::ApplyTuning(tag, applied))
}

fn as_text(row: &Row) -> String {
    let g = &row.gains;
    format!("{} {}: Kc = {}, Ti = {} s, Td = {} s, N = {}", row.rule, row.kind, g.kc, g.ti_s, g.td_s, g.n)
}
