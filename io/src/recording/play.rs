//! Recordings back as runs: rows, events, settings and models, for a replay or an export.
//!
//! The messages of the file are read one after the other, without a store: a file that was cut off gives all that is
//! whole in it.

use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rerun::ComponentIdentifier;
use rerun::external::arrow::array::{Array, Float64Array, ListArray, StringArray};
use rerun::external::re_log_encoding::Decoder;
use rerun::log::{Chunk, ChunkId, LogMsg};
use vasos_engine::plant::{Network, RigSpec};
use vasos_engine::session::{Event, RecordedModel, RecordedRun};
use vasos_engine::signal::{ChannelSet, SampleBlock};

use super::layout::{EVENTS, MODELS, SIGNALS, TIME, TOLD, groups};
use super::notes::MODEL;
use super::told::{self, Beginning, ToldModel, event_kind};
use super::trouble::RecordingError;

/// The files of a recording that goes on in several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts(pub Vec<PathBuf>);

impl Parts {
    /// A file, with those beside it that a recorder would have gone on in: `run.rrd`, `run-2.rrd`, …
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let mut parts = vec![path.to_owned()];
        let stem = path.with_extension("");
        let name = stem.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let beside = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let number = |file: &Path| -> Option<u32> {
            let rest = file.file_name()?.to_str()?.strip_prefix(&name)?.strip_prefix('-')?;
            rest.strip_suffix(".rrd")?.parse().ok()
        };
        let files = std::fs::read_dir(beside).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut more: Vec<(u32, PathBuf)> = files.filter_map(|file| Some((number(&file)?, file))).collect();
        more.sort();
        parts.extend(more.into_iter().map(|(_, file)| file));
        Self(parts)
    }
}

/// Every run of a recording, in the order in which they began; files beside the first that are parts of another
/// recording are left out.
///
/// # Errors
/// [`RecordingError::Read`] for a file that cannot be read, [`RecordingError::Nothing`] for one without a run,
/// [`RecordingError::NoRig`] for a recording of something else.
pub fn read_runs(parts: &Parts) -> Result<Vec<RecordedRun>, RecordingError> {
    let first = parts.0.first().map(|p| p.display().to_string()).unwrap_or_default();
    let mut stores: Vec<Store> = vec![];
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    for (place, path) in parts.0.iter().enumerate() {
        let read = read_messages(path, |id, name, chunk| {
            // A part holds runs of the first file and those that began after it.
            let index = match known.get(id) {
                Some(&index) => index,
                None => {
                    known.insert(id.to_owned(), stores.len());
                    stores.push(Store { part: place, ..Store::default() });
                    stores.len() - 1
                }
            };
            let store = &mut stores[index];
            if let Some(name) = name {
                name.clone_into(&mut store.name);
            }
            if let Some(chunk) = chunk {
                store.take(&chunk, place);
            }
        });
        match read {
            Ok(()) => {}
            Err(reason) if place == 0 => return Err(RecordingError::Read { path: first, reason }),
            // What is beside a recording may be anything.
            Err(_) => {}
        }
    }
    if stores.is_empty() {
        return Err(RecordingError::Nothing { path: first });
    }
    let belongs = belonging(&stores);
    let mut runs = vec![];
    for store in stores.into_iter().zip(belongs).filter(|(_, belongs)| *belongs).map(|(store, _)| store) {
        if let Some(run) = store.run(&first)? {
            runs.push(run);
        }
    }
    if runs.is_empty() { Err(RecordingError::NoRig { path: first }) } else { Ok(runs) }
}

/// Which runs are of the recording that the first file begins: those in it, and those of a later part in which a run
/// that belongs goes on.
fn belonging(stores: &[Store]) -> Vec<bool> {
    let mut parts: HashSet<usize> = HashSet::from([0]);
    loop {
        let before = parts.len();
        for store in stores {
            if store.parts.iter().any(|part| parts.contains(part)) {
                parts.extend(&store.parts);
            }
        }
        if parts.len() == before {
            break;
        }
    }
    stores.iter().map(|store| parts.contains(&store.part)).collect()
}

