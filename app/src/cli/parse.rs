//! Models and gains as they stand on the command line: `K=4.9,T=152,L=2`, `Kc=7,Ti=15,Td=1,N=10`, `Ku=10,Pu=8`.

use std::fmt;

use vasos_engine::control::{GainsError, ParallelGains, PidGains};
use vasos_engine::explain::Explain;
use vasos_engine::model::{Fopdt, Ipdt, ModelError, ProcessModel, Sopdt};
use vasos_engine::tune::{RuleError, Ultimate};

/// The ways to write a model, for messages.
pub const MODEL_FORMS: &str =
    "K=..,T=..,L=..  or  Kv=..,L=..  or  K=..,T1=..,T2=..,L=..[,Tz=..]  or  num=1 2,den=1 3 3 1,L=0";
/// The way to write gains, for messages.
pub const GAINS_FORM: &str = "Kc=..[,Ti=..][,Td=..][,N=..]";
/// The ways to write gains where the parallel form is taken as well, for messages.
pub const ANY_GAINS_FORM: &str = "Kc=..[,Ti=..][,Td=..][,N=..]  or  Kp=..,Ki=..[,Kd=..,Tf=..]";
/// The way to write a limit of oscillation, for messages.
pub const ULTIMATE_FORM: &str = "Ku=..,Pu=..";

/// What is wrong with a model or gains on the command line.
#[derive(Debug, Clone, PartialEq)]
pub enum ParseError {
    /// A part without `=`.
    NoEquals {
        /// Part as typed.
        part: String,
        /// What was expected.
        form: &'static str,
    },
    /// A name that does not belong here.
    UnknownName {
        /// Name as typed.
        name: String,
        /// What was expected.
        form: &'static str,
    },
    /// A value that is no number.
    NotANumber {
        /// Name.
        name: String,
        /// Value as typed.
        text: String,
    },
    /// A name given twice.
    Twice {
        /// Name.
        name: String,
    },
    /// A name that is needed.
    Missing {
        /// Name.
        name: &'static str,
        /// What was expected.
        form: &'static str,
    },
    /// A number that no controller can have there.
    OutOfRange {
        /// Name.
        name: &'static str,
        /// Value as given.
        value: f64,
    },
    /// The numbers are no model.
    Model(ModelError),
    /// The numbers are no gains.
    Gains(GainsError),
    /// The numbers are no limit of oscillation.
    Ultimate(RuleError),
}

impl fmt::Display for ParseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoEquals { part, form } => {
                write!(f, "'{part}' is not of the form NAME=NUMBER (decimals with a point): write {form}")
            }
            Self::UnknownName { name, form } => write!(f, "'{name}' is not known here: write {form}"),
            Self::NotANumber { name, text } => {
                write!(f, "{name} = '{text}' is not a number: write decimals with a point, as in 4.9")
            }
            Self::Twice { name } => write!(f, "{name} is given twice: leave one out"),
            Self::Missing { name, form } => write!(f, "{name} is missing: write {form}"),
            Self::OutOfRange { name, value } => {
                write!(
                    f,
                    "{name} = {value} is not usable: it must be finite, and Tf greater than 0 beside a Kd"
                )
            }
            Self::Model(error) => error.fmt(f),
            Self::Gains(error) => error.fmt(f),
            Self::Ultimate(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ParseError {}

impl Explain for ParseError {
    fn key(&self) -> &'static str {
        match self {
            Self::NoEquals { .. } => "cli.no_equals",
            Self::UnknownName { .. } => "cli.unknown_name",
            Self::NotANumber { .. } => "cli.not_a_number",
            Self::Twice { .. } => "cli.twice",
            Self::Missing { .. } => "cli.missing",
            Self::OutOfRange { .. } => "cli.out_of_range",
            Self::Model(error) => error.key(),
            Self::Gains(error) => error.key(),
            Self::Ultimate(error) => error.key(),
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::NoEquals { part, form } => vec![("part", part.clone()), ("form", (*form).to_owned())],
            Self::UnknownName { name, form } => vec![("name", name.clone()), ("form", (*form).to_owned())],
            Self::NotANumber { name, text } => vec![("name", name.clone()), ("text", text.clone())],
            Self::Twice { name } => vec![("name", name.clone())],
            Self::Missing { name, form } => {
                vec![("name", (*name).to_owned()), ("form", (*form).to_owned())]
            }
            Self::OutOfRange { name, value } => {
                vec![("name", (*name).to_owned()), ("value", value.to_string())]
            }
            Self::Model(error) => error.args(),
            Self::Gains(error) => error.args(),
            Self::Ultimate(error) => error.args(),
        }
    }
}

