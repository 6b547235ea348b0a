//! Level sensors: noise, resolution, the 4–20 mA signal and the input converter.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::faults::Fault;
use super::lanes::Number;
use super::spec::{ConverterSpec, SensorSpec};

/// Currents between which a transmitter signals, NAMUR NE 43: 3.8 to 20.5 mA.
const LOWEST_MA: f64 = 3.8;
const HIGHEST_MA: f64 = 20.5;
/// Below this current the wire is broken, NAMUR NE 43: 3.6 mA.
const BROKEN_MA: f64 = 3.6;

/// Which imperfections of measurement and actuation are switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Gaussian noise of the sensors.
    pub noise: bool,
    /// Conversion of inputs and outputs to the codes of the converters.
    pub quantisation: bool,
    /// The sensors' own resolution.
    pub resolution: bool,
}

impl Measurement {
    /// Nothing between the level and the controller.
    pub const IDEAL: Self = Self { noise: false, quantisation: false, resolution: false };
    /// Noise and converters on, the sensors' resolution off.
    pub const DEFAULT: Self = Self { noise: true, quantisation: true, resolution: false };
}

/// What a reading is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReadingStatus {
    /// Within the sensor's range.
    Good,
    /// At the lower end of the signal.
    BelowRange,
    /// At the upper end of the signal.
    AboveRange,
    /// The signal says that the wire is broken.
    Broken,
}

/// One measured level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Level in cm as the controller sees it; NaN where the wire is broken, which is no level.
    pub level_cm: f64,
    /// What it is worth.
    pub status: ReadingStatus,
}

/// Whatever is wrong with a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Ills {
    /// Gives this reading for ever.
    stuck: Option<Reading>,
    /// Speed of the zero in cm/s.
    drift_cm_s: f64,
    /// How far the zero has moved, in cm.
    offset_cm: f64,
    broken: bool,
    /// Height in cm and mean time between two in seconds.
    spikes: Option<(f64, f64)>,
}

/// A sensor with its converter, ready to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Transmitter {
    /// Standard deviation of the noise in cm.
    pub(crate) noise_cm: f64,
    resolution_cm: f64,
    /// Gain and zero in cm of a sensor that is off its calibration.
    calibration: Option<(f64, f64)>,
    current: Option<Current>,
    sample_time_s: f64,
    ills: Ills,
    /// Whether it has any of them.
    ill: bool,
    last: Reading,
}

/// The 4–20 mA signal of a range, and the converter that reads it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Current {
    low_cm: f64,
    ma_per_cm: f64,
    cm_per_ma: f64,
    /// One code of the converter and its inverse; 0 without one.
    code_ma: f64,
    codes_per_ma: f64,
}

/// What a sensor shows of a level, of one plant or several.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shown<V> {
    pub level_cm: V,
    /// Current that the level asks for, and the one that is read; none without a range.
    ma: Option<(V, V)>,
}

impl Transmitter {
    /// A sensor read every `sample_time_s`, and the converter behind it if the rig has one.
    #[must_use]
    pub fn new(sensor: &SensorSpec, converters: Option<&ConverterSpec>, sample_time_s: f64) -> Self {
        let code_ma = converters
            .map_or(0.0, |c| 1000.0 * c.adc_full_scale_v / (f64::from(c.adc_bits).exp2() * c.shunt_ohm));
        let current = |[low_cm, high_cm]: [f64; 2]| Current {
            low_cm,
            ma_per_cm: 16.0 / (high_cm - low_cm),
            cm_per_ma: (high_cm - low_cm) / 16.0,
            code_ma,
            codes_per_ma: if code_ma > 0.0 { 1.0 / code_ma } else { 0.0 },
        };
        Self {
            noise_cm: sensor.noise_cm,
            resolution_cm: sensor.resolution_cm,
            calibration: (sensor.gain != 1.0 || sensor.offset_cm != 0.0)
                .then_some((sensor.gain, sensor.offset_cm)),
            current: sensor.range_cm.map(current),
            sample_time_s,
            ills: Ills::default(),
            ill: false,
            last: Reading { level_cm: f64::NAN, status: ReadingStatus::Good },
        }
    }

