//! The running loop on its own worker thread: commands in, snapshots, samples and events out.
//!
//! A [`Session`] never blocks its caller: commands go into a bounded queue, the snapshot is swapped, samples
//! and events are fetched when it suits. Samples wait for a slow reader and are given up only beyond half a
//! million, which is an event.

mod alarms;
mod command;
mod event;
mod exact;
mod recorded;
mod replay;
mod sink;
mod snapshot;
mod worker;

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};

pub use command::{CommandError, RigCommand};
pub use event::{Alarm, Event, EventKind};
pub use recorded::{RecordedModel, RecordedRun};
pub use sink::{RunStart, Sink};
pub use snapshot::{LoopNow, PumpNow, Snapshot, TankNow, ValveNow};

use crate::plant::{Measurement, Network};
use crate::signal::SampleBlock;
use crate::sim::{ClosedLoop, ScenarioEvent};
use replay::Player;
use worker::Worker;

/// Longest wait for the worker to end, when its session is dropped.
const LONGEST_FAREWELL: Duration = Duration::from_secs(2);

/// Called from the worker's thread whenever there is something new to fetch.
pub type Notify = Box<dyn Fn() + Send>;

/// A simulated rig to run.
#[derive(Debug, Clone)]
pub struct Rig {
    /// Its structure.
    pub network: Arc<Network>,
    /// Index of the configuration to start in.
    pub configuration: usize,
    /// Imperfections.
    pub measurement: Measurement,
    /// Seed of the noise.
    pub seed: u64,
}

/// What a session can be told.
pub enum SessionCommand {
    /// Something of the rig or its loops.
    Rig(RigCommand),
    /// Let time go on.
    Run,
    /// Let time stand still.
    Pause,
    /// Take one sample and stand still.
    Step,
    /// Times real time, 1 to 1000.
    Speed(f64),
    /// Go to a time of the recording that is played, in seconds of its run.
    Seek(f64),
    /// Carry commands out at their times in seconds of the run, and stand still at an end: each before the first sample
    /// at or after its time, as a scenario has them.
    Plan {
        /// Commands, in any order; they take the place of those of a plan before.
        events: Vec<ScenarioEvent>,
        /// Time of the last sample in seconds; `None` to go on.
        end_s: Option<f64>,
    },
    /// Start a new run on a rig.
    Load(Box<Rig>),
    /// Send everything from now on to a sink as well.
    Attach {
        /// Name for [`SessionCommand::Detach`].
        id: u64,
        /// The sink.
        sink: Box<dyn Sink>,
    },
    /// Let go of a sink.
    Detach {
        /// Its name.
        id: u64,
    },
    /// End the worker.
    Shutdown,
}

/// What a worker shares with its handle.
struct Ports {
    commands: Receiver<SessionCommand>,
    blocks: Sender<SampleBlock>,
    events: Sender<Event>,
    latest: Arc<Mutex<Arc<Snapshot>>>,
    notify: Notify,
}

/// A running session; dropping it ends the worker.
pub struct Session {
    commands: Sender<SessionCommand>,
    blocks: Receiver<SampleBlock>,
    events: Receiver<Event>,
    latest: Arc<Mutex<Arc<Snapshot>>>,
    worker: Option<JoinHandle<()>>,
}

impl Session {
    /// Starts a worker on a rig, paused at time 0.
    ///
    /// # Errors
    /// [`CommandError`] when the rig cannot start in that configuration.
    ///
    /// # Panics
    /// When the system cannot start a thread.
    pub fn start(rig: &Rig, notify: Notify) -> Result<Self, CommandError> {
        ClosedLoop::simulated(rig.network.clone(), rig.configuration, rig.measurement, rig.seed)
            .map(|closed| Self::of(closed, notify))
    }

    /// Starts a worker on loops as they stand, paused.
    ///
    /// # Panics
    /// When the system cannot start a thread.
    #[must_use]
    pub fn of(closed: ClosedLoop, notify: Notify) -> Self {
        let (handle, ports) = Self::without_worker(closed.network().clone(), 256, 4096, notify);
        let worker = Worker::new(closed, ports);
        let first = worker.snapshot();
        handle.working("vasos-session", first, move || worker.run())
    }

    /// Plays a recording, paused at its beginning. All its rows and events are delivered at once; snapshots show the
    /// time that is played.
    ///
    /// # Panics
    /// When the system cannot start a thread.
    #[must_use]
    pub fn replay(recorded: Arc<RecordedRun>, notify: Notify) -> Self {
        let (network, most_events) = (recorded.network.clone(), recorded.events.len() + 64);
        let (handle, ports) = Self::without_worker(network, 2, most_events, notify);
        let player = Player::new(recorded, ports);
        let first = player.snapshot();
        handle.working("vasos-replay", first, move || player.run())
    }

    /// A handle, and what its worker is to share with it.
    fn without_worker(
        network: Arc<Network>,
        most_blocks: usize,
        most_events: usize,
        notify: Notify,
    ) -> (Self, Ports) {
        let (commands, command_queue) = bounded(4096);
        let (block_queue, blocks) = bounded(most_blocks);
        let (event_queue, events) = bounded(most_events);
        let latest = Arc::new(Mutex::new(Arc::new(Snapshot::empty(network))));
        let ports = Ports {
            commands: command_queue,
            blocks: block_queue,
            events: event_queue,
            latest: latest.clone(),
            notify,
        };
        (Self { commands, blocks, events, latest, worker: None }, ports)
    }

    /// The handle with its worker begun, on a first snapshot.
    fn working(mut self, name: &str, first: Snapshot, work: impl FnOnce() + Send + 'static) -> Self {
        if let Ok(mut latest) = self.latest.lock() {
            *latest = Arc::new(first);
        }
        let worker = std::thread::Builder::new().name(name.to_owned()).spawn(work);
        self.worker = Some(worker.expect("the system can start a thread"));
        self
    }

    /// Sends a command without waiting; false when the queue is full or the worker gone, and the command
    /// is not carried out.
    #[must_use]
    pub fn send(&self, command: SessionCommand) -> bool {
        self.commands.try_send(command).is_ok()
    }

    /// The present state.
    #[must_use]
    pub fn snapshot(&self) -> Arc<Snapshot> {
        match self.latest.lock() {
            Ok(latest) => latest.clone(),
            Err(poisoned) => poisoned.into_inner().clone(),
        }
    }

    /// Samples since the last call.
    pub fn samples(&self) -> impl Iterator<Item = SampleBlock> + '_ {
        self.blocks.try_iter()
    }

    /// Events since the last call.
    pub fn events(&self) -> impl Iterator<Item = Event> + '_ {
        self.events.try_iter()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let asked = self.commands.send_timeout(SessionCommand::Shutdown, Duration::from_secs(1));
        let (Ok(()), Some(worker)) = (asked, self.worker.take()) else { return };
        let asked_at = Instant::now();
        // A worker that a sink or a long computation holds up is left to end by itself.
        while !worker.is_finished() && asked_at.elapsed() < LONGEST_FAREWELL {
            std::thread::sleep(Duration::from_millis(1));
        }
        if worker.is_finished() {
            drop(worker.join());
        }
    }
}
