//! The continuous unit step response of a process, alone or under a controller.

use serde::{Deserialize, Serialize};

use super::error::RunError;
use super::linear_loop::checked;
use super::outcome::RunColumn;
use crate::analyze::{Excitation, ResponseOptions, step_response};
use crate::control::FormGains;
use crate::model::{ProcessModel, SampledInput, simulate_process};

/// A unit step of the setpoint or of the load; without gains of the process input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepRun {
    /// The process.
    pub process: ProcessModel,
    /// Gains; absent: the process alone.
    pub gains: Option<FormGains>,
    /// What steps.
    #[serde(default = "setpoint")]
    pub excitation: Excitation,
    /// b, weight of the setpoint in the proportional part.
    #[serde(default = "one")]
    pub b: f64,
    /// c, weight of the setpoint in the derivative part.
    #[serde(default)]
    pub c: f64,
    /// Length in seconds; absent: until it has settled. The process alone needs it.
    pub horizon_s: Option<f64>,
}

fn setpoint() -> Excitation {
    Excitation::Setpoint
}

fn one() -> f64 {
    1.0
}

/// Points of the response of a process alone.
const POINTS: usize = 2000;

/// Times, columns and the final value.
pub(super) type StepResult = (Vec<f64>, Vec<RunColumn>, Option<f64>);

impl StepRun {
    pub(super) fn run(&self) -> Result<StepResult, RunError> {
        let process = checked(&self.process)?;
        let Some(gains) = &self.gains else { return self.alone(&process) };
        let options = ResponseOptions {
            setpoint_weight_b: self.b,
            setpoint_weight_c: self.c,
            horizon_s: self.horizon_s,
            ..ResponseOptions::default()
        };
        let response = step_response(&process, &gains.to_ideal()?, self.excitation, &options);
        let columns = columns([response.r, response.y, response.u]);
        Ok((response.time_s, columns, response.final_value))
    }

    fn alone(&self, process: &ProcessModel) -> Result<StepResult, RunError> {
        let horizon_s = self.horizon_s.unwrap_or(1.0);
        let time_s: Vec<f64> = (0..=POINTS).map(|k| horizon_s * k as f64 / POINTS as f64).collect();
        let u = vec![1.0; time_s.len()];
        let y = simulate_process(process, &SampledInput::single(&time_s, &u))?;
        Ok((time_s, columns([u.clone(), y, u]), None))
    }
}

fn columns(values: [Vec<f64>; 3]) -> Vec<RunColumn> {
    let named = ["sp", "pv", "mv"].into_iter().zip(values);
    named.map(|(name, values)| RunColumn { name: name.to_owned(), unit: String::new(), values }).collect()
}
