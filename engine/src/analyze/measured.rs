//! A frequency response measured point by point, and the loop it makes with a controller.
//!
//! Between the points ln |G| and the phase run straight over ln ω. Below the first point G keeps the slope it starts
//! with, constant or 1/ω, and its phase runs to the value that belongs to it in proportion to ω, as a dead time's
//! does. Above the last nothing is known: peaks are sought up to there, and a loop whose gain has not fallen under 1 by
//! then gets no verdict. The process is taken for stable, but for an integrator.

use std::f64::consts::{FRAC_PI_2, PI};

use num_complex::Complex64;

use super::analysis::{Analysis, Peak, Peaks};
use super::measured_error::FrequencyResponseError;
use super::open_loop::Asymptote;
use super::search::{minimum, root};
use super::stability::angle_to_critical;
use crate::control::ParallelGains;

/// Fewest points of a response.
pub(super) const FEWEST: usize = 3;
/// Points of the search between two measured ones.
const BETWEEN: usize = 12;
/// Decades below the first point that the search looks at; below them the limits rule.
const DECADES_BELOW: f64 = 3.0;
/// Slope of ln |G| over ln ω at the lowest frequencies under which a process may integrate, and the least |sin| of the
/// phase that is left there for ω → 0: within 45° of a quarter of a turn.
const INTEGRATES: f64 = -0.5;
const LEAST_SINE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Points of the lowest frequencies: so many at least, and all within this part of a decade.
const LOWEST_POINTS: usize = 8;
const LOWEST_DECADES: f64 = 1.0 / 3.0;
/// Fewest points from which a phase can be held against the gain, what it may lead by in radians, in noise besides so many
/// standard deviations, and what is no lead but a turn lost between two points.
const FEWEST_OF_BODE: usize = 12;
const LEAD: f64 = 0.61;
const LEAD_DEVIATIONS: f64 = 2.5;
const LOST_TURN: f64 = 4.4;
/// Share of the largest gain from which on phases are believed.
const HEARD: f64 = 0.05;

/// Points (ω, G(jω)) of a process in rising frequency, to be read at any frequency up to the last.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyResponse {
    pub(super) log_omega: Vec<f64>,
    pub(super) log_gain: Vec<f64>,
    /// Without jumps of 2π.
    pub(super) phase_rad: Vec<f64>,
    low: Asymptote,
}

impl FrequencyResponse {
    /// Whether the response reaches half a turn of lag, without which no gain can be called too large.
    ///
    /// # Errors
    /// [`FrequencyResponseError::BeforeHalfTurn`] where it ends before.
    pub(crate) fn reaches_half_turn(&self) -> Result<(), FrequencyResponseError> {
        let negative = if self.low.coefficient < 0.0 { PI } else { 0.0 };
        let phase = |rad: &f64| rad - negative;
        let least = self.phase_rad.iter().map(phase).fold(f64::INFINITY, f64::min);
        let last = self.phase_rad.last().map_or(0.0, phase);
        if least > -PI {
            let (omega_rad_s, phase_deg) = (self.last_omega(), last.to_degrees());
            return Err(FrequencyResponseError::BeforeHalfTurn { omega_rad_s, phase_deg });
        }
        Ok(())
    }

    /// Takes points (ω in rad/s, G(jω) in PV units per MV unit).
    ///
    /// # Errors
    /// [`FrequencyResponseError`] for fewer than three points, frequencies that do not rise, values that are 0 or not
    /// finite.
    pub fn new(points: &[(f64, Complex64)]) -> Result<Self, FrequencyResponseError> {
        if points.len() < FEWEST {
            return Err(FrequencyResponseError::TooFew { count: points.len() });
        }
        let mut before = 0.0;
        for (i, (omega, g)) in points.iter().enumerate() {
            let usable = *omega > before && omega.is_finite() && g.is_finite() && g.norm_sqr() > 0.0;
            if !usable {
                return Err(FrequencyResponseError::Point { index: i + 1, omega_rad_s: *omega });
            }
            before = *omega;
        }
        let log_omega: Vec<f64> = points.iter().map(|p| p.0.ln()).collect();
        let log_gain: Vec<f64> = points.iter().map(|p| p.1.norm().ln()).collect();
        let power = if integrates(points, &log_omega, &log_gain) { -1 } else { 0 };
        // The phase at ω → 0 of a positive gain; a negative one is half a turn away from it.
        let upright = f64::from(power) * FRAC_PI_2;
        let first = points[0].1.arg();
        let away = (first - upright).rem_euclid(2.0 * PI);
        // Lag up to three quarters of a turn is a dead time's or a lag's, from there on a negative gain's.
        let negative = (0.25 * PI..1.25 * PI).contains(&away);
        let start = if negative { upright + PI } else { upright };
        let mut phase_rad = Vec::with_capacity(points.len());
        let mut last = start;
        for (_, g) in points {
            let turns = ((last - g.arg()) / (2.0 * PI)).round();
            last = g.arg() + 2.0 * PI * turns;
            phase_rad.push(last);
        }
        let gain = (log_gain[0] - f64::from(power) * log_omega[0]).exp();
        let low = Asymptote { coefficient: if negative { -gain } else { gain }, power };
        let response = Self { log_omega, log_gain, phase_rad, low };
        match response.lead() {
            Some((omega_rad_s, lead)) => {
                Err(FrequencyResponseError::Unstable { omega_rad_s, lead_deg: lead.to_degrees().round() })
            }
            None => Ok(response),
        }
    }

