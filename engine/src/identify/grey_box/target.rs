//! The parameters of a rig that a fit may change, by the names that files and the command line give them: `TAG.field`.

use super::GreyBoxError;
use crate::plant::RigSpec;
use crate::plant::spec::{ValveDrive, ValveLaw, ValveSpec};

/// Delays below this are none, in seconds: a rig file has none that are shorter.
const NO_DELAY_S: f64 = 1e-3;
/// Bound on what has no other, and least size, as in a rig file.
const MOST: f64 = 1e9;
const LEAST: f64 = 1e-6;

/// What a parameter is, with the place of its tank, pump, valve or sensor in the rig file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// `k90` of a valve, in cm^2.5/s (√ law) or cm²/s (laminar).
    ValveK90(usize),
    /// `scale`: factor on all flows of a pump's curve; 1 as it stands in the file.
    PumpScale(usize),
    /// `offset_cm3_s`: added to all flows of a pump's curve, which stay 0 or more; 0 as in the file.
    PumpOffset(usize),
    /// `point_1`, `point_2`, …: flow at one point of the curve, in cm³/s.
    PumpPoint(usize, usize),
    /// `delay_s`: transport delay of a pump's stream.
    PumpDelay(usize),
    /// `area_cm2` of a tank.
    Area(usize),
    /// `height_cm`: rim of a tank.
    Height(usize),
    /// `spill_share`: share of the spill that gets to the tank it spills to.
    SpillShare(usize),
    /// `leak_cm2_5_s`: k of a hole in the tank's floor, `q = k √h`; 0 as in the file.
    Leak(usize),
    /// `gain` of a sensor.
    SensorGain(usize),
    /// `offset_cm`: zero of a sensor.
    SensorOffset(usize),
}

impl Target {
    /// The parameter of a name.
    ///
    /// # Errors
    /// [`GreyBoxError::UnknownParameter`] with the names there are.
    pub fn parse(spec: &RigSpec, name: &str) -> Result<Self, GreyBoxError> {
        let all = Self::all(spec);
        let found = all.iter().find(|t| t.name(spec).eq_ignore_ascii_case(name.trim()));
        found.copied().ok_or_else(|| {
            let points = |t: &&Self| !matches!(t, Self::PumpPoint(_, i) if *i > 0);
            let known: Vec<String> = all.iter().filter(points).map(|t| t.name(spec)).collect();
            GreyBoxError::UnknownParameter { name: name.trim().to_owned(), known: known.join(", ") }
        })
    }

    /// Every parameter of a rig.
    fn all(spec: &RigSpec) -> Vec<Self> {
        let mut all: Vec<Self> = (0..spec.valves.len()).map(Self::ValveK90).collect();
        for (i, pump) in spec.pumps.iter().enumerate() {
            all.extend([Self::PumpScale(i), Self::PumpOffset(i), Self::PumpDelay(i)]);
            all.extend((0..pump.curve.len()).map(|point| Self::PumpPoint(i, point)));
        }
        for i in 0..spec.tanks.len() {
            all.extend([Self::Area(i), Self::Height(i), Self::SpillShare(i), Self::Leak(i)]);
        }
        all.extend((0..spec.sensors.len()).flat_map(|i| [Self::SensorGain(i), Self::SensorOffset(i)]));
        all
    }

    /// `TAG.field`.
    #[must_use]
    pub fn name(self, spec: &RigSpec) -> String {
        let (tanks, pumps, sensors) = (&spec.tanks, &spec.pumps, &spec.sensors);
        match self {
            Self::ValveK90(i) => format!("{}.k90", spec.valves[i].id),
            Self::PumpScale(i) => format!("{}.scale", pumps[i].id),
            Self::PumpOffset(i) => format!("{}.offset_cm3_s", pumps[i].id),
            Self::PumpPoint(i, point) => format!("{}.point_{}", pumps[i].id, point + 1),
            Self::PumpDelay(i) => format!("{}.delay_s", pumps[i].id),
            Self::Area(i) => format!("{}.area_cm2", tanks[i].id),
            Self::Height(i) => format!("{}.height_cm", tanks[i].id),
            Self::SpillShare(i) => format!("{}.spill_share", tanks[i].id),
            Self::Leak(i) => format!("{}.leak_cm2_5_s", tanks[i].id),
            Self::SensorGain(i) => format!("{}.gain", sensors[i].id),
            Self::SensorOffset(i) => format!("{}.offset_cm", sensors[i].id),
        }
    }

    /// Its value in a rig description, in one of its configurations.
    #[must_use]
    pub fn value(self, spec: &RigSpec, configuration: usize) -> f64 {
        match self {
            Self::ValveK90(i) => spec.valves[i].k90,
            Self::PumpScale(_) => 1.0,
            Self::PumpOffset(_) | Self::Leak(_) => 0.0,
            Self::PumpPoint(i, point) => spec.pumps[i].curve[point][1],
            Self::PumpDelay(i) => delay_s(spec, configuration, i),
            Self::Area(i) => spec.tanks[i].area_cm2,
            Self::Height(i) => spec.tanks[i].height_cm,
            Self::SpillShare(i) => spec.tanks[i].spill_share,
            Self::SensorGain(i) => spec.sensors[i].gain,
            Self::SensorOffset(i) => spec.sensors[i].offset_cm,
        }
    }

