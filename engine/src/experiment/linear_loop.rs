//! A control law at its sample time on a linear process.

use serde::{Deserialize, Serialize};

use super::error::RunError;
use super::outcome::{RunColumn, TimedColumns};
use crate::control::{
    ControlLoop, FormGains, Law, LoopInput, LoopOptions, LoopSpec, Mode, OutputRange, PidGains, PidTuning,
};
use crate::model::{HeldInput, ProcessModel};
use crate::plant::RigError;

/// A law, a process, and what happens to them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopRun {
    /// The process, at rest at 0.
    pub process: ProcessModel,
    /// h in seconds.
    pub sample_time_s: f64,
    /// Length in seconds.
    pub duration_s: f64,
    /// The law.
    #[serde(default)]
    pub law: Law,
    /// Gains; absent for on/off and for a loop that stays in manual.
    pub gains: Option<FormGains>,
    /// b, weight of the setpoint in the proportional part.
    #[serde(default = "one")]
    pub b: f64,
    /// c, weight of the setpoint in the derivative part.
    #[serde(default)]
    pub c: f64,
    /// Mode at the start.
    #[serde(default = "automatic")]
    pub mode: Mode,
    /// Setpoint at the start in PV units.
    #[serde(default)]
    pub setpoint: f64,
    /// Output at the start in MV units; before, it was 0.
    #[serde(default)]
    pub mv: f64,
    /// Lowest output.
    #[serde(default = "lowest")]
    pub low: f64,
    /// Highest output.
    #[serde(default = "highest")]
    pub high: f64,
    /// Time constant of the PV filter in seconds.
    #[serde(default)]
    pub pv_filter_s: f64,
    /// What stands around the law.
    #[serde(default)]
    pub options: LoopOptions,
    /// Unit of PV as shown.
    #[serde(default)]
    pub pv_unit: String,
    /// Unit of MV as shown.
    #[serde(default)]
    pub mv_unit: String,
    /// What happens, in any order.
    #[serde(rename = "event", default)]
    pub events: Vec<LoopEvent>,
}

/// What changes at a time; what is left out stays.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopEvent {
    /// Time in seconds; it acts from the first sample at or after it.
    pub at_s: f64,
    /// Setpoint in PV units.
    pub setpoint: Option<f64>,
    /// Load at the process input in MV units.
    pub load: Option<f64>,
    /// Mode.
    pub mode: Option<Mode>,
    /// Output in manual, in MV units.
    pub mv: Option<f64>,
    /// Gains.
    pub gains: Option<FormGains>,
    /// b.
    pub b: Option<f64>,
    /// c.
    pub c: Option<f64>,
}

fn one() -> f64 {
    1.0
}

fn automatic() -> Mode {
    Mode::Automatic
}

fn lowest() -> f64 {
    -1e9
}

fn highest() -> f64 {
    1e9
}

/// The process as its constructor would have it.
pub(super) fn checked(process: &ProcessModel) -> Result<ProcessModel, RunError> {
    let tf = process.transfer_function();
    Ok(ProcessModel::rational(&tf.num, &tf.den, tf.dead_time_s)?)
}

impl LoopRun {
    fn tuning(&self, gains: Option<&FormGains>, b: f64, c: f64) -> Result<PidTuning, RunError> {
        let gains = gains.map_or(Ok(PidGains::pi(1.0, 1.0)), FormGains::to_ideal)?;
        Ok(PidTuning { gains, b, c }.validated(&self.law)?)
    }

    fn demand(&self, field: &'static str, value: f64, ok: bool, expected: &str) -> Result<(), RigError> {
        let refusal =
            || RigError::Value { item: "loop".to_owned(), field, value, expected: expected.to_owned() };
        ok.then_some(()).ok_or_else(refusal)
    }

