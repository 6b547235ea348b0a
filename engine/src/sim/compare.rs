//! Models side by side: one input, several models, one recording.

use std::sync::Arc;

use crate::explain::Explain;
use crate::model::{
    Fopdt, ProcessModel, ReduceError, ReducedOrder, SampledInput, StateSpaceError, fit_step_response,
    half_rule, simulate, simulate_process,
};
use crate::plant::{
    LinearError, LinearOptions, Linearisation, Network, OperatingPoint, Plant, RigError, linearise,
};

/// Inputs of all pumps over time, and where the rig stands before.
#[derive(Debug, Clone, PartialEq)]
pub struct InputSeries {
    /// N stamps in seconds, rising.
    pub time_s: Vec<f64>,
    /// One column of N values a pump, in its unit; each holds from its stamp until the next.
    pub inputs: Vec<Vec<f64>>,
    /// One column of N angles in degrees a valve, which the non-linear model follows; empty: they stay as at the start.
    pub angles_deg: Vec<Vec<f64>>,
    /// Levels in cm and inputs before the first stamp, the streams in the air in equilibrium with them.
    pub start: OperatingPoint,
}

/// A model that takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// The rig's own equations.
    NonLinear,
    /// State space about the operating point, from its levels at the start.
    StateSpace,
    /// The same behind the pump's curve: the flow is exact, the tanks are linear.
    StateSpaceBehindCurve,
    /// The minimal transfer function of each pump to the output, at rest before.
    TransferFunction,
    /// Its FOPDT (IPDT where it integrates), at rest before.
    Fopdt,
}

impl ModelKind {
    /// All of them, in the order of a table.
    pub const ALL: [Self; 5] =
        [Self::NonLinear, Self::StateSpace, Self::StateSpaceBehindCurve, Self::TransferFunction, Self::Fopdt];

    /// Name in JSON and in translation keys.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::NonLinear => "non_linear",
            Self::StateSpace => "state_space",
            Self::StateSpaceBehindCurve => "state_space_behind_curve",
            Self::TransferFunction => "transfer_function",
            Self::Fopdt => "fopdt",
        }
    }
}

/// One model's answer.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelTrace {
    /// Which.
    pub kind: ModelKind,
    /// ŷ in cm, one value a stamp.
    pub level_cm: Vec<f64>,
    /// Mean of (y − ŷ)² in cm².
    pub mse_cm2: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖); `None` where the recording does not move.
    pub fit_percent: Option<f64>,
}

/// Why a model or a comparison cannot be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// The rig refuses the start.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// There is no linear model at the operating point.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// Samples that cannot be simulated.
    #[error(transparent)]
    Samples(#[from] StateSpaceError),
    /// There is no low-order model.
    #[error(transparent)]
    Reduce(#[from] ReduceError),
    /// A transfer function that integrates, or is unstable, has no rest away from the operating point.
    #[error(
        "the run does not start at the operating point, and a model that integrates has no other rest: start there, or compare the state space"
    )]
    NoRest,
}

impl Explain for CompareError {
    fn key(&self) -> &'static str {
        match self {
            Self::Rig(error) => error.key(),
            Self::Linear(error) => error.key(),
            Self::Samples(error) => error.key(),
            Self::Reduce(error) => error.key(),
            Self::NoRest => "compare.no_rest",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Rig(error) => error.args(),
            Self::Linear(error) => error.args(),
            Self::Samples(error) => error.args(),
            Self::Reduce(error) => error.args(),
            Self::NoRest => vec![],
        }
    }
}

impl CompareError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![Self::NoRest]
    }
}

/// A comparison about one operating point and for one tank.
#[derive(Debug, Clone)]
pub struct Comparison {
    network: Arc<Network>,
    series: InputSeries,
    tank: usize,
    linear: Linearisation,
}

