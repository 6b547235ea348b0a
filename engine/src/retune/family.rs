//! Models as likely as the fitted one, and the few of them that an optimum is held against.

use crate::analyze::{OpenLoop, analyze_loop};
use crate::control::ParallelGains;
use crate::model::ProcessModel;
use crate::tune::optimum::Process;

/// Models an optimum over the uncertainty is held against; more cost time and change little.
const FAMILY: usize = 12;
/// Share of the draws, by how little robust they are, that the family reaches to: the last ones are outliers of a
/// normal distribution in the search's coordinates.
const REACH: f64 = 0.95;

/// A model with at least this dead time; a transfer function keeps its own.
pub(super) fn with_dead_time(model: &ProcessModel, least_s: f64) -> ProcessModel {
    let mut model = model.clone();
    match &mut model {
        ProcessModel::Fopdt(m) => m.dead_time_s = m.dead_time_s.max(least_s),
        ProcessModel::Ipdt(m) => m.dead_time_s = m.dead_time_s.max(least_s),
        ProcessModel::Sopdt(m) => m.dead_time_s = m.dead_time_s.max(least_s),
        ProcessModel::Rational(_) => {}
    }
    model
}

/// The model and draws spread evenly over the ranks of Ms under a tuning.
pub(super) fn family(model: &ProcessModel, draws: &[ProcessModel], tuning: &ParallelGains) -> Vec<Process> {
    let ms = |m: &ProcessModel| analyze_loop(&OpenLoop::of_parallel(m, tuning)).ms.unwrap_or(f64::INFINITY);
    let mut ranked: Vec<(f64, &ProcessModel)> = draws.iter().map(|m| (ms(m), m)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen = vec![Process::Model(model.clone())];
    let last = (REACH * ranked.len().saturating_sub(1) as f64).round() as usize;
    let steps = FAMILY - 2;
    let mut rows: Vec<usize> = (0..=steps).map(|k| k * last / steps).collect();
    rows.dedup();
    chosen.extend(rows.into_iter().filter_map(|k| ranked.get(k)).map(|(_, m)| Process::Model((*m).clone())));
    chosen
}
