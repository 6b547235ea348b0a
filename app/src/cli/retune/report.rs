//! The report of a retuning.

use vasos_engine::control::{PidGains, proportional_band_percent, repeats_per_min};
use vasos_engine::explain::number;
use vasos_engine::identify::ModelFit;
use vasos_io::report::{Block, Cell, Report, Table, Tone};

use super::one::Outcome;
use super::{Task, answer, figures};
use crate::cli::identify;
use crate::cli::json::shown;
use crate::i18n::{self, Language};
use crate::tr;

/// The report in the language that was asked for; what is printed stays English.
pub(super) fn of(outcome: &Outcome, task: &Task) -> Report {
    in_its_language(task, || in_language(outcome, task))
}

/// What is said in the language of the reports.
pub(super) fn in_its_language<T>(task: &Task, say: impl FnOnce() -> T) -> T {
    i18n::set(task.language);
    let said = say();
    i18n::set(Language::English);
    said
}

fn in_language(outcome: &Outcome, task: &Task) -> Report {
    let mut blocks = Vec::new();
    let tone = if outcome.retuning.recommended.is_some() { Tone::Answer } else { Tone::No };
    blocks.push(Block::Note(tone, capital(&outcome.reason())));
    blocks.extend(outcome.warnings().iter().map(|w| Block::Note(Tone::Warning, capital(w))));
    to_type(outcome, task, &mut blocks);
    seen(outcome, &mut blocks);
    model(outcome, &mut blocks);
    compared(outcome, task, &mut blocks);
    Report {
        language: task.language.tag(),
        title: tr!("retuning.title", name = outcome.log.columns.pv),
        provenance: provenance(outcome),
        blocks,
    }
}

