//! The relay with hysteresis.
//!
//! A first pulse up finds the sign of the gain; from then on the output goes up at e ≥ ε and down at e ≤ −ε, e = −y·sign,
//! y counted from the PV at rest. A cycle lasts from one switch up to the next. Cycles agree when their periods and
//! amplitudes do, beyond what sampling and noise leave open; when the last ones all agree, they are averaged.
//!
//! Source: Åström & Hägglund, Automatica 20 (1984) 645; hysteresis from the noise: Silva et al., CBA 2014.

use super::progress::Phase;
use super::report::{Finding, RelayFinding};
use super::signal::{Ground, Heard, Order, State};
use super::spec::Relay;

/// Most cycles that may have to agree.
const MOST: usize = 12;
/// Samples averaged to see the first pulse.
const SMOOTHED: usize = 4;
/// Standard deviations of the noise by which the first pulse has to move the PV, and two amplitudes may differ.
const SURE: f64 = 3.0;

/// The mean output of a cycle, as a share of the relay's amplitude, must be that many times the noise, as a share of the
/// cycle's amplitude, to tell the static gain.
const TELLING: f64 = 2.0;
/// A static gain with a standard error beyond this share of it is none.
const UNKNOWN: f64 = 0.3;

/// One cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Cycle {
    period_s: f64,
    /// Half the distance of its extremes in PV units.
    amplitude: f64,
    /// ∫y dt in PV units · s.
    pv_integral: f64,
    /// ∫u dt in MV units · s.
    mv_integral: f64,
}

/// The cycle that is under way.
#[derive(Debug, Clone, Copy)]
struct Open {
    start_s: f64,
    low: f64,
    high: f64,
    pv_integral: f64,
    mv_integral: f64,
}

#[derive(Debug, Clone)]
pub(super) struct RelayMachine {
    relay: Relay,
    width: f64,
    pulse: f64,
    noise_sd: f64,
    sample_time_s: f64,
    recent: [f64; SMOOTHED],
    heard: usize,
    sign: Option<f64>,
    up: bool,
    before: Option<Heard>,
    open: Option<Open>,
    cycles: [Cycle; MOST],
    closed: usize,
}

impl RelayMachine {
    pub fn new(relay: &Relay, ground: &Ground) -> Self {
        let width = relay.hysteresis.width(ground.base.deviation_sd);
        let noise_sd = ground.base.noise_sd;
        Self {
            relay: *relay,
            width,
            pulse: width.max(SURE * noise_sd).max(ground.least),
            noise_sd,
            sample_time_s: ground.sample_time_s,
            recent: [0.0; SMOOTHED],
            heard: 0,
            sign: None,
            up: true,
            before: None,
            open: None,
            cycles: [Cycle::default(); MOST],
            closed: 0,
        }
    }

    pub fn learn(&mut self, ground: &Ground) {
        *self = Self::new(&self.relay, ground);
    }

    pub fn step(&mut self, heard: Heard) -> Order {
        self.integrate(heard);
        self.before = Some(heard);
        match self.sign {
            None => self.watch_pulse(heard.y),
            Some(sign) => self.switch(heard, -heard.y * sign),
        }
        if self.agree() { Order::Done } else { Order::Move(self.output()) }
    }

    fn output(&self) -> f64 {
        if self.up { self.relay.amplitude } else { -self.relay.down() }
    }

    fn watch_pulse(&mut self, y: f64) {
        self.recent[self.heard % SMOOTHED] = y;
        self.heard += 1;
        let mean = self.recent.iter().sum::<f64>() / SMOOTHED as f64;
        if self.heard >= SMOOTHED && mean.abs() >= self.pulse {
            self.sign = Some(mean.signum());
            self.up = false;
        }
    }

    fn switch(&mut self, heard: Heard, e: f64) {
        if self.up && e <= -self.width {
            self.up = false;
        } else if !self.up && e >= self.width {
            self.up = true;
            if let Some(open) = self.open {
                self.close(&open, heard.t_s);
            }
            let (low, high) = (heard.y, heard.y);
            self.open = Some(Open { start_s: heard.t_s, low, high, pv_integral: 0.0, mv_integral: 0.0 });
        }
    }

    fn integrate(&mut self, heard: Heard) {
        if let (Some(open), Some(before)) = (&mut self.open, self.before) {
            let dt_s = heard.t_s - before.t_s;
            open.low = open.low.min(heard.y);
            open.high = open.high.max(heard.y);
            open.pv_integral += 0.5 * (before.y + heard.y) * dt_s;
            open.mv_integral += heard.u * dt_s;
        }
    }

    fn close(&mut self, open: &Open, now_s: f64) {
        self.cycles[self.closed % MOST] = Cycle {
            period_s: now_s - open.start_s,
            amplitude: 0.5 * (open.high - open.low),
            pv_integral: open.pv_integral,
            mv_integral: open.mv_integral,
        };
        self.closed += 1;
    }

