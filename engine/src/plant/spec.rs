//! What a rig file says: plain data, names instead of indices, nothing checked yet.
//!
//! [`super::Network::new`] turns it into a checked network. `assets/SCHEMA.md` documents every field.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::two_numbers;
use crate::control::LoopSpec;

/// A text in one language for all, or one per language tag (`en`, `pt-BR`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Text {
    /// The same for every language.
    One(String),
    /// Keyed by language tag; `en` is the fallback.
    ByLanguage(BTreeMap<String, String>),
}

impl Text {
    /// The text for a language tag, else English, else any.
    #[must_use]
    pub fn get(&self, language: &str) -> &str {
        match self {
            Self::One(text) => text,
            Self::ByLanguage(map) => {
                map.get(language).or_else(|| map.get("en")).or_else(|| map.values().next()).map_or("", |s| s)
            }
        }
    }
}

/// A laboratory rig of tanks, pumps and valves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSpec {
    /// Version of the file format; 1.
    pub schema: u32,
    /// Short name without spaces, unique among presets.
    pub id: String,
    /// Name shown to people.
    pub title: Text,
    /// Where the numbers come from and what they are good for.
    pub note: Option<Text>,
    /// δ of the regularised √ law in cm; 0 gives the plain square root.
    pub delta_cm: f64,
    /// Sample time of the control loops in seconds.
    pub sample_time_s: f64,
    /// Total water of a closed circuit in cm³; the reservoir starts with what the others leave.
    pub water_cm3: Option<f64>,
    /// Tank that holds the rest of `water_cm3`, and with which a bumped tank exchanges water.
    pub reservoir: Option<String>,
    /// Converters between plant and controller; absent for ideal ones.
    pub converters: Option<ConverterSpec>,
    /// The vessels.
    #[serde(rename = "tank")]
    pub tanks: Vec<TankSpec>,
    /// The pumps.
    #[serde(rename = "pump", default)]
    pub pumps: Vec<PumpSpec>,
    /// The valves.
    #[serde(rename = "valve", default)]
    pub valves: Vec<ValveSpec>,
    /// The level sensors.
    #[serde(rename = "sensor", default)]
    pub sensors: Vec<SensorSpec>,
    /// Named settings of valves, delays and loops; the first one is the start.
    #[serde(rename = "configuration", default)]
    pub configurations: Vec<ConfigurationSpec>,
    /// Parameters that a fit to a recording may change, with their bounds: by tag, then by field.
    #[serde(default, deserialize_with = "two_numbers::by_tag")]
    pub fit: BTreeMap<String, BTreeMap<String, [f64; 2]>>,
}

/// One tank.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TankSpec {
    /// Tag, for example `TQ1`.
    pub id: String,
    /// Name of its level in recordings, for example `h1`.
    pub signal: String,
    /// Cross-section in cm².
    pub area_cm2: f64,
    /// Height of the rim in cm.
    pub height_cm: f64,
    /// Level at the start in cm.
    pub initial_cm: f64,
    /// Tank that takes what this one spills; absent: the water is lost to the outside.
    pub spills_to: Option<String>,
    /// Share of the spill, from 0 to 1, that gets there; the rest is lost to the outside.
    #[serde(default = "one")]
    pub spill_share: f64,
    /// Place in the drawing: column and row of the tank's middle, in grid units.
    #[serde(default, deserialize_with = "two_numbers::optional")]
    pub at: Option<[f64; 2]>,
    /// Width in the drawing, in grid units.
    pub width: Option<f64>,
}

/// One pump with its characteristic curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PumpSpec {
    /// Tag, for example `BA01`.
    pub id: String,
    /// Name of its input in recordings, for example `u`.
    pub signal: String,
    /// Name of the flow that arrives, for example `q_in`.
    pub flow_signal: String,
    /// Tank it draws from; absent: an endless supply outside.
    pub from: Option<String>,
    /// Tank it feeds.
    pub to: String,
    /// Shares of the flow, between 0 and 1, that a splitting valve sends to other tanks instead.
    #[serde(default)]
    pub split: BTreeMap<String, f64>,
    /// Unit of its input.
    pub unit: InputUnit,
    /// Lowest input.
    pub min: f64,
    /// Highest input.
    pub max: f64,
    /// Input at the start.
    pub initial: f64,
    /// Transport delay of the stream in seconds.
    #[serde(default)]
    pub delay_s: f64,
    /// Largest change of the input per second; absent: none.
    pub rate_limit: Option<f64>,
    /// Points (input, flow in cm³/s), inputs increasing; linear between, constant outside.
    #[serde(deserialize_with = "two_numbers::list")]
    pub curve: Vec<[f64; 2]>,
}

