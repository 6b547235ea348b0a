//! Painting the P&ID: symbols after ISA-5.1, water and streams from the model.

use eframe::egui::{self, Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};

use super::model::{BubbleView, PidModel, PumpView, StreamView, TankView, ValveView};
use crate::theme::{self, Palette};
use crate::{journal, text, tr};

/// Length of a moving dash and of the gap behind it, in points.
const DASH: f32 = 7.0;
/// Points a dash moves per cm³ that flows.
pub const TRAVEL: f64 = 0.6;

/// Half the length of a valve's symbol.
pub fn valve_radius(scale: f32) -> f32 {
    (scale * 0.115).clamp(9.0, 17.0)
}

/// Radius of pumps and instruments.
pub fn bubble_radius(scale: f32) -> f32 {
    (scale * 0.16).clamp(13.0, 22.0)
}

/// Draws everything that does not react to the pointer.
pub fn paint(painter: &Painter, model: &PidModel, p: &Palette, phase: &dyn Fn(usize) -> f32) {
    let pipe_width = (model.scale * 0.065).clamp(5.0, 10.0);
    for (i, pump) in model.pumps.iter().enumerate() {
        stream(painter, &pump.suction, pipe_width, p, phase(2 * i));
        for branch in &pump.branches {
            stream(painter, branch, pipe_width, p, phase(2 * i + 1));
        }
        stream(painter, &pump.discharge, pipe_width, p, phase(2 * i + 1));
    }
    let offset = 2 * model.pumps.len();
    for (i, valve) in model.valves.iter().enumerate() {
        stream(painter, &valve.stream, pipe_width, p, phase(offset + i));
    }
    for tap in &model.taps {
        painter.line_segment(*tap, Stroke::new(1.2, p.weak));
    }
    for line in &model.signals {
        painter.extend(Shape::dashed_line(line, Stroke::new(1.2, p.weak), 5.0, 4.0));
    }
    for (i, view) in model.tanks.iter().enumerate() {
        tank(painter, view, p, phase(offset + model.valves.len() + i));
    }
    for (i, valve) in model.valves.iter().enumerate() {
        falling(painter, &valve.stream, pipe_width, p, phase(offset + i));
    }
    for (i, pump) in model.pumps.iter().enumerate() {
        for view in std::iter::once(&pump.discharge).chain(&pump.branches) {
            falling(painter, view, pipe_width, p, phase(2 * i + 1));
        }
    }
    for view in &model.bubbles {
        bubble(painter, view, bubble_radius(model.scale), p);
    }
}

fn dashes(painter: &Painter, line: &[Pos2], width: f32, colour: Color32, phase: f32) {
    let offset = phase.rem_euclid(2.0 * DASH);
    let stroke = Stroke::new(width, colour);
    painter.extend(Shape::dashed_line_with_offset(line, stroke, &[DASH], &[DASH], offset));
}

fn stream(painter: &Painter, view: &StreamView, width: f32, p: &Palette, phase: f32) {
    if view.pipe.len() < 2 {
        return;
    }
    painter.line(view.pipe.clone(), Stroke::new(width + 2.0, p.body));
    let flows = view.direction() != 0;
    let inside = if flows { p.water } else { p.dry_pipe };
    painter.line(view.pipe.clone(), Stroke::new(width - 1.0, inside));
    if flows {
        dashes(painter, &view.pipe, width * 0.45, p.stream, phase);
        arrows(painter, view, width, p);
    }
    if view.to_outside {
        let (Some(&end), true) = (view.pipe.last(), flows) else { return };
        painter.arrow(end, vec2(0.0, 10.0), Stroke::new(2.0, p.stream));
    }
}

/// An arrow on the longest piece of the pipe, in the direction of the flow: dashes alone say nothing on a
/// printed page.
fn arrows(painter: &Painter, view: &StreamView, width: f32, p: &Palette) {
    let longest =
        view.pipe.windows(2).max_by(|a, b| (a[1] - a[0]).length().total_cmp(&(b[1] - b[0]).length()));
    let Some([a, b]) = longest.map(|w| [w[0], w[1]]) else { return };
    if (b - a).length() < 30.0 {
        return;
    }
    let along = (b - a).normalized() * f32::from(view.direction());
    let across = along.rot90();
    // A valve sits in the middle of its pipe; the arrow stands beside it.
    let at = a + (b - a) * 0.82;
    let size = width * 0.95;
    let points = vec![
        at + along * size,
        at - along * size * 0.7 + across * size * 0.8,
        at - along * size * 0.7 - across * size * 0.8,
    ];
    painter.add(Shape::convex_polygon(points, p.stream, Stroke::new(1.0, p.pane)));
}

