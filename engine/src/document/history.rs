//! Undo and redo.

use std::sync::Arc;

use super::command::DocumentCommand;
use super::data::Document;
use super::error::DocumentError;

/// Versions kept for undo.
const MOST_VERSIONS: usize = 500;

/// A step of the history: the version before it (done) or after it (undone), and what the step was.
#[derive(Debug, Clone)]
struct Step {
    version: Arc<Document>,
    key: &'static str,
    thread: Option<String>,
}

/// The document with its past and its undone future.
#[derive(Debug, Clone)]
pub struct History {
    present: Arc<Document>,
    done: Vec<Step>,
    undone: Vec<Step>,
}

impl History {
    /// A document without a past.
    #[must_use]
    pub fn new(document: Document) -> Self {
        Self { present: Arc::new(document), done: vec![], undone: vec![] }
    }

    /// The present version.
    #[must_use]
    pub fn document(&self) -> &Arc<Document> {
        &self.present
    }

    /// Applies a change. Changes of one thread, such as the steps of a drag, become one step of the history
    /// until [`Self::seal`].
    ///
    /// # Errors
    /// [`DocumentError`]; nothing has changed then.
    pub fn apply(&mut self, command: &DocumentCommand) -> Result<(), DocumentError> {
        let next = Arc::new(self.present.after(command)?);
        let thread = command.thread();
        let continues = thread.is_some() && self.done.last().is_some_and(|s| s.thread == thread);
        let before = std::mem::replace(&mut self.present, next);
        if !continues {
            self.done.push(Step { version: before, key: command.key(), thread });
            if self.done.len() > MOST_VERSIONS {
                self.done.remove(0);
            }
        }
        self.undone.clear();
        Ok(())
    }

    /// Ends a thread: the next change is a step of its own.
    pub fn seal(&mut self) {
        if let Some(step) = self.done.last_mut() {
            step.thread = None;
        }
    }

    /// Key of the step that undo would take back.
    #[must_use]
    pub fn undo_key(&self) -> Option<&'static str> {
        self.done.last().map(|s| s.key)
    }

    /// Key of the step that redo would do again.
    #[must_use]
    pub fn redo_key(&self) -> Option<&'static str> {
        self.undone.last().map(|s| s.key)
    }

    /// Takes the last step back; false when there is none.
    pub fn undo(&mut self) -> bool {
        let Some(step) = self.done.pop() else { return false };
        let after = std::mem::replace(&mut self.present, step.version);
        self.undone.push(Step { version: after, key: step.key, thread: None });
        true
    }

    /// Does the last undone step again; false when there is none.
    pub fn redo(&mut self) -> bool {
        let Some(step) = self.undone.pop() else { return false };
        let before = std::mem::replace(&mut self.present, step.version);
        self.done.push(Step { version: before, key: step.key, thread: None });
        true
    }
}
