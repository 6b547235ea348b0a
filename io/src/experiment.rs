//! Experiment files: TOML in, experiments ready to run out, and those that ship inside the program.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use toml::Value;
use toml::de::{DeTable, DeValue};
use vasos_engine::experiment::{
    Experiment, ExperimentError, ExperimentRun, ExperimentSpec, Member, Place, RunSpec, ScenarioRun,
};
use vasos_engine::plant::Network;

use crate::rig::{FileError, PRESETS, file_name, load_rig, load_scenario, parse, preset, read_text};

/// An experiment that ships with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Embedded {
    /// Its id.
    pub id: &'static str,
    /// The file's text.
    pub text: &'static str,
}

macro_rules! embedded {
    ($($id:literal),* $(,)?) => {
        &[$(Embedded {
            id: $id,
            text: include_str!(concat!("../../assets/experiments/", $id, ".toml")),
        }),*]
    };
}

/// The experiments, source by source.
pub const EXPERIMENTS: &[Embedded] = embedded![
    "stad_figure_4",
    "stad_figure_7",
    "stad_figure_8",
    "stad_figure_9",
    "stad_figure_10",
    "stad_figure_11",
    "stad_load_in_range",
    "stad_amigo_drift",
    "stad_integrating",
    "stad_sample_time",
    "stad_faults",
    "simtank_figure_7",
    "simtank_figure_8",
    "simtank_figure_10",
    "simtank_steady_levels",
    "uff_offset",
    "uff_proportional_band",
    "uff_pi_load",
    "uff_ti_repetition",
    "uff_pd_prediction",
    "uff_second_order",
    "uff_ki_sweep",
    "uff_itae_reactor",
    "uff_effect_table",
    "uff_on_off",
    "fic18_tables",
    "fic18_figure_6",
    "fic18_figure_9",
    "fic18_figure_10",
    "fic18_figure_11",
    "fic18_optimum",
];

/// An experiment of the program by its id.
///
/// # Errors
/// [`FileError::Read`] when there is none of that name.
pub fn experiment(id: &str) -> Result<Experiment, FileError> {
    let found = EXPERIMENTS.iter().find(|e| e.id == id).ok_or_else(|| FileError::Read {
        path: id.to_owned(),
        reason: "there is no experiment of that name, and no such file".to_owned(),
    })?;
    parse_experiment(&format!("{id}.toml"), found.text, Path::new(""))
}

/// An experiment by id, or by the path of a file.
///
/// # Errors
/// [`FileError`].
pub fn load_experiment(id_or_path: &str) -> Result<Experiment, FileError> {
    let path = Path::new(id_or_path);
    if EXPERIMENTS.iter().any(|e| e.id == id_or_path) || !path.exists() {
        return experiment(id_or_path);
    }
    parse_experiment(&file_name(path), &read_text(path)?, path.parent().unwrap_or(Path::new("")))
}

/// An experiment from the text of its file; `name` stands in errors, files it names are sought in `folder`.
///
/// # Errors
/// [`FileError`] with the line and what is expected there.
pub fn parse_experiment(name: &str, text: &str, folder: &Path) -> Result<Experiment, FileError> {
    let mut spec: ExperimentSpec = parse(name, text)?;
    let refused = |error| at(name, text, error);
    let mut rigs: BTreeMap<String, Arc<Network>> = BTreeMap::new();
    for (number, run) in spec.runs.iter_mut().enumerate() {
        if let Some(file) = &run.scenario_file {
            let (scenario, network) = load_scenario(&folder.join(file))?;
            let scenario = ScenarioRun { rig: file.clone(), ..ScenarioRun::of(scenario) };
            rigs.insert(file.clone(), network);
            (run.scenario, run.scenario_file) = (Some(scenario), None);
        }
        let rig = run.scenario.as_ref().map(|s| &s.rig).or(run.models.as_ref().map(|m| &m.rig));
        if let Some(rig) = rig.filter(|rig| !rigs.contains_key(*rig)) {
            let network = find_rig(rig, folder, Place::Run(number), &refused)?;
            rigs.insert(rig.clone(), network);
        }
    }
    spec.runs = unrolled(spec.runs).map_err(refused)?;
    Experiment::new(spec, rigs).map_err(refused)
}

/// What an experiment's run was refused for, with the line of its file; id or path as for [`load_experiment`].
#[must_use]
pub fn explained(id_or_path: &str, error: ExperimentError) -> FileError {
    if let Some(found) = EXPERIMENTS.iter().find(|e| e.id == id_or_path) {
        return at(&format!("{id_or_path}.toml"), found.text, error);
    }
    let path = Path::new(id_or_path);
    at(&file_name(path), &read_text(path).unwrap_or_default(), error)
}

