//! Objective and limits of the best gains, as sliders that the gains follow.

use eframe::egui;
use vasos_engine::document::{DocumentCommand, OptimumSettings};
use vasos_engine::tune::optimum::Objective;

use crate::action::Action;
use crate::panes::View;
use crate::tr;

/// Ranges of the sliders; the far end of each is no limit.
const MS: (f64, f64) = (1.02, 3.0);
const MT: (f64, f64) = (1.0, 3.0);
/// Decades of the slider of Ju about the gain of the tuning in view.
const JU_DECADES: f64 = 1.5;
/// Width of a slider.
const WIDTH: f32 = 54.0;

/// Draws the row.
pub(super) fn ui(ui: &mut egui::Ui, view: &View, actions: &mut Vec<Action>) {
    let settings = view.document.optimum;
    let mut new = settings;
    let mut released = false;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().slider_width = WIDTH;
        ui.spacing_mut().item_spacing.x = 4.0;
        objective(ui, &mut new);
        slider(ui, "Ms", &tr!("tune.limit_ms"), MS, false, &mut new.limits.ms, &mut released);
        slider(ui, "Mt", &tr!("tune.limit_mt"), MT, false, &mut new.limits.mt, &mut released);
        let centre = scale(view);
        let range = (centre * 10f64.powf(-JU_DECADES), centre * 10f64.powf(JU_DECADES));
        slider(ui, "Ju", &tr!("tune.limit_ju"), range, true, &mut new.limits.ju, &mut released);
    });
    if new != settings {
        actions.push(Action::Document(DocumentCommand::Optimum(new)));
    }
    if released || new.objective != settings.objective {
        actions.push(Action::Seal);
    }
}

fn objective(ui: &mut egui::Ui, new: &mut OptimumSettings) {
    let name = |o: Objective| {
        let key = format!("tune.objective_{}", o.id().replace('-', "_"));
        tr!(&key)
    };
    egui::ComboBox::from_id_salt("objective")
        .selected_text(name(new.objective))
        .width(86.0)
        .show_ui(ui, |ui| {
            for objective in Objective::ALL {
                ui.selectable_value(&mut new.objective, objective, name(objective));
            }
        })
        .response
        .on_hover_text(tr!("tune.objective_hint"));
}

/// A slider whose upper end stands for no limit.
fn slider(
    ui: &mut egui::Ui,
    symbol: &str,
    hint: &str,
    (low, high): (f64, f64),
    logarithmic: bool,
    limit: &mut f64,
    released: &mut bool,
) {
    let mut shown = limit.clamp(low, high);
    let label = ui.label(symbol);
    let off = tr!("tune.no_limit");
    let widget = egui::Slider::new(&mut shown, low..=high)
        .logarithmic(logarithmic)
        .custom_formatter(move |v, _| if is_off(v, high) { off.clone() } else { crate::text::brief(v) })
        .custom_parser(|text| text.trim().replace(',', ".").parse().ok());
    let response = ui.add(widget).labelled_by(label.id).on_hover_text(hint);
    if response.changed() {
        *limit = if is_off(shown, high) { f64::INFINITY } else { shown };
    }
    *released |= response.drag_stopped() || response.lost_focus();
}

/// Whether a slider stands at its end, but for rounding.
fn is_off(value: f64, high: f64) -> bool {
    value >= high * (1.0 - 1e-3)
}

/// A gain in MV units per PV unit about which limits on Ju lie: that of the first row that has one.
fn scale(view: &View) -> f64 {
    let of = |row: &crate::tuning::Row| row.analysis.ju.filter(|v| *v > 0.0 && v.is_finite());
    // Of a rule, so that the slider does not move under the hand that drags it.
    let rules =
        view.tuning.rows.iter().filter(|r| r.certificate.is_none() && r.rule != crate::tuning::PRESENT);
    let found: Vec<f64> = rules.filter_map(of).collect();
    let logs: f64 = found.iter().map(|v| v.ln()).sum();
    if found.is_empty() { 1.0 } else { (logs / found.len() as f64).exp() }
}
