//! The session's one thread: the only place where time passes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TrySendError};

use super::alarms::AlarmTable;
use super::command::CommandError;
use super::event::{Event, EventKind};
use super::sink::{RunStart, Sink};
use super::snapshot::{LoopNow, PumpNow, Snapshot, TankNow, ValveNow};
use super::{Notify, Ports, Rig, SessionCommand};
use crate::control::Limits;
use crate::excitation::{Progress, StopReason};
use crate::plant::{Measurement, Plant};
use crate::signal::SampleBlock;
use crate::sim::{ClosedLoop, ScenarioEvent};

/// Between two looks at the clock while time goes on.
const TICK: Duration = Duration::from_millis(10);
/// Longest computing between two looks at the commands.
const BUDGET: Duration = Duration::from_millis(12);
/// Samples kept for a reader that does not fetch them: an hour and a half at 200 ms and 20 ×.
const MOST_PENDING: usize = 500_000;
/// Seconds of the run between two words on the cycles of a test.
const BETWEEN_CYCLES_S: f64 = 5.0;
/// Events kept likewise.
const MOST_EVENTS: usize = 10_000;

pub(super) struct Worker {
    closed: ClosedLoop,
    run: u64,
    running: bool,
    speed: f64,
    owed_s: f64,
    achieved_speed: f64,
    baseline_cm3: f64,
    alarms: AlarmTable,
    /// Progress of the test as it was last told.
    told: Option<Progress>,
    fresh: SampleBlock,
    pending: SampleBlock,
    pending_events: Vec<Event>,
    lost_events: usize,
    sinks: Vec<(u64, Box<dyn Sink>)>,
    /// Commands to come, in falling order of time.
    planned: Vec<ScenarioEvent>,
    /// Time of the last sample of a plan.
    end_s: Option<f64>,
    commands: Receiver<SessionCommand>,
    blocks: Sender<SampleBlock>,
    events: Sender<Event>,
    latest: Arc<Mutex<Arc<Snapshot>>>,
    notify: Notify,
    changed: bool,
}

impl Worker {
    pub fn new(closed: ClosedLoop, ports: Ports) -> Self {
        let empty =
            SampleBlock { run: 0, channels: closed.channels().clone(), time_s: vec![], values: vec![] };
        let mut worker = Self {
            run: 0,
            running: false,
            speed: 1.0,
            owed_s: 0.0,
            achieved_speed: f64::NAN,
            baseline_cm3: 0.0,
            alarms: AlarmTable::new(&closed),
            told: None,
            fresh: empty.clone(),
            pending: empty,
            pending_events: vec![],
            lost_events: 0,
            sinks: vec![],
            planned: vec![],
            end_s: None,
            commands: ports.commands,
            blocks: ports.blocks,
            events: ports.events,
            latest: ports.latest,
            notify: ports.notify,
            changed: true,
            closed,
        };
        worker.baseline_cm3 = worker.total_cm3();
        worker.say(EventKind::RigLoaded { id: worker.closed.network().spec.id.clone() });
        worker
    }

