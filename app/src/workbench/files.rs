//! Files into the window: dropped, chosen or typed; logs with their import sheet, rigs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui;
use vasos_engine::document::{DocumentCommand, LogRoles};
use vasos_engine::experiment::ExperimentEnd;
use vasos_io::experiment::load_experiment;
use vasos_io::log::{
    DateOrder, Decimal, FileFormat, ImportError, ImportOptions, ImportedLog, Repair, TextFormat, open_log,
    open_logs,
};
use vasos_io::recording::{Parts, RecordingError, read_recorded};
use vasos_io::rig::{FileError, load_rig};

use super::Workbench;
use super::jobs::Outcome;
use crate::action::Action;
use crate::experiments::Finished;
use crate::journal::Weight;
use crate::{i18n, text, theme, tr};

/// Rows shown before an import.
const PREVIEW_ROWS: usize = 6;

/// A log that was read and waits for its columns to be confirmed.
pub struct ImportSheet {
    paths: Vec<PathBuf>,
    log: ImportedLog,
    roles: LogRoles,
    sample_time_s: f64,
    /// What the user said of the file so far.
    options: ImportOptions,
}

impl ImportSheet {
    /// A sheet with the columns the importer proposes.
    pub fn new(paths: Vec<PathBuf>, log: ImportedLog, options: ImportOptions) -> Self {
        let proposed = &log.report.roles;
        let index = |name: &Option<String>| name.as_deref().and_then(|n| log.table.index_of(n));
        let roles = LogRoles {
            pv: index(&proposed.pv),
            sp: index(&proposed.sp),
            mv: index(&proposed.mv),
            mode: index(&proposed.mode),
            disturbance: None,
        };
        let sample_time_s = options.sample_time_s.unwrap_or(1.0);
        Self { paths, log, roles, sample_time_s, options }
    }
}

/// Reads a file in a job: a rig or an experiment when it ends in `.toml`, else a log.
pub fn read(path: &Path, options: &ImportOptions) -> Outcome {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("rrd")) {
        match read_recorded(&Parts::of(path)) {
            Ok(recorded) => return Outcome::Runs(Box::new(recorded)),
            // A recording of something else has numbers all the same.
            Err(RecordingError::NoRig { .. }) => {}
            Err(error) => return Outcome::Failed(Box::new(error)),
        }
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        // Only an experiment expects something.
        let text = std::fs::read_to_string(path).unwrap_or_default();
        if text.lines().any(|line| line.trim_start().starts_with("[[check")) {
            return match load_experiment(&path.to_string_lossy()) {
                Ok(experiment) => Outcome::Experiment(path.to_owned(), Arc::new(experiment)),
                Err(error) => Outcome::Failed(Box::new(error)),
            };
        }
        return match load_rig(&path.to_string_lossy()) {
            Ok(network) => Outcome::Rig(path.to_owned(), network),
            Err(error) => Outcome::Failed(Box::new(error)),
        };
    }
    let shown = path.display().to_string();
    if path.is_dir() {
        let reason = tr!("window.is_folder");
        return Outcome::Failed(Box::new(FileError::Read { path: shown, reason }));
    }
    read_log(&[path.to_owned()], options)
}

/// Reads a log out of one file or several in a job.
pub fn read_log(paths: &[PathBuf], options: &ImportOptions) -> Outcome {
    let shown = |path: &Path| path.display().to_string();
    let opened = match paths {
        [path] => open_log(path, options).map_err(|error| (shown(path), error)),
        paths => open_logs(paths, options),
    };
    match opened {
        Ok(log) => Outcome::Log(paths.to_vec(), Box::new(log), options.clone()),
        Err((path, ImportError::Read { reason })) => {
            Outcome::Failed(Box::new(FileError::Read { path, reason }))
        }
        Err((_, error)) => Outcome::Failed(Box::new(error)),
    }
}

impl Workbench {
    /// Takes what an experiment came to.
    fn take_experiment(&mut self, finished: Finished) {
        self.desk.under_way = None;
        match finished.end {
            Ok(ExperimentEnd::Finished(run)) => {
                let words =
                    if run.reached() { "event.experiment_reached" } else { "event.experiment_missed" };
                let weight = if run.reached() { Weight::Note } else { Weight::Caution };
                self.tell(weight, tr!(words, id = finished.id));
                self.desk.results.insert(finished.id, Arc::new(run));
            }
            Ok(ExperimentEnd::Cancelled) => {
                self.tell(Weight::Note, tr!("event.experiment_cancelled", id = finished.id));
            }
            Err(error) => self.refuse(i18n::say(&error)),
        }
    }

