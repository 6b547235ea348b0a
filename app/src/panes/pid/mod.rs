//! The living P&ID: model, layout, paint, and what the pointer does.

mod faults;
pub mod layout;
pub mod model;
mod paint;

use std::sync::Arc;

use eframe::egui::{self, Id, Rect, Role, Sense, WidgetInfo, vec2};
use vasos_engine::document::DocumentCommand;
use vasos_engine::plant::{FaultyPart, Network};
use vasos_engine::session::RigCommand;

use self::layout::Layout;
use self::model::{BubbleView, PidModel, PumpView, TankView, ValveView};
use crate::action::Action;
use crate::panes::View;
use crate::{text, theme, tr};

/// Degrees a valve turns per point of a drag.
const TURN_DEG: f64 = 0.5;

/// State of the pane.
#[derive(Default)]
pub struct State {
    layout: Option<(Arc<Network>, Layout)>,
    phases: Vec<f64>,
    last_s: f64,
    turning: Option<(usize, f64)>,
}

impl State {
    fn layout(&mut self, network: &Arc<Network>) -> Layout {
        if self.layout.as_ref().is_none_or(|(known, _)| !Arc::ptr_eq(known, network)) {
            self.layout = Some((network.clone(), Layout::of(network)));
            self.phases.clear();
        }
        self.layout.as_ref().map(|(_, l)| l.clone()).expect("just made")
    }

    /// Moves the dashes on by the time since the last frame.
    fn advance(&mut self, model: &PidModel, now_s: f64, running: bool) {
        let dt = if running { (now_s - self.last_s).clamp(0.0, 0.1) } else { 0.0 };
        self.last_s = now_s;
        let pumps = model.pumps.iter().flat_map(|p| [p.suction.flow_cm3_s, p.discharge.flow_cm3_s]);
        let valves = model.valves.iter().map(|v| v.stream.flow_cm3_s);
        let spills = model.tanks.iter().map(|t| t.spill_cm3_s);
        let flows: Vec<f64> = pumps.chain(valves).chain(spills).collect();
        self.phases.resize(flows.len(), 0.0);
        for (phase, flow) in self.phases.iter_mut().zip(flows) {
            // Even a trickle is seen to move.
            let speed = flow.signum() * (flow.abs() * paint::TRAVEL + 4.0).min(90.0);
            *phase += if flow.abs() < model::STILL_CM3_S { 0.0 } else { speed * dt };
        }
    }
}

/// Draws the pane.
pub fn ui(ui: &mut egui::Ui, view: &View, state: &mut State) -> Vec<Action> {
    let mut actions = vec![];
    let p = theme::palette(ui);
    let rect = ui.available_rect_before_wrap();
    ui.allocate_rect(rect, Sense::hover());
    let layout = state.layout(&view.snapshot.network);
    let drawing = rect.shrink2(vec2(6.0, 4.0)).with_min_y(rect.top() + 22.0).with_max_y(rect.bottom() - 18.0);
    let model = PidModel::new(view.snapshot, &layout, drawing);
    state.advance(&model, ui.input(|i| i.time), view.snapshot.running);
    let phases = &state.phases;
    paint::paint(ui.painter(), &model, &p, &|i| phases.get(i).map_or(0.0, |v| (*v % 1e4) as f32));
    for (i, tank) in model.tanks.iter().enumerate() {
        tank_popup(ui, view, i, tank, &mut actions);
    }
    for (i, valve) in model.valves.iter().enumerate() {
        valve_ui(ui, view, state, i, valve, model.scale, &mut actions);
    }
    for (i, pump) in model.pumps.iter().enumerate() {
        pump_ui(ui, view, i, pump, model.scale, &mut actions);
    }
    for bubble in model.bubbles.iter().filter(|b| b.automatic.is_none()) {
        sensor_ui(ui, view, bubble, model.scale, &mut actions);
    }
    paint::faults(ui.painter(), &model, &p);
    rig_ui(ui, view, rect, &mut actions);
    let recorded = view.snapshot.span_s.is_some();
    let hint = if recorded { tr!("pid.recorded_hint") } else { tr!("pid.hint") };
    paint::hint(ui.painter(), rect, &hint, &p);
    if recorded {
        // Views of it may change, what happened may not.
        actions.retain(|action| !matches!(action, Action::Document(_) | Action::Rig(_) | Action::Seal));
    }
    actions
}

