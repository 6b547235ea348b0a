//! What a fit of a rig is given: the rig, its free parameters, and a record whose columns are named.

use std::sync::Arc;

use super::free_run::Moves;
use super::structure::Structure;
use super::target::Target;
use super::{GreyBoxError, with_values};
use crate::plant::Network;

/// Fewest rows of a record.
const LEAST_ROWS: usize = 10;
/// Rows more than there are unknowns.
const SPARE_ROWS: usize = 3;

/// A parameter to fit, with its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParameter {
    /// `TAG.field`.
    pub name: String,
    /// What it is.
    pub target: Target,
    /// Where the search starts.
    pub start: f64,
    /// Lowest and highest value looked at.
    pub bounds: [f64; 2],
}

impl FreeParameter {
    /// A parameter by its name, from the value in the rig file.
    ///
    /// # Errors
    /// [`GreyBoxError`] for a name there is not, bounds in the wrong order or that no rig can have, and a value outside
    /// them.
    pub fn new(
        network: &Network,
        configuration: usize,
        name: &str,
        bounds: [f64; 2],
    ) -> Result<Self, GreyBoxError> {
        let target = Target::parse(&network.spec, name)?;
        let (name, [low, high]) = (target.name(&network.spec), bounds);
        if low.is_nan() || high.is_nan() || low >= high {
            return Err(GreyBoxError::BoundsOrder { name, low, high });
        }
        let [least, most] = target.possible();
        if low < least || high > most {
            return Err(GreyBoxError::BoundsPossible { name, low, high, least, most });
        }
        let start = target.value(&network.spec, configuration);
        if !(low..=high).contains(&start) {
            return Err(GreyBoxError::OutsideBounds { name, value: start, low, high });
        }
        Ok(Self { name, target, start, bounds })
    }

    /// The parameters that a rig file marks, in the order of their names.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn marked(network: &Network, configuration: usize) -> Result<Vec<Self>, GreyBoxError> {
        let marks = network.spec.fit.iter().flat_map(|(tag, fields)| {
            fields.iter().map(move |(field, bounds)| (format!("{tag}.{field}"), *bounds))
        });
        marks.map(|(name, bounds)| Self::new(network, configuration, &name, bounds)).collect()
    }
}

/// A recorded input: which pump, and its values, each applied from its stamp until the next.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedInput {
    /// Place of the pump in the rig file.
    pub pump: usize,
    /// Values in the pump's unit; a missing one (NaN) holds the last.
    pub values: Vec<f64>,
}

/// A recorded level: of which tank, and its values.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedOutput {
    /// Place of the tank in the rig file.
    pub tank: usize,
    /// Sensor that shows it: its gain and zero apply.
    pub sensor: Option<usize>,
    /// Levels in the rig's unit, measured at their stamps; NaN for none.
    pub values: Vec<f64>,
}

/// Inputs and outputs of a rig over one time.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyBoxRecord {
    /// Time stamps in seconds, not decreasing.
    pub time_s: Vec<f64>,
    /// One for every pump that the outputs depend on.
    pub inputs: Vec<RecordedInput>,
    /// At least one.
    pub outputs: Vec<RecordedOutput>,
}

/// A rig, what of it is free, and the records to fit and to judge it by.
#[derive(Debug, Clone)]
pub struct GreyBoxProblem {
    /// The rig with everything else as it is.
    pub network: Arc<Network>,
    /// Which of its configurations the record is of.
    pub configuration: usize,
    /// Free parameters.
    pub free: Vec<FreeParameter>,
    /// The record to fit.
    pub train: GreyBoxRecord,
    /// Another record, to judge the fit by; of the same outputs.
    pub validate: Option<GreyBoxRecord>,
}

/// A pump by its tag or signal; `pump` is the only one there is.
///
/// # Errors
/// [`GreyBoxError::UnknownInput`].
pub fn input_named(network: &Network, name: &str) -> Result<usize, GreyBoxError> {
    let pumps = &network.spec.pumps;
    let same = |other: &str| other.eq_ignore_ascii_case(name);
    let found = pumps.iter().position(|p| same(&p.id) || same(&p.signal));
    found.or_else(|| (same("pump") && pumps.len() == 1).then_some(0)).ok_or_else(|| {
        let known = pumps.iter().map(|p| format!("{} ({})", p.signal, p.id)).collect::<Vec<_>>().join(", ");
        GreyBoxError::UnknownInput { name: name.to_owned(), known }
    })
}

/// A tank by its tag, its signal or its sensor's tag, with that sensor; a tank's only sensor stands for it.
///
/// # Errors
/// [`GreyBoxError::UnknownOutput`].
pub fn output_named(network: &Network, name: &str) -> Result<(usize, Option<usize>), GreyBoxError> {
    let same = |other: &str| other.eq_ignore_ascii_case(name);
    if let Some(sensor) = network.spec.sensors.iter().position(|s| same(&s.id)) {
        return Ok((network.sensors[sensor].tank, Some(sensor)));
    }
    let tanks = &network.spec.tanks;
    let tank = tanks.iter().position(|t| same(&t.id) || same(&t.signal)).ok_or_else(|| {
        let tanks = tanks.iter().map(|t| format!("{} ({})", t.signal, t.id));
        let sensors = network.spec.sensors.iter().map(|s| s.id.clone());
        let known = tanks.chain(sensors).collect::<Vec<_>>().join(", ");
        GreyBoxError::UnknownOutput { name: name.to_owned(), known }
    })?;
    let mut sensors = (0..network.sensors.len()).filter(|&s| network.sensors[s].tank == tank);
    Ok((tank, sensors.next().filter(|_| sensors.next().is_none())))
}