/// Unit of a pump's input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum InputUnit {
    /// Volt.
    #[serde(rename = "V")]
    Volt,
    /// Cubic centimetres per second.
    #[serde(rename = "cm3/s")]
    Cm3PerS,
    /// Percent.
    #[serde(rename = "%")]
    Percent,
}

impl InputUnit {
    /// As shown beside a number.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Volt => "V",
            Self::Cm3PerS => "cm³/s",
            Self::Percent => "%",
        }
    }

    /// As appended to a column's name.
    #[must_use]
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Volt => "v",
            Self::Cm3PerS => "cm3_s",
            Self::Percent => "percent",
        }
    }
}

/// What drives the flow through a valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ValveDrive {
    /// The level of the upper tank: the water falls freely behind the valve.
    FreeFall,
    /// The difference of the two levels, in either direction.
    Between,
}

/// How the flow grows with its driving head.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum ValveLaw {
    /// q = k √h, k in cm^2.5/s.
    #[default]
    SquareRoot,
    /// q = k h, k in cm²/s.
    Laminar,
}

/// One valve, `k(α) = k90 sinⁿ α`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValveSpec {
    /// Tag, for example `FV01`.
    pub id: String,
    /// Name of its flow in recordings, for example `q1`.
    pub signal: String,
    /// Tank it drains.
    pub from: String,
    /// Tank it feeds; absent: the outside.
    pub to: Option<String>,
    /// What drives the flow.
    pub drive: ValveDrive,
    /// How the flow grows with the head.
    #[serde(default)]
    pub law: ValveLaw,
    /// k at 90°, in cm^2.5/s (square root) or cm²/s (laminar).
    pub k90: f64,
    /// n of the opening characteristic.
    #[serde(default = "one")]
    pub exponent: f64,
    /// Angle at the start, 0 (shut) to 90 (open).
    pub angle_deg: f64,
}

fn one() -> f64 {
    1.0
}

/// One level sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    /// Tag, for example `LT02`.
    pub id: String,
    /// Tank it measures.
    pub tank: String,
    /// Standard deviation of its noise in cm.
    #[serde(default)]
    pub noise_cm: f64,
    /// Level at 4 mA and at 20 mA in cm; absent: an ideal sensor.
    #[serde(default, deserialize_with = "two_numbers::optional")]
    pub range_cm: Option<[f64; 2]>,
    /// Smallest difference it tells apart in cm, applied when resolution is switched on.
    #[serde(default)]
    pub resolution_cm: f64,
    /// What it shows is `gain · level + offset_cm`: 1 where it is calibrated.
    #[serde(default = "one")]
    pub gain: f64,
    /// Zero of the sensor in cm.
    #[serde(default)]
    pub offset_cm: f64,
}

/// Analogue converters between plant and controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConverterSpec {
    /// Resolution of the input converter in bits.
    pub adc_bits: u32,
    /// Voltage at its highest code.
    pub adc_full_scale_v: f64,
    /// Resistor that turns the sensor's current into a voltage, in Ω.
    pub shunt_ohm: f64,
    /// Resolution of the output converter in bits.
    pub dac_bits: u32,
    /// Voltage at its highest code.
    pub dac_full_scale_v: f64,
}

impl ConverterSpec {
    /// Step of the output converter in V.
    #[must_use]
    pub fn dac_step_v(&self) -> f64 {
        self.dac_full_scale_v / f64::from(self.dac_bits).exp2()
    }
}

/// A named state of the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfigurationSpec {
    /// Short name, for example `coupled`.
    pub id: String,
    /// Name shown to people.
    pub title: Text,
    /// Valve tag to angle in degrees.
    #[serde(default)]
    pub angles_deg: BTreeMap<String, f64>,
    /// Pump tag to transport delay in seconds.
    #[serde(default)]
    pub delays_s: BTreeMap<String, f64>,
    /// Start at the steady state in which each loop's PV is at its setpoint.
    #[serde(default)]
    pub start_steady: bool,
    /// Control loops of this configuration.
    #[serde(rename = "loop", default)]
    pub loops: Vec<LoopSpec>,
}
