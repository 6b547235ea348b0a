//! The way of a sample through a loop. In this order:
//!
//! 1. PV filter (first order).
//! 2. Setpoint: ramp, then filter. A setpoint from an outer loop passes both by.
//! 3. Smith predictor: the PV as it would be without the dead time.
//! 4. Gain schedule: Kc and Ti at the filtered level.
//! 5. Deadband: the PV moves towards the setpoint by what does not count of the error.
//! 6. Feed-forward: gain, lead and lag on the change of the disturbance.
//! 7. The law, whose limiter has the output's limits, narrowed to what the largest rate allows in a sample, and
//!    to the side that is free where an inner loop is at its limit.
//!
//! A change of 3 to 6, and of the law, brings no jump of the output: the law goes on from where it stands.

use super::controller::{Bound, ControlInput, ControlOutput, Controller, Limits, Mode};
use super::feedforward::LeadLag;
use super::law::{Law, Running, Sends};
use super::loop_spec::LoopSpec;
use super::options::LoopOptions;
use super::schedule::scheduled;
use super::setpoint_path::SetpointShaper;
use super::smith::SmithPredictor;
use super::tuning::PidTuning;

/// Range and largest rate of what a loop writes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputRange {
    /// Lowest value in MV units.
    pub low: f64,
    /// Highest value in MV units.
    pub high: f64,
    /// Largest change per second in MV units; ∞ for none.
    pub rate_per_s: f64,
}

/// What a loop gets for a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopInput {
    /// Measured PV in cm.
    pub pv_cm: f64,
    /// Measured disturbance in its unit; without a feed-forward it is not looked at.
    pub disturbance: f64,
    /// Mode that is possible now; differs from the mode asked for while an outer loop has to wait.
    pub actual: Mode,
    /// Side to which the output must not go further, since an inner loop is at its limit.
    pub blocked: Option<Bound>,
}

/// A loop in operation.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlLoop {
    pub(super) running: Running,
    law: Law,
    tuning: PidTuning,
    options: LoopOptions,
    pub(super) sample_time_s: f64,
    range: OutputRange,
    limits: Limits,
    pub(super) most_per_sample: f64,
    /// Setpoint in cm that the operator or the outer loop gave.
    pub setpoint_cm: f64,
    /// Mode that was asked for.
    pub mode: Mode,
    pv_filter_s: f64,
    /// Share of the way to the PV that its filter goes in a sample; none without a filter.
    filter_share: Option<f64>,
    pub(super) filtered_pv: Option<f64>,
    shaper: SetpointShaper,
    lead_lag: LeadLag,
    smith: Option<SmithPredictor>,
    last: ControlOutput,
    working_setpoint_cm: f64,
    actual: Mode,
}

impl ControlLoop {
    /// A loop at rest at the output `mv`, which writes within `range`.
    #[must_use]
    pub fn new(spec: &LoopSpec, sample_time_s: f64, range: OutputRange, mv: f64) -> Self {
        let tuning = spec.tuning();
        let mv = mv.clamp(range.low, range.high);
        let mut new = Self {
            running: Running::new(&spec.law, tuning, sample_time_s, mv),
            law: spec.law,
            tuning,
            options: LoopOptions::default(),
            sample_time_s,
            range,
            limits: Limits { low: range.low, high: range.high },
            most_per_sample: f64::INFINITY,
            setpoint_cm: spec.setpoint_cm,
            mode: spec.mode,
            pv_filter_s: spec.pv_filter_s,
            filter_share: filter_share(spec.pv_filter_s, sample_time_s),
            filtered_pv: None,
            shaper: SetpointShaper::default(),
            lead_lag: LeadLag::default(),
            smith: None,
            last: ControlOutput { held: false, ..ControlOutput::held(mv) },
            working_setpoint_cm: spec.setpoint_cm,
            actual: spec.mode,
        };
        new.take_options(spec.options.clone());
        new
    }

