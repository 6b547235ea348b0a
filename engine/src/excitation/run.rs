//! A test under way: it listens, moves, watches the limits and the time, and keeps the record.

use super::error::ExcitationError;
use super::listening::{Base, Listening};
use super::progress::{Circumstances, Drive, Envelope, Phase, Progress, Restore};
use super::report::{Ending, ExcitationReport, Finding, Record};
use super::signal::{Ground, Heard, Machine, Order, State};
use super::spec::{AtRest, Excitation, Signal, StepEnd};
use super::stop::StopReason;
use crate::control::{Limits, Mode};

/// Deviation of the PV that means something without noise, as a share of 1 + |PV|.
const LEAST: f64 = 1e-6;
/// Rounding of limits and times.
const ROUNDING: f64 = 1e-9;

#[derive(Debug, Clone)]
enum Stage {
    Listening(Listening),
    Driving { machine: Box<Machine>, since_s: f64 },
    Over(State),
}

/// A test under way. Step it once a sample, before the loop, and tell it afterwards what was written.
#[derive(Debug, Clone)]
pub struct ExcitationRun {
    excitation: Excitation,
    start: Circumstances,
    envelope: Envelope,
    stage: Stage,
    base: Option<Base>,
    now_s: f64,
    rows: usize,
    record: Record,
    waiting: Option<(f64, f64)>,
    ending: Option<Ending>,
    finding: Finding,
    moved_at_s: Option<f64>,
    /// Made at the start, so that the last sample of listening allocates nothing.
    prepared: Option<Box<Machine>>,
}

impl ExcitationRun {
    /// Checks a description and the loop it is for, and reserves what the samples need.
    ///
    /// # Errors
    /// [`ExcitationError`] with the numbers; nothing has been moved.
    pub fn start(excitation: &Excitation, at: Circumstances) -> Result<Self, ExcitationError> {
        excitation.check(&at.tag, at.sample_time_s)?;
        let envelope = envelope(excitation, &at);
        if let Some(pv) = at.pv {
            if !pv.is_finite() {
                return Err(ExcitationError::NoPv { tag: at.tag });
            }
            let Limits { low, high } = envelope.pv;
            if !(low..=high).contains(&pv) {
                return Err(ExcitationError::PvOutside { tag: at.tag, pv, low, high });
            }
        }
        room(excitation, &at, &envelope, at.mv, at.setpoint)?;
        let rows = (excitation.budget_s / at.sample_time_s).ceil() as usize + 2;
        let heard = (excitation.listen_s / at.sample_time_s).round() as usize;
        let silent = Base { pv: 0.0, mv: 0.0, deviation_sd: 0.0, noise_sd: 0.0, moved: 0.0, noise_band: 0.0 };
        let ground = ground(&envelope, &silent, at.sample_time_s, rows);
        Ok(Self {
            stage: Stage::Listening(Listening::new(heard)),
            prepared: Some(Box::new(Machine::new(&excitation.signal, &ground))),
            record: Record::with_rows(rows),
            now_s: at.time_s,
            excitation: excitation.clone(),
            start: at,
            envelope,
            base: None,
            rows,
            waiting: None,
            ending: None,
            finding: Finding::Nothing,
            moved_at_s: None,
        })
    }

    /// Tag of its loop.
    #[must_use]
    pub fn tag(&self) -> &str {
        &self.start.tag
    }

    /// Its description.
    #[must_use]
    pub fn excitation(&self) -> &Excitation {
        &self.excitation
    }

    /// What it keeps to.
    #[must_use]
    pub fn envelope(&self) -> Envelope {
        self.envelope
    }