fn capital(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn provenance(outcome: &Outcome) -> Vec<(String, String)> {
    let rows = &outcome.log.stretch.rows;
    let columns = &outcome.log.columns;
    let second = |t: Option<&f64>| t.map_or_else(String::new, |t| number(*t));
    let stretch = tr!(
        "retuning.stretch_rows",
        rows = rows.time_s.len(),
        from = second(rows.time_s.first()),
        to = second(rows.time_s.last())
    );
    let mut used = format!("PV {}, MV {}", columns.pv, columns.mv);
    for (role, name) in [(tr!("retuning.setpoint"), &columns.sp), (tr!("retuning.mode"), &columns.mode)] {
        if let Some(name) = name {
            used.push_str(&format!(", {role} {name}"));
        }
    }
    [
        (tr!("retuning.file"), outcome.name.clone()),
        ("SHA-256".to_owned(), outcome.sha256.clone()),
        (tr!("retuning.stretch"), stretch),
        (tr!("retuning.columns"), used),
        (tr!("retuning.program"), format!("Vasos {}", env!("CARGO_PKG_VERSION"))),
    ]
    .to_vec()
}

/// The numbers in the units of controllers.
fn to_type(outcome: &Outcome, task: &Task, blocks: &mut Vec<Block>) {
    let Some(choice) = outcome.retuning.choice() else { return };
    blocks.push(Block::Heading(tr!("retuning.to_type")));
    let present = outcome.retuning.present().and_then(|c| c.ideal());
    let mut rows = Vec::new();
    let mut row = |name: String, value: Option<f64>, now: Option<f64>| {
        rows.push(vec![Cell::words(name), Cell::number(shown(value)), Cell::number(shown(now))]);
    };
    let has_derivative = choice.gains.kd != 0.0;
    if let Some(g) = choice.ideal() {
        let both = |f: &dyn Fn(&PidGains) -> f64| (Some(f(&g)), present.as_ref().map(f));
        let mut add = |name: String, f: &dyn Fn(&PidGains) -> f64| {
            let (new, now) = both(f);
            row(name, new, now);
        };
        add(tr!("retuning.kc"), &|g| g.kc);
        if let Some((mv, pv)) = task.spans {
            add(tr!("retuning.band"), &|g| proportional_band_percent(g.kc.abs(), mv, pv));
        }
        add("Ti (s)".to_owned(), &|g| g.ti_s);
        add("Ti (min)".to_owned(), &|g| g.ti_s / 60.0);
        add(tr!("retuning.reset"), &|g| repeats_per_min(g.ti_s));
        if has_derivative {
            add("Td (s)".to_owned(), &|g| g.td_s);
            add("Td (min)".to_owned(), &|g| g.td_s / 60.0);
            add(tr!("retuning.filter_n"), &|g| g.n);
        }
    }
    let now = outcome.retuning.present().map(|c| c.gains);
    row(tr!("retuning.parallel_kp"), Some(choice.gains.kp), now.map(|g| g.kp));
    row(tr!("retuning.parallel_ki"), Some(choice.gains.ki), now.map(|g| g.ki));
    if has_derivative {
        row(tr!("retuning.parallel_kd"), Some(choice.gains.kd), now.map(|g| g.kd));
        let series = answer::series(choice);
        let earlier = outcome.retuning.present().and_then(answer::series);
        row(tr!("retuning.series_kc"), series.map(|s| s.kc), earlier.map(|s| s.kc));
        row(tr!("retuning.series_ti"), series.map(|s| s.ti_s), earlier.map(|s| s.ti_s));
        row(tr!("retuning.series_td"), series.map(|s| s.td_s), earlier.map(|s| s.td_s));
    }
    let head = vec![String::new(), tr!("retuning.recommended"), tr!("retuning.present")];
    blocks.push(Block::Table(Table { head, rows, marked: None }));
    let action = match choice.ideal().map_or("reverse", |g| answer::action(&g)) {
        "direct" => tr!("retuning.direct"),
        _ => tr!("retuning.reverse"),
    };
    let mut words = tr!("retuning.forms", tuning = capital(&answer::title(choice)), action = action);
    if task.spans.is_none() {
        words.push_str(&format!(" {}", tr!("retuning.give_spans")));
    }
    blocks.push(Block::Paragraph(words));
}

fn seen(outcome: &Outcome, blocks: &mut Vec<Block>) {
    blocks.push(Block::Heading(tr!("retuning.seen")));
    let findings = outcome.study.findings.iter().filter(|f| !f.is_warning()).map(|f| capital(&i18n::say(f)));
    let mut lines: Vec<String> = findings.chain(outcome.repairs().iter().map(|r| capital(r))).collect();
    if let Some(c) = &outcome.study.controller {
        let times: String = [("Ti", c.ti_s), ("Td", c.td_s)]
            .into_iter()
            .filter_map(|(name, value)| Some(format!(", {name} = {} s", number(value?))))
            .collect();
        lines.push(tr!(
            "retuning.at_work",
            kc = number(c.kc),
            times = times,
            percent = number((100.0 * c.r2).round())
        ));
    }
    if lines.is_empty() {
        blocks.push(Block::Paragraph(tr!("retuning.ordinary")));
    } else {
        blocks.push(Block::List(lines));
    }
    blocks.push(Block::Figure(figures::data(outcome), tr!("retuning.caption_data")));
}

fn model(outcome: &Outcome, blocks: &mut Vec<Block>) {
    let (Ok(choice), true) = (&outcome.study.choice, outcome.study.has_model()) else { return };
    let fit: &ModelFit = choice.chosen();
    blocks.push(Block::Heading(tr!("retuning.model")));
    let mut lines = identify::model_rows(fit).into_iter();
    let structure = lines.next().unwrap_or_default().into_iter().next().unwrap_or_default();
    let head = vec![structure, String::new(), tr!("retuning.interval")];
    // What is printed says its intervals in English.
    let between = format!(" {} ", tr!("retuning.to"));
    let mut rows: Vec<Vec<Cell>> = lines
        .map(|r| {
            r.into_iter()
                .enumerate()
                .map(|(i, t)| if i == 0 { Cell::words(t) } else { Cell::number(t.replace(" to ", &between)) })
                .collect()
        })
        .collect();
    let of_fit =
        vec![Cell::words(tr!("retuning.fit")), Cell::number(number(fit.fit_percent)), Cell::number("")];
    rows.push(of_fit);
    blocks.push(Block::Table(Table { head, rows, marked: None }));
    blocks.push(Block::Paragraph(capital(&i18n::say(fit.verdict()))));
}

fn compared(outcome: &Outcome, task: &Task, blocks: &mut Vec<Block>) {
    let retuning = &outcome.retuning;
    let Some(model) = retuning.model.as_ref().filter(|_| !retuning.candidates.is_empty()) else { return };
    blocks.push(Block::Heading(tr!("retuning.compared")));
    let cells = |words: Vec<String>| -> Vec<Cell> {
        let cell = |(i, t)| if i == 0 { Cell::words(t) } else { Cell::number(t) };
        words.into_iter().enumerate().map(cell).collect()
    };
    let worth = Table {
        head: answer::head()[..11].to_vec(),
        rows: retuning.candidates.iter().map(|c| cells(answer::row(c)[..11].to_vec())).collect(),
        marked: retuning.recommended,
    };
    blocks.push(Block::Table(worth));
    let safety = Table {
        head: vec![
            tr!("retuning.over_uncertainty"),
            tr!("retuning.unstable"),
            "Ms 5 %".to_owned(),
            "Ms 50 %".to_owned(),
            "Ms 95 %".to_owned(),
            tr!("retuning.gain_margin"),
            tr!("retuning.phase_margin"),
        ],
        rows: retuning.candidates.iter().map(|c| cells(safety(c))).collect(),
        marked: retuning.recommended,
    };
    blocks.push(Block::Table(safety));
    blocks.push(Block::Paragraph(tr!("retuning.measures", draws = retuning.draws.len())));
    blocks.push(Block::Figure(figures::steps(model, retuning), tr!("retuning.caption_steps")));
    let mut charts = vec![figures::nyquist(model, retuning, &task.options.limits)];
    charts.extend(figures::trade_off(model, retuning, &task.options.limits, task.options.controller));
    blocks.push(Block::Figure(charts, tr!("retuning.caption_loops")));
}

fn safety(one: &vasos_engine::retune::Candidate) -> Vec<String> {
    let spread = one.spread.as_ref();
    let mut row = vec![answer::title(one)];
    row.push(shown(one.unstable_share().map(|s| 100.0 * s)));
    row.extend([spread.map(|s| s.ms.low), spread.map(|s| s.ms.middle), spread.map(|s| s.ms.high)].map(shown));
    row.extend([one.analysis.gain_margin, one.analysis.phase_margin_deg].map(shown));
    row
}
