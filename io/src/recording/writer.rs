//! The recorder's thread: rows are gathered for about a second and logged as columns.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crossbeam_channel::{Receiver, RecvTimeoutError};
use rerun::{
    Boxes2D, ComponentDescriptor, ComponentIdentifier, RecordingStream, RecordingStreamBuilder, Scalars,
    TextLog, TimeColumn,
};
use vasos_engine::session::{Event, EventKind, RunStart};
use vasos_engine::signal::{ChannelKind, ChannelSet, SampleBlock};

use super::layout::{EVENTS, Group, RIG, SIGNALS, TIME, TOLD, WALL_CLOCK, groups};
use super::notes::{self, Note};
use super::opening::blueprint_messages;
use super::output::{Keep, Output};
use super::run_sink::Message;
use super::seal::{self, CHECKS, Sealing};
use super::status::Status;
use super::tanks::{Tanks, WaterBox};
use super::told::{self, told};
use super::trouble::RecordingTrouble;
use super::words;

/// Wall time between two batches.
const BATCH: Duration = Duration::from_millis(950);
/// Rows that make a batch before its time.
const MOST_ROWS: usize = 2_000;
/// Frames of the drawing in a batch.
const MOST_FRAMES: usize = 5;
/// Batches at real time of which the frames go together.
const STILL_BATCHES: usize = 10;
/// How long a closing recorder waits for its sink to be let go.
const LAST_ROWS: Duration = Duration::from_secs(1);

type LogResult = Result<(), Box<dyn std::error::Error>>;

/// What one run needs.
struct Run {
    /// Number in the session.
    number: u64,
    stream: RecordingStream,
    channels: Arc<ChannelSet>,
    groups: Vec<Group>,
    levels: Vec<usize>,
    tanks: Tanks,
    /// Batches since the drawing was logged, and its frames since then: time, wall clock, parts.
    still: usize,
    water: Vec<(f64, i64, Vec<WaterBox>)>,
    sealing: Sealing,
}

pub(super) struct Writer {
    queue: Receiver<Message>,
    output: Output,
    status: Arc<Status>,
    name: String,
    run: Option<Run>,
    time_s: Vec<f64>,
    wall_ns: Vec<i64>,
    values: Vec<f64>,
    events: Vec<(Event, i64)>,
    notes: Vec<Note>,
    /// Time of the last row or event in seconds.
    now_s: f64,
    part_bytes: Option<u64>,
    /// Messages that the file had not taken when it was last looked at.
    unwritten: u64,
}

impl Writer {
    pub fn new(
        queue: Receiver<Message>,
        output: Output,
        status: Arc<Status>,
        name: String,
        part_bytes: Option<u64>,
    ) -> Self {
        let (time_s, wall_ns, values) = (vec![], vec![], vec![]);
        let (run, events, notes, now_s, unwritten) = (None, vec![], vec![], 0.0, 0);
        Self {
            queue,
            output,
            status,
            name,
            run,
            time_s,
            wall_ns,
            values,
            events,
            notes,
            now_s,
            part_bytes,
            unwritten,
        }
    }

    /// Records until the sink is gone, or the handle closes.
    pub fn record(mut self) {
        let mut due = Instant::now() + BATCH;
        let mut close_by: Option<Instant> = None;
        loop {
            let wait = due.saturating_duration_since(Instant::now()).min(Duration::from_millis(100));
            match self.queue.recv_timeout(wait) {
                Ok(message) => self.take(message),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if Instant::now() >= due || self.time_s.len() >= MOST_ROWS {
                self.flush();
                due = Instant::now() + BATCH;
            }
            if self.status.closing.load(Ordering::Relaxed) {
                let limit = *close_by.get_or_insert_with(|| Instant::now() + LAST_ROWS);
                if Instant::now() >= limit {
                    break;
                }
            }
        }
        self.flush();
        self.seal(true);
        self.run = None;
        self.output.finish();
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Run(start) => {
                self.flush();
                self.seal(true);
                self.output.keep(Keep::Open);
                let begun = self.begin(&start);
                self.output.keep(Keep::Write);
                if let Err(error) = begun {
                    self.report(&*error);
                }
            }
            Message::Rows { block, wall } => self.gather(&block, wall),
            Message::Event { event, wall } => {
                self.now_s = event.time_s;
                self.events.push((event, nanoseconds(wall)));
            }
            Message::Note(note) => self.notes.push(*note),
        }
    }

    fn gather(&mut self, block: &SampleBlock, wall: SystemTime) {
        let known = self.run.as_ref().is_some_and(|run| run.channels == block.channels);
        if !known {
            self.status.lost.fetch_add(block.time_s.len() as u64, Ordering::Relaxed);
            return;
        }
        self.now_s = block.time_s.last().copied().unwrap_or(self.now_s);
        self.time_s.extend_from_slice(&block.time_s);
        self.wall_ns.resize(self.time_s.len(), nanoseconds(wall));
        self.values.extend_from_slice(&block.values);
    }

