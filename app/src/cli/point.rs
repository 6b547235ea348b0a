//! Operating points as they stand on the command line: `LIC-02=15`, `BA01=2.4`, `FV01=33`.

use vasos_engine::control::Mode;
use vasos_engine::plant::{Network, OperatingPoint, RigError, SteadyTarget};

use super::Refusal;

/// The way to write it, for messages.
const FORM: &str = "TAG=NUMBER, a loop with a level in cm, a pump with its input, or a valve with its angle";

/// A configuration by id; the first where none is named.
pub fn configuration(network: &Network, id: Option<&str>) -> Result<usize, Refusal> {
    let Some(id) = id else { return Ok(0) };
    let configurations = &network.spec.configurations;
    configurations.iter().position(|c| c.id == id).ok_or_else(|| {
        let known = configurations.iter().map(|c| c.id.as_str()).collect::<Vec<_>>().join(", ");
        Refusal(format!("there is no configuration '{id}': there are {known}"))
    })
}

/// The point at rest that `at` asks for, from `start`. Loops in automatic that `at` does not name are held at their
/// setpoints, unless it gives their pump an input.
pub fn at_rest(
    network: &Network,
    configuration: usize,
    start: &OperatingPoint,
    at: &[String],
) -> Result<OperatingPoint, Refusal> {
    let mut point = start.clone();
    let loops = network.spec.configurations.get(configuration).map_or(&[][..], |c| &c.loops);
    let mut held: Vec<Option<f64>> =
        loops.iter().map(|l| (l.mode == Mode::Automatic).then_some(l.setpoint_cm)).collect();
    for text in at {
        let (tag, value) = tag_and_number(text)?;
        if let Some(i) = loops.iter().position(|l| l.id == tag) {
            held[i] = Some(value);
        } else if let Some(pump) = network.pump(tag) {
            let p = &network.pumps[pump];
            in_range(tag, "input", value, p.min, p.max)?;
            point.inputs[pump] = value;
            for (level, l) in held.iter_mut().zip(loops).filter(|(_, l)| l.pump.as_deref() == Some(tag)) {
                let given = at.iter().any(|other| other.starts_with(&format!("{}=", l.id)));
                if given {
                    return Err(Refusal(format!("{tag} and {} are both given, but {tag} is its pump", l.id)));
                }
                *level = None;
            }
        } else if let Some(valve) = network.valve(tag) {
            in_range(tag, "angle_deg", value, 0.0, 90.0)?;
            point.angles_deg[valve] = value;
        } else {
            let known = loops.iter().map(|l| &l.id);
            let known = known.chain(network.spec.pumps.iter().map(|p| &p.id));
            let known = known.chain(network.spec.valves.iter().map(|v| &v.id));
            let known = known.map(String::as_str).collect::<Vec<_>>().join(", ");
            return Err(Refusal(format!("'{tag}' cannot be set here: there are {known}")));
        }
    }
    let target = |(l, level): (&vasos_engine::control::LoopSpec, &Option<f64>)| {
        let (pump, sensor) = (network.pump(l.pump.as_deref()?)?, network.sensor(&l.sensor)?);
        Some(SteadyTarget { pump, tank: network.sensors[sensor].tank, level_cm: (*level)? })
    };
    let targets: Vec<SteadyTarget> = loops.iter().zip(&held).filter_map(target).collect();
    point.at_levels(network, &targets).map_err(Refusal::of)
}

fn tag_and_number(text: &str) -> Result<(&str, f64), Refusal> {
    let (tag, number) = text.split_once('=').ok_or_else(|| Refusal(format!("'{text}': write {FORM}")))?;
    let value = number.trim().parse().ok().filter(|v: &f64| v.is_finite());
    let value = value.ok_or_else(|| Refusal(format!("{tag} = '{number}' is not a number: write {FORM}")))?;
    Ok((tag.trim(), value))
}

fn in_range(item: &str, field: &'static str, value: f64, low: f64, high: f64) -> Result<(), Refusal> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let (item, expected) = (item.to_owned(), format!("{low}…{high}"));
    Err(Refusal::of(RigError::Value { item, field, value, expected }))
}

/// A tank by its own tag, that of a sensor on it, or that of a loop of the configuration.
pub fn tank(network: &Network, configuration: usize, tag: &str) -> Result<usize, Refusal> {
    let loops = network.spec.configurations.get(configuration).map_or(&[][..], |c| &c.loops);
    let sensor = loops.iter().find(|l| l.id == tag).map_or(tag, |l| &l.sensor);
    let by_sensor = || network.sensor(sensor).map(|i| network.sensors[i].tank);
    network.tank(tag).or_else(by_sensor).ok_or_else(|| {
        let tags = network.spec.tanks.iter().map(|t| t.id.as_str()).collect::<Vec<_>>().join(", ");
        Refusal(format!("there is no tank, sensor or loop '{tag}': tanks are {tags}"))
    })
}