    /// Where and how far the phase leads what Bode's relation makes of the gain, if it does by more than noise explains.
    ///
    /// A stable process has the phase of its gain, φ(ω) = 1/π ∫ d ln|G|/du ln coth |u/2| du with u = ln(ω′/ω), less what
    /// dead time and zeros in the right half plane take off with rising ω; a pole there adds up to half a turn. Source:
    /// Bode, Network Analysis and Feedback Amplifier Design, 1945.
    fn lead(&self) -> Option<(f64, f64)> {
        let (x, g) = (&self.log_omega, &self.log_gain);
        let n = x.len();
        if n < FEWEST_OF_BODE {
            return None;
        }
        let end = n / 8 + 2;
        let low = slope_of(&x[..end], &g[..end]);
        let high = slope_of(&x[n - end..], &g[n - end..]);
        let whole = PI * PI / 4.0;
        let of_gain = |at: f64| {
            let between = (1..n).map(|i| {
                let slope = (g[i] - g[i - 1]) / (x[i] - x[i - 1]);
                slope * (log_coth_integral(x[i] - at) - log_coth_integral(x[i - 1] - at))
            });
            let below = low * (log_coth_integral(x[0] - at) + whole);
            let above = high * (whole - log_coth_integral(x[n - 1] - at));
            (below + between.sum::<f64>() + above) / PI
        };
        let leads: Vec<f64> = x.iter().zip(&self.phase_rad).map(|(at, phase)| phase - of_gain(*at)).collect();
        let bends: f64 = leads.windows(3).map(|l| (l[0] - 2.0 * l[1] + l[2]).powi(2)).sum();
        let deviation = (bends / (6.0 * (n - 2) as f64)).sqrt();
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        let start = mean(&leads[..end]);
        let level = |i: usize| g[i] - f64::from(self.low.power) * x[i];
        let first = mean(&(0..end).map(level).collect::<Vec<_>>());
        let smooth = |i: usize| mean(&leads[i - 2..(i + 3).min(n)]) - start;
        let heard = (end..n).filter(|&i| level(i) > first + HEARD.ln());
        let (omega, lead) = heard.map(|i| (x[i].exp(), smooth(i))).max_by(|a, b| a.1.total_cmp(&b.1))?;
        (lead > LEAD + LEAD_DEVIATIONS * deviation && lead < LOST_TURN).then_some((omega, lead))
    }

