//! A tuning tried on the non-linear rig before it is used: setpoint and load step with noise, quantisation, saturation.

use std::sync::Arc;

use super::scenario::{Scenario, ScenarioError, Start, run_scenario};
use super::scenario_event::ScenarioEvent;
use crate::analyze::{Excitation, Metrics, metrics_at_rest};
use crate::control::{Mode, PidTuning, final_pump};
use crate::plant::{Fault, Measurement, Network};
use crate::session::RigCommand;
use crate::signal::ChannelKind;

/// What is tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Configuration of the rig.
    pub configuration: String,
    /// What of the rig is other than in its file.
    pub setup: Vec<RigCommand>,
    /// Noise, quantisation and resolution.
    pub measurement: Measurement,
    /// Seed of the noise.
    pub seed: u64,
    /// Loop.
    pub tag: String,
    /// Its tuning.
    pub tuning: PidTuning,
    /// Its PV filter in seconds.
    pub pv_filter_s: f64,
    /// Level at which it rests before, in cm.
    pub level_cm: f64,
    /// Step of the setpoint in cm, after a tenth of the time.
    pub step_cm: f64,
    /// Share of its flow that the loop's pump keeps from the middle of the time on: a load at the process input.
    pub pump_share: f64,
    /// Length in seconds.
    pub duration_s: f64,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialRun {
    /// Times in seconds.
    pub time_s: Vec<f64>,
    /// Setpoint, in cm.
    pub sp: Vec<f64>,
    /// PV as the controller sees it, in cm.
    pub pv: Vec<f64>,
    /// MV in the pump's unit.
    pub mv: Vec<f64>,
    /// Figures from the setpoint step to the load.
    pub setpoint: Option<Metrics>,
    /// Figures from the load on.
    pub load: Option<Metrics>,
    /// Share of the time that MV stood at a limit of the pump.
    pub saturated_share: f64,
}

/// Share of the length at which the setpoint steps, and at which the load does.
const STEP_AT: f64 = 0.1;
const LOAD_AT: f64 = 0.5;

/// Runs a trial; the same trial gives the same bytes.
///
/// # Errors
/// [`ScenarioError`] for a tag, a tuning or a level that is not possible, with the reason.
pub fn run_trial(network: &Arc<Network>, trial: &Trial) -> Result<TrialRun, ScenarioError> {
    let configurations = &network.spec.configurations;
    let loops = configurations.iter().find(|c| c.id == trial.configuration).map_or(&[][..], |c| &c.loops);
    let slot = loops.iter().position(|l| l.id == trial.tag);
    let pump = slot.and_then(|slot| final_pump(network, loops, &loops[slot]));
    let run = run_scenario(network.clone(), &scenario(network, trial, pump))?;
    let column = |kind: ChannelKind| -> Vec<f64> {
        let Some(index) = run.channels.column(kind) else { return Vec::new() };
        run.values.iter().skip(index).step_by(run.channels.len()).copied().collect()
    };
    let slot = slot.unwrap_or(0);
    let (sp, pv, mv) =
        (column(ChannelKind::Setpoint(slot)), column(ChannelKind::Pv(slot)), column(ChannelKind::Mv(slot)));
    let figures = |from: f64, to: f64, excitation: Excitation| {
        let first = run.time_s.partition_point(|t| *t < from * trial.duration_s);
        let last = run.time_s.partition_point(|t| *t < to * trial.duration_s);
        let goal = *sp.get(first)?;
        let part = |of: &[f64]| of.get(first..last).map(<[f64]>::to_vec);
        let (time_s, r, y, u) = (part(&run.time_s)?, part(&sp)?, part(&pv)?, part(&mv)?);
        metrics_at_rest(&time_s, &r, &y, &u, excitation, goal).ok()
    };
    let saturated_share = pump.map_or(0.0, |pump| {
        let range = &network.spec.pumps[pump];
        let at_limit = |u: &&f64| **u <= range.min || **u >= range.max;
        mv.iter().filter(at_limit).count() as f64 / mv.len().max(1) as f64
    });
    Ok(TrialRun {
        setpoint: figures(STEP_AT, LOAD_AT, Excitation::Setpoint),
        load: figures(LOAD_AT, 1.0, Excitation::Load),
        saturated_share,
        sp,
        pv,
        mv,
        time_s: run.time_s,
    })
}

fn scenario(network: &Network, trial: &Trial, pump: Option<usize>) -> Scenario {
    let Trial { tag, level_cm, .. } = trial;
    let mut events: Vec<ScenarioEvent> =
        trial.setup.iter().map(|command| ScenarioEvent { at_s: 0.0, command: command.clone() }).collect();
    let mut at = |at_s: f64, command: RigCommand| events.push(ScenarioEvent { at_s, command });
    let tag = || tag.clone();
    at(0.0, RigCommand::Mode { tag: tag(), mode: Mode::Automatic });
    at(0.0, RigCommand::Tuning { tag: tag(), tuning: trial.tuning });
    at(0.0, RigCommand::PvFilter { tag: tag(), time_constant_s: trial.pv_filter_s });
    at(0.0, RigCommand::Setpoint { tag: tag(), level_cm: *level_cm });
    at(0.0, RigCommand::SteadyAt { tag: tag(), level_cm: *level_cm });
    at(STEP_AT * trial.duration_s, RigCommand::Setpoint { tag: tag(), level_cm: level_cm + trial.step_cm });
    if let Some(pump) = pump {
        let fault = Fault::WeakPump { share: trial.pump_share };
        let tag = network.spec.pumps[pump].id.clone();
        at(LOAD_AT * trial.duration_s, RigCommand::Fault { tag, fault });
    }
    Scenario {
        schema: 1,
        rig: network.spec.id.clone(),
        configuration: Some(trial.configuration.clone()),
        duration_s: trial.duration_s,
        seed: trial.seed,
        measurement: trial.measurement,
        keep_every: 1,
        start: Start::default(),
        events,
    }
}
