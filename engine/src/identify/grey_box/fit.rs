//! The fit of a rig to a record, with what is known of it afterwards.

use nalgebra::{DMatrix, SymmetricEigen};

use super::super::residual_tests::ResidualTests;
use super::super::statistics::student_95;
use super::free_run::FreeRun;
use super::judge;
use super::optimise::{Found, Search, Sums};
use super::problem::{GreyBoxProblem, Record};
use super::start::{elsewhere, initial_levels};
use super::structure::Structure;
use super::{GreyBoxError, GreyBoxVerdict};

/// Rows from which the initial levels of a record are estimated; in the fitted record they are refined with the rest.
pub const INITIAL_SAMPLES: usize = 50;
/// Share of the sum of squares that ends the search while the weights settle, and in the end: far less than what moves an
/// estimate by a tenth of its standard error.
const ROUGHLY: f64 = 1e-4;
const EXACTLY: f64 = 1e-8;
/// Steps of a search.
const MOST_ROUNDS: usize = 200;
/// Change of an output's weight against the first one's that needs no further search.
const SAME_WEIGHT: f64 = 0.05;
/// Rounds in which the weights of several outputs follow their noise.
const WEIGHT_ROUNDS: usize = 3;
/// Least noise of an output, as a share of its movement: records without noise have weights all the same.
const LEAST_NOISE: f64 = 1e-6;
/// Most that was in the air before the first row, by the highest flow of the pump as it stands in the file.
const MOST_IN_AIR: f64 = 3.0;
/// Share of the movement left over above which other starts are tried.
const BADLY: f64 = 0.1;
/// Smallest eigenvalue of the scaled normal equations, as a share of the largest, that still tells something.
const TELLS: f64 = 1e-12;

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct RigParameter {
    /// `TAG.field`.
    pub name: String,
    /// Best value.
    pub value: f64,
    /// Value in the rig file.
    pub start: f64,
    /// Bounds of the search.
    pub bounds: [f64; 2],
    /// Standard error; ∞ where the record cannot tell.
    pub standard_error: f64,
    /// 95 % interval, cut at the bounds.
    pub interval_95: [f64; 2],
}

/// How well an output of a record is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputFit {
    /// Signal of the tank.
    pub signal: String,
    /// Root mean squared error in free run.
    pub rmse: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖).
    pub fit_percent: f64,
    /// Simulated levels, a row each.
    pub simulated: Vec<f64>,
}

/// A free run through a record.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordFit {
    /// Root mean squared error over all outputs.
    pub rmse: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖) over all outputs, each about its own mean.
    pub fit_percent: f64,
    /// Each output.
    pub outputs: Vec<OutputFit>,
    /// Initial level of every tank the outputs depend on: its tag, and the level.
    pub initial_levels: Vec<(String, f64)>,
}

/// A rig fitted to a record.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyBoxFit {
    /// The free parameters.
    pub parameters: Vec<RigParameter>,
    /// The record that was fitted.
    pub train: RecordFit,
    /// The other one, its initial levels estimated on its first rows alone.
    pub validate: Option<RecordFit>,
    /// Rows from which initial levels were estimated.
    pub initial_samples: usize,
    /// Tests of the residuals of every output.
    pub tests: Vec<ResidualTests>,
    /// What the fit is worth.
    pub verdicts: Vec<GreyBoxVerdict>,
    /// Simulations with sensitivities that the search took.
    pub runs: usize,
}