impl Comparison {
    /// Linearises about `point`; `tank` is the output, the stamps and columns of `series` are checked.
    ///
    /// # Errors
    /// [`CompareError`].
    pub fn new(
        network: Arc<Network>,
        point: &OperatingPoint,
        tank: usize,
        series: InputSeries,
    ) -> Result<Self, CompareError> {
        let options = LinearOptions { outputs: Some(vec![tank]), ..LinearOptions::default() };
        let linear = linearise(&network, point, &options)?;
        let shape = |columns: usize, rows: usize| StateSpaceError::Shape {
            what: "u",
            rows,
            columns,
            expected_rows: series.time_s.len(),
            expected_columns: network.pumps.len(),
        };
        if series.inputs.len() != network.pumps.len() {
            return Err(shape(series.inputs.len(), series.time_s.len()).into());
        }
        if let Some(column) = series.inputs.iter().find(|c| c.len() != series.time_s.len()) {
            return Err(shape(network.pumps.len(), column.len()).into());
        }
        let valves = (network.valves.len(), series.time_s.len());
        if !series.angles_deg.is_empty()
            && (series.angles_deg.len() != valves.0 || series.angles_deg.iter().any(|c| c.len() != valves.1))
        {
            return Err(StateSpaceError::Shape {
                what: "α",
                rows: series.angles_deg.first().map_or(0, Vec::len),
                columns: series.angles_deg.len(),
                expected_rows: valves.1,
                expected_columns: valves.0,
            }
            .into());
        }
        if series.time_s.is_empty() {
            return Err(shape(0, 0).into());
        }
        Ok(Self { network, series, tank, linear })
    }

    /// The linear model in use.
    #[must_use]
    pub fn linearisation(&self) -> &Linearisation {
        &self.linear
    }

    /// One model over the input, in cm, one value a stamp.
    ///
    /// # Errors
    /// [`CompareError`] where this model does not exist here.
    pub fn run(&self, kind: ModelKind) -> Result<Vec<f64>, CompareError> {
        match kind {
            ModelKind::NonLinear => self.non_linear(),
            ModelKind::StateSpace => self.state_space(false),
            ModelKind::StateSpaceBehindCurve => self.state_space(true),
            ModelKind::TransferFunction => {
                self.channels(|pump| Ok(ProcessModel::Rational(self.channel(pump).transfer_function())))
            }
            ModelKind::Fopdt => self.channels(|pump| Ok(self.reduced(pump)?)),
        }
    }

    /// One model against a recording of the output in cm, one value a stamp.
    ///
    /// # Errors
    /// [`CompareError`] where this model does not exist here, or the recording has another length.
    pub fn trace(&self, kind: ModelKind, recording_cm: &[f64]) -> Result<ModelTrace, CompareError> {
        let level_cm = self.run(kind)?;
        let (rows, expected_rows) = (recording_cm.len(), level_cm.len());
        if rows != expected_rows {
            let error =
                StateSpaceError::Shape { what: "y", rows, columns: 1, expected_rows, expected_columns: 1 };
            return Err(error.into());
        }
        let (mse_cm2, fit_percent) = agreement(recording_cm, &level_cm);
        Ok(ModelTrace { kind, level_cm, mse_cm2, fit_percent })
    }

    fn channel(&self, pump: usize) -> crate::model::ZeroPoleGain {
        self.linear.model.zero_pole_gain(0, pump)
    }

    /// The low-order model of a pump's channel: by fit of its step response, by the half rule where it integrates; a pump
    /// that does not reach the output has gain 0.
    fn reduced(&self, pump: usize) -> Result<ProcessModel, ReduceError> {
        let channel = self.channel(pump);
        if channel.gain == 0.0 {
            return Ok(ProcessModel::Fopdt(Fopdt { gain: 0.0, time_constant_s: 1.0, dead_time_s: 0.0 }));
        }
        if channel.static_gain().is_finite() {
            return Ok(fit_step_response(&channel, ReducedOrder::First)?.model);
        }
        half_rule(&channel, ReducedOrder::First)
    }

    fn non_linear(&self) -> Result<Vec<f64>, CompareError> {
        let mut plant = plant_at(&self.network, &self.series.start)?;
        let mut out = Vec::with_capacity(self.series.time_s.len());
        for (k, &t) in self.series.time_s.iter().enumerate() {
            out.push(plant.levels_cm()[self.tank]);
            for (pump, column) in self.series.inputs.iter().enumerate() {
                plant.set_input(pump, column[k])?;
            }
            for (valve, column) in self.series.angles_deg.iter().enumerate() {
                plant.set_angle(valve, column[k])?;
            }
            if let Some(&next) = self.series.time_s.get(k + 1) {
                if next <= t {
                    return Err(StateSpaceError::Time { row: k + 2, from_s: t, to_s: next }.into());
                }
                plant.advance(next - t);
            }
        }
        Ok(out)
    }