    /// Runs until told to shut down or until its handle is gone.
    pub fn run(mut self) {
        let mut last = Instant::now();
        let mut measured = (Instant::now(), 0.0);
        loop {
            self.deliver();
            let waiting = self.running || !self.pending.time_s.is_empty() || !self.pending_events.is_empty();
            let received = if waiting {
                self.commands.recv_timeout(if self.owed_s >= self.closed.sample_time_s() {
                    Duration::ZERO
                } else {
                    TICK
                })
            } else {
                self.commands.recv().map_err(|_| RecvTimeoutError::Disconnected)
            };
            match received {
                Ok(command) => {
                    if !self.obey_all(command) {
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
                let before_s = self.closed.time_s();
                self.owed_s += elapsed * self.speed;
                self.catch_up();
                measured.1 += self.closed.time_s() - before_s;
            }
            let window = measured.0.elapsed().as_secs_f64();
            if window >= 1.0 {
                self.achieved_speed = if self.running { measured.1 / window } else { f64::NAN };
                measured = (Instant::now(), 0.0);
            }
        }
    }

    /// Takes the samples that are due, as many as the budget allows; what is left is given up, which
    /// shows as an achieved speed below the wanted one.
    fn catch_up(&mut self) {
        let start = Instant::now();
        let sample_time_s = self.closed.sample_time_s();
        while self.owed_s >= sample_time_s {
            self.owed_s -= sample_time_s;
            if !self.sample() {
                return;
            }
            if start.elapsed() > BUDGET {
                self.owed_s = self.owed_s.min(sample_time_s);
                return;
            }
        }
    }

    /// One sample; false when a defect stopped the run.
    fn sample(&mut self) -> bool {
        let time_s = self.closed.time_s();
        // Sample times are multiples of the sample time, rounded.
        const NEAR_S: f64 = 1e-9;
        if self.end_s.is_some_and(|end_s| time_s > end_s + NEAR_S) {
            self.end_s = None;
            self.set_running(false);
            return false;
        }
        while let Some(event) = self.planned.pop_if(|event| event.at_s <= time_s + NEAR_S) {
            self.obey(SessionCommand::Rig(event.command));
        }
        let outcome = guarded(|| {
            let row = self.closed.step();
            self.fresh.time_s.push(time_s);
            self.fresh.values.extend_from_slice(row);
        });
        self.changed = true;
        if let Err(reason) = outcome {
            self.stop(reason);
            drop(guarded(|| self.closed.stop_excitation(StopReason::Defect)));
            self.tell_excitation();
            return false;
        }
        self.tell_excitation();
        let mut changes = Vec::new();
        self.alarms.update(&self.closed, |alarm, on| changes.push((alarm.clone(), on)));
        for (alarm, on) in changes {
            self.say(EventKind::Alarm(alarm, on));
        }
        true
    }

    /// Says how the test goes on: every phase, cycles at intervals, and its end.
    fn tell_excitation(&mut self) {
        if self.closed.has_ended_excitations() {
            let reports: Vec<_> = self.closed.ended_excitations().collect();
            for report in reports {
                self.say(EventKind::ExcitationEnded(Arc::new(report)));
            }
            self.told = None;
        }
        let Some(progress) = self.closed.excitation_progress() else { return };
        let news = self.told.is_none_or(|told| {
            let later = progress.elapsed_s - told.elapsed_s >= BETWEEN_CYCLES_S;
            progress.phase != told.phase || progress.cycle != told.cycle && later
        });
        if news && let Some(now) = self.closed.excitation() {
            self.told = Some(progress);
            self.say(EventKind::ExcitationProgress { tag: now.tag, progress });
        }
    }

    /// Carries out a command and those that wait behind it, as the budget allows; false at shutdown.
    fn obey_all(&mut self, first: SessionCommand) -> bool {
        let begun = Instant::now();
        let mut next = Some(first);
        while let Some(command) = next {
            if matches!(command, SessionCommand::Shutdown) {
                return false;
            }
            self.changed = true;
            if let Err(reason) = guarded(|| self.obey(command)) {
                self.stop(reason);
            }
            // A flood of commands must not keep time from passing.
            next = if begun.elapsed() < BUDGET { self.commands.try_recv().ok() } else { None };
        }
        true
    }

    fn obey(&mut self, command: SessionCommand) {
        match command {
            SessionCommand::Rig(command) => match self.closed.apply(&command) {
                Ok(()) => {
                    if matches!(command, super::RigCommand::SteadyAt { .. }) {
                        self.baseline_cm3 = self.total_cm3();
                    }
                    if matches!(command, super::RigCommand::Configuration { .. }) {
                        self.alarms = AlarmTable::new(&self.closed);
                    }
                    self.say(EventKind::Done(command));
                    self.tell_excitation();
                }
                Err(error) => self.say(EventKind::Refused(error)),
            },
            SessionCommand::Run => self.set_running(true),
            SessionCommand::Pause => self.set_running(false),
            SessionCommand::Step => {
                self.set_running(false);
                self.sample();
            }
            SessionCommand::Speed(speed) => {
                if (1.0..=1000.0).contains(&speed) {
                    self.speed = speed;
                } else {
                    self.say(EventKind::Refused(CommandError::Speed { speed }));
                }
            }
            SessionCommand::Plan { mut events, end_s } => {
                events.sort_by(|a, b| b.at_s.total_cmp(&a.at_s));
                (self.planned, self.end_s) = (events, end_s);
            }
            SessionCommand::Seek(_) => self.say(EventKind::Refused(CommandError::NoReplay)),
            SessionCommand::Load(rig) => self.load(&rig),
            SessionCommand::Attach { id, mut sink } => {
                // What was sampled before belongs to the others.
                self.hand_to_sinks();
                sink.started(&RunStart::of(&self.closed, self.run));
                self.sinks.push((id, sink));
            }
            SessionCommand::Detach { id } => {
                self.hand_to_sinks();
                self.sinks.retain(|(other, _)| *other != id);
            }
            SessionCommand::Shutdown => {}
        }
    }

    /// Stops the run after a defect of the program.
    fn stop(&mut self, reason: String) {
        self.running = false;
        self.owed_s = 0.0;
        self.achieved_speed = f64::NAN;
        self.say(EventKind::Stopped { reason });
    }

    fn set_running(&mut self, running: bool) {
        if running != self.running {
            self.running = running;
            self.owed_s = 0.0;
            self.achieved_speed = f64::NAN;
            self.say(if running { EventKind::Running } else { EventKind::Paused });
        }
    }

    fn load(&mut self, rig: &Rig) {
        match ClosedLoop::simulated(rig.network.clone(), rig.configuration, rig.measurement, rig.seed) {
            Ok(closed) => {
                self.closed.stop_excitation(StopReason::NewRun);
                self.tell_excitation();
                self.hand_to_sinks();
                self.closed = closed;
                self.run += 1;
                // A plan was for the run before.
                (self.planned, self.end_s) = (vec![], None);
                self.owed_s = 0.0;
                self.baseline_cm3 = self.total_cm3();
                self.alarms = AlarmTable::new(&self.closed);
                let empty = SampleBlock {
                    run: self.run,
                    channels: self.closed.channels().clone(),
                    time_s: vec![],
                    values: vec![],
                };
                self.fresh = empty.clone();
                self.pending = empty;
                let start = RunStart::of(&self.closed, self.run);
                self.tell_sinks(|sink| sink.started(&start));
                self.say(EventKind::RigLoaded { id: rig.network.spec.id.clone() });
            }
            Err(error) => self.say(EventKind::Refused(error)),
        }
    }

    fn say(&mut self, kind: EventKind) {
        let event = Event { run: self.run, time_s: self.closed.time_s(), kind };
        let told = event.clone();
        if self.pending_events.len() < MOST_EVENTS {
            self.pending_events.push(event);
        } else {
            self.lost_events += 1;
        }
        self.changed = true;
        self.tell_sinks(|sink| sink.event(&told));
    }

    /// Calls every sink; one that panics is let go, and the run stops.
    fn tell_sinks(&mut self, mut tell: impl FnMut(&mut dyn Sink)) {
        let mut reasons = Vec::new();
        let mut index = 0;
        while let Some((_, sink)) = self.sinks.get_mut(index) {
            match guarded(|| tell(&mut **sink)) {
                Ok(()) => index += 1,
                Err(reason) => {
                    reasons.push(reason);
                    let (_, broken) = self.sinks.remove(index);
                    reasons.extend(guarded(|| drop(broken)).err());
                }
            }
        }
        for reason in reasons {
            self.stop(reason);
        }
    }

    fn hand_to_sinks(&mut self) {
        if self.fresh.time_s.is_empty() {
            return;
        }
        let channels = self.fresh.channels.clone();
        let empty = SampleBlock { run: self.fresh.run, channels, time_s: vec![], values: vec![] };
        let mut fresh = std::mem::replace(&mut self.fresh, empty);
        self.tell_sinks(|sink| sink.samples(&fresh));
        self.pending.time_s.append(&mut fresh.time_s);
        self.pending.values.append(&mut fresh.values);
        // Its room serves the next samples.
        self.fresh = fresh;
    }

    /// Hands samples to the sinks, offers them and the events to the reader, publishes the snapshot.
    fn deliver(&mut self) {
        self.hand_to_sinks();
        if !self.pending.time_s.is_empty() {
            let empty = SampleBlock {
                run: self.run,
                channels: self.pending.channels.clone(),
                time_s: vec![],
                values: vec![],
            };
            match self.blocks.try_send(std::mem::replace(&mut self.pending, empty)) {
                Ok(()) | Err(TrySendError::Disconnected(_)) => {}
                Err(TrySendError::Full(back)) => self.pending = back,
            }
            let count = self.pending.time_s.len();
            if count > MOST_PENDING {
                self.pending.time_s.clear();
                self.pending.values.clear();
                self.say(EventKind::SamplesLost { count });
            }
        }
        let mut events = std::mem::take(&mut self.pending_events).into_iter();
        for event in events.by_ref() {
            if let Err(TrySendError::Full(event)) = self.events.try_send(event) {
                self.pending_events.push(event);
                break;
            }
        }
        self.pending_events.extend(events);
        if self.lost_events > 0 && self.pending_events.len() < MOST_EVENTS {
            // The sinks had every event: this is for the reader alone.
            let kind = EventKind::EventsLost { count: std::mem::take(&mut self.lost_events) };
            self.pending_events.push(Event { run: self.run, time_s: self.closed.time_s(), kind });
        }
        if self.changed {
            self.changed = false;
            let snapshot = Arc::new(self.snapshot());
            if let Ok(mut latest) = self.latest.lock() {
                *latest = snapshot;
            }
            // The listener's defects are its own.
            drop(guarded(|| (self.notify)()));
        }
    }

    fn total_cm3(&self) -> f64 {
        self.closed.source().plant().map_or(0.0, |p| p.balance().total_cm3())
    }

    pub fn snapshot(&self) -> Snapshot {
        let closed = &self.closed;
        let plant = closed.source().plant();
        let (tanks, pumps, valves) = plant.map_or((vec![], vec![], vec![]), parts);
        Snapshot {
            run: self.run,
            time_s: closed.time_s(),
            samples: (closed.time_s() / closed.sample_time_s()).round() as u64,
            running: self.running,
            speed: self.speed,
            achieved_speed: self.achieved_speed,
            network: closed.network().clone(),
            configuration: closed.configuration(),
            measurement: closed.measurement().unwrap_or(Measurement::IDEAL),
            tanks,
            pumps,
            valves,
            loops: closed.loops().iter().map(|l| loop_now(l, closed)).collect(),
            balance: plant.map(Plant::balance).unwrap_or_default(),
            balance_error_cm3: self.total_cm3() - self.baseline_cm3,
            alarms: self.alarms.active(),
            faults: closed.source().faults().to_vec(),
            excitation: closed.excitation(),
            span_s: None,
        }
    }
}

/// Runs something whose panic must not end the worker; gives what the panic says.
fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let said = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
        said.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
    })
}