impl ParseError {
    /// One of each kind of its own, for the test that compares them with the translation files.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        let text = |t: &str| t.to_owned();
        vec![
            Self::NoEquals { part: text("9"), form: MODEL_FORMS },
            Self::UnknownName { name: text("Q"), form: GAINS_FORM },
            Self::NotANumber { name: text("K"), text: text("four") },
            Self::Twice { name: text("K") },
            Self::Missing { name: "T", form: MODEL_FORMS },
            Self::OutOfRange { name: "Tf", value: -1.0 },
        ]
    }
}

/// Named parts of one argument, each used once.
pub(super) struct Parts<'a> {
    parts: Vec<(&'a str, &'a str)>,
    form: &'static str,
}

impl<'a> Parts<'a> {
    pub(super) fn of(text: &'a str, form: &'static str) -> Result<Self, ParseError> {
        let mut parts: Vec<(&str, &str)> = Vec::new();
        for part in text.split([',', ';']).map(str::trim).filter(|part| !part.is_empty()) {
            let Some((name, value)) = part.split_once('=') else {
                return Err(ParseError::NoEquals { part: part.to_owned(), form });
            };
            let name = name.trim();
            if parts.iter().any(|(other, _)| other.eq_ignore_ascii_case(name)) {
                return Err(ParseError::Twice { name: name.to_owned() });
            }
            parts.push((name, value.trim()));
        }
        Ok(Self { parts, form })
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.parts.iter().any(|(other, _)| other.eq_ignore_ascii_case(name))
    }

    pub(super) fn text(&mut self, name: &str) -> Option<&'a str> {
        let at = self.parts.iter().position(|(other, _)| other.eq_ignore_ascii_case(name))?;
        Some(self.parts.remove(at).1)
    }

    pub(super) fn optional(&mut self, name: &str) -> Result<Option<f64>, ParseError> {
        self.text(name).map(|text| number(name, text)).transpose()
    }

    pub(super) fn needed(&mut self, name: &'static str) -> Result<f64, ParseError> {
        self.optional(name)?.ok_or(ParseError::Missing { name, form: self.form })
    }

    fn list(&mut self, name: &'static str) -> Result<Vec<f64>, ParseError> {
        let text = self.text(name).ok_or(ParseError::Missing { name, form: self.form })?;
        text.trim_matches(['[', ']']).split_whitespace().map(|word| number(name, word)).collect()
    }

    pub(super) fn end(self) -> Result<(), ParseError> {
        match self.parts.first() {
            Some((name, _)) => Err(ParseError::UnknownName { name: (*name).to_owned(), form: self.form }),
            None => Ok(()),
        }
    }
}

pub(super) fn number(name: &str, text: &str) -> Result<f64, ParseError> {
    let text = text.strip_suffix('s').map_or(text, str::trim);
    let value = if text == "∞" { Ok(f64::INFINITY) } else { text.parse::<f64>() };
    value.map_err(|_| ParseError::NotANumber { name: name.to_owned(), text: text.to_owned() })
}

/// A process model, in seconds and in PV units per MV unit. Without L the dead time is 0.
///
/// # Errors
/// [`ParseError`] names the part.
pub fn model(text: &str) -> Result<ProcessModel, ParseError> {
    let mut parts = Parts::of(text, MODEL_FORMS)?;
    let dead_time_s = parts.optional("L")?.unwrap_or(0.0);
    let built = if parts.has("num") || parts.has("den") {
        let (num, den) = (parts.list("num")?, parts.list("den")?);
        ProcessModel::rational(&num, &den, dead_time_s)
    } else if parts.has("Kv") {
        Ipdt::new(parts.needed("Kv")?, dead_time_s).map(ProcessModel::Ipdt)
    } else if parts.has("T1") || parts.has("T2") {
        let (k, t1, t2) = (parts.needed("K")?, parts.needed("T1")?, parts.needed("T2")?);
        let tz = parts.optional("Tz")?.unwrap_or(0.0);
        Sopdt::new(k, t1, t2, tz, dead_time_s).map(ProcessModel::Sopdt)
    } else {
        let (k, t) = (parts.needed("K")?, parts.needed("T")?);
        Fopdt::new(k, t, dead_time_s).map(ProcessModel::Fopdt)
    };
    parts.end()?;
    built.map_err(ParseError::Model)
}

