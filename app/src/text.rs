//! Numbers as people read them.

/// A number with a fixed count of decimals and a real minus sign; `–` where there is none.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() {
            "–".to_owned()
        } else if value > 0.0 {
            "∞".to_owned()
        } else {
            "−∞".to_owned()
        };
    }
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "−") }
}

/// A number with about four significant digits, for tables.
#[must_use]
pub fn brief(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return fixed(value, 0);
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..7.0).contains(&magnitude) {
        return format!("{value:.2e}").replace('-', "−");
    }
    fixed(value, (2.0 - magnitude).clamp(0.0, 6.0) as usize)
}

/// A number with two significant digits, for the half-width of an interval.
#[must_use]
pub fn rough(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return fixed(value, 0);
    }
    fixed(value, (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize)
}

/// A number for a narrow cell: three significant digits, powers of ten below 0.01 and above 9999.
#[must_use]
pub fn cell(value: f64) -> String {
    if value.is_finite() && value != 0.0 && !(0.01..10_000.0).contains(&value.abs()) {
        return format!("{value:.0e}").replace('-', "−");
    }
    brief(value)
}

/// The unit of a quotient of two, written the short way where there is one.
#[must_use]
pub fn quotient(over: &str, under: &str) -> String {
    let known = |u: &str| if u.is_empty() { "–".to_owned() } else { u.to_owned() };
    match (over, under) {
        (a, b) if a == b && !a.is_empty() => "1".to_owned(),
        ("cm³/s", "cm") => "cm²/s".to_owned(),
        ("cm", "cm³/s") => "s/cm²".to_owned(),
        (_, u) if u.contains(['/', '·']) => format!("{}/({u})", known(over)),
        _ => format!("{}/{}", known(over), known(under)),
    }
}

/// A number that may not exist.
#[must_use]
pub fn maybe(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), brief)
}

/// Seconds as h:mm:ss, or mm:ss below an hour.
#[must_use]
pub fn clock(time_s: f64) -> String {
    if !time_s.is_finite() {
        return "–".to_owned();
    }
    let s = time_s.max(0.0).floor() as u64;
    let (h, m, s) = (s / 3600, s / 60 % 60, s % 60);
    if h > 0 { format!("{h}:{m:02}:{s:02}") } else { format!("{m:02}:{s:02}") }
}

/// The moment as `2026-11-22-031500` by the local clock, for file names.
#[must_use]
pub fn stamp() -> String {
    chrono::Local::now().format("%Y-%m-%d-%H%M%S").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(fixed(-1.25, 1), "−1.2");
        assert_eq!(fixed(f64::NAN, 1), "–");
        assert_eq!(brief(152.04), "152");
        assert_eq!(brief(4.987), "4.99");
        assert_eq!(brief(0.031_26), "0.0313");
        assert_eq!(cell(0.005_96), "6e−3");
        assert_eq!(quotient("cm³/s", "cm"), "cm²/s");
        assert_eq!(quotient("V", "ml/s"), "V/(ml/s)");
        assert_eq!(rough(0.002_17), "0.0022");
        assert_eq!(clock(3725.9), "1:02:05");
        assert_eq!(clock(59.99), "00:59");
    }
}
