//! Performance figures of any sampled run, simulated or recorded.

use serde::{Deserialize, Serialize};

use crate::explain::Explain;

/// What set the run in motion; decides which figures make sense.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Excitation {
    /// The setpoint stepped: PV has a way to go.
    Setpoint,
    /// A load stepped: PV leaves and comes back.
    Load,
}

/// Figures of one run; e = r − y, times counted from the first sample.
///
/// Integrals by the trapezoidal rule over the run. PV in its own units, MV in its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// IE = ∫ e dt in PV units times seconds.
    pub ie: f64,
    /// IAE = ∫ |e| dt in PV units times seconds.
    pub iae: f64,
    /// ISE = ∫ e² dt in PV units squared times seconds.
    pub ise: f64,
    /// ITAE = ∫ t |e| dt in PV units times seconds squared.
    pub itae: f64,
    /// Largest |e| in PV units.
    pub peak_error: f64,
    /// Where y comes to rest: the mean over the last twentieth of the run, exact for a computed response.
    pub final_value: f64,
    /// Setpoint minus final value in PV units.
    pub steady_error: f64,
    /// How far y passes the final value, in percent of the way to it; setpoint steps only.
    pub overshoot_percent: Option<f64>,
    /// Second excursion beyond the final value over the first on the same side; none with fewer than two that
    /// stand out from the noise.
    pub decay_ratio: Option<f64>,
    /// From 10 to 90 % of the way to the final value, in seconds; setpoint steps only.
    pub rise_time_s: Option<f64>,
    /// When y enters for good the band of ±2 % of the way (of the largest excursion for a load), in seconds.
    pub settling_time_s: Option<f64>,
    /// TV = Σ |Δu| in MV units.
    pub total_variation: f64,
    /// Largest u.
    pub max_u: f64,
    /// Smallest u.
    pub min_u: f64,
}

/// Why no figures can be given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// Slices of different lengths.
    #[error("the run's columns differ in length: {time} times, {r} setpoints, {y} PV and {u} MV values")]
    Lengths {
        /// Number of times.
        time: usize,
        /// Number of setpoints.
        r: usize,
        /// Number of PV values.
        y: usize,
        /// Number of MV values.
        u: usize,
    },
    /// Fewer than two samples.
    #[error("the run has {count} samples: performance figures need at least 2")]
    TooFew {
        /// Number of samples.
        count: usize,
    },
    /// A time that is not later than the one before.
    #[error("sample {index} of the run is not later than the one before it")]
    Time {
        /// Index of the offending sample, from 0.
        index: usize,
    },
    /// NaN or an infinite value.
    #[error("sample {index} of the run holds a value that is not a finite number")]
    NotFinite {
        /// Index of the offending sample, from 0.
        index: usize,
    },
}

impl MetricsError {
    /// One value per variant, for the test that compares the sentences with the translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::Lengths { time: 4, r: 4, y: 3, u: 4 },
            Self::TooFew { count: 1 },
            Self::Time { index: 7 },
            Self::NotFinite { index: 7 },
        ]
    }
}

impl Explain for MetricsError {
    fn key(&self) -> &'static str {
        match self {
            Self::Lengths { .. } => "metrics.lengths",
            Self::TooFew { .. } => "metrics.too_few",
            Self::Time { .. } => "metrics.time",
            Self::NotFinite { .. } => "metrics.not_finite",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Lengths { time, r, y, u } => {
                vec![
                    ("time", time.to_string()),
                    ("r", r.to_string()),
                    ("y", y.to_string()),
                    ("u", u.to_string()),
                ]
            }
            Self::TooFew { count } => vec![("count", count.to_string())],
            Self::Time { index } | Self::NotFinite { index } => vec![("index", index.to_string())],
        }
    }
}

/// Share of the run whose mean is the final value.
const FINAL_SHARE: f64 = 0.05;
/// Half-width of the settling band.
const SETTLING_BAND: f64 = 0.02;
/// Rise time counts between these shares of the way.
const RISE: (f64, f64) = (0.1, 0.9);
/// Excursions under this share of the way are rounding, not a decaying oscillation …
const LEAST_EXCURSION: f64 = 1e-3;
/// … nor are those under this many standard deviations of the noise.
const NOISE_EXCURSION: f64 = 5.0;

/// Figures of a run from its samples: times in seconds, setpoint, PV and MV.
///
/// # Errors
/// [`MetricsError`] for columns of different lengths, fewer than two samples, times that do not rise and values
/// that are not finite.
pub fn metrics(
    time_s: &[f64],
    r: &[f64],
    y: &[f64],
    u: &[f64],
    excitation: Excitation,
) -> Result<Metrics, MetricsError> {
    metrics_about(time_s, r, y, u, excitation, None)
}

/// [`metrics`] of a run of which it is known where y comes to rest.
///
/// # Errors
/// [`MetricsError`] as there.
pub fn metrics_at_rest(
    time_s: &[f64],
    r: &[f64],
    y: &[f64],
    u: &[f64],
    excitation: Excitation,
    final_value: f64,
) -> Result<Metrics, MetricsError> {
    metrics_about(time_s, r, y, u, excitation, Some(final_value))
}

