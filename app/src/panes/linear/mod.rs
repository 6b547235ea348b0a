//! The rig as a linear model: operating point, matrices, poles and zeros, transfer functions, first order.

pub mod card;

use eframe::egui::{self, RichText};
use num_complex::Complex64;
use vasos_engine::document::{DocumentCommand, ModelOrigin, NewModel};
use vasos_engine::model::ProcessModel;

use self::card::{At, Card, Channel, Key};
use crate::action::Action;
use crate::panes::View;
use crate::widgets::segmented;
use crate::{text, theme, tr};

/// State of the pane.
#[derive(Default)]
pub struct State {
    at: At,
    made: Option<(Key, Result<Card, String>)>,
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    let snapshot = view.snapshot;
    if snapshot.tanks.is_empty() {
        return actions;
    }
    ui.horizontal_wrapped(|ui| {
        let places = [tr!("linear.setpoints"), tr!("linear.inputs"), tr!("linear.now")];
        let chosen = At::ALL.iter().position(|a| *a == state.at).unwrap_or(0);
        if let Some(chosen) = segmented(ui, &tr!("linear.at"), &places, chosen) {
            state.at = At::ALL[chosen];
        }
        ui.weak(tr!(&format!("linear.hint_{}", state.at.key())));
    });
    let key = Key::of(snapshot, state.at);
    if state.made.as_ref().is_none_or(|(known, _)| *known != key) {
        let card = key.card(&snapshot.network);
        state.made = Some((key, card));
    }
    match state.made.as_ref().map(|(_, made)| made) {
        Some(Ok(card)) => {
            egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| show(ui, view, card, &mut actions));
        }
        Some(Err(reason)) => {
            ui.add(egui::Label::new(RichText::new(reason).color(theme::palette(ui).caution)).wrap());
        }
        None => {}
    }
    actions
}

fn show(ui: &mut egui::Ui, view: &View, card: &Card, actions: &mut Vec<Action>) {
    ui.spacing_mut().item_spacing.y = 4.0;
    point(ui, view, card);
    for channel in &card.channels {
        transfer(ui, channel, actions);
    }
    roots(ui, card);
    matrices(ui, view, card);
    remarks(ui, view, card);
}

fn heading(ui: &mut egui::Ui, words: String) {
    ui.add_space(2.0);
    ui.label(RichText::new(words).family(theme::bold()).size(theme::BODY));
}

/// Levels and inputs of the point.
fn point(ui: &mut egui::Ui, view: &View, card: &Card) {
    let (spec, at) = (&view.snapshot.network.spec, &card.linear.point);
    let levels = spec.tanks.iter().zip(&at.levels_cm);
    let mut parts: Vec<String> = levels.map(|(t, h)| format!("{} {} cm", t.id, text::fixed(*h, 3))).collect();
    let inputs = spec.pumps.iter().zip(&at.inputs);
    parts.extend(inputs.map(|(p, u)| format!("{} {} {}", p.id, text::fixed(*u, 4), p.unit.symbol())));
    if card.linear.unrest_cm_s > 1e-6 {
        parts.push(tr!("linear.unrest", rate = text::brief(card.linear.unrest_cm_s)));
    }
    ui.horizontal_wrapped(|ui| {
        for part in parts {
            // A number stays beside its tag.
            ui.label(RichText::new(part.replace(' ', "\u{a0}")).size(theme::TABLE));
        }
    });
}

/// A polynomial in s, falling powers, the last coefficient 1 where it can be.
fn polynomial(coefficients: &[f64]) -> String {
    let n = coefficients.len();
    let mut words = String::new();
    for (i, &c) in coefficients.iter().enumerate() {
        if c == 0.0 && n > 1 {
            continue;
        }
        let power = n - 1 - i;
        let sign = match (words.is_empty(), c < 0.0) {
            (true, true) => "−",
            (true, false) => "",
            (false, true) => " − ",
            (false, false) => " + ",
        };
        words.push_str(sign);
        let number = if c.abs() == 1.0 { "1".to_owned() } else { text::brief(c.abs()) };
        let power = match power {
            0 => String::new(),
            1 => "s".to_owned(),
            2 => "s²".to_owned(),
            3 => "s³".to_owned(),
            n => format!("s^{n}"),
        };
        words.push_str(&match (number.as_str(), power.as_str()) {
            (_, "") => number,
            ("1", _) => power,
            _ => format!("{number} {power}"),
        });
    }
    if words.is_empty() { "0".to_owned() } else { words }
}

/// G(s) as a fraction, and its first-order reduction with a button.
fn transfer(ui: &mut egui::Ui, channel: &Channel, actions: &mut Vec<Action>) {
    heading(ui, format!("{} ← {}", channel.output, channel.input));
    let tf = &channel.transfer;
    // Time constants are read more easily when the last coefficient is 1.
    let last = tf.den.last().copied().filter(|c| *c != 0.0).unwrap_or(1.0);
    let scaled = |c: &[f64]| polynomial(&c.iter().map(|c| c / last).collect::<Vec<_>>());
    let (num, den) = (scaled(&tf.num), scaled(&tf.den));
    ui.horizontal(|ui| {
        ui.label("G(s) =");
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 0.0;
            let above = ui.label(RichText::new(num));
            let below = ui.label(RichText::new(den));
            let width = above.rect.width().max(below.rect.width());
            let y = above.rect.bottom();
            let left = above.rect.left();
            ui.painter().hline(left..=left + width, y, egui::Stroke::new(1.0, theme::palette(ui).text));
        });
        if tf.dead_time_s > 0.0 {
            ui.label(format!("· e^(−{} s)", text::brief(tf.dead_time_s)));
        }
        ui.weak(text::quotient("cm", &channel.input_unit));
    });
    ui.horizontal_wrapped(|ui| match &channel.first {
        Ok(model) => {
            ui.label(format!("{} {}", tr!("linear.first"), words_of(model)));
            if ui.small_button(tr!("linear.use")).on_hover_text(tr!("linear.use_hint")).clicked() {
                actions.push(Action::Document(DocumentCommand::AddModel(Box::new(NewModel {
                    model: model.clone(),
                    origin: ModelOrigin::Typed,
                    fit: None,
                    study: None,
                    rows: None,
                    pv_unit: "cm".to_owned(),
                    mv_unit: channel.input_unit.clone(),
                }))));
            }
        }
        Err(reason) => {
            ui.weak(reason);
        }
    });
}

