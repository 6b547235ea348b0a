//! The checked tank network: indices instead of names, every number in its range.

use super::curve::Curve;
use super::error::{RigError, demand};
use super::motions::MOST_PARTS;
use super::names::check_names;
use super::spec::{ConfigurationSpec, InputUnit, PumpSpec, RigSpec, SensorSpec, ValveDrive, ValveLaw};
use super::streams::widest;

/// The schema of rig files this version reads.
pub const RIG_SCHEMA: u32 = 1;

/// Bound on sizes, flows and coefficients: far beyond any rig, far from where sums and products overflow.
const MOST: f64 = 1e9;
/// Least size of a tank in cm and cm² and of a converter in V and Ω, so that quotients stay numbers.
const LEAST_SIZE: f64 = 1e-6;
/// Farthest place and widest tank of the drawing, in grid units.
const MOST_GRID: f64 = 1000.0;
/// Shortest transport delay other than none, in seconds: the integrator takes at least a step in each.
const SHORTEST_DELAY_S: f64 = 1e-3;

/// One tank of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct Tank {
    /// Cross-section in cm².
    pub area_cm2: f64,
    /// Rim in cm.
    pub height_cm: f64,
    /// Tank that takes the spill; `None`: the outside.
    pub spills_to: Option<usize>,
    /// Share of the spill that gets there; the rest goes outside.
    pub spill_share: f64,
}

/// One pump of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct Pump {
    /// Tank it draws from; `None`: an endless supply.
    pub from: Option<usize>,
    /// Tank it feeds.
    pub to: usize,
    /// Tanks it feeds with the share of the flow each gets: [`Self::to`] first, the shares add up to 1.
    pub outlets: Vec<(usize, f64)>,
    /// Unit of the input.
    pub unit: InputUnit,
    /// Lowest input.
    pub min: f64,
    /// Highest input.
    pub max: f64,
    /// Largest change of the input per second; ∞ for none.
    pub rate_limit_per_s: f64,
    curve: Curve,
}

impl Pump {
    /// Flow in cm³/s for an input: linear between the curve's points, constant outside.
    #[must_use]
    pub fn flow_cm3_s(&self, input: f64) -> f64 {
        self.curve.flow_cm3_s(input, &mut 0)
    }

    /// As [`Self::flow_cm3_s`], looking first at the piece of the curve where the last input lay.
    #[inline]
    pub(crate) fn flow_near(&self, input: f64, piece: &mut usize) -> f64 {
        self.curve.flow_cm3_s(input, piece)
    }
}

/// One valve of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct Valve {
    /// Tank it drains.
    pub from: usize,
    /// Tank it feeds; `None`: the outside.
    pub to: Option<usize>,
    /// What drives the flow.
    pub drive: ValveDrive,
    /// How the flow grows with the head.
    pub law: ValveLaw,
    /// k at 90° in cm^2.5/s or cm²/s.
    pub k90: f64,
    /// Exponent n of sinⁿ α.
    pub exponent: f64,
}

impl Valve {
    /// `k(α) = k90 sinⁿ α` for an angle in degrees; 0 at 0°.
    #[must_use]
    pub fn coefficient(&self, angle_deg: f64) -> f64 {
        if angle_deg <= 0.0 { 0.0 } else { self.k90 * angle_deg.to_radians().sin().powf(self.exponent) }
    }

    /// The head in cm that drives the flow.
    #[must_use]
    #[inline]
    pub fn head_cm(&self, levels_cm: &[f64]) -> f64 {
        let from = levels_cm[self.from];
        match (self.drive, self.to) {
            (ValveDrive::Between, Some(to)) => from - levels_cm[to],
            _ => from.max(0.0),
        }
    }
}

/// One sensor of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Tank it measures.
    pub tank: usize,
    /// Its data.
    pub spec: SensorSpec,
}

/// The structure of a rig, checked; it does not change while the rig runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// The description it was made from.
    pub spec: RigSpec,
    /// δ in cm.
    pub delta_cm: f64,
    /// Tanks in the order of the file.
    pub tanks: Vec<Tank>,
    /// Pumps in the order of the file.
    pub pumps: Vec<Pump>,
    /// Valves in the order of the file.
    pub valves: Vec<Valve>,
    /// Sensors in the order of the file.
    pub sensors: Vec<Sensor>,
    /// Tank that a bump exchanges water with; `None`: the outside.
    pub reservoir: Option<usize>,
}

fn check_delay(item: &str, delay_s: f64) -> Result<(), RigError> {
    let ok = delay_s == 0.0 || (SHORTEST_DELAY_S..=3600.0).contains(&delay_s);
    demand(item, "delay_s", delay_s, ok, "0 or 0.001…3600")
}

