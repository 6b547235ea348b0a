//! What a controller is worth on a process, as one row of numbers; the gains given, or the best under limits.

use serde::{Deserialize, Serialize};

use super::error::RunError;
use super::linear_loop::checked;
use super::outcome::{RunColumn, TimedColumns};
use crate::analyze::{OpenLoop, analyze_loop, loop_figures};
use crate::control::{FormGains, ParallelGains};
use crate::model::{ProcessModel, TransferFunction};
use crate::tune::ControllerKind;
use crate::tune::optimum::{LoopLimits, Objective, OptimumProblem, Process, Wanted, optimum};

/// Measures of given gains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnalysisRun {
    /// The process.
    pub process: ProcessModel,
    /// Gains.
    pub gains: FormGains,
    /// Takes a first-order Padé approximation for the dead time, to replay sources that did.
    #[serde(default)]
    pub pade: bool,
}

/// Measures of the best gains under limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptimumRun {
    /// The process.
    pub process: ProcessModel,
    /// `pi` or `pid`.
    #[serde(default = "pi")]
    pub controller: ControllerKind,
    /// What is to be made best.
    #[serde(default)]
    pub objective: Objective,
    /// Largest Ms.
    pub ms: Option<f64>,
    /// Largest Mt.
    pub mt: Option<f64>,
    /// Largest Ju, in MV units per PV unit.
    pub ju: Option<f64>,
}

fn pi() -> ControllerKind {
    ControllerKind::Pi
}

impl AnalysisRun {
    pub(super) fn run(&self) -> Result<TimedColumns, RunError> {
        let process = checked(&self.process)?;
        let process = if self.pade { pade(&process)? } else { process };
        let ideal = self.gains.to_ideal()?;
        let filter_s = if ideal.td_s == 0.0 { 0.0 } else { ideal.td_s / ideal.n };
        let gains = ParallelGains { kp: ideal.kc, ki: ideal.ki(), kd: ideal.kd(), tf_s: filter_s };
        Ok(measured(&process, &gains))
    }
}

impl OptimumRun {
    pub(super) fn run(&self) -> Result<TimedColumns, RunError> {
        let process = checked(&self.process)?;
        let none = f64::INFINITY;
        let limits = LoopLimits {
            ms: self.ms.unwrap_or(none),
            mt: self.mt.unwrap_or(none),
            ju: self.ju.unwrap_or(none),
        };
        let wanted = if self.controller == ControllerKind::Pid { Wanted::pid(&limits) } else { Wanted::Pi };
        let processes = [Process::Model(process.clone())];
        let found =
            optimum(&OptimumProblem { processes: &processes, wanted, objective: self.objective, limits })?;
        Ok(measured(&process, &found.gains))
    }
}

/// First-order Padé approximation of the dead time: e^(−Ls) ≈ (1 − Ls/2)/(1 + Ls/2).
fn pade(process: &ProcessModel) -> Result<ProcessModel, RunError> {
    let exact = process.transfer_function();
    let half_s = 0.5 * exact.dead_time_s;
    let times = |polynomial: &[f64], slope: f64| {
        let mut out = vec![0.0; polynomial.len() + 1];
        for (k, c) in polynomial.iter().enumerate() {
            out[k] += slope * c;
            out[k + 1] += c;
        }
        out
    };
    let rational = TransferFunction {
        num: times(&exact.num, -half_s),
        den: times(&exact.den, half_s),
        dead_time_s: 0.0,
    };
    checked(&ProcessModel::Rational(rational))
}

/// One row; what does not exist is not a number, and no check is met by it.
fn measured(process: &ProcessModel, gains: &ParallelGains) -> TimedColumns {
    let open = OpenLoop::of_parallel(process, gains);
    let a = analyze_loop(&open);
    let f = loop_figures(&open, &a);
    let stable = Some(f64::from(u8::from(a.stable)));
    let named = [
        ("stable", "", stable),
        ("kp", "", Some(gains.kp)),
        ("ki", "1/s", Some(gains.ki)),
        ("kd", "s", Some(gains.kd)),
        ("ti_s", "s", Some(gains.kp / gains.ki)),
        ("ms", "", a.ms),
        ("mt", "", a.mt),
        ("ju", "", a.ju),
        ("jv", "s", a.jv),
        ("gain_margin", "", a.gain_margin),
        ("phase_margin_deg", "°", a.phase_margin_deg),
        ("iae_load", "s", f.iae_load),
        ("iae_setpoint", "s", f.iae_setpoint),
        ("overshoot_percent", "%", f.overshoot_percent),
    ];
    let column = |(name, unit, value): (&str, &str, Option<f64>)| RunColumn {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: vec![value.filter(|v| v.is_finite()).unwrap_or(f64::NAN)],
    };
    (vec![0.0], named.map(column).to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::PidGains;
    use crate::model::Fopdt;

    /// Seed 001, Table 5: made with a first-order Padé.
    #[test]
    fn val_the_papers_numbers_come_out_with_its_own_approximation() {
        let process = ProcessModel::Fopdt(Fopdt::new(0.6335, 8.0, 1.0).expect("a model"));
        let gains = FormGains::Ideal(PidGains::pi(1.0, 9.09));
        let ms = |pade| {
            let run = AnalysisRun { process: process.clone(), gains, pade };
            let (_, columns) = run.run().expect("a result");
            columns.iter().find(|c| c.name == "ms").expect("Ms").values[0]
        };
        assert!((ms(true) - 1.0686).abs() < 1e-4 && (ms(false) - 1.0718).abs() < 1e-4);
    }
}