/// Fits the free parameters of a rig to a record in free run.
///
/// The levels are simulated by the rig's own laws from initial levels that are estimated along; measurements never enter
/// the simulation. Outputs are weighed by what is left over of them. Intervals come from the normal equations with
/// Student's t, widened where residuals are correlated.
///
/// # Errors
/// [`GreyBoxError`] for a problem that cannot be.
pub fn fit_rig(problem: &GreyBoxProblem) -> Result<GreyBoxFit, GreyBoxError> {
    let (structure, train, validate) = problem.checked()?;
    let (bounds, mut start) = bounds_and_start(problem, &structure, &train);
    let spread: Vec<f64> = train.outputs.iter().map(|o| deviation(o)).collect();
    let weights: Vec<f64> = spread.iter().map(|s| 1.0 / (s * s)).collect();
    initial_levels(&structure, &train, &weights, &bounds, INITIAL_SAMPLES, &mut start);
    let all = vec![true; start.len()];
    let mut search = Search {
        structure: &structure,
        record: &train,
        weights,
        bounds: &bounds,
        free: &all,
        most_rounds: MOST_ROUNDS,
        same_cost: ROUGHLY,
    };
    let (mut found, runs) = descend_weighted(&mut search, &start, &spread);
    found.sums = search.sums(&found.unknowns);
    let shown = judged(problem, &structure, &train, &found.unknowns);
    let tests = tests(&structure, &train, &shown);
    let knowledge = Knowledge::new(problem, &train, &found.sums, &tests);
    let parameters = knowledge.parameters(problem, &found.unknowns);
    let other = validate.map(|record| {
        let mut unknowns = found.unknowns.clone();
        initial_levels(&structure, &record, &search.weights, &bounds, INITIAL_SAMPLES, &mut unknowns);
        judged(problem, &structure, &record, &unknowns)
    });
    let verdicts = judge::verdicts(&problem.free, &parameters, &knowledge, &shown, other.as_ref(), &tests);
    let initial_samples = INITIAL_SAMPLES.min(train.rows());
    Ok(GreyBoxFit { parameters, train: shown, validate: other, initial_samples, tests, verdicts, runs })
}

/// Bounds and start of every unknown: parameters as marked, initial levels from the floor to the rim, what is in the air.
fn bounds_and_start(
    problem: &GreyBoxProblem,
    structure: &Structure,
    record: &Record,
) -> (Vec<[f64; 2]>, Vec<f64>) {
    let mut bounds: Vec<[f64; 2]> = problem.free.iter().map(|f| f.bounds).collect();
    let mut start: Vec<f64> = problem.free.iter().map(|f| f.start).collect();
    for vessel in &structure.vessels {
        let rim = vessel.height.slot.map_or(vessel.height.value, |slot| problem.free[slot].bounds[1]);
        bounds.push([0.0, rim]);
        start.push(problem.network.spec.tanks[vessel.tank].initial_cm.min(rim));
    }
    for feed in structure.feeds.iter().filter(|f| f.in_air.is_some()) {
        let curve = &structure.pumps[feed.pump];
        let first = curve.flow(&start, record.moves.inputs[feed.pump][0].1).cm3_s;
        let most = curve.points.iter().map(|p| curve.flow(&start, p.0).cm3_s).fold(first, f64::max);
        bounds.push([0.0, MOST_IN_AIR * most.max(1e-9)]);
        start.push(first);
    }
    (bounds, start)
}

/// Searches from a start, other starts where that leads nowhere, until the weights of the outputs are those of their noise;
/// gives the simulations it took as well.
fn descend_weighted(search: &mut Search, start: &[f64], spread: &[f64]) -> (Found, usize) {
    let mut found = search.descend(start);
    let square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let left = errors(search.structure, search.record, &found.unknowns);
    if square(&left) > BADLY * BADLY * square(spread) {
        found = elsewhere(search, &found);
    }
    let mut runs = found.runs;
    for _ in 1..WEIGHT_ROUNDS {
        let left = errors(search.structure, search.record, &found.unknowns);
        let noise = left.iter().zip(spread).map(|(l, s)| l.max(LEAST_NOISE * s));
        let settled: Vec<f64> = noise.map(|n| 1.0 / (n * n)).collect();
        let ratio = |(a, b): (&f64, &f64)| (a / settled[0] / (b / search.weights[0]) - 1.0).abs();
        let moved = settled.iter().zip(&search.weights).map(ratio).fold(0.0, f64::max);
        search.weights = settled;
        if moved < SAME_WEIGHT {
            break;
        }
        found = search.descend(&found.unknowns);
        runs += found.runs;
    }
    search.same_cost = EXACTLY;
    found = search.descend(&found.unknowns);
    runs += found.runs;
    (found, runs)
}