/// Hands over what each message is of: the id of its recording, its name where it opens, its chunk where it is one.
fn read_messages(path: &Path, mut take: impl FnMut(&str, Option<&str>, Option<Chunk>)) -> Result<(), String> {
    let file = File::open(path).map_err(|error| error.to_string())?;
    let messages =
        Decoder::<LogMsg>::decode_eager(BufReader::new(file)).map_err(|error| error.to_string())?;
    for message in messages {
        // The rest of a file that was cut off.
        let Ok(message) = message else { return Ok(()) };
        let id = message.store_id().clone();
        if !id.is_recording() {
            continue;
        }
        let id = id.recording_id().to_string();
        match &message {
            LogMsg::SetStoreInfo(_) => take(&id, None, None),
            LogMsg::ArrowMsg(_, arrow) => {
                if let Ok(chunk) = Chunk::from_arrow_msg(arrow) {
                    take(&id, None, Some(chunk));
                }
            }
            LogMsg::BlueprintActivationCommand(_) => {}
        }
    }
    Ok(())
}

/// Rows of the signals out of one chunk.
struct Rows {
    time_ns: Vec<i64>,
    /// Component, its number of values a row, its values row by row.
    columns: Vec<(String, usize, Vec<f64>)>,
}

/// What the messages of one run come to.
#[derive(Default)]
struct Store {
    name: String,
    /// First part with this run.
    part: usize,
    parts: HashSet<usize>,
    chunks: HashSet<ChunkId>,
    rig: Option<String>,
    rig_file: Option<String>,
    start: Option<String>,
    number: Option<String>,
    rows: Vec<Rows>,
    /// Time, words, what is told.
    events: Vec<(i64, String, String)>,
    models: Vec<(i64, String)>,
}

impl Store {
    fn take(&mut self, chunk: &Chunk, part: usize) {
        self.parts.insert(part);
        // What opens a part stands in the one before as well.
        if !self.chunks.insert(chunk.id()) {
            return;
        }
        let entity = chunk.entity_path().to_string();
        let times = || chunk.timelines().values().find(|t| t.name() == TIME).map(|t| t.times_raw().to_vec());
        match entity.trim_start_matches('/') {
            SIGNALS => self.rows.extend(times().map(|time_ns| rows_of(chunk, time_ns))),
            EVENTS => {
                let Some(time_ns) = times() else { return };
                let (words, told) = (texts(chunk, "TextLog:text"), texts(chunk, TOLD));
                for (row, time) in time_ns.into_iter().enumerate() {
                    let at = |texts: &[Option<String>]| texts.get(row).cloned().flatten().unwrap_or_default();
                    self.events.push((time, at(&words), at(&told)));
                }
            }
            MODELS => {
                let models = times().unwrap_or_default().into_iter().zip(texts(chunk, MODEL));
                self.models.extend(models.filter_map(|(time, text)| Some((time, text?))));
            }
            other if other == format!("__properties/{}", told::PROPERTY) => {
                let first = |field: &str| texts(chunk, field).into_iter().flatten().next();
                self.rig = first("rig").or(self.rig.take());
                self.rig_file = first(told::RIG_FILE).or(self.rig_file.take());
                self.start = first(told::START).or(self.start.take());
                self.number = first(told::RUN).or(self.number.take());
            }
            "__properties" => {
                let name = texts(chunk, "RecordingInfo:name").into_iter().flatten().next();
                self.name = name.unwrap_or(std::mem::take(&mut self.name));
            }
            _ => {}
        }
    }

    /// The run; `None` for a recording of something else.
    fn run(mut self, path: &str) -> Result<Option<RecordedRun>, RecordingError> {
        let unreadable = |reason: String| RecordingError::Read { path: path.to_owned(), reason };
        let network = match (&self.rig_file, &self.rig) {
            (Some(text), _) => {
                let spec: RigSpec = toml::from_str(text)
                    .map_err(|error| unreadable(format!("its rig is not readable: {}", error.message())))?;
                Arc::new(Network::new(spec).map_err(|error| unreadable(error.to_string()))?)
            }
            // Recordings from before the rig was kept in them name one that ships.
            (None, Some(id)) => match crate::rig::preset(id) {
                Ok(network) => network,
                Err(_) => return Ok(None),
            },
            (None, None) => return Ok(None),
        };
        let beginning: Option<Beginning> = self.start.as_deref().and_then(|text| toml::from_str(text).ok());
        let configuration = beginning.as_ref().and_then(|beginning| {
            network.spec.configurations.iter().position(|c| c.id == beginning.configuration)
        });
        let number = self.number.as_deref().and_then(|n| n.parse().ok()).unwrap_or(0);
        let mut events: Vec<Event> = self.take_events(number);
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let mut models: Vec<RecordedModel> = self.models.iter().filter_map(recorded_model).collect();
        models.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        models.dedup();
        Ok(Some(RecordedRun {
            name: std::mem::take(&mut self.name),
            configuration: configuration.unwrap_or(0),
            measurement: beginning.and_then(|b| b.measurement),
            rows: block(self.rows, &network, number),
            events,
            models,
            network,
        }))
    }