fn falling(painter: &Painter, view: &StreamView, width: f32, p: &Palette, phase: f32) {
    let (Some(&from), Some(to)) = (view.pipe.last(), view.falls_to) else { return };
    if view.direction() > 0 && to.y > from.y {
        painter.line_segment([from, to], Stroke::new(width * 0.5, p.water));
        dashes(painter, &[from, to], width * 0.35, p.stream, phase);
    }
}

fn tank(painter: &Painter, view: &TankView, p: &Palette, phase: f32) {
    painter.rect_filled(view.rect, 2.0, p.empty);
    let water = Rect::from_min_max(pos2(view.rect.left(), view.surface_y), view.rect.max);
    if water.height() > 0.3 {
        painter.rect_filled(water, 0.0, p.water);
        painter.hline(water.x_range(), water.top(), Stroke::new(1.6, p.stream));
    }
    // A scale every 5 cm on the left wall.
    let per_cm = view.rect.height() / view.height_cm as f32;
    let mut mark_cm = 5.0;
    while mark_cm < view.height_cm as f32 {
        let y = view.rect.bottom() - mark_cm * per_cm;
        painter.hline(view.rect.left()..=view.rect.left() + 5.0, y, Stroke::new(1.0, p.weak));
        mark_cm += 5.0;
    }
    // Open at the top.
    let walls =
        [view.rect.left_top(), view.rect.left_bottom(), view.rect.right_bottom(), view.rect.right_top()];
    painter.line(walls.to_vec(), Stroke::new(2.0, p.outline));
    painter.text(
        view.rect.left_top() + vec2(9.0, 3.0),
        Align2::LEFT_TOP,
        &view.tag,
        theme::bold_font(13.0),
        p.text,
    );
    let reading = format!("{} cm", text::fixed(view.level_cm, 1));
    // In a narrow tank the reading goes under the tag, clear of the stream that falls in.
    let below = view.fed_on_the_right || view.rect.width() < 110.0;
    let (at, anchor) = if below {
        (view.rect.left_top() + vec2(9.0, 19.0), Align2::LEFT_TOP)
    } else {
        (view.rect.right_top() + vec2(-6.0, 3.0), Align2::RIGHT_TOP)
    };
    painter.text(at, anchor, reading, FontId::proportional(13.0), p.text);
    if let Some(setpoint_cm) = view.setpoint_cm {
        let y = view.rect.bottom() - setpoint_cm as f32 * per_cm;
        let x = view.rect.right();
        let points = vec![pos2(x - 1.0, y), pos2(x - 9.0, y - 5.0), pos2(x - 9.0, y + 5.0)];
        painter.add(Shape::convex_polygon(points, p.sp, Stroke::new(1.0, p.pane)));
    }
    if view.leak_cm3_s > 0.0 {
        painter.line_segment(view.leak, Stroke::new(3.0, p.water));
        dashes(painter, &view.leak, 2.0, p.stream, phase);
    }
    if view.spill_cm3_s > 0.0 {
        painter.line_segment(view.spill, Stroke::new(4.0, p.water));
        dashes(painter, &view.spill, 2.5, p.stream, phase);
        let spilled = format!("{} {} cm³/s", tr!("pid.overflow"), text::fixed(view.spill_cm3_s, 1));
        badge(painter, view.rect.center_top() + vec2(0.0, 30.0), &spilled, p);
    }
}

/// A badge at everything that is broken.
pub fn faults(painter: &Painter, model: &PidModel, p: &Palette) {
    for (at, kind) in &model.faults {
        badge(painter, *at, &journal::fault_name(*kind), p);
    }
}