    /// The same loop, going on from its output whatever its law would start with.
    #[must_use]
    pub fn taking_over(mut self) -> Self {
        self.running.rebase();
        self
    }

    /// The tuning in use; a schedule goes before its Kc and Ti.
    #[must_use]
    pub fn tuning(&self) -> PidTuning {
        self.tuning
    }

    /// The tuning of the last sample, schedule included.
    #[must_use]
    pub fn scheduled_tuning(&self) -> PidTuning {
        self.filtered_pv.map_or(self.tuning, |pv| scheduled(&self.options.schedule, self.tuning, pv))
    }

    /// Takes a new tuning.
    pub fn set_tuning(&mut self, tuning: PidTuning) {
        self.tuning = tuning;
        self.running.set_tuning(self.scheduled_tuning());
    }

    /// The law.
    #[must_use]
    pub fn law(&self) -> &Law {
        &self.law
    }

    /// Changes the law or its settings; the output goes on from where it is.
    pub fn set_law(&mut self, law: Law) {
        if !self.running.reconfigure(&law) {
            self.running = Running::new(&law, self.scheduled_tuning(), self.sample_time_s, self.mv());
            self.running.rebase();
        }
        self.law = law;
    }

    /// What stands around the law.
    #[must_use]
    pub fn options(&self) -> &LoopOptions {
        &self.options
    }

    /// Changes what stands around the law; the output goes on from where it is.
    pub fn set_options(&mut self, options: LoopOptions) {
        let old = &self.options;
        let inside = old.deadband != options.deadband
            || old.schedule != options.schedule
            || old.feedforward != options.feedforward
            || old.smith != options.smith;
        self.take_options(options);
        if inside {
            self.running.rebase();
        }
    }

    fn take_options(&mut self, options: LoopOptions) {
        if options.smith != self.options.smith {
            let mv = self.mv();
            self.smith = options.smith.map(|model| SmithPredictor::new(model, self.sample_time_s, mv));
        }
        if options.feedforward != self.options.feedforward {
            self.lead_lag = LeadLag::default();
        }
        let output = options.output;
        self.limits = Limits {
            low: output.low.unwrap_or(self.range.low),
            high: output.high.unwrap_or(self.range.high),
        };
        let rate = output.rate_per_s.unwrap_or(f64::INFINITY).min(self.range.rate_per_s);
        self.most_per_sample = rate * self.sample_time_s;
        self.options = options;
        self.running.set_tuning(self.scheduled_tuning());
    }

    /// Time constant of the PV filter in seconds.
    #[must_use]
    pub fn pv_filter_s(&self) -> f64 {
        self.pv_filter_s
    }

    /// Changes the PV filter; it goes on from its present value.
    pub fn set_pv_filter(&mut self, pv_filter_s: f64) {
        self.pv_filter_s = pv_filter_s;
        self.filter_share = filter_share(pv_filter_s, self.sample_time_s);
    }

    /// The present output in MV units.
    #[must_use]
    pub fn mv(&self) -> f64 {
        self.running.mv()
    }

    /// Limits of the output in MV units.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// What the last sample came to.
    #[must_use]
    pub fn last(&self) -> &ControlOutput {
        &self.last
    }

    /// Setpoint that the law saw in the last sample, after ramp and filter, in cm.
    #[must_use]
    pub fn working_setpoint_cm(&self) -> f64 {
        self.working_setpoint_cm
    }

    /// Mode of the last sample.
    #[must_use]
    pub fn actual_mode(&self) -> Mode {
        self.actual
    }

    /// The limit at which the output stands.
    #[must_use]
    pub fn at_limit(&self) -> Option<Bound> {
        self.limits.reached(self.mv())
    }