    fn take_events(&mut self, run: u64) -> Vec<Event> {
        let mut seen: HashSet<(i64, String, String)> = HashSet::new();
        let all = std::mem::take(&mut self.events).into_iter();
        // Parts that were tidied up have the same events in other chunks.
        let once: Vec<_> = all.filter(|event| seen.insert(event.clone())).collect();
        let event = |(time, words, told): (i64, String, String)| Event {
            run,
            time_s: time as f64 * 1e-9,
            kind: event_kind(&told, words),
        };
        once.into_iter().map(event).collect()
    }
}

fn recorded_model((time, text): &(i64, String)) -> Option<RecordedModel> {
    let ToldModel { pv_unit, mv_unit, model } = toml::from_str(text).ok()?;
    Some(RecordedModel { time_s: *time as f64 * 1e-9, model, pv_unit, mv_unit })
}

fn list<'a>(chunk: &'a Chunk, component: &str) -> Option<&'a ListArray> {
    chunk.components().get_array(ComponentIdentifier::try_new(component).ok()?)
}

/// The first text of each row.
fn texts(chunk: &Chunk, component: &str) -> Vec<Option<String>> {
    let Some(list) = list(chunk, component) else { return vec![] };
    let text = |row: usize| {
        let values = (!list.is_null(row)).then(|| list.value(row))?;
        let values = values.as_any().downcast_ref::<StringArray>()?;
        (!values.is_empty()).then(|| values.value(0).to_owned())
    };
    (0..list.len()).map(text).collect()
}

fn rows_of(chunk: &Chunk, time_ns: Vec<i64>) -> Rows {
    let mut columns = vec![];
    for component in chunk.components().keys() {
        let Some(list) = chunk.components().get_array(*component) else { continue };
        let width = (0..list.len()).map(|row| list.value_length(row) as usize).max().unwrap_or(0);
        let mut values = vec![f64::NAN; width * time_ns.len()];
        for (row, cells) in values.chunks_mut(width.max(1)).enumerate().take(list.len()) {
            if list.is_null(row) {
                continue;
            }
            let of_row = list.value(row);
            if let Some(of_row) = of_row.as_any().downcast_ref::<Float64Array>() {
                cells.iter_mut().zip(of_row.values()).for_each(|(cell, value)| *cell = *value);
            }
        }
        columns.push((component.to_string(), width, values));
    }
    Rows { time_ns, columns }
}

/// Rows in order of time, in the columns of the rig.
fn block(mut parts: Vec<Rows>, network: &Network, run: u64) -> SampleBlock {
    let channels = Arc::new(ChannelSet::of(network));
    let groups = groups(&channels, network);
    parts.sort_by_key(|rows| rows.time_ns.first().copied());
    let count = parts.iter().map(|rows| rows.time_ns.len()).sum();
    let width = channels.len();
    let (mut time_s, mut values) = (Vec::with_capacity(count), vec![f64::NAN; count * width]);
    let mut ordered = true;
    for rows in &parts {
        let first = time_s.len();
        for group in &groups {
            let Some((_, of_row, cells)) = rows.columns.iter().find(|c| c.0 == group.component) else {
                continue;
            };
            for (row, cells) in cells.chunks(*of_row.max(&1)).enumerate() {
                for (&column, &cell) in group.columns.iter().zip(cells) {
                    values[(first + row) * width + column] = cell;
                }
            }
        }
        time_s.extend(rows.time_ns.iter().map(|&ns| ns as f64 * 1e-9));
        ordered &= time_s[first.saturating_sub(1)..].is_sorted();
    }
    if !ordered {
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| f64::total_cmp(&time_s[a], &time_s[b]));
        values = order.iter().flat_map(|&row| values[row * width..(row + 1) * width].to_vec()).collect();
        time_s = order.iter().map(|&row| time_s[row]).collect();
    }
    SampleBlock { run, channels, time_s, values }
}
