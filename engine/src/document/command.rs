//! Changes of the document.

use std::sync::Arc;

use super::data::{
    Candidate, Document, FittedRows, LogRoles, LoopSettings, ModelEntry, ModelOrigin, OptimumSettings,
    RigSettings, SourceChoice, Stretch,
};
use super::error::DocumentError;
use crate::control::{GainsError, Law, LoopOptions, LoopSpec, Mode, PidTuning, check_filter, check_loop};
use crate::identify::{LoopStudy, ModelFit};
use crate::model::ProcessModel;
use crate::plant::{Measurement, Network, RigError};
use crate::session::{CommandError, RecordedRun};
use crate::signal::LogTable;
use crate::tune::Ultimate;

/// Tunings compared at a time: more curves than these cannot be told apart.
const MOST_COMPARED: usize = 4;

/// A tuning with what goes along with it when a loop takes it over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Applied {
    /// Gains and weights.
    pub tuning: PidTuning,
    /// Time constant of the PV filter in seconds.
    pub pv_filter_s: f64,
    /// Time constant of the filter on the setpoint in seconds.
    pub setpoint_filter_s: f64,
}

/// A change of the document.
#[derive(Debug, Clone)]
pub enum DocumentCommand {
    /// Another rig, as its file has it.
    OpenRig(Arc<Network>),
    /// Another configuration of the rig.
    Configuration(usize),
    /// Setpoint of a loop in cm.
    Setpoint(String, f64),
    /// Mode of a loop.
    Mode(String, Mode),
    /// Tuning of a loop.
    Tuning(String, PidTuning),
    /// PV filter of a loop in seconds.
    PvFilter(String, f64),
    /// Tuning, filter of the PV and filter of the setpoint of a loop together, as one step of the history.
    ApplyTuning(String, Applied),
    /// Law of a loop with its settings.
    Law(String, Law),
    /// What stands around the law of a loop, all of it.
    Options(String, Box<LoopOptions>),
    /// Angle of a valve in degrees.
    Angle(String, f64),
    /// Imperfections of the simulated rig.
    Measurement(Measurement),
    /// Seed of the noise.
    Seed(u64),
    /// A log was imported, with the columns proposed.
    OpenLog(Arc<LogTable>, LogRoles),
    /// A recording was opened: its rig as it was set, its models, and the recording as source.
    OpenRecording(Arc<RecordedRun>),
    /// Columns of the log.
    Roles(LogRoles),
    /// Data in use.
    Source(SourceChoice),
    /// Stretch for identification.
    Stretch(Option<Stretch>),
    /// A model was fitted or typed; it becomes the one in use.
    AddModel(Box<NewModel>),
    /// Another model of the list.
    UseModel(u32),
    /// A model is struck off the list.
    RemoveModel(u32),
    /// A tuning to look at.
    Candidate(Option<Candidate>),
    /// Free time constant of a rule in seconds; `None` for its default.
    TauC(String, Option<f64>),
    /// Objective and limits of the best gains.
    Optimum(OptimumSettings),
    /// The curves of a tuning stay beside the one in view, or no longer do.
    Compare(Candidate),
    /// Overshoot of a setpoint step in percent for which b is chosen; `None` for none.
    Overshoot(Option<f64>),
    /// Ku and Pu of a test for the rules that start from them; `None` for those of the model.
    Ultimate(Option<Ultimate>),
}

/// A model that joins the list.
#[derive(Debug, Clone)]
pub struct NewModel {
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
    /// Unit of its PV.
    pub pv_unit: String,
    /// Unit of its MV.
    pub mv_unit: String,
}