    /// Opens a recording for a run, in the same file.
    fn begin(&mut self, start: &RunStart) -> LogResult {
        self.run = None;
        let RunStart { run: number, network, channels, .. } = start;
        let id = &network.spec.id;
        let stream = RecordingStreamBuilder::new("vasos")
            .enabled(true)
            .recording_name(format!("{} · {id} · run {}", self.name, number + 1))
            .buffered()?;
        stream.set_sink(Box::new(self.output.clone()));
        let groups = groups(channels, network);
        for message in blueprint_messages(&groups)? {
            stream.record_msg(message);
        }
        let tanks = Tanks::new(network);
        stream.log_static(format!("{RIG}/walls"), &tanks.walls(network))?;
        stream.log_static(format!("{RIG}/pipes"), &tanks.pipes(network))?;
        stream.log_static(format!("{RIG}/water"), &Tanks::water_style())?;
        stream.send_property(told::PROPERTY, &told::property(start)?)?;
        let column = |tank| channels.column(ChannelKind::Level(tank));
        let levels = (0..network.tanks.len()).filter_map(column).collect();
        stream.flush_with_timeout(BATCH)?;
        let (channels, sealing) = (channels.clone(), Sealing::new());
        let number = *number;
        self.run =
            Some(Run { number, stream, channels, groups, levels, tanks, still: 0, water: vec![], sealing });
        Ok(())
    }

    /// Logs what has been gathered.
    fn flush(&mut self) {
        if let Some(run) = &mut self.run {
            let rows = Rows { time_s: &self.time_s, wall_ns: &self.wall_ns, values: &self.values };
            let logged = run.log_rows(&rows).and_then(|()| run.log_notes(&self.notes, self.now_s));
            let flushed = logged.and_then(|()| Ok(run.stream.flush_with_timeout(5 * BATCH)?));
            let of_event = |(event, _): &(Event, i64)| matches!(event.kind, EventKind::Done(_));
            let models = self.notes.iter().any(|note| matches!(note, Note::Model(_)));
            let settings = models || self.events.iter().any(of_event);
            self.output.keep(if settings { Keep::Settings } else { Keep::Write });
            let logged = flushed.and_then(|()| run.log_models(&self.notes, self.now_s));
            let logged = logged.and_then(|()| run.log_events(&self.events));
            let flushed = logged.and_then(|()| Ok(run.stream.flush_with_timeout(5 * BATCH)?));
            self.output.keep(Keep::Write);
            if let Err(error) = flushed {
                self.report(&*error);
            }
            self.events.clear();
            self.notes.clear();
            self.output.check_there();
            self.go_on();
        }
        self.time_s.clear();
        self.wall_ns.clear();
        self.values.clear();
    }

    /// Seals what is due, and goes on in another file when this one is full.
    fn go_on(&mut self) {
        let unwritten = self.status.unwritten.load(Ordering::Relaxed);
        let missing = self.status.missing_before.swap(0, Ordering::Relaxed);
        let Some(run) = &mut self.run else { return };
        if missing > 0 {
            let words = format!("{missing} batches before this are missing: the disk did not take them");
            let kind = EventKind::Recorded { words, test_over: None };
            let event = Event { run: run.number, time_s: self.now_s, kind };
            self.events.push((event, nanoseconds(SystemTime::now())));
        }
        if unwritten != self.unwritten {
            self.unwritten = unwritten;
            run.sealing.restart();
        }
        let full = self.part_bytes.filter(|most| self.output.is_over(*most));
        if full.is_some() || run.sealing.is_due() {
            self.seal(false);
        }
        if full.is_some() {
            self.output.rotate();
        }
    }

    /// Logs the check sum of the rows since the last one; `is_last` where the run ends with them.
    fn seal(&mut self, is_last: bool) {
        let Some(run) = &mut self.run else { return };
        if let Err(error) = run.send_water().and_then(|()| run.log_check(is_last)) {
            self.report(&*error);
        }
    }

    fn report(&self, error: &dyn std::error::Error) {
        self.status.report(RecordingTrouble::Log { reason: error.to_string() });
    }
}

struct Rows<'a> {
    time_s: &'a [f64],
    wall_ns: &'a [i64],
    values: &'a [f64],
}

impl Run {
    fn log_rows(&mut self, rows: &Rows) -> LogResult {
        if rows.time_s.is_empty() {
            return Ok(());
        }
        let width = self.channels.len();
        let count = rows.time_s.len();
        let time_ns: Vec<i64> = rows.time_s.iter().map(|&t| run_nanoseconds(t)).collect();
        for (&time_ns, row) in time_ns.iter().zip(rows.values.chunks(width)) {
            self.sealing.add(time_ns, row);
        }
        let time = TimeColumn::new_duration_nanos(TIME, time_ns);
        let wall = TimeColumn::new_timestamp_nanos_since_epoch(WALL_CLOCK, rows.wall_ns.iter().copied());
        let mut columns = Vec::new();
        for group in &self.groups {
            let scalars = rows.values.chunks(width).flat_map(|row| group.columns.iter().map(|&c| row[c]));
            let lengths = std::iter::repeat_n(group.columns.len(), count);
            for mut column in Scalars::new(scalars).columns(lengths)? {
                column.descriptor = group.descriptor()?;
                columns.push(column);
            }
        }
        self.stream.send_columns(SIGNALS, [time, wall], columns)?;
        self.log_water(rows)
    }

