//! One log: read, studied, tuned for.

use std::path::Path;

use vasos_engine::explain::Explain;
use vasos_engine::identify::{LoopStudy, study_loop};
use vasos_engine::retune::{LoopSigns, Retuning, retune};
use vasos_io::log::sha256_of_file;

use super::{Arguments, Task, answer, output, report};
use crate::cli::log_columns::LoadedLog;
use crate::cli::{Answer, Refusal};
use crate::{i18n, tr};

/// All that came of one log.
pub(super) struct Outcome {
    /// Name of the file, without its folder.
    pub name: String,
    pub sha256: String,
    pub log: LoadedLog,
    pub study: LoopStudy,
    pub retuning: Retuning,
}

impl Outcome {
    pub fn of(path: &Path, task: &Task) -> Result<Self, Refusal> {
        let log = LoadedLog::read(&[path], task.columns)?;
        let record = log.record();
        let study = study_loop(&record, &task.columns.study_options()?).map_err(Refusal::of)?;
        let signs = LoopSigns::of(record.problem.time_s, record.problem.mv, record.sp);
        let retuning = retune(&study, &signs, &task.options).map_err(Refusal::of)?;
        drop(record);
        let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let sha256 = sha256_of_file(path)
            .map_err(|error| Refusal(format!("{} cannot be read: {error}", path.display())))?;
        Ok(Self { name, sha256, log, study, retuning })
    }

    /// The answer in words of the present language.
    pub fn reason(&self) -> String {
        self.retuning.advice.first().map_or_else(String::new, |advice| i18n::say(advice))
    }

    /// Everything to heed, the most important first; not the answer itself.
    pub fn warnings(&self) -> Vec<String> {
        let mut said: Vec<&dyn Explain> = Vec::new();
        said.extend(self.retuning.advice.iter().skip(1).map(|a| a as &dyn Explain));
        said.extend(self.study.findings.iter().filter(|f| f.is_warning()).map(|f| f as &dyn Explain));
        if let (Ok(choice), true) = (&self.study.choice, self.study.has_model()) {
            let objections = choice.chosen().verdicts.iter().filter(|v| v.is_objection());
            said.extend(objections.map(|v| v as &dyn Explain));
        }
        let mut warnings: Vec<String> = said.into_iter().map(i18n::say).collect();
        let left_out = self.log.stretch.rows.left_out.len();
        if left_out > 0 {
            warnings.push(tr!("retuning.left_out", rows = left_out));
        }
        warnings
    }

    /// What was done to the file's text.
    pub fn repairs(&self) -> Vec<String> {
        self.log.imported.report.repairs.iter().map(|repair| i18n::say(repair)).collect()
    }
}

pub(super) fn run(arguments: &Arguments, task: &Task) -> Result<Answer, Refusal> {
    if let Some(path) = &arguments.output {
        output::check(path, &arguments.log)?;
        output::check_html(path)?;
    }
    let outcome = Outcome::of(&arguments.log, task)?;
    if let Some(path) = &arguments.output {
        output::write(path, &report::of(&outcome, task).html())?;
    }
    let status = u8::from(outcome.retuning.recommended.is_none());
    let remarks = if status == 1 { vec![outcome.reason()] } else { vec![] };
    let text = if arguments.json { answer::json(&outcome, task) } else { answer::text(&outcome) };
    Ok(Answer { text, remarks, status })
}