/// Simulated outputs, a row each, and their derivatives: by output, row and unknown.
pub type Simulated = (Vec<Vec<f64>>, Vec<Vec<Vec<f64>>>);

/// Simulates the outputs of a problem's record with every free parameter and initial level given: rows by outputs, with
/// the derivatives of each by the unknowns: parameters, initial levels, then the flow in the air of every pump with a delay.
///
/// # Errors
/// [`GreyBoxError`] for a problem that cannot be.
pub fn simulate_rig(problem: &GreyBoxProblem, unknowns: &[f64]) -> Result<Simulated, GreyBoxError> {
    let structure = problem.structure()?;
    let record = problem.record(&structure, &problem.train)?;
    let mut values = vec![Vec::new(); record.outputs.len()];
    let mut slopes = vec![Vec::new(); record.outputs.len()];
    FreeRun::new(&structure, &record.moves, unknowns, true).run(|_, output, value, derivatives| {
        values[output].push(value);
        slopes[output].push(derivatives.to_vec());
    });
    Ok((values, slopes))
}

/// Standard deviation of the values there are; > 0.
fn deviation(values: &[f64]) -> f64 {
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let square = known.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / known.len().max(1) as f64;
    square.sqrt().max(f64::MIN_POSITIVE.sqrt())
}

fn simulated(structure: &Structure, record: &Record, unknowns: &[f64]) -> Vec<Vec<f64>> {
    let mut values = vec![Vec::with_capacity(record.rows()); record.outputs.len()];
    FreeRun::new(structure, &record.moves, unknowns, false).run(|_, o, value, _| values[o].push(value));
    values
}