fn valve_ui(
    ui: &mut egui::Ui,
    view: &View,
    state: &mut State,
    index: usize,
    valve: &ValveView,
    scale: f32,
    actions: &mut Vec<Action>,
) {
    let response =
        ui.interact(paint::valve_rect(valve, scale), Id::unique(("valve", index)), Sense::click_and_drag());
    let shown = view.document.rig.angles_deg.get(index).copied().unwrap_or(valve.angle_deg);
    response.widget_info(|| WidgetInfo::slider(true, shown, tr!("pid.valve", tag = valve.tag)));
    let turn = |angle_deg: f64| {
        let angle_deg = angle_deg.clamp(0.0, 90.0);
        Action::Document(DocumentCommand::Angle(valve.tag.clone(), (angle_deg * 2.0).round() / 2.0))
    };
    if response.drag_started() {
        state.turning = Some((index, shown));
    }
    if let Some((turned, angle)) = &mut state.turning
        && *turned == index
        && response.dragged()
    {
        let moved = response.drag_delta();
        *angle = (*angle + f64::from(moved.x - moved.y) * TURN_DEG).clamp(0.0, 90.0);
        actions.push(turn(*angle));
    }
    if response.drag_stopped() {
        state.turning = None;
        actions.push(Action::Seal);
    }
    if response.has_focus() {
        // The arrows turn the valve instead of leaving it.
        let filter =
            egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
        ui.memory_mut(|m| m.set_focus_lock_filter(response.id, filter));
        let steps = ui.input(|i| {
            let pressed = |k| i.num_presses(k) as f64;
            pressed(egui::Key::ArrowUp) + pressed(egui::Key::ArrowRight)
                - pressed(egui::Key::ArrowDown)
                - pressed(egui::Key::ArrowLeft)
        });
        if steps != 0.0 {
            actions.push(turn(shown + steps));
        }
    }
    let p = theme::palette(ui);
    paint::valve(ui.painter(), valve, scale, response.hovered() || response.has_focus(), &p);
    paint::valve_label(ui.painter(), valve, scale, &p);
    egui::Popup::menu(&response).close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
        ui.set_min_width(150.0);
        ui.strong(tr!("pid.valve", tag = valve.tag));
        let mut angle = shown;
        let field =
            egui::DragValue::new(&mut angle).range(0.0..=90.0).speed(0.5).max_decimals(1).suffix(" °");
        let field = ui.add(field).on_hover_text(tr!("pid.angle"));
        if field.changed() {
            actions.push(Action::Document(DocumentCommand::Angle(valve.tag.clone(), angle)));
        }
        ui.horizontal(|ui| {
            for (label, angle) in [(tr!("pid.shut"), 0.0), (tr!("pid.half"), 45.0), (tr!("pid.open"), 90.0)] {
                if ui.button(label).clicked() {
                    actions.push(Action::Document(DocumentCommand::Angle(valve.tag.clone(), angle)));
                    actions.push(Action::Seal);
                }
            }
        });
    });
    faults::menu(&response, view.snapshot, &valve.tag, actions);
    response.on_hover_text(tr!("pid.valve_hint"));
}