/// Words on the alarm colour: never colour alone.
pub fn badge(painter: &Painter, at: Pos2, words: &str, p: &Palette) {
    let galley = painter.layout_no_wrap(words.to_owned(), theme::bold_font(11.5), p.on_alarm);
    let rect = Rect::from_center_size(at, galley.size() + vec2(10.0, 4.0));
    painter.rect_filled(rect, 3.0, p.alarm);
    painter.galley(rect.center() - galley.size() * 0.5, galley, p.on_alarm);
}

fn bubble(painter: &Painter, view: &BubbleView, radius: f32, p: &Palette) {
    let edge = if view.abnormal { Stroke::new(2.5, p.alarm) } else { Stroke::new(1.5, p.outline) };
    painter.circle(view.at, radius, p.pane, edge);
    let (letters, number) =
        view.tag.split_at(view.tag.find(|c: char| c.is_ascii_digit() || c == '-').unwrap_or(view.tag.len()));
    let number = number.trim_start_matches('-');
    let size = (radius * 0.68).clamp(9.5, 13.0);
    painter.text(
        view.at - vec2(0.0, radius * 0.36),
        Align2::CENTER_CENTER,
        letters,
        theme::bold_font(size),
        p.text,
    );
    painter.text(
        view.at + vec2(0.0, radius * 0.40),
        Align2::CENTER_CENTER,
        number,
        FontId::proportional(size),
        p.text,
    );
    if view.automatic.is_some() {
        painter.hline(view.at.x - radius..=view.at.x + radius, view.at.y + 0.5, Stroke::new(1.0, p.weak));
    }
    if let Some(automatic) = view.automatic {
        let words = match (automatic, view.cascade) {
            (_, true) => tr!("mode.cascade"),
            (true, false) => tr!("mode.auto"),
            (false, false) => tr!("mode.manual"),
        };
        let (aside, anchor) =
            if view.mode_on_the_left { (-5.0, Align2::RIGHT_TOP) } else { (5.0, Align2::LEFT_TOP) };
        let at = view.at + vec2(aside, radius + 2.0);
        let colour = if automatic { p.weak } else { p.caution };
        painter.text(at, anchor, words, theme::bold_font(10.5), colour);
    }
    if view.abnormal {
        badge(painter, view.at - vec2(0.0, radius + 9.0), &tr!("pid.out_of_range"), p);
    }
}

/// The bow tie of a valve, filled as far as it is open.
pub fn valve(painter: &Painter, view: &ValveView, scale: f32, hovered: bool, p: &Palette) {
    let r = valve_radius(scale);
    let open = (view.angle_deg / 90.0) as f32;
    let turn = |v: Vec2| if view.vertical { vec2(v.y, v.x) } else { v };
    let stroke =
        Stroke::new(if hovered { 2.5 } else { 1.6 }, if hovered { p.accent_text } else { p.outline });
    let fill = if open <= 0.0 { p.outline } else { p.body };
    for side in [-1.0, 1.0] {
        let points = vec![
            view.at,
            view.at + turn(vec2(side * r, -0.72 * r)),
            view.at + turn(vec2(side * r, 0.72 * r)),
        ];
        painter.add(Shape::convex_polygon(points, fill, stroke));
    }
    // The handle stands along the pipe when open, across it when shut.
    let angle = std::f32::consts::FRAC_PI_2 * (1.0 - open);
    let handle = turn(vec2(angle.cos(), angle.sin())) * r * 1.25;
    painter.line_segment([view.at - handle * 0.15, view.at + handle], Stroke::new(3.0, p.pane));
    painter.line_segment([view.at - handle * 0.15, view.at + handle], Stroke::new(1.8, p.accent_text));
    painter.circle_filled(view.at, 2.6, p.accent_text);
}

/// Tag, angle and flow beside a valve.
pub fn valve_label(painter: &Painter, view: &ValveView, scale: f32, p: &Palette) {
    let r = valve_radius(scale);
    let name = format!("{}  {}°", view.tag, text::fixed(view.angle_deg, 0));
    let flow = format!("{} cm³/s", text::fixed(view.stream.flow_cm3_s, 1));
    let name = painter.layout_no_wrap(name, theme::bold_font(12.0), p.text);
    let flow = painter.layout_no_wrap(flow, FontId::proportional(12.0), p.weak);
    let (a, b) = if view.vertical {
        let left = view.at + vec2(r + 8.0, 0.0);
        (left - vec2(0.0, name.size().y), left)
    } else if view.label_below {
        let top = view.at + vec2(-0.5 * name.size().x.max(flow.size().x), r + 4.0);
        (top, top + vec2(0.0, name.size().y))
    } else {
        let bottom = view.at - vec2(0.0, r + 6.0);
        let width = name.size().x.max(flow.size().x);
        (bottom - vec2(width * 0.5, name.size().y + flow.size().y), bottom - vec2(width * 0.5, flow.size().y))
    };
    painter.galley(a, name, p.text);
    painter.galley(b, flow, p.weak);
}