/// Gains of the ideal form; without Ti no integral, without Td no derivative action, N = 10.
///
/// # Errors
/// [`ParseError`] names the part.
pub fn gains(text: &str) -> Result<PidGains, ParseError> {
    let mut parts = Parts::of(text, GAINS_FORM)?;
    let kc = parts.needed("Kc")?;
    let ti_s = parts.optional("Ti")?.unwrap_or(f64::INFINITY);
    let td_s = parts.optional("Td")?.unwrap_or(0.0);
    let n = parts.optional("N")?.unwrap_or(PidGains::DEFAULT_N);
    parts.end()?;
    PidGains { kc, ti_s, td_s, n }.validated().map_err(ParseError::Gains)
}

/// Gains of the ideal form as [`gains`] takes them, or of the parallel one, `Kp=..,Ki=..[,Kd=..,Tf=..]`, where Kp may be 0
/// beside a Ki.
///
/// # Errors
/// [`ParseError`] names the part.
pub fn any_gains(text: &str) -> Result<ParallelGains, ParseError> {
    let mut parts = Parts::of(text, ANY_GAINS_FORM)?;
    if !["Kp", "Ki", "Kd", "Tf"].iter().any(|name| parts.has(name)) {
        return gains(text).map(ParallelGains::from);
    }
    let kd = parts.optional("Kd")?.unwrap_or(0.0);
    let [kp, ki] = [parts.optional("Kp")?, parts.optional("Ki")?].map(Option::unwrap_or_default);
    let tf_s = if kd == 0.0 { parts.optional("Tf")?.unwrap_or(0.0) } else { parts.needed("Tf")? };
    parts.end()?;
    if kp == 0.0 && ki == 0.0 {
        return Err(ParseError::Missing { name: "Kp or Ki", form: ANY_GAINS_FORM });
    }
    let named = [("Kp", kp, true), ("Ki", ki, true), ("Kd", kd, true), ("Tf", tf_s, kd == 0.0 || tf_s > 0.0)];
    match named.iter().find(|(_, value, usable)| !(value.is_finite() && *usable)) {
        Some((name, value, _)) => Err(ParseError::OutOfRange { name, value: *value }),
        None => Ok(ParallelGains { kp, ki, kd, tf_s }),
    }
}

/// Ultimate gain and period from a test.
///
/// # Errors
/// [`ParseError`] names the part.
pub fn ultimate(text: &str) -> Result<Ultimate, ParseError> {
    let mut parts = Parts::of(text, ULTIMATE_FORM)?;
    let (ku, pu_s) = (parts.needed("Ku")?, parts.needed("Pu")?);
    parts.end()?;
    Ultimate { ku, pu_s }.validated().map_err(ParseError::Ultimate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_a_model_is_read() {
        let fopdt = model("K=4.9,T=152,L=2").expect("fopdt");
        assert_eq!(fopdt, ProcessModel::Fopdt(Fopdt::new(4.9, 152.0, 2.0).expect("a model")));
        assert!(
            matches!(model(" k = -2 ; t = 3s ").expect("loose"), ProcessModel::Fopdt(m) if m.dead_time_s == 0.0)
        );
        assert!(matches!(model("Kv=0.1,L=2").expect("ipdt"), ProcessModel::Ipdt(_)));
        let sopdt = model("K=1,T1=2,T2=9,L=0,Tz=-1").expect("sopdt");
        assert!(matches!(sopdt, ProcessModel::Sopdt(m) if m.time_constant_1_s == 9.0));
        let rational = model("num=1 2,den=1 3 3 1,L=0.5").expect("rational");
        assert!(matches!(rational, ProcessModel::Rational(m) if m.den == [1.0, 3.0, 3.0, 1.0]));
    }

    #[test]
    fn errors_name_the_part() {
        for (text, part) in [
            ("K=4,9,T=1", "'9'"),
            ("K=x,T=1", "'x'"),
            ("K=1,T=1,Q=2", "'Q'"),
            ("K=1,K=2,T=1", "K is given twice"),
            ("K=1", "T is missing"),
            ("", "K is missing"),
            ("K=1,T1=2", "T2 is missing"),
            ("K=0,T=1", "K = 0"),
            ("num=1,L=2", "den is missing"),
        ] {
            let error = model(text).expect_err(text).to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(gains("Ti=3").expect_err("no Kc").to_string().contains("Kc is missing"));
        assert_eq!(gains("Kc=2").expect("P").ti_s, f64::INFINITY);
        assert!(gains("Kc=1,Ti=-3").expect_err("Ti").to_string().contains("Ti = -3"));
        assert!(ultimate("Ku=0,Pu=3").is_err());
    }
}