    /// Opens what was dropped on the window in this frame. A frame drawn twice brings the same drop twice.
    pub(super) fn take_dropped(&mut self, ui: &egui::Ui, actions: &mut Vec<Action>) {
        let files = ui.input(|i| i.raw.dropped_files.clone());
        let Some(dropped) = files.first().cloned() else { return };
        if self.dropped.as_ref().is_some_and(|known| std::sync::Arc::ptr_eq(known, &dropped)) {
            return;
        }
        let paths: Vec<PathBuf> = files.iter().map(|file| file.path().to_owned()).collect();
        actions.push(if paths.len() > 1 {
            Action::OpenLogs(paths)
        } else {
            Action::OpenFile(dropped.path().to_owned())
        });
        self.dropped = Some(dropped);
    }

    /// Takes what jobs came to.
    pub(super) fn take_results(&mut self, ctx: &egui::Context) {
        for outcome in self.jobs.results().into_iter().chain(self.beside.results()) {
            match outcome {
                Outcome::Runs(recorded) => self.take_runs(ctx, *recorded),
                Outcome::Log(paths, log, options) => {
                    let words = tr!("import_sheet.read", name = log.table.name, rows = log.table.len());
                    self.tell(Weight::Note, words);
                    self.import = Some(ImportSheet::new(paths, *log, options));
                }
                Outcome::Rig(path, network) => {
                    self.settings.remember(path);
                    self.act(ctx, Action::Document(DocumentCommand::OpenRig(network)));
                }
                Outcome::Experiment(path, experiment) => {
                    self.settings.remember(path);
                    self.desk.add(experiment);
                }
                Outcome::Ran(finished) => self.take_experiment(*finished),
                Outcome::Model(model) => self.act(ctx, Action::Document(DocumentCommand::AddModel(model))),
                Outcome::Chosen(path) => self.act(ctx, Action::OpenFile(path)),
                Outcome::Recorded(files, rows) => {
                    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
                    self.tell(Weight::Note, tr!("event.recorded", rows = rows, path = names.join(", ")));
                    self.recorded = files;
                }
                Outcome::Answered(question, reply) => self.answers.take(*question, *reply),
                Outcome::Cancelled => {}
                Outcome::NoDialog => self.path_field = Some(String::new()),
                Outcome::Failed(error) => {
                    self.answers.give_up();
                    let words = i18n::say(&*error);
                    self.tell(Weight::Alarm, words.clone());
                    self.notice = Some(words);
                }
            }
        }
    }

    /// The field for a path, where the system has no file dialog.
    pub(super) fn path_ui(&mut self, ui: &mut egui::Ui, actions: &mut Vec<Action>) {
        let Some(path) = &mut self.path_field else { return };
        let mut open = true;
        let mut chosen = false;
        egui::Window::new(tr!("window.path_title")).open(&mut open).collapsible(false).resizable(false).show(
            ui.ctx(),
            |ui| {
                ui.label(tr!("window.path_hint"));
                let field = ui.add(egui::TextEdit::singleline(path).desired_width(420.0));
                field.request_focus();
                chosen =
                    ui.input(|i| i.key_pressed(egui::Key::Enter)) || ui.button(tr!("window.open")).clicked();
            },
        );
        if chosen && !path.trim().is_empty() {
            actions.push(Action::OpenFile(PathBuf::from(path.trim())));
            open = false;
        }
        if !open {
            self.path_field = None;
        }
    }

    /// What the import sheet asks for.
    pub(super) fn import_ui(&mut self, ui: &mut egui::Ui, actions: &mut Vec<Action>) {
        let Some(mut sheet) = self.import.take() else { return };
        match sheet_ui(ui, &mut sheet) {
            Answer::None => self.import = Some(sheet),
            Answer::Use => {
                for repair in &sheet.log.report.repairs {
                    self.tell(Weight::Caution, i18n::say(repair));
                }
                sheet.paths.iter().for_each(|path| self.settings.remember(path.clone()));
                let table = std::sync::Arc::new(sheet.log.table);
                actions.push(Action::Document(DocumentCommand::OpenLog(table, sheet.roles)));
            }
            Answer::Cancel => {
                self.tell(Weight::Note, tr!("import_sheet.cancelled", name = sheet.log.table.name))
            }
            Answer::ReadAgain => {
                let (paths, options) = (sheet.paths.clone(), sheet.options.clone());
                self.jobs.start("import", move || read_log(&paths, &options));
            }
        }
    }
}

