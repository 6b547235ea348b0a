//! Reading a recording back.

use std::path::Path;

use rerun::dataframe::{ChunkStoreConfig, QueryEngine, QueryExpression, TimelineName};
use rerun::external::arrow::array::{Array, ArrayRef, DurationNanosecondArray, Float64Array, ListArray};
use rerun::external::re_chunk_store::ColumnDescriptor;

use super::layout::TIME;
use super::trouble::RecordingError;

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
    let shown = || path.display().to_string();
    let engines = QueryEngine::from_rrd_filepath(&ChunkStoreConfig::DEFAULT, path)
        .map_err(|error| RecordingError::Read { path: shown(), reason: format!("{error:#}") })?;
    let mut columns = Vec::new();
    let mut recordings = 0;
    for (id, engine) in &engines {
        if !id.is_recording() {
            continue;
        }
        recordings += 1;
        let query = QueryExpression {
            filtered_index: Some(TimelineName::from_static_str(TIME)),
            ..QueryExpression::default()
        };
        let handle = engine.query(query);
        let contents: Vec<ColumnDescriptor> =
            handle.selected_contents().iter().map(|(_, column)| column.clone()).collect();
        let mut found: Vec<Option<RecordedColumn>> =
            contents.iter().map(|c| recorded(&id.recording_id().to_string(), c)).collect();
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
        columns.extend(found.into_iter().flatten().filter(|c| !c.time_s.is_empty()));
    }
    if recordings == 0 {
        return Err(RecordingError::Nothing { path: shown() });
    }
    Ok(columns)
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