    /// The last cycles, as many as have to agree, or as there are.
    fn last(&self) -> impl Iterator<Item = Cycle> + Clone + '_ {
        let wanted = (self.relay.cycles as usize).min(self.closed);
        (self.closed - wanted..self.closed).map(|i| self.cycles[i % MOST])
    }

    fn agree(&self) -> bool {
        if self.closed < self.relay.cycles as usize {
            return false;
        }
        let within = |of: fn(&Cycle) -> f64, beyond: f64| {
            let low = self.last().map(|c| of(&c)).fold(f64::MAX, f64::min);
            let high = self.last().map(|c| of(&c)).fold(f64::MIN, f64::max);
            high - low <= self.relay.agreement * high + beyond
        };
        // Noise moves a switch by σ over the slope, 4a a period for a triangle.
        let slope = |c: &Cycle| 4.0 * c.amplitude / c.period_s;
        let steepest = self.last().map(|c| slope(&c)).fold(f64::MIN_POSITIVE, f64::max);
        let noise = SURE * self.noise_sd;
        within(|c| c.period_s, 2.0 * self.sample_time_s + noise / steepest) && within(|c| c.amplitude, noise)
    }

    fn mean(&self, of: fn(&Cycle) -> f64) -> Option<f64> {
        let count = self.last().count();
        (count > 0).then(|| self.last().map(|c| of(&c)).sum::<f64>() / count as f64)
    }

    /// ∫y dt/∫u dt over the last cycles, and its standard error: as they differ among each other, and by what the mean PV
    /// may still have to go. Where the process integrates over a cycle, the mean output is close to that at rest, and
    /// noise alone decides the ratio.
    fn static_gain(&self) -> Option<(f64, f64)> {
        let count = self.last().count() as f64;
        let gain = self.mean(|c| c.pv_integral)? / self.mean(|c| c.mv_integral)?;
        let squares: f64 = self.last().map(|c| (c.pv_integral - gain * c.mv_integral).powi(2)).sum();
        let error = (squares / (count * (count - 1.0))).sqrt() / self.mean(|c| c.mv_integral)?.abs();
        let mean_mv = self.mean(|c| c.mv_integral)? / self.mean(|c| c.period_s)?;
        let share = mean_mv.abs() / (0.5 * (self.relay.amplitude + self.relay.down()));
        let tells = share > TELLING * self.noise_sd / self.mean(|c| c.amplitude)?;
        let error = error.hypot(gain.abs() * self.left_to_go()?);
        (tells && gain.is_finite() && error < UNKNOWN * gain.abs()).then_some((gain, error))
    }

    /// Share of the mean PV by which it may still change; `None` where it says nothing of where it goes.
    ///
    /// A mean that settles as 1 − e^(−x), x cycles over the time constant counted in cycles, grows by
    /// q = x/(eˣ − 1) of itself times cycle over cycles so far; 1/(eˣ − 1) = q/x is left. q is taken two standard errors
    /// above what was seen.
    fn left_to_go(&self) -> Option<f64> {
        /// Above this most of the way is still to go.
        const GROWS: f64 = 0.5;
        let count = self.last().count() as f64;
        let mean_of = |c: Cycle| c.pv_integral / c.period_s;
        let (first, last) = (mean_of(self.last().next()?), mean_of(self.last().last()?));
        let mean = self.last().map(mean_of).sum::<f64>() / count;
        let samples = self.mean(|c| c.period_s)? / self.sample_time_s;
        let noise = self.noise_sd * (2.0 / samples).sqrt() / (count - 1.0);
        let growth = (last - first).abs() / (count - 1.0) + 2.0 * noise;
        let q = growth * (self.closed as f64 - 0.5 * count) / mean.abs();
        if q.is_nan() || q >= GROWS {
            return None;
        }
        let (mut low, mut high) = (1.0_f64, 60.0_f64);
        for _ in 0..50 {
            let x = 0.5 * (low + high);
            if x / x.exp_m1() > q { low = x } else { high = x }
        }
        Some(q / low)
    }

    pub fn state(&self) -> State {
        let phase = if self.sign.is_none() { Phase::FirstPulse } else { Phase::Cycling };
        State {
            cycle: u32::try_from(self.closed).unwrap_or(u32::MAX),
            period_s: self.mean(|c| c.period_s),
            amplitude: self.mean(|c| c.amplitude),
            ..State::of(phase)
        }
    }

    pub fn finding(&self) -> Finding {
        let d = 0.5 * (self.relay.amplitude + self.relay.down());
        let amplitude = self.mean(|c| c.amplitude).unwrap_or(f64::NAN);
        let period_s = self.mean(|c| c.period_s).unwrap_or(f64::NAN);
        let sign = self.sign.unwrap_or(1.0);
        let describing = 4.0 * d / (std::f64::consts::PI * amplitude);
        let under_root = amplitude * amplitude - self.width * self.width;
        let with_hysteresis = 4.0 * d / (std::f64::consts::PI * under_root.max(0.0).sqrt());
        let asymmetric = self.relay.amplitude != self.relay.down();
        let gain = asymmetric.then(|| self.static_gain()).flatten();
        Finding::Relay(RelayFinding {
            period_s,
            omega_rad_s: 2.0 * std::f64::consts::PI / period_s,
            amplitude,
            hysteresis: self.width,
            cycles: self.relay.cycles,
            ku: sign * describing,
            ku_hysteresis: (under_root > 0.0).then_some(sign * with_hysteresis),
            static_gain: gain.map(|(gain, _)| gain),
            static_gain_error: gain.map(|(_, error)| error),
        })
    }
}
