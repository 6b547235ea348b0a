//! Tests on a running loop: they go over it and leave it as it was.
//!
//! While one runs, mode, setpoint, law, tuning and options of the loop stay what the operator chose; a [`Forced`] value
//! goes before them sample by sample, and the law follows as in manual. To end a test is to take that value away,
//! and to put the output (or the setpoint) back where it was: there is nothing else to restore.
//!
//! The operator goes before a test. A command to its loop that is possible ends it first and is carried out
//! then, whichever it is; one that is refused changes nothing, and the test goes on.

use super::active_loop::{Forced, LoopTarget};
use super::closed_loop::ClosedLoop;
use crate::control::{Limits, Mode};
use crate::excitation::{
    Circumstances, Drive, Envelope, Excitation, ExcitationError, ExcitationReport, ExcitationRun, Progress,
    Restore, StopReason,
};
use crate::plant::ReadingStatus;
use crate::session::{CommandError, RigCommand};

/// The test that runs, with its loop's index.
pub(super) struct Excited {
    pub index: usize,
    pub run: ExcitationRun,
}

/// The test that runs, as a view needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationNow {
    /// Tag of its loop.
    pub tag: String,
    /// Its signal, as files name it.
    pub signal: &'static str,
    /// What it keeps to.
    pub envelope: Envelope,
    /// How far it is.
    pub progress: Progress,
}

impl ClosedLoop {
    /// How far the test that runs is.
    #[must_use]
    pub fn excitation_progress(&self) -> Option<Progress> {
        self.excited.as_ref().map(|e| e.run.progress())
    }

    /// The test that runs.
    #[must_use]
    pub fn excitation(&self) -> Option<ExcitationNow> {
        let run = &self.excited.as_ref()?.run;
        Some(ExcitationNow {
            tag: run.tag().to_owned(),
            signal: run.excitation().signal.key(),
            envelope: run.envelope(),
            progress: run.progress(),
        })
    }