    /// A few frames of the drawing, evenly spaced over the batch, where a level has moved. At real time a frame in two
    /// seconds is smooth enough for water, and a few of them go together: a message of its own costs as much as a batch
    /// of rows.
    fn log_water(&mut self, rows: &Rows) -> LogResult {
        let width = self.channels.len();
        let count = rows.time_s.len();
        let (slow, first) = (count <= 2 * MOST_FRAMES, !self.tanks.is_drawn());
        self.still += 1;
        if slow && !first && !self.still.is_multiple_of(2) {
            return Ok(());
        }
        let frames = if slow { 1 } else { MOST_FRAMES };
        for frame in 0..=frames {
            // The first row of all is drawn as well; of other batches the last of each part.
            let row = (frame * count / frames).saturating_sub(1);
            if frame == 0 && self.tanks.is_drawn() {
                continue;
            }
            let values = &rows.values[row * width..(row + 1) * width];
            let levels: Vec<f32> = self.levels.iter().map(|&c| values[c] as f32).collect();
            if self.tanks.moved(&levels) {
                self.water.push((rows.time_s[row], rows.wall_ns[row], self.tanks.frame(&levels)));
            }
        }
        if slow && !first && self.still < STILL_BATCHES {
            return Ok(());
        }
        self.send_water()
    }

    /// Logs the frames that wait.
    fn send_water(&mut self) -> LogResult {
        self.still = 0;
        let water = std::mem::take(&mut self.water);
        if water.is_empty() {
            return Ok(());
        }
        let times = [
            TimeColumn::new_duration_secs(TIME, water.iter().map(|frame| frame.0)),
            TimeColumn::new_timestamp_nanos_since_epoch(WALL_CLOCK, water.iter().map(|frame| frame.1)),
        ];
        let lengths: Vec<usize> = water.iter().map(|frame| frame.2.len()).collect();
        let parts = || water.iter().flat_map(|frame| &frame.2);
        let boxes = Boxes2D::update_fields()
            .with_centers(parts().map(|part| part.center))
            .with_half_sizes(parts().map(|part| part.half))
            .with_radii(parts().map(|part| part.radius));
        Ok(self.stream.send_columns(format!("{RIG}/water"), times, boxes.columns(lengths)?)?)
    }

    fn log_notes(&self, notes: &[Note], now_s: f64) -> LogResult {
        notes.iter().try_for_each(|note| notes::log(&self.stream, note, now_s))
    }

    fn log_models(&self, notes: &[Note], now_s: f64) -> LogResult {
        notes.iter().try_for_each(|note| match note {
            Note::Model(model) => notes::log_model(&self.stream, model, now_s),
            Note::Nyquist(_) => Ok(()),
        })
    }

    fn log_check(&mut self, is_last: bool) -> LogResult {
        let Some(check) = self.sealing.take(is_last) else { return Ok(()) };
        self.stream.set_time(TIME, rerun::TimeCell::from_duration_nanos(check.to_ns));
        let text = seal::sealed(&toml::to_string(&check)?, &[]);
        let rows = rerun::AnyValues::default().with_component::<rerun::components::Text>(seal::ROWS, [text]);
        self.stream.log(CHECKS, &rows)?;
        self.stream.reset_time();
        Ok(self.stream.flush_with_timeout(5 * BATCH)?)
    }

    fn log_events(&mut self, events: &[(Event, i64)]) -> LogResult {
        if events.is_empty() {
            return Ok(());
        }
        let (levels, texts): (Vec<_>, Vec<_>) = events.iter().map(|(e, _)| words::line(&e.kind)).unzip();
        let times = [
            TimeColumn::new_duration_secs(TIME, events.iter().map(|(e, _)| e.time_s)),
            TimeColumn::new_timestamp_nanos_since_epoch(WALL_CLOCK, events.iter().map(|(_, w)| *w)),
        ];
        let told: Vec<String> = events
            .iter()
            .zip(&texts)
            .map(|((event, _), words)| told(&event.kind, self.sealing.number_event(), words))
            .collect();
        let columns = TextLog::update_fields().with_many_text(texts).with_many_level(levels);
        let mut columns: Vec<_> = columns.columns_of_unit_batches()?.collect();
        for mut column in TextLog::update_fields().with_many_text(told).columns_of_unit_batches()? {
            let component = ComponentIdentifier::try_new(TOLD)?;
            let component_type = column.descriptor.component_type;
            column.descriptor = ComponentDescriptor { archetype: None, component, component_type };
            columns.push(column);
        }
        Ok(self.stream.send_columns(EVENTS, times, columns)?)
    }
}

/// Time of the run in nanoseconds.
fn run_nanoseconds(time_s: f64) -> i64 {
    (1e9 * time_s).round() as i64
}

fn nanoseconds(wall: SystemTime) -> i64 {
    let since = wall.duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}