    /// Switches a sensor's fault on or off; other faults than a sensor's do nothing.
    pub fn set_fault(&mut self, fault: Fault, on: bool) {
        let ills = &mut self.ills;
        match fault {
            Fault::Stuck => ills.stuck = on.then_some(self.last),
            Fault::BrokenWire => ills.broken = on,
            Fault::Spikes { height_cm, every_s } => ills.spikes = on.then_some((height_cm, every_s)),
            // A drift that is repaired leaves a zero that has been set right.
            Fault::Drift { rate_cm_s } if on => ills.drift_cm_s = rate_cm_s,
            Fault::Drift { .. } => (ills.drift_cm_s, ills.offset_cm) = (0.0, 0.0),
            _ => {}
        }
        self.ill = self.ills != Ills::default();
    }

    /// Measures a true level in cm. One random number is drawn whether noise is on or off, so that
    /// switching it leaves the rest of a seeded run as it was; spikes draw from a source of their own.
    pub fn measure(
        &mut self,
        level_cm: f64,
        how: Measurement,
        powered: bool,
        rng: &mut impl Rng,
        mishaps: &mut impl Rng,
    ) -> Reading {
        self.measure_with(level_cm, StandardNormal.sample(rng), how, powered, mishaps)
    }

    /// As [`Self::measure`], with the random number already drawn.
    #[inline(always)]
    pub(crate) fn measure_with(
        &mut self,
        level_cm: f64,
        draw: f64,
        how: Measurement,
        powered: bool,
        mishaps: &mut impl Rng,
    ) -> Reading {
        let noise_cm = if how.noise { self.noise_cm * draw } else { 0.0 };
        if self.ill || !powered {
            return self.measure_ill(level_cm, noise_cm, how, powered, mishaps);
        }
        self.last = self.show(level_cm + noise_cm, how).judged();
        self.last
    }

    /// Measures with whatever is wrong; apart, so that what runs every time stays short.
    #[inline(never)]
    fn measure_ill(
        &mut self,
        level_cm: f64,
        noise_cm: f64,
        how: Measurement,
        powered: bool,
        mishaps: &mut impl Rng,
    ) -> Reading {
        self.ills.offset_cm += self.ills.drift_cm_s * self.sample_time_s;
        if self.ills.broken || !powered {
            return Reading { level_cm: f64::NAN, status: ReadingStatus::Broken };
        }
        if let Some(stuck) = self.ills.stuck {
            return stuck;
        }
        let mut level_cm = level_cm + self.ills.offset_cm + noise_cm;
        if let Some((height_cm, every_s)) = self.ills.spikes
            && mishaps.random::<f64>() * every_s < self.sample_time_s
        {
            level_cm += if mishaps.random::<bool>() { height_cm } else { -height_cm };
        }
        self.last = self.show(level_cm, how).judged();
        self.last
    }

    /// A level through the sensor's calibration, its resolution, the signal and the converter.
    #[inline(always)]
    pub(crate) fn show<V: Number>(&self, mut level_cm: V, how: Measurement) -> Shown<V> {
        if let Some((gain, offset_cm)) = self.calibration {
            level_cm = level_cm * gain + V::of(offset_cm);
        }
        if how.resolution && self.resolution_cm > 0.0 {
            level_cm = nearest(level_cm * (1.0 / self.resolution_cm)) * self.resolution_cm;
        }
        let Some(current) = &self.current else { return Shown { level_cm, ma: None } };
        let wanted_ma = V::of(4.0) + (level_cm - V::of(current.low_cm)) * current.ma_per_cm;
        let mut read_ma = wanted_ma.larger(V::of(LOWEST_MA)).smaller(V::of(HIGHEST_MA));
        if how.quantisation && current.code_ma > 0.0 {
            read_ma = nearest(read_ma * current.codes_per_ma) * current.code_ma;
        }
        let level_cm = V::of(current.low_cm) + (read_ma - V::of(4.0)) * current.cm_per_ma;
        Shown { level_cm, ma: Some((wanted_ma, read_ma)) }
    }
}

impl Shown<f64> {
    #[inline]
    fn judged(self) -> Reading {
        let status = match self.ma {
            Some((_, read_ma)) if read_ma < BROKEN_MA => ReadingStatus::Broken,
            Some((wanted_ma, _)) if wanted_ma < LOWEST_MA => ReadingStatus::BelowRange,
            Some((wanted_ma, _)) if wanted_ma > HIGHEST_MA => ReadingStatus::AboveRange,
            _ => ReadingStatus::Good,
        };
        Reading { level_cm: self.level_cm, status }
    }
}

