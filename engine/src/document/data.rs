//! The document's data.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::control::{Law, LoopOptions, LoopSpec, Mode, PidGains, PidTuning, outer_of};
use crate::identify::{LoopStudy, ModelFit};
use crate::model::ProcessModel;
use crate::plant::{Measurement, Network};
use crate::session::{RecordedRun, Rig};
use crate::signal::LogTable;
use crate::tune::Ultimate;
use crate::tune::optimum::{LoopLimits, Objective};

/// Settings of one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopSettings {
    /// Setpoint in cm.
    pub setpoint_cm: f64,
    /// Who writes the output.
    pub mode: Mode,
    /// Gains and weights.
    pub tuning: PidTuning,
    /// Time constant of the PV filter in seconds.
    pub pv_filter_s: f64,
    /// The law with its settings.
    pub law: Law,
    /// What stands around the law.
    pub options: LoopOptions,
}

impl LoopSettings {
    /// As the rig file has them.
    #[must_use]
    pub fn of(spec: &LoopSpec) -> Self {
        Self {
            setpoint_cm: spec.setpoint_cm,
            mode: spec.mode,
            tuning: spec.tuning(),
            pv_filter_s: spec.pv_filter_s,
            law: spec.law,
            options: spec.options.clone(),
        }
    }

    /// Writes these settings into the description of their loop.
    pub(super) fn put_into(&self, spec: &mut LoopSpec) {
        spec.set_tuning(self.tuning);
        (spec.setpoint_cm, spec.mode, spec.pv_filter_s) = (self.setpoint_cm, self.mode, self.pv_filter_s);
        (spec.law, spec.options) = (self.law, self.options.clone());
    }
}

/// The rig and how it is set.
#[derive(Debug, Clone)]
pub struct RigSettings {
    /// Its structure.
    pub network: Arc<Network>,
    /// Index of the configuration.
    pub configuration: usize,
    /// Angles of the valves in degrees, in the order of the network.
    pub angles_deg: Vec<f64>,
    /// Settings of every loop of every configuration, by tag.
    pub loops: BTreeMap<String, LoopSettings>,
    /// Imperfections.
    pub measurement: Measurement,
    /// Seed of the noise.
    pub seed: u64,
}

impl RigSettings {
    /// A rig as its file has it.
    #[must_use]
    pub fn new(network: Arc<Network>) -> Self {
        let spec = &network.spec;
        let loops = spec.configurations.iter().flat_map(|c| &c.loops);
        let mut settings = Self {
            configuration: 0,
            angles_deg: spec.valves.iter().map(|v| v.angle_deg).collect(),
            loops: loops.map(|l| (l.id.clone(), LoopSettings::of(l))).collect(),
            measurement: Measurement::DEFAULT,
            seed: 1,
            network,
        };
        settings.turn_valves();
        settings
    }

    /// A rig as it was set when a recording of it began.
    #[must_use]
    pub fn recorded(run: &RecordedRun) -> Self {
        let mut settings = Self::new(run.network.clone());
        if run.configuration < run.network.spec.configurations.len() {
            settings.configuration = run.configuration;
            settings.turn_valves();
        }
        settings.measurement = run.measurement.unwrap_or(settings.measurement);
        settings
    }

    /// What a session starts on; everything else follows by commands.
    #[must_use]
    pub fn to_start(&self) -> Rig {
        Rig {
            network: self.network.clone(),
            configuration: self.configuration,
            measurement: self.measurement,
            seed: self.seed,
        }
    }

    /// Puts the angles to those of the present configuration.
    pub(super) fn turn_valves(&mut self) {
        let Some(configuration) = self.network.spec.configurations.get(self.configuration) else { return };
        for (id, &angle_deg) in &configuration.angles_deg {
            if let Some(valve) = self.network.valve(id) {
                self.angles_deg[valve] = angle_deg;
            }
        }
    }

    /// Turns to a configuration; the operator's mode of each loop slot goes along.
    pub(super) fn configure(&mut self, configuration: usize) {
        let tags = |settings: &Self| -> Vec<String> {
            settings.active_loops().iter().map(|l| l.id.clone()).collect()
        };
        let modes: Vec<Option<Mode>> =
            tags(self).iter().map(|tag| self.loops.get(tag).map(|l| l.mode)).collect();
        self.configuration = configuration;
        self.turn_valves();
        let network = self.network.clone();
        let loops = network.spec.configurations.get(configuration).map_or(&[][..], |c| &c.loops);
        for (tag, mode) in tags(self).iter().zip(modes) {
            if let (Some(mode), Some(settings)) = (mode, self.loops.get_mut(tag)) {
                let alone = outer_of(loops, tag).is_none();
                settings.mode = if mode == Mode::Cascade && alone { Mode::Automatic } else { mode };
            }
        }
    }