    /// Number of measured points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.log_omega.len()
    }

    /// First measured frequency in rad/s.
    #[must_use]
    pub fn first_omega(&self) -> f64 {
        self.log_omega[0].exp()
    }

    /// Last measured frequency in rad/s.
    #[must_use]
    pub fn last_omega(&self) -> f64 {
        self.log_omega[self.log_omega.len() - 1].exp()
    }

    pub(crate) fn low(&self) -> Asymptote {
        self.low
    }

    /// G(jω), ω > 0 in rad/s; beyond the last point its last slope goes on.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Complex64 {
        let x = omega_rad_s.ln();
        if x <= self.log_omega[0] {
            let power = f64::from(self.low.power);
            let limit = power * FRAC_PI_2 + if self.low.coefficient < 0.0 { PI } else { 0.0 };
            let share = omega_rad_s / self.first_omega();
            let phase = limit + (self.phase_rad[0] - limit) * share;
            return Complex64::from_polar(
                self.low.coefficient.abs() * omega_rad_s.powi(self.low.power),
                phase,
            );
        }
        let last = self.log_omega.len() - 1;
        let i = self.log_omega.partition_point(|w| *w < x).clamp(1, last);
        let share = (x - self.log_omega[i - 1]) / (self.log_omega[i] - self.log_omega[i - 1]);
        let between = |of: &[f64]| of[i - 1] + share * (of[i] - of[i - 1]);
        Complex64::from_polar(between(&self.log_gain).exp(), between(&self.phase_rad))
    }

    fn search_frequencies(&self) -> Vec<f64> {
        let mut found = Vec::with_capacity(BETWEEN * self.log_omega.len() + 64);
        let below = DECADES_BELOW * std::f64::consts::LN_10;
        let steps = 60;
        found.extend(
            (0..steps).map(|k| (self.log_omega[0] - below * (1.0 - f64::from(k) / f64::from(steps))).exp()),
        );
        for pair in self.log_omega.windows(2) {
            let step = (pair[1] - pair[0]) / BETWEEN as f64;
            found.extend((0..BETWEEN).map(|k| (pair[0] + k as f64 * step).exp()));
        }
        found.push(self.last_omega());
        found
    }
}

/// Whether the lowest frequencies are those of an integrator: a gain that falls, and a quarter of a turn that is left of
/// the phase when what a dead time or a lag adds in proportion to ω is taken off.
fn integrates(points: &[(f64, Complex64)], log_omega: &[f64], log_gain: &[f64]) -> bool {
    let within = log_omega[0] + LOWEST_DECADES * std::f64::consts::LN_10;
    let count = log_omega.partition_point(|x| *x <= within).max(LOWEST_POINTS.min(points.len()));
    // Few points may span much of the response: no more than a decade of them, but a line takes two.
    let decade = log_omega.partition_point(|x| *x <= log_omega[0] + std::f64::consts::LN_10);
    let count = count.min(decade.max(2));
    if slope_of(&log_omega[..count], &log_gain[..count]) > INTEGRATES {
        return false;
    }
    let mut phases: Vec<f64> = Vec::with_capacity(count);
    for (_, g) in &points[..count] {
        let last = phases.last().copied().unwrap_or_else(|| g.arg());
        phases.push(g.arg() + 2.0 * PI * ((last - g.arg()) / (2.0 * PI)).round());
    }
    let omegas: Vec<f64> = points[..count].iter().map(|p| p.0).collect();
    let mean = |of: &[f64]| of.iter().sum::<f64>() / count as f64;
    let left = mean(&phases) - slope_of(&omegas, &phases) * mean(&omegas);
    left.sin().abs() > LEAST_SINE
}

/// Slope of the straight line through points, by least squares.
fn slope_of(x: &[f64], y: &[f64]) -> f64 {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let both: f64 = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum();
    both / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
}

/// ∫ ln coth |v/2| dv from 0 to u.
fn log_coth_integral(u: f64) -> f64 {
    const TERMS: u32 = 30;
    let q = (-u.abs()).exp();
    // The series ends early where u is small, where it is normed to what it comes to at 0.
    let (mut series, mut at_0, mut power) = (0.0, 0.0, q);
    for k in (0..TERMS).map(|k| f64::from(2 * k + 1)) {
        series += power / (k * k);
        at_0 += 1.0 / (k * k);
        power *= q * q;
    }
    u.signum() * PI * PI / 4.0 * (1.0 - series / at_0)
}

/// Peaks of the loop of a measured process and a controller over the measured range; `None` for an unstable loop.
///
/// # Errors
/// [`FrequencyResponseError::TooShort`] where the loop's gain is 1 or more at the last frequency.
pub fn measured_peaks(
    response: &FrequencyResponse,
    gains: &ParallelGains,
) -> Result<Option<Peaks>, FrequencyResponseError> {
    let walked = Walk::new(response, gains);
    Ok(walked.is_known_stable()?.then(|| walked.peaks()))
}

/// The analysis of the loop of a measured process and a controller; an unstable loop has no measures.
///
/// # Errors
/// [`FrequencyResponseError::TooShort`] where the loop's gain is 1 or more at the last frequency.
pub fn analyze_measured(
    response: &FrequencyResponse,
    gains: &ParallelGains,
) -> Result<Analysis, FrequencyResponseError> {
    let walked = Walk::new(response, gains);
    if !walked.is_known_stable()? {
        return Ok(Analysis::default());
    }
    let peaks = walked.peaks();
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    let mut analysis = Analysis {
        stable: true,
        ms: finite(peaks.s.value),
        mt: finite(peaks.t.value),
        jv: finite(peaks.v.value),
        ju: finite(peaks.u.value),
        ..Analysis::default()
    };
    walked.margins(&mut analysis);
    Ok(analysis)
}