    /// How it ended, once it has.
    #[must_use]
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// Takes a sample: time in seconds, PV, and the output in force since the sample before. Allocates nothing.
    pub fn step(&mut self, time_s: f64, pv: f64, mv: f64) -> Drive {
        if self.ending.is_some() {
            return Drive::Leave;
        }
        self.now_s = time_s;
        if !(pv.is_finite() && mv.is_finite()) {
            self.stop(StopReason::PvLost);
            return Drive::Leave;
        }
        self.waiting = Some((time_s, pv));
        let Limits { low, high } = self.envelope.pv;
        if !(low..=high).contains(&pv) {
            self.stop(StopReason::PvLimit { pv, low, high });
            return Drive::Leave;
        }
        if time_s - self.start.time_s >= self.excitation.budget_s - ROUNDING {
            self.stop(StopReason::Budget { budget_s: self.excitation.budget_s });
            return Drive::Leave;
        }
        if let Stage::Listening(listening) = &mut self.stage {
            match listening.push(pv, mv) {
                Some(base) => self.heard(base, time_s),
                None => return Drive::Leave,
            }
        }
        self.drive(time_s, pv, mv)
    }

    fn drive(&mut self, time_s: f64, pv: f64, mv: f64) -> Drive {
        let (Some(base), Stage::Driving { machine, since_s }) = (self.base, &mut self.stage) else {
            return Drive::Leave;
        };
        let heard = Heard { t_s: time_s - *since_s, y: pv - base.pv, u: mv - base.mv };
        match machine.step(heard) {
            Order::Move(by) => {
                self.moved_at_s.get_or_insert(time_s);
                match self.excitation.signal {
                    Signal::SetpointStep { .. } => Drive::Setpoint(self.setpoint_at_rest() + by),
                    _ => Drive::Output(self.envelope.mv.clamp(base.mv + by)),
                }
            }
            Order::NoOscillation(gain) => {
                self.stop(StopReason::NoOscillation { gain });
                Drive::Leave
            }
            Order::Done => {
                self.finding = machine.finding();
                self.end(Ending::Finished);
                Drive::Leave
            }
        }
    }

    /// Listening is over: the loop has to be at rest, with room about it.
    fn heard(&mut self, base: Base, now_s: f64) {
        self.base = Some(base);
        let range = self.start.pv_range.high - self.start.pv_range.low;
        let band = base.rest_band(range);
        if self.excitation.at_rest == AtRest::Required && base.moved.abs() > band {
            let listen_s = self.excitation.listen_s;
            return self.stop(StopReason::NotAtRest { listen_s, moved: base.moved, band });
        }
        if let Err(error) =
            room(&self.excitation, &self.start, &self.envelope, base.mv, self.setpoint_at_rest())
        {
            return self.stop(StopReason::NoRoom(error));
        }
        let Some(mut machine) = self.prepared.take() else { return };
        machine.learn(&ground(&self.envelope, &base, self.start.sample_time_s, self.rows));
        self.stage = Stage::Driving { machine, since_s: now_s };
    }

    /// Setpoint that a step of it starts from: that of a loop in automatic, the PV at rest of any other.
    fn setpoint_at_rest(&self) -> f64 {
        match (self.start.mode, self.base) {
            (Mode::Automatic, _) | (_, None) => self.start.setpoint,
            (_, Some(base)) => base.pv,
        }
    }

    /// Takes what was written in the sample, setpoint and output after all limits.
    pub fn applied(&mut self, setpoint: f64, mv: f64) {
        if let Some((time_s, pv)) = self.waiting.take() {
            self.record.push(time_s, pv, setpoint, mv);
        }
    }

    /// Ends it with a reason; one that has ended keeps its own.
    pub fn stop(&mut self, reason: StopReason) {
        self.end(Ending::Stopped(reason));
    }

    fn end(&mut self, ending: Ending) {
        if self.ending.is_none() {
            self.stage = Stage::Over(self.state());
            self.ending = Some(ending);
        }
    }

