//! Proportional control alone, the gain raised until the oscillation holds.
//!
//! A kick of the output sets the loop going, and the first one finds the sign of the process gain. Then u = −K·y, y and u
//! counted from rest. The logarithm of the amplitude's ratio from cycle to cycle is judged at each gain: below 0 it dies
//! out and the gain is raised by a factor, above 0 it grows; between two such gains the next is where the line through
//! both (over ln K) crosses 0. An oscillation that the output's limits cut holds at any gain above the ultimate one: it
//! counts as growing. What grew is calmed with half the gain before the next one is tried.
//!
//! Source: Ziegler & Nichols, Trans. ASME 64 (1942) 759.

use super::progress::Phase;
use super::report::{Finding, UltimateFinding};
use super::signal::{Ground, Heard, Order, State};
use super::spec::UltimateGain;

/// Half cycles left out after a change of the gain.
const SKIPPED: usize = 2;
/// Most half cycles that are judged: those of eight cycles.
const MOST: usize = 17;
/// Samples averaged to see the first kick.
const SMOOTHED: usize = 4;
/// Standard deviations of the noise by which the kick has to move the PV, and to which a crossing is blind.
const SURE: f64 = 3.0;
/// Times the longer of the kick and the last half cycle without a crossing, after which nothing swings any more.
const PATIENCE: f64 = 4.0;
/// Times the band in which crossings are not seen, under which peaks are more noise than oscillation.
const FLOOR: f64 = 4.0;
/// Times the peak after a kick, beyond which an oscillation has grown and is calmed.
const GROWN: f64 = 3.0;
/// Share of the peak after a kick, under which the oscillation has died out.
const DIED_OUT: f64 = 0.02;
/// Logarithmic growth that stands for an oscillation at the limits of the output.
const CUT: f64 = 0.5;
/// Times the gain at the start, at which the search is given up.
const HOPELESS: f64 = 1e4;
/// Widest ratio of two gains between which the ultimate one is not sought any further.
const CLOSE: f64 = 1.005;

/// A gain with the logarithmic growth per cycle seen at it.
type Judged = (f64, f64);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Doing {
    /// The first kick, until the PV has answered.
    FirstKick,
    /// A kick that lasts as long as the first.
    Kick { until_s: f64 },
    /// Control.
    Control,
    /// Control with half the gain, until an oscillation that grew is as small as after the kick.
    Calm,
}

#[derive(Debug, Clone)]
pub(super) struct UltimateMachine {
    test: UltimateGain,
    room: [f64; 2],
    pulse: f64,
    blind: f64,
    /// Highest gain at which an oscillation between the limits of the output stands out of the noise: the first harmonic
    /// of a square wave of height d, 4d/π, over the gain.
    highest: f64,
    doing: Doing,
    recent: [f64; SMOOTHED],
    heard: usize,
    sign: f64,
    kick_s: f64,
    /// First peak after the last kick in PV units.
    kicked: Option<f64>,
    gain: f64,
    gains: u32,
    /// Side of the PV, 0 before the first crossing.
    side: f64,
    crossed_s: f64,
    largest: f64,
    skipped: usize,
    peaks: [f64; MOST],
    times_s: [f64; MOST],
    seen: usize,
    cut: bool,
    dying: Option<Judged>,
    growing: Option<Judged>,
    found: Option<UltimateFinding>,
    last_period_s: Option<f64>,
    last_peak: Option<f64>,
}

impl UltimateMachine {
    pub fn new(test: &UltimateGain, ground: &Ground) -> Self {
        let noise = SURE * ground.base.noise_sd;
        Self {
            test: *test,
            room: ground.room,
            pulse: noise.max(ground.least),
            blind: noise,
            highest: 4.0 * ground.room[1].min(-ground.room[0]) / (std::f64::consts::PI * FLOOR * noise),
            doing: Doing::FirstKick,
            recent: [0.0; SMOOTHED],
            heard: 0,
            sign: 1.0,
            kick_s: 0.0,
            kicked: None,
            gain: test.start_gain,
            gains: 1,
            side: 0.0,
            crossed_s: 0.0,
            largest: 0.0,
            skipped: 0,
            peaks: [0.0; MOST],
            times_s: [0.0; MOST],
            seen: 0,
            cut: false,
            dying: None,
            growing: None,
            found: None,
            last_period_s: None,
            last_peak: None,
        }
    }

