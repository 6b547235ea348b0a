//! The simulated rig: the plant behind its sensors and converters.

use std::sync::Arc;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::plant::spec::ConverterSpec;

use super::noise::Noise;
use super::source::{RigControls, Source};
use crate::plant::{
    ActiveFault, Fault, FaultKind, FaultyPart, Measurement, Network, Number, Plant, Pump, Reading, RigError,
    Sensor, Transmitter, check_fault, nearest,
};

/// A plant with its transmitters, converters and a seeded source of noise.
#[derive(Debug, Clone)]
pub struct SimulatedRig {
    plant: Plant,
    probes: Vec<Probe>,
    measurement: Measurement,
    dac_step: Option<f64>,
    written: Vec<f64>,
    mishaps: Xoshiro256PlusPlus,
    faults: Vec<ActiveFault>,
    powered: bool,
}

/// A sensor in its tank, with its source of noise.
#[derive(Debug, Clone)]
struct Probe {
    tank: usize,
    transmitter: Transmitter,
    noise: Noise,
}

/// Tells the source of spikes from those of noise.
const MISHAPS: u64 = 0x005b_1ce5;

impl SimulatedRig {
    /// A rig at the state of its file.
    ///
    /// # Errors
    /// [`RigError`] when the water does not fit.
    pub fn new(network: Arc<Network>, measurement: Measurement, seed: u64) -> Result<Self, RigError> {
        let converters = network.spec.converters.as_ref();
        let probe = |(index, sensor): (usize, &Sensor)| Probe {
            tank: sensor.tank,
            transmitter: Transmitter::new(&sensor.spec, converters, network.spec.sample_time_s),
            noise: Noise::of_sensor(index, seed),
        };
        let probes = network.sensors.iter().enumerate().map(probe).collect();
        let dac_step = converters.map(ConverterSpec::dac_step_v);
        let plant = Plant::new(network)?;
        Ok(Self {
            written: plant.inputs().to_vec(),
            plant,
            probes,
            measurement,
            dac_step,
            mishaps: Xoshiro256PlusPlus::seed_from_u64(seed ^ MISHAPS),
            faults: vec![],
            powered: true,
        })
    }

    fn switch(&mut self, part: FaultyPart, fault: Fault, on: bool) {
        match (part, fault) {
            (FaultyPart::Sensor(i), _) => self.probes[i].transmitter.set_fault(fault, on),
            (FaultyPart::Valve(i), Fault::Clogged { share }) => {
                self.plant.set_clogged(i, if on { share } else { 1.0 });
            }
            (FaultyPart::Tank(i), Fault::Leak { k_cm2_5_s }) => {
                self.plant.set_leak(i, if on { k_cm2_5_s } else { 0.0 });
            }
            (FaultyPart::Pump(i), _) => self.plant.set_pump_fault(i, fault, on),
            (FaultyPart::Rig, _) => {
                self.powered = !on;
                self.plant.set_blackout(on);
            }
            _ => {}
        }
    }
}

/// An output, a number, within its rate and range, and as the converter of that step gives it to the pump.
#[inline(always)]
pub(crate) fn convert<V: Number>(
    pump: &Pump,
    sample_time_s: f64,
    step: Option<f64>,
    last: V,
    mv: V,
) -> (V, V) {
    let most = V::of(pump.rate_limit_per_s * sample_time_s);
    let slow = mv.larger(last - most).smaller(last + most);
    let limited = slow.larger(V::of(pump.min)).smaller(V::of(pump.max));
    (limited, step.map_or(limited, |step| nearest(limited * (1.0 / step)) * step))
}

impl Source for SimulatedRig {
    fn network(&self) -> &Arc<Network> {
        self.plant.network()
    }

    fn read(&mut self, readings: &mut [Reading]) {
        let (levels_cm, how, powered) = (self.plant.levels_cm(), self.measurement, self.powered);
        for (reading, Probe { tank, transmitter, noise }) in readings.iter_mut().zip(&mut self.probes) {
            let level_cm = levels_cm[*tank];
            *reading = transmitter.measure_with(level_cm, noise.draw(), how, powered, &mut self.mishaps);
        }
    }

