//! The exact linearisation of a rig about an operating point.
//!
//! Every derivative is that of the network's own right-hand side: regularised root, laminar law, free fall and flow
//! between tanks, pump curve, split streams, tanks that spill. Transport delays stay dead times of the inputs.

use nalgebra::DMatrix;

use super::error::RigError;
use super::flows::{Flows, closed_reservoir, is_idle};
use super::linear_error::LinearError;
use super::network::Network;
use super::pump_curve::{CurveSide, slope_at};
use super::spec::ValveLaw;
use super::state::Plant;
use super::steady::{SteadyState, SteadyTarget, steady_at_levels};
use crate::model::{Matrices, Port, Ports, StateSpace};

/// A state of a rig about which it is linearised; it need not be at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatingPoint {
    /// Levels in cm, in the order of the file.
    pub levels_cm: Vec<f64>,
    /// Pump inputs in their own units.
    pub inputs: Vec<f64>,
    /// Valve angles in degrees.
    pub angles_deg: Vec<f64>,
    /// Transport delays of the pumps' streams in seconds.
    pub delays_s: Vec<f64>,
}

impl OperatingPoint {
    /// Where a plant is now.
    #[must_use]
    pub fn of(plant: &Plant) -> Self {
        Self {
            levels_cm: plant.levels_cm().to_vec(),
            inputs: plant.inputs().to_vec(),
            angles_deg: plant.angles_deg().to_vec(),
            delays_s: plant.delays_s().collect(),
        }
    }

    /// Angles and delays of a configuration of the rig's file, levels and inputs as at its start.
    #[must_use]
    pub fn of_configuration(network: &Network, configuration: usize) -> Self {
        let spec = &network.spec;
        let mut point = Self {
            levels_cm: spec.tanks.iter().map(|t| t.initial_cm).collect(),
            inputs: spec.pumps.iter().map(|p| p.initial).collect(),
            angles_deg: spec.valves.iter().map(|v| v.angle_deg).collect(),
            delays_s: spec.pumps.iter().map(|p| p.delay_s).collect(),
        };
        if let Some(configuration) = spec.configurations.get(configuration) {
            for (valve, angle) in spec.valves.iter().zip(&mut point.angles_deg) {
                *angle = configuration.angles_deg.get(&valve.id).copied().unwrap_or(*angle);
            }
            for (pump, delay) in spec.pumps.iter().zip(&mut point.delays_s) {
                *delay = configuration.delays_s.get(&pump.id).copied().unwrap_or(*delay);
            }
        }
        point
    }

    /// k(α) of the valves, in the order of the file.
    #[must_use]
    pub fn coefficients(&self, network: &Network) -> Vec<f64> {
        network.valves.iter().zip(&self.angles_deg).map(|(v, &angle)| v.coefficient(angle)).collect()
    }

    /// The same rig at rest with tanks at wanted levels; the reservoir of a closed circuit takes the rest of the water.
    ///
    /// # Errors
    /// [`RigError`] as [`steady_at_levels`] gives it, and [`RigError::Water`] when the water does not fit.
    pub fn at_levels(&self, network: &Network, targets: &[SteadyTarget]) -> Result<Self, RigError> {
        let coefficients = self.coefficients(network);
        let SteadyState { levels_cm, inputs } =
            steady_at_levels(network, &coefficients, &self.inputs, &self.levels_cm, targets)?;
        let mut point = Self { levels_cm, inputs, ..self.clone() };
        point.fill_reservoir(network)?;
        Ok(point)
    }

    fn fill_reservoir(&mut self, network: &Network) -> Result<(), RigError> {
        let (Some(water_cm3), Some(r)) = (network.spec.water_cm3, network.reservoir) else { return Ok(()) };
        let in_tanks: f64 = (self.levels_cm.iter().zip(&network.tanks).enumerate())
            .filter(|(i, _)| *i != r)
            .map(|(_, (level, tank))| level * tank.area_cm2)
            .sum();
        let flows = network.pumps.iter().zip(&self.inputs).map(|(p, &u)| p.flow_cm3_s(u));
        let in_flight: f64 = flows.zip(&self.delays_s).map(|(flow, delay)| flow * delay).sum();
        let level_cm = (water_cm3 - in_tanks - in_flight) / network.tanks[r].area_cm2;
        if !(0.0..=network.tanks[r].height_cm).contains(&level_cm) {
            return Err(RigError::Water { tank: network.spec.tanks[r].id.clone(), level_cm });
        }
        self.levels_cm[r] = level_cm;
        Ok(())
    }
}

