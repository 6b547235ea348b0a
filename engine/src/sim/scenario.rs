//! Prepared runs: a rig, a start, and commands at given times.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::closed_loop::ClosedLoop;
use super::scenario_event::ScenarioEvent;
use crate::excitation::{Excitation, ExcitationReport};
use crate::explain::{Explain, number};
use crate::plant::{Measurement, Network, OperatingPoint, RigError};
use crate::session::{CommandError, Rig, RigCommand};
use crate::signal::ChannelSet;

/// How a run starts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Levels in cm by tank tag; those not named stay as the rig file has them.
    #[serde(default)]
    pub levels_cm: std::collections::BTreeMap<String, f64>,
    /// Pump inputs by pump tag, in their own units.
    #[serde(default)]
    pub inputs: std::collections::BTreeMap<String, f64>,
}

/// A prepared run, without the rig it runs on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of the file format; 1.
    pub schema: u32,
    /// Preset or rig file.
    pub rig: String,
    /// Configuration of the rig; absent: its first.
    pub configuration: Option<String>,
    /// Length of the run in seconds.
    pub duration_s: f64,
    /// Seed of the noise.
    #[serde(default)]
    pub seed: u64,
    /// Noise, quantisation and resolution.
    #[serde(default = "Scenario::default_measurement")]
    pub measurement: Measurement,
    /// Every how many samples a row is kept, 1 or more.
    #[serde(default = "Scenario::default_keep")]
    pub keep_every: u32,
    /// State at the start.
    #[serde(default)]
    pub start: Start,
    /// Commands, in any order.
    #[serde(rename = "event", default)]
    pub events: Vec<ScenarioEvent>,
}

impl Scenario {
    fn default_measurement() -> Measurement {
        Measurement::DEFAULT
    }

    fn default_keep() -> u32 {
        1
    }
}

/// A finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Columns.
    pub channels: Arc<ChannelSet>,
    /// Time of each row in seconds.
    pub time_s: Vec<f64>,
    /// Rows one after the other.
    pub values: Vec<f64>,
    /// Steps of the integrator.
    pub integrator_steps: u64,
    /// Tests on its loops, in the order in which they ended.
    pub excitations: Vec<ExcitationReport>,
}

impl Run {
    /// One column by its name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let index = self.channels.channels.iter().position(|c| c.name == name)?;
        Some(self.values.iter().skip(index).step_by(self.channels.len()).copied().collect())
    }
}

/// Why a scenario cannot run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScenarioError {
    /// The start is refused.
    #[error("at {} s: {error}", number(*.at_s))]
    Command {
        /// Time in seconds.
        at_s: f64,
        /// What was refused.
        error: CommandError,
    },
    /// An event is refused.
    #[error("at {} s, {command}: {error}", number(*.at_s))]
    Event {
        /// Time of the event in seconds.
        at_s: f64,
        /// Its command, as files name it.
        command: &'static str,
        /// What was refused.
        error: CommandError,
    },
    /// Rows of which none is kept.
    #[error("keep_every = 0 keeps no row; it must be 1 or more")]
    Keep,
    /// A length that is negative or not a number.
    #[error("a run of {} s is not possible: the duration must be 0 s or more", number(*.duration_s))]
    Length {
        /// Length in seconds.
        duration_s: f64,
    },
    /// A length of too many samples.
    #[error("a run of {} s with sample time {} s is not possible: at most 10⁸ samples", number(*.duration_s), number(*.sample_time_s))]
    Duration {
        /// Length in seconds.
        duration_s: f64,
        /// Sample time in seconds.
        sample_time_s: f64,
    },
}

impl Explain for ScenarioError {
    fn key(&self) -> &'static str {
        match self {
            Self::Command { .. } => "scenario.command",
            Self::Event { .. } => "scenario.event",
            Self::Keep => "scenario.keep",
            Self::Length { .. } => "scenario.length",
            Self::Duration { .. } => "scenario.duration",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Command { at_s, error } => vec![("at_s", number(*at_s)), ("error", error.to_string())],
            Self::Event { at_s, command, error } => vec![
                ("at_s", number(*at_s)),
                ("command", (*command).to_owned()),
                ("error", error.to_string()),
            ],
            Self::Keep => vec![],
            Self::Length { duration_s } => vec![("duration_s", number(*duration_s))],
            Self::Duration { duration_s, sample_time_s } => {
                vec![("duration_s", number(*duration_s)), ("sample_time_s", number(*sample_time_s))]
            }
        }
    }

    fn cause(&self) -> Option<&dyn Explain> {
        match self {
            Self::Command { error, .. } | Self::Event { error, .. } => Some(error),
            _ => None,
        }
    }
}

