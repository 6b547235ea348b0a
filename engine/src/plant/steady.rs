//! Steady states: levels for given inputs, and the input for a wanted level.

use nalgebra::{DMatrix, DVector};

use super::error::RigError;
use super::network::Network;
use super::spec::ValveDrive;

/// Levels and inputs at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyState {
    /// Levels in cm, in the order of the file.
    pub levels_cm: Vec<f64>,
    /// Pump inputs in their own units.
    pub inputs: Vec<f64>,
}

/// Levels at which the network rests for constant inputs, from a guess.
///
/// Implicit Euler with growing steps (pseudo-transient continuation), Newton with the exact Jacobian. An
/// isolated tank keeps its level; a tank that would rise over its rim stays at the rim.
/// `coefficients` are k(α) of the valves, `inputs` the pumps' inputs, `guess_cm` levels in cm.
#[must_use]
pub fn steady_levels(network: &Network, coefficients: &[f64], inputs: &[f64], guess_cm: &[f64]) -> Vec<f64> {
    // From a good guess plain Newton gets there at once.
    if let Some(levels) = implicit_step(network, coefficients, inputs, guess_cm, LONGEST_STEP_S) {
        return levels;
    }
    let mut levels = guess_cm.to_vec();
    let mut step_s = 1.0;
    for _ in 0..MOST_STEPS {
        match implicit_step(network, coefficients, inputs, &levels, step_s) {
            Some(next) => {
                levels = next;
                if step_s >= LONGEST_STEP_S {
                    break;
                }
                step_s = (3.0 * step_s).min(LONGEST_STEP_S);
            }
            None => step_s *= 0.2,
        }
    }
    levels
}

/// Longer than any rig takes to settle, in seconds.
const LONGEST_STEP_S: f64 = 1e9;
/// Bound on the steps of the continuation.
const MOST_STEPS: usize = 120;

fn implicit_step(
    network: &Network,
    coefficients: &[f64],
    inputs: &[f64],
    start: &[f64],
    step_s: f64,
) -> Option<Vec<f64>> {
    let n = start.len();
    let mut levels = start.to_vec();
    for _ in 0..30 {
        let (rate, mut jacobian) = rates(network, coefficients, inputs, &levels);
        let mut residual = DVector::zeros(n);
        for i in 0..n {
            residual[i] = levels[i] - start[i] - step_s * rate[i];
        }
        jacobian *= -step_s;
        for i in 0..n {
            jacobian[(i, i)] += 1.0;
        }
        let change = jacobian.lu().solve(&residual)?;
        if change.iter().any(|c| !c.is_finite()) {
            return None;
        }
        let mut largest = 0.0_f64;
        for i in 0..n {
            let height = network.tanks[i].height_cm;
            let next = (levels[i] - change[i]).clamp(0.0, height);
            largest = largest.max((next - levels[i]).abs());
            levels[i] = next;
        }
        if largest < 1e-12 {
            return Some(levels);
        }
    }
    None
}

/// dh/dt in cm/s and its Jacobian with respect to the levels in 1/s.
fn rates(
    network: &Network,
    coefficients: &[f64],
    inputs: &[f64],
    levels: &[f64],
) -> (Vec<f64>, DMatrix<f64>) {
    let n = levels.len();
    let mut rate = vec![0.0; n];
    let mut jacobian = DMatrix::zeros(n, n);
    for (pump, &input) in network.pumps.iter().zip(inputs) {
        let flow = pump.flow_cm3_s(input);
        for &(to, share) in &pump.outlets {
            rate[to] += share * flow;
        }
        if let Some(from) = pump.from {
            rate[from] -= flow;
        }
    }
    for (valve, &k) in network.valves.iter().zip(coefficients) {
        let head = valve.head_cm(levels);
        let flow = valve.law.flow_cm3_s(k, head, network.delta_cm);
        // δ = 0 has no finite slope at zero head; a tiny δ keeps Newton going.
        let slope = valve.law.slope_cm2_s(k, head, network.delta_cm.max(1e-9));
        rate[valve.from] -= flow;
        jacobian[(valve.from, valve.from)] -= slope;
        if let Some(to) = valve.to {
            rate[to] += flow;
            jacobian[(to, valve.from)] += slope;
            if valve.drive == ValveDrive::Between {
                jacobian[(valve.from, to)] += slope;
                jacobian[(to, to)] -= slope;
            }
        }
    }
    for (i, tank) in network.tanks.iter().enumerate() {
        rate[i] /= tank.area_cm2;
        for j in 0..n {
            jacobian[(i, j)] /= tank.area_cm2;
        }
        // The reservoir of a closed circuit follows from the water; it takes no part.
        if network.reservoir == Some(i) && network.spec.water_cm3.is_some() {
            rate[i] = 0.0;
            jacobian.row_mut(i).fill(0.0);
        }
    }
    (rate, jacobian)
}

/// The input of `pump` that holds `tank` at `level_cm`, the other inputs as given, and all levels there.
///
/// Bisection on the input; the level of a tank never falls when the input that feeds it rises.
///
/// # Errors
/// [`RigError::Unreachable`] with the range that can be held.
pub fn steady_at_level(
    network: &Network,
    coefficients: &[f64],
    inputs: &[f64],
    guess_cm: &[f64],
    pump: usize,
    tank: usize,
    level_cm: f64,
) -> Result<SteadyState, RigError> {
    let mut inputs = inputs.to_vec();
    let mut guess = guess_cm.to_vec();
    let mut level_at = |input: f64| {
        inputs[pump] = input;
        guess = steady_levels(network, coefficients, &inputs, &guess);
        (guess.clone(), inputs.clone())
    };
    let (mut low, mut high) = (network.pumps[pump].min, network.pumps[pump].max);
    let lowest_cm = level_at(low).0[tank];
    let highest_cm = level_at(high).0[tank];
    if !(lowest_cm..=highest_cm).contains(&level_cm) || level_cm >= network.tanks[tank].height_cm {
        let id = network.spec.tanks[tank].id.clone();
        return Err(RigError::Unreachable { tank: id, wanted_cm: level_cm, lowest_cm, highest_cm });
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if level_at(middle).0[tank] < level_cm {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (levels_cm, inputs) = level_at(0.5 * (low + high));
    Ok(SteadyState { levels_cm, inputs })
}