    fn write(&mut self, pump: usize, mv: f64) -> Result<f64, RigError> {
        let network = self.plant.network();
        let (of, sample_time_s) = (&network.pumps[pump], network.spec.sample_time_s);
        let step = self.dac_step.filter(|_| self.measurement.quantisation);
        // What is no number, the plant refuses.
        let (limited, converted) =
            if mv.is_finite() { convert(of, sample_time_s, step, self.written[pump], mv) } else { (mv, mv) };
        self.plant.set_input(pump, converted)?;
        self.written[pump] = limited;
        Ok(limited)
    }

    fn advance(&mut self, duration_s: f64) {
        self.plant.advance(duration_s);
    }

    fn accelerates(&self) -> bool {
        true
    }

    fn rig(&mut self) -> Option<&mut dyn RigControls> {
        Some(self)
    }

    fn measurement(&self) -> Option<Measurement> {
        Some(self.measurement)
    }

    fn faults(&self) -> &[ActiveFault] {
        &self.faults
    }

    fn plant(&self) -> Option<&Plant> {
        Some(&self.plant)
    }
}

impl RigControls for SimulatedRig {
    fn set_angle(&mut self, valve: usize, angle_deg: f64) -> Result<(), RigError> {
        self.plant.set_angle(valve, angle_deg)
    }

    fn bump(&mut self, tank: usize, delta_cm: f64) -> Result<f64, RigError> {
        self.plant.bump(tank, delta_cm)
    }

    fn configure(&mut self, configuration: usize) -> Result<(), RigError> {
        let network = self.plant.network().clone();
        let Some(spec) = network.spec.configurations.get(configuration) else { return Ok(()) };
        for (id, &angle_deg) in &spec.angles_deg {
            if let Some(valve) = network.valve(id) {
                self.plant.set_angle(valve, angle_deg)?;
            }
        }
        for (id, &delay_s) in &spec.delays_s {
            if let Some(pump) = network.pump(id) {
                self.plant.set_delay(pump, delay_s);
            }
        }
        Ok(())
    }

    fn set_state(&mut self, levels_cm: &[f64], inputs: &[f64]) -> Result<(), RigError> {
        self.plant.set_state(levels_cm, inputs)?;
        self.written.copy_from_slice(inputs);
        Ok(())
    }

    fn set_measurement(&mut self, measurement: Measurement) {
        self.measurement = measurement;
    }

    fn set_seed(&mut self, seed: u64) {
        for (sensor, probe) in self.probes.iter_mut().enumerate() {
            probe.noise = Noise::of_sensor(sensor, seed);
        }
        self.mishaps = Xoshiro256PlusPlus::seed_from_u64(seed ^ MISHAPS);
    }

    fn set_fault(&mut self, tag: &str, fault: Fault) -> Result<(), RigError> {
        let part = check_fault(self.plant.network(), tag, fault)?;
        self.faults.retain(|f| f.tag != tag || f.fault.kind() != fault.kind());
        self.faults.push(ActiveFault { tag: tag.to_owned(), fault });
        self.switch(part, fault, true);
        Ok(())
    }

    fn repair(&mut self, tag: &str, kind: Option<FaultKind>) -> Result<(), RigError> {
        let of_tag = |f: &ActiveFault| f.tag == tag && kind.is_none_or(|kind| f.fault.kind() == kind);
        let (over, left): (Vec<_>, Vec<_>) = self.faults.drain(..).partition(of_tag);
        self.faults = left;
        if over.is_empty() {
            return Err(RigError::Sound { tag: tag.to_owned() });
        }
        if let Some(part) = FaultyPart::find(self.plant.network(), tag) {
            for fault in over {
                self.switch(part, fault.fault, false);
            }
        }
        Ok(())
    }
}