impl DocumentCommand {
    /// Key under `change.` in the translation files, for the history.
    #[must_use]
    pub fn key(&self) -> &'static str {
        match self {
            Self::OpenRig(_) => "open_rig",
            Self::Configuration(_) => "configuration",
            Self::Setpoint(..) => "setpoint",
            Self::Mode(..) => "mode",
            Self::Tuning(..) | Self::ApplyTuning(..) => "tuning",
            Self::PvFilter(..) => "pv_filter",
            Self::Law(..) => "law",
            Self::Options(..) => "options",
            Self::Angle(..) => "angle",
            Self::Measurement(_) => "measurement",
            Self::Seed(_) => "seed",
            Self::OpenLog(..) => "open_log",
            Self::OpenRecording(_) => "open_recording",
            Self::Roles(_) => "roles",
            Self::Source(_) => "source",
            Self::Stretch(_) => "stretch",
            Self::AddModel(_) => "add_model",
            Self::UseModel(_) => "use_model",
            Self::RemoveModel(_) => "remove_model",
            Self::Candidate(_) => "candidate",
            Self::TauC(..) => "tau_c",
            Self::Optimum(_) => "optimum",
            Self::Compare(_) => "compare",
            Self::Overshoot(_) => "overshoot",
            Self::Ultimate(_) => "ultimate",
        }
    }

    /// Whether it changes how the rig or one of its loops is set.
    fn changes_rig(&self) -> bool {
        matches!(
            self,
            Self::Configuration(_)
                | Self::Setpoint(..)
                | Self::Mode(..)
                | Self::Tuning(..)
                | Self::ApplyTuning(..)
                | Self::PvFilter(..)
                | Self::Law(..)
                | Self::Options(..)
                | Self::Angle(..)
                | Self::Measurement(_)
                | Self::Seed(_)
        )
    }

    /// Changes that follow each other with the same thread become one step of the history.
    #[must_use]
    pub fn thread(&self) -> Option<String> {
        match self {
            Self::Setpoint(tag, _)
            | Self::Angle(tag, _)
            | Self::TauC(tag, _)
            | Self::Tuning(tag, _)
            | Self::Law(tag, _)
            | Self::Options(tag, _)
            | Self::PvFilter(tag, _) => Some(format!("{} {tag}", self.key())),
            Self::Stretch(_) | Self::Candidate(_) | Self::Optimum(_) | Self::Overshoot(_) => {
                Some(self.key().to_owned())
            }
            _ => None,
        }
    }
}

impl Document {
    /// The document after a change.
    ///
    /// # Errors
    /// [`DocumentError`]; the document is as before.
    pub fn after(&self, command: &DocumentCommand) -> Result<Self, DocumentError> {
        let mut next = self.clone();
        if self.source == SourceChoice::Replay && command.changes_rig() {
            return Err(CommandError::Replay.into());
        }
        match command {
            DocumentCommand::OpenRig(network) => {
                next.rig = RigSettings::new(network.clone());
                if next.source == SourceChoice::Replay {
                    next.source = SourceChoice::Simulated;
                }
            }
            DocumentCommand::Configuration(index) => {
                if *index >= self.rig.network.spec.configurations.len() {
                    return Err(CommandError::UnknownTag { tag: index.to_string() }.into());
                }
                next.rig.configure(*index);
            }
            DocumentCommand::Setpoint(..)
            | DocumentCommand::Mode(..)
            | DocumentCommand::Tuning(..)
            | DocumentCommand::Law(..)
            | DocumentCommand::Options(..)
            | DocumentCommand::PvFilter(..)
            | DocumentCommand::ApplyTuning(..) => next.change_loop(command)?,
            DocumentCommand::Angle(tag, angle_deg) => next.turn(tag, *angle_deg)?,
            DocumentCommand::Measurement(measurement) => next.rig.measurement = *measurement,
            DocumentCommand::Seed(seed) => next.rig.seed = *seed,
            DocumentCommand::OpenLog(log, roles) => {
                next.log = Some(log.clone());
                next.roles = *roles;
                next.source = SourceChoice::Log;
                next.stretch = None;
            }
            DocumentCommand::OpenRecording(run) => next.open_recording(run),
            DocumentCommand::Roles(roles) => {
                if roles.pv.is_some() && roles.pv == roles.mv {
                    return Err(DocumentError::SameColumn);
                }
                next.roles = *roles;
            }
            DocumentCommand::Source(source) => {
                next.source = *source;
                next.stretch = None;
            }
            DocumentCommand::Stretch(stretch) => {
                if let Some(Stretch { from_s, to_s }) = *stretch
                    && (!from_s.is_finite() || !to_s.is_finite() || to_s <= from_s)
                {
                    return Err(DocumentError::EmptyStretch { from_s, to_s });
                }
                next.stretch = *stretch;
            }
            DocumentCommand::AddModel(new) => next.add_model(new),
            DocumentCommand::UseModel(number) => {
                if next.models.iter().any(|m| m.number == *number) {
                    next.model_in_use = Some(*number);
                }
            }
            DocumentCommand::RemoveModel(number) => {
                next.models.retain(|m| m.number != *number);
                if next.model_in_use == Some(*number) {
                    next.model_in_use = next.models.last().map(|m| m.number);
                }
            }
            DocumentCommand::Candidate(_)
            | DocumentCommand::TauC(..)
            | DocumentCommand::Optimum(_)
            | DocumentCommand::Compare(_)
            | DocumentCommand::Overshoot(_)
            | DocumentCommand::Ultimate(_) => next.change_tuning(command)?,
        }
        Ok(next)
    }

