//! Who writes whom: loops, pumps, and loops whose output is another loop's setpoint.

use super::control_loop::OutputRange;
use super::controller::Mode;
use super::loop_spec::LoopSpec;
use crate::plant::{Network, RigError, demand};

/// The loop that writes the setpoint of the loop `tag`.
#[must_use]
pub fn outer_of(loops: &[LoopSpec], tag: &str) -> Option<usize> {
    loops.iter().position(|l| l.cascade_to.as_deref() == Some(tag))
}

fn inner_of<'a>(loops: &'a [LoopSpec], spec: &LoopSpec) -> Option<&'a LoopSpec> {
    let tag = spec.cascade_to.as_ref()?;
    loops.iter().find(|l| l.id == *tag)
}

/// The pump that a loop moves in the end, through its inner loops.
#[must_use]
pub fn final_pump(network: &Network, loops: &[LoopSpec], spec: &LoopSpec) -> Option<usize> {
    let mut last = spec;
    for _ in loops {
        match inner_of(loops, last) {
            Some(inner) => last = inner,
            None => break,
        }
    }
    network.pump(last.pump.as_deref()?)
}

/// Range of what a loop writes: its pump's input, or the setpoint of its inner loop from bottom to rim.
#[must_use]
pub fn output_range(network: &Network, loops: &[LoopSpec], spec: &LoopSpec) -> Option<OutputRange> {
    if let Some(inner) = inner_of(loops, spec) {
        let tank = network.sensors.get(network.sensor(&inner.sensor)?)?.tank;
        let high = network.tanks[tank].height_cm;
        return Some(OutputRange { low: 0.0, high, rate_per_s: f64::INFINITY });
    }
    let pump = &network.pumps[network.pump(spec.pump.as_deref()?)?];
    Some(OutputRange { low: pump.min, high: pump.max, rate_per_s: pump.rate_limit_per_s })
}

/// Indices of the loops such that each comes before the one it writes to.
#[must_use]
pub fn execution_order(loops: &[LoopSpec]) -> Vec<usize> {
    let depth = |spec: &LoopSpec| {
        let mut depth = 0;
        let mut last = spec;
        while let Some(inner) = inner_of(loops, last)
            && depth < loops.len()
        {
            depth += 1;
            last = inner;
        }
        depth
    };
    let mut order: Vec<usize> = (0..loops.len()).collect();
    // Stable: loops that have nothing to do with each other stay in the order of the file.
    order.sort_by_key(|&i| std::cmp::Reverse(depth(&loops[i])));
    order
}

/// Checks the loops of a configuration: tags, targets, values.
///
/// # Errors
/// [`RigError`] naming the loop, field and value.
pub fn check_loops(network: &Network, configuration: &str, loops: &[LoopSpec]) -> Result<(), RigError> {
    let unknown = |reference: &str| RigError::Unknown {
        item: configuration.to_owned(),
        reference: reference.to_owned(),
    };
    for (i, spec) in loops.iter().enumerate() {
        network.sensor(&spec.sensor).ok_or_else(|| unknown(&spec.sensor))?;
        let target = match (&spec.pump, &spec.cascade_to) {
            (Some(pump), None) => {
                network.pump(pump).ok_or_else(|| unknown(pump))?;
                pump
            }
            (None, Some(inner)) => {
                loops.iter().find(|l| l.id == *inner).ok_or_else(|| unknown(inner))?;
                inner
            }
            _ => return Err(RigError::Target { item: spec.id.clone() }),
        };
        let same = |other: &&LoopSpec| other.pump == spec.pump && other.cascade_to == spec.cascade_to;
        if let Some(other) = loops[..i].iter().find(same) {
            return Err(RigError::SharedPump {
                first: other.id.clone(),
                second: spec.id.clone(),
                pump: target.clone(),
            });
        }
    }
    for spec in loops {
        if final_pump(network, loops, spec).is_none() {
            return Err(RigError::CascadeCircle { item: spec.id.clone() });
        }
    }
    loops.iter().try_for_each(|spec| check_loop(network, loops, spec))
}

/// Checks one loop among the loops of its configuration, whose wiring is sound.
///
/// # Errors
/// [`RigError`] naming the loop, field and value.
pub fn check_loop(network: &Network, loops: &[LoopSpec], spec: &LoopSpec) -> Result<(), RigError> {
    let unknown =
        |reference: &str| RigError::Unknown { item: spec.id.clone(), reference: reference.to_owned() };
    let sensor = network.sensor(&spec.sensor).ok_or_else(|| unknown(&spec.sensor))?;
    let rim = network.tanks[network.sensors[sensor].tank].height_cm;
    let on_scale = (0.0..=rim).contains(&spec.setpoint_cm);
    demand(&spec.id, "setpoint_cm", spec.setpoint_cm, on_scale, format!("0…{rim} (rim)"))?;
    spec.check_tuning()?;
    if spec.mode == Mode::Cascade && outer_of(loops, &spec.id).is_none() {
        return Err(RigError::NoOuterLoop { item: spec.id.clone() });
    }
    let range =
        output_range(network, loops, spec).ok_or_else(|| RigError::Target { item: spec.id.clone() })?;
    let range = [range.low, range.high];
    spec.law.check(&spec.id, range)?;
    spec.options.check(&spec.id, &spec.law, range)?;
    if let Some(path) = &spec.options.feedforward {
        let (from_sensor, from_pump) = (network.sensor(&path.from), network.pump(&path.from));
        let own = from_sensor == Some(sensor)
            || from_pump.is_some_and(|p| final_pump(network, loops, spec) == Some(p));
        let other_part = network.valve(&path.from).is_some()
            || network.tank(&path.from).is_some()
            || loops.iter().any(|l| l.id == path.from);
        if own || other_part {
            return Err(RigError::Feedforward { item: spec.id.clone(), from: path.from.clone() });
        }
        if from_sensor.is_none() && from_pump.is_none() {
            return Err(unknown(&path.from));
        }
    }
    Ok(())
}
