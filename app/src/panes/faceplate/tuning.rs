//! The law on the faceplate, and its gains in the form of the user's choice.

use eframe::egui::{self, RichText, Role, WidgetInfo};
use vasos_engine::control::{
    Action as Direction, AntiWindup, Clip, Form, FormGains, Law, ParallelGains, PidGains, Sends, SeriesGains,
};
use vasos_engine::document::DocumentCommand;
use vasos_engine::session::LoopNow;

use super::{State, mv_unit};
use crate::action::Action;
use crate::panes::View;
use crate::{i18n, text, theme, tr};

/// Draws law, gains, weight and filter.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State, now: &LoopNow, actions: &mut Vec<Action>) {
    let Some(settings) = view.document.rig.loops.get(&now.tag) else { return };
    // A recording has had several settings, and shows those of its time.
    let replay = view.snapshot.span_s.is_some();
    let (law_now, tuning, filter_now_s) = if replay {
        (now.law, now.tuning, now.pv_filter_s)
    } else {
        (settings.law, settings.tuning, settings.pv_filter_s)
    };
    law(ui, state, now, actions);
    if !law_now.is_pid() {
        return;
    }
    let unit = text::quotient(mv_unit(view, now), "cm");
    let mut edited = tuning;
    let mut filter_s = filter_now_s;
    let mut fields = Fields { width: ((ui.available_width() - 72.0) / 2.0).clamp(48.0, 84.0), done: false };
    let mut changed = false;
    let mut filter_changed = false;
    ui.style_mut().drag_value_text_style = egui::TextStyle::Small;
    let shown = FormGains::Ideal(tuning.gains).to_form(state.form);
    egui::Grid::new("tuning").min_col_width(14.0).num_columns(4).spacing([4.0, 2.0]).show(ui, |ui| {
        match shown {
            Ok(mut gains) => {
                // What the ideal form cannot hold stays as it is; the gains in use say so.
                if fields.gains(ui, &mut gains, &unit)
                    && let Ok(ideal) = gains.to_ideal()
                {
                    edited.gains = ideal;
                    changed = true;
                }
            }
            Err(error) => {
                // The series form has no such gains: the reason in full under the pointer.
                let reason = i18n::say(&error);
                let words = RichText::new(tr!("faceplate.no_form")).color(theme::palette(ui).caution).small();
                ui.label(words).on_hover_text(reason);
                ui.end_row();
                ui.label("");
                ui.end_row();
            }
        }
        changed |= fields.field(ui, "b", tr!("gain.b"), &mut edited.b, "", 0.01);
        filter_changed |= fields.field(ui, "Tf", tr!("gain.pv_filter"), &mut filter_s, " s", 0.02);
        ui.end_row();
    });
    if changed {
        actions.push(Action::Document(DocumentCommand::Tuning(now.tag.clone(), edited)));
    }
    if filter_changed {
        actions.push(Action::Document(DocumentCommand::PvFilter(now.tag.clone(), filter_s)));
    }
    if fields.done {
        actions.push(Action::Seal);
    }
}

/// Fields of one width; remembers whether one was left.
struct Fields {
    width: f32,
    done: bool,
}

impl Fields {
    fn field(
        &mut self,
        ui: &mut egui::Ui,
        name: &str,
        hint: String,
        value: &mut f64,
        suffix: &str,
        speed: f64,
    ) -> bool {
        let name = ui.label(name).on_hover_text(&hint);
        let decimals = if value.abs() < 0.1 { 5 } else { 3 };
        let drag = egui::DragValue::new(value).speed(speed).max_decimals(decimals).suffix(suffix);
        let response = ui.add_sized([self.width, 20.0], drag).labelled_by(name.id).on_hover_text(hint);
        self.done |= response.drag_stopped() || response.lost_focus();
        response.changed()
    }

