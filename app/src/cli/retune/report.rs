//! The report of a retuning.

use vasos_engine::control::{PidGains, proportional_band_percent, repeats_per_min};
use vasos_engine::explain::number;
use vasos_engine::identify::ModelFit;
use vasos_io::report::{Block, Cell, Report, Table, Tone};

use super::one::Outcome;
use super::{Task, answer, figures};
use crate::cli::identify;
use crate::cli::json::shown;

pub(super) fn of(outcome: &Outcome, task: &Task) -> Report {
    let mut blocks = Vec::new();
    let tone = if outcome.retuning.recommended.is_some() { Tone::Answer } else { Tone::No };
    blocks.push(Block::Note(tone, capital(&outcome.reason())));
    blocks.extend(outcome.warnings.iter().map(|w| Block::Note(Tone::Warning, capital(w))));
    to_type(outcome, task, &mut blocks);
    seen(outcome, &mut blocks);
    model(outcome, &mut blocks);
    compared(outcome, task, &mut blocks);
    Report {
        language: "en",
        title: format!("Retuning of {}", outcome.log.columns.pv),
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
    let stretch = format!(
        "{} rows, {} to {} s",
        rows.time_s.len(),
        second(rows.time_s.first()),
        second(rows.time_s.last())
    );
    let mut used = format!("PV {}, MV {}", columns.pv, columns.mv);
    for (role, name) in [("setpoint", &columns.sp), ("mode", &columns.mode)] {
        if let Some(name) = name {
            used.push_str(&format!(", {role} {name}"));
        }
    }
    [
        ("File", outcome.name.clone()),
        ("SHA-256", outcome.sha256.clone()),
        ("Stretch", stretch),
        ("Columns", used),
        ("Program", format!("Vasos {}", env!("CARGO_PKG_VERSION"))),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

/// The numbers in the units of controllers.
fn to_type(outcome: &Outcome, task: &Task, blocks: &mut Vec<Block>) {
    let Some(choice) = outcome.retuning.choice() else { return };
    blocks.push(Block::Heading("What to type into your controller".to_owned()));
    let present = outcome.retuning.present().and_then(|c| c.ideal());
    let mut rows = Vec::new();
    let mut row = |name: &str, value: Option<f64>, now: Option<f64>| {
        rows.push(vec![Cell::words(name), Cell::number(shown(value)), Cell::number(shown(now))]);
    };
    let has_derivative = choice.gains.kd != 0.0;
    if let Some(g) = choice.ideal() {
        let both = |f: &dyn Fn(&PidGains) -> f64| (Some(f(&g)), present.as_ref().map(f));
        let mut add = |name: &str, f: &dyn Fn(&PidGains) -> f64| {
            let (new, now) = both(f);
            row(name, new, now);
        };
        add("Kc (MV unit per PV unit)", &|g| g.kc);
        if let Some((mv, pv)) = task.spans {
            add("Proportional band (%)", &|g| proportional_band_percent(g.kc.abs(), mv, pv));
        }
        add("Ti (s)", &|g| g.ti_s);
        add("Ti (min)", &|g| g.ti_s / 60.0);
        add("Reset (repeats per minute)", &|g| repeats_per_min(g.ti_s));
        if has_derivative {
            add("Td (s)", &|g| g.td_s);
            add("Td (min)", &|g| g.td_s / 60.0);
            add("N, filter of the derivative Td/N", &|g| g.n);
        }
    }
    let now = outcome.retuning.present().map(|c| c.gains);
    row("Parallel form: Kp", Some(choice.gains.kp), now.map(|g| g.kp));
    row("Parallel form: Ki (1/s)", Some(choice.gains.ki), now.map(|g| g.ki));
    if has_derivative {
        row("Parallel form: Kd (s)", Some(choice.gains.kd), now.map(|g| g.kd));
        let series = answer::series(choice);
        let earlier = outcome.retuning.present().and_then(answer::series);
        row("Series form: Kc", series.map(|s| s.kc), earlier.map(|s| s.kc));
        row("Series form: Ti (s)", series.map(|s| s.ti_s), earlier.map(|s| s.ti_s));
        row("Series form: Td (s)", series.map(|s| s.td_s), earlier.map(|s| s.td_s));
    }
    let head = ["", "recommended", "present"].map(str::to_owned).to_vec();
    blocks.push(Block::Table(Table { head, rows, marked: None }));
    let action = choice.ideal().map_or("reverse", |g| answer::action(&g));
    let band =
        if task.spans.is_none() { " Give --pv-span and --mv-span for a proportional band." } else { "" };
    blocks.push(Block::Paragraph(format!(
        "{}, ideal form unless said otherwise; for a PI ideal and series are the same. Action: {action}. Gains are in engineering units of the log.{band}",
        capital(&answer::title(choice))
    )));
}

fn seen(outcome: &Outcome, blocks: &mut Vec<Block>) {
    blocks.push(Block::Heading("What was seen".to_owned()));
    let findings = outcome.study.findings.iter().filter(|f| !f.is_warning()).map(|f| capital(&f.to_string()));
    let mut lines: Vec<String> = findings.chain(outcome.repairs.iter().map(|r| capital(r))).collect();
    if let Some(c) = &outcome.study.controller {
        let times: String = [("Ti", c.ti_s), ("Td", c.td_s)]
            .into_iter()
            .filter_map(|(name, value)| Some(format!(", {name} = {} s", number(value?))))
            .collect();
        lines.push(format!(
            "A controller is at work with Kc = {}{times}; that explains {} % of the MV's moves.",
            number(c.kc),
            number((100.0 * c.r2).round())
        ));
    }
    if lines.is_empty() {
        blocks.push(Block::Paragraph("Nothing out of the ordinary.".to_owned()));
    } else {
        blocks.push(Block::List(lines));
    }
    let caption = "The log. The model's free run is driven by the MV alone and never sees the PV.";
    blocks.push(Block::Figure(figures::data(outcome), caption.to_owned()));
}

fn model(outcome: &Outcome, blocks: &mut Vec<Block>) {
    let (Ok(choice), true) = (&outcome.study.choice, outcome.study.has_model()) else { return };
    let fit: &ModelFit = choice.chosen();
    blocks.push(Block::Heading("Model".to_owned()));
    let mut lines = identify::model_rows(fit).into_iter();
    let head = lines.next().unwrap_or_default();
    let mut rows: Vec<Vec<Cell>> = lines
        .map(|r| {
            r.into_iter()
                .enumerate()
                .map(|(i, t)| if i == 0 { Cell::words(t) } else { Cell::number(t) })
                .collect()
        })
        .collect();
    let of_fit = vec![Cell::words("fit (%)"), Cell::number(number(fit.fit_percent)), Cell::number("")];
    rows.push(of_fit);
    blocks.push(Block::Table(Table { head, rows, marked: None }));
    blocks.push(Block::Paragraph(capital(&fit.verdict().to_string())));
}

fn compared(outcome: &Outcome, task: &Task, blocks: &mut Vec<Block>) {
    let retuning = &outcome.retuning;
    let Some(model) = retuning.model.as_ref().filter(|_| !retuning.candidates.is_empty()) else { return };
    blocks.push(Block::Heading("Tunings compared".to_owned()));
    let cells = |words: Vec<String>| -> Vec<Cell> {
        let cell = |(i, t)| if i == 0 { Cell::words(t) } else { Cell::number(t) };
        words.into_iter().enumerate().map(cell).collect()
    };
    let worth = Table {
        head: answer::HEAD[..11].iter().map(|h| (*h).to_owned()).collect(),
        rows: retuning.candidates.iter().map(|c| cells(answer::row(c)[..11].to_vec())).collect(),
        marked: retuning.recommended,
    };
    blocks.push(Block::Table(worth));
    let safety = Table {
        head: [
            "over the model's uncertainty",
            "unstable (%)",
            "Ms 5 %",
            "Ms 50 %",
            "Ms 95 %",
            "gain margin",
            "phase margin (°)",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: retuning.candidates.iter().map(|c| cells(safety(c))).collect(),
        marked: retuning.recommended,
    };
    blocks.push(Block::Table(safety));
    blocks.push(Block::Paragraph(format!(
        "Ms and Mt: largest |1/(1 + L)| and |L/(1 + L)|. Ju: how much noise of the PV moves the MV. Jv: how much a slow load moves the PV. IAE of a step of 1 of the load at the MV and of the setpoint. The uncertainty is {} models drawn from what the log leaves open.",
        retuning.draws.len()
    )));
    let caption = "Step responses with the model; the shaded band holds the middle 90 % of the models for the recommended tuning.";
    blocks.push(Block::Figure(figures::steps(model, retuning), caption.to_owned()));
    let mut charts = vec![figures::nyquist(model, retuning, &task.options.limits)];
    charts.extend(figures::trade_off(model, retuning, &task.options.limits, task.options.controller));
    let caption = "Left: Nyquist curves stay out of the circle where they keep the limit on Ms. Right: what Jv can be for each Ms; no tuning lies below the curve.";
    blocks.push(Block::Figure(charts, caption.to_owned()));
}

fn safety(one: &vasos_engine::retune::Candidate) -> Vec<String> {
    let spread = one.spread.as_ref();
    let mut row = vec![answer::title(one)];
    row.push(shown(one.unstable_share().map(|s| 100.0 * s)));
    row.extend([spread.map(|s| s.ms.low), spread.map(|s| s.ms.middle), spread.map(|s| s.ms.high)].map(shown));
    row.extend([one.analysis.gain_margin, one.analysis.phase_margin_deg].map(shown));
    row
}
