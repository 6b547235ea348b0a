//! The whole window at 1440 × 900 without a display, frame by frame.

use std::time::Duration;

use eframe::egui::{Context, Event, Pos2, RawInput, Rect, ViewportId, vec2};
use vasos_app::action::Action;
use vasos_app::workbench::{Options, Workbench};
use vasos_engine::document::{DocumentCommand, ModelOrigin, NewModel};
use vasos_engine::model::{Fopdt, ProcessModel};

/// A window on the reference rig, paused at time 0, that neither reads nor writes settings.
pub struct Screen {
    /// Its state.
    pub workbench: Workbench,
    ctx: Context,
    frames: u32,
}

/// What a frame came to.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Corners of the triangles for the graphics card.
    pub corners: usize,
    /// When the window asks for the next frame.
    pub next: Duration,
}

impl Screen {
    /// A window before its first frame.
    ///
    /// # Panics
    /// When the preset does not start.
    #[must_use]
    pub fn new() -> Self {
        let ctx = Context::default();
        let options = Options { paused: true, forget: true, ..Options::default() };
        let workbench = Workbench::new(&ctx, options).expect("the preset starts");
        Self { workbench, ctx, frames: 0 }
    }

    /// Carries out an action.
    pub fn act(&mut self, action: Action) {
        self.workbench.act(&self.ctx, action);
    }

    /// One frame: what happens between frames, layout, drawing, triangles.
    pub fn frame(&mut self, events: Vec<Event>) -> Frame {
        self.frames += 1;
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, vec2(1440.0, 900.0))),
            time: Some(f64::from(self.frames) / 60.0),
            focused: true,
            events,
            ..RawInput::default()
        };
        self.workbench.logic(&self.ctx);
        let mut output = self.ctx.run_ui(input, |ui| self.workbench.ui(ui));
        // There is no graphics card to take the pictures of letters.
        output.textures_delta.clear();
        let shapes = std::mem::take(&mut output.shapes);
        let primitives = self.ctx.tessellate(shapes, output.pixels_per_point);
        let corners = |p: &eframe::egui::ClippedPrimitive| match &p.primitive {
            eframe::egui::epaint::Primitive::Mesh(mesh) => mesh.vertices.len(),
            eframe::egui::epaint::Primitive::Callback(_) => 0,
        };
        Frame {
            corners: primitives.iter().map(corners).sum(),
            next: output.viewport_output[&ViewportId::ROOT].repaint_delay,
        }
    }
}

impl Default for Screen {
    fn default() -> Self {
        Self::new()
    }
}

/// Puts the model that was published for TQ2 of the reference rig into the document.
///
/// # Panics
/// Never: the model is usable.
#[must_use]
pub fn typed_model() -> Action {
    Action::Document(DocumentCommand::AddModel(Box::new(NewModel {
        model: ProcessModel::Fopdt(Fopdt::new(4.9, 152.0, 2.0).expect("usable")),
        origin: ModelOrigin::Typed,
        fit: None,
        study: None,
        rows: None,
        pv_unit: "cm".to_owned(),
        mv_unit: "V".to_owned(),
    })))
}
