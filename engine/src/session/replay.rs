//! A recording played: the same handle, commands and snapshots as a running rig, with nothing computed.
//!
//! The reader gets all rows and events at once; what moves is the time that the snapshots stand at. Values come from
//! the recording; laws, gains, modes and faults from carrying the recorded commands out on loops that never step.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::RecvTimeoutError;

use super::command::{CommandError, RigCommand};
use super::event::{Alarm, Event, EventKind};
use super::recorded::RecordedRun;
use super::sink::{RunStart, Sink};
use super::snapshot::{LoopNow, PumpNow, Snapshot, TankNow, ValveNow};
use super::{Ports, SessionCommand};
use crate::control::{ControlOutput, Limits, Mode};
use crate::daq::ReplayedRig;
use crate::plant::{Balance, Fault, Measurement, ReadingStatus};
use crate::signal::ChannelKind;
use crate::sim::{ActiveLoop, ClosedLoop};

/// Between two looks at the clock while the recording plays.
const TICK: Duration = Duration::from_millis(16);

/// Plays a recording.
pub(super) struct Player {
    recorded: Arc<RecordedRun>,
    followed: Followed,
    /// Time that is shown, in seconds of the run.
    time_s: f64,
    running: bool,
    speed: f64,
    sinks: Vec<(u64, Box<dyn Sink>)>,
    ports: Ports,
}

impl Player {
    pub fn new(recorded: Arc<RecordedRun>, ports: Ports) -> Self {
        let [start_s, _] = recorded.span_s();
        let mut player = Self {
            followed: Followed::new(&recorded),
            time_s: start_s,
            running: false,
            speed: 1.0,
            sinks: vec![],
            recorded,
            ports,
        };
        player.followed.follow(&player.recorded, start_s);
        player
    }

