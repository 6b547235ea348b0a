//! What can be wrong with a rig, and with a value sent to it.

use crate::explain::{Explain, number};

/// Why a rig description or a value for the rig is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigError {
    /// A file of a format this version does not read.
    #[error("this rig file has schema {found}; this version reads schema {known}")]
    Schema {
        /// Schema of the file.
        found: u32,
        /// Schema this version reads.
        known: u32,
    },
    /// A rig without a tank.
    #[error("the rig has no tank: add at least one [[tank]]")]
    NoTank,
    /// An id or signal that cannot be a column, a path or an argument.
    #[error("'{id}' is not possible as an id or signal: use letters, digits, _, - and . without blanks")]
    Name {
        /// Offending name.
        id: String,
    },
    /// The same tag twice.
    #[error(
        "the tag {id} is used twice: every tank, pump, valve, sensor, loop, configuration and signal needs a name of its own"
    )]
    Duplicate {
        /// Tag.
        id: String,
    },
    /// A tag that names nothing.
    #[error("{item} refers to {reference}, which is not among the rig's tags")]
    Unknown {
        /// Who refers.
        item: String,
        /// Missing tag.
        reference: String,
    },
    /// A number outside what its field can take.
    #[error("{item}: {field} = {} is not possible; it must be {expected}", number(*.value))]
    Value {
        /// Tag of the item.
        item: String,
        /// Field with its unit.
        field: &'static str,
        /// Offending value.
        value: f64,
        /// What is expected, for example `> 0`.
        expected: String,
    },
    /// A pump curve that is not a function.
    #[error(
        "the curve of pump {item} needs at least two points with increasing input and flows of 0 or more"
    )]
    Curve {
        /// Tag of the pump.
        item: String,
    },
    /// A valve or pump from a tank to itself.
    #[error("{item} leads from {tank} back to {tank}")]
    Loop {
        /// Tag of the valve or pump.
        item: String,
        /// Tank at both ends.
        tank: String,
    },
    /// A fault that such a part cannot have.
    #[error("{tag} cannot have the fault {kind}; it can have: {possible}")]
    Fault {
        /// Tag of the part.
        tag: String,
        /// The fault.
        kind: &'static str,
        /// What is possible.
        possible: String,
    },
    /// Nothing to repair.
    #[error("{tag} has no such fault to repair")]
    Sound {
        /// Tag of the part.
        tag: String,
    },
    /// Two loops write the same pump, or the setpoint of the same loop.
    #[error("the loops {first} and {second} both write {pump}")]
    SharedPump {
        /// One loop.
        first: String,
        /// The other.
        second: String,
        /// Pump or loop both write.
        pump: String,
    },
    /// A loop that writes nothing, or two things.
    #[error("the loop {item} must write one thing: give it either a pump or, with cascade_to, a loop")]
    Target {
        /// Tag of the loop.
        item: String,
    },
    /// Loops that write each other's setpoints in a circle.
    #[error("the cascade from {item} leads to no pump: its loops write each other's setpoints")]
    CascadeCircle {
        /// Tag of a loop.
        item: String,
    },
    /// Cascade mode without a loop that gives the setpoint.
    #[error("{item} cannot be in cascade: no loop writes its setpoint")]
    NoOuterLoop {
        /// Tag of the loop.
        item: String,
    },
    /// A feed-forward from what is no disturbance of the loop.
    #[error(
        "the feed-forward of {item} cannot come from {from}: it takes another sensor or another pump than the loop's own"
    )]
    Feedforward {
        /// Tag of the loop.
        item: String,
        /// Tag it was to come from.
        from: String,
    },
    /// Water that does not fit.
    #[error("the reservoir {tank} would start at {} cm: the tanks hold more than water_cm3 or less than the rim allows", number(*.level_cm))]
    Water {
        /// Reservoir.
        tank: String,
        /// Level it would start at, in cm.
        level_cm: f64,
    },
    /// A level no input can hold.
    #[error("{tank} cannot be held at {} cm: with these valves the pump holds between {} and {} cm", number(*.wanted_cm), number(*.lowest_cm), number(*.highest_cm))]
    Unreachable {
        /// Tank.
        tank: String,
        /// Wanted level in cm.
        wanted_cm: f64,
        /// Lowest level the input range can hold, in cm.
        lowest_cm: f64,
        /// Highest level the input range can hold, in cm.
        highest_cm: f64,
    },
    /// Levels for which a pump would have to deliver what it cannot.
    #[error("these levels cannot be held together: {pump} would have to deliver {} cm³/s and delivers {} to {}", number(*.needed_cm3_s), number(*.lowest_cm3_s), number(*.highest_cm3_s))]
    OutOfReach {
        /// Pump.
        pump: String,
        /// Flow it would have to deliver, in cm³/s.
        needed_cm3_s: f64,
        /// Lowest flow its input range gives, in cm³/s.
        lowest_cm3_s: f64,
        /// Highest flow, in cm³/s.
        highest_cm3_s: f64,
    },
    /// Levels that no flows of the free pumps hold.
    #[error("no flows of these pumps hold {tanks} at these levels together: does every pump reach its tank?")]
    NoBalance {
        /// Tanks.
        tanks: String,
    },
}