impl Network {
    /// Checks a description.
    ///
    /// # Errors
    /// [`RigError`] with the tag, the field and the offending value.
    pub fn new(spec: RigSpec) -> Result<Self, RigError> {
        if spec.schema != RIG_SCHEMA {
            return Err(RigError::Schema { found: spec.schema, known: RIG_SCHEMA });
        }
        if spec.tanks.is_empty() {
            return Err(RigError::NoTank);
        }
        check_names(&spec)?;
        demand(&spec.id, "delta_cm", spec.delta_cm, (0.0..=MOST).contains(&spec.delta_cm), "0…1e9")?;
        let sampled = (1e-3..=3600.0).contains(&spec.sample_time_s);
        demand(&spec.id, "sample_time_s", spec.sample_time_s, sampled, "0.001…3600")?;
        if let Some(c) = &spec.converters {
            let sizes = LEAST_SIZE..=MOST;
            demand(&spec.id, "shunt_ohm", c.shunt_ohm, sizes.contains(&c.shunt_ohm), "1e-6…1e9")?;
            demand(
                &spec.id,
                "adc_full_scale_v",
                c.adc_full_scale_v,
                sizes.contains(&c.adc_full_scale_v),
                "1e-6…1e9",
            )?;
            demand(
                &spec.id,
                "dac_full_scale_v",
                c.dac_full_scale_v,
                sizes.contains(&c.dac_full_scale_v),
                "1e-6…1e9",
            )?;
            demand(&spec.id, "adc_bits", f64::from(c.adc_bits), (1..=32).contains(&c.adc_bits), "1…32")?;
            demand(&spec.id, "dac_bits", f64::from(c.dac_bits), (1..=32).contains(&c.dac_bits), "1…32")?;
        }
        let network = Self {
            delta_cm: spec.delta_cm,
            tanks: tanks(&spec)?,
            pumps: pumps(&spec)?,
            valves: valves(&spec)?,
            sensors: sensors(&spec)?,
            reservoir: spec.reservoir.as_deref().map(|r| tank_index(&spec, &spec.id, r)).transpose()?,
            spec,
        };
        let parts = widest(&network).max(network.valves.len() + network.tanks.len());
        let expected = format!("at most {MOST_PARTS} tanks, valves and pumps");
        demand(&network.spec.id, "size", parts as f64, parts <= MOST_PARTS, expected)?;
        for configuration in &network.spec.configurations {
            network.check_configuration(configuration)?;
        }
        if let Some(water) = network.spec.water_cm3 {
            demand(&network.spec.id, "water_cm3", water, water > 0.0, "> 0")?;
        }
        Ok(network)
    }

    /// Index of a tank by tag.
    #[must_use]
    pub fn tank(&self, id: &str) -> Option<usize> {
        self.spec.tanks.iter().position(|t| t.id == id)
    }

    /// Index of a pump by tag.
    #[must_use]
    pub fn pump(&self, id: &str) -> Option<usize> {
        self.spec.pumps.iter().position(|p| p.id == id)
    }

    /// Index of a valve by tag.
    #[must_use]
    pub fn valve(&self, id: &str) -> Option<usize> {
        self.spec.valves.iter().position(|v| v.id == id)
    }

    /// Index of a sensor by tag.
    #[must_use]
    pub fn sensor(&self, id: &str) -> Option<usize> {
        self.spec.sensors.iter().position(|s| s.id == id)
    }

    fn check_configuration(&self, configuration: &ConfigurationSpec) -> Result<(), RigError> {
        let unknown = |reference: &str| RigError::Unknown {
            item: configuration.id.clone(),
            reference: reference.to_owned(),
        };
        for (id, &angle) in &configuration.angles_deg {
            self.valve(id).ok_or_else(|| unknown(id))?;
            demand(id, "angle_deg", angle, (0.0..=90.0).contains(&angle), "0…90")?;
        }
        for (id, &delay) in &configuration.delays_s {
            self.pump(id).ok_or_else(|| unknown(id))?;
            check_delay(id, delay)?;
        }
        crate::control::check_loops(self, &configuration.id, &configuration.loops)
    }
}

fn tank_index(spec: &RigSpec, item: &str, id: &str) -> Result<usize, RigError> {
    spec.tanks
        .iter()
        .position(|t| t.id == id)
        .ok_or_else(|| RigError::Unknown { item: item.to_owned(), reference: id.to_owned() })
}

fn tanks(spec: &RigSpec) -> Result<Vec<Tank>, RigError> {
    spec.tanks
        .iter()
        .map(|t| {
            let sizes = LEAST_SIZE..=MOST;
            demand(&t.id, "area_cm2", t.area_cm2, sizes.contains(&t.area_cm2), "1e-6…1e9")?;
            demand(&t.id, "height_cm", t.height_cm, sizes.contains(&t.height_cm), "1e-6…1e9")?;
            for place in t.at.into_iter().flatten() {
                demand(&t.id, "at", place, place.abs() <= MOST_GRID, "-1000…1000")?;
            }
            if let Some(width) = t.width {
                demand(&t.id, "width", width, width > 0.0 && width <= MOST_GRID, "> 0 and ≤ 1000")?;
            }
            let in_tank = (0.0..=t.height_cm).contains(&t.initial_cm);
            demand(&t.id, "initial_cm", t.initial_cm, in_tank, format!("0…{} (rim)", t.height_cm))?;
            let spills_to = t.spills_to.as_deref().map(|o| tank_index(spec, &t.id, o)).transpose()?;
            if spills_to.is_some_and(|o| spec.tanks[o].id == t.id) {
                return Err(RigError::Loop { item: t.id.clone(), tank: t.id.clone() });
            }
            demand(&t.id, "spill_share", t.spill_share, (0.0..=1.0).contains(&t.spill_share), "0…1")?;
            Ok(Tank { area_cm2: t.area_cm2, height_cm: t.height_cm, spills_to, spill_share: t.spill_share })
        })
        .collect()
}

