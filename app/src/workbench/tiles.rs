//! The arrangement of panes.

use eframe::egui::{self, WidgetText};
use egui_tiles::{
    Behavior, Container, Linear, LinearDir, SimplificationOptions, TabState, Tile, TileId, Tiles, Tree,
    UiResponse,
};

use crate::action::Action;
use crate::panes::{self, PaneKind, States, View};
use crate::{theme, tr};

/// The arrangement at the first start: plant, faceplate and trend above, the tuning chain below.
pub fn first_layout() -> Tree<PaneKind> {
    let mut tiles = Tiles::default();
    let tab = |tiles: &mut Tiles<PaneKind>, panes: &[PaneKind]| {
        let children = panes.iter().map(|p| tiles.insert_pane(*p)).collect();
        tiles.insert_tab_tile(children)
    };
    let above: Vec<TileId> = vec![
        tab(&mut tiles, &[PaneKind::Pid]),
        tab(&mut tiles, &[PaneKind::Faceplate]),
        tab(&mut tiles, &[PaneKind::Trend, PaneKind::Experiments]),
    ];
    let below: Vec<TileId> = vec![
        tab(&mut tiles, &[PaneKind::Identify, PaneKind::Linear]),
        tab(&mut tiles, &[PaneKind::Tune]),
        tab(&mut tiles, &[PaneKind::Nyquist]),
        tab(&mut tiles, &[PaneKind::Step, PaneKind::Log]),
    ];
    let row = |tiles: &mut Tiles<PaneKind>, children: Vec<TileId>, shares: &[f32]| {
        let mut linear = Linear::new(LinearDir::Horizontal, children.clone());
        for (child, share) in children.into_iter().zip(shares) {
            linear.shares.set_share(child, *share);
        }
        tiles.insert_container(Container::Linear(linear))
    };
    let above = row(&mut tiles, above, &[1.0, 0.44, 1.1]);
    let below = row(&mut tiles, below, &[0.8, 1.35, 0.72, 0.75]);
    let mut both = Linear::new(LinearDir::Vertical, vec![above, below]);
    both.shares.set_share(above, 1.2);
    both.shares.set_share(below, 1.0);
    let root = tiles.insert_container(Container::Linear(both));
    Tree::new(egui::Id::unique("panes"), root, tiles)
}

/// Whether an arrangement still has every pane once.
pub fn is_whole(tree: &Tree<PaneKind>) -> bool {
    let panes: Vec<PaneKind> =
        tree.tiles.tiles().filter_map(|t| if let Tile::Pane(p) = t { Some(*p) } else { None }).collect();
    panes.len() == PaneKind::ALL.len() && PaneKind::ALL.iter().all(|p| panes.contains(p))
}

/// Draws all panes, or one alone.
pub fn ui(
    ui: &mut egui::Ui,
    tree: &mut Tree<PaneKind>,
    maximised: Option<PaneKind>,
    view: &View,
    states: &mut States,
) -> Vec<Action> {
    let mut behavior = Panes { view, states, actions: vec![] };
    if let Some(kind) = maximised {
        let p = theme::palette(ui);
        egui::Frame::NONE.fill(p.pane).corner_radius(4).inner_margin(theme::PANE_MARGIN).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.heading(tr!(kind.key()));
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.button(tr!("pane.all")).clicked() {
                        behavior.actions.push(Action::Maximise(kind));
                    }
                });
            });
            let actions = panes::ui(kind, ui, view, behavior.states);
            behavior.actions.extend(actions);
        });
    } else {
        tree.ui(&mut behavior, ui);
    }
    behavior.actions
}

struct Panes<'a, 'b> {
    view: &'a View<'b>,
    states: &'a mut States,
    actions: Vec<Action>,
}

impl Behavior<PaneKind> for Panes<'_, '_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut PaneKind) -> UiResponse {
        let p = theme::palette(ui);
        egui::Frame::NONE.fill(p.pane).inner_margin(theme::PANE_MARGIN).show(ui, |ui| {
            ui.set_clip_rect(ui.max_rect().expand(4.0).intersect(ui.clip_rect()));
            let actions = panes::ui(*pane, ui, self.view, self.states);
            self.actions.extend(actions);
            ui.allocate_space(ui.available_size());
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &PaneKind) -> WidgetText {
        egui::RichText::new(tr!(pane.key())).family(theme::bold()).into()
    }

    fn on_tab_button(
        &mut self,
        tiles: &mut Tiles<PaneKind>,
        tile_id: TileId,
        button: egui::Response,
    ) -> egui::Response {
        if button.double_clicked()
            && let Some(kind) = tiles.get_pane(&tile_id)
        {
            self.actions.push(Action::Maximise(*kind));
        }
        button.on_hover_text(tr!("pane.tab_hint"))
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        26.0
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        6.0
    }

    fn resize_stroke(&self, style: &egui::Style, state: egui_tiles::ResizeState) -> egui::Stroke {
        match state {
            egui_tiles::ResizeState::Idle => {
                egui::Stroke::new(self.gap_width(style), style.visuals.panel_fill)
            }
            egui_tiles::ResizeState::Hovering | egui_tiles::ResizeState::Dragging => {
                egui::Stroke::new(2.0, style.visuals.hyperlink_color)
            }
        }
    }

    fn min_size(&self) -> f32 {
        120.0
    }

    fn tab_bar_color(&self, visuals: &egui::Visuals) -> egui::Color32 {
        visuals.window_fill
    }

    fn tab_bg_color(
        &self,
        visuals: &egui::Visuals,
        _: &Tiles<PaneKind>,
        _: TileId,
        _: &TabState,
    ) -> egui::Color32 {
        visuals.window_fill
    }

    fn tab_text_color(
        &self,
        visuals: &egui::Visuals,
        _: &Tiles<PaneKind>,
        _: TileId,
        state: &TabState,
    ) -> egui::Color32 {
        if state.active { visuals.text_color() } else { visuals.weak_text_color() }
    }

    fn tab_outline_stroke(
        &self,
        _: &egui::Visuals,
        _: &Tiles<PaneKind>,
        _: TileId,
        _: &TabState,
    ) -> egui::Stroke {
        egui::Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, visuals: &egui::Visuals) -> egui::Stroke {
        egui::Stroke::new(1.0, visuals.widgets.noninteractive.bg_stroke.color)
    }
}