/// A checked record.
#[derive(Debug, Clone)]
pub(super) struct Record {
    pub moves: Moves,
    /// Values of every output; NaN for none.
    pub outputs: Vec<Vec<f64>>,
}

impl Record {
    /// Only the first rows.
    pub fn first(&self, rows: usize) -> Self {
        let rows = rows.min(self.moves.time_s.len());
        let mut first = self.clone();
        first.moves.time_s.truncate(rows);
        first.outputs.iter_mut().for_each(|o| o.truncate(rows));
        first
    }

    pub fn rows(&self) -> usize {
        self.moves.time_s.len()
    }
}

impl GreyBoxProblem {
    /// The rig with other values of its free parameters.
    #[must_use]
    pub fn spec_with(&self, values: &[f64]) -> crate::plant::RigSpec {
        let targets: Vec<(Target, f64)> =
            self.free.iter().map(|f| f.target).zip(values.iter().copied()).collect();
        with_values(&self.network.spec, self.configuration, &targets)
    }

    /// Checks everything.
    pub(super) fn checked(&self) -> Result<(Structure, Record, Option<Record>), GreyBoxError> {
        if self.free.is_empty() {
            return Err(GreyBoxError::NothingMarked);
        }
        for (i, free) in self.free.iter().enumerate() {
            if self.free[..i].iter().any(|other| other.target == free.target) {
                return Err(GreyBoxError::Twice { name: free.name.clone() });
            }
        }
        let structure = self.structure()?;
        let train = self.record(&structure, &self.train)?;
        for (output, values) in self.train.outputs.iter().zip(&train.outputs) {
            self.check_moves(output, values, structure.unknowns())?;
        }
        let validate = self.validate.as_ref().map(|v| self.record(&structure, v)).transpose()?;
        Ok((structure, train, validate))
    }

    pub(super) fn structure(&self) -> Result<Structure, GreyBoxError> {
        if self.train.outputs.is_empty() {
            return Err(GreyBoxError::NoOutput);
        }
        let targets: Vec<Target> = self.free.iter().map(|f| f.target).collect();
        let outputs: Vec<_> = self.train.outputs.iter().map(|o| (o.tank, o.sensor)).collect();
        Ok(Structure::new(&self.network, self.configuration, &targets, &outputs))
    }

    fn check_moves(
        &self,
        output: &RecordedOutput,
        values: &[f64],
        unknowns: usize,
    ) -> Result<(), GreyBoxError> {
        let name = self.output_name(output);
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let needed = LEAST_ROWS.max(unknowns + SPARE_ROWS);
        if known.len() < needed {
            return Err(GreyBoxError::TooFewRows { name, rows: known.len(), needed });
        }
        if known.iter().all(|v| *v == known[0]) {
            return Err(GreyBoxError::StillOutput { name, value: known[0] });
        }
        Ok(())
    }

    fn output_name(&self, output: &RecordedOutput) -> String {
        self.network.spec.tanks[output.tank].signal.clone()
    }

    pub(super) fn record(&self, structure: &Structure, raw: &GreyBoxRecord) -> Result<Record, GreyBoxError> {
        let rows = raw.time_s.len();
        if rows < 2 {
            return Err(GreyBoxError::TooFewRows { name: "time".to_owned(), rows, needed: LEAST_ROWS });
        }
        for (row, pair) in raw.time_s.windows(2).enumerate() {
            if pair[1].is_nan() || pair[1] < pair[0] {
                return Err(GreyBoxError::TimeBackwards { row: row + 2, from_s: pair[0], to_s: pair[1] });
            }
        }
        if raw.time_s[rows - 1] <= raw.time_s[0] || !raw.time_s.iter().all(|t| t.is_finite()) {
            return Err(GreyBoxError::NoTimeSpan);
        }
        let lengths =
            raw.inputs.iter().map(|i| (self.network.spec.pumps[i.pump].signal.clone(), i.values.len()));
        let lengths = lengths.chain(raw.outputs.iter().map(|o| (self.output_name(o), o.values.len())));
        if let Some((name, found)) = lengths.into_iter().find(|(_, length)| *length != rows) {
            return Err(GreyBoxError::Length { name, found, rows });
        }
        let mut inputs = Vec::new();
        for pump in 0..self.network.pumps.len() {
            let given = raw.inputs.iter().find(|i| i.pump == pump);
            let used = structure.feeds.iter().any(|f| f.pump == pump);
            match given {
                Some(input) => inputs.push(self.input_moves(&raw.time_s, input)?),
                None if used => {
                    let spec = &self.network.spec.pumps[pump];
                    return Err(GreyBoxError::MissingInput {
                        pump: spec.id.clone(),
                        signal: spec.signal.clone(),
                    });
                }
                None => inputs.push(vec![(raw.time_s[0], self.network.spec.pumps[pump].initial)]),
            }
        }
        let outputs = raw.outputs.iter().map(|o| o.values.clone()).collect();
        Ok(Record { moves: Moves { time_s: raw.time_s.clone(), inputs }, outputs })
    }

    /// When the input moves, and to what, within the pump's limits.
    fn input_moves(&self, time_s: &[f64], input: &RecordedInput) -> Result<Vec<(f64, f64)>, GreyBoxError> {
        let pump = &self.network.pumps[input.pump];
        let mut moves: Vec<(f64, f64)> = Vec::new();
        for (&t, &value) in time_s.iter().zip(&input.values) {
            if value.is_nan() {
                continue;
            }
            let value = value.clamp(pump.min, pump.max);
            if moves.last().is_none_or(|last| last.1 != value) {
                moves.push((t, value));
            }
        }
        if moves.is_empty() {
            let name = self.network.spec.pumps[input.pump].signal.clone();
            return Err(GreyBoxError::EmptyInput { name });
        }
        Ok(moves)
    }
}
