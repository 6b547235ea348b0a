//! Recordings back as runs: rows, events, settings and models, for a replay or an export.
//!
//! The messages of the file are read one after the other, without a store: a file that was cut off or damaged gives all
//! that is whole in it.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rerun::ComponentIdentifier;
use rerun::external::arrow::array::{Array, Float64Array, ListArray, StringArray};
use rerun::log::{Chunk, ChunkId, LogMsg};
use vasos_engine::plant::{Network, RigSpec};
use vasos_engine::session::{Event, RecordedModel, RecordedRun};
use vasos_engine::signal::{ChannelSet, SampleBlock};

use super::frames::{self, Damage};
use super::layout::{EVENTS, MODELS, SIGNALS, TIME, TOLD, groups};
use super::notes::MODEL;
use super::seal::{self, CHECKS, Check, has_sum, is_whole};
use super::told::{self, Beginning, Heard, ToldModel, heard};
use super::trouble::{RecordingError, RecordingFlaw};

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

/// What is in a recording.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Every run, in the order in which they began.
    pub runs: Vec<RecordedRun>,
    /// The files they are in; others beside the first that have the names of parts are left out.
    pub files: Vec<PathBuf>,
    /// What is missing or cannot be read.
    pub flaws: Vec<RecordingFlaw>,
}

/// Every run of a recording.
///
/// # Errors
/// As [`read_recorded`].
pub fn read_runs(parts: &Parts) -> Result<Vec<RecordedRun>, RecordingError> {
    read_recorded(parts).map(|recorded| recorded.runs)
}

/// Every run of a recording, its files, and what is wrong with them. What can be read is read.
///
/// # Errors
/// [`RecordingError::Read`] for a file that cannot be read, [`RecordingError::Nothing`] for one without a run,
/// [`RecordingError::NoRig`] for a recording of something else.
pub fn read_recorded(parts: &Parts) -> Result<Recorded, RecordingError> {
    let first = parts.0.first().map(|p| p.display().to_string()).unwrap_or_default();
    let mut stores: Vec<Store> = vec![];
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    let mut damages: Vec<(usize, Damage)> = vec![];
    for (place, path) in parts.0.iter().enumerate() {
        let read = read_messages(path, |id, is_recording, chunk| {
            // A part holds runs of the first file and those that began after it.
            let index = *known.entry(id.to_owned()).or_insert_with(|| {
                stores.push(Store {
                    id: id.to_owned(),
                    order: stores.len(),
                    part: place,
                    ..Store::default()
                });
                stores.len() - 1
            });
            stores[index].messages[usize::from(is_recording)] += 1;
            if let Some(chunk) = chunk {
                stores[index].take(&chunk, place);
            }
        });
        match read {
            Ok(damage) => damages.push((place, damage)),
            Err(reason) if place == 0 => return Err(RecordingError::Read { path: first, reason }),
            // What is beside a recording may be anything.
            Err(_) => {}
        }
    }
    let mut stores = joined(stores);
    stores.retain(|store| store.messages[1] > 0);
    if stores.is_empty() {
        return Err(RecordingError::Nothing { path: first });
    }
    let used = used_parts(&stores);
    let mut flaws: Vec<RecordingFlaw> = damages
        .into_iter()
        .filter(|(place, _)| used.contains(place))
        .filter_map(|(place, damage)| damage.flaw(&parts.0[place]))
        .collect();
    let mut runs = vec![];
    for store in stores.into_iter().filter(|store| used.contains(&store.part)) {
        let orphaned = RecordingFlaw::TextsAltered { run: store.id.clone(), texts: 1 };
        let has_rows = !store.rows.is_empty();
        match store.run(&first)? {
            Some((run, altered)) => {
                flaws.extend(gap(&run));
                flaws.extend(altered);
                runs.push(run);
            }
            // Rows of which no settings tell what they are.
            None if has_rows => flaws.push(orphaned),
            None => {}
        }
    }
    if runs.is_empty() {
        return Err(RecordingError::NoRig { path: first });
    }
    // A file that ends in the middle says the same of its last run.
    if flaws.iter().any(|flaw| matches!(flaw, RecordingFlaw::Cut { .. })) {
        flaws.retain(|flaw| !matches!(flaw, RecordingFlaw::NoEnd { .. }));
    }
    let files = parts.0.iter().enumerate().filter(|(place, _)| used.contains(place));
    Ok(Recorded { runs, files: files.map(|(_, file)| file.clone()).collect(), flaws })
}