fn loop_now(l: &crate::sim::ActiveLoop, closed: &ClosedLoop) -> LoopNow {
    let reading = closed.readings()[l.sensor];
    LoopNow {
        tag: l.spec.id.clone(),
        sensor: l.sensor,
        pump: l.pump,
        target: l.target,
        outer: l.outer,
        pv_cm: reading.level_cm,
        status: reading.status,
        setpoint_cm: l.control.setpoint_cm,
        working_setpoint_cm: l.control.working_setpoint_cm(),
        mv: l.control.mv(),
        range: Limits { low: l.range.low, high: l.range.high },
        limits: l.control.limits(),
        at_limit: l.control.at_limit(),
        mode: l.control.mode,
        actual: l.control.actual_mode(),
        law: *l.control.law(),
        action: l.control.law().action(&l.control.tuning()),
        tuning: l.control.tuning(),
        tuning_now: l.control.scheduled_tuning(),
        pv_filter_s: l.control.pv_filter_s(),
        last: *l.control.last(),
    }
}

fn parts(plant: &Plant) -> (Vec<TankNow>, Vec<PumpNow>, Vec<ValveNow>) {
    let tanks = (0..plant.levels_cm().len())
        .map(|i| TankNow {
            level_cm: plant.levels_cm()[i],
            spill_cm3_s: plant.spill_flows_cm3_s()[i],
            leak_cm3_s: plant.leak_flows_cm3_s()[i],
        })
        .collect();
    let pumps = (0..plant.inputs().len())
        .map(|i| PumpNow {
            input: plant.inputs()[i],
            pumped_cm3_s: plant.pumped_flows_cm3_s()[i],
            arriving_cm3_s: plant.arriving_flows_cm3_s()[i],
            dry: plant.dry()[i],
        })
        .collect();
    let valves = plant.angles_deg().iter().zip(plant.valve_flows_cm3_s());
    let valves = valves.map(|(&angle_deg, &flow_cm3_s)| ValveNow { angle_deg, flow_cm3_s }).collect();
    (tanks, pumps, valves)
}