    /// Deviation of a pump's input from the operating point; behind the curve that of the flow, in units of the input.
    fn deviation(&self, pump: usize, input: f64, behind_curve: bool) -> f64 {
        let at = self.linear.point.inputs[pump];
        let slope = self.linear.pump_slopes[pump];
        if !behind_curve || slope == 0.0 {
            return input - at;
        }
        let curve = &self.network.pumps[pump];
        (curve.flow_cm3_s(input) - curve.flow_cm3_s(at)) / slope
    }

    fn state_space(&self, behind_curve: bool) -> Result<Vec<f64>, CompareError> {
        let start = &self.series.start;
        let columns: Vec<Vec<f64>> = (self.series.inputs.iter().enumerate())
            .map(|(pump, column)| column.iter().map(|&u| self.deviation(pump, u, behind_curve)).collect())
            .collect();
        let before =
            start.inputs.iter().enumerate().map(|(p, &u)| self.deviation(p, u, behind_curve)).collect();
        let level = |tank: &usize| start.levels_cm[*tank] - self.linear.point.levels_cm[*tank];
        let state: Vec<f64> = self.linear.states.iter().map(level).collect();
        let input = SampledInput {
            time_s: &self.series.time_s,
            columns: columns.iter().map(Vec::as_slice).collect(),
            before,
            initial_state: Some(&state),
        };
        let deviation = simulate(&self.linear.model, &input)?.swap_remove(0);
        Ok(self.about_the_point(deviation))
    }

    fn about_the_point(&self, mut deviation: Vec<f64>) -> Vec<f64> {
        let at_cm = self.linear.point.levels_cm[self.tank];
        deviation.iter_mut().for_each(|v| *v += at_cm);
        deviation
    }

    /// The sum over the pumps of one model each, at rest with the inputs before the first stamp.
    fn channels(
        &self,
        model: impl Fn(usize) -> Result<ProcessModel, CompareError>,
    ) -> Result<Vec<f64>, CompareError> {
        let mut sum = vec![0.0; self.series.time_s.len()];
        for (pump, column) in self.series.inputs.iter().enumerate() {
            let model = model(pump)?;
            let before = self.series.start.inputs[pump];
            let away = before - self.linear.point.inputs[pump];
            let tf = model.transfer_function();
            let gain = match (tf.num.last(), tf.den.last()) {
                (Some(num), Some(den)) if *den != 0.0 => num / den,
                _ => f64::INFINITY,
            };
            if away != 0.0 && !gain.is_finite() {
                return Err(CompareError::NoRest);
            }
            let moves: Vec<f64> = column.iter().map(|u| u - before).collect();
            let y = simulate_process(&model, &SampledInput::single(&self.series.time_s, &moves))?;
            let rest = if away == 0.0 { 0.0 } else { gain * away };
            sum.iter_mut().zip(y).for_each(|(sum, y)| *sum += y + rest);
        }
        Ok(self.about_the_point(sum))
    }
}

/// Mean squared difference in the square of the values' unit, and 100 (1 − ‖y − ŷ‖/‖y − ȳ‖), `None` for a constant y.
#[must_use]
pub fn agreement(recorded: &[f64], modelled: &[f64]) -> (f64, Option<f64>) {
    let count = recorded.len().max(1) as f64;
    let mean = recorded.iter().sum::<f64>() / count;
    let error: f64 = recorded.iter().zip(modelled).map(|(y, model)| (y - model).powi(2)).sum();
    let movement: f64 = recorded.iter().map(|y| (y - mean).powi(2)).sum();
    (error / count, (movement > 0.0).then(|| 100.0 * (1.0 - (error / movement).sqrt())))
}

/// A plant with a point's angles and delays, at rest with its levels and inputs.
pub(super) fn plant_at(network: &Arc<Network>, point: &OperatingPoint) -> Result<Plant, RigError> {
    let mut plant = Plant::new(network.clone())?;
    for (valve, &angle) in point.angles_deg.iter().enumerate() {
        plant.set_angle(valve, angle)?;
    }
    for (pump, &delay) in point.delays_s.iter().enumerate() {
        plant.set_delay(pump, delay);
    }
    plant.set_state(&point.levels_cm, &point.inputs)?;
    Ok(plant)
}