fn words_of(model: &ProcessModel) -> String {
    let n = text::brief;
    match model {
        ProcessModel::Fopdt(m) => {
            format!("K {}  T {} s  L {} s", n(m.gain), n(m.time_constant_s), n(m.dead_time_s))
        }
        ProcessModel::Ipdt(m) => format!("Kv {}  L {} s", n(m.velocity_gain), n(m.dead_time_s)),
        _ => String::new(),
    }
}

fn root(value: Complex64) -> String {
    let size = |v: f64| text::brief(v);
    if value.im == 0.0 {
        size(value.re)
    } else {
        format!("{} {} {}j", size(value.re), if value.im < 0.0 { "−" } else { "+" }, size(value.im.abs()))
    }
}

/// Poles with their time constants, and the zeros of the whole.
fn roots(ui: &mut egui::Ui, card: &Card) {
    heading(ui, tr!("linear.roots"));
    let model = &card.linear.model;
    egui::Grid::new("roots").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        ui.label(tr!("linear.poles"));
        let poles = model.poles();
        let words = poles.iter().map(|p| {
            let time = if p.im == 0.0 && p.re < 0.0 {
                format!(" ({} s)", text::brief(-1.0 / p.re))
            } else {
                String::new()
            };
            format!("{}{time}", root(*p))
        });
        ui.label(words.collect::<Vec<_>>().join("   "));
        ui.end_row();
        ui.label(tr!("linear.zeros"));
        let zeros = model.zeros();
        let words = zeros.iter().map(|z| root(*z)).collect::<Vec<_>>().join("   ");
        ui.label(if zeros.is_empty() { tr!("linear.none") } else { words });
        ui.end_row();
        if let Some(rga) = model.rga().filter(|r| r.nrows() > 1) {
            ui.label(tr!("linear.rga"));
            let words =
                rga.row_iter().map(|r| r.iter().map(|v| text::fixed(*v, 3)).collect::<Vec<_>>().join("  "));
            ui.label(words.collect::<Vec<_>>().join("\n"));
            ui.end_row();
        }
    });
}

fn matrices(ui: &mut egui::Ui, view: &View, card: &Card) {
    let (model, spec) = (&card.linear.model, &view.snapshot.network.spec);
    let states: Vec<&str> = card.linear.states.iter().map(|&i| spec.tanks[i].id.as_str()).collect();
    let outputs: Vec<&str> = card.linear.outputs.iter().map(|&i| spec.tanks[i].id.as_str()).collect();
    let inputs: Vec<&str> = spec.pumps.iter().map(|p| p.id.as_str()).collect();
    ui.horizontal_top(|ui| {
        let all = [
            ("A", model.a(), &states, &states),
            ("B", model.b(), &states, &inputs),
            ("C", model.c(), &outputs, &states),
            ("D", model.d(), &outputs, &inputs),
        ];
        for (name, matrix, rows, columns) in all {
            ui.vertical(|ui| {
                heading(ui, name.to_owned());
                egui::Grid::new(name).spacing([8.0, 1.0]).show(ui, |ui| {
                    ui.label("");
                    for column in columns {
                        ui.label(RichText::new(*column).small().color(theme::palette(ui).weak));
                    }
                    ui.end_row();
                    for (row, label) in matrix.row_iter().zip(rows) {
                        ui.label(RichText::new(*label).small().color(theme::palette(ui).weak));
                        for value in row.iter() {
                            ui.label(RichText::new(text::brief(*value)).size(theme::TABLE));
                        }
                        ui.end_row();
                    }
                });
            });
            ui.add_space(theme::WIDE_GAP);
        }
    });
    let delays = model.input_delays_s().iter().zip(&inputs).filter(|(d, _)| **d > 0.0);
    let delays: Vec<String> = delays.map(|(d, p)| format!("{p} {} s", text::brief(*d))).collect();
    let words =
        if delays.is_empty() { String::new() } else { tr!("linear.delays", list = delays.join(", ")) };
    ui.weak(format!("ẋ = A x + B u(t − θ),  y = C x + D u   {words}"));
}

fn remarks(ui: &mut egui::Ui, view: &View, card: &Card) {
    let spec = &view.snapshot.network.spec;
    let tank = |&i: &usize| spec.tanks[i].id.clone();
    let mut words: Vec<String> =
        card.linear.left_out.iter().map(|i| tr!("linear.left_out", tag = tank(i))).collect();
    words.extend(card.linear.spilling.iter().map(|i| tr!("linear.spilling", tag = tank(i))));
    words.extend(card.linear.on_a_break.iter().map(|&i| tr!("linear.on_a_break", tag = spec.pumps[i].id)));
    for line in words {
        ui.weak(line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_written_as_people_write_them() {
        assert_eq!(polynomial(&[2.5, -1.0, 0.0, 1.0]), "2.50 s³ − s² + 1");
        assert_eq!(polynomial(&[1.0, 0.0, 0.0, 0.0, 0.0]), "s^4");
        assert_eq!(polynomial(&[0.0]), "0");
        assert_eq!(polynomial(&[-3.0]), "−3.00");
    }
}