    /// The four numbers of a form in two rows; whether one was changed.
    fn gains(&mut self, ui: &mut egui::Ui, gains: &mut FormGains, unit: &str) -> bool {
        let speed = |v: f64| if v.is_finite() { (v.abs() / 100.0).max(1e-4) } else { 1.0 };
        let gain = format!(" {unit}");
        match gains {
            FormGains::Ideal(PidGains { kc, ti_s, td_s, n })
            | FormGains::Series(SeriesGains { kc, ti_s, td_s, n }) => {
                let mut changed = self.field(ui, "Kc", tr!("gain.kc"), kc, &gain, speed(*kc));
                changed |= self.field(ui, "Ti", tr!("gain.ti"), ti_s, " s", speed(*ti_s));
                ui.end_row();
                changed |= self.field(ui, "Td", tr!("gain.td"), td_s, " s", 0.01);
                changed |= self.field(ui, "N", tr!("gain.n"), n, "", 0.1);
                ui.end_row();
                changed
            }
            FormGains::Parallel(ParallelGains { kp, ki, kd, tf_s }) => {
                let mut changed = self.field(ui, "Kp", tr!("gain.kp", unit = unit), kp, "", speed(*kp));
                changed |= self.field(ui, "Ki", tr!("gain.ki", unit = unit), ki, "", speed(*ki));
                ui.end_row();
                changed |= self.field(ui, "Kd", tr!("gain.kd", unit = unit), kd, "", speed(*kd).max(0.01));
                changed |= self.field(ui, "Tf", tr!("gain.tf"), tf_s, " s", 0.01);
                ui.end_row();
                changed
            }
        }
    }
}

/// The choice of a form.
fn forms(ui: &mut egui::Ui, state: &mut State) {
    let name = |form: Form| tr!(&format!("form.{}", form.id()));
    let combo = egui::ComboBox::from_id_salt("form")
        .width(52.0)
        .selected_text(RichText::new(name(state.form)).small());
    let combo = combo.show_ui(ui, |ui| {
        for form in Form::ALL {
            ui.selectable_value(&mut state.form, form, name(form));
        }
    });
    combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, tr!("faceplate.form")));
    combo.response.on_hover_text(tr!("faceplate.form"));
}

/// The law with its choice, its direction, and what is on around it.
fn law(ui: &mut egui::Ui, state: &mut State, now: &LoopNow, actions: &mut Vec<Action>) {
    let direction = match now.action {
        Direction::Reverse => tr!("faceplate.reverse"),
        Direction::Direct => tr!("faceplate.direct"),
    };
    let name = law_name(&now.law);
    ui.horizontal(|ui| {
        let combo =
            egui::ComboBox::from_id_salt("law").width(84.0).selected_text(egui::RichText::new(&name).small());
        let combo = combo.show_ui(ui, |ui| {
            let laws = [
                Law::default(),
                Law::PidI2gl { clip: Clip::Integral, sends: Sends::Position },
                Law::Pid2gl { bias: None, anti_windup: AntiWindup::Clamping },
                Law::Pid2gl { bias: None, anti_windup: AntiWindup::BackCalculation { tracking_s: None } },
                Law::OnOff { gap_cm: 0.5, action: now.action },
            ];
            for law in laws {
                if ui.selectable_label(now.law == law, law_name(&law)).clicked() && now.law != law {
                    actions.push(Action::Document(DocumentCommand::Law(now.tag.clone(), law)));
                }
            }
        });
        combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, tr!("faceplate.law")));
        let last = now.last.parts;
        let number = |v: f64| text::fixed(v, 5);
        let words = tr!("faceplate.parts", p = number(last.p), i = number(last.i), d = number(last.d));
        combo.response.on_hover_text(words);
        if now.law.is_pid() {
            forms(ui, state);
        }
        let words = egui::RichText::new(&direction).small();
        ui.add(egui::Label::new(words).truncate()).on_hover_text(direction);
    });
    if let Law::OnOff { mut gap_cm, action } = now.law {
        ui.horizontal(|ui| {
            let name = ui.label(tr!("faceplate.gap"));
            let field = egui::DragValue::new(&mut gap_cm).range(0.0..=10.0).speed(0.01).suffix(" cm");
            if ui.add(field).labelled_by(name.id).changed() {
                let law = Law::OnOff { gap_cm, action };
                actions.push(Action::Document(DocumentCommand::Law(now.tag.clone(), law)));
            }
        });
    }
}

fn law_name(law: &Law) -> String {
    match law {
        Law::PidI2gl { clip: Clip::Output, .. } => "PID-I2GL".to_owned(),
        Law::PidI2gl { clip: Clip::Integral, .. } => tr!("law.i2gl_integral"),
        Law::Pid2gl { anti_windup: AntiWindup::Clamping, .. } => "PID-2GL".to_owned(),
        Law::Pid2gl { anti_windup: AntiWindup::BackCalculation { .. }, .. } => tr!("law.pid_2gl_back"),
        Law::OnOff { .. } => tr!("law.on_off"),
    }
}
