//! Which alarms are on, checked after every sample.
//!
//! What noise alone can switch (a signal near the end of its range, an output near its limit) has to last
//! before it counts, and to be gone as long before it is over; spill, dry pump and broken wire count at once.

use super::event::Alarm;
use crate::plant::ReadingStatus;
use crate::sim::ClosedLoop;

/// How long a state that noise can switch has to last, in seconds of the run.
const HOLD_S: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
enum Watch {
    Spill(usize),
    Dry(usize),
    Status(usize, ReadingStatus),
    Limit(usize),
}

impl Watch {
    fn holds(self) -> bool {
        matches!(
            self,
            Self::Limit(_) | Self::Status(_, ReadingStatus::BelowRange | ReadingStatus::AboveRange)
        )
    }
}

#[derive(Debug)]
struct Row {
    watch: Watch,
    alarm: Alarm,
    on: bool,
    /// Samples in a row after which a change counts.
    needed: u64,
    /// Samples in a row that differed from `on`.
    differing: u64,
}

/// Every alarm a configuration can raise, with its state.
#[derive(Debug, Default)]
pub(super) struct AlarmTable {
    rows: Vec<Row>,
}

impl AlarmTable {
    pub fn new(closed: &ClosedLoop) -> Self {
        let spec = &closed.network().spec;
        let held = (HOLD_S / closed.sample_time_s() - 1e-9).ceil().max(1.0) as u64;
        let mut rows = Vec::new();
        let mut add = |watch: Watch, alarm| {
            let needed = if watch.holds() { held } else { 1 };
            rows.push(Row { watch, alarm, on: false, needed, differing: 0 });
        };
        for (i, tank) in spec.tanks.iter().enumerate() {
            add(Watch::Spill(i), Alarm::Overflow { tag: tank.id.clone() });
        }
        for (i, pump) in spec.pumps.iter().enumerate() {
            add(Watch::Dry(i), Alarm::PumpDry { tag: pump.id.clone() });
        }
        for (i, active) in closed.loops().iter().enumerate() {
            let tag = || active.spec.sensor.clone();
            let watch = |status| Watch::Status(i, status);
            add(watch(ReadingStatus::BelowRange), Alarm::BelowRange { tag: tag() });
            add(watch(ReadingStatus::AboveRange), Alarm::AboveRange { tag: tag() });
            add(watch(ReadingStatus::Broken), Alarm::SensorFault { tag: tag() });
            add(Watch::Limit(i), Alarm::OutputAtLimit { tag: active.spec.id.clone() });
        }
        Self { rows }
    }

    /// Compares with the state after a sample and says what began or ended.
    pub fn update(&mut self, closed: &ClosedLoop, mut say: impl FnMut(&Alarm, bool)) {
        let plant = closed.source().plant();
        for row in &mut self.rows {
            let now = match row.watch {
                Watch::Spill(i) => plant.is_some_and(|p| p.spill_flows_cm3_s()[i] > 0.0),
                Watch::Dry(i) => plant.is_some_and(|p| p.dry()[i]),
                Watch::Status(i, status) => {
                    closed.loops().get(i).is_some_and(|l| closed.readings()[l.sensor].status == status)
                }
                Watch::Limit(i) => closed
                    .loops()
                    .get(i)
                    .is_some_and(|l| l.control.mode.is_controlling() && l.control.at_limit().is_some()),
            };
            row.differing = if now == row.on { 0 } else { row.differing + 1 };
            if row.differing >= row.needed {
                row.on = now;
                row.differing = 0;
                say(&row.alarm, now);
            }
        }
    }

    pub fn active(&self) -> Vec<Alarm> {
        self.rows.iter().filter(|r| r.on).map(|r| r.alarm.clone()).collect()
    }
}
