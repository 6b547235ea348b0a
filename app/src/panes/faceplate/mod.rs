//! The faceplate of a loop: PV, SP and MV on bars, mode, keys, tuning in use, alarms.

mod tuning;

use eframe::egui::{self, Align2, Color32, FontId, Rect, Role, Sense, Stroke, WidgetInfo, pos2, vec2};
use vasos_engine::control::{Form, Mode};
use vasos_engine::document::DocumentCommand;
use vasos_engine::session::{LoopNow, RigCommand};
use vasos_engine::sim::LoopTarget;

use crate::action::Action;
use crate::panes::View;
use crate::widgets::segmented;
use crate::{text, theme, tr};

/// State of the pane.
pub struct State {
    /// The loop in view: what is identified, compared and tuned is this one.
    pub shown: usize,
    /// Form in which its gains are shown and typed.
    form: Form,
}

impl Default for State {
    fn default() -> Self {
        Self { shown: 0, form: Form::Ideal }
    }
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    let loops = &view.snapshot.loops;
    state.shown = state.shown.min(loops.len().saturating_sub(1));
    let Some(now) = loops.get(state.shown) else {
        ui.weak(tr!("faceplate.none"));
        return actions;
    };
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        ui.spacing_mut().button_padding.x = 5.0;
        // What was recorded can be looked at, and at another loop of it.
        let recorded = view.snapshot.span_s.is_some();
        heading(ui, view, state, now, &mut actions);
        bars(ui, view, now);
        ui.add_enabled_ui(!recorded, |ui| {
            setpoint_keys(ui, view, now, &mut actions);
            tuning::ui(ui, view, state, now, &mut actions);
        });
        alarms(ui, view, now);
    });
    actions
}

fn heading(ui: &mut egui::Ui, view: &View, state: &mut State, now: &LoopNow, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        if view.snapshot.loops.len() > 1 {
            let combo = egui::ComboBox::from_id_salt("loop").width(78.0).selected_text(&now.tag);
            let combo = combo.show_ui(ui, |ui| {
                for (i, other) in view.snapshot.loops.iter().enumerate() {
                    ui.selectable_value(&mut state.shown, i, &other.tag);
                }
            });
            combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, tr!("faceplate.loop")));
        } else {
            ui.label(egui::RichText::new(&now.tag).family(theme::bold()).size(15.0));
        }
        let mut modes = vec![(tr!("mode.man"), Mode::Manual), (tr!("mode.auto"), Mode::Automatic)];
        if now.outer.is_some() {
            modes.push((tr!("mode.cas"), Mode::Cascade));
        }
        let chosen = modes.iter().position(|(_, m)| *m == now.mode).unwrap_or(0);
        let names: Vec<String> = modes.iter().map(|(name, _)| name.clone()).collect();
        let recorded = view.snapshot.span_s.is_some();
        let clicked =
            ui.add_enabled_ui(!recorded, |ui| segmented(ui, &tr!("faceplate.mode"), &names, chosen)).inner;
        if let Some(chosen) = clicked {
            actions.push(Action::Document(DocumentCommand::Mode(now.tag.clone(), modes[chosen].1)));
        }
    });
}

fn bars(ui: &mut egui::Ui, view: &View, now: &LoopNow) {
    let p = theme::palette(ui);
    let network = &view.snapshot.network;
    let rim = network.tanks[network.sensors[now.sensor].tank].height_cm;
    let unit = mv_unit(view, now);
    let height = (ui.available_height() - 248.0).clamp(28.0, 260.0);
    let columns = [
        ("PV", now.pv_cm, 0.0, rim, "cm", 2, p.pv),
        ("SP", now.setpoint_cm, 0.0, rim, "cm", 2, p.sp),
        ("MV", now.mv, now.range.low, now.range.high, unit, 2, p.mv),
    ];
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height + 38.0), Sense::hover());
    response.widget_info(|| {
        let words = columns.map(|(n, v, .., u, d, _)| format!("{n} {} {u}", text::fixed(v, d))).join(", ");
        WidgetInfo::labeled(Role::Label, true, words)
    });
    let width = rect.width() / 3.0;
    for (i, (name, value, low, high, unit, decimals, colour)) in columns.into_iter().enumerate() {
        let x = rect.left() + width * (i as f32 + 0.5);
        let well = Rect::from_center_size(pos2(x, rect.top() + 18.0 + height * 0.5), vec2(26.0, height));
        let name = ui.painter().layout_no_wrap(name.to_owned(), theme::bold_font(13.0), colour);
        let unit = ui.painter().layout_no_wrap(unit.to_owned(), FontId::proportional(11.0), p.weak);
        let left = x - 0.5 * (name.size().x + 3.0 + unit.size().x);
        let under = name.size().y - unit.size().y;
        ui.painter().galley(pos2(left + name.size().x + 3.0, rect.top() + under), unit, p.weak);
        ui.painter().galley(pos2(left, rect.top()), name, colour);
        bar(ui, well, ((value - low) / (high - low)) as f32, colour, &p);
        let reading = text::fixed(value, decimals);
        let at = pos2(x, well.bottom() + 3.0);
        ui.painter().text(at, Align2::CENTER_TOP, reading, theme::bold_font(17.0), p.text);
        for (share, value) in [(1.0, high), (0.0, low)] {
            let y = well.bottom() - share * well.height();
            let at = pos2(well.right() + 3.0, y);
            let align = if share > 0.5 { Align2::LEFT_TOP } else { Align2::LEFT_BOTTOM };
            ui.painter().text(at, align, text::brief(value), FontId::proportional(10.0), p.weak);
        }
    }
}

