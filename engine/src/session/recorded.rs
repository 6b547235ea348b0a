//! A recorded run as plain data: what a recorder kept, as a session plays it and a face exports it.

use std::sync::Arc;

use super::event::Event;
use super::replay;
use crate::control::Mode;
use crate::model::ProcessModel;
use crate::plant::{Measurement, Network};
use crate::signal::{ChannelSet, SampleBlock};

/// A model that was in use while the run was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedModel {
    /// Time in seconds of the run at which it came.
    pub time_s: f64,
    /// The model.
    pub model: ProcessModel,
    /// Unit of its PV.
    pub pv_unit: String,
    /// Unit of its MV.
    pub mv_unit: String,
}

/// A run out of a recording.
#[derive(Debug, Clone)]
pub struct RecordedRun {
    /// Name shown to people: file, rig, number of the run.
    pub name: String,
    /// The rig as it was set when the recording began: its loops have the laws, gains, setpoints and modes of then.
    pub network: Arc<Network>,
    /// Index of the configuration at the beginning.
    pub configuration: usize,
    /// Imperfections at the beginning; `None` where no simulated rig was recorded.
    pub measurement: Option<Measurement>,
    /// Its rows: time in seconds of the run, and the columns of [`ChannelSet::of`] the rig, in that order.
    pub rows: SampleBlock,
    /// What happened, in order of time.
    pub events: Vec<Event>,
    /// Models of its loops, in order of time.
    pub models: Vec<RecordedModel>,
}

impl RecordedRun {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.time_s.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.time_s.is_empty()
    }

    /// Time of the first and of the last row in seconds of the run; 0 for both where there is none.
    #[must_use]
    pub fn span_s(&self) -> [f64; 2] {
        let time_s = &self.rows.time_s;
        [time_s.first().copied().unwrap_or(0.0), time_s.last().copied().unwrap_or(0.0)]
    }

    /// The last row at or before a time in seconds; the first one before that, `None` where there is none.
    #[must_use]
    pub fn row_at(&self, time_s: f64) -> Option<usize> {
        let after = self.rows.time_s.partition_point(|&t| t <= time_s);
        (!self.is_empty()).then(|| after.saturating_sub(1))
    }

    /// The mode of every loop slot at each row, a vector each: `None` while the slot has no loop, by hand while a test
    /// moves the loop's output.
    #[must_use]
    pub fn modes(&self) -> Vec<Vec<Option<Mode>>> {
        replay::modes(self)
    }

    /// Columns of its rows.
    #[must_use]
    pub fn channels(&self) -> &Arc<ChannelSet> {
        &self.rows.channels
    }
}
