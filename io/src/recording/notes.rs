//! What is kept with a run besides its signals: models with their fits, Nyquist curves.

use rerun::{Color, LineStrips2D, Points2D, RecordingStream, Scalars, SeriesLines, TextDocument, TimeColumn};
use vasos_engine::model::ProcessModel;

use super::layout::{FITS, MODELS, NYQUIST, TIME};
use super::seal::sealed;
use super::told::ToldModel;

/// A model that came into use, with the fit that gave it.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelNote {
    /// Number in its list, for names.
    pub number: u32,
    /// What is shown of it, Markdown.
    pub words: String,
    /// The model.
    pub model: ProcessModel,
    /// Unit of its PV.
    pub pv_unit: String,
    /// Unit of its MV.
    pub mv_unit: String,
    /// Rows of the fit: time in seconds of the run, PV as measured, PV as the model has it.
    pub rows: Vec<[f64; 3]>,
}

/// A loop's Nyquist curve.
#[derive(Debug, Clone, PartialEq)]
pub struct NyquistNote {
    /// Whose it is.
    pub words: String,
    /// Real and imaginary parts of L(jω), by rising frequency; points that are no numbers part the curve.
    pub curve: Vec<[f64; 2]>,
    /// Largest sensitivity of the loop, for the circle that the curve touches; `None` where it is unstable.
    pub ms: Option<f64>,
}

/// Something to be kept with a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// A model came into use.
    Model(ModelNote),
    /// A loop has another Nyquist curve.
    Nyquist(NyquistNote),
}

type LogResult = Result<(), Box<dyn std::error::Error>>;

/// Component of [`MODELS`] with the model as a replay reads it.
pub(super) const MODEL: &str = "model";
/// Points of a circle.
const CIRCLE: usize = 128;
/// Part of the plane that is of use around −1.
const FRAME: f64 = 3.0;

/// Logs what a viewer shows of a note at a time of the run, in seconds.
pub(super) fn log(stream: &RecordingStream, note: &Note, time_s: f64) -> LogResult {
    match note {
        Note::Model(note) => log_fit(stream, note),
        Note::Nyquist(note) => log_nyquist(stream, note, time_s),
    }
}

/// Logs the model of a note, which every further part of the recording needs.
pub(super) fn log_model(stream: &RecordingStream, note: &ModelNote, time_s: f64) -> LogResult {
    stream.set_duration_secs(TIME, time_s);
    let told =
        ToldModel { pv_unit: note.pv_unit.clone(), mv_unit: note.mv_unit.clone(), model: note.model.clone() };
    stream.log(MODELS, &TextDocument::from_markdown(note.words.as_str()))?;
    let told = rerun::AnyValues::default()
        .with_component::<rerun::components::Text>(MODEL, [sealed(&toml::to_string(&told)?, &[])]);
    stream.log(MODELS, &told)?;
    stream.reset_time();
    Ok(())
}

/// Logs the rows of a fit.
fn log_fit(stream: &RecordingStream, note: &ModelNote) -> LogResult {
    if note.rows.is_empty() {
        return Ok(());
    }
    let entity = format!("{FITS}/model_{}", note.number);
    let names = ["measured", "model"].map(|what| format!("model {}, {what} ({})", note.number, note.pv_unit));
    let lines = SeriesLines::new()
        .with_names(names)
        .with_colors([Color::from_rgb(80, 170, 240), Color::from_rgb(240, 170, 50)])
        .with_widths([1.8_f32, 1.8]);
    stream.log_static(entity.as_str(), &lines)?;
    let time = TimeColumn::new_duration_secs(TIME, note.rows.iter().map(|row| row[0]));
    let scalars = Scalars::new(note.rows.iter().flat_map(|row| [row[1], row[2]]));
    let columns = scalars.columns(std::iter::repeat_n(2, note.rows.len()))?;
    Ok(stream.send_columns(entity.as_str(), [time], columns)?)
}

/// The curve with the unit circle, the point −1 and the circle of Ms around it; y of the viewer points down.
fn log_nyquist(stream: &RecordingStream, note: &NyquistNote, time_s: f64) -> LogResult {
    stream.set_duration_secs(TIME, time_s);
    let mut strips: Vec<Vec<[f32; 2]>> = vec![];
    let mut strip = vec![];
    for &[re, im] in &note.curve {
        if re.is_finite() && im.is_finite() && re.abs() <= FRAME && im.abs() <= FRAME {
            strip.push([re as f32, -im as f32]);
        } else if !strip.is_empty() {
            strips.push(std::mem::take(&mut strip));
        }
    }
    strips.push(strip);
    strips.retain(|strip| strip.len() > 1);
    let count = strips.len();
    let labels = (0..count).map(|i| if i == 0 { note.words.as_str() } else { "" });
    let curve = LineStrips2D::new(strips)
        .with_colors(vec![Color::from_rgb(80, 170, 240); count])
        .with_radii(vec![0.008_f32; count])
        .with_labels(labels);
    stream.log(format!("{NYQUIST}/curve"), &curve)?;
    let circle = |radius: f64| -> Vec<[f32; 2]> {
        let at = |k: usize| std::f64::consts::TAU * k as f64 / CIRCLE as f64;
        (0..=CIRCLE).map(|k| [(-1.0 + radius * at(k).cos()) as f32, (radius * at(k).sin()) as f32]).collect()
    };
    let unit: Vec<[f32; 2]> = circle(1.0).iter().map(|[x, y]| [x + 1.0, *y]).collect();
    let unit =
        LineStrips2D::new([unit]).with_colors([Color::from_rgb(120, 125, 135)]).with_radii([0.004_f32]);
    stream.log(format!("{NYQUIST}/unit_circle"), &unit)?;
    if let Some(ms) = note.ms.filter(|ms| ms.is_finite() && *ms > 0.0) {
        let ring = LineStrips2D::new([circle(1.0 / ms)])
            .with_colors([Color::from_rgb(240, 120, 130)])
            .with_radii([0.004_f32])
            .with_labels([format!("Ms {ms:.2}")]);
        stream.log(format!("{NYQUIST}/ms"), &ring)?;
    } else {
        stream.log(format!("{NYQUIST}/ms"), &rerun::Clear::flat())?;
    }
    let point =
        Points2D::new([[-1.0_f32, 0.0]]).with_colors([Color::from_rgb(240, 120, 130)]).with_radii([0.03_f32]);
    stream.log(format!("{NYQUIST}/critical"), &point)?;
    stream.reset_time();
    Ok(())
}