    /// Plays until told to shut down or until its handle is gone.
    pub fn run(mut self) {
        if !self.recorded.is_empty() {
            drop(self.ports.blocks.send(self.recorded.rows.clone()));
        }
        for event in &self.recorded.events {
            // A handle that does not fetch has its snapshots all the same.
            drop(self.ports.events.try_send(event.clone()));
        }
        self.publish();
        let mut last = Instant::now();
        loop {
            let received = if self.running {
                self.ports.commands.recv_timeout(TICK)
            } else {
                self.ports.commands.recv().map_err(|_| RecvTimeoutError::Disconnected)
            };
            match received {
                Ok(command) => {
                    if !self.obey(command) || !self.obey_waiting() {
                        return;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let now = Instant::now();
            let elapsed = (now - last).as_secs_f64().min(0.25);
            last = now;
            if self.running {
                self.play(elapsed * self.speed);
            }
            self.publish();
        }
    }

    /// Of the commands that wait, a drag of the time leaves only its last.
    fn obey_waiting(&mut self) -> bool {
        while let Ok(command) = self.ports.commands.try_recv() {
            if !self.obey(command) {
                return false;
            }
        }
        true
    }

    fn obey(&mut self, command: SessionCommand) -> bool {
        let [start_s, end_s] = self.recorded.span_s();
        match command {
            SessionCommand::Run => {
                if self.time_s >= end_s {
                    self.seek(start_s);
                }
                self.running = true;
            }
            SessionCommand::Pause => self.running = false,
            SessionCommand::Step => {
                self.running = false;
                let next = self.recorded.rows.time_s.partition_point(|&t| t <= self.time_s);
                if let Some(&time_s) = self.recorded.rows.time_s.get(next) {
                    self.seek(time_s);
                }
            }
            SessionCommand::Speed(speed) if (1.0..=1000.0).contains(&speed) => self.speed = speed,
            SessionCommand::Speed(speed) => self.refuse(CommandError::Speed { speed }),
            SessionCommand::Seek(time_s) => self.seek(time_s.clamp(start_s, end_s)),
            SessionCommand::Rig(_) | SessionCommand::Load(_) | SessionCommand::Plan { .. } => {
                self.refuse(CommandError::Replay)
            }
            SessionCommand::Attach { id, mut sink } => {
                // A recorder of a recording gets all of it.
                sink.started(&RunStart::of(&fresh(&self.recorded), self.recorded.rows.run));
                sink.samples(&self.recorded.rows);
                self.recorded.events.iter().for_each(|event| sink.event(event));
                self.sinks.push((id, sink));
            }
            SessionCommand::Detach { id } => self.sinks.retain(|(other, _)| *other != id),
            SessionCommand::Shutdown => return false,
        }
        true
    }

    fn refuse(&self, error: CommandError) {
        let event =
            Event { run: self.recorded.rows.run, time_s: self.time_s, kind: EventKind::Refused(error) };
        drop(self.ports.events.try_send(event));
    }

    fn play(&mut self, span_s: f64) {
        let [_, end_s] = self.recorded.span_s();
        let to_s = self.time_s + span_s;
        self.seek(to_s.min(end_s));
        if to_s >= end_s {
            self.running = false;
        }
    }

    /// Goes to a time, which may lie before the present one.
    fn seek(&mut self, time_s: f64) {
        if !time_s.is_finite() {
            return;
        }
        if time_s < self.time_s {
            self.followed = Followed::new(&self.recorded);
        }
        self.time_s = time_s;
        self.followed.follow(&self.recorded, time_s);
    }

    fn publish(&self) {
        let snapshot = Arc::new(self.snapshot());
        if let Ok(mut latest) = self.ports.latest.lock() {
            *latest = snapshot;
        }
        (self.ports.notify)();
    }

    pub fn snapshot(&self) -> Snapshot {
        let recorded = &self.recorded;
        let row = recorded.row_at(self.time_s);
        let value = |kind: ChannelKind| {
            let column = recorded.channels().column(kind);
            row.zip(column).map_or(f64::NAN, |(row, column)| recorded.rows.row(row)[column])
        };
        let (network, loops) = (recorded.network.clone(), &self.followed.loops);
        let tank = |i| TankNow {
            level_cm: value(ChannelKind::Level(i)),
            spill_cm3_s: value(ChannelKind::Spill(i)),
            leak_cm3_s: self.leak_cm3_s(i, value(ChannelKind::Level(i))),
        };
        let pump = |i| {
            let arriving_cm3_s = value(ChannelKind::Arriving(i));
            // What is drawn is not recorded; it differs from what arrives by the pipe's delay.
            let input = value(ChannelKind::Input(i));
            PumpNow { input, pumped_cm3_s: arriving_cm3_s, arriving_cm3_s, dry: self.is_dry(i) }
        };
        let valve = |i| ValveNow {
            angle_deg: value(ChannelKind::Angle(i)),
            flow_cm3_s: value(ChannelKind::ValveFlow(i)),
        };
        let numbers =
            |slot| [ChannelKind::Setpoint(slot), ChannelKind::Pv(slot), ChannelKind::Mv(slot)].map(value);
        Snapshot {
            run: recorded.rows.run,
            time_s: self.time_s,
            samples: row.map_or(0, |row| row as u64 + 1),
            running: self.running,
            speed: self.speed,
            achieved_speed: f64::NAN,
            configuration: loops.configuration(),
            measurement: loops.measurement().unwrap_or(Measurement::IDEAL),
            tanks: (0..network.tanks.len()).map(tank).collect(),
            pumps: (0..network.pumps.len()).map(pump).collect(),
            valves: (0..network.valves.len()).map(valve).collect(),
            loops: loops
                .loops()
                .iter()
                .enumerate()
                .map(|(slot, l)| loop_now(l, numbers(slot), self.status(l.sensor)))
                .collect(),
            balance: Balance::default(),
            balance_error_cm3: 0.0,
            alarms: self.followed.alarms.clone(),
            faults: loops.source().faults().to_vec(),
            excitation: None,
            span_s: Some(recorded.span_s()),
            network,
        }
    }

    /// What the alarms say of a sensor.
    fn status(&self, sensor: usize) -> ReadingStatus {
        let tag = &self.recorded.network.spec.sensors[sensor].id;
        let of = |alarm: &&Alarm| alarm.tag() == tag;
        match self.followed.alarms.iter().find(of) {
            Some(Alarm::SensorFault { .. }) => ReadingStatus::Broken,
            Some(Alarm::BelowRange { .. }) => ReadingStatus::BelowRange,
            Some(Alarm::AboveRange { .. }) => ReadingStatus::AboveRange,
            _ => ReadingStatus::Good,
        }
    }

    /// k √h of the leaks that are open.
    fn leak_cm3_s(&self, tank: usize, level_cm: f64) -> f64 {
        let tag = &self.recorded.network.spec.tanks[tank].id;
        let leaks = self.followed.loops.source().faults().iter().filter(|f| f.tag == *tag);
        let of = |fault: &Fault| match fault {
            Fault::Leak { k_cm2_5_s } => k_cm2_5_s * level_cm.max(0.0).sqrt(),
            _ => 0.0,
        };
        leaks.map(|f| of(&f.fault)).sum()
    }

    fn is_dry(&self, pump: usize) -> bool {
        let tag = &self.recorded.network.spec.pumps[pump].id;
        self.followed.alarms.iter().any(|alarm| matches!(alarm, Alarm::PumpDry { .. }) && alarm.tag() == tag)
    }
}

/// What the events of a recording have come to at a time.
struct Followed {
    /// Loops as the commands up to `next_event` have set them.
    loops: ClosedLoop,
    next_event: usize,
    /// Alarms that are on.
    alarms: Vec<Alarm>,
    /// Loops whose output a test moves.
    tested: Vec<String>,
}

impl Followed {
    fn new(recorded: &RecordedRun) -> Self {
        Self { loops: fresh(recorded), next_event: 0, alarms: vec![], tested: vec![] }
    }

    /// Carries out what happened up to a time in seconds.
    fn follow(&mut self, recorded: &RecordedRun, time_s: f64) {
        while let Some(event) = recorded.events.get(self.next_event).filter(|e| e.time_s <= time_s) {
            self.next_event += 1;
            match &event.kind {
                // Tests move a loop over its settings and leave them as they were.
                EventKind::Done(RigCommand::Excite { tag, excitation })
                    if !excitation.signal.keeps_loop() =>
                {
                    self.tested.push(tag.clone());
                }
                EventKind::Recorded { test_over: Some(tag), .. } => self.tested.retain(|t| t != tag),
                EventKind::Done(RigCommand::SteadyAt { tag, level_cm }) => {
                    let setpoint = RigCommand::Setpoint { tag: tag.clone(), level_cm: *level_cm };
                    drop(self.loops.apply(&setpoint));
                }
                EventKind::Done(command) if !moves_itself(command) => drop(self.loops.apply(command)),
                EventKind::Alarm(alarm, true) if !self.alarms.contains(alarm) => {
                    self.alarms.push(alarm.clone());
                }
                EventKind::Alarm(alarm, false) => self.alarms.retain(|on| on != alarm),
                _ => {}
            }
        }
    }

    /// Mode of a loop; by hand while a test moves its output.
    fn mode(&self, slot: usize) -> Option<Mode> {
        let l = self.loops.loops().get(slot)?;
        Some(if self.tested.contains(&l.spec.id) { Mode::Manual } else { l.control.mode })
    }
}

/// The mode of every loop slot at each row: `None` while the slot has no loop.
pub(super) fn modes(recorded: &RecordedRun) -> Vec<Vec<Option<Mode>>> {
    let mut followed = Followed::new(recorded);
    let mut modes = vec![Vec::with_capacity(recorded.len()); recorded.channels().slots];
    for &time_s in &recorded.rows.time_s {
        followed.follow(recorded, time_s);
        for (slot, modes) in modes.iter_mut().enumerate() {
            modes.push(followed.mode(slot));
        }
    }
    modes
}

/// The loops of a recording as they were at its beginning.
fn fresh(recorded: &RecordedRun) -> ClosedLoop {
    let rig = ReplayedRig::new(recorded.network.clone(), recorded.measurement);
    ClosedLoop::new(Box::new(rig), recorded.configuration)
}

/// Commands whose effect is in the values.
fn moves_itself(command: &RigCommand) -> bool {
    use RigCommand as C;
    matches!(command, C::Excite { .. } | C::AbortExcitation { .. } | C::Mv { .. } | C::Bump { .. })
}

fn loop_now(l: &ActiveLoop, [setpoint_cm, pv_cm, mv]: [f64; 3], status: ReadingStatus) -> LoopNow {
    let limits = l.control.limits();
    let mode: Mode = l.control.mode;
    LoopNow {
        tag: l.spec.id.clone(),
        sensor: l.sensor,
        pump: l.pump,
        target: l.target,
        outer: l.outer,
        pv_cm,
        status,
        setpoint_cm,
        working_setpoint_cm: setpoint_cm,
        mv,
        range: Limits { low: l.range.low, high: l.range.high },
        limits,
        at_limit: limits.reached(mv),
        mode,
        actual: mode,
        law: *l.control.law(),
        action: l.control.law().action(&l.control.tuning()),
        tuning: l.control.tuning(),
        tuning_now: l.control.tuning(),
        pv_filter_s: l.control.pv_filter_s(),
        last: ControlOutput::held(mv),
    }
}