    pub fn learn(&mut self, ground: &Ground) {
        *self = Self::new(&self.test, ground);
    }

    pub fn step(&mut self, heard: Heard) -> Order {
        let Heard { t_s, y, .. } = heard;
        match self.doing {
            Doing::FirstKick => {
                if !self.answered(y) {
                    return Order::Move(self.test.kick);
                }
                self.kick_s = t_s;
                self.begin(t_s);
            }
            Doing::Kick { until_s } if t_s < until_s => return Order::Move(self.kick()),
            Doing::Kick { .. } => self.begin(t_s),
            Doing::Control | Doing::Calm => self.watch(t_s, y),
        }
        if self.found.is_some() {
            return Order::Done;
        }
        let [low, high] = self.room;
        if self.gain > self.highest {
            if self.dying.is_some_and(|(gain, _)| gain >= CLOSE.recip() * self.highest) {
                return Order::NoOscillation(self.sign * self.highest);
            }
            self.gain = self.highest;
        }
        if self.gain * self.blind > high - low || self.gain > HOPELESS * self.test.start_gain {
            return Order::NoOscillation(self.sign * self.gain);
        }
        if let Doing::Kick { .. } = self.doing {
            return Order::Move(self.kick());
        }
        let gain = if self.doing == Doing::Calm { 0.5 * self.gain } else { self.gain };
        let wanted = -self.sign * gain * y;
        self.cut |= !(low..=high).contains(&wanted) && self.skipped >= SKIPPED;
        Order::Move(wanted.clamp(low, high))
    }

    /// The kick, to the side on which the PV is already.
    fn kick(&self) -> f64 {
        let side = if self.side == 0.0 { 1.0 } else { self.side * self.sign * self.test.kick.signum() };
        let [low, high] = self.room;
        (side * self.test.kick).clamp(low, high)
    }

    fn answered(&mut self, y: f64) -> bool {
        self.recent[self.heard % SMOOTHED] = y;
        self.heard += 1;
        let mean = self.recent.iter().sum::<f64>() / SMOOTHED as f64;
        self.sign = mean.signum() * self.test.kick.signum();
        self.heard >= SMOOTHED && mean.abs() >= self.pulse
    }

    /// Control begins, or goes on with another gain.
    fn begin(&mut self, now_s: f64) {
        self.doing = Doing::Control;
        self.crossed_s = now_s;
        (self.skipped, self.seen, self.cut) = (0, 0, false);
    }

    fn watch(&mut self, now_s: f64, y: f64) {
        self.largest = self.largest.max(y.abs());
        let side = if y > self.blind {
            1.0
        } else if y < -self.blind {
            -1.0
        } else {
            self.side
        };
        if side != self.side {
            let first = self.side == 0.0;
            self.side = side;
            if !first {
                self.half_cycle(now_s);
            }
            (self.crossed_s, self.largest) = (now_s, y.abs());
            return;
        }
        let half_s = self.last_period_s.map_or(0.0, |period_s| 0.5 * period_s);
        if now_s - self.crossed_s > PATIENCE * self.kick_s.max(half_s) {
            self.nothing_swings(now_s);
        }
    }

    /// A half cycle has ended.
    fn half_cycle(&mut self, now_s: f64) {
        let kicked = *self.kicked.get_or_insert(self.largest);
        if self.doing == Doing::Calm {
            if self.largest <= kicked {
                self.begin(now_s);
            }
            return;
        }
        let floor = (FLOOR * self.blind).max(DIED_OUT * kicked);
        if self.skipped < SKIPPED && self.largest >= floor {
            self.skipped += 1;
            return;
        }
        self.peaks[self.seen] = self.largest;
        self.times_s[self.seen] = now_s;
        self.seen += 1;
        self.last_peak = Some(self.largest);
        if self.largest < floor {
            self.nothing_swings(now_s);
            return;
        }
        if self.seen >= 3 {
            self.last_period_s = Some(self.period_s());
        }
        let grown = self.seen >= 3 && self.largest > GROWN * kicked;
        if grown || self.seen > 2 * self.test.cycles as usize {
            let growth = self.growth();
            if self.cut && growth < -self.test.agreement {
                // It dies out of the limits; what it does within them is yet to be seen.
                self.begin(now_s);
                return;
            }
            self.judge(if self.cut { growth.max(CUT) } else { growth }, now_s);
        }
    }

