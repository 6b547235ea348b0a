//! Work beside the window: imports, fits, file dialogs. Each has a thread of its own and gives one result.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, unbounded};
use eframe::egui;
use vasos_engine::document::NewModel;
use vasos_engine::experiment::Experiment;
use vasos_engine::explain::Explain;
use vasos_engine::plant::Network;
use vasos_io::log::{ImportOptions, ImportedLog};
use vasos_io::recording::Recorded;

use crate::answers::{Question, Reply};
use crate::experiments::Finished;

/// A dialog that answers faster than any hand was never shown.
const NO_DIALOG: Duration = Duration::from_millis(100);

/// An error to be said in the window's language.
pub type Said = Box<dyn Explain + Send>;

/// What a job came to.
pub enum Outcome {
    /// A log was read.
    Log(Vec<PathBuf>, Box<ImportedLog>, ImportOptions),
    /// A recording was read.
    Runs(Box<Recorded>),
    /// A rig was read.
    Rig(PathBuf, Arc<Network>),
    /// A model was fitted.
    Model(Box<NewModel>),
    /// An experiment was read from a file.
    Experiment(PathBuf, Arc<Experiment>),
    /// An experiment has ended.
    Ran(Box<Finished>),
    /// A pane's question was worked out.
    Answered(Box<Question>, Box<Reply>),
    /// A recording is complete: its files, its rows.
    Recorded(Vec<PathBuf>, u64),
    /// A file was chosen.
    Chosen(PathBuf),
    /// The dialog was closed without a choice.
    Cancelled,
    /// The system has no file dialog.
    NoDialog,
    /// It failed.
    Failed(Said),
}

/// Jobs under way.
pub struct Jobs {
    ctx: egui::Context,
    sender: Sender<Outcome>,
    receiver: Receiver<Outcome>,
    under_way: usize,
}

impl Jobs {
    /// None yet; results wake the window.
    pub fn new(ctx: egui::Context) -> Self {
        let (sender, receiver) = unbounded();
        Self { ctx, sender, receiver, under_way: 0 }
    }

    /// Whether a job is under way.
    pub fn is_busy(&self) -> bool {
        self.under_way > 0
    }

    /// Results since the last call.
    pub fn results(&mut self) -> Vec<Outcome> {
        let results: Vec<Outcome> = self.receiver.try_iter().collect();
        self.under_way -= results.len().min(self.under_way);
        results
    }

    /// Starts a job.
    pub fn start(&mut self, name: &str, job: impl FnOnce() -> Outcome + Send + 'static) {
        let (sender, ctx) = (self.sender.clone(), self.ctx.clone());
        let started = std::thread::Builder::new().name(format!("vasos-{name}")).spawn(move || {
            // A defect in a job must not leave the window waiting for it.
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(job));
            let outcome = outcome.unwrap_or_else(|_| Outcome::Failed(Box::new(Defect)));
            drop(sender.send(outcome));
            ctx.request_repaint();
        });
        if started.is_ok() {
            self.under_way += 1;
        }
    }

    /// Asks for a file with the system's dialog.
    pub fn ask_file(&mut self) {
        self.start("dialog", || {
            let asked = Instant::now();
            let chosen = rfd::FileDialog::new().pick_file();
            match chosen {
                Some(path) => Outcome::Chosen(path),
                None if asked.elapsed() < NO_DIALOG => Outcome::NoDialog,
                None => Outcome::Cancelled,
            }
        });
    }
}

/// A job that ended in a defect of the program.
#[derive(Debug, thiserror::Error)]
#[error("this could not be finished because of a defect in Vasos; nothing was changed")]
pub struct Defect;

impl Explain for Defect {
    fn key(&self) -> &'static str {
        "window.defect"
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        vec![]
    }
}
