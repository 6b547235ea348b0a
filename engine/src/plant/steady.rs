//! Steady states: levels for given inputs, and inputs for wanted levels.

use super::error::RigError;
use super::flows::Flows;
use super::network::Network;
use super::pump_curve::input_for;
use super::steady_solver::{Solver, Wanted};

/// Levels and inputs at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyState {
    /// Levels in cm, in the order of the file.
    pub levels_cm: Vec<f64>,
    /// Pump inputs in their own units.
    pub inputs: Vec<f64>,
}

/// A tank and the level at which a pump is to hold it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyTarget {
    /// Pump whose input is free.
    pub pump: usize,
    /// Tank.
    pub tank: usize,
    /// Level in cm.
    pub level_cm: f64,
}

fn flows_of(network: &Network, inputs: &[f64]) -> Vec<f64> {
    network.pumps.iter().zip(inputs).map(|(p, &u)| p.flow_cm3_s(u)).collect()
}

/// Levels at which the network rests for constant inputs, from a guess.
///
/// Newton's method with the exact Jacobian; where that fails, implicit Euler with growing steps. An isolated tank keeps
/// its level, the reservoir of a closed circuit that of the guess; a tank that would rise over its rim stays there and
/// spills. `coefficients` are k(α) of the valves, `inputs` the pumps' inputs, `guess_cm` levels in cm.
#[must_use]
pub fn steady_levels(network: &Network, coefficients: &[f64], inputs: &[f64], guess_cm: &[f64]) -> Vec<f64> {
    let pumped = flows_of(network, inputs);
    let mut solver = Solver::new(network, coefficients, pumped, &[]);
    let mut levels = guess_cm.to_vec();
    if solver.newton(&mut levels, network.delta_cm) {
        return levels;
    }
    solver.settle(guess_cm)
}

/// The input of `pump` that holds `tank` at `level_cm`, the other inputs as given, and all levels there.
///
/// Newton's method on levels and flow together, bisection on the input where that fails; of several inputs with the
/// same flow the lowest.
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
    let target = SteadyTarget { pump, tank, level_cm };
    let in_tank = (0.0..network.tanks[tank].height_cm).contains(&level_cm);
    if in_tank && let Ok(state) = together(network, coefficients, inputs, guess_cm, &[target]) {
        return Ok(state);
    }
    by_bisection(network, coefficients, inputs, guess_cm, target)
}

/// The inputs of several pumps that hold several tanks at wanted levels, the other inputs as given.
///
/// As many levels are wanted as inputs are free; net inflow 0 of every tank is solved for the other levels and the
/// free flows by Newton's method with the exact Jacobian, from a smoothed flow law where the guess is too far.
///
/// # Errors
/// [`RigError::Unreachable`] for a single level; [`RigError::Value`] for a level outside its tank,
/// [`RigError::OutOfReach`] for a pump that cannot deliver its share, [`RigError::NoBalance`] where the pumps have no
/// hold on these tanks.
pub fn steady_at_levels(
    network: &Network,
    coefficients: &[f64],
    inputs: &[f64],
    guess_cm: &[f64],
    targets: &[SteadyTarget],
) -> Result<SteadyState, RigError> {
    if let [t] = *targets {
        return steady_at_level(network, coefficients, inputs, guess_cm, t.pump, t.tank, t.level_cm);
    }
    for target in targets {
        let rim_cm = network.tanks[target.tank].height_cm;
        if !(0.0..rim_cm).contains(&target.level_cm) {
            return Err(RigError::Value {
                item: network.spec.tanks[target.tank].id.clone(),
                field: "level_cm",
                value: target.level_cm,
                expected: format!("0…{rim_cm} (rim)"),
            });
        }
    }
    if targets.is_empty() {
        let levels_cm = steady_levels(network, coefficients, inputs, guess_cm);
        return Ok(SteadyState { levels_cm, inputs: inputs.to_vec() });
    }
    together(network, coefficients, inputs, guess_cm, targets)
}

/// Widths of the smooth part of the root, in cm, from which the true one is approached.
const SMOOTH_CM: [f64; 4] = [10.0, 2.0, 0.5, 0.15];

fn together(
    network: &Network,
    coefficients: &[f64],
    inputs: &[f64],
    guess_cm: &[f64],
    targets: &[SteadyTarget],
) -> Result<SteadyState, RigError> {
    let wanted: Vec<Wanted> = targets.iter().map(|t| Wanted { pump: t.pump, tank: t.tank }).collect();
    let mut solver = Solver::new(network, coefficients, flows_of(network, inputs), &wanted);
    let mut start = guess_cm.to_vec();
    for target in targets {
        start[target.tank] = target.level_cm;
    }
    let mut levels_cm = start.clone();
    let mut solved = solver.newton(&mut levels_cm, network.delta_cm);
    if !solved {
        solver.restart(&flows_of(network, inputs));
        levels_cm = start;
        let smooth = SMOOTH_CM.into_iter().filter(|delta| *delta > network.delta_cm);
        solved = smooth.chain([network.delta_cm]).map(|delta| solver.newton(&mut levels_cm, delta)).last()
            == Some(true);
    }
    if !solved {
        let tanks = targets.iter().map(|t| network.spec.tanks[t.tank].id.as_str()).collect::<Vec<_>>();
        return Err(RigError::NoBalance { tanks: tanks.join(", ") });
    }
    let mut inputs = inputs.to_vec();
    for target in targets {
        let (pump, needed_cm3_s) = (&network.spec.pumps[target.pump], solver.pumped_cm3_s[target.pump]);
        inputs[target.pump] = input_for(pump, needed_cm3_s).map_err(|range| RigError::OutOfReach {
            pump: pump.id.clone(),
            needed_cm3_s,
            lowest_cm3_s: range[0],
            highest_cm3_s: range[1],
        })?;
    }
    Ok(SteadyState { levels_cm, inputs })
}

/// Bisection on the input; the level of a tank never falls when the input that feeds it rises.
fn by_bisection(
    network: &Network,
    coefficients: &[f64],
    inputs: &[f64],
    guess_cm: &[f64],
    target: SteadyTarget,
) -> Result<SteadyState, RigError> {
    let SteadyTarget { pump, tank, level_cm } = target;
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

/// Largest |dh/dt| in cm/s of the tanks that are not full: 0 at rest.
#[must_use]
pub fn unrest_cm_s(network: &Network, coefficients: &[f64], state: &SteadyState) -> f64 {
    let mut flows = Flows::new(state.levels_cm.len());
    let pumped = flows_of(network, &state.inputs);
    flows.evaluate(network, coefficients, &pumped, &state.levels_cm, network.delta_cm);
    let reservoir = super::flows::closed_reservoir(network);
    let rates = flows.net_cm3_s.iter().zip(&network.tanks).map(|(net, tank)| (net / tank.area_cm2).abs());
    rates.enumerate().filter(|(i, _)| Some(*i) != reservoir).map(|(_, rate)| rate).fold(0.0, f64::max)
}