    /// Logarithmic growth per cycle: the slope of the least-squares line through the logarithms of the peaks.
    fn growth(&self) -> f64 {
        let count = self.seen as f64;
        let middle = 0.5 * (count - 1.0);
        let (mut above, mut below) = (0.0, 0.0);
        for (i, peak) in self.peaks[..self.seen].iter().enumerate() {
            let x = i as f64 - middle;
            above += x * peak.max(f64::MIN_POSITIVE).ln();
            below += x * x;
        }
        2.0 * above / below
    }

    /// Mean period of the half cycles seen, from crossings to the same side.
    fn period_s(&self) -> f64 {
        let last = (self.seen - 1) & !1;
        2.0 * (self.times_s[last] - self.times_s[0]) / last as f64
    }

    /// The gain is far too low, or the oscillation went under in the noise: another gain and another kick.
    fn nothing_swings(&mut self, now_s: f64) {
        if self.doing != Doing::Calm {
            let growth = if self.seen >= 3 { self.growth().min(-self.test.agreement) } else { -1.0 };
            self.next_gain(growth);
        }
        self.doing = Doing::Kick { until_s: now_s + self.kick_s };
        self.kicked = None;
    }

    fn judge(&mut self, growth: f64, now_s: f64) {
        if growth.abs() <= self.test.agreement && !self.cut {
            self.finish(growth);
            return;
        }
        self.next_gain(growth);
        if let (Some((low, _)), Some((high, _))) = (self.dying, self.growing)
            && high / low <= CLOSE
        {
            self.finish(growth);
            return;
        }
        self.begin(now_s);
        if self.last_peak.zip(self.kicked).is_some_and(|(last, kicked)| last > GROWN * kicked) {
            self.doing = Doing::Calm;
        }
    }

    /// The gain at which the line through what was seen crosses 0.
    fn next_gain(&mut self, growth: f64) {
        let seen = Some((self.gain, growth));
        // Noise can contradict itself: what was seen last goes before.
        if growth < 0.0 {
            self.dying = seen;
            self.growing = self.growing.filter(|g| g.0 > self.gain);
        } else {
            self.growing = seen;
            self.dying = self.dying.filter(|d| d.0 < self.gain);
        }
        self.gain = match (self.dying, self.growing) {
            (Some(dying), Some(growing)) => crossing(dying, growing),
            (None, Some((gain, _))) => gain / self.test.factor,
            _ => self.gain * self.test.factor,
        };
        self.gains += 1;
    }

    fn finish(&mut self, growth: f64) {
        let here = (self.gain, growth);
        let other = if growth < 0.0 { self.growing } else { self.dying };
        let ku = other.filter(|o| o.0 != here.0).map_or(self.gain, |other| crossing(here, other));
        self.found =
            Some(UltimateFinding { ku: self.sign * ku, pu_s: self.period_s(), gains: self.gains, growth });
    }

    pub fn state(&self) -> State {
        let phase = match self.doing {
            Doing::FirstKick => Phase::FirstPulse,
            Doing::Kick { .. } | Doing::Control | Doing::Calm => Phase::Raising,
        };
        State {
            cycle: self.gains,
            period_s: self.last_period_s,
            amplitude: self.last_peak,
            ..State::of(phase)
        }
    }

    pub fn finding(&self) -> Finding {
        self.found.map_or(Finding::Nothing, Finding::Ultimate)
    }
}

/// Where the line through two gains with growths of opposite signs, over ln K, crosses 0; kept a little inside.
fn crossing((k1, g1): Judged, (k2, g2): Judged) -> f64 {
    let share = if g1 == g2 { 0.5 } else { (g1 / (g1 - g2)).clamp(0.05, 0.95) };
    (k1.ln() + share * (k2.ln() - k1.ln())).exp()
}