/// Longest run in samples.
const MOST_SAMPLES: f64 = 1e8;

/// A scenario ready to run.
pub(super) struct Prepared {
    /// In its starting state.
    pub closed: ClosedLoop,
    /// Commands in the order of their times.
    pub events: Vec<ScenarioEvent>,
    /// Samples of the run.
    pub samples: u64,
}

fn refused(event: &ScenarioEvent, error: CommandError) -> ScenarioError {
    ScenarioError::Event { at_s: event.at_s, command: event.command.key(), error }
}

/// Checks a scenario and puts a rig into its starting state.
pub(super) fn prepare(network: &Arc<Network>, scenario: &Scenario) -> Result<Prepared, ScenarioError> {
    let (duration_s, sample_time_s) = (scenario.duration_s, network.spec.sample_time_s);
    if duration_s.is_nan() || duration_s < 0.0 {
        return Err(ScenarioError::Length { duration_s });
    }
    let count = (duration_s / sample_time_s + 1e-9).floor();
    if count > MOST_SAMPLES {
        return Err(ScenarioError::Duration { duration_s, sample_time_s });
    }
    if scenario.keep_every == 0 {
        return Err(ScenarioError::Keep);
    }
    if let Some(event) = scenario.events.iter().find(|e| !e.at_s.is_finite() || e.at_s < 0.0) {
        let (item, expected) = ("event".to_owned(), "a time of 0 s or more".to_owned());
        let error = RigError::Value { item, field: "at_s", value: event.at_s, expected };
        return Err(refused(event, error.into()));
    }
    let at_start = |error: CommandError| ScenarioError::Command { at_s: 0.0, error };
    let configuration = configuration_index(network, scenario).map_err(at_start)?;
    let mut closed =
        ClosedLoop::simulated(network.clone(), configuration, scenario.measurement, scenario.seed)
            .map_err(at_start)?;
    set_start(&mut closed, &scenario.start).map_err(at_start)?;
    let mut events = scenario.events.clone();
    events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    Ok(Prepared { closed, events, samples: count as u64 + 1 })
}

/// The rig with its loops as a scenario starts them, before its first sample.
///
/// # Errors
/// [`ScenarioError`] when the scenario cannot start.
pub fn scenario_loop(network: &Arc<Network>, scenario: &Scenario) -> Result<ClosedLoop, ScenarioError> {
    prepare(network, scenario).map(|prepared| prepared.closed)
}

/// Runs a scenario on a rig from start to end.
///
/// # Errors
/// [`ScenarioError`] naming the time of the refused command, or the length that is not possible.
pub fn run_scenario(network: Arc<Network>, scenario: &Scenario) -> Result<Run, ScenarioError> {
    let Prepared { mut closed, events, samples } = prepare(&network, scenario)?;
    let mut run = Rows::new(scenario);
    run_samples(&mut closed, &events, samples, |sample, now_s, row| run.see(sample, now_s, row))?;
    Ok(run.finish(&mut closed))
}

/// Samples between two questions whether to go on.
const STRIDE: u64 = 4096;

