//! Recordings in the window: opened, played with the simulated rig parked meanwhile, shown in Rerun, and told of models
//! and loops while they run.

use std::sync::Arc;

use eframe::egui::{self, RichText};
use vasos_engine::analyze::{CurveOptions, LoopFunction, OpenLoop, frequency_curve};
use vasos_engine::document::{Document, DocumentCommand, SourceChoice};
use vasos_engine::session::{RecordedRun, Session, SessionCommand, Snapshot};
use vasos_io::recording::viewer::{self, Shown};
use vasos_io::recording::{ModelNote, Note, NyquistNote, Recorded};

use super::Workbench;
use crate::action::Action;
use crate::journal::Weight;
use crate::traces::RunTrace;
use crate::tuning::PRESENT;
use crate::{i18n, text, theme, tr};

/// The simulated rig while a recording is played.
pub(super) struct Parked {
    session: Session,
    run: RunTrace,
    was_running: bool,
    /// What is played.
    recorded: Arc<RecordedRun>,
}

/// What the recording has been told of.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Noted {
    model: Option<u32>,
    loop_of: Option<(u32, vasos_engine::control::PidGains)>,
}

impl Workbench {
    /// Takes the runs of a recording: one is played at once, of several one is chosen.
    pub(super) fn take_runs(&mut self, ctx: &egui::Context, recorded: Recorded) {
        if let Some(first) = recorded.files.first() {
            self.settings.remember(first.clone());
        }
        for flaw in &recorded.flaws {
            self.tell(Weight::Caution, i18n::say(flaw));
        }
        self.recorded = recorded.files;
        self.runs = recorded.runs.into_iter().map(Arc::new).collect();
        if self.runs.len() > 1 {
            self.choosing_run = true;
        } else {
            self.play_run(ctx, 0);
        }
    }

    pub(super) fn play_run(&mut self, ctx: &egui::Context, index: usize) {
        self.choosing_run = false;
        let Some(run) = self.runs.get(index).cloned() else { return };
        let words = tr!("event.replay", name = run.name, rows = run.len());
        self.tell(Weight::Note, words);
        self.act(ctx, Action::Document(DocumentCommand::OpenRecording(run)));
    }

    /// Sends a command to the simulated rig, also while a recording is played.
    pub(super) fn rig_command(&mut self, command: SessionCommand) {
        let sent = match &self.parked {
            Some(parked) => parked.session.send(command),
            None => self.session.send(command),
        };
        if !sent {
            self.tell(Weight::Alarm, tr!("event.busy"));
        }
    }

    /// Plays the document's recording, or goes back to the simulated rig.
    pub(super) fn follow_source(&mut self, document: &Document) {
        let wanted = document.recording.as_ref().filter(|_| document.source == SourceChoice::Replay);
        let playing = self.parked.as_ref().map(|parked| &parked.recorded);
        match (wanted, playing) {
            (None, None) => {}
            (Some(wanted), Some(playing)) if Arc::ptr_eq(wanted, playing) => {}
            (wanted, _) => {
                // A recording belongs to one source.
                if self.recording.is_some() {
                    self.toggle_recording();
                }
                let wanted = wanted.cloned();
                self.unpark();
                if let Some(recorded) = wanted {
                    self.park(recorded);
                }
            }
        }
    }

    fn park(&mut self, recorded: Arc<RecordedRun>) {
        let was_running = self.session.snapshot().running;
        self.session_command(SessionCommand::Pause);
        let repaint = self.ctx.clone();
        let player = Session::replay(recorded.clone(), Box::new(move || repaint.request_repaint()));
        let session = std::mem::replace(&mut self.session, player);
        let run = std::mem::take(&mut self.run);
        self.parked = Some(Parked { session, run, was_running, recorded });
    }

    fn unpark(&mut self) {
        let Some(parked) = self.parked.take() else { return };
        self.session = parked.session;
        self.run = parked.run;
        if parked.was_running {
            self.session_command(SessionCommand::Run);
        }
    }

    /// Opens Rerun's viewer on the recording that runs, else on the last one.
    pub(super) fn open_in_rerun(&mut self) {
        let running = self.recording.as_ref().and_then(|r| r.address()).map(str::to_owned);
        let shown = running.map_or_else(|| Shown::Files(self.recorded.clone()), Shown::Running);
        match viewer::open(&shown) {
            Ok(_) => self.tell(Weight::Note, tr!("event.rerun")),
            Err(error) => self.refuse(i18n::say(&error)),
        }
    }

