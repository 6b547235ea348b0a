//! Which alarms are on, checked after every sample.

use super::event::Alarm;
use crate::control::Mode;
use crate::plant::ReadingStatus;
use crate::sim::ClosedLoop;

#[derive(Debug, Clone, Copy)]
enum Watch {
    Spill(usize),
    Dry(usize),
    Status(usize, ReadingStatus),
    Limit(usize),
}

/// Every alarm a configuration can raise, with its state.
#[derive(Debug, Default)]
pub(super) struct AlarmTable {
    rows: Vec<(Watch, Alarm, bool)>,
}

impl AlarmTable {
    pub fn new(closed: &ClosedLoop) -> Self {
        let spec = &closed.network().spec;
        let mut rows = Vec::new();
        for (i, tank) in spec.tanks.iter().enumerate() {
            rows.push((Watch::Spill(i), Alarm::Overflow { tag: tank.id.clone() }, false));
        }
        for (i, pump) in spec.pumps.iter().enumerate() {
            rows.push((Watch::Dry(i), Alarm::PumpDry { tag: pump.id.clone() }, false));
        }
        for (i, active) in closed.loops().iter().enumerate() {
            let tag = || active.spec.sensor.clone();
            let watch = |status| Watch::Status(i, status);
            rows.push((watch(ReadingStatus::BelowRange), Alarm::BelowRange { tag: tag() }, false));
            rows.push((watch(ReadingStatus::AboveRange), Alarm::AboveRange { tag: tag() }, false));
            rows.push((watch(ReadingStatus::Broken), Alarm::SensorFault { tag: tag() }, false));
            rows.push((Watch::Limit(i), Alarm::OutputAtLimit { tag: active.spec.id.clone() }, false));
        }
        Self { rows }
    }

    /// Compares with the state after a sample and says what began or ended.
    pub fn update(&mut self, closed: &ClosedLoop, mut say: impl FnMut(&Alarm, bool)) {
        let plant = closed.source().plant();
        for (watch, alarm, on) in &mut self.rows {
            let now = match *watch {
                Watch::Spill(i) => plant.is_some_and(|p| p.spill_flows_cm3_s()[i] > 0.0),
                Watch::Dry(i) => plant.is_some_and(|p| p.dry()[i]),
                Watch::Status(i, status) => {
                    closed.loops().get(i).is_some_and(|l| closed.readings()[l.sensor].status == status)
                }
                Watch::Limit(i) => closed.loops().get(i).is_some_and(|l| {
                    let pump = &closed.network().pumps[l.pump];
                    let mv = l.control.mv();
                    l.control.mode == Mode::Automatic && (mv <= pump.min || mv >= pump.max)
                }),
            };
            if now != *on {
                *on = now;
                say(alarm, now);
            }
        }
    }

    pub fn active(&self) -> Vec<Alarm> {
        self.rows.iter().filter(|r| r.2).map(|r| r.1.clone()).collect()
    }
}
