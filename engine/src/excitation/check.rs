//! What a description may hold.

use super::prbs::REGISTERS;
use super::spec::{Excitation, Hysteresis, Relay, Signal, SteppedSine, UltimateGain};
use crate::explain::number;
use crate::plant::{RigError, demand};

/// Bound on sizes, gains and times of a description.
const MOST: f64 = 1e9;
/// Most rows a record is made for: 32 bytes each.
const MOST_ROWS: f64 = 2e6;
/// Fewest samples to listen to: fewer tell neither noise nor drift.
const FEWEST_HEARD: f64 = 12.0;

/// Checks of a description, each naming its field.
struct Check<'a> {
    item: &'a str,
}

impl Check<'_> {
    fn positive(&self, field: &'static str, value: f64) -> Result<(), RigError> {
        demand(self.item, field, value, value > 0.0 && value <= MOST, "> 0 and ≤ 1e9")
    }

    fn move_of(&self, field: &'static str, value: f64) -> Result<(), RigError> {
        demand(self.item, field, value, value != 0.0 && value.abs() <= MOST, "≠ 0 and within ±1e9")
    }

    fn share(&self, field: &'static str, value: f64) -> Result<(), RigError> {
        demand(self.item, field, value, (1e-4..=0.5).contains(&value), "0.0001…0.5")
    }

    fn count(&self, field: &'static str, value: u32, [least, most]: [u32; 2]) -> Result<(), RigError> {
        let ok = (least..=most).contains(&value);
        demand(self.item, field, f64::from(value), ok, format!("{least}…{most}"))
    }
}

impl Excitation {
    /// Checks every value for the loop `item` with its sample time in seconds.
    ///
    /// # Errors
    /// [`RigError::Value`] with the offending field.
    pub fn check(&self, item: &str, sample_time_s: f64) -> Result<(), RigError> {
        let least_s = FEWEST_HEARD * sample_time_s;
        let heard = self.listen_s >= least_s - 1e-9 && self.listen_s <= MOST;
        demand(item, "listen_s", self.listen_s, heard, format!("{} or more (12 samples)", number(least_s)))?;
        let most_s = MOST_ROWS * sample_time_s;
        let fits = self.budget_s > self.listen_s && self.budget_s <= most_s;
        demand(
            item,
            "budget_s",
            self.budget_s,
            fits,
            format!("> {} (listen_s) and ≤ {}", number(self.listen_s), number(most_s)),
        )?;
        let limits = &self.limits;
        for (field, value) in [
            ("pv_low", limits.pv_low),
            ("pv_high", limits.pv_high),
            ("mv_low", limits.mv_low),
            ("mv_high", limits.mv_high),
        ] {
            if let Some(value) = value {
                demand(item, field, value, value.abs() <= MOST, "within ±1e9")?;
            }
        }
        self.signal.check(&Check { item }, sample_time_s)
    }
}

impl Signal {
    fn check(&self, check: &Check, sample_time_s: f64) -> Result<(), RigError> {
        match self {
            Self::Step { size, rest_share, .. } | Self::SetpointStep { size, rest_share, .. } => {
                check.move_of("size", *size)?;
                check.share("rest_share", *rest_share)
            }
            Self::Relay(relay) => relay.check(check),
            Self::Doublet { amplitude, hold_s } => {
                check.move_of("amplitude", *amplitude)?;
                at_least(check, "hold_s", *hold_s, sample_time_s)
            }
            Self::Prbs { amplitude, clock_s, register, periods } => {
                check.positive("amplitude", *amplitude)?;
                at_least(check, "clock_s", *clock_s, sample_time_s)?;
                check.count("register", *register, REGISTERS)?;
                check.count("periods", *periods, [1, 1000])
            }
            Self::SteppedSine(sine) => sine.check(check, sample_time_s),
            Self::UltimateGain(test) => test.check(check),
        }
    }
}

fn at_least(check: &Check, field: &'static str, value: f64, least: f64) -> Result<(), RigError> {
    let ok = value >= least - 1e-9 && value <= MOST;
    demand(check.item, field, value, ok, format!("{} (the sample time) or more", number(least)))
}

impl Relay {
    fn check(&self, check: &Check) -> Result<(), RigError> {
        check.positive("amplitude", self.amplitude)?;
        check.positive("amplitude_down", self.down())?;
        match self.hysteresis {
            Hysteresis::Given(width) => {
                let ok = (0.0..=MOST).contains(&width);
                demand(check.item, "hysteresis.given", width, ok, "0…1e9")?;
            }
            Hysteresis::Noise(factor) => {
                let ok = (0.0..=100.0).contains(&factor);
                demand(check.item, "hysteresis.noise", factor, ok, "0…100")?;
            }
        }
        check.count("cycles", self.cycles, [2, 12])?;
        check.share("agreement", self.agreement)
    }
}

impl SteppedSine {
    fn check(&self, check: &Check, sample_time_s: f64) -> Result<(), RigError> {
        check.positive("amplitude", self.amplitude)?;
        let count = u32::try_from(self.frequencies_rad_s.len()).unwrap_or(u32::MAX);
        check.count("number of frequencies", count, [1, 1000])?;
        let most = std::f64::consts::FRAC_PI_2 / sample_time_s;
        for &omega in &self.frequencies_rad_s {
            let ok = omega > 0.0 && omega <= most;
            let expected = format!("> 0 and ≤ {} (four samples a cycle)", number(most));
            demand(check.item, "frequencies_rad_s", omega, ok, expected)?;
        }
        check.count("cycles", self.cycles, [1, 100])?;
        check.share("agreement", self.agreement)
    }
}

impl UltimateGain {
    fn check(&self, check: &Check) -> Result<(), RigError> {
        check.positive("start_gain", self.start_gain)?;
        check.move_of("kick", self.kick)?;
        let factor = self.factor;
        demand(check.item, "factor", factor, factor > 1.0 && factor <= 4.0, "> 1 and ≤ 4")?;
        check.count("cycles", self.cycles, [2, 8])?;
        check.share("agreement", self.agreement)
    }
}
