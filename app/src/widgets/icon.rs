//! Buttons with a drawn sign: crisp at every size, and no font has to have it.

use eframe::egui::{self, Color32, Painter, Rect, Role, Sense, Shape, Stroke, Vec2, WidgetInfo, pos2, vec2};

use crate::theme;

/// A sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Icon {
    /// Let time go on.
    Run,
    /// Let time stand still.
    Pause,
    /// One sample.
    Step,
    /// Start again.
    Restart,
    /// Take back.
    Undo,
    /// Do again.
    Redo,
    /// Record.
    Record,
    /// Stop recording.
    Stop,
    /// Light or dark.
    Theme,
    /// Show a pane alone.
    Maximise,
}

/// A square button with a sign; its name is read out and shown under the pointer.
pub fn icon_button(ui: &mut egui::Ui, icon: Icon, name: &str, enabled: bool) -> egui::Response {
    let size = Vec2::splat(theme::PRESS);
    let sense = if enabled { Sense::click() } else { Sense::hover() };
    let (rect, response) = ui.allocate_exact_size(size, sense);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    let visuals = if enabled { *ui.style().interact(&response) } else { ui.visuals().widgets.inactive };
    ui.painter().rect(
        rect,
        visuals.corner_radius,
        visuals.weak_bg_fill,
        visuals.bg_stroke,
        egui::StrokeKind::Inside,
    );
    let p = theme::palette(ui);
    let ink = if !enabled {
        p.body
    } else if icon == Icon::Record {
        p.alarm
    } else {
        visuals.fg_stroke.color
    };
    paint(ui.painter(), icon, rect.shrink(theme::PRESS * 0.27), ink);
    response.on_hover_text(name)
}

fn paint(painter: &Painter, icon: Icon, r: Rect, ink: Color32) {
    let stroke = Stroke::new(1.8, ink);
    let fill = |points: Vec<egui::Pos2>| Shape::convex_polygon(points, ink, Stroke::NONE);
    let c = r.center();
    match icon {
        Icon::Run => {
            painter.add(fill(vec![r.left_top(), pos2(r.right(), c.y), r.left_bottom()]));
        }
        Icon::Pause => {
            for x in [r.left(), r.right() - r.width() * 0.36] {
                painter.rect_filled(
                    Rect::from_min_size(pos2(x, r.top()), vec2(r.width() * 0.36, r.height())),
                    0.0,
                    ink,
                );
            }
        }
        Icon::Step => {
            let tip = r.right() - r.width() * 0.28;
            painter.add(fill(vec![r.left_top(), pos2(tip, c.y), r.left_bottom()]));
            painter.rect_filled(Rect::from_min_max(pos2(tip + 1.0, r.top()), r.max), 0.0, ink);
        }
        Icon::Restart | Icon::Undo | Icon::Redo => {
            let flip = if icon == Icon::Redo { -1.0 } else { 1.0 };
            let sweep = if icon == Icon::Restart { 5.2 } else { 3.6 };
            let start = -2.5_f32;
            let radius = r.width() * 0.5;
            let at = |a: f32| c + vec2(flip * radius * a.cos(), radius * a.sin());
            let arc: Vec<_> = (0..=20).map(|i| at(start + sweep * i as f32 / 20.0)).collect();
            painter.line(arc, stroke);
            let tip = at(start);
            let s = r.width() * 0.34;
            painter.add(fill(vec![
                tip + vec2(-s * 0.9 * flip, s * 0.7),
                tip + vec2(-s * 0.5 * flip, -s * 0.9),
                tip + vec2(s * 0.9 * flip, s * 0.3),
            ]));
        }
        Icon::Record => {
            painter.circle_filled(c, r.width() * 0.5, ink);
        }
        Icon::Stop => {
            painter.rect_filled(r, 1.0, ink);
        }
        Icon::Theme => {
            painter.circle_stroke(c, r.width() * 0.5, stroke);
            let half: Vec<_> = (0..=16)
                .map(|i| {
                    let a = std::f32::consts::FRAC_PI_2 + std::f32::consts::PI * i as f32 / 16.0;
                    c + vec2(a.cos(), a.sin()) * r.width() * 0.5
                })
                .collect();
            painter.add(fill(half));
        }
        Icon::Maximise => {
            painter.rect_stroke(r, 1.0, stroke, egui::StrokeKind::Inside);
        }
    }
}
