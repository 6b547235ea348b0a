//! Reading a recording back.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rerun::dataframe::{ChunkStoreConfig, QueryEngine, QueryExpression, TimelineName};
use rerun::external::arrow::array::{Array, ArrayRef, DurationNanosecondArray, Float64Array, ListArray};
use rerun::external::re_chunk_store::{ChunkStore, ChunkStoreHandle, ColumnDescriptor};
use rerun::log::{Chunk, LogMsg};

use super::frames;
use super::layout::TIME;
use super::trouble::{RecordingError, RecordingFlaw};

/// What one entity holds of one component, over the run's time.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedColumn {
    /// Id of the recording in the file; each run is one.
    pub recording: String,
    /// Entity path, with its leading slash.
    pub entity: String,
    /// Component, for example `Scalars:scalars`.
    pub component: String,
    /// Time of each row in seconds of the run.
    pub time_s: Vec<f64>,
    /// Numbers of each row; empty for components that are no numbers.
    pub values: Vec<Vec<f64>>,
}

/// Every column of every recording of a file, without static ones.
///
/// # Errors
/// [`RecordingError::Read`] for a file that cannot be read, [`RecordingError::Nothing`] for one without a recording.
pub fn read_recording(path: &Path) -> Result<Vec<RecordedColumn>, RecordingError> {
    read_columns(path).map(|(columns, _)| columns)
}

/// As [`read_recording`], with what of the file cannot be read.
///
/// # Errors
/// As [`read_recording`].
pub fn read_columns(path: &Path) -> Result<(Vec<RecordedColumn>, Option<RecordingFlaw>), RecordingError> {
    let shown = || path.display().to_string();
    let mut stores: BTreeMap<String, ChunkStore> = BTreeMap::new();
    let mut unreadable = 0;
    let mut damage = frames::read(path, |message| {
        let id = message.store_id();
        if !id.is_recording() {
            return;
        }
        let store = stores
            .entry(id.recording_id().to_string())
            .or_insert_with(|| ChunkStore::new(id.clone(), ChunkStoreConfig::DEFAULT));
        if let LogMsg::ArrowMsg(_, arrow) = &message {
            // Columns that do not fit together are a panic of Arrow's.
            let chunk = frames::quietly(|| Chunk::from_arrow_msg(arrow)).and_then(Result::ok);
            let taken = chunk.and_then(|chunk| frames::quietly(|| store.insert_chunk(&Arc::new(chunk))));
            unreadable += usize::from(taken.is_none_or(|taken| taken.is_err()));
        }
    })
    .map_err(|reason| RecordingError::Read { path: shown(), reason })?;
    if stores.is_empty() {
        return Err(RecordingError::Nothing { path: shown() });
    }
    damage.messages += unreadable;
    let mut columns = Vec::new();
    for (id, store) in stores {
        match frames::quietly(|| columns_of(&id, store)) {
            Some(of_run) => columns.extend(of_run),
            None => damage.messages += 1,
        }
    }
    Ok((columns, damage.flaw(path)))
}

/// Every column of one recording.
fn columns_of(id: &str, store: ChunkStore) -> Vec<RecordedColumn> {
    let query = QueryExpression {
        filtered_index: Some(TimelineName::from_static_str(TIME)),
        ..QueryExpression::default()
    };
    let handle = QueryEngine::from_store(ChunkStoreHandle::new(store)).query(query);
    let contents: Vec<ColumnDescriptor> =
        handle.selected_contents().iter().map(|(_, column)| column.clone()).collect();
    let mut found: Vec<Option<RecordedColumn>> = contents.iter().map(|c| recorded(id, c)).collect();
    for row in handle.into_iter() {
        let time = contents.iter().zip(&row).find_map(|(column, array)| time_s(column, array));
        let Some(time) = time else { continue };
        for (column, array) in found.iter_mut().zip(&row) {
            if let Some(column) = column
                && array.is_valid(0)
            {
                column.time_s.push(time);
                column.values.push(numbers(array));
            }
        }
    }
    found.into_iter().flatten().filter(|c| !c.time_s.is_empty()).collect()
}

fn recorded(recording: &str, column: &ColumnDescriptor) -> Option<RecordedColumn> {
    let ColumnDescriptor::Component(component) = column else { return None };
    if component.is_static {
        return None;
    }
    Some(RecordedColumn {
        recording: recording.to_owned(),
        entity: component.entity_path.to_string(),
        component: component.component.to_string(),
        time_s: vec![],
        values: vec![],
    })
}

fn time_s(column: &ColumnDescriptor, array: &ArrayRef) -> Option<f64> {
    match column {
        ColumnDescriptor::Time(time) if time.timeline_name().as_str() == TIME && array.is_valid(0) => {
            let times = array.as_any().downcast_ref::<DurationNanosecondArray>()?;
            Some(times.value(0) as f64 / 1e9)
        }
        _ => None,
    }
}

fn numbers(array: &ArrayRef) -> Vec<f64> {
    let list = array.as_any().downcast_ref::<ListArray>().map(|list| list.value(0));
    let inner = list.as_ref().and_then(|values| values.as_any().downcast_ref::<Float64Array>());
    inner.map(|values| values.values().to_vec()).unwrap_or_default()
}