    /// The loop, checked as one of a rig is.
    fn control(&self) -> Result<ControlLoop, RunError> {
        let range = [self.low, self.high];
        self.demand("low", self.low, self.low < self.high, "below high")?;
        let manual = |mode: Mode| !mode.is_controlling();
        let idle = manual(self.mode) && self.events.iter().all(|e| e.mode.is_none_or(manual));
        let known = self.gains.is_some() || idle || !self.law.is_pid();
        self.demand("gains", f64::NAN, known, "given, except for on/off and a loop that stays in manual")?;
        self.law.check("loop", range)?;
        self.options.check("loop", &self.law, range)?;
        let pv_filter_s = crate::control::check_filter(self.pv_filter_s)?;
        let tuning = self.tuning(self.gains.as_ref(), self.b, self.c)?;
        let mut spec = LoopSpec {
            id: "loop".to_owned(),
            sensor: String::new(),
            pump: None,
            cascade_to: None,
            setpoint_cm: self.setpoint,
            mode: self.mode,
            kc: None,
            ti_s: None,
            td_s: 0.0,
            n: PidGains::DEFAULT_N,
            gains: None,
            b: self.b,
            c: self.c,
            pv_filter_s,
            law: self.law,
            options: self.options.clone(),
        };
        spec.set_tuning(tuning);
        let range = OutputRange { low: self.low, high: self.high, rate_per_s: f64::INFINITY };
        Ok(ControlLoop::new(&spec, self.sample_time_s, range, self.mv))
    }

    /// Runs it; `go_on` is asked with the share done, and `None` is what its no gives.
    pub(super) fn run(&self, go_on: &mut dyn FnMut(f64) -> bool) -> Result<Option<TimedColumns>, RunError> {
        let h = self.sample_time_s;
        let mut control = self.control()?;
        let mut process = HeldInput::new(&checked(&self.process)?, h);
        let mut events = self.events.clone();
        events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let tunings = self.tunings(&events)?;
        let mut pending = events.iter().zip(tunings).peekable();
        let count = (self.duration_s / h + 1e-9).floor() as usize + 1;
        let mut load = 0.0;
        let mut time_s = Vec::with_capacity(count);
        let mut values: [Vec<f64>; 4] = std::array::from_fn(|_| Vec::with_capacity(count));
        for k in 0..count {
            if k % 4096 == 0 && !go_on(k as f64 / count as f64) {
                return Ok(None);
            }
            let now_s = k as f64 * h;
            while let Some((event, tuning)) = pending.next_if(|(e, _)| e.at_s <= now_s + 1e-9) {
                load = event.load.unwrap_or(load);
                control.setpoint_cm = event.setpoint.unwrap_or(control.setpoint_cm);
                control.mode = event.mode.unwrap_or(control.mode);
                control.set_tuning(tuning);
                if let Some(mv) = event.mv {
                    control.set_mv(mv);
                }
            }
            let pv_cm = process.output();
            let input = LoopInput { pv_cm, disturbance: load, actual: control.mode, blocked: None };
            control.update(&input);
            let mv = control.mv();
            process.advance(mv + load);
            time_s.push(now_s);
            for (column, value) in values.iter_mut().zip([control.setpoint_cm, pv_cm, mv, load]) {
                column.push(value);
            }
        }
        let units = [&self.pv_unit, &self.pv_unit, &self.mv_unit, &self.mv_unit];
        let columns = ["sp", "pv", "mv", "load"].into_iter().zip(units).zip(values);
        let columns = columns
            .map(|((name, unit), values)| RunColumn { name: name.to_owned(), unit: unit.clone(), values })
            .collect();
        Ok(Some((time_s, columns)))
    }

    /// The tuning after each event.
    fn tunings(&self, events: &[LoopEvent]) -> Result<Vec<PidTuning>, RunError> {
        let (mut gains, mut b, mut c) = (self.gains, self.b, self.c);
        let mut after = |event: &LoopEvent| {
            gains = event.gains.or(gains);
            (b, c) = (event.b.unwrap_or(b), event.c.unwrap_or(c));
            self.tuning(gains.as_ref(), b, c)
        };
        events.iter().map(&mut after).collect()
    }
}