    /// Carries out a command about what is tuned for and looked at; others change nothing.
    fn change_tuning(&mut self, command: &DocumentCommand) -> Result<(), DocumentError> {
        match command {
            DocumentCommand::Candidate(candidate) => self.candidate.clone_from(candidate),
            DocumentCommand::TauC(rule, Some(value)) => {
                if !(value.is_finite() && *value > 0.0) {
                    return Err(DocumentError::TauC { value: *value });
                }
                self.tau_c_s.insert(rule.clone(), *value);
            }
            DocumentCommand::Optimum(settings) => {
                settings.limits.validated().map_err(DocumentError::Optimum)?;
                self.optimum = *settings;
            }
            DocumentCommand::Compare(candidate) => self.compare(candidate),
            DocumentCommand::Overshoot(percent) => {
                if let Some(value) = percent.filter(|v| !(0.0..=100.0).contains(v)) {
                    return Err(DocumentError::Overshoot { value });
                }
                self.overshoot_percent = *percent;
            }
            DocumentCommand::Ultimate(ultimate) => {
                self.ultimate =
                    ultimate.map(Ultimate::validated).transpose().map_err(DocumentError::Ultimate)?;
            }
            DocumentCommand::TauC(rule, None) => {
                self.tau_c_s.remove(rule);
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes a tuning in among those compared, the oldest making room, or out again.
    fn compare(&mut self, candidate: &Candidate) {
        if self.compared.contains(candidate) {
            self.compared.retain(|c| c != candidate);
            return;
        }
        if self.compared.len() >= MOST_COMPARED {
            self.compared.remove(0);
        }
        self.compared.push(candidate.clone());
    }

    fn open_recording(&mut self, run: &Arc<RecordedRun>) {
        self.rig = RigSettings::recorded(run);
        self.recording = Some(run.clone());
        self.source = SourceChoice::Replay;
        self.stretch = None;
        for recorded in &run.models {
            self.add_model(&NewModel {
                model: recorded.model.clone(),
                origin: ModelOrigin::Recording { name: run.name.clone() },
                fit: None,
                study: None,
                rows: None,
                pv_unit: recorded.pv_unit.clone(),
                mv_unit: recorded.mv_unit.clone(),
            });
        }
    }

    /// Carries out a command for one loop; others change nothing.
    fn change_loop(&mut self, command: &DocumentCommand) -> Result<(), DocumentError> {
        match command {
            DocumentCommand::Setpoint(tag, level_cm) => {
                self.check_setpoint(tag, *level_cm)?;
                let settings = self.settings(tag)?;
                if settings.mode == Mode::Cascade {
                    return Err(CommandError::Cascade { tag: tag.clone() }.into());
                }
                settings.setpoint_cm = *level_cm;
            }
            DocumentCommand::Mode(tag, mode) => self.set_loop(tag, |l| l.mode = *mode)?,
            DocumentCommand::Tuning(tag, tuning) => {
                tuning.validated(&self.settings(tag)?.law).map_err(CommandError::from)?;
                self.set_loop(tag, |l| l.tuning = *tuning)?;
            }
            DocumentCommand::Law(tag, law) => self.set_loop(tag, |l| l.law = *law)?,
            DocumentCommand::Options(tag, options) => {
                self.set_loop(tag, |l| l.options.clone_from(options))?;
            }
            DocumentCommand::PvFilter(tag, filter_s) => {
                self.settings(tag)?.pv_filter_s = check_filter(*filter_s).map_err(CommandError::from)?;
            }
            DocumentCommand::ApplyTuning(tag, applied) => {
                let usable = |e: GainsError| CommandError::from(e);
                applied.tuning.validated(&self.settings(tag)?.law).map_err(usable)?;
                let pv_filter_s = check_filter(applied.pv_filter_s).map_err(usable)?;
                self.set_loop(tag, |l| {
                    (l.tuning, l.pv_filter_s) = (applied.tuning, pv_filter_s);
                    l.options.setpoint.filter_s = applied.setpoint_filter_s;
                })?;
            }
            _ => {}
        }
        Ok(())
    }

    fn settings(&mut self, tag: &str) -> Result<&mut LoopSettings, DocumentError> {
        let unknown = || CommandError::UnknownTag { tag: tag.to_owned() };
        self.rig.loops.get_mut(tag).ok_or_else(|| unknown().into())
    }

    /// Changes the settings of a loop when its rig allows it.
    fn set_loop(&mut self, tag: &str, change: impl FnOnce(&mut LoopSettings)) -> Result<(), DocumentError> {
        change(self.settings(tag)?);
        let network = self.rig.network.clone();
        let active = network.spec.configurations.get(self.rig.configuration);
        let has = |loops: &[LoopSpec]| loops.iter().any(|l| l.id == tag);
        // The same tag may be wired differently in other configurations: the present one counts.
        let only_active = active.is_some_and(|c| has(&c.loops));
        for (place, configuration) in network.spec.configurations.iter().enumerate() {
            let Some(index) = configuration.loops.iter().position(|l| l.id == tag) else { continue };
            if only_active && place != self.rig.configuration {
                continue;
            }
            let mut specs: Vec<LoopSpec> = configuration.loops.clone();
            if let Some(settings) = self.rig.loops.get(tag) {
                settings.put_into(&mut specs[index]);
            }
            check_loop(&network, &specs, &specs[index]).map_err(CommandError::from)?;
        }
        Ok(())
    }

    fn check_setpoint(&self, tag: &str, level_cm: f64) -> Result<(), DocumentError> {
        let network = &self.rig.network;
        let loops = network.spec.configurations.iter().flat_map(|c| &c.loops);
        let Some(sensor) = loops.into_iter().find(|l| l.id == tag).and_then(|l| network.sensor(&l.sensor))
        else {
            return Err(CommandError::UnknownTag { tag: tag.to_owned() }.into());
        };
        let rim_cm = network.tanks[network.sensors[sensor].tank].height_cm;
        if (0.0..=rim_cm).contains(&level_cm) {
            Ok(())
        } else {
            Err(CommandError::Setpoint { tag: tag.to_owned(), level_cm, rim_cm }.into())
        }
    }

    fn turn(&mut self, tag: &str, angle_deg: f64) -> Result<(), DocumentError> {
        let valve = self.rig.network.valve(tag);
        let valve = valve.ok_or_else(|| CommandError::UnknownTag { tag: tag.to_owned() })?;
        if !(0.0..=90.0).contains(&angle_deg) {
            let (item, expected) = (tag.to_owned(), "0…90".to_owned());
            let error = RigError::Value { item, field: "angle_deg", value: angle_deg, expected };
            return Err(CommandError::from(error).into());
        }
        self.rig.angles_deg[valve] = angle_deg;
        Ok(())
    }

    fn add_model(&mut self, new: &NewModel) {
        let number = self.models.iter().map(|m| m.number).max().unwrap_or(0) + 1;
        let NewModel { model, origin, fit, study, rows, pv_unit, mv_unit } = new.clone();
        self.models.push(ModelEntry { number, model, origin, fit, study, rows, pv_unit, mv_unit });
        self.model_in_use = Some(number);
        self.candidate = None;
        self.compared.clear();
    }
}