enum Answer {
    None,
    Use,
    Cancel,
    ReadAgain,
}

fn sheet_ui(ui: &mut egui::Ui, sheet: &mut ImportSheet) -> Answer {
    let mut answer = Answer::None;
    let modal = egui::Modal::new(egui::Id::unique("import")).show(ui.ctx(), |ui| {
        ui.set_max_width(760.0);
        ui.heading(tr!("import_sheet.title", name = sheet.log.table.name));
        facts(ui, sheet);
        ui.add_space(theme::GAP);
        egui::ScrollArea::horizontal().id_salt("preview").show(ui, |ui| preview(ui, sheet));
        ui.add_space(theme::GAP);
        ui.horizontal_wrapped(|ui| {
            let ImportSheet { log, roles, .. } = sheet;
            for (what, role) in [("PV", &mut roles.pv), ("SP", &mut roles.sp), ("MV", &mut roles.mv)] {
                column_choice(ui, what, role, &log.table, 130.0);
            }
            column_choice(ui, &tr!("import_sheet.mode"), &mut roles.mode, &log.table, 130.0);
        });
        if time_ui(ui, sheet) {
            answer = Answer::ReadAgain;
        }
        if sheet.log.report.time_column.is_none() {
            ui.horizontal(|ui| {
                let name = ui.label(tr!("import_sheet.sample_time"));
                let field =
                    egui::DragValue::new(&mut sheet.sample_time_s).range(1e-6..=1e6).speed(0.01).suffix(" s");
                ui.add(field).labelled_by(name.id);
                if ui.button(tr!("import_sheet.again")).clicked() {
                    sheet.options.sample_time_s = Some(sheet.sample_time_s);
                    answer = Answer::ReadAgain;
                }
            });
        }
        let p = theme::palette(ui);
        egui::ScrollArea::vertical().id_salt("repairs").max_height(110.0).show(ui, |ui| {
            for repair in &sheet.log.report.repairs {
                ui.add(
                    egui::Label::new(
                        egui::RichText::new(format!("! {}", i18n::say(repair))).color(p.caution),
                    )
                    .wrap(),
                );
            }
        });
        let same = sheet.roles.pv.is_some() && sheet.roles.pv == sheet.roles.mv;
        if same || sheet.roles.pv.is_none() || sheet.roles.mv.is_none() {
            let key = if same { "said.document.same_column" } else { "import_sheet.choose" };
            ui.label(egui::RichText::new(format!("! {}", tr!(key))).color(p.caution));
        }
        ui.add_space(theme::GAP);
        ui.horizontal(|ui| {
            let take = egui::Button::new(egui::RichText::new(tr!("import_sheet.use")).color(p.on_accent))
                .fill(p.accent);
            let enter = !same && ui.input(|i| i.key_pressed(egui::Key::Enter));
            if ui.add_enabled(!same, take).clicked() || enter {
                answer = Answer::Use;
            }
            if ui.button(tr!("import_sheet.cancel")).clicked() {
                answer = Answer::Cancel;
            }
        });
    });
    // A click beside the sheet must not throw away what was read.
    let escaped = modal.is_top_modal && ui.input(|i| i.key_pressed(egui::Key::Escape));
    if escaped && matches!(answer, Answer::None) { Answer::Cancel } else { answer }
}