fn tank_popup(ui: &mut egui::Ui, view: &View, index: usize, tank: &TankView, actions: &mut Vec<Action>) {
    let response = ui.interact(tank.rect, Id::unique(("tank", index)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, tr!("pid.tank", tag = tank.tag)));
    let is_reservoir = view.snapshot.network.reservoir == Some(index);
    egui::Popup::menu(&response).close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
        ui.strong(tr!("pid.tank", tag = tank.tag));
        ui.label(format!(
            "{} cm · {} cm³",
            text::fixed(tank.level_cm, 2),
            text::fixed(tank.level_cm * view.snapshot.network.tanks[index].area_cm2, 0)
        ));
        if is_reservoir {
            ui.weak(tr!("pid.reservoir"));
            return;
        }
        ui.label(tr!("pid.bump"));
        ui.horizontal(|ui| {
            for delta_cm in [-5.0, -1.0, 1.0, 5.0] {
                let sign = if delta_cm > 0.0 { "+" } else { "−" };
                if ui.button(format!("{sign}{} cm", f64::abs(delta_cm))).clicked() {
                    actions.push(Action::Rig(RigCommand::Bump { tag: tank.tag.clone(), delta_cm }));
                }
            }
        });
    });
    faults::menu(&response, view.snapshot, &tank.tag, actions);
    if response.hovered() {
        let p = theme::palette(ui);
        let line = egui::Stroke::new(1.5, p.accent_text);
        ui.painter().rect_stroke(tank.rect.expand(2.0), 3.0, line, egui::StrokeKind::Outside);
    }
}

fn sensor_ui(ui: &mut egui::Ui, view: &View, bubble: &BubbleView, scale: f32, actions: &mut Vec<Action>) {
    let rect = Rect::from_center_size(bubble.at, egui::Vec2::splat(2.0 * paint::bubble_radius(scale)));
    let response = ui.interact(rect, Id::unique(("sensor", &bubble.tag)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, tr!("pid.sensor", tag = bubble.tag)));
    faults::menu(&response, view.snapshot, &bubble.tag, actions);
    // A sensor has nothing else to set: the left button opens the same menu.
    if let Some(part) = FaultyPart::find(&view.snapshot.network, &bubble.tag) {
        egui::Popup::menu(&response)
            .id(response.id.with("left"))
            .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
            .show(|ui| faults::switches(ui, view.snapshot, &bubble.tag, part, actions));
    }
    response.on_hover_text(tr!("pid.sensor_hint"));
}

/// Power, faults and water of the whole rig, in the corner of the drawing.
fn rig_ui(ui: &mut egui::Ui, view: &View, rect: Rect, actions: &mut Vec<Action>) {
    let count = view.snapshot.faults.len();
    let words = if count == 0 { tr!("pid.rig") } else { tr!("pid.rig_faults", count = count) };
    let at = Rect::from_min_size(rect.left_top(), vec2(rect.width().min(150.0), 20.0));
    let button = egui::Button::new(egui::RichText::new(words).size(theme::SMALL));
    let place = egui::UiBuilder::new().max_rect(at).layout(egui::Layout::left_to_right(egui::Align::Min));
    let response = ui.scope_builder(place, |ui| ui.add(button)).inner.on_hover_text(tr!("pid.rig_hint"));
    egui::Popup::menu(&response)
        .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| faults::overview(ui, view.snapshot, actions));
}

fn pump_ui(
    ui: &mut egui::Ui,
    view: &View,
    index: usize,
    pump: &PumpView,
    scale: f32,
    actions: &mut Vec<Action>,
) {
    let rect = Rect::from_center_size(pump.at, egui::Vec2::splat(2.0 * paint::bubble_radius(scale)));
    let response = ui.interact(rect, Id::unique(("pump", index)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, tr!("pid.pump", tag = pump.tag)));
    let p = theme::palette(ui);
    paint::pump(ui.painter(), pump, scale, response.hovered() || response.has_focus(), &p);
    egui::Popup::menu(&response).close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
        ui.strong(tr!("pid.pump", tag = pump.tag));
        let range = &view.snapshot.network.pumps[index];
        if pump.by_hand {
            let mut input = pump.input;
            let field = egui::DragValue::new(&mut input)
                .range(range.min..=range.max)
                .speed((range.max - range.min) / 200.0)
                .max_decimals(3)
                .suffix(format!(" {}", pump.unit));
            if ui.add(field).on_hover_text(tr!("pid.input")).changed() {
                actions.push(Action::Rig(RigCommand::Mv { tag: pump.tag.clone(), value: input }));
            }
        } else {
            ui.weak(tr!("pid.in_automatic"));
        }
        ui.weak(format!("{}…{} {}", text::brief(range.min), text::brief(range.max), pump.unit));
    });
    faults::menu(&response, view.snapshot, &pump.tag, actions);
}