/// Stores whose ids differ in one character, or in a message's kind, are one: a bit flipped. What comes of it is said.
fn joined(stores: Vec<Store>) -> Vec<Store> {
    let mut kept: Vec<Store> = vec![];
    let mut ordered = stores;
    ordered.sort_by_key(|store| std::cmp::Reverse(store.messages[1]));
    for store in ordered {
        let alike = |a: &str, b: &str| {
            a.len() == b.len() && a.bytes().zip(b.bytes()).filter(|(a, b)| a != b).count() == 1
        };
        match kept.iter_mut().find(|other| alike(&other.id, &store.id)) {
            Some(other) => other.join(store),
            None => kept.push(store),
        }
    }
    kept.sort_by_key(|store| store.order);
    for store in &mut kept {
        if store.messages[1] > 0 {
            store.strays += store.messages[0];
        }
    }
    kept
}

/// Rows that are missing in the middle of a run: a disk that was full, a part that is not there.
fn gap(run: &RecordedRun) -> Option<RecordingFlaw> {
    let time_s = &run.rows.time_s;
    let mut steps: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let gaps: Vec<usize> = {
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2).copied()?;
        (0..steps.len()).filter(|&i| steps[i] > 2.5 * usual).collect()
    };
    let first = *gaps.first()?;
    let missing_s = gaps.iter().map(|&i| std::mem::take(&mut steps[i])).sum();
    Some(RecordingFlaw::Gap { run: run.name.clone(), from_s: time_s[first], missing_s, gaps: gaps.len() })
}

/// The parts of the recording that the first file begins: those in which a run of it goes on.
fn used_parts(stores: &[Store]) -> HashSet<usize> {
    let mut parts: HashSet<usize> = HashSet::from([0]);
    loop {
        let before = parts.len();
        for store in stores {
            if store.parts.iter().any(|part| parts.contains(part)) {
                parts.extend(&store.parts);
            }
        }
        if parts.len() == before {
            return parts;
        }
    }
}