/// Root mean squared error of two columns where the first has a value.
fn rmse(measured: &[f64], simulated: &[f64]) -> f64 {
    let squares = measured.iter().zip(simulated).map(|(y, s)| (y - s).powi(2)).filter(|s| !s.is_nan());
    let (sum, count) = squares.fold((0.0, 0_usize), |(sum, n), s| (sum + s, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

fn errors(structure: &Structure, record: &Record, unknowns: &[f64]) -> Vec<f64> {
    let values = simulated(structure, record, unknowns);
    record.outputs.iter().zip(&values).map(|(y, s)| rmse(y, s)).collect()
}

fn judged(problem: &GreyBoxProblem, structure: &Structure, record: &Record, unknowns: &[f64]) -> RecordFit {
    let tanks = &problem.network.spec.tanks;
    let values = simulated(structure, record, unknowns);
    let (all, all_simulated) = (record.outputs.concat(), values.concat());
    let outputs = structure.gauges.iter().zip(&record.outputs).zip(values).map(|((gauge, y), simulated)| {
        let rmse = rmse(y, &simulated);
        OutputFit {
            signal: tanks[structure.vessels[gauge.vessel].tank].signal.clone(),
            rmse,
            fit_percent: 100.0 * (1.0 - rmse / deviation(y)),
            simulated,
        }
    });
    let vessels = structure.vessels.iter().zip(&unknowns[structure.parameters..]);
    let rmse = rmse(&all, &all_simulated);
    let known = |values: &[f64]| values.iter().filter(|v| v.is_finite()).count() as f64;
    let movement: f64 = record.outputs.iter().map(|o| deviation(o).powi(2) * known(o)).sum();
    RecordFit {
        rmse,
        fit_percent: 100.0 * (1.0 - rmse / (movement / known(&all).max(1.0)).sqrt()),
        outputs: outputs.collect(),
        initial_levels: vessels.map(|(v, &level)| (tanks[v.tank].id.clone(), level)).collect(),
    }
}

fn tests(structure: &Structure, record: &Record, shown: &RecordFit) -> Vec<ResidualTests> {
    let pump = structure.feeds.first().map_or(0, |f| f.pump);
    let moves = &record.moves.inputs[pump];
    let mut next = 0;
    let input: Vec<f64> = (record.moves.time_s.iter())
        .map(|t| {
            while moves.get(next + 1).is_some_and(|m| m.0 <= *t) {
                next += 1;
            }
            moves[next].1
        })
        .collect();
    let left = |y: &f64, s: &f64| if y.is_finite() { y - s } else { 0.0 };
    let residuals = record.outputs.iter().zip(&shown.outputs);
    residuals
        .map(|(y, o)| {
            let residuals: Vec<f64> = y.iter().zip(&o.simulated).map(|(y, s)| left(y, s)).collect();
            ResidualTests::new(&residuals, &input)
        })
        .collect()
}

/// What the normal equations tell of the unknowns.
#[derive(Debug)]
pub(super) struct Knowledge {
    /// Standard error of every unknown; ∞ where the record cannot tell.
    pub errors: Vec<f64>,
    /// Unknowns without effect.
    pub idle: Vec<usize>,
    /// Groups of unknowns that make up for each other.
    pub mixed: Vec<Vec<usize>>,
    student: f64,
}

impl Knowledge {
    fn new(problem: &GreyBoxProblem, record: &Record, sums: &Sums, tests: &[ResidualTests]) -> Self {
        let n = sums.gradient.len();
        // Rows of all outputs weigh by their noise; correlated ones say less, by the mean over the outputs.
        let rows: Vec<f64> =
            record.outputs.iter().map(|o| o.iter().filter(|v| v.is_finite()).count() as f64).collect();
        let total: f64 = rows.iter().sum();
        let per_independent =
            rows.iter().zip(tests).map(|(r, t)| r * t.rows_per_independent).sum::<f64>() / total;
        let freedom = (total / per_independent - n as f64).max(1.0);
        let variance = sums.cost / (total - n as f64).max(1.0) * per_independent;
        let scale: Vec<f64> = (0..n).map(|i| sums.gram[(i, i)].sqrt()).collect();
        let largest = (0..n)
            .map(|i| problem.free.get(i).map_or(0.0, |f| scale[i] * (f.bounds[1] - f.bounds[0])))
            .fold(0.0, f64::max);
        let shows = |i: usize| match problem.free.get(i) {
            Some(f) => scale[i] * (f.bounds[1] - f.bounds[0]) > 1e-9 * largest,
            None => scale[i] > 0.0,
        };
        let active: Vec<usize> = (0..n).filter(|&i| shows(i)).collect();
        let idle = (0..n).filter(|&i| !shows(i)).collect();
        let m = active.len();
        let matrix = DMatrix::from_fn(m, m, |a, b| {
            let (i, j) = (active[a], active[b]);
            sums.gram[(i, j)] / (scale[i] * scale[j])
        });
        let eigen = SymmetricEigen::new(matrix);
        let most = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        let (mut errors, mut mixed) = (vec![f64::INFINITY; n], Vec::new());
        let mut inverse = vec![0.0; m];
        for (k, &value) in eigen.eigenvalues.iter().enumerate() {
            let vector = eigen.eigenvectors.column(k);
            if value <= TELLS * most {
                let strongest = vector.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
                let group: Vec<usize> = (0..m).filter(|&a| vector[a].abs() > 0.05 * strongest).collect();
                group.iter().for_each(|&a| inverse[a] = f64::INFINITY);
                mixed.push(group.into_iter().map(|a| active[a]).collect());
            } else {
                (0..m).for_each(|a| inverse[a] += vector[a] * vector[a] / value);
            }
        }
        for (a, &i) in active.iter().enumerate() {
            errors[i] = (variance * inverse[a]).sqrt() / scale[i];
        }
        Self { errors, idle, mixed, student: student_95(freedom as usize) }
    }

    fn parameters(&self, problem: &GreyBoxProblem, unknowns: &[f64]) -> Vec<RigParameter> {
        let parameter = |(i, free): (usize, &super::FreeParameter)| {
            let (value, half) = (unknowns[i], self.student * self.errors[i]);
            let [low, high] = free.bounds;
            let cut = |x: f64| if x.is_nan() { low } else { x.clamp(low, high) };
            RigParameter {
                name: free.name.clone(),
                value,
                start: free.start,
                bounds: free.bounds,
                standard_error: self.errors[i],
                interval_95: if half.is_finite() {
                    [cut(value - half), cut(value + half)]
                } else {
                    free.bounds
                },
            }
        };
        problem.free.iter().enumerate().map(parameter).collect()
    }
}
