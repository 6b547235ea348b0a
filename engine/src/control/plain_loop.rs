//! The plain loop of several plants at once: PID-I2GL in automatic with nothing around it but PV filter, limits and rate.
//!
//! It does in lanes what [`ControlLoop`] does for one plant, to the last bit: the same operations in the same order.

use super::control_loop::{ControlLoop, filter_share};
use super::controller::{Limits, Mode};
use super::derivative::Sampled;
use super::law::{Clip, Law, Running, Sends};
use super::options::LoopOptions;
use super::tuning::PidTuning;
use crate::plant::Number;

/// Setpoint and PV of the last sample, in cm.
#[derive(Debug, Clone, Copy)]
struct Seen<V> {
    setpoint: f64,
    pv: V,
}

impl<V: Number> Seen<V> {
    /// w·r − y.
    #[inline(always)]
    fn weighted(self, weight: f64) -> V {
        V::of(weight * self.setpoint) - self.pv
    }
}

/// A plain loop in operation in every plant.
#[derive(Debug, Clone)]
pub(crate) struct PlainLoop<V> {
    /// Setpoint in cm, the same in every plant.
    pub setpoint_cm: f64,
    tuning: PidTuning,
    sampled: Sampled,
    sample_time_s: f64,
    limits: Limits,
    most_per_sample: f64,
    /// Share of the way to the PV that its filter goes in a sample; none without a filter.
    filter_share: Option<f64>,
    filtered: Option<V>,
    last: Option<Seen<V>>,
    derivative: V,
    /// The present output in MV units.
    pub mv: V,
}

impl<V: Number> PlainLoop<V> {
    /// A loop that goes on from where another stands; none where that is not a plain one.
    pub fn of(one: &ControlLoop) -> Option<Self> {
        let plain = LoopOptions { output: one.options().output, ..LoopOptions::default() };
        let Running::I2gl(pid) = &one.running else { return None };
        let simple = one.mode == Mode::Automatic
            && !one.last().held
            && *one.options() == plain
            && pid.clip == Clip::Output
            && matches!(one.law(), Law::PidI2gl { sends: Sends::Position, .. });
        let mut made = Self {
            setpoint_cm: one.setpoint_cm,
            tuning: one.tuning(),
            sampled: Sampled::of(&one.tuning().gains, one.sample_time_s),
            sample_time_s: one.sample_time_s,
            limits: one.limits(),
            most_per_sample: one.most_per_sample,
            filter_share: None,
            filtered: one.filtered_pv.map(V::of),
            last: pid.last.map(|s| Seen { setpoint: s.setpoint, pv: V::of(s.pv) }),
            derivative: V::of(pid.derivative),
            mv: V::of(one.mv()),
        };
        made.set_pv_filter(one.pv_filter_s());
        simple.then_some(made)
    }

    /// Takes a new tuning.
    pub fn set_tuning(&mut self, tuning: PidTuning) {
        let (old, new) = (self.tuning.gains, tuning.gains);
        if old.td_s != new.td_s || old.n != new.n {
            self.derivative = V::of(0.0);
        }
        self.sampled = Sampled::of(&new, self.sample_time_s);
        self.tuning = tuning;
    }

    /// Changes the time constant of the PV filter, in seconds.
    pub fn set_pv_filter(&mut self, time_constant_s: f64) {
        self.filter_share = filter_share(time_constant_s, self.sample_time_s);
    }

    /// One sample with these measured PVs, which are numbers; gives the outputs.
    #[inline(always)]
    pub fn update(&mut self, pv: V) -> V {
        let before = self.filtered.unwrap_or(pv);
        let pv = self.filter_share.map_or(pv, |share| before + (pv - before) * share);
        self.filtered = Some(pv);
        let now = Seen { setpoint: self.setpoint_cm, pv };
        let last = self.last.unwrap_or(now);
        let PidTuning { gains, b, c } = self.tuning;
        let Sampled { a_d, b_d, integral } = self.sampled;
        let derivative = self.derivative * a_d + (now.weighted(c) - last.weighted(c)) * b_d;
        let p = (now.weighted(b) - last.weighted(b)) * gains.kc;
        let i = (now.weighted(1.0) + last.weighted(1.0)) * integral;
        let d = derivative - self.derivative;
        (self.last, self.derivative) = (Some(now), derivative);
        let (low, high) = (V::of(self.limits.low), V::of(self.limits.high));
        let mut wanted = self.mv + ((p + d) + i);
        if self.most_per_sample < f64::INFINITY {
            let most = V::of(self.most_per_sample);
            let least_now = (self.mv - most).larger(low).smaller(high);
            let most_now = (self.mv + most).larger(low).smaller(high);
            wanted = wanted.larger(least_now).smaller(most_now);
        } else {
            wanted = wanted.larger(low).smaller(high);
        }
        self.mv = wanted;
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{LoopInput, LoopSpec, OutputRange, PidGains};

    fn one(options: LoopOptions) -> ControlLoop {
        let spec = LoopSpec {
            id: "LIC-02".to_owned(),
            sensor: "LT02".to_owned(),
            pump: Some("BA01".to_owned()),
            cascade_to: None,
            setpoint_cm: 15.0,
            mode: Mode::Automatic,
            law: Law::default(),
            options,
            pv_filter_s: 0.0,
            kc: Some(1.8),
            ti_s: Some(152.0),
            gains: None,
            td_s: 2.0,
            n: 10.0,
            b: 1.0,
            c: 0.0,
        };
        ControlLoop::new(&spec, 0.2, OutputRange { low: 1.0, high: 3.5, rate_per_s: 2.0 }, 2.0)
    }

    #[test]
    fn it_does_what_the_loop_of_one_plant_does_to_the_last_bit() {
        let mut alone = one(LoopOptions::default());
        let mut plain = PlainLoop::<f64>::of(&alone).expect("a plain loop");
        for sample in 0..3000_u32 {
            if sample == 1000 {
                let tuning = PidTuning::new(PidGains::pid(7.0, 15.0, 1.0));
                alone.set_tuning(tuning);
                plain.set_tuning(tuning);
                alone.set_pv_filter(1.5);
                plain.set_pv_filter(1.5);
                (alone.setpoint_cm, plain.setpoint_cm) = (16.0, 16.0);
            }
            let pv_cm = 15.0 + (f64::from(sample) * 0.7).sin() * f64::from(sample % 37) * 0.01;
            let input = LoopInput { pv_cm, disturbance: f64::NAN, actual: Mode::Automatic, blocked: None };
            let mv = alone.update(&input).mv;
            assert!(plain.update(pv_cm).to_bits() == mv.to_bits(), "sample {sample}: {} {mv}", plain.mv);
        }
    }

    #[test]
    fn what_has_more_around_it_is_no_plain_loop() {
        let ramp = crate::control::SetpointPath { ramp_cm_s: Some(0.1), filter_s: 0.0 };
        let options = LoopOptions { setpoint: ramp, ..LoopOptions::default() };
        assert!(PlainLoop::<f64>::of(&one(options)).is_none());
        let mut manual = one(LoopOptions::default());
        manual.mode = Mode::Manual;
        assert!(PlainLoop::<f64>::of(&manual).is_none());
    }
}
