//! Making a tuning calmer by hand.

use crate::control::PidGains;

/// Gains made calmer: Kc/f, f·Ti, Td/f with f > 1.
///
/// The advice of seeds 003 and 004 for aggressive rules: start with less gain, more integral time and less
/// derivative time, then go back towards the rule while watching the process. A factor that is not greater than 1
/// and finite changes nothing.
#[must_use]
pub fn detuned(gains: &PidGains, factor: f64) -> PidGains {
    if !(factor > 1.0 && factor.is_finite()) {
        return *gains;
    }
    PidGains { kc: gains.kc / factor, ti_s: gains.ti_s * factor, td_s: gains.td_s / factor, n: gains.n }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn detuning_moves_all_three_gains_to_the_calm_side() {
        let calm = detuned(&PidGains::pid(-6.0, 10.0, 2.0), 2.0);
        assert_eq!((calm.kc, calm.ti_s, calm.td_s), (-3.0, 20.0, 1.0));
        assert_eq!(detuned(&PidGains::p(3.0), 0.5), PidGains::p(3.0));
        assert!(detuned(&PidGains::p(3.0), 2.0).ti_s.is_infinite());
    }
}
