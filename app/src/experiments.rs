//! Experiments beside the window: what there is, what runs, what came of it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use vasos_engine::experiment::{Experiment, ExperimentEnd, ExperimentError, ExperimentRun, run_experiment};
use vasos_io::experiment::{EXPERIMENTS, experiment};

/// Parts that progress is counted in.
const PARTS: f64 = 1000.0;

/// An experiment under way.
#[derive(Debug, Clone)]
pub struct UnderWay {
    /// Its id.
    pub id: String,
    progress: Arc<AtomicU32>,
    cancel: Arc<AtomicBool>,
}

impl UnderWay {
    /// Share that is done, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f32 {
        self.progress.load(Ordering::Relaxed) as f32 / PARTS as f32
    }

    /// Asks it to end.
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

/// Every experiment with its last result.
#[derive(Default)]
pub struct Desk {
    /// The program's, then those from files.
    pub known: Vec<Arc<Experiment>>,
    /// Results by id.
    pub results: BTreeMap<String, Arc<ExperimentRun>>,
    /// The one that runs.
    pub under_way: Option<UnderWay>,
    /// Id of the one in view.
    pub chosen: String,
    listed: bool,
}

impl Desk {
    /// Reads the program's own experiments, once.
    pub fn list(&mut self) {
        if self.listed {
            return;
        }
        self.listed = true;
        // They are read in a test; one that cannot be read here is not offered.
        let own = EXPERIMENTS.iter().filter_map(|e| experiment(e.id).ok()).map(Arc::new);
        let from_files = std::mem::take(&mut self.known);
        self.known = own.chain(from_files).collect();
        if self.chosen.is_empty() {
            self.chosen = self.known.first().map_or(String::new(), |e| e.spec.id.clone());
        }
    }

    /// Adds one from a file, or replaces the one of the same id.
    pub fn add(&mut self, experiment: Arc<Experiment>) {
        self.list();
        let id = experiment.spec.id.clone();
        self.known.retain(|e| e.spec.id != id);
        self.results.remove(&id);
        self.known.push(experiment);
        self.chosen = id;
    }

    /// The one in view.
    #[must_use]
    pub fn in_view(&self) -> Option<&Arc<Experiment>> {
        self.known.iter().find(|e| e.spec.id == self.chosen)
    }

    /// What to run in a job, and that it is under way; nothing while another one runs.
    pub fn start(&mut self, id: &str) -> Option<impl FnOnce() -> Finished + Send + use<>> {
        if self.under_way.is_some() {
            return None;
        }
        let experiment = self.known.iter().find(|e| e.spec.id == id)?.clone();
        let (progress, cancel) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicBool::new(false)));
        self.under_way =
            Some(UnderWay { id: id.to_owned(), progress: progress.clone(), cancel: cancel.clone() });
        Some(move || {
            let end = run_experiment(&experiment, &cancel, &mut |p| {
                let share = (p.done as f64 + p.share) / p.of.max(1) as f64;
                progress.store((PARTS * share) as u32, Ordering::Relaxed);
            });
            Finished { id: experiment.spec.id.clone(), end }
        })
    }
}

/// An experiment that has ended.
#[derive(Debug)]
pub struct Finished {
    /// Its id.
    pub id: String,
    /// How.
    pub end: Result<ExperimentEnd, ExperimentError>,
}