#[derive(Clone, Copy)]
struct Seen {
    omega: f64,
    l: Complex64,
}

/// The loop along the frequencies of the search.
struct Walk<'a> {
    response: &'a FrequencyResponse,
    gains: &'a ParallelGains,
    points: Vec<Seen>,
}

impl<'a> Walk<'a> {
    fn new(response: &'a FrequencyResponse, gains: &'a ParallelGains) -> Self {
        let at = |omega: f64| Seen { omega, l: response.at_omega(omega) * gains.at_omega(omega) };
        Self { response, gains, points: response.search_frequencies().into_iter().map(at).collect() }
    }

    fn l(&self, omega: f64) -> Complex64 {
        self.response.at_omega(omega) * self.gains.at_omega(omega)
    }

    /// Number of integrators of the loop, and the first term's sign.
    fn low(&self) -> (i32, f64) {
        let ParallelGains { kp, ki, .. } = *self.gains;
        let (power, controller) = if ki == 0.0 { (0, kp) } else { (-1, ki) };
        (power + self.response.low.power, controller * self.response.low.coefficient)
    }

    /// Whether the loop is stable, where the points reach far enough to tell.
    fn is_known_stable(&self) -> Result<bool, FrequencyResponseError> {
        let end = self.points[self.points.len() - 1];
        if end.l.norm() >= 1.0 {
            return Err(FrequencyResponseError::TooShort { gain: end.l.norm(), omega_rad_s: end.omega });
        }
        Ok(self.is_stable())
    }

    /// Whether 1 + L turns by π/2 for each integrator from ω → 0 to ∞, as a stable loop of a stable process does.
    fn is_stable(&self) -> bool {
        let (power, coefficient) = self.low();
        if power == 0 && 1.0 + coefficient <= 0.0 {
            return false;
        }
        let start = if power == 0 {
            0.0
        } else {
            f64::from(power) * FRAC_PI_2 + if coefficient < 0.0 { PI } else { 0.0 }
        };
        let (mut total, mut last) = (0.0, start);
        for point in &self.points {
            let angle = (1.0 + point.l).arg();
            let step = (angle - last + PI).rem_euclid(2.0 * PI) - PI;
            total += step;
            last = angle;
        }
        // The rest of the way |L| < 1 and 1 + L stays to the right.
        total -= last;
        (total + f64::from(power) * FRAC_PI_2).abs() < 0.5
    }

    fn peaks(&self) -> Peaks {
        let g = |omega: f64| self.response.at_omega(omega).norm_sqr();
        let reciprocal = |k: usize, omega: f64| {
            let l = self.l(omega);
            let d = (1.0 + l).norm_sqr();
            match k {
                0 => d,
                1 => d / l.norm_sqr(),
                2 => d * omega * omega / g(omega),
                _ => d / self.gains.at_omega(omega).norm_sqr(),
            }
        };
        let peak = |k: usize| -> Peak {
            let values: Vec<(f64, f64)> =
                self.points.iter().map(|p| (p.omega, reciprocal(k, p.omega))).collect();
            let mut best =
                values.iter().copied().fold((0.0, f64::INFINITY), |b, v| if v.1 < b.1 { v } else { b });
            for triple in values.windows(3) {
                if triple[1].1 < triple[0].1 && triple[1].1 <= triple[2].1 && triple[1].1 < 2.0 * best.1 {
                    let found = minimum(|w| reciprocal(k, w), triple[0], triple[1], triple[2]);
                    if found.1 < best.1 {
                        best = found;
                    }
                }
            }
            Peak { value: 1.0 / best.1.sqrt(), omega_rad_s: best.0 }
        };
        let [s, t, mut v, mut u] = [0, 1, 2, 3].map(peak);
        let ParallelGains { kp, ki, kd, tf_s } = *self.gains;
        if ki != 0.0 && v.value < 1.0 / ki.abs() {
            v = Peak { value: 1.0 / ki.abs(), omega_rad_s: 0.0 };
        }
        // Where G has fallen to nothing S is 1 and the controller speaks alone.
        let high = if kd == 0.0 { kp } else { kp + kd / tf_s };
        if u.value < high.abs() {
            u = Peak { value: high.abs(), omega_rad_s: f64::INFINITY };
        }
        Peaks { s, t, v, u }
    }

