//! Sines one after the other: the frequency response, point by point.
//!
//! At each frequency the PV is fitted, cycle by cycle, by b + c·t + p cos ωt + q sin ωt; when two cycles agree, the
//! answer has settled, and the cycles after it are fitted together. The MV is fitted as it was applied, held from sample
//! to sample: of a held sine of phasor U, the plant feels U·sinc(ωh/2)·e^(−jωh/2). G(jω) is the ratio of the two.

use nalgebra::{Matrix4, Vector4};
use num_complex::Complex64;

use super::progress::Phase;
use super::report::{Finding, FrequencyPoint};
use super::signal::{Ground, Heard, Order, State};
use super::spec::SteppedSine;

/// Standard errors by which noise alone may tell two cycles apart.
const SURE: f64 = 3.0;
/// Times are multiples of the sample time up to rounding.
const ROUNDING: f64 = 1e-6;

/// Normal equations of the fit over some samples.
#[derive(Debug, Clone, Copy)]
struct HarmonicFit {
    normal: Matrix4<f64>,
    right: Vector4<f64>,
    count: u32,
}

impl HarmonicFit {
    fn new() -> Self {
        Self { normal: Matrix4::zeros(), right: Vector4::zeros(), count: 0 }
    }

    /// Takes a value at a time; `drift` is that time within the fit, scaled to about 1.
    fn push(&mut self, phase: f64, drift: f64, value: f64) {
        let row = Vector4::new(1.0, drift, phase.cos(), phase.sin());
        self.normal += row * row.transpose();
        self.right += row * value;
        self.count += 1;
    }

    /// p − jq, the phasor of cos ωt.
    fn phasor(&self) -> Option<Complex64> {
        let found = self.normal.cholesky()?.solve(&self.right);
        Some(Complex64::new(found[2], -found[3]))
    }
}

/// PV and MV over the same samples.
#[derive(Debug, Clone, Copy)]
struct Window {
    from_s: f64,
    pv: HarmonicFit,
    mv: HarmonicFit,
}

impl Window {
    fn new(from_s: f64) -> Self {
        Self { from_s, pv: HarmonicFit::new(), mv: HarmonicFit::new() }
    }
}

#[derive(Debug, Clone)]
pub(super) struct SineMachine {
    sine: SteppedSine,
    noise_sd: f64,
    sample_time_s: f64,
    room: [f64; 2],
    index: usize,
    /// When the present frequency began.
    start_s: f64,
    window: Window,
    /// Cycles that the window holds when it is full.
    length: u32,
    measuring: bool,
    before: Option<Complex64>,
    /// Time and phase of the output before this sample.
    last: Option<(f64, f64)>,
    points: Vec<FrequencyPoint>,
}

impl SineMachine {
    pub fn new(sine: &SteppedSine, ground: &Ground) -> Self {
        Self {
            noise_sd: ground.base.noise_sd,
            sample_time_s: ground.sample_time_s,
            room: ground.room,
            index: 0,
            start_s: 0.0,
            window: Window::new(0.0),
            length: 1,
            measuring: false,
            before: None,
            last: None,
            points: Vec::with_capacity(sine.frequencies_rad_s.len()),
            sine: sine.clone(),
        }
    }

    pub fn learn(&mut self, ground: &Ground) {
        (self.noise_sd, self.room) = (ground.base.noise_sd, ground.room);
    }

    fn omega(&self) -> Option<f64> {
        self.sine.frequencies_rad_s.get(self.index).copied()
    }

    fn period_s(&self) -> f64 {
        self.omega().map_or(1.0, |omega| 2.0 * std::f64::consts::PI / omega)
    }

    pub fn step(&mut self, heard: Heard) -> Order {
        let drift = |window: &Window, t_s: f64, length_s: f64| (t_s - window.from_s) / length_s - 0.5;
        let length_s = f64::from(self.length) * self.period_s();
        if let Some((t_s, phase)) = self.last {
            // The value in force since the sample before belongs to that sample.
            let at = drift(&self.window, t_s, length_s);
            self.window.mv.push(phase, at, heard.u);
        }
        if heard.t_s >= self.window.from_s + length_s * (1.0 - ROUNDING) && self.window.pv.count >= 5 {
            self.judge(heard.t_s);
        }
        let Some(omega) = self.omega() else { return Order::Done };
        let phase = omega * (heard.t_s - self.start_s);
        let at = drift(&self.window, heard.t_s, f64::from(self.length) * self.period_s());
        self.window.pv.push(phase, at, heard.y);
        self.last = Some((heard.t_s, phase));
        let [low, high] = self.room;
        Order::Move((self.sine.amplitude * phase.sin()).clamp(low, high))
    }

    /// A window is full: goes on to the next cycle, to the measurement, or to the next frequency.
    fn judge(&mut self, now_s: f64) {
        let found = self.response();
        let noise =
            SURE * self.noise_sd * (4.0 / f64::from(self.window.pv.count)).sqrt() / self.sine.amplitude;
        self.window = Window::new(now_s);
        self.last = None;
        if self.measuring {
            let omega_rad_s = self.omega().unwrap_or(f64::NAN);
            if let Some(response) = found {
                self.points.push(FrequencyPoint { omega_rad_s, response });
            }
            self.index += 1;
            (self.start_s, self.length, self.measuring, self.before) = (now_s, 1, false, None);
            return;
        }
        let settled = self
            .before
            .zip(found)
            .is_some_and(|(before, now)| (now - before).norm() <= self.sine.agreement * now.norm() + noise);
        self.before = found;
        if settled {
            (self.measuring, self.length) = (true, self.sine.cycles);
        }
    }

    /// G(jω) as the window tells it.
    fn response(&self) -> Option<Complex64> {
        let half = 0.5 * self.omega()? * self.sample_time_s;
        let held = Complex64::from_polar(half.sin() / half, -half);
        let mv = self.window.mv.phasor()? * held;
        (mv.norm() > 0.0).then(|| self.window.pv.phasor().map(|pv| pv / mv)).flatten()
    }

    pub fn state(&self) -> State {
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let of = self.sine.frequencies_rad_s.len();
        State {
            cycle: count((self.index + 1).min(of)),
            of: Some(count(of)),
            period_s: self.omega().map(|_| self.period_s()),
            amplitude: self.before.map(|g| g.norm() * self.sine.amplitude),
            ..State::of(if self.measuring { Phase::Measuring } else { Phase::Settling })
        }
    }

    pub fn finding(&mut self) -> Finding {
        Finding::Frequencies(std::mem::take(&mut self.points))
    }
}