fn at(name: &str, text: &str, error: ExperimentError) -> FileError {
    FileError::Experiment { name: name.to_owned(), line: line_of(text, &error), error: Box::new(error) }
}

fn find_rig(
    rig: &str,
    folder: &Path,
    place: Place,
    refused: &dyn Fn(ExperimentError) -> FileError,
) -> Result<Arc<Network>, FileError> {
    if PRESETS.iter().any(|p| p.id == rig) {
        return preset(rig);
    }
    let beside = folder.join(rig);
    if !beside.is_file() {
        let presets = PRESETS.map(|p| p.id).join(", ");
        return Err(refused(ExperimentError::UnknownRig { rig: rig.to_owned(), presets, place }));
    }
    load_rig(&beside.display().to_string())
}

/// Each run of a sweep in its place.
fn unrolled(runs: Vec<RunSpec>) -> Result<Vec<RunSpec>, ExperimentError> {
    let mut all = Vec::with_capacity(runs.len());
    for (number, run) in runs.into_iter().enumerate() {
        let Some(sweep) = run.sweep.clone() else {
            all.push(run);
            continue;
        };
        let refused = || ExperimentError::Sweep {
            run: run.id.clone(),
            parameter: sweep.parameter.clone(),
            place: Place::Run(number),
        };
        if sweep.values.is_empty() {
            return Err(refused());
        }
        for &value in &sweep.values {
            let base = RunSpec { sweep: None, ..run.clone() };
            let mut tree = Value::try_from(&base).map_err(|_| refused())?;
            let place = sweep.parameter.split('.').try_fold(&mut tree, |tree, key| match tree {
                Value::Table(table) => table.get_mut(key),
                Value::Array(items) => items.get_mut(key.parse::<usize>().ok()?),
                _ => None,
            });
            let place = place.filter(|v| v.is_float() || v.is_integer()).ok_or_else(refused)?;
            *place = Value::Float(value);
            let mut swept: RunSpec = tree.try_into().map_err(|_| refused())?;
            swept.id = format!("{}_{value}", run.id);
            swept.member = Some(Member { sweep: run.id.clone(), value });
            all.push(swept);
        }
    }
    Ok(all)
}

/// The line, from 1, of the item an error is about.
fn line_of(text: &str, error: &ExperimentError) -> Option<usize> {
    let (list, number) = match error.place() {
        Place::Whole => return None,
        Place::Run(number) => ("run", number),
        Place::Table(number) => ("table", number),
        Place::Check(number) => ("check", number),
    };
    let table = DeTable::parse(text).ok()?;
    let (_, items) = table.get_ref().iter().find(|(key, _)| key.get_ref() == list)?;
    let DeValue::Array(items) = items.get_ref() else { return None };
    let start = items.get(number)?.span().start;
    text.get(..start).map(|before| before.matches('\n').count() + 1)
}

/// Writes the columns of an experiment as CSV: `run`, then the axes and columns of all runs; what a run does not have is
/// left empty.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_experiment_csv(run: &ExperimentRun, path: &Path) -> Result<(), FileError> {
    let failed = |reason: String| FileError::Write { path: path.display().to_string(), reason };
    let mut names: Vec<&str> = Vec::new();
    let axes = run.runs.iter().map(|r| r.x_name.as_str());
    let columns = run.runs.iter().flat_map(|r| &r.columns).map(|c| c.name.as_str());
    for name in axes.chain(columns) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut writer = csv::Writer::from_path(path).map_err(|e| failed(e.to_string()))?;
    writer
        .write_record(std::iter::once("run").chain(names.iter().copied()))
        .map_err(|e| failed(e.to_string()))?;
    for result in &run.runs {
        let columns: Vec<Option<&[f64]>> = names.iter().map(|name| result.column(name)).collect();
        for row in 0..result.x.len() {
            let cell = |column: &Option<&[f64]>| match column.and_then(|c| c.get(row)) {
                // Times are multiples of the sample time; twelve digits hide the rounding of the product.
                Some(v) if !v.is_nan() => format!("{}", rounded(*v)),
                _ => String::new(),
            };
            let cells = std::iter::once(result.id.clone()).chain(columns.iter().map(cell));
            writer.write_record(cells).map_err(|e| failed(e.to_string()))?;
        }
    }
    writer.flush().map_err(|e| failed(e.to_string()))
}

fn rounded(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}
