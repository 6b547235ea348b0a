//! Round values along an axis.

use vasos_engine::explain::number;

use super::chart::Scale;

/// An axis with its range and its ticks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ruler {
    low: f64,
    high: f64,
    scale: Scale,
    /// Where a tick is, and its words.
    pub ticks: Vec<(f64, String)>,
}

impl Ruler {
    /// Fits the values, or takes the range; about `wanted` ticks.
    pub fn new(
        range: Option<(f64, f64)>,
        values: impl Iterator<Item = f64>,
        scale: Scale,
        wanted: usize,
    ) -> Self {
        let usable = |v: &f64| v.is_finite() && (scale == Scale::Linear || *v > 0.0);
        let (low, high) = range.unwrap_or_else(|| {
            values.filter(usable).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        });
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (1.0, 2.0) };
        match scale {
            Scale::Linear => Self::linear(low, high, range.is_some(), wanted),
            Scale::Log => Self::log(low, high),
        }
    }

    fn linear(low: f64, high: f64, fixed: bool, wanted: usize) -> Self {
        let room = if high > low { 0.04 * (high - low) } else { 0.05 * low.abs().max(1e-9) };
        let (low, high) = if fixed && high > low { (low, high) } else { (low - room, high + room) };
        let step = round_step((high - low) / wanted.max(1) as f64);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let ticks = (first..=last).map(|k| (k as f64 * step, written(k as f64 * step, step))).collect();
        Self { low, high, scale: Scale::Linear, ticks }
    }

    fn log(low: f64, high: f64) -> Self {
        let (low, high) = if high > low { (low, high) } else { (0.8 * low, 1.25 * low) };
        let room = (high / low).powf(0.05);
        let (low, high) = (low / room, high * room);
        let decades = (high / low).log10();
        let of_decade: &[f64] = if decades < 1.2 {
            &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]
        } else if decades < 3.0 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0]
        };
        let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
        let ticks = (first..=last)
            .flat_map(|d| of_decade.iter().map(move |m| m * 10f64.powi(d)))
            .filter(|v| (low..=high).contains(v))
            .map(|v| (v, number(v)))
            .collect();
        Self { low, high, scale: Scale::Log, ticks }
    }

    /// Where a value lies: 0 at the low end, 1 at the high one.
    pub fn share(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => (value / self.low).ln() / (self.high / self.low).ln(),
        }
    }
}

/// 1, 2 or 5 times a power of ten, not under the given step.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].iter().map(|m| m * power).find(|s| *s >= 0.999 * least).unwrap_or(10.0 * power)
}

/// With the digits its step asks for.
fn written(value: f64, step: f64) -> String {
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    if value != 0.0 && (value.abs() >= 1e6 || step < 1e-4) {
        return format!("{value:.2e}");
    }
    let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let words = |r: &Ruler| r.ticks.iter().map(|t| t.1.clone()).collect::<Vec<_>>();
        let ruler = Ruler::new(Some((0.0, 1000.0)), std::iter::empty(), Scale::Linear, 5);
        assert_eq!(words(&ruler), ["0", "200", "400", "600", "800", "1000"]);
        let ruler = Ruler::new(Some((-0.3, 0.31)), std::iter::empty(), Scale::Linear, 5);
        assert_eq!(words(&ruler), ["−0.2", "0.0", "0.2"]);
        let ruler = Ruler::new(None, [3.0, 40.0].into_iter(), Scale::Log, 5);
        assert_eq!(words(&ruler), ["5", "10", "20"]);
        let ruler = Ruler::new(None, [3.0, 20.0].into_iter(), Scale::Log, 5);
        assert_eq!(words(&ruler), ["3", "4", "5", "7", "10", "15", "20"]);
        assert!((ruler.share(3.0) - ruler.share(20.0) + 1.0).abs() < 0.2);
    }

    #[test]
    fn nothing_to_show_still_has_an_axis() {
        for values in [vec![], vec![f64::NAN], vec![5.0], vec![0.0, 0.0]] {
            let ruler = Ruler::new(None, values.into_iter(), Scale::Linear, 5);
            assert!(ruler.high > ruler.low && ruler.ticks.len() < 20, "{ruler:?}");
        }
    }
}