/// Refuses a value of an item unless it is finite and `ok`.
pub(crate) fn demand(
    item: &str,
    field: &'static str,
    value: f64,
    ok: bool,
    expected: impl Into<String>,
) -> Result<(), RigError> {
    if value.is_finite() && ok {
        Ok(())
    } else {
        Err(RigError::Value { item: item.to_owned(), field, value, expected: expected.into() })
    }
}

impl Explain for RigError {
    fn key(&self) -> &'static str {
        match self {
            Self::Schema { .. } => "rig.schema",
            Self::NoTank => "rig.no_tank",
            Self::Name { .. } => "rig.name",
            Self::Duplicate { .. } => "rig.duplicate",
            Self::Unknown { .. } => "rig.unknown",
            Self::Value { .. } => "rig.value",
            Self::Curve { .. } => "rig.curve",
            Self::Loop { .. } => "rig.loop",
            Self::Fault { .. } => "rig.fault",
            Self::Sound { .. } => "rig.sound",
            Self::SharedPump { .. } => "rig.shared_pump",
            Self::Target { .. } => "rig.target",
            Self::CascadeCircle { .. } => "rig.cascade_circle",
            Self::NoOuterLoop { .. } => "rig.no_outer_loop",
            Self::Feedforward { .. } => "rig.feedforward",
            Self::Water { .. } => "rig.water",
            Self::Unreachable { .. } => "rig.unreachable",
            Self::OutOfReach { .. } => "rig.out_of_reach",
            Self::NoBalance { .. } => "rig.no_balance",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Schema { found, known } => vec![("found", found.to_string()), ("known", known.to_string())],
            Self::NoTank => vec![],
            Self::Name { id } | Self::Duplicate { id } => vec![("id", id.clone())],
            Self::Unknown { item, reference } => {
                vec![("item", item.clone()), ("reference", reference.clone())]
            }
            Self::Value { item, field, value, expected } => vec![
                ("item", item.clone()),
                ("field", (*field).to_owned()),
                ("value", number(*value)),
                ("expected", expected.clone()),
            ],
            Self::Curve { item } => vec![("item", item.clone())],
            Self::Loop { item, tank } => vec![("item", item.clone()), ("tank", tank.clone())],
            Self::Fault { tag, kind, possible } => {
                vec![("tag", tag.clone()), ("kind", (*kind).to_owned()), ("possible", possible.clone())]
            }
            Self::Sound { tag } => vec![("tag", tag.clone())],
            Self::Target { item } | Self::CascadeCircle { item } | Self::NoOuterLoop { item } => {
                vec![("item", item.clone())]
            }
            Self::SharedPump { first, second, pump } => {
                vec![("first", first.clone()), ("second", second.clone()), ("pump", pump.clone())]
            }
            Self::Feedforward { item, from } => vec![("item", item.clone()), ("from", from.clone())],
            Self::Water { tank, level_cm } => vec![("tank", tank.clone()), ("level_cm", number(*level_cm))],
            Self::Unreachable { tank, wanted_cm, lowest_cm, highest_cm } => vec![
                ("tank", tank.clone()),
                ("wanted_cm", number(*wanted_cm)),
                ("lowest_cm", number(*lowest_cm)),
                ("highest_cm", number(*highest_cm)),
            ],
            Self::OutOfReach { pump, needed_cm3_s, lowest_cm3_s, highest_cm3_s } => vec![
                ("pump", pump.clone()),
                ("needed_cm3_s", number(*needed_cm3_s)),
                ("lowest_cm3_s", number(*lowest_cm3_s)),
                ("highest_cm3_s", number(*highest_cm3_s)),
            ],
            Self::NoBalance { tanks } => vec![("tanks", tanks.clone())],
        }
    }
}

impl RigError {
    /// One of each kind, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        vec![
            Self::Schema { found: 7, known: 1 },
            Self::NoTank,
            Self::Name { id: text("TQ 1") },
            Self::Duplicate { id: text("TQ1") },
            Self::Unknown { item: text("FV01"), reference: text("TQ9") },
            Self::Value { item: text("TQ1"), field: "area_cm2", value: -1.0, expected: text("> 0") },
            Self::Curve { item: text("BA01") },
            Self::Loop { item: text("FV01"), tank: text("TQ1") },
            Self::Fault { tag: text("FV01"), kind: "stuck", possible: text("clogged") },
            Self::Sound { tag: text("LT02") },
            Self::SharedPump { first: text("LIC-01"), second: text("LIC-02"), pump: text("BA01") },
            Self::Target { item: text("LIC-01") },
            Self::CascadeCircle { item: text("LIC-01") },
            Self::NoOuterLoop { item: text("LIC-01") },
            Self::Feedforward { item: text("LIC-01"), from: text("BA01") },
            Self::Water { tank: text("TQ4"), level_cm: -3.5 },
            Self::Unreachable { tank: text("TQ2"), wanted_cm: 26.0, lowest_cm: 4.4, highest_cm: 20.5 },
            Self::OutOfReach {
                pump: text("BA01"),
                needed_cm3_s: 120.5,
                lowest_cm3_s: 0.0,
                highest_cm3_s: 77.9,
            },
            Self::NoBalance { tanks: text("TQ1, TQ2") },
        ]
    }
}