/// Which valves' settings are inputs beside the pumps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Disturbances {
    /// None.
    #[default]
    None,
    /// k of every valve, in cm^2.5/s or cm²/s.
    Coefficients,
    /// The angle of every valve, in degrees.
    Angles,
}

/// What is wanted of a linearisation.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LinearOptions {
    /// Tanks whose levels are outputs; `None`: those with a sensor, in the order of the sensors.
    pub outputs: Option<Vec<usize>>,
    /// Inputs beside the pumps.
    pub disturbances: Disturbances,
    /// Side on which the slope of a pump's curve is taken where the input stands on a break of it.
    pub side: CurveSide,
}

/// A rig linearised.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// ẋ = A x + B u(t − θ), y = C x: levels in cm and inputs in their units, all as deviations from the point.
    pub model: StateSpace,
    /// Where.
    pub point: OperatingPoint,
    /// Tanks whose levels are the states, in the order of A.
    pub states: Vec<usize>,
    /// Tanks whose levels are the outputs.
    pub outputs: Vec<usize>,
    /// Tanks at their rim, which spill: their levels do not move.
    pub spilling: Vec<usize>,
    /// Tanks left out because no flow depends on their levels: the sump, or the reservoir of a closed circuit, whose
    /// level follows from the water.
    pub left_out: Vec<usize>,
    /// Slope of each pump's curve in cm³/s per unit of its input.
    pub pump_slopes: Vec<f64>,
    /// Pumps whose input stands on a break of the curve: the slope holds on [`LinearOptions::side`] alone.
    pub on_a_break: Vec<usize>,
    /// Largest |dh/dt| at the point in cm/s; 0 at rest.
    pub unrest_cm_s: f64,
}

/// A, B, C, D of a rig at an operating point, by exact differentiation of the balance of every tank.
///
/// For tank i: `A ∂ḣᵢ = Σ ∂q/∂h · δh + shares · slope of the pump's curve · δu(t − θ)`; D = 0. A tank that spills has no
/// state, what it would gain goes where it spills to. A pump is taken to have water.
///
/// # Errors
/// [`LinearError`] where a flow has no finite slope (δ = 0 at zero head), or where one pump acts at two delays.
pub fn linearise(
    network: &Network,
    point: &OperatingPoint,
    options: &LinearOptions,
) -> Result<Linearisation, LinearError> {
    let n = network.tanks.len();
    let coefficients = point.coefficients(network);
    check_slopes(network, point, &coefficients)?;
    let outputs =
        options.outputs.clone().unwrap_or_else(|| network.sensors.iter().map(|sensor| sensor.tank).collect());
    let pumped: Vec<f64> = network.pumps.iter().zip(&point.inputs).map(|(p, &u)| p.flow_cm3_s(u)).collect();
    let mut flows = Flows::new(n);
    flows.evaluate(network, &coefficients, &pumped, &point.levels_cm, network.delta_cm);
    let is_sump = |i: usize| {
        closed_reservoir(network) == Some(i) || network.pumps.iter().any(|pump| pump.from == Some(i))
    };
    let left_out: Vec<usize> = (0..n)
        .filter(|&i| is_sump(i) && is_idle(network, &coefficients, i) && !outputs.contains(&i))
        .collect();
    let spilling: Vec<usize> = (0..n).filter(|&i| flows.spilling[i]).collect();
    let states: Vec<usize> = (0..n).filter(|i| !left_out.contains(i) && !spilling.contains(i)).collect();
    let row = |tank: usize| states.iter().position(|&s| s == tank);
    let area = |i: usize| network.tanks[states[i]].area_cm2;
    let a = DMatrix::from_fn(states.len(), states.len(), |i, j| {
        flows.slope_cm2_s[states[i] * n + states[j]] / area(i)
    });
    let mut columns = Columns::default();
    let (mut pump_slopes, mut on_a_break) = (Vec::with_capacity(pumped.len()), Vec::new());
    for (pump, spec) in network.spec.pumps.iter().enumerate() {
        let (slope, broken) = slope_at(spec, point.inputs[pump], options.side);
        let source = network.pumps[pump].from.and_then(|from| flows.destination(network, from));
        let draws = source.and_then(|(tank, _)| row(tank));
        if point.delays_s[pump] > 0.0 && draws.is_some() {
            return Err(LinearError::TwoDelays { pump: spec.id.clone(), delay_s: point.delays_s[pump] });
        }
        let mut column = vec![0.0; states.len()];
        flows.pump_column(network, pump, |tank, share| {
            if let Some(i) = row(tank) {
                column[i] += share * slope / area(i);
            }
        });
        columns.push(column, point.delays_s[pump], Port::new(&spec.signal, spec.unit.symbol()));
        pump_slopes.push(slope);
        if broken {
            on_a_break.push(pump);
        }
    }
    if options.disturbances != Disturbances::None {
        valve_columns(network, point, options.disturbances, &flows, &states, &mut columns)?;
    }
    let c =
        DMatrix::from_fn(outputs.len(), states.len(), |i, j| f64::from(u8::from(outputs[i] == states[j])));
    let level = |&tank: &usize| Port::new(&network.spec.tanks[tank].signal, "cm");
    let ports = Ports {
        states: states.iter().map(level).collect(),
        inputs: columns.ports,
        outputs: outputs.iter().map(level).collect(),
    };
    let m = ports.inputs.len();
    let b = DMatrix::from_fn(states.len(), m, |i, j| columns.columns[j][i]);
    let d = DMatrix::zeros(outputs.len(), m);
    let unrest_cm_s = states.iter().map(|&i| (flows.net_cm3_s[i] / network.tanks[i].area_cm2).abs());
    Ok(Linearisation {
        unrest_cm_s: unrest_cm_s.fold(0.0, f64::max),
        model: StateSpace::new(Matrices { a, b, c, d }, columns.delays_s, ports)?,
        point: point.clone(),
        states,
        outputs,
        spilling,
        left_out,
        pump_slopes,
        on_a_break,
    })
}