    /// What has to be put back now that it has ended.
    #[must_use]
    pub fn restore(&self) -> Restore {
        let Some(base) = self.base.filter(|_| self.moved_at_s.is_some()) else { return Restore::default() };
        let manual = self.start.mode == Mode::Manual;
        let before = if manual { self.start.mv } else { base.mv };
        let finished = self.ending == Some(Ending::Finished);
        match self.excitation.signal {
            Signal::SetpointStep { size, end, .. } => {
                let stays = finished && end == StepEnd::Stay && !manual;
                let from = if self.start.mode == Mode::Automatic { self.start.setpoint } else { base.pv };
                let setpoint = if stays { from + size } else { self.start.setpoint };
                Restore { output: manual.then_some(before), setpoint: Some(setpoint) }
            }
            Signal::Step { size, end: StepEnd::Stay, .. } if finished => {
                let output = Some(self.envelope.mv.clamp(before + size));
                Restore { output, setpoint: None }
            }
            _ => Restore { output: Some(before), setpoint: None },
        }
    }

    fn state(&self) -> State {
        match &self.stage {
            Stage::Listening(listening) => {
                State { fraction: Some(listening.fraction()), ..State::of(Phase::Listening) }
            }
            Stage::Driving { machine, .. } => machine.state(),
            Stage::Over(state) => State { phase: Phase::Ended, ..*state },
        }
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let State { phase, fraction, cycle, of, period_s, amplitude } = self.state();
        let elapsed_s = self.now_s - self.start.time_s;
        let budget_s = self.excitation.budget_s;
        Progress { phase, fraction, cycle, of, period_s, amplitude, elapsed_s, budget_s }
    }

    /// What came of it.
    #[must_use]
    pub fn into_report(self) -> ExcitationReport {
        let base = self.base;
        ExcitationReport {
            tag: self.start.tag,
            excitation: self.excitation,
            envelope: self.envelope,
            start_s: self.start.time_s,
            moved_at_s: self.moved_at_s,
            ending: self.ending.unwrap_or(Ending::Stopped(StopReason::Operator)),
            pv_at_rest: base.map(|b| b.pv),
            mv_at_rest: base.map(|b| b.mv),
            noise_sd: base.map(|b| b.noise_sd),
            deviation_sd: base.map(|b| b.deviation_sd),
            finding: self.finding,
            record: self.record,
        }
    }
}

fn ground(envelope: &Envelope, base: &Base, sample_time_s: f64, rows: usize) -> Ground {
    Ground {
        base: *base,
        sample_time_s,
        room: [envelope.mv.low - base.mv, envelope.mv.high - base.mv],
        least: LEAST * (1.0 + base.pv.abs()),
        rows,
    }
}

/// The limits of the loop and its sensor, narrowed by those of the description.
fn envelope(excitation: &Excitation, at: &Circumstances) -> Envelope {
    let narrowed = |range: Limits, low: Option<f64>, high: Option<f64>| Limits {
        low: low.map_or(range.low, |low| low.max(range.low)),
        high: high.map_or(range.high, |high| high.min(range.high)),
    };
    let limits = &excitation.limits;
    let mut mv = narrowed(at.mv_limits, limits.mv_low, limits.mv_high);
    // Ends that cross leave no room, which is said before anything is clamped between them.
    mv.high = mv.high.max(mv.low);
    Envelope { pv: narrowed(at.pv_range, limits.pv_low, limits.pv_high), mv }
}

/// Whether the signal finds room about an output and a setpoint.
fn room(
    excitation: &Excitation,
    at: &Circumstances,
    envelope: &Envelope,
    mv: f64,
    setpoint: f64,
) -> Result<(), ExcitationError> {
    let tag = || at.tag.clone();
    if let Signal::SetpointStep { size, .. } = excitation.signal {
        let Limits { low, high } = envelope.pv;
        let setpoint = setpoint + size;
        let inside = (low..=high).contains(&setpoint);
        return if inside {
            Ok(())
        } else {
            Err(ExcitationError::Setpoint { tag: tag(), setpoint, low, high })
        };
    }
    let [down, up] = excitation.signal.reach();
    let (from, to) = (mv + down, mv + up);
    let Limits { low, high } = envelope.mv;
    let slack = ROUNDING * (1.0 + high.abs());
    if from >= low - slack && to <= high + slack {
        return Ok(());
    }
    Err(ExcitationError::Margin { tag: tag(), from, to, low, high })
}
