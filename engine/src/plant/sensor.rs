//! Level sensors: noise, resolution, the 4–20 mA signal and the input converter.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::spec::{ConverterSpec, SensorSpec};

/// Currents between which a transmitter signals, NAMUR NE 43: 3.8 to 20.5 mA.
const LOWEST_MA: f64 = 3.8;
const HIGHEST_MA: f64 = 20.5;
/// Below this current the wire is broken, NAMUR NE 43: 3.6 mA.
const BROKEN_MA: f64 = 3.6;

/// Which imperfections of measurement and actuation are switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
    /// Level in cm as the controller sees it.
    pub level_cm: f64,
    /// What it is worth.
    pub status: ReadingStatus,
}

/// A sensor with its converter, ready to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Transmitter {
    noise_cm: f64,
    resolution_cm: f64,
    range_cm: Option<[f64; 2]>,
    code_ma: f64,
}

impl Transmitter {
    /// A sensor, and the converter behind it if the rig has one.
    #[must_use]
    pub fn new(sensor: &SensorSpec, converters: Option<&ConverterSpec>) -> Self {
        let code_ma = converters
            .map_or(0.0, |c| 1000.0 * c.adc_full_scale_v / (f64::from(c.adc_bits).exp2() * c.shunt_ohm));
        Self {
            noise_cm: sensor.noise_cm,
            resolution_cm: sensor.resolution_cm,
            range_cm: sensor.range_cm,
            code_ma,
        }
    }

    /// Measures a true level in cm. One random number is drawn whether noise is on or off, so that
    /// switching it leaves the rest of a seeded run as it was.
    pub fn measure(&self, level_cm: f64, how: Measurement, rng: &mut impl Rng) -> Reading {
        let draw: f64 = StandardNormal.sample(rng);
        let mut level_cm = if how.noise { level_cm + self.noise_cm * draw } else { level_cm };
        if how.resolution && self.resolution_cm > 0.0 {
            level_cm = (level_cm / self.resolution_cm).round() * self.resolution_cm;
        }
        let Some([low, high]) = self.range_cm else {
            return Reading { level_cm, status: ReadingStatus::Good };
        };
        let span_cm = high - low;
        let wanted_ma = 4.0 + 16.0 * (level_cm - low) / span_cm;
        let mut current_ma = wanted_ma.clamp(LOWEST_MA, HIGHEST_MA);
        if how.quantisation && self.code_ma > 0.0 {
            current_ma = (current_ma / self.code_ma).round() * self.code_ma;
        }
        let status = if current_ma < BROKEN_MA {
            ReadingStatus::Broken
        } else if wanted_ma < LOWEST_MA {
            ReadingStatus::BelowRange
        } else if wanted_ma > HIGHEST_MA {
            ReadingStatus::AboveRange
        } else {
            ReadingStatus::Good
        };
        Reading { level_cm: low + span_cm * (current_ma - 4.0) / 16.0, status }
    }
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
        let t = Transmitter::new(&sensor, Some(&converters));
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let how = Measurement { noise: false, quantisation: true, resolution: false };
        let mut seen: Vec<f64> =
            (0..4000).map(|i| t.measure(10.0 + f64::from(i) * 1e-4, how, &mut rng).level_cm).collect();
        seen.dedup();
        let step = (seen[20] - seen[10]) / 10.0;
        assert!((step - 0.014_65).abs() < 1e-5, "{step}");
    }

    #[test]
    fn out_of_range_saturates_at_3_8_and_20_5_ma() {
        let (sensor, _) = lt02();
        let t = Transmitter::new(&sensor, None);
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let low = t.measure(0.0, Measurement::IDEAL, &mut rng);
        assert_eq!(low.status, ReadingStatus::BelowRange);
        assert!((low.level_cm - 1.2).abs() < 1e-12);
        let high = t.measure(27.0, Measurement::IDEAL, &mut rng);
        assert_eq!(high.status, ReadingStatus::AboveRange);
        assert!((high.level_cm - 26.25).abs() < 1e-12);
    }
}