/// Unit of a loop's output: of its pump, or of its inner loop's setpoint.
fn mv_unit(view: &View, now: &LoopNow) -> &'static str {
    match now.target {
        LoopTarget::Pump(pump) => view.snapshot.network.spec.pumps[pump].unit.symbol(),
        LoopTarget::Loop(_) => "cm",
    }
}

fn bar(ui: &egui::Ui, well: Rect, share: f32, colour: Color32, p: &theme::Palette) {
    ui.painter().rect(well, 2.0, p.well, Stroke::new(1.0, p.edge), egui::StrokeKind::Inside);
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    let top = well.bottom() - share * well.height();
    ui.painter().rect_filled(
        Rect::from_min_max(pos2(well.left() + 1.0, top), well.max - vec2(1.0, 1.0)),
        1.0,
        colour,
    );
    for tick in 1..4 {
        let y = well.bottom() - well.height() * tick as f32 / 4.0;
        ui.painter().hline(well.left()..=well.left() + 4.0, y, Stroke::new(1.0, p.weak));
    }
}

fn setpoint_keys(ui: &mut egui::Ui, view: &View, now: &LoopNow, actions: &mut Vec<Action>) {
    let network = &view.snapshot.network;
    let rim = network.tanks[network.sensors[now.sensor].tank].height_cm;
    let manual = now.mode == Mode::Manual;
    let (label, value, low, high, unit) = if manual {
        (tr!("faceplate.output"), now.mv, now.limits.low, now.limits.high, mv_unit(view, now))
    } else {
        (tr!("faceplate.setpoint"), now.setpoint_cm, 0.0, rim, "cm")
    };
    let set = |value: f64| {
        let value = value.clamp(low, high);
        if manual {
            Action::Rig(RigCommand::Mv { tag: now.tag.clone(), value })
        } else {
            Action::Document(DocumentCommand::Setpoint(now.tag.clone(), value))
        }
    };
    ui.horizontal(|ui| {
        let name = ui.label(label);
        let mut edited = value;
        let field = egui::DragValue::new(&mut edited)
            .range(low..=high)
            .speed((high - low) / 500.0)
            .max_decimals(3)
            .suffix(format!(" {unit}"));
        let response = ui.add(field).labelled_by(name.id);
        if response.changed() {
            actions.push(set(edited));
        }
        if response.drag_stopped() || response.lost_focus() {
            actions.push(Action::Seal);
        }
        if ui.button(tr!("faceplate.steady")).on_hover_text(tr!("faceplate.steady_hint")).clicked() {
            actions.push(Action::SteadyAt(now.tag.clone(), now.setpoint_cm));
        }
    });
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let width = (ui.available_width() - 9.0) / 4.0;
        for percent in [-10.0, -1.0, 1.0, 10.0] {
            let sign = if percent > 0.0 { "+" } else { "−" };
            let key = egui::Button::new(format!("{sign}{} %", f64::abs(percent)))
                .min_size(vec2(width, theme::PRESS));
            let key = ui.add_sized([width, theme::PRESS], key).on_hover_text(tr!("faceplate.keys_hint"));
            if key.clicked() {
                actions.push(set(value + percent / 100.0 * (high - low)));
                actions.push(Action::Seal);
            }
        }
    });
}

fn alarms(ui: &mut egui::Ui, view: &View, now: &LoopNow) {
    let p = theme::palette(ui);
    let network = &view.snapshot.network;
    let sensor = &network.spec.sensors[now.sensor].id;
    let pump = &network.spec.pumps[now.pump].id;
    let tank = &network.spec.tanks[network.sensors[now.sensor].tank].id;
    let mine = |tag: &str| tag == now.tag || tag == sensor || tag == pump || tag == tank;
    let alarms = view.snapshot.alarms.iter().filter(|a| mine(a.tag()));
    let words: Vec<String> = alarms.map(|a| tr!(&format!("alarm.{}", a.key()), tag = a.tag())).collect();
    let Some(first) = words.first() else {
        ui.weak(tr!("faceplate.no_alarm"));
        return;
    };
    // One line, so that it is in view whatever the height; all of them under the pointer.
    let more = if words.len() > 1 { format!(" +{}", words.len() - 1) } else { String::new() };
    let line = egui::RichText::new(format!("! {first}{more}")).color(p.on_alarm).small();
    egui::Frame::NONE.fill(p.alarm).corner_radius(3).inner_margin(egui::Margin::symmetric(4, 1)).show(
        ui,
        |ui| {
            ui.add(egui::Label::new(line).truncate()).on_hover_text(words.join("\n"));
        },
    );
}