/// What the user may change about the time: its column, and the order of day and month where dates read both ways. True
/// when the file is to be read again.
fn time_ui(ui: &mut egui::Ui, sheet: &mut ImportSheet) -> bool {
    let before = sheet.options.clone();
    let current = sheet.log.report.time_column.clone();
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(tr!("import_sheet.time_column"));
        let mut chosen = current.clone();
        egui::ComboBox::from_id_salt("time_column")
            .width(130.0)
            .truncate()
            .selected_text(current.clone().unwrap_or_else(|| tr!("import_sheet.none")))
            .show_ui(ui, |ui| {
                let numbers = sheet.log.table.columns.iter().filter(|c| c.states.is_empty());
                for name in current.iter().chain(numbers.map(|c| &c.name)) {
                    ui.selectable_value(&mut chosen, Some(name.clone()), name);
                }
            })
            .response
            .labelled_by(label.id);
        if chosen != current {
            sheet.options.time_column = chosen;
        }
        let doubt = sheet.log.report.repairs.iter().find_map(|repair| match repair {
            Repair::AmbiguousDates { month_first } => Some(*month_first),
            _ => None,
        });
        let other = match doubt {
            Some(false) => Some((tr!("import_sheet.month_first"), DateOrder::MonthFirst)),
            Some(true) => Some((tr!("import_sheet.day_first"), DateOrder::DayFirst)),
            None => None,
        };
        if let Some((words, order)) = other
            && ui.button(words).clicked()
        {
            sheet.options.date_order = Some(order);
        }
        let unsure = sheet.log.report.repairs.iter().any(|r| matches!(r, Repair::ThousandsOrDecimals { .. }));
        let other = match &sheet.log.report.format {
            FileFormat::Text(TextFormat { decimal: Decimal::Point, .. }) if unsure => {
                Some((tr!("import_sheet.decimal_comma"), Decimal::Comma))
            }
            FileFormat::Text(TextFormat { decimal: Decimal::Comma, .. }) if unsure => {
                Some((tr!("import_sheet.decimal_point"), Decimal::Point))
            }
            _ => None,
        };
        if let Some((words, mark)) = other
            && ui.button(words).clicked()
        {
            sheet.options.decimal = Some(mark);
        }
    });
    sheet.options != before
}

fn facts(ui: &mut egui::Ui, sheet: &ImportSheet) {
    let table = &sheet.log.table;
    let length_s = table.time_s.last().copied().unwrap_or(0.0);
    let time = sheet.log.report.time_column.clone().unwrap_or_else(|| tr!("import_sheet.no_time"));
    ui.label(tr!(
        "import_sheet.facts",
        rows = table.len(),
        columns = table.columns.len(),
        length = text::brief(length_s),
        time = time
    ));
}

fn preview(ui: &mut egui::Ui, sheet: &ImportSheet) {
    let table = &sheet.log.table;
    egui::Grid::new("preview").striped(true).spacing([14.0, 3.0]).show(ui, |ui| {
        ui.strong(tr!("import_sheet.time"));
        for (i, column) in table.columns.iter().enumerate() {
            let unit = column.unit.as_ref().map_or(String::new(), |u| format!(" [{u}]"));
            let role = [("PV", sheet.roles.pv), ("SP", sheet.roles.sp), ("MV", sheet.roles.mv)];
            let role = role
                .iter()
                .find(|(_, r)| *r == Some(i))
                .map_or(String::new(), |(name, _)| format!("  · {name}"));
            ui.strong(format!("{}{unit}{role}", column.name));
        }
        ui.end_row();
        for row in 0..PREVIEW_ROWS.min(table.len()) {
            ui.label(text::brief(table.time_s[row]));
            for column in &table.columns {
                let value = column.values[row];
                let state =
                    column.states.get(value as usize).filter(|_| !column.states.is_empty() && value >= 0.0);
                ui.label(state.cloned().unwrap_or_else(|| text::brief(value)));
            }
            ui.end_row();
        }
    });
}

/// A choice of a column, or of none.
pub fn column_choice(
    ui: &mut egui::Ui,
    what: &str,
    role: &mut Option<usize>,
    table: &vasos_engine::signal::LogTable,
    width: f32,
) -> bool {
    let before = *role;
    let none = tr!("import_sheet.none");
    let name = |i: usize| table.columns.get(i).map_or_else(|| none.clone(), |c| c.name.clone());
    let label = ui.label(egui::RichText::new(what).family(theme::bold()));
    let width = width.clamp(40.0, 160.0);
    egui::ComboBox::from_id_salt(what)
        .width(width)
        .truncate()
        .selected_text(role.map_or_else(|| none.clone(), name))
        .show_ui(ui, |ui| {
            ui.selectable_value(role, None, &none);
            for i in 0..table.columns.len() {
                ui.selectable_value(role, Some(i), name(i));
            }
        })
        .response
        .labelled_by(label.id);
    before != *role
}