/// The pump's circle with its triangle, tag and input.
pub fn pump(painter: &Painter, view: &PumpView, scale: f32, hovered: bool, p: &Palette) {
    let r = bubble_radius(scale);
    let edge = if view.dry {
        p.alarm
    } else if hovered {
        p.accent_text
    } else {
        p.outline
    };
    painter.circle(view.at, r, p.body, Stroke::new(if hovered { 2.5 } else { 1.8 }, edge));
    let up = view.discharge.pipe.get(1).map_or(vec2(0.0, -1.0), |next| (*next - view.at).normalized());
    let across = up.rot90();
    let points = vec![
        view.at + up * r * 0.85,
        view.at - up * r * 0.5 + across * r * 0.72,
        view.at - up * r * 0.5 - across * r * 0.72,
    ];
    painter.add(Shape::convex_polygon(points, p.pane, Stroke::new(1.2, p.outline)));
    let input = format!("{} {}", text::fixed(view.input, 2), view.unit);
    let flow = format!("{} cm³/s", text::fixed(view.arriving_cm3_s, 1));
    if view.suction.pipe.is_empty() {
        let at = view.at - vec2(0.0, r + 3.0);
        label(
            painter,
            at,
            Align2::CENTER_BOTTOM,
            format!("{}  {input}", view.tag),
            theme::bold_font(12.0),
            p,
        );
    } else {
        let at = view.at + vec2(r * 0.2 + 2.0, r + 3.0);
        painter.text(at, Align2::CENTER_TOP, &view.tag, theme::bold_font(12.0), p.text);
        painter.text(at + vec2(0.0, 15.0), Align2::CENTER_TOP, input, FontId::proportional(12.0), p.mv);
        // Where streams split, beside the pump's own pipe: the middle belongs to others as well.
        let run = |stream: &&StreamView| stream.pipe.get(1..3).map_or(0.0, |p| (p[1] - p[0]).length());
        let longest =
            std::iter::once(&view.discharge).chain(&view.branches).max_by(|a, b| run(a).total_cmp(&run(b)));
        if let Some([_, corner, end, ..]) = longest.map(|stream| &stream.pipe[..]) {
            let share = if view.branches.is_empty() { 0.5 } else { 0.4 * scale / (*end - *corner).length() };
            let middle = *corner + (*end - *corner) * share.min(0.5);
            painter.text(
                middle - vec2(0.0, 9.0),
                Align2::CENTER_BOTTOM,
                flow,
                FontId::proportional(12.0),
                p.weak,
            );
        }
    }
    if view.dry {
        badge(painter, view.at - vec2(0.0, r + 10.0), &tr!("pid.dry"), p);
    }
}

/// Words on the pane's own colour, so that no line strikes them through.
fn label(painter: &Painter, at: Pos2, anchor: Align2, words: String, font: FontId, p: &Palette) {
    let galley = painter.layout_no_wrap(words, font, p.text);
    let rect = anchor.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(vec2(2.0, 0.0)), 0.0, p.pane);
    painter.galley(rect.min, galley, p.text);
}

/// The hint under the drawing.
pub fn hint(painter: &Painter, rect: Rect, words: &str, p: &Palette) {
    painter.text(rect.left_bottom(), Align2::LEFT_BOTTOM, words, FontId::proportional(theme::SMALL), p.weak);
}

/// Where to press a valve.
pub fn valve_rect(view: &ValveView, scale: f32) -> Rect {
    Rect::from_center_size(
        view.at,
        Vec2::splat(2.4 * valve_radius(scale)).max(egui::Vec2::splat(theme::PRESS)),
    )
}
