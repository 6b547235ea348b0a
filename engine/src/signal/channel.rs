//! Names and units of the columns of a run.

use std::sync::Arc;

use crate::plant::Network;

/// What a channel stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChannelKind {
    /// Setpoint of a loop slot.
    Setpoint(usize),
    /// Measured process variable of a loop slot.
    Pv(usize),
    /// Manipulated variable of a loop slot.
    Mv(usize),
    /// True level of a tank.
    Level(usize),
    /// Input of a pump.
    Input(usize),
    /// Flow that arrives from a pump.
    Arriving(usize),
    /// Flow through a valve.
    ValveFlow(usize),
    /// Angle of a valve.
    Angle(usize),
    /// Spill of a tank.
    Spill(usize),
}

/// One column of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Column name with its unit, for example `h1_cm`.
    pub name: String,
    /// Unit as shown, for example `cm³/s`.
    pub unit: &'static str,
    /// What it stands for.
    pub kind: ChannelKind,
}

/// The columns of a run, without time.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSet {
    /// In the order of a row.
    pub channels: Vec<Channel>,
    /// Number of loop slots: the most loops of any configuration.
    pub slots: usize,
}

impl ChannelSet {
    /// The columns of a rig: sp, pv, mv of each loop slot (numbered when there are several), then levels,
    /// pump inputs and flows, valve flows and angles, spills.
    #[must_use]
    pub fn of(network: &Network) -> Self {
        let spec = &network.spec;
        let slots = spec.configurations.iter().map(|c| c.loops.len()).max().unwrap_or(0);
        let mv_unit = |slot: usize| {
            let in_slot = spec.configurations.iter().find_map(|c| c.loops.get(slot));
            let level = in_slot.is_some_and(|l| l.cascade_to.is_some());
            if level { "cm" } else { spec.pumps.first().map_or("", |p| p.unit.symbol()) }
        };
        let mut channels = Vec::new();
        let mut push = |name: String, unit, kind| channels.push(Channel { name, unit, kind });
        for slot in 0..slots {
            let number = if slots > 1 { (slot + 1).to_string() } else { String::new() };
            push(format!("sp{number}"), "cm", ChannelKind::Setpoint(slot));
            push(format!("pv{number}"), "cm", ChannelKind::Pv(slot));
            push(format!("mv{number}"), mv_unit(slot), ChannelKind::Mv(slot));
        }
        for (i, tank) in spec.tanks.iter().enumerate() {
            push(format!("{}_cm", tank.signal), "cm", ChannelKind::Level(i));
        }
        for (i, pump) in spec.pumps.iter().enumerate() {
            push(
                format!("{}_{}", pump.signal, pump.unit.suffix()),
                pump.unit.symbol(),
                ChannelKind::Input(i),
            );
            push(format!("{}_cm3_s", pump.flow_signal), "cm³/s", ChannelKind::Arriving(i));
        }
        for (i, valve) in spec.valves.iter().enumerate() {
            push(format!("{}_cm3_s", valve.signal), "cm³/s", ChannelKind::ValveFlow(i));
            push(format!("{}_deg", valve.id.to_lowercase()), "°", ChannelKind::Angle(i));
        }
        for (i, tank) in spec.tanks.iter().enumerate() {
            push(format!("{}_spill_cm3_s", tank.signal), "cm³/s", ChannelKind::Spill(i));
        }
        Self { channels, slots }
    }

    /// Number of columns.
    #[must_use]
    pub fn len(&self) -> usize {
        self.channels.len()
    }

    /// Whether there is no column.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.channels.is_empty()
    }

    /// Column of a kind.
    #[must_use]
    pub fn column(&self, kind: ChannelKind) -> Option<usize> {
        self.channels.iter().position(|c| c.kind == kind)
    }
}

/// Consecutive samples of a run, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleBlock {
    /// Number of the run the rows belong to; it grows with every restart.
    pub run: u64,
    /// The columns.
    pub channels: Arc<ChannelSet>,
    /// Time of each row in seconds of the run.
    pub time_s: Vec<f64>,
    /// Rows one after the other: `time_s.len() × channels.len()`.
    pub values: Vec<f64>,
}

impl SampleBlock {
    /// One row.
    #[must_use]
    pub fn row(&self, index: usize) -> &[f64] {
        let width = self.channels.len();
        &self.values[index * width..(index + 1) * width]
    }

    /// One column.
    pub fn column(&self, column: usize) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().skip(column).step_by(self.channels.len()).copied()
    }
}
