//! The speed of the loop, taken hold of in the plot of its setpoint step: τc of the rules that leave it free.

use eframe::egui::{self, RichText};
use egui_plot::{Line, LineStyle, PlotPoint, PlotPoints, Text};
use vasos_engine::document::DocumentCommand;
use vasos_engine::tune::find_rule;

use crate::action::Action;
use crate::plots::{self, Grip};
use crate::tuning::Row;
use crate::{text, theme, tr};

/// Shortest τc that a drag reaches, as a share of the one at its beginning and of the dead time.
const SHORTEST: (f64, f64) = (0.02, 0.05);

/// A drag under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drag {
    /// s.
    least_s: f64,
    /// Time axis at its beginning: it stands still meanwhile, whatever the response does.
    pub axis_s: f64,
}

/// Where a loop that follows its setpoint as e^(−θs)/(τc s + 1) is at 63.2 % of its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Handle {
    rule: &'static str,
    dead_time_s: f64,
    tau_c_s: f64,
}

impl Handle {
    /// Of a row whose rule has a τc to choose.
    pub(super) fn of(row: &Row, dead_time_s: f64) -> Option<Self> {
        let tau_c_s = row.tau_c_s.filter(|tau_c_s| *tau_c_s > 0.0)?;
        let rule = find_rule(row.rule, row.kind)?.id;
        Some(Self { rule, dead_time_s, tau_c_s })
    }

    fn at_s(&self) -> f64 {
        self.dead_time_s + self.tau_c_s
    }

    /// A line from the time axis to the point that the rule wants the loop to pass.
    pub(super) fn draw(&self, plot: &mut egui_plot::PlotUi<'_>, p: &theme::Palette) {
        const REACHED: f64 = 0.632;
        let at_s = self.at_s();
        let line = PlotPoints::from(vec![[at_s, 0.0], [at_s, REACHED]]);
        let line = Line::new(tr!("step.speed_hint"), line).color(p.caution).width(1.4);
        plot.line(line.style(LineStyle::dashed_dense()).allow_hover(false));
        let grip = egui_plot::Points::new(tr!("step.speed_hint"), vec![[at_s, REACHED]])
            .radius(5.0)
            .color(p.caution);
        plot.points(grip.allow_hover(false));
        let words = RichText::new(format!(" τc {} s", text::brief(self.tau_c_s)));
        let words = words.color(p.caution).size(theme::SMALL);
        plot.text(Text::new("", PlotPoint::new(at_s, 0.12), words).anchor(egui::Align2::LEFT_CENTER));
    }

    /// The handle follows the pointer, and τc the handle.
    pub(super) fn drag(
        &self,
        ui: &egui::Ui,
        drag: &mut Option<Drag>,
        axis_s: f64,
        shown: &egui_plot::PlotResponse<()>,
    ) -> Vec<Action> {
        let scale = shown.transform.dpos_dvalue_x().abs();
        let at = match plots::grip(ui, shown, drag.is_some(), |at| (at.x - self.at_s()).abs() * scale) {
            Grip::Away => return vec![],
            Grip::Released => {
                *drag = None;
                return vec![Action::Seal];
            }
            Grip::Near => {
                ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
                shown.response.clone().on_hover_text_at_pointer(tr!("step.speed_hint"));
                return vec![];
            }
            Grip::Held(at) => at,
        };
        ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
        let least_s = (SHORTEST.0 * self.tau_c_s).max(SHORTEST.1 * self.dead_time_s);
        let Drag { least_s, axis_s } = *drag.get_or_insert(Drag { least_s, axis_s });
        let tau_c_s = (at.x.min(axis_s) - self.dead_time_s).max(least_s);
        vec![Action::Document(DocumentCommand::TauC(self.rule.to_owned(), Some(tau_c_s)))]
    }
}