    /// The side to which an outer loop must not move this loop's setpoint further: that way the output cannot go.
    #[must_use]
    pub fn blocks_outer(&self, blocked: Option<Bound>) -> Option<Bound> {
        let direct = self.law.action(&self.scheduled_tuning()).sign() < 0.0;
        match self.last.cut.and(self.at_limit()).or(blocked)? {
            Bound::High if direct => Some(Bound::Low),
            Bound::Low if direct => Some(Bound::High),
            bound => Some(bound),
        }
    }

    /// Puts the output to a value, for manual operation.
    pub fn set_mv(&mut self, mv: f64) {
        if mv.is_finite() {
            self.running.set_mv(self.limits.clamp(mv));
        }
    }

    /// Learns what the final element took.
    pub fn applied(&mut self, mv: f64) {
        self.running.applied(mv);
    }

    /// Whether the actuator adds up what this loop sends.
    #[must_use]
    pub fn sends_increments(&self) -> bool {
        matches!(self.law, Law::PidI2gl { sends: Sends::Increment, .. })
    }

    /// One sample.
    pub fn update(&mut self, input: &LoopInput) -> &ControlOutput {
        self.actual = input.actual;
        if self.last.held && input.pv_cm.is_finite() {
            // The PV is back, somewhere else perhaps: what it did meanwhile is nothing to answer with a jump.
            self.filtered_pv = None;
            self.running.rebase();
        }
        let level_cm = self.filter(input.pv_cm);
        let remote = input.actual == Mode::Cascade;
        let setpoint = self.lead_setpoint(remote);
        let mut pv = level_cm;
        if let Some(smith) = &self.smith {
            pv += smith.correction();
        }
        if !self.options.schedule.is_empty() && level_cm.is_finite() {
            self.running.set_tuning(self.scheduled_tuning());
        }
        if let Some(band) = &self.options.deadband {
            pv = band.pv(setpoint, pv);
        }
        let feedforward = match &self.options.feedforward {
            Some(spec) => self.lead_lag.step(spec, input.disturbance, self.sample_time_s),
            None => 0.0,
        };
        let limits = self.limits_now(input.blocked);
        let controlling = input.actual.is_controlling();
        self.last = self.running.step(&ControlInput { setpoint, pv, feedforward, limits, controlling });
        if let Some(smith) = &mut self.smith {
            smith.advance(self.last.mv);
        }
        &self.last
    }

    fn filter(&mut self, pv_cm: f64) -> f64 {
        if !pv_cm.is_finite() {
            return pv_cm;
        }
        let pv = match self.filter_share {
            Some(share) => {
                let before = self.filtered_pv.unwrap_or(pv_cm);
                before + share * (pv_cm - before)
            }
            None => pv_cm,
        };
        if pv.is_finite() {
            self.filtered_pv = Some(pv);
        }
        pv
    }

    fn lead_setpoint(&mut self, remote: bool) -> f64 {
        if remote {
            self.shaper.jump(self.setpoint_cm);
            self.working_setpoint_cm = self.setpoint_cm;
        } else {
            self.working_setpoint_cm =
                self.shaper.step(&self.options.setpoint, self.setpoint_cm, self.sample_time_s);
        }
        self.working_setpoint_cm
    }

    /// The limits of this sample.
    #[inline]
    fn limits_now(&self, blocked: Option<Bound>) -> Limits {
        let mv = self.mv();
        let mut now = self.limits;
        if self.most_per_sample < f64::INFINITY {
            now = Limits {
                low: self.limits.clamp(mv - self.most_per_sample),
                high: self.limits.clamp(mv + self.most_per_sample),
            };
        }
        match blocked {
            Some(Bound::High) => now.high = now.high.min(mv).max(now.low),
            Some(Bound::Low) => now.low = now.low.max(mv).min(now.high),
            None => {}
        }
        now
    }
}

/// Share of the way to the PV that a filter of first order goes in a sample; none for a time constant of 0.
pub(super) fn filter_share(time_constant_s: f64, sample_time_s: f64) -> Option<f64> {
    (time_constant_s > 0.0).then(|| -(-sample_time_s / time_constant_s).exp_m1())
}