    /// Loops of the present configuration, as the rig file lists them.
    #[must_use]
    pub fn active_loops(&self) -> &[LoopSpec] {
        self.network.spec.configurations.get(self.configuration).map_or(&[], |c| &c.loops)
    }
}

/// Where trend and identification take their data from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceChoice {
    /// The simulated rig's run.
    Simulated,
    /// The imported log.
    Log,
    /// The recording that is played.
    Replay,
}

/// Which columns of a log are what; indices into its columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LogRoles {
    /// Process variable.
    pub pv: Option<usize>,
    /// Setpoint.
    pub sp: Option<usize>,
    /// Manipulated variable.
    pub mv: Option<usize>,
    /// Mode of the controller.
    pub mode: Option<usize>,
    /// Measured disturbance.
    pub disturbance: Option<usize>,
}

/// A stretch of time in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// First time.
    pub from_s: f64,
    /// Last time.
    pub to_s: f64,
}

/// Where a model comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelOrigin {
    /// Typed in.
    Typed,
    /// Fitted to a stretch of the simulated run.
    Run {
        /// Loop whose data it was.
        tag: String,
        /// The stretch.
        stretch: Stretch,
    },
    /// Taken out of a recording.
    Recording {
        /// Name of the run.
        name: String,
    },
    /// Fitted to a stretch of a log.
    Log {
        /// File name.
        name: String,
        /// The stretch.
        stretch: Stretch,
    },
}

/// The rows a model was fitted to, kept to draw it on them whatever becomes of their source.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedRows {
    /// Times in seconds.
    pub time_s: Vec<f64>,
    /// PV in its unit.
    pub pv: Vec<f64>,
}

/// A model of the list.
#[derive(Debug, Clone)]
pub struct ModelEntry {
    /// Number shown to people; it is not used again.
    pub number: u32,
    /// The model.
    pub model: ProcessModel,
    /// Where it comes from.
    pub origin: ModelOrigin,
    /// The fit that gave it.
    pub fit: Option<Arc<ModelFit>>,
    /// The study of the stretch that the fit is part of.
    pub study: Option<Arc<LoopStudy>>,
    /// The rows it was fitted to.
    pub rows: Option<Arc<FittedRows>>,
    /// Unit of its PV, as shown.
    pub pv_unit: String,
    /// Unit of its MV, as shown.
    pub mv_unit: String,
}

/// A tuning chosen to be looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Id of the rule, or `present`.
    pub rule: String,
    /// Short name of the controller: `P`, `PI`, `PD`, `PID`.
    pub controller: String,
    /// Gains.
    pub gains: PidGains,
}

/// What the best gains are sought for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OptimumSettings {
    /// What is made best.
    pub objective: Objective,
    /// Limits it keeps.
    pub limits: LoopLimits,
}

impl Default for OptimumSettings {
    fn default() -> Self {
        Self { objective: Objective::Jv, limits: LoopLimits::DEFAULT }
    }
}

/// Everything the user works on.
#[derive(Debug, Clone)]
pub struct Document {
    /// The rig.
    pub rig: RigSettings,
    /// The imported log.
    pub log: Option<Arc<LogTable>>,
    /// Its columns' roles.
    pub roles: LogRoles,
    /// The recording that is open.
    pub recording: Option<Arc<RecordedRun>>,
    /// Data in use.
    pub source: SourceChoice,
    /// Stretch chosen for identification.
    pub stretch: Option<Stretch>,
    /// Models, oldest first.
    pub models: Vec<ModelEntry>,
    /// Number of the model in use.
    pub model_in_use: Option<u32>,
    /// Tuning in view.
    pub candidate: Option<Candidate>,
    /// Free time constants by rule, in seconds; absent: the rule's default.
    pub tau_c_s: BTreeMap<String, f64>,
    /// Objective and limits of the best gains.
    pub optimum: OptimumSettings,
    /// Tunings whose curves stay beside the one in view.
    pub compared: Vec<Candidate>,
    /// Overshoot of a setpoint step for which b is chosen, in percent; `None` leaves b as it is.
    pub overshoot_percent: Option<f64>,
    /// Ku and Pu of a test, in units of the rig's loop, for the rules that start from them; `None`: those of the model.
    pub ultimate: Option<Ultimate>,
}

impl Document {
    /// A fresh document on a rig.
    #[must_use]
    pub fn new(network: Arc<Network>) -> Self {
        Self {
            rig: RigSettings::new(network),
            log: None,
            roles: LogRoles::default(),
            recording: None,
            source: SourceChoice::Simulated,
            stretch: None,
            models: vec![],
            model_in_use: None,
            candidate: None,
            tau_c_s: BTreeMap::new(),
            optimum: OptimumSettings::default(),
            compared: vec![],
            overshoot_percent: None,
            ultimate: None,
        }
    }

    /// The model in use.
    #[must_use]
    pub fn model(&self) -> Option<&ModelEntry> {
        self.models.iter().find(|m| Some(m.number) == self.model_in_use)
    }
}
