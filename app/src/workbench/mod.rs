//! The window: state, what happens between frames ([`Workbench::logic`]), and the frame ([`Workbench::ui`]).

mod dispatch;
mod files;
mod jobs;
mod replay;
mod settings;
mod tiles;
mod topbar;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;
use vasos_engine::document::{Document, DocumentCommand, History, SourceChoice};
use vasos_engine::excitation::{Ending, ExcitationReport, Signal, StepEnd};
use vasos_engine::session::{EventKind, RecordedRun, Session, SessionCommand};
use vasos_engine::signal::SampleBlock;
use vasos_io::rig::PRESETS;

use crate::action::Action;
use crate::answers::Answers;
use crate::experiments::Desk;
use crate::i18n;
use crate::journal::{self, Entry, Weight};
use crate::panes::{PaneKind, States, View};
use crate::traces::{LogTrace, RunTrace};
use crate::tuning::TuningTable;
pub use settings::Settings;

use self::files::ImportSheet;
pub use self::files::column_choice;
use self::jobs::Jobs;
pub use self::jobs::Outcome;
use self::replay::{Noted, Parked};

/// How a workbench starts.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A log or a rig to open.
    pub file: Option<PathBuf>,
    /// Stand still at time 0, for tests and screenshots.
    pub paused: bool,
    /// Neither read nor write settings.
    pub forget: bool,
}

/// The window's state.
pub struct Workbench {
    ctx: egui::Context,
    session: Session,
    history: History,
    run: RunTrace,
    kept: Option<RunTrace>,
    log: Option<LogTrace>,
    tuning: TuningTable,
    journal: VecDeque<Entry>,
    tree: egui_tiles::Tree<PaneKind>,
    maximised: Option<PaneKind>,
    states: States,
    settings: Settings,
    jobs: Jobs,
    /// Work that nobody has to wait for: fits and imports go on meanwhile.
    beside: Jobs,
    answers: Answers,
    desk: Desk,
    import: Option<ImportSheet>,
    recording: Option<vasos_io::recording::Recording>,
    /// Files of the recording that was opened or ended last.
    recorded: Vec<PathBuf>,
    /// Runs of the recording that was opened.
    runs: Vec<Arc<RecordedRun>>,
    /// A choice among them is open.
    choosing_run: bool,
    /// The simulated rig, while a recording is played.
    parked: Option<Parked>,
    /// Model and tuning that the recording has been told of.
    noted: Noted,
    path_field: Option<String>,
    notice: Option<String>,
    dropped: Option<egui::DroppedFileHandle>,
    options: Options,
    title: String,
}

impl Workbench {
    /// A workbench on the reference rig, running unless told otherwise.
    ///
    /// # Errors
    /// When the preset cannot start.
    pub fn new(ctx: &egui::Context, options: Options) -> anyhow::Result<Self> {
        crate::theme::install(ctx);
        let (settings, trouble) = if options.forget { (Settings::default(), None) } else { Settings::load() };
        i18n::set(settings.language);
        ctx.set_theme(settings.theme());
        ctx.set_zoom_factor(settings.zoom());
        let preset = PRESETS.iter().find(|p| Some(p.id) == settings.rig.as_deref()).unwrap_or(&PRESETS[0]);
        let network = vasos_io::rig::preset(preset.id)?;
        let document = Document::new(network);
        let rig = document.rig.to_start();
        let repaint = ctx.clone();
        let session = Session::start(&rig, Box::new(move || repaint.request_repaint()))?;
        let tree = settings.layout.clone().unwrap_or_else(tiles::first_layout);
        let mut workbench = Self {
            ctx: ctx.clone(),
            session,
            history: History::new(document),
            run: RunTrace::default(),
            kept: None,
            log: None,
            tuning: TuningTable::default(),
            journal: VecDeque::new(),
            tree,
            maximised: None,
            states: States::default(),
            jobs: Jobs::new(ctx.clone()),
            beside: Jobs::new(ctx.clone()),
            answers: Answers::default(),
            desk: Desk::default(),
            import: None,
            recording: None,
            recorded: vec![],
            runs: vec![],
            choosing_run: false,
            parked: None,
            noted: Noted::default(),
            path_field: None,
            notice: None,
            dropped: None,
            settings,
            title: String::new(),
            options,
        };
        if let Some(trouble) = trouble {
            workbench.tell(Weight::Caution, i18n::say(&trouble));
        }
        if !workbench.options.paused {
            workbench.session_command(SessionCommand::Run);
            if workbench.settings.record_always {
                workbench.act(ctx, Action::ToggleRecording);
            }
        }
        if let Some(path) = workbench.options.file.take() {
            workbench.act(ctx, Action::OpenFile(path));
        }
        Ok(workbench)
    }