    fn margins(&self, to: &mut Analysis) {
        let mut nearest: Option<(f64, f64)> = None;
        for pair in self.points.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let excess = |l: Complex64| l.norm().ln();
            if (excess(a.l) > 0.0) != (excess(b.l) > 0.0) {
                let omega = root(|w| excess(self.l(w)), (a.omega, excess(a.l)), (b.omega, excess(b.l)));
                let (angle, lag) = angle_to_critical(self.l(omega));
                if nearest.is_none_or(|(_, best)| angle < best) {
                    nearest = Some((omega, angle));
                }
                let delay = lag / omega;
                if to.delay_margin_s.is_none_or(|best| delay < best) {
                    to.delay_margin_s = Some(delay);
                }
            }
            if (a.l.im > 0.0) != (b.l.im > 0.0) && a.l.re.min(b.l.re) < 0.0 {
                let sine = |l: Complex64| l.im / l.norm();
                let omega = root(|w| sine(self.l(w)), (a.omega, sine(a.l)), (b.omega, sine(b.l)));
                let l = self.l(omega);
                let margin = 1.0 / l.norm();
                if l.re >= 0.0 {
                    continue;
                }
                if margin > 1.0 && to.gain_margin.is_none_or(|m| margin < m) {
                    (to.gain_margin, to.w_180_rad_s) = (Some(margin), Some(omega));
                }
                if margin < 1.0 && to.gain_reduction_margin.is_none_or(|m| margin > m) {
                    to.gain_reduction_margin = Some(margin);
                }
            }
        }
        to.phase_margin_deg = nearest.map(|(_, angle)| angle.to_degrees());
        to.w_gc_rad_s = nearest.map(|(omega, _)| omega);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analyze::analyze;
    use crate::control::PidGains;
    use crate::model::{Fopdt, Ipdt, ProcessModel};

    fn points_of(model: &ProcessModel, from: f64, to: f64, count: usize) -> FrequencyResponse {
        let tf = model.transfer_function();
        let ratio = (to / from).powf(1.0 / (count - 1) as f64);
        let omegas = (0..count).map(|k| from * ratio.powi(k as i32));
        FrequencyResponse::new(&omegas.map(|w| (w, tf.at_omega(w))).collect::<Vec<_>>()).expect("points")
    }

    #[test]
    fn sixty_points_say_what_the_model_says() {
        for (model, gains, range) in [
            (ProcessModel::Fopdt(Fopdt::new(2.0, 40.0, 6.0).expect("a model")), (1.2, 22.0), (2e-3, 1.5)),
            (ProcessModel::Fopdt(Fopdt::new(-2.0, 40.0, 6.0).expect("a model")), (-1.2, 22.0), (2e-3, 1.5)),
            (ProcessModel::Ipdt(Ipdt::new(0.1, 6.0).expect("a model")), (0.5, 60.0), (2e-3, 1.5)),
        ] {
            let response = points_of(&model, range.0, range.1, 60);
            let ideal = PidGains::pi(gains.0, gains.1);
            let parallel = ParallelGains { kp: ideal.kc, ki: ideal.ki(), kd: 0.0, tf_s: 0.0 };
            let (exact, measured) =
                (analyze(&model, &ideal), analyze_measured(&response, &parallel).expect("long enough"));
            assert!(exact.stable && measured.stable, "{model:?}");
            for (a, b) in [
                (exact.ms, measured.ms),
                (exact.mt, measured.mt),
                (exact.jv, measured.jv),
                (exact.ju, measured.ju),
                (exact.gain_margin, measured.gain_margin),
                (exact.phase_margin_deg, measured.phase_margin_deg),
                (exact.delay_margin_s, measured.delay_margin_s),
            ] {
                let (a, b) = (a.expect("a figure"), b.expect("a figure"));
                assert!((b / a - 1.0).abs() < 4e-3, "{model:?}: {a} {b}");
            }
        }
    }

    /// A measured response with noise: both parts of G times 1 plus so much of a normal deviate.
    fn noisy(
        of: impl Fn(f64) -> Complex64,
        range: (f64, f64),
        noise: f64,
        seed: u64,
    ) -> Vec<(f64, Complex64)> {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let ratio = (range.1 / range.0).powf(1.0 / 59.0);
        (0..60)
            .map(|k| range.0 * ratio.powi(k))
            .map(|w| (w, of(w) * (1.0 + noise * Complex64::new(draw(), draw()))))
            .collect()
    }