/// Hands over what each message is of: the id of its store, whether that is a recording, and its chunk where it is one.
fn read_messages(path: &Path, mut take: impl FnMut(&str, bool, Option<Chunk>)) -> Result<Damage, String> {
    let mut unreadable = 0;
    let mut damage = frames::read(path, |message| {
        let store = message.store_id().clone();
        let (id, is_recording) = (store.recording_id().to_string(), store.is_recording());
        match &message {
            LogMsg::SetStoreInfo(_) => take(&id, is_recording, None),
            // Arrow panics on columns that do not fit together.
            LogMsg::ArrowMsg(_, arrow) => match frames::quietly(|| Chunk::from_arrow_msg(arrow)) {
                Some(Ok(chunk)) => take(&id, is_recording, Some(chunk)),
                _ => unreadable += 1,
            },
            LogMsg::BlueprintActivationCommand(_) => {}
        }
    })?;
    damage.messages += unreadable;
    Ok(damage)
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
    id: String,
    /// Place among the stores, by their first messages.
    order: usize,
    /// Messages of it as a blueprint, and as a recording.
    messages: [usize; 2],
    /// Messages that came under another id or kind.
    strays: usize,
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
    checks: Vec<String>,
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
            CHECKS => self.checks.extend(texts(chunk, seal::ROWS).into_iter().flatten()),
            other if other == format!("__properties/{}", told::PROPERTY) => {
                let first = |field: &str| texts(chunk, field).into_iter().flatten().next();
                self.rig = first(told::RIG).or(self.rig.take());
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

    /// Takes in what came under an id that a bit made another.
    fn join(&mut self, other: Self) {
        self.strays += other.messages.iter().sum::<usize>();
        (self.part, self.order) = (self.part.min(other.part), self.order.min(other.order));
        self.parts.extend(other.parts);
        self.chunks.extend(other.chunks);
        self.rows.extend(other.rows);
        self.events.extend(other.events);
        self.models.extend(other.models);
        self.checks.extend(other.checks);
        self.rig = self.rig.take().or(other.rig);
        self.rig_file = self.rig_file.take().or(other.rig_file);
        self.start = self.start.take().or(other.start);
        self.number = self.number.take().or(other.number);
        if self.name.is_empty() {
            self.name = other.name;
        }
    }

    /// Whether the texts of this run were written with sums: one of its settings has one.
    fn has_sums(&self) -> bool {
        [&self.rig_file, &self.start].into_iter().flatten().any(|text| has_sum(text))
    }

    /// Settings that are not there beside others that are: the name of one is not what it was.
    fn missing_settings(&self) -> usize {
        let there = [&self.rig_file, &self.start, &self.number].map(Option::is_some);
        if there.contains(&true) {
            there.iter().chain([&self.rig.is_some()]).filter(|there| !**there).count()
        } else {
            0
        }
    }

    /// The run, and what of it is not as it was written; `None` for a recording of something else.
    fn run(mut self, path: &str) -> Result<Option<(RecordedRun, Vec<RecordingFlaw>)>, RecordingError> {
        let unreadable = |reason: String| RecordingError::Read { path: path.to_owned(), reason };
        let of_file = self.rig_file.as_ref().map(|text| {
            let spec: RigSpec = toml::from_str(text)
                .map_err(|error| unreadable(format!("its rig is not readable: {}", error.message())))?;
            Network::new(spec).map(Arc::new).map_err(|error| unreadable(error.to_string()))
        });
        let altered = self.rig_file.as_ref().is_some_and(|text| !is_whole(text, &[], self.has_sums()));
        let network = match (of_file, &self.rig) {
            (Some(Ok(network)), _) => network,
            // The rows of a damaged rig file are those of the preset that it was, where it was one.
            (Some(Err(error)), Some(id)) if altered => match crate::rig::preset(id) {
                Ok(network) => network,
                Err(_) => return Err(error),
            },
            (Some(Err(error)), _) => return Err(error),
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
        let mut altered_texts = self.altered_texts() + self.missing_settings() + self.strays;
        let heard = self.take_events();
        altered_texts += heard.iter().filter(|(_, heard)| !heard.whole).count();
        let numbers: HashSet<u64> = heard.iter().filter_map(|(_, heard)| heard.number).collect();
        let mut events: Vec<Event> = heard
            .into_iter()
            .map(|(time, heard)| Event { run: number, time_s: time as f64 / 1e9, kind: heard.kind })
            .collect();
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let mut models: Vec<RecordedModel> = self.models.iter().filter_map(recorded_model).collect();
        models.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        models.dedup();
        let name = std::mem::take(&mut self.name);
        let checks: Vec<Check> = self.checks.iter().filter_map(|text| toml::from_str(text).ok()).collect();
        let (time_ns, rows) = block(self.rows, &network, number);
        let has_end = checks.iter().any(|check| check.is_last);
        let mut flaws = altered_rows(&name, checks, &time_ns, &rows, &numbers);
        if !has_end && beginning.as_ref().is_some_and(|beginning| beginning.tells_end) {
            flaws.push(RecordingFlaw::NoEnd {
                run: name.clone(),
                last_s: rows.time_s.last().copied().unwrap_or(0.0),
            });
        }
        if altered_texts > 0 {
            flaws.push(RecordingFlaw::TextsAltered { run: name.clone(), texts: altered_texts });
        }
        let run = RecordedRun {
            name,
            configuration: configuration.unwrap_or(0),
            measurement: beginning.and_then(|b| b.measurement),
            rows,
            events,
            models,
            network,
        };
        Ok(Some((run, flaws)))
    }

    /// Takes away the texts that are not as they were written, of checks and models; how many there are, with those of
    /// the settings, which are kept.
    fn altered_texts(&mut self) -> usize {
        let before = self.checks.len() + self.models.len();
        let sums = self.has_sums();
        self.checks.retain(|text| is_whole(text, &[], sums));
        self.models.retain(|(_, text)| is_whole(text, &[], sums));
        let beside = [self.rig.as_deref().unwrap_or_default(), self.number.as_deref().unwrap_or_default()];
        let settings = [
            self.rig_file.as_ref().is_some_and(|text| !is_whole(text, &[], sums)),
            self.start.as_ref().is_some_and(|text| !is_whole(text, &beside, sums)),
        ];
        before - self.checks.len() - self.models.len()
            + settings.into_iter().filter(|altered| *altered).count()
    }

    /// Times in nanoseconds, and what is told at them.
    fn take_events(&mut self) -> Vec<(i64, Heard)> {
        let mut seen: HashSet<(i64, String, String)> = HashSet::new();
        let sums = self.has_sums();
        let all = std::mem::take(&mut self.events).into_iter();
        // Parts that were tidied up have the same events in other chunks.
        let once: Vec<_> = all.filter(|event| seen.insert(event.clone())).collect();
        once.into_iter().map(|(time, words, told)| (time, heard(&told, words, sums))).collect()
    }
}

/// Stretches of rows that are not what was summed up; those that follow each other are one.
fn altered_rows(
    name: &str,
    mut checks: Vec<Check>,
    time_ns: &[i64],
    rows: &SampleBlock,
    events: &HashSet<u64>,
) -> Vec<RecordingFlaw> {
    checks.sort_by_key(|check| check.from_ns);
    // Parts that were tidied up have the same checks in other chunks.
    checks.dedup();
    let mut altered: Vec<[i64; 2]> = vec![];
    let mut before_altered = false;
    for check in checks {
        let holds = check.holds(time_ns, |at| rows.row(at), events);
        match altered.last_mut().filter(|_| before_altered) {
            _ if holds => {}
            Some(last) => last[1] = check.to_ns,
            None => altered.push([check.from_ns, check.to_ns]),
        }
        before_altered = !holds;
    }
    let flaw = |[from_ns, to_ns]: [i64; 2]| {
        let [from_s, to_s] = [from_ns, to_ns].map(|ns| ns as f64 / 1e9);
        RecordingFlaw::RowsAltered { run: name.to_owned(), from_s, to_s }
    };
    altered.into_iter().map(flaw).collect()
}

fn recorded_model((time, text): &(i64, String)) -> Option<RecordedModel> {
    let ToldModel { pv_unit, mv_unit, model } = toml::from_str(text).ok()?;
    Some(RecordedModel { time_s: *time as f64 / 1e9, model, pv_unit, mv_unit })
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

/// Rows in order of time, in the columns of the rig; with them, their times in nanoseconds.
fn block(mut parts: Vec<Rows>, network: &Network, run: u64) -> (Vec<i64>, SampleBlock) {
    let channels = Arc::new(ChannelSet::of(network));
    let groups = groups(&channels, network);
    parts.sort_by_key(|rows| rows.time_ns.first().copied());
    let count = parts.iter().map(|rows| rows.time_ns.len()).sum();
    let width = channels.len();
    let (mut time_ns, mut values) = (Vec::with_capacity(count), vec![f64::NAN; count * width]);
    let mut ordered = true;
    for rows in &parts {
        let first = time_ns.len();
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
        time_ns.extend(&rows.time_ns);
        ordered &= time_ns[first.saturating_sub(1)..].is_sorted();
    }
    if !ordered {
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&row| time_ns[row]);
        values = order.iter().flat_map(|&row| values[row * width..(row + 1) * width].to_vec()).collect();
        time_ns = order.iter().map(|&row| time_ns[row]).collect();
    }
    let time_s = time_ns.iter().map(|&ns| ns as f64 / 1e9).collect();
    (time_ns, SampleBlock { run, channels, time_s, values })
}