    /// Lowest and highest value that a rig can have.
    #[must_use]
    pub fn possible(self) -> [f64; 2] {
        match self {
            Self::ValveK90(_) | Self::PumpPoint(..) | Self::Leak(_) => [0.0, MOST],
            Self::PumpOffset(_) | Self::SensorOffset(_) => [-MOST, MOST],
            Self::PumpDelay(_) => [0.0, 3600.0],
            Self::SpillShare(_) => [0.0, 1.0],
            Self::PumpScale(_) | Self::Area(_) | Self::Height(_) | Self::SensorGain(_) => [LEAST, MOST],
        }
    }
}

/// Transport delay of a pump in a configuration, in seconds.
pub(super) fn delay_s(spec: &RigSpec, configuration: usize, pump: usize) -> f64 {
    let own = spec.configurations.get(configuration).and_then(|c| c.delays_s.get(&spec.pumps[pump].id));
    own.copied().unwrap_or(spec.pumps[pump].delay_s)
}

/// Angle of a valve in a configuration, in degrees.
pub(super) fn angle_deg(spec: &RigSpec, configuration: usize, valve: usize) -> f64 {
    let own = spec.configurations.get(configuration).and_then(|c| c.angles_deg.get(&spec.valves[valve].id));
    own.copied().unwrap_or(spec.valves[valve].angle_deg)
}

/// The description with other values of its parameters: scale and offset go into the pump's curve, a leak becomes a valve
/// to the outside, and nothing is marked for fitting that these have changed the meaning of.
#[must_use]
pub fn with_values(spec: &RigSpec, configuration: usize, values: &[(Target, f64)]) -> RigSpec {
    let mut made = spec.clone();
    let (mut scale, mut offset) = (vec![1.0; spec.pumps.len()], vec![0.0; spec.pumps.len()]);
    for &(target, value) in values {
        match target {
            Target::ValveK90(i) => made.valves[i].k90 = value,
            Target::PumpScale(i) => scale[i] = value,
            Target::PumpOffset(i) => offset[i] = value,
            Target::PumpPoint(i, point) => made.pumps[i].curve[point][1] = value,
            Target::PumpDelay(i) => set_delay(&mut made, configuration, i, value),
            Target::Area(i) => made.tanks[i].area_cm2 = value,
            Target::Height(i) => {
                made.tanks[i].height_cm = value;
                made.tanks[i].initial_cm = made.tanks[i].initial_cm.min(value);
            }
            Target::SpillShare(i) => made.tanks[i].spill_share = value,
            Target::Leak(i) => add_leak(&mut made, i, value),
            Target::SensorGain(i) => made.sensors[i].gain = value,
            Target::SensorOffset(i) => made.sensors[i].offset_cm = value,
        }
    }
    for (i, pump) in made.pumps.iter_mut().enumerate() {
        if scale[i] != 1.0 || offset[i] != 0.0 {
            pump.curve = moved(&pump.curve, scale[i], offset[i]);
        }
    }
    made
}

fn set_delay(spec: &mut RigSpec, configuration: usize, pump: usize, value: f64) {
    let value = if value < NO_DELAY_S { 0.0 } else { value };
    let id = spec.pumps[pump].id.clone();
    match spec.configurations.get_mut(configuration).and_then(|c| c.delays_s.get_mut(&id)) {
        Some(delay) => *delay = value,
        None => spec.pumps[pump].delay_s = value,
    }
}

fn add_leak(spec: &mut RigSpec, tank: usize, k: f64) {
    if k == 0.0 {
        return;
    }
    let id = format!("{}_leak", spec.tanks[tank].id);
    spec.valves.push(ValveSpec {
        signal: format!("q_{id}"),
        id,
        from: spec.tanks[tank].id.clone(),
        to: None,
        drive: ValveDrive::FreeFall,
        law: ValveLaw::SquareRoot,
        k90: k,
        exponent: 1.0,
        angle_deg: 90.0,
    });
}

/// A curve scaled and shifted, cut off at no flow where it crosses that.
fn moved(curve: &[[f64; 2]], scale: f64, offset: f64) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(curve.len() + 1);
    let mut before: Option<[f64; 2]> = None;
    for &[input, flow] in curve {
        let raw = scale * flow + offset;
        if let Some([u, q]) = before
            && q * raw < 0.0
        {
            points.push([u + (input - u) * q / (q - raw), 0.0]);
        }
        points.push([input, raw.max(0.0)]);
        before = Some([input, raw]);
    }
    points.dedup_by(|b, a| b[0] <= a[0]);
    points
}

#[cfg(test)]
mod tests {
    use super::moved;

    #[test]
    fn a_curve_shifted_below_no_flow_begins_where_it_crosses() {
        let curve = [[0.0, 0.0], [1.0, 10.0], [2.0, 30.0]];
        assert_eq!(moved(&curve, 1.0, -5.0), [[0.0, 0.0], [0.5, 0.0], [1.0, 5.0], [2.0, 25.0]]);
        assert_eq!(moved(&curve, 2.0, 1.0), [[0.0, 1.0], [1.0, 21.0], [2.0, 61.0]]);
    }
}
