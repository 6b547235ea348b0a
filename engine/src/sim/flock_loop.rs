//! The loops of a flock: sensor, controller and pump of every plant.

use std::sync::Arc;

use super::active_loop::ActiveLoop;
use crate::control::{ControlLoop, Law, LoopInput, PlainLoop, check_filter};
use crate::daq::{Noise, convert};
use crate::plant::{Measurement, Network, Number, Pack, Transmitter};
use crate::session::RigCommand;

/// The controllers of a loop.
enum Steering {
    /// All plants at once.
    Plain(Box<PlainLoop<Pack>>),
    /// Plant by plant.
    Each(Vec<ControlLoop>),
}

/// A loop in every plant.
pub(super) struct FlockLoop {
    pub tag: String,
    /// Tank of the sensor.
    pub tank: usize,
    pub pump: usize,
    law: Law,
    steering: Steering,
    transmitter: Transmitter,
    noise: Vec<Noise>,
    /// Last PV and output.
    pub pv_cm: Pack,
    pub mv: Pack,
    /// Piece of each pump's curve where its input lay last.
    pieces: [usize; Pack::PLANTS],
    dac_step: Option<f64>,
    sample_time_s: f64,
}

impl FlockLoop {
    /// The loop `active` in plants of these rigs and seeds; its pump stands at `input`.
    pub fn new(
        active: &ActiveLoop,
        rigs: &[(Arc<Network>, u64)],
        input: f64,
        measurement: Measurement,
    ) -> Self {
        let network = &rigs[0].0;
        let (spec, sensor) = (&network.spec, &network.sensors[active.sensor]);
        let converters = spec.converters.as_ref();
        Self {
            tag: active.spec.id.clone(),
            tank: sensor.tank,
            pump: active.pump,
            law: *active.control.law(),
            steering: match PlainLoop::of(&active.control) {
                Some(plain) => Steering::Plain(Box::new(plain)),
                None => Steering::Each(vec![active.control.clone(); Pack::PLANTS]),
            },
            transmitter: Transmitter::new(&sensor.spec, converters, spec.sample_time_s),
            noise: rigs.iter().map(|(_, seed)| Noise::of_sensor(active.sensor, *seed)).collect(),
            pv_cm: Pack::of(f64::NAN),
            mv: Pack::of(input),
            pieces: [0; Pack::PLANTS],
            dac_step: converters.filter(|_| measurement.quantisation).map(|c| c.dac_step_v()),
            sample_time_s: spec.sample_time_s,
        }
    }

    /// Setpoint in cm.
    pub fn setpoint_cm(&self) -> f64 {
        match &self.steering {
            Steering::Plain(plain) => plain.setpoint_cm,
            Steering::Each(loops) => loops[0].setpoint_cm,
        }
    }

    /// Measures these levels, controls and writes; gives the flows that the pumps draw from now on, in cm³/s.
    #[inline(always)]
    pub fn sample(&mut self, rigs: &[(Arc<Network>, u64)], mut level_cm: Pack, how: Measurement) -> Pack {
        if how.noise {
            let noise = Pack::each_of(|plant| self.noise[plant].draw());
            level_cm += noise * self.transmitter.noise_cm;
        }
        self.pv_cm = self.transmitter.show(level_cm, how).level_cm;
        let wanted = self.steering.update(self.pv_cm);
        let pump = &rigs[0].0.pumps[self.pump];
        let (written, converted) = convert(pump, self.sample_time_s, self.dac_step, self.mv, wanted);
        self.steering.applied(wanted, written);
        self.mv = written;
        let input = converted.larger(Pack::of(pump.min)).smaller(Pack::of(pump.max));
        Pack::each_of(|plant| {
            rigs[plant].0.pumps[self.pump].flow_near(input.of_plant(plant), &mut self.pieces[plant])
        })
    }

    /// Carries out a command for this loop in every plant; none when it is refused. The sensor's tank has its rim at
    /// `rim_cm`.
    pub fn apply(&mut self, command: &RigCommand, rim_cm: f64) -> Option<()> {
        match command {
            RigCommand::Setpoint { level_cm, .. } if (0.0..=rim_cm).contains(level_cm) => {
                self.steering.change(|l| l.setpoint_cm = *level_cm, |l| l.setpoint_cm = *level_cm);
            }
            RigCommand::Tuning { tuning, .. } if tuning.validated(&self.law).is_ok() => {
                self.steering.change(|l| l.set_tuning(*tuning), |l| l.set_tuning(*tuning));
            }
            RigCommand::PvFilter { time_constant_s, .. } => {
                let filter_s = check_filter(*time_constant_s).ok()?;
                self.steering.change(|l| l.set_pv_filter(filter_s), |l| l.set_pv_filter(filter_s));
            }
            _ => return None,
        }
        Some(())
    }
}

impl Steering {
    /// One sample; gives the outputs.
    #[inline(always)]
    fn update(&mut self, pv_cm: Pack) -> Pack {
        match self {
            Self::Plain(plain) => plain.update(pv_cm),
            Self::Each(loops) => Pack::each_of(|plant| {
                let control = &mut loops[plant];
                let actual = control.mode;
                let pv_cm = pv_cm.of_plant(plant);
                control.update(&LoopInput { pv_cm, disturbance: f64::NAN, actual, blocked: None }).mv
            }),
        }
    }

    /// Learns what the pumps took of what was wanted.
    #[inline(always)]
    fn applied(&mut self, wanted: Pack, written: Pack) {
        match self {
            Self::Plain(plain) => plain.mv = written,
            Self::Each(loops) => {
                for (plant, control) in loops.iter_mut().enumerate() {
                    if written.of_plant(plant) != wanted.of_plant(plant) {
                        control.applied(written.of_plant(plant));
                    }
                }
            }
        }
    }

    fn change(&mut self, plain: impl Fn(&mut PlainLoop<Pack>), each: impl Fn(&mut ControlLoop)) {
        match self {
            Self::Plain(of_all) => plain(of_all),
            Self::Each(loops) => loops.iter_mut().for_each(each),
        }
    }
}