    fn lag(gain: f64, t: f64, order: i32, dead_time_s: f64) -> impl Fn(f64) -> Complex64 {
        move |w| gain * Complex64::from_polar(1.0, -w * dead_time_s) / Complex64::new(1.0, w * t).powi(order)
    }

    /// The slope of the first two points alone said whether a process integrates: noise on them flipped the sign of the
    /// controller.
    #[test]
    fn noise_on_the_first_points_makes_no_integrator() {
        for noise in [0.0, 0.03, 0.06, 0.1] {
            for seed in 0..12 {
                for (gain, t, order, l, range) in [
                    (4.9, 152.0, 1, 2.0, (1e-3, 10.0)),
                    (1.0, 1.0, 3, 1.0, (0.02, 6.0)),
                    (-1.0, 1.0, 3, 1.0, (0.02, 6.0)),
                ] {
                    let points = noisy(lag(gain, t, order, l), range, noise, seed);
                    let low = FrequencyResponse::new(&points).expect("points").low;
                    assert_eq!(low.power, 0, "{gain} {t} {noise} {seed}");
                    assert!(low.coefficient * gain > 0.0, "{gain} {t} {noise} {seed}");
                }
                for (gain, l) in [(0.03, 2.0), (-0.03, 2.0)] {
                    let of = move |w: f64| gain * Complex64::from_polar(1.0, -w * l) / Complex64::new(0.0, w);
                    let low =
                        FrequencyResponse::new(&noisy(of, (1e-2, 5.0), noise, seed)).expect("points").low;
                    assert_eq!(low.power, -1, "{gain} {noise} {seed}");
                    assert!(low.coefficient * gain > 0.0, "{gain} {noise} {seed}");
                }
            }
        }
    }

    /// The loop of an unstable process was called stable where it is not: nothing said that the process must be stable.
    #[test]
    fn a_response_of_an_unstable_process_is_refused() {
        let unstable = |l: f64| move |w: f64| Complex64::from_polar(1.0, -w * l) / Complex64::new(-1.0, w);
        for seed in 0..12 {
            for (noise, l) in [(0.0, 0.2), (0.0, 0.5), (0.03, 0.2), (0.1, 0.2)] {
                let refused = FrequencyResponse::new(&noisy(unstable(l), (0.02, 20.0), noise, seed));
                assert!(
                    matches!(refused, Err(FrequencyResponseError::Unstable { .. })),
                    "{noise} {l} {seed}: {refused:?}"
                );
            }
            // What a stable one may do: resonate, answer the wrong way first, lead by a zero.
            for noise in [0.0, 0.03, 0.1] {
                let resonant = |w: f64| 1.0 / Complex64::new(1.0 - w * w, 0.04 * w);
                let inverse = |w: f64| Complex64::new(1.0, -2.0 * w) / Complex64::new(1.0, w).powi(3);
                let leading = |w: f64| Complex64::new(1.0, 10.0 * w) / Complex64::new(1.0, w).powi(3);
                let all: [&dyn Fn(f64) -> Complex64; 3] = [&resonant, &inverse, &leading];
                for (i, of) in all.iter().enumerate() {
                    let taken = FrequencyResponse::new(&noisy(of, (0.01, 10.0), noise, seed));
                    assert!(taken.is_ok(), "{i} {noise} {seed}: {taken:?}");
                }
            }
        }
    }

    #[test]
    fn an_unstable_loop_is_called_so_and_a_short_record_says_that_it_is_short() {
        let model = ProcessModel::Fopdt(Fopdt::new(2.0, 40.0, 6.0).expect("a model"));
        let response = points_of(&model, 2e-3, 1.5, 60);
        let unstable = ParallelGains { kp: 9.0, ki: 0.1, kd: 0.0, tf_s: 0.0 };
        assert_eq!(analyze_measured(&response, &unstable), Ok(Analysis::default()));
        let short = points_of(&model, 2e-3, 0.01, 20);
        let gains = ParallelGains { kp: 3.0, ki: 0.1, kd: 0.0, tf_s: 0.0 };
        assert!(matches!(
            analyze_measured(&short, &gains),
            Err(FrequencyResponseError::TooShort { gain, .. }) if gain > 1.0
        ));
    }
}