#[derive(Default)]
struct Columns {
    columns: Vec<Vec<f64>>,
    delays_s: Vec<f64>,
    ports: Vec<Port>,
}

impl Columns {
    fn push(&mut self, column: Vec<f64>, delay_s: f64, port: Port) {
        self.columns.push(column);
        self.delays_s.push(delay_s);
        self.ports.push(port);
    }
}

/// Where δ = 0 the root has no slope at zero head, unless the valve is shut.
fn check_slopes(network: &Network, point: &OperatingPoint, coefficients: &[f64]) -> Result<(), LinearError> {
    for (i, (valve, &k)) in network.valves.iter().zip(coefficients).enumerate() {
        let head_cm = valve.head_cm(&point.levels_cm);
        if k != 0.0 && !valve.law.slope_cm2_s(k, head_cm, network.delta_cm).is_finite() {
            return Err(LinearError::NoSlope { valve: network.spec.valves[i].id.clone(), head_cm });
        }
    }
    Ok(())
}

/// Columns of the valves' coefficients or angles: ∂q/∂k = the law at k = 1, ∂k/∂α = k90 n sinⁿ⁻¹α cos α.
fn valve_columns(
    network: &Network,
    point: &OperatingPoint,
    disturbances: Disturbances,
    flows: &Flows,
    states: &[usize],
    columns: &mut Columns,
) -> Result<(), LinearError> {
    for (i, valve) in network.valves.iter().enumerate() {
        let id = &network.spec.valves[i].id;
        let head = valve.head_cm(&point.levels_cm);
        let mut slope = valve.law.flow_cm3_s(1.0, head, network.delta_cm);
        let port = if disturbances == Disturbances::Angles {
            let alpha = point.angles_deg[i].to_radians();
            let growth = valve.exponent * alpha.sin().powf(valve.exponent - 1.0) * alpha.cos();
            slope *= valve.k90 * growth * 1.0_f64.to_radians();
            Port::new(&format!("α({id})"), "°")
        } else {
            let unit = if valve.law == ValveLaw::Laminar { "cm²/s" } else { "cm^2.5/s" };
            Port::new(&format!("k({id})"), unit)
        };
        if !slope.is_finite() {
            return Err(LinearError::NoAngle { valve: id.clone(), angle_deg: point.angles_deg[i] });
        }
        let mut column = vec![0.0; states.len()];
        for (tank, sign) in [(Some(valve.from), -1.0), (valve.to, 1.0)] {
            let into = tank.and_then(|tank| flows.destination(network, tank));
            let row = |(tank, share)| Some((states.iter().position(|&s| s == tank)?, share));
            if let Some((row, share)) = into.and_then(row) {
                column[row] += share * sign * slope / network.tanks[states[row]].area_cm2;
            }
        }
        columns.push(column, 0.0, port);
    }
    Ok(())
}