/// The nearest whole number of a quotient below 2⁵¹; halves go to the even neighbour. (`f64::round` is a call into
/// the mathematical library on the default target.)
#[inline(always)]
pub(crate) fn nearest<V: Number>(x: V) -> V {
    const SHIFT: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²
    (x + V::of(SHIFT)) - V::of(SHIFT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn lt02() -> (SensorSpec, ConverterSpec) {
        (
            SensorSpec {
                id: "LT02".to_owned(),
                tank: "TQ2".to_owned(),
                noise_cm: 0.03,
                range_cm: Some([1.5, 25.5]),
                resolution_cm: 0.35,
                gain: 1.0,
                offset_cm: 0.0,
            },
            ConverterSpec {
                adc_bits: 12,
                adc_full_scale_v: 10.0,
                shunt_ohm: 250.0,
                dac_bits: 12,
                dac_full_scale_v: 10.0,
            },
        )
    }

    #[test]
    fn one_code_of_the_converter_is_0_015_cm() {
        // plant.md: 12 bit over 0–10 V, 250 Ω, 24 cm over 16 mA.
        let (sensor, converters) = lt02();
        let mut t = Transmitter::new(&sensor, Some(&converters), 0.2);
        let mut mishaps = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(2);
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let how = Measurement { noise: false, quantisation: true, resolution: false };
        let mut seen: Vec<f64> = (0..4000)
            .map(|i| t.measure(10.0 + f64::from(i) * 1e-4, how, true, &mut rng, &mut mishaps).level_cm)
            .collect();
        seen.dedup();
        let step = (seen[20] - seen[10]) / 10.0;
        assert!((step - 0.014_65).abs() < 1e-5, "{step}");
    }

    #[test]
    fn out_of_range_saturates_at_3_8_and_20_5_ma() {
        let (sensor, _) = lt02();
        let mut t = Transmitter::new(&sensor, None, 0.2);
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let mut mishaps = rng.clone();
        let low = t.measure(0.0, Measurement::IDEAL, true, &mut rng, &mut mishaps);
        assert_eq!(low.status, ReadingStatus::BelowRange);
        assert!((low.level_cm - 1.2).abs() < 1e-12);
        let high = t.measure(27.0, Measurement::IDEAL, true, &mut rng, &mut mishaps);
        assert_eq!(high.status, ReadingStatus::AboveRange);
        assert!((high.level_cm - 26.25).abs() < 1e-12);
    }

    #[test]
    fn faults_do_what_they_say_and_end_when_repaired() {
        let (sensor, _) = lt02();
        let mut t = Transmitter::new(&sensor, None, 0.2);
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let mut mishaps = rng.clone();
        let how = Measurement::IDEAL;
        let mut read =
            |t: &mut Transmitter, level: f64, powered| t.measure(level, how, powered, &mut rng, &mut mishaps);
        assert!((read(&mut t, 10.0, true).level_cm - 10.0).abs() < 1e-12);
        t.set_fault(Fault::Stuck, true);
        assert!((read(&mut t, 12.0, true).level_cm - 10.0).abs() < 1e-12);
        t.set_fault(Fault::Stuck, false);
        t.set_fault(Fault::BrokenWire, true);
        let broken = read(&mut t, 12.0, true);
        assert!(broken.level_cm.is_nan() && broken.status == ReadingStatus::Broken);
        t.set_fault(Fault::BrokenWire, false);
        assert_eq!(read(&mut t, 12.0, false).status, ReadingStatus::Broken);
        t.set_fault(Fault::Drift { rate_cm_s: 0.1 }, true);
        let drifted: Vec<f64> = (0..100).map(|_| read(&mut t, 12.0, true).level_cm).collect();
        assert!((drifted[99] - 14.0).abs() < 1e-9, "{}", drifted[99]); // 100 samples of 0.2 s at 0.1 cm/s
        t.set_fault(Fault::Drift { rate_cm_s: 0.1 }, false);
        assert!((read(&mut t, 12.0, true).level_cm - 12.0).abs() < 1e-12);
        t.set_fault(Fault::Spikes { height_cm: 2.0, every_s: 20.0 }, true);
        let spikes = (0..100_000).filter(|_| (read(&mut t, 12.0, true).level_cm - 12.0).abs() > 1.9).count();
        // One sample in a hundred: 1000 ± 31.
        assert!((850..1150).contains(&spikes), "{spikes}");
    }
}
