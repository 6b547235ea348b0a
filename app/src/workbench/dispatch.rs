//! The one place where what panes ask for is carried out.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;
use vasos_engine::document::{Consequence, Document, DocumentCommand, rig_commands};
use vasos_engine::session::{RigCommand, SessionCommand};
use vasos_io::recording::{Recording, RecordingOptions};

use super::jobs::Outcome;
use super::{Workbench, files, tiles};
use crate::action::{Action, Table};
use crate::answers::Question;
use crate::journal::{self, Weight};
use crate::panes::identify;
use crate::traces::LogTrace;
use crate::{i18n, text, tr};

impl Workbench {
    /// Carries out an action. What is refused is said in the log pane and as a notice; nothing has changed then.
    pub fn act(&mut self, ctx: &egui::Context, action: Action) {
        match action {
            Action::Document(command) => self.change(&command),
            Action::Seal => self.history.seal(),
            Action::Undo | Action::Redo => self.travel(matches!(action, Action::Undo)),
            Action::Rig(command) => self.session_command(SessionCommand::Rig(command)),
            Action::ToggleRunning => {
                let running = self.session.snapshot().running;
                self.session_command(if running { SessionCommand::Pause } else { SessionCommand::Run });
            }
            Action::Step => self.session_command(SessionCommand::Step),
            Action::Speed(speed) => self.session_command(SessionCommand::Speed(speed)),
            Action::Restart if self.parked.is_some() => self.session_command(SessionCommand::Seek(f64::MIN)),
            Action::Seek(time_s) => self.session_command(SessionCommand::Seek(time_s)),
            Action::PlayRun(index) => self.play_run(ctx, index),
            Action::OpenInRerun => self.open_in_rerun(),
            Action::Restart => {
                let document = self.history.document().clone();
                self.reload(&document);
            }
            Action::SteadyAt(tag, level_cm) => {
                self.change(&DocumentCommand::Setpoint(tag.clone(), level_cm));
                self.session_command(SessionCommand::Rig(RigCommand::SteadyAt { tag, level_cm }));
            }
            Action::OpenPreset(id) => match vasos_io::rig::preset(id) {
                Ok(network) => self.change(&DocumentCommand::OpenRig(network)),
                Err(error) => self.refuse(i18n::say(&error)),
            },
            Action::AskFile => self.jobs.ask_file(),
            Action::OpenFile(path) => self.open(path),
            Action::OpenLogs(paths) => self.open_logs(paths),
            Action::ToggleRecording => self.toggle_recording(),
            Action::RecordAlways(on) => {
                self.settings.record_always = on;
                if on && self.recording.is_none() {
                    self.toggle_recording();
                }
                self.save_settings();
            }
            Action::Language(language) => {
                self.settings.language = language;
                i18n::set(language);
                self.save_settings();
            }
            Action::ToggleTheme => {
                self.settings.dark = !self.settings.dark;
                ctx.set_theme(self.settings.theme());
                self.save_settings();
            }
            Action::Zoom(zoom) => {
                self.settings.zoom = zoom;
                ctx.set_zoom_factor(self.settings.zoom());
                self.save_settings();
            }
            Action::KeepRun => self.kept = Some(self.run.clone()),
            Action::DropKeptRun => self.kept = None,
            Action::Identify => self.identify(),
            Action::ChooseExperiment(id) => self.desk.chosen = id,
            Action::RunExperiment(id) => {
                if let Some(run) = self.desk.start(&id) {
                    self.beside.start("experiment", move || Outcome::Ran(Box::new(run())));
                }
            }
            Action::CancelExperiment => {
                if let Some(under_way) = &self.desk.under_way {
                    under_way.cancel();
                }
            }
            Action::Maximise(kind) => {
                self.maximised = if self.maximised == Some(kind) { None } else { Some(kind) };
            }
            Action::ResetLayout => {
                self.tree = tiles::first_layout();
                self.maximised = None;
            }
            Action::ExportTrend(table) => self.export_trend(table),
            Action::ClearLog => self.journal.clear(),
            Action::Ask(question) => self.work_out(question),
            Action::Copy(words) => ctx.copy_text(words),
        }
    }

    /// Works a question out beside the window, unless it is known or under way.
    fn work_out(&mut self, question: Box<Question>) {
        if self.answers.begins(&question) {
            self.beside.start("answer", move || {
                let reply = question.answer();
                Outcome::Answered(question, Box::new(reply))
            });
        }
    }