/// [`metrics`] with the final value known; without, it is the mean of the run's last twentieth.
pub(super) fn metrics_about(
    time_s: &[f64],
    r: &[f64],
    y: &[f64],
    u: &[f64],
    excitation: Excitation,
    final_value: Option<f64>,
) -> Result<Metrics, MetricsError> {
    check(time_s, r, y, u)?;
    let last = time_s.len() - 1;
    let mut sums = [0.0; 4];
    let terms = |i: usize| {
        let (e, t) = (r[i] - y[i], time_s[i] - time_s[0]);
        [e, e.abs(), e * e, t * e.abs()]
    };
    let mut previous = terms(0);
    let (mut total_variation, mut peak_error) = (0.0, previous[1]);
    for i in 1..=last {
        let current = terms(i);
        let half_step = 0.5 * (time_s[i] - time_s[i - 1]);
        for k in 0..4 {
            sums[k] += half_step * (previous[k] + current[k]);
        }
        total_variation += (u[i] - u[i - 1]).abs();
        peak_error = current[1].max(peak_error);
        previous = current;
    }
    let final_value = final_value.unwrap_or_else(|| final_mean(time_s, y));
    let way = match excitation {
        Excitation::Setpoint => final_value - y[0],
        Excitation::Load => y.iter().fold(0.0f64, |m, v| m.max((v - final_value).abs())),
    };
    let shares: Vec<f64> = y.iter().map(|v| if way == 0.0 { 0.0 } else { (v - final_value) / way }).collect();
    let stepped = excitation == Excitation::Setpoint && way != 0.0;
    Ok(Metrics {
        ie: sums[0],
        iae: sums[1],
        ise: sums[2],
        itae: sums[3],
        peak_error,
        final_value,
        steady_error: r[last] - final_value,
        overshoot_percent: stepped.then(|| 100.0 * shares.iter().fold(0.0f64, |m, s| m.max(*s))),
        decay_ratio: decay_ratio(&shares, excitation),
        rise_time_s: if stepped { rise_time(time_s, &shares) } else { None },
        settling_time_s: settling_time(time_s, &shares),
        total_variation,
        max_u: u.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        min_u: u.iter().copied().fold(f64::INFINITY, f64::min),
    })
}

fn check(time_s: &[f64], r: &[f64], y: &[f64], u: &[f64]) -> Result<(), MetricsError> {
    let count = time_s.len();
    if [r.len(), y.len(), u.len()].iter().any(|n| *n != count) {
        return Err(MetricsError::Lengths { time: count, r: r.len(), y: y.len(), u: u.len() });
    }
    if count < 2 {
        return Err(MetricsError::TooFew { count });
    }
    for i in 0..count {
        if ![time_s[i], r[i], y[i], u[i]].iter().all(|v| v.is_finite()) {
            return Err(MetricsError::NotFinite { index: i });
        }
        if i > 0 && time_s[i] <= time_s[i - 1] {
            return Err(MetricsError::Time { index: i });
        }
    }
    Ok(())
}

fn final_mean(time_s: &[f64], y: &[f64]) -> f64 {
    let end = time_s[time_s.len() - 1];
    let from = end - FINAL_SHARE * (end - time_s[0]);
    let tail = &y[time_s.partition_point(|t| *t < from).min(y.len() - 1)..];
    tail.iter().sum::<f64>() / tail.len() as f64
}

/// Time at which a rising quantity first reaches `level`, interpolated between samples.
fn first_reach(time_s: &[f64], shares: &[f64], level: f64) -> Option<f64> {
    let i = shares.iter().position(|s| *s >= level)?;
    if i == 0 {
        return Some(time_s[0]);
    }
    let fraction = (level - shares[i - 1]) / (shares[i] - shares[i - 1]);
    Some(time_s[i - 1] + fraction * (time_s[i] - time_s[i - 1]))
}

fn rise_time(time_s: &[f64], shares: &[f64]) -> Option<f64> {
    Some(first_reach(time_s, shares, RISE.1 - 1.0)? - first_reach(time_s, shares, RISE.0 - 1.0)?)
}

fn settling_time(time_s: &[f64], shares: &[f64]) -> Option<f64> {
    let Some(last_outside) = shares.iter().rposition(|s| s.abs() > SETTLING_BAND) else { return Some(0.0) };
    if last_outside + 1 == shares.len() {
        return None;
    }
    let (a, b) = (shares[last_outside], shares[last_outside + 1]);
    let fraction = (SETTLING_BAND.copysign(a) - a) / (b - a);
    let (start, end) = (time_s[last_outside], time_s[last_outside + 1]);
    Some(start + fraction * (end - start) - time_s[0])
}

/// Standard deviation of what is noise in equally spaced samples: from the median of the fourth differences, in
/// which a smooth response all but vanishes and independent noise has 70 times its variance.
fn noise(shares: &[f64]) -> f64 {
    let fourth = |w: &[f64]| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs();
    let mut differences: Vec<f64> = shares.windows(5).map(fourth).collect();
    let middle = differences.len() / 2;
    if differences.is_empty() {
        return 0.0;
    }
    let (_, median, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of |x| of a normal distribution is 0.6745 σ.
    *median / (0.6745 * 70f64.sqrt())
}

/// Third excursion from the final value over the first, counted from where y first overshoots (or first leaves).
fn decay_ratio(shares: &[f64], excitation: Excitation) -> Option<f64> {
    let least = LEAST_EXCURSION.max(NOISE_EXCURSION * noise(shares));
    let mut excursions: Vec<f64> = Vec::new();
    let mut current = 0.0f64;
    for &s in shares.iter().chain(std::iter::once(&f64::NAN)) {
        if s.is_nan() || s * current < 0.0 {
            match excursions.last_mut() {
                _ if current.abs() <= least => {}
                // Noise crossed the final value in the middle of a swing.
                Some(last) if *last * current > 0.0 => {
                    if current.abs() > last.abs() {
                        *last = current;
                    }
                }
                _ => excursions.push(current),
            }
            current = 0.0;
        }
        if s.abs() > current.abs() {
            current = s;
        }
    }
    // A setpoint step starts a full way below the final value: that is not an excursion.
    let first = usize::from(excitation == Excitation::Setpoint);
    let (a, b) = (excursions.get(first)?, excursions.get(first + 2)?);
    (a * b > 0.0).then(|| b / a)
}
