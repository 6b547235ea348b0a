//! The panes: each a function of (view, own state) to actions.

pub mod experiments;
pub mod faceplate;
pub mod identify;
pub mod linear;
pub mod log;
pub mod nyquist;
pub mod pid;
pub mod step;
pub mod trend;
pub mod tune;

use std::collections::VecDeque;

use eframe::egui;
use vasos_engine::document::Document;
use vasos_engine::session::Snapshot;

use crate::action::Action;
use crate::answers::Answers;
use crate::experiments::Desk;
use crate::journal::Entry;
use crate::traces::{LogTrace, RunTrace};
use crate::tuning::TuningTable;

/// A pane of the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PaneKind {
    /// The plant.
    Pid,
    /// The loop's faceplate.
    Faceplate,
    /// Signals over time.
    Trend,
    /// Data to model.
    Identify,
    /// The rig as a linear model.
    Linear,
    /// Model to gains.
    Tune,
    /// The loop's curve.
    Nyquist,
    /// Its time responses.
    Step,
    /// Prepared experiments.
    Experiments,
    /// What happened.
    Log,
}

impl PaneKind {
    /// Every pane.
    pub const ALL: [Self; 10] = [
        Self::Pid,
        Self::Faceplate,
        Self::Trend,
        Self::Identify,
        Self::Linear,
        Self::Tune,
        Self::Nyquist,
        Self::Step,
        Self::Experiments,
        Self::Log,
    ];

    /// Key of its title.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Pid => "pane.pid",
            Self::Faceplate => "pane.faceplate",
            Self::Trend => "pane.trend",
            Self::Identify => "pane.identify",
            Self::Linear => "pane.linear",
            Self::Tune => "pane.tune",
            Self::Nyquist => "pane.nyquist",
            Self::Step => "pane.step",
            Self::Experiments => "pane.experiments",
            Self::Log => "pane.log",
        }
    }
}

/// What panes look at; nobody changes it while they draw.
pub struct View<'a> {
    /// The rig now.
    pub snapshot: &'a Snapshot,
    /// What the user works on.
    pub document: &'a Document,
    /// The present run.
    pub run: &'a RunTrace,
    /// The run kept for comparison.
    pub kept: Option<&'a RunTrace>,
    /// The imported log.
    pub log: Option<&'a LogTrace>,
    /// Rules on the model in use.
    pub tuning: &'a TuningTable,
    /// What was worked out beside the window.
    pub answers: &'a Answers,
    /// Which of the loops identification and tuning are about.
    pub focus: usize,
    /// A fit is under way.
    pub fitting: bool,
    /// Experiments and their results.
    pub experiments: &'a Desk,
    /// What happened, newest last.
    pub journal: &'a VecDeque<Entry>,
}

/// State of every pane.
#[derive(Default)]
pub struct States {
    /// Of the plant.
    pub pid: pid::State,
    /// Of the faceplate.
    pub faceplate: faceplate::State,
    /// Of the trend.
    pub trend: trend::State,
    /// Of identification.
    pub identify: identify::State,
    /// Of linear models.
    pub linear: linear::State,
    /// Of tuning.
    pub tune: tune::State,
    /// Of the Nyquist plot.
    pub nyquist: nyquist::State,
    /// Of the step plot.
    pub step: step::State,
    /// Of the experiments.
    pub experiments: experiments::State,
    /// Of the log.
    pub log: log::State,
}

/// Draws one pane.
pub fn ui(kind: PaneKind, ui: &mut egui::Ui, view: &View, states: &mut States) -> Vec<Action> {
    match kind {
        PaneKind::Pid => pid::ui(ui, view, &mut states.pid),
        PaneKind::Faceplate => faceplate::ui(ui, view, &mut states.faceplate),
        PaneKind::Trend => trend::ui(ui, view, &mut states.trend),
        PaneKind::Identify => identify::ui(ui, view, &mut states.identify),
        PaneKind::Linear => linear::ui(ui, view, &mut states.linear),
        PaneKind::Tune => tune::ui(ui, view, &mut states.tune),
        PaneKind::Nyquist => nyquist::ui(ui, view, &mut states.nyquist),
        PaneKind::Step => step::ui(ui, view, &mut states.step),
        PaneKind::Experiments => experiments::ui(ui, view, &mut states.experiments),
        PaneKind::Log => log::ui(ui, view, &mut states.log),
    }
}