    /// Says why something was not done.
    pub(super) fn refuse(&mut self, words: String) {
        self.tell(Weight::Alarm, words.clone());
        self.notice = Some(words);
    }

    fn change(&mut self, command: &DocumentCommand) {
        let before = self.history.document().clone();
        match self.history.apply(command) {
            Ok(()) => self.follow(&before),
            Err(error) => self.refuse(i18n::say(&error)),
        }
    }

    fn travel(&mut self, back: bool) {
        let before = self.history.document().clone();
        let key = if back { self.history.undo_key() } else { self.history.redo_key() };
        let done = if back { self.history.undo() } else { self.history.redo() };
        if let (true, Some(key)) = (done, key) {
            let sentence = if back { "event.undone" } else { "event.redone" };
            let words = tr!(sentence, change = journal::change(key));
            self.tell(Weight::Note, words);
            self.follow(&before);
        }
    }

    /// Brings the rig and the traces in line with the document.
    fn follow(&mut self, before: &Document) {
        let after = self.history.document().clone();
        match rig_commands(before, &after) {
            Consequence::Reload => self.reload(&after),
            Consequence::Commands(commands) => {
                for command in commands {
                    self.rig_command(SessionCommand::Rig(command));
                }
            }
        }
        self.follow_source(&after);
        let shown = self.log.as_ref().map(|l| Arc::as_ptr(&l.table));
        if shown != after.log.as_ref().map(Arc::as_ptr) {
            self.log = after.log.clone().map(LogTrace::new);
        }
    }

    fn reload(&mut self, document: &Document) {
        let rig = &document.rig;
        let load = rig.to_start();
        self.rig_command(SessionCommand::Load(Box::new(load)));
        for command in rig.commands_after_load() {
            self.rig_command(SessionCommand::Rig(command));
        }
    }

    fn open_logs(&mut self, paths: Vec<PathBuf>) {
        self.notice = None;
        let options = vasos_io::log::ImportOptions::default();
        self.jobs.start("import", move || files::read_log(&paths, &options));
    }

    fn open(&mut self, path: PathBuf) {
        self.notice = None;
        self.jobs.start("import", move || files::read(&path, &vasos_io::log::ImportOptions::default()));
    }

    fn identify(&mut self) {
        if self.jobs.is_busy() {
            return;
        }
        self.notice = None;
        let focus = self.states.faceplate.shown;
        match identify::data(self.history.document(), &self.run, &self.states.identify, focus) {
            Ok(data) => self.jobs.start("fit", move || data.fit()),
            Err(words) => self.refuse(words),
        }
    }

    pub(super) fn toggle_recording(&mut self) {
        if let Some(recording) = self.recording.take() {
            self.session_command(SessionCommand::Detach { id: recording.id() });
            // Closing waits for the recorder and tidies the file up: seconds, on a slow disk.
            self.jobs.start("close", move || {
                let (files, rows) = (recording.parts(), recording.rows());
                match recording.close() {
                    Ok(()) => Outcome::Recorded(files, rows),
                    Err(trouble) => Outcome::Failed(Box::new(trouble)),
                }
            });
            return;
        }
        let path = vasos_io::settings::recordings_dir().join(format!("vasos-{}.rrd", text::stamp()));
        match Recording::start(&path, RecordingOptions::default()) {
            Ok((recording, sink)) => {
                self.session_command(SessionCommand::Attach { id: recording.id(), sink });
                let viewer = recording.address().unwrap_or("–").to_owned();
                self.tell(Weight::Note, tr!("event.recording", path = path.display(), viewer = viewer));
                self.recording = Some(recording);
                self.noted = super::replay::Noted::default();
            }
            Err(error) => self.refuse(i18n::say(&error)),
        }
    }

    fn export_trend(&mut self, table: Table) {
        let name = format!("vasos-{}.{}", text::stamp(), table.ending());
        let path = vasos_io::settings::recordings_dir().join(name);
        let Some(channels) = self.run.channels.clone() else { return };
        let columns: Vec<&[f64]> = self.run.columns.iter().map(|c| c.values()).collect();
        let time_s = self.run.columns.first().map_or(&[][..], |c| c.time_s());
        match vasos_io::export::write_columns(&channels, time_s, &columns, &path) {
            Ok(()) => {
                self.tell(Weight::Note, tr!("event.exported", rows = time_s.len(), path = path.display()))
            }
            Err(error) => self.refuse(i18n::say(&error)),
        }
    }
}
