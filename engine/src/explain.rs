//! Errors and findings that a face can say in the user's language.
//!
//! Every error and warning enum of the engine writes its English sentence through `Display` and
//! names the same sentence to the translation files through [`Explain`]. A test compares the two.

/// A sentence with a key in the translation files and the numbers that go into it.
pub trait Explain: std::fmt::Display {
    /// Key under `said.` in the translation files, for example `fit.too_few_samples`.
    fn key(&self) -> &'static str;
    /// Values of the placeholders `%{name}` of that sentence, as they are printed.
    fn args(&self) -> Vec<(&'static str, String)>;
    /// The finding inside this one, which stands for the placeholder `%{error}`.
    fn cause(&self) -> Option<&dyn Explain> {
        None
    }
}

/// Prints a number for a sentence: up to four significant digits, no trailing zeros.
#[must_use]
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() {
            "NaN".to_owned()
        } else if value > 0.0 {
            "∞".to_owned()
        } else {
            "−∞".to_owned()
        };
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let decimals = (3.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Two numbers with as many digits as tell them apart, four at least.
#[must_use]
pub fn told_apart(a: f64, b: f64) -> [String; 2] {
    let short = [number(a), number(b)];
    if short[0] != short[1] || a == b || !(a.is_finite() && b.is_finite()) {
        return short;
    }
    let with = |digits: usize| [a, b].map(|v| format!("{v:.digits$}"));
    (4..16).map(with).find(|[a, b]| a != b).unwrap_or_else(|| [a, b].map(|v| format!("{v:e}")))
}
