//! The samples the window keeps: the present run, a kept run, an imported log, all as pyramids.

use std::sync::Arc;

use vasos_engine::document::LogRoles;
use vasos_engine::session::{Event, EventKind, RigCommand};
use vasos_engine::signal::{ChannelKind, ChannelSet, LogTable, Pyramid, SampleBlock};

/// A run's columns over time.
#[derive(Debug, Clone, Default)]
pub struct RunTrace {
    /// Number of the run.
    pub run: u64,
    /// Its columns.
    pub channels: Option<Arc<ChannelSet>>,
    /// One pyramid a column.
    pub columns: Vec<Pyramid>,
    /// Marks of what happened.
    pub marks: Vec<Mark>,
    /// Times in seconds at which another configuration took over.
    changes_s: Vec<f64>,
}

/// Something that happened, at its time.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Time in seconds.
    pub time_s: f64,
    /// What, in a few signs that need no translation.
    pub words: String,
}

/// Rows kept of a run: 55 hours at 200 ms. The oldest quarter goes when there are more; a recording has them all.
const MOST_ROWS: usize = 1_000_000;
/// Marks kept; a drag gives one a frame.
const MOST_MARKS: usize = 400;

impl RunTrace {
    /// Takes samples; a new run starts afresh.
    pub fn take(&mut self, block: &SampleBlock) {
        let other = self.channels.as_ref().is_none_or(|c| !Arc::ptr_eq(c, &block.channels));
        if other || block.run != self.run {
            let (marks, changes_s) = if block.run == self.run {
                (std::mem::take(&mut self.marks), std::mem::take(&mut self.changes_s))
            } else {
                (vec![], vec![])
            };
            *self = Self {
                run: block.run,
                channels: Some(block.channels.clone()),
                columns: vec![Pyramid::default(); block.channels.len()],
                marks,
                changes_s,
            };
        }
        for (i, &time_s) in block.time_s.iter().enumerate() {
            for (column, &value) in self.columns.iter_mut().zip(block.row(i)) {
                column.push(time_s, value);
            }
        }
        if self.columns.first().is_some_and(|c| c.len() > MOST_ROWS) {
            self.columns.iter_mut().for_each(|c| c.keep_last(MOST_ROWS / 4 * 3));
        }
    }

    /// Takes note of an event that belongs on the time axis.
    pub fn note(&mut self, event: &Event) {
        if event.run != self.run {
            self.marks.clear();
            self.changes_s.clear();
            self.run = event.run;
            self.columns.iter_mut().for_each(Pyramid::clear);
        }
        let words = match &event.kind {
            EventKind::Done(RigCommand::Valve { tag, angle_deg }) => {
                format!("{tag} {}°", crate::text::brief(*angle_deg))
            }
            EventKind::Done(RigCommand::Bump { tag, delta_cm }) => {
                format!("{tag} {} cm", crate::text::fixed(*delta_cm, 1))
            }
            EventKind::Done(RigCommand::Configuration { id }) => {
                self.changes_s.push(event.time_s);
                id.clone()
            }
            EventKind::Done(RigCommand::Tuning { tag, tuning }) => {
                format!("{tag} Kc {}", crate::text::brief(tuning.gains.kc))
            }
            _ => return,
        };
        let first_word = |s: &str| s.split(' ').next().map(str::to_owned);
        if let Some(last) = self.marks.last_mut() {
            // A drag is one mark that moves along.
            if first_word(&last.words) == first_word(&words) && event.time_s - last.time_s < 5.0 {
                last.words = words;
                return;
            }
        }
        if self.marks.len() >= MOST_MARKS {
            self.marks.remove(0);
        }
        self.marks.push(Mark { time_s: event.time_s, words });
    }

    /// The column of a kind.
    #[must_use]
    pub fn column(&self, kind: ChannelKind) -> Option<&Pyramid> {
        self.columns.get(self.channels.as_ref()?.column(kind)?)
    }

    /// When the last change of configuration before a time was, in seconds.
    #[must_use]
    pub fn last_change_s(&self, before_s: f64) -> Option<f64> {
        self.changes_s.iter().copied().rfind(|&s| s < before_s)
    }

    /// Time of the last sample in seconds.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.columns.first().and_then(|c| c.time_s().last()).copied().unwrap_or(0.0)
    }
}

/// A log's columns as pyramids.
#[derive(Debug, Clone)]
pub struct LogTrace {
    /// The log.
    pub table: Arc<LogTable>,
    /// One pyramid a column.
    pub columns: Vec<Pyramid>,
}

impl LogTrace {
    /// Builds the pyramids.
    #[must_use]
    pub fn new(table: Arc<LogTable>) -> Self {
        let columns = table
            .columns
            .iter()
            .map(|column| {
                let mut pyramid = Pyramid::default();
                for (&time_s, &value) in table.time_s.iter().zip(&column.values) {
                    pyramid.push(time_s, value);
                }
                pyramid
            })
            .collect();
        Self { table, columns }
    }

    /// The PV, SP and MV columns under the given roles.
    #[must_use]
    pub fn roles(&self, roles: LogRoles) -> [Option<&Pyramid>; 3] {
        [roles.pv, roles.sp, roles.mv].map(|i| i.and_then(|i| self.columns.get(i)))
    }
}