    /// Tells the recording of the model in use, with its fit, and of the loop's Nyquist curve with the present gains.
    pub(super) fn note_recording(&mut self) {
        let Some(recording) = &self.recording else { return };
        let document = self.history.document();
        let Some(entry) = document.model() else { return };
        if self.noted.model != Some(entry.number) {
            self.noted.model = Some(entry.number);
            let fitted = entry.rows.as_ref().zip(entry.fit.as_ref()).map(|(rows, fit)| {
                let modelled = fit.simulated.iter();
                rows.time_s.iter().zip(&rows.pv).zip(modelled).map(|((t, pv), y)| [*t, *pv, *y]).collect()
            });
            recording.note(Note::Model(ModelNote {
                number: entry.number,
                words: entry.model.to_string(),
                model: entry.model.clone(),
                pv_unit: entry.pv_unit.clone(),
                mv_unit: entry.mv_unit.clone(),
                rows: fitted.unwrap_or_default(),
            }));
        }
        let Some(present) = self.tuning.rows.iter().find(|row| row.rule == PRESENT) else { return };
        let gains = present.gains;
        if self.noted.loop_of == Some((entry.number, gains)) {
            return;
        }
        self.noted.loop_of = Some((entry.number, gains));
        let open = OpenLoop::new(&entry.model, &gains);
        let curve = frequency_curve(&open, LoopFunction::OpenLoop, &CurveOptions::default());
        let tag = document.rig.active_loops().get(self.states.faceplate.shown).map_or("", |l| l.id.as_str());
        recording.note(Note::Nyquist(NyquistNote {
            words: format!("{tag}: Kc {}, Ti {} s", text::brief(gains.kc), text::brief(gains.ti_s)),
            curve: curve.iter().map(|(_, l)| [l.re, l.im]).collect(),
            ms: present.analysis.ms,
        }));
    }

    /// The bar with which a recording is gone through.
    pub(super) fn scrub_bar(
        &self,
        ui: &mut egui::Ui,
        snapshot: &Snapshot,
        document: &Document,
        actions: &mut Vec<Action>,
    ) {
        let Some([from_s, to_s]) = snapshot.span_s else { return };
        let p = theme::palette(ui);
        let frame = egui::Frame::NONE.fill(p.pane).inner_margin(egui::Margin::symmetric(10, 4));
        egui::Panel::bottom("scrub").frame(frame).show(ui, |ui| {
            ui.horizontal(|ui| {
                let name = document.recording.as_ref().map_or("", |run| run.name.as_str());
                ui.add(egui::Label::new(RichText::new(name).family(theme::bold())).truncate());
                let words = format!("{} / {}", text::clock(snapshot.time_s), text::clock(to_s));
                ui.label(RichText::new(words).monospace());
                let mut time_s = snapshot.time_s;
                ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(60.0);
                let slider =
                    egui::Slider::new(&mut time_s, from_s..=to_s.max(from_s + 1e-9)).show_value(false);
                let slider = ui.add(slider).on_hover_text(tr!("replay.scrub_hint"));
                slider.widget_info(|| egui::WidgetInfo::slider(true, time_s, tr!("replay.scrub")));
                if slider.changed() {
                    actions.push(Action::Seek(time_s));
                }
            });
        });
    }

    /// The choice among several runs of a recording.
    pub(super) fn runs_ui(&mut self, ui: &mut egui::Ui, actions: &mut Vec<Action>) {
        if !self.choosing_run {
            return;
        }
        let modal = egui::Modal::new(egui::Id::unique("runs")).show(ui.ctx(), |ui| {
            ui.set_max_width(560.0);
            ui.heading(tr!("replay.choose", count = self.runs.len()));
            ui.add_space(theme::GAP);
            for (index, run) in self.runs.iter().enumerate() {
                let [from_s, to_s] = run.span_s();
                let length = text::clock(to_s - from_s);
                let words = tr!("replay.run", name = run.name, length = length, rows = run.len());
                if ui.button(words).clicked() {
                    actions.push(Action::PlayRun(index));
                }
            }
            ui.add_space(theme::GAP);
            ui.button(tr!("import_sheet.cancel")).clicked()
        });
        let escaped = modal.is_top_modal && ui.input(|i| i.key_pressed(egui::Key::Escape));
        if modal.inner || escaped {
            self.choosing_run = false;
        }
    }
}