fn pumps(spec: &RigSpec) -> Result<Vec<Pump>, RigError> {
    spec.pumps
        .iter()
        .map(|p| {
            let from = p.from.as_deref().map(|f| tank_index(spec, &p.id, f)).transpose()?;
            let to = tank_index(spec, &p.id, &p.to)?;
            if from == Some(to) {
                return Err(RigError::Loop { item: p.id.clone(), tank: p.to.clone() });
            }
            let outlets = outlets(spec, p, to, from)?;
            demand(&p.id, "min", p.min, p.min.abs() <= MOST, "-1e9…1e9")?;
            let above = p.max > p.min && p.max <= MOST;
            demand(&p.id, "max", p.max, above, format!("> min = {} and ≤ 1e9", p.min))?;
            let in_range = (p.min..=p.max).contains(&p.initial);
            demand(&p.id, "initial", p.initial, in_range, format!("{}…{}", p.min, p.max))?;
            check_delay(&p.id, p.delay_s)?;
            let rate = p.rate_limit.unwrap_or(f64::MAX);
            demand(&p.id, "rate_limit", rate, rate > 0.0, "> 0")?;
            let increasing = p.curve.len() >= 2 && p.curve.windows(2).all(|w| w[1][0] > w[0][0]);
            if !increasing || p.curve.iter().any(|q| !q[0].is_finite() || !q[1].is_finite() || q[1] < 0.0) {
                return Err(RigError::Curve { item: p.id.clone() });
            }
            for &point in p.curve.as_flattened() {
                demand(&p.id, "curve", point, point.abs() <= MOST, "within ±1e9")?;
            }
            Ok(Pump {
                from,
                to,
                outlets,
                unit: p.unit,
                min: p.min,
                max: p.max,
                rate_limit_per_s: p.rate_limit.unwrap_or(f64::INFINITY),
                curve: Curve::new(&p.curve),
            })
        })
        .collect()
}

/// The tanks a pump feeds with their shares, the main one first.
fn outlets(
    spec: &RigSpec,
    pump: &PumpSpec,
    to: usize,
    from: Option<usize>,
) -> Result<Vec<(usize, f64)>, RigError> {
    let mut outlets = vec![(to, 1.0)];
    for (id, &share) in &pump.split {
        let tank = tank_index(spec, &pump.id, id)?;
        if Some(tank) == from || tank == to {
            return Err(RigError::Loop { item: pump.id.clone(), tank: id.clone() });
        }
        let left = outlets[0].1;
        demand(
            &pump.id,
            "split",
            share,
            share > 0.0 && share <= left,
            format!("> 0 and together ≤ 1 ({id})"),
        )?;
        outlets[0].1 = left - share;
        outlets.push((tank, share));
    }
    Ok(outlets)
}

fn valves(spec: &RigSpec) -> Result<Vec<Valve>, RigError> {
    spec.valves
        .iter()
        .map(|v| {
            let from = tank_index(spec, &v.id, &v.from)?;
            let to = v.to.as_deref().map(|t| tank_index(spec, &v.id, t)).transpose()?;
            if to == Some(from) {
                return Err(RigError::Loop { item: v.id.clone(), tank: v.from.clone() });
            }
            if v.drive == ValveDrive::Between && to.is_none() {
                return Err(RigError::Unknown { item: v.id.clone(), reference: "to".to_owned() });
            }
            demand(&v.id, "k90", v.k90, (0.0..=MOST).contains(&v.k90), "0…1e9")?;
            demand(&v.id, "exponent", v.exponent, v.exponent > 0.0, "> 0")?;
            demand(&v.id, "angle_deg", v.angle_deg, (0.0..=90.0).contains(&v.angle_deg), "0…90")?;
            Ok(Valve { from, to, drive: v.drive, law: v.law, k90: v.k90, exponent: v.exponent })
        })
        .collect()
}

fn sensors(spec: &RigSpec) -> Result<Vec<Sensor>, RigError> {
    spec.sensors
        .iter()
        .map(|s| {
            let tank = tank_index(spec, &s.id, &s.tank)?;
            demand(&s.id, "noise_cm", s.noise_cm, (0.0..=MOST).contains(&s.noise_cm), "0…1e9")?;
            demand(
                &s.id,
                "resolution_cm",
                s.resolution_cm,
                (0.0..=MOST).contains(&s.resolution_cm),
                "0…1e9",
            )?;
            if let Some([low, high]) = s.range_cm {
                demand(&s.id, "range_cm", low, low.abs() <= MOST, "-1e9…1e9")?;
                demand(&s.id, "range_cm", high, high > low && high <= MOST, format!("> {low} and ≤ 1e9"))?;
            }
            Ok(Sensor { tank, spec: s.clone() })
        })
        .collect()
}
