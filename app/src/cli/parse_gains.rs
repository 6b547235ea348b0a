//! Gains in any form as they stand on the command line, and a controller's own way to show them.

use vasos_engine::control::{
    Form, FormGains, Mapping, ParallelGains, PidGains, PidTuning, Scale, SeriesGains, ShownGains,
    kc_of_proportional_band, repeats_per_min, repeats_per_s,
};

use super::parse::{ParseError, Parts, number};

/// The ways to write gains of the ideal and the series form, for messages.
const IDEAL_FORM: &str = "Kc=.. or PB=..[,Ti=.. or Ti_min=.. or repeats_per_min=.. or repeats_per_s=..][,Td=.. or Td_min=..][,N=..]";
/// The way to write gains of the parallel form, for messages.
const PARALLEL_FORM: &str = "Kp=..[,Ki=..][,Kd=..][,Tf=..]";
/// The way to write what a controller of the user's own shows, for messages.
const SHOWN_FORM: &str = "gain=..,integral=..,derivative=..,filter=..";
/// The way to write a mapping, for messages.
const MAPPING_FORM: &str = "base=ideal|parallel|series,gain=F,integral=F,derivative=F,filter=F with F a factor, or /F where the controller shows F divided by the value";
/// The way to write a tuning, for messages.
const TUNING_FORM: &str = "Kc=..,Ti=..[,Td=..][,N=..][,b=..][,c=..]";
/// What a proportional band needs beside it, for messages.
const SPANS_FORM: &str = "--mv-span and --pv-span beside a proportional band PB";

/// Spans of MV and PV in their units.
pub(super) type Spans = Option<(f64, f64)>;

/// Gains in a form; times in seconds unless the name says otherwise.
pub(super) fn form_gains(text: &str, form: Form, spans: Spans) -> Result<FormGains, ParseError> {
    if form == Form::Parallel {
        let mut parts = Parts::of(text, PARALLEL_FORM)?;
        let kp = parts.needed("Kp")?;
        let mut other = |name| Ok(parts.optional(name)?.unwrap_or(0.0));
        let (ki, kd, tf_s) = (other("Ki")?, other("Kd")?, other("Tf")?);
        parts.end()?;
        return Ok(FormGains::Parallel(ParallelGains { kp, ki, kd, tf_s }));
    }
    let mut parts = Parts::of(text, IDEAL_FORM)?;
    let kc = match parts.optional("PB")? {
        Some(percent) => {
            let (mv, pv) = spans.ok_or(ParseError::Missing { name: "--mv-span", form: SPANS_FORM })?;
            kc_of_proportional_band(percent, mv, pv)
        }
        None => parts.needed("Kc")?,
    };
    let ti_s = if let Some(minutes) = parts.optional("Ti_min")? {
        60.0 * minutes
    } else if let Some(rate) = parts.optional("repeats_per_min")? {
        repeats_per_min(rate)
    } else if let Some(rate) = parts.optional("repeats_per_s")? {
        repeats_per_s(rate)
    } else {
        parts.optional("Ti")?.unwrap_or(f64::INFINITY)
    };
    let td_s = match parts.optional("Td_min")? {
        Some(minutes) => 60.0 * minutes,
        None => parts.optional("Td")?.unwrap_or(0.0),
    };
    let n = parts.optional("N")?.unwrap_or(PidGains::DEFAULT_N);
    parts.end()?;
    Ok(if form == Form::Ideal {
        FormGains::Ideal(PidGains { kc, ti_s, td_s, n })
    } else {
        FormGains::Series(SeriesGains { kc, ti_s, td_s, n })
    })
}

/// What a controller of the user's own shows.
pub(super) fn shown_gains(text: &str) -> Result<ShownGains, ParseError> {
    let mut parts = Parts::of(text, SHOWN_FORM)?;
    let shown = ShownGains {
        gain: parts.needed("gain")?,
        integral: parts.needed("integral")?,
        derivative: parts.needed("derivative")?,
        filter: parts.needed("filter")?,
    };
    parts.end()?;
    Ok(shown)
}

/// A form by its name.
pub(super) fn form(name: &str) -> Option<Form> {
    Form::ALL.into_iter().find(|form| form.id() == name)
}

/// A controller's own way to show its gains.
pub(super) fn mapping(text: &str) -> Result<Mapping, ParseError> {
    let mut parts = Parts::of(text, MAPPING_FORM)?;
    let base = parts.text("base").ok_or(ParseError::Missing { name: "base", form: MAPPING_FORM })?;
    let base = form(base).ok_or(ParseError::UnknownName { name: base.to_owned(), form: MAPPING_FORM })?;
    let mut scale = |name: &'static str| {
        let text = parts.text(name).ok_or(ParseError::Missing { name, form: MAPPING_FORM })?;
        match text.strip_prefix('/') {
            Some(rest) => number(name, rest).map(Scale::Over),
            None => number(name, text).map(Scale::Times),
        }
    };
    let [gain, integral, derivative, filter] =
        [scale("gain")?, scale("integral")?, scale("derivative")?, scale("filter")?];
    parts.end()?;
    Mapping { base, gain, integral, derivative, filter }.validated().map_err(ParseError::Gains)
}

/// Gains of the ideal form with setpoint weights; b is 1, c is 0, N is 10 unless given.
pub(super) fn tuning(text: &str) -> Result<PidTuning, ParseError> {
    let mut parts = Parts::of(text, TUNING_FORM)?;
    let kc = parts.needed("Kc")?;
    let ti_s = parts.optional("Ti")?.unwrap_or(f64::INFINITY);
    let td_s = parts.optional("Td")?.unwrap_or(0.0);
    let n = parts.optional("N")?.unwrap_or(PidGains::DEFAULT_N);
    let b = parts.optional("b")?.unwrap_or(1.0);
    let c = parts.optional("c")?.unwrap_or(0.0);
    parts.end()?;
    Ok(PidTuning { gains: PidGains { kc, ti_s, td_s, n }, b, c })
}