    /// The document.
    #[must_use]
    pub fn document(&self) -> &Document {
        self.history.document()
    }

    /// The rig now.
    #[must_use]
    pub fn snapshot(&self) -> std::sync::Arc<vasos_engine::session::Snapshot> {
        self.session.snapshot()
    }

    /// What happened, newest last.
    #[must_use]
    pub fn journal(&self) -> &VecDeque<Entry> {
        &self.journal
    }

    /// The present run's samples.
    #[must_use]
    pub fn run(&self) -> &RunTrace {
        &self.run
    }

    /// Rules compared on the model in use.
    #[must_use]
    pub fn tuning(&self) -> &TuningTable {
        &self.tuning
    }

    /// Takes samples as if the session had delivered them, for benchmarks and pictures of long runs; the session's own
    /// begin afresh.
    pub fn preload(&mut self, block: &SampleBlock) {
        self.run.take(block);
    }

    /// Whether something that a pane has asked for is being worked out.
    #[must_use]
    pub fn is_answering(&self) -> bool {
        self.answers.is_busy()
    }

    /// Whether a fit or an import is under way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.jobs.is_busy()
    }

    /// Experiments and their results.
    #[must_use]
    pub fn experiments(&self) -> &Desk {
        &self.desk
    }

    /// Between frames: fetches samples and events, takes results of jobs, keeps tables up to date. It also runs
    /// while the window is covered.
    pub fn logic(&mut self, ctx: &egui::Context) {
        i18n::set(self.settings.language);
        for block in self.session.samples() {
            self.run.take(&block);
        }
        let events: Vec<_> = self.session.events().collect();
        for event in events {
            self.run.note(&event);
            if let EventKind::ExcitationEnded(report) = &event.kind {
                self.take_report(ctx, report.clone());
            }
            journal::add(&mut self.journal, journal::of_event(&event));
        }
        self.take_results(ctx);
        self.tuning.update(self.history.document(), self.states.faceplate.shown, &self.answers);
        for question in self.tuning.questions.clone() {
            self.act(ctx, Action::Ask(Box::new(question)));
        }
        if let Some(recording) = &mut self.recording {
            for trouble in recording.troubles() {
                let words = i18n::say(&trouble);
                journal::add(&mut self.journal, journal::entry(Weight::Alarm, words));
            }
        }
        self.note_recording();
        self.set_title(ctx);
    }

    /// Keeps what a test of the loop measured, and fits its record where the loop was moved.
    fn take_report(&mut self, ctx: &egui::Context, report: Arc<ExcitationReport>) {
        // A setpoint that a test leaves behind is a setting like one that was typed.
        if let (Ending::Finished, Signal::SetpointStep { end: StepEnd::Stay, .. }) =
            (&report.ending, &report.excitation.signal)
            && let Some(&level_cm) = report.record.setpoint.last()
        {
            let change = DocumentCommand::Setpoint(report.tag.clone(), level_cm);
            self.act(ctx, Action::Document(change));
        }
        self.states.identify.bench.report = Some(report.clone());
        if report.moved_at_s.is_none() {
            return;
        }
        let snapshot = self.session.snapshot();
        let pump = snapshot.loops.iter().find(|l| l.tag == report.tag).map(|l| l.pump);
        let unit = pump.map_or("", |pump| snapshot.network.spec.pumps[pump].unit.symbol()).to_owned();
        self.jobs.start("fit", move || crate::panes::identify::of_report(&report, unit));
    }

    /// One frame.
    pub fn ui(&mut self, ui: &mut egui::Ui) {
        let snapshot = self.session.snapshot();
        let document = self.history.document().clone();
        self.desk.list();
        let mut actions = self.keys(ui);
        self.take_dropped(ui, &mut actions);
        actions.extend(self.top_bar(ui, &snapshot, &document));
        actions.extend(self.status_bar(ui, &snapshot, &document));
        self.scrub_bar(ui, &snapshot, &document, &mut actions);
        let view = View {
            snapshot: &snapshot,
            document: &document,
            run: &self.run,
            kept: self.kept.as_ref(),
            log: self.log.as_ref(),
            tuning: &self.tuning,
            answers: &self.answers,
            focus: self.states.faceplate.shown,
            fitting: self.jobs.is_busy(),
            experiments: &self.desk,
            journal: &self.journal,
        };
        egui::CentralPanel::default_margins()
            .frame(egui::Frame::NONE.fill(crate::theme::palette(ui).field).inner_margin(6))
            .show(ui, |ui| {
                actions.extend(tiles::ui(ui, &mut self.tree, self.maximised, &view, &mut self.states));
            });
        self.import_ui(ui, &mut actions);
        self.runs_ui(ui, &mut actions);
        self.notice_ui(ui);
        self.path_ui(ui, &mut actions);
        let ctx = ui.ctx().clone();
        for action in actions {
            self.act(&ctx, action);
        }
        if snapshot.running {
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(33));
        }
    }

    /// Writes into the log pane.
    pub(crate) fn tell(&mut self, weight: Weight, words: String) {
        journal::add(&mut self.journal, journal::entry(weight, words));
    }

    fn keys(&self, ui: &egui::Ui) -> Vec<Action> {
        if ui.ctx().egui_wants_keyboard_input() {
            return vec![];
        }
        use egui::{Key, KeyboardShortcut, Modifiers};
        let keys = [
            (KeyboardShortcut::new(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z), Action::Redo),
            (KeyboardShortcut::new(Modifiers::COMMAND, Key::Y), Action::Redo),
            (KeyboardShortcut::new(Modifiers::COMMAND, Key::Z), Action::Undo),
            (KeyboardShortcut::new(Modifiers::COMMAND, Key::O), Action::AskFile),
            (KeyboardShortcut::new(Modifiers::COMMAND, Key::R), Action::ToggleRecording),
            (KeyboardShortcut::new(Modifiers::COMMAND, Key::I), Action::Identify),
        ];
        let mut actions: Vec<Action> = ui.input_mut(|i| {
            keys.into_iter().filter(|(key, _)| i.consume_shortcut(key)).map(|(_, action)| action).collect()
        });
        // A focused button takes the space bar itself.
        if ui.memory(|m| m.focused()).is_none()
            && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Space))
        {
            actions.push(Action::ToggleRunning);
        }
        actions
    }

    fn set_title(&mut self, ctx: &egui::Context) {
        let document = self.history.document();
        let shown = match (document.source, &document.log) {
            (SourceChoice::Log, Some(log)) => log.name.clone(),
            (SourceChoice::Replay, _) => {
                document.recording.as_ref().map_or_else(String::new, |run| run.name.clone())
            }
            _ => document.rig.network.spec.title.get(i18n::current().tag()).to_owned(),
        };
        let title = format!("Vasos · {shown}");
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    pub(crate) fn session_command(&mut self, command: SessionCommand) {
        if !self.session.send(command) {
            self.tell(Weight::Alarm, crate::tr!("event.busy"));
        }
    }

    /// Writes the settings; called at exit and after changes that must outlive a crash.
    pub fn save_settings(&mut self) {
        if self.options.forget {
            return;
        }
        self.settings.layout = Some(self.tree.clone());
        self.settings.rig = Some(self.history.document().rig.network.spec.id.clone());
        if let Err(error) = self.settings.save() {
            self.tell(Weight::Caution, i18n::say(&error));
        }
    }
}

impl eframe::App for Workbench {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.logic(ctx);
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.ui(ui);
    }

    fn save(&mut self, _storage: &mut dyn eframe::Storage) {
        self.save_settings();
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.save_settings();
        if let Some(recording) = self.recording.take() {
            self.session_command(SessionCommand::Detach { id: recording.id() });
            // Nobody is left to tell; the file holds all but its index.
            drop(recording.close());
        }
    }
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// When the system gives no window.
pub fn open(options: Options) -> anyhow::Result<()> {
    let native = eframe::NativeOptions {
        renderer: eframe::Renderer::Glow,
        viewport: egui::ViewportBuilder::default()
            .with_app_id("vasos")
            .with_title("Vasos")
            .with_inner_size([1440.0, 900.0])
            .with_min_inner_size([960.0, 600.0])
            .with_drag_and_drop(true),
        persist_window: true,
        ..eframe::NativeOptions::default()
    };
    let create: eframe::AppCreator<'_> =
        Box::new(move |cc| Ok(Box::new(Workbench::new(&cc.egui_ctx, options)?)));
    eframe::run_native("vasos", native, create).map_err(|e| anyhow::anyhow!("{e}"))
}