    /// Tests that ended since the last call, in that order.
    pub fn ended_excitations(&mut self) -> impl Iterator<Item = ExcitationReport> + '_ {
        self.ended.drain(..).map(|e| e.run.into_report())
    }

    /// Whether there are any.
    #[must_use]
    pub fn has_ended_excitations(&self) -> bool {
        !self.ended.is_empty()
    }

    pub(super) fn excite(&mut self, tag: &str, excitation: &Excitation) -> Result<(), CommandError> {
        if let Some(running) = &self.excited {
            return Err(ExcitationError::Busy { tag: running.run.tag().to_owned() }.into());
        }
        self.find(tag)?;
        let index = self.loops.iter().position(|l| l.spec.id == tag).unwrap_or_default();
        let active = &self.loops[index];
        if let LoopTarget::Loop(inner) = active.target
            && !self.loops[inner].listens()
        {
            let inner = self.loops[inner].spec.id.clone();
            return Err(CommandError::Follows { tag: tag.to_owned(), inner });
        }
        let sensor = &self.network.sensors[active.sensor];
        let rim_cm = self.network.tanks[sensor.tank].height_cm;
        let [low, high] = sensor.spec.range_cm.unwrap_or([0.0, rim_cm]);
        let reading = self.readings[active.sensor];
        let pv_cm = if reading.status == ReadingStatus::Broken { f64::NAN } else { reading.level_cm };
        let at = Circumstances {
            tag: tag.to_owned(),
            time_s: self.time_s(),
            sample_time_s: self.sample_time_s(),
            pv: (self.samples > 0).then_some(pv_cm),
            pv_range: Limits { low, high },
            setpoint: active.control.setpoint_cm,
            mv: active.control.mv(),
            mv_limits: active.control.limits(),
            mode: active.control.mode,
        };
        let run = ExcitationRun::start(excitation, at)?;
        // So that its end needs no memory.
        self.ended.reserve(1);
        self.excited = Some(Excited { index, run });
        Ok(())
    }

    pub(super) fn abort_excitation(&mut self, tag: &str) -> Result<(), CommandError> {
        self.find(tag)?;
        if self.excited.as_ref().is_none_or(|e| e.run.tag() != tag) {
            return Err(ExcitationError::NotRunning { tag: tag.to_owned() }.into());
        }
        self.stop_excitation(StopReason::Operator);
        Ok(())
    }

    /// Ends the test that runs, if one does, and puts its loop back.
    pub fn stop_excitation(&mut self, reason: StopReason) {
        if let Some(excited) = &mut self.excited {
            excited.run.stop(reason);
            self.put_back();
        }
    }

    /// Before the loops take a sample: what the test has its loop do.
    pub(super) fn excite_sample(&mut self) {
        let time_s = self.time_s();
        let Some(Excited { index, run }) = &mut self.excited else { return };
        let active = &self.loops[*index];
        let reading = self.readings[active.sensor];
        if let LoopTarget::Loop(inner) = active.target
            && !self.loops[inner].listens()
        {
            run.stop(StopReason::Unlinked);
        }
        if matches!(reading.status, ReadingStatus::BelowRange | ReadingStatus::AboveRange) {
            // A signal at the end of its range says only that the level is beyond it.
            let Limits { low, high } = run.envelope().pv;
            run.stop(StopReason::PvLimit { pv: reading.level_cm, low, high });
        }
        let pv_cm = if reading.status == ReadingStatus::Broken { f64::NAN } else { reading.level_cm };
        let mv = active.control.mv();
        let forced = match run.step(time_s, pv_cm, mv) {
            Drive::Leave => None,
            Drive::Output(mv) => Some(Forced::Output(mv)),
            Drive::Setpoint(setpoint_cm) => Some(Forced::Setpoint(setpoint_cm)),
        };
        let ended = run.ending().is_some();
        self.loops[*index].forced = forced;
        if ended {
            self.put_back();
        }
    }

    /// After the loops took a sample: what was written.
    pub(super) fn record_excitation(&mut self) {
        // One that ended in this sample has its last row to come.
        if let Some(Excited { index, run }) = self.excited.as_mut().or(self.ended.last_mut())
            && let Some(active) = self.loops.get(*index)
        {
            run.applied(active.control.setpoint_cm, active.control.mv());
        }
    }

    /// Takes an ended test off its loop and puts back what it moved.
    fn put_back(&mut self) {
        let Some(excited) = self.excited.take() else { return };
        self.release(excited.index, excited.run.restore());
        self.ended.push(excited);
    }

    /// Lets a loop do again what its mode and its law say, from the values before the test.
    fn release(&mut self, index: usize, restore: Restore) {
        let Some(active) = self.loops.get_mut(index) else { return };
        active.forced = None;
        if let Some(mv) = restore.output {
            active.put_to(mv);
        }
        if let Some(setpoint_cm) = restore.setpoint {
            active.control.setpoint_cm = setpoint_cm;
            if active.control.mode == Mode::Automatic {
                active.spec.setpoint_cm = setpoint_cm;
            }
        }
        let (outer, setpoint_cm) = (active.outer, active.control.setpoint_cm);
        // What gives its setpoint again goes on from there.
        if let Some(outer) = outer
            && self.loops[index].listens()
        {
            self.loops[outer].control.set_mv(setpoint_cm);
        }
    }

    /// Why a command ends the test that runs; `None` for one that has nothing to do with it.
    pub(super) fn overrules(&self, command: &RigCommand) -> Option<StopReason> {
        let excited = self.excited.as_ref()?;
        let active = &self.loops[excited.index];
        let of_loop = |tag: &String| {
            let reason = StopReason::Overruled { command: command.key() };
            (*tag == active.spec.id).then_some(reason)
        };
        match command {
            RigCommand::Mv { tag, .. } => {
                let pump = self.network.pump(tag).map(LoopTarget::Pump);
                if pump == Some(active.target) { of_loop(&active.spec.id) } else { of_loop(tag) }
            }
            RigCommand::Setpoint { tag, .. }
            | RigCommand::Mode { tag, .. }
            | RigCommand::Tuning { tag, .. }
            | RigCommand::Law { tag, .. }
            | RigCommand::Options { tag, .. }
            | RigCommand::PvFilter { tag, .. } => of_loop(tag),
            RigCommand::Configuration { .. } => Some(StopReason::Configuration),
            RigCommand::SteadyAt { .. } => Some(StopReason::Restarted),
            RigCommand::Excite { .. }
            | RigCommand::AbortExcitation { .. }
            | RigCommand::Valve { .. }
            | RigCommand::Bump { .. }
            | RigCommand::Measurement { .. }
            | RigCommand::Seed { .. }
            | RigCommand::Fault { .. }
            | RigCommand::Repair { .. } => None,
        }
    }

    /// Carries out a command to a loop whose test it ends; when it is refused, the test goes on.
    pub(super) fn apply_overruling(
        &mut self,
        command: &RigCommand,
        reason: StopReason,
    ) -> Result<(), CommandError> {
        let Some(mut excited) = self.excited.take() else { return self.carry_out(command) };
        let kept = self.loops.clone();
        self.release(excited.index, excited.run.restore());
        let done = self.carry_out(command);
        if done.is_ok() {
            excited.run.stop(reason);
            self.ended.push(excited);
        } else {
            self.loops = kept;
            self.excited = Some(excited);
        }
        done
    }
}