/// [`run_scenario`] as long as `go_on` says so, which is asked now and then with the share done; `None` otherwise.
///
/// # Errors
/// [`ScenarioError`] as there.
pub fn run_scenario_while(
    network: Arc<Network>,
    scenario: &Scenario,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Run>, ScenarioError> {
    let Prepared { mut closed, events, samples } = prepare(&network, scenario)?;
    let mut run = Rows::new(scenario);
    let (mut done, mut due) = (0, events.as_slice());
    while done < samples {
        if !go_on(done as f64 / samples as f64) {
            return Ok(None);
        }
        let count = STRIDE.min(samples - done);
        let used = run_samples(&mut closed, due, count, |sample, now_s, row| {
            run.see(done + sample, now_s, row);
        })?;
        due = &due[used..];
        done += count;
    }
    Ok(Some(run.finish(&mut closed)))
}

/// Runs a test on a loop of a simulated rig until it ends: from the state of the rig's file in a configuration, or
/// with the rig at rest with the loop's level at `level_cm`.
///
/// # Errors
/// [`CommandError`] when the rig cannot start there, or the test is refused.
pub fn run_excitation(
    rig: &Rig,
    tag: &str,
    level_cm: Option<f64>,
    excitation: &Excitation,
) -> Result<(Run, ExcitationReport), CommandError> {
    let mut closed =
        ClosedLoop::simulated(rig.network.clone(), rig.configuration, rig.measurement, rig.seed)?;
    if let Some(level_cm) = level_cm {
        closed.apply(&RigCommand::SteadyAt { tag: tag.to_owned(), level_cm })?;
    }
    let excitation = Box::new(excitation.clone());
    closed.apply(&RigCommand::Excite { tag: tag.to_owned(), excitation })?;
    let mut rows = Rows { keep: 1, time_s: Vec::new(), values: Vec::new() };
    for sample in 0.. {
        let now_s = closed.time_s();
        rows.see(sample, now_s, closed.step());
        if closed.has_ended_excitations() {
            break;
        }
    }
    let mut run = rows.finish(&mut closed);
    let report = run.excitations.remove(0);
    Ok((run, report))
}

/// The rows of a run as they come.
struct Rows {
    keep: u64,
    time_s: Vec<f64>,
    values: Vec<f64>,
}

impl Rows {
    fn new(scenario: &Scenario) -> Self {
        Self { keep: u64::from(scenario.keep_every), time_s: Vec::new(), values: Vec::new() }
    }

    fn see(&mut self, sample: u64, now_s: f64, row: &[f64]) {
        if sample.is_multiple_of(self.keep) {
            self.time_s.push(now_s);
            self.values.extend_from_slice(row);
        }
    }

    fn finish(self, closed: &mut ClosedLoop) -> Run {
        let integrator_steps = closed.source().plant().map_or(0, crate::plant::Plant::steps);
        let Self { time_s, values, .. } = self;
        let excitations = closed.ended_excitations().collect();
        Run { channels: closed.channels().clone(), time_s, values, integrator_steps, excitations }
    }
}

/// Takes samples, each preceded by the commands that are due, and shows every row with its number and time. Gives the
/// number of commands carried out.
pub(super) fn run_samples(
    closed: &mut ClosedLoop,
    events: &[ScenarioEvent],
    samples: u64,
    mut see: impl FnMut(u64, f64, &[f64]),
) -> Result<usize, ScenarioError> {
    let mut used = 0;
    for sample in 0..samples {
        let now_s = closed.time_s();
        while let Some(event) = events.get(used).filter(|e| e.at_s <= now_s + 1e-9) {
            closed.apply(&event.command).map_err(|error| refused(event, error))?;
            used += 1;
        }
        see(sample, now_s, closed.step());
    }
    Ok(used)
}

/// Where a scenario starts: levels, inputs, angles and delays before its first sample, and its configuration's index.
///
/// # Errors
/// [`ScenarioError`] when the start is refused.
pub fn scenario_start(
    network: Arc<Network>,
    scenario: &Scenario,
) -> Result<(OperatingPoint, usize), ScenarioError> {
    let refused = |error: CommandError| ScenarioError::Command { at_s: 0.0, error };
    let configuration = configuration_index(&network, scenario).map_err(refused)?;
    let mut closed = ClosedLoop::simulated(network, configuration, scenario.measurement, scenario.seed)
        .map_err(refused)?;
    set_start(&mut closed, &scenario.start).map_err(refused)?;
    let plant = closed.source().plant().ok_or_else(|| refused(CommandError::NotARig))?;
    Ok((OperatingPoint::of(plant), configuration))
}

fn configuration_index(network: &Network, scenario: &Scenario) -> Result<usize, CommandError> {
    let Some(id) = &scenario.configuration else { return Ok(0) };
    let found = network.spec.configurations.iter().position(|c| c.id == *id);
    found.ok_or_else(|| CommandError::UnknownTag { tag: id.clone() })
}

fn set_start(closed: &mut ClosedLoop, start: &Start) -> Result<(), CommandError> {
    if start.levels_cm.is_empty() && start.inputs.is_empty() {
        return Ok(());
    }
    let network = closed.network().clone();
    let (mut levels, mut inputs) = match closed.source().plant() {
        Some(plant) => (plant.levels_cm().to_vec(), plant.inputs().to_vec()),
        None => return Err(CommandError::NotARig),
    };
    let unknown = |tag: &String| CommandError::UnknownTag { tag: tag.clone() };
    for (tag, &level_cm) in &start.levels_cm {
        let tank = network.tank(tag).ok_or_else(|| unknown(tag))?;
        let rim = network.tanks[tank].height_cm;
        if !(0.0..=rim).contains(&level_cm) {
            let expected = format!("0…{rim} (rim)");
            return Err(
                RigError::Value { item: tag.clone(), field: "levels_cm", value: level_cm, expected }.into()
            );
        }
        levels[tank] = level_cm;
    }
    for (tag, &input) in &start.inputs {
        let pump = network.pump(tag).ok_or_else(|| unknown(tag))?;
        let p = &network.pumps[pump];
        if !(p.min..=p.max).contains(&input) {
            let expected = format!("{}…{}", p.min, p.max);
            return Err(RigError::Value { item: tag.clone(), field: "inputs", value: input, expected }.into());
        }
        inputs[pump] = input;
    }
    closed.restart_at(&levels, &inputs)
}
