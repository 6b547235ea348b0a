//! The formulas as they are printed, for people; a test evaluates each and compares it with the code.
//!
//! K, τ (time constant), θ (dead time), r = θ/τ, a = τ/(K·θ) of a first-order model; Ku, Pu; λ stands for τc too. What is
//! left out (Ti of a P, Td of a PI) is absent. Formulas for integrating and second-order models stand in the modules beside.

use crate::tune::ControllerKind::{self, P, Pd, Pi, Pid};

/// Gains of a rule for a first-order model, or from Ku and Pu; `None` where the rule has no such controller, or gives it for
/// second-order models only.
pub(in crate::tune) fn formula_text(rule: &str, kind: ControllerKind) -> Option<&'static str> {
    Some(match (rule, kind) {
        ("zn_reaction", P) => "Kc = a",
        ("zn_reaction", Pi) => "Kc = 0.9·a, Ti = 3.33·θ",
        ("zn_reaction", Pid) => "Kc = 1.2·a, Ti = 2·θ, Td = 0.5·θ",
        ("zn_closed_loop", P) => "Kc = 0.5·Ku",
        ("zn_closed_loop", Pi) => "Kc = 0.45·Ku, Ti = Pu/1.2",
        ("zn_closed_loop", Pid) => "Kc = 0.6·Ku, Ti = Pu/2, Td = Pu/8",
        ("relay_astrom", Pid) => "Kc = Ku/1.7, Ti = Pu/2, Td = Pu/8",
        ("cohen_coon", P) => "Kc = a·(1 + r/3)",
        ("cohen_coon", Pi) => "Kc = a·(0.9 + r/12), Ti = θ·(30 + 3·r)/(9 + 20·r)",
        ("cohen_coon", Pd) => "Kc = a·(5/4 + r/6), Td = θ·(6 − 2·r)/(22 + 3·r)",
        ("cohen_coon", Pid) => "Kc = a·(4/3 + r/4), Ti = θ·(32 + 6·r)/(13 + 8·r), Td = 4·θ/(11 + 2·r)",
        ("chr_setpoint_0", P) => "Kc = 0.3·a",
        ("chr_setpoint_0", Pi) => "Kc = 0.35·a, Ti = 1.2·τ",
        ("chr_setpoint_0", Pid) => "Kc = 0.6·a, Ti = τ, Td = 0.5·θ",
        ("chr_setpoint_20", P) => "Kc = 0.7·a",
        ("chr_setpoint_20", Pi) => "Kc = 0.6·a, Ti = τ",
        ("chr_setpoint_20", Pid) => "Kc = 0.95·a, Ti = 1.357·τ, Td = 0.473·θ",
        ("chr_load_0", P) => "Kc = 0.3·a",
        ("chr_load_0", Pi) => "Kc = 0.6·a, Ti = 4·θ",
        ("chr_load_0", Pid) => "Kc = 0.95·a, Ti = 2.4·θ, Td = 0.42·θ",
        ("chr_load_20", P) => "Kc = 0.7·a",
        ("chr_load_20", Pi) => "Kc = 0.7·a, Ti = 2.3·θ",
        ("chr_load_20", Pid) => "Kc = 1.2·a, Ti = 2·θ, Td = 0.42·θ",
        ("itae_load", P) => "Kc = 0.49/K·r^(−1.084)",
        ("itae_load", Pi) => "Kc = 0.859/K·r^(−0.977), Ti = τ/0.674·r^0.680",
        ("itae_load", Pid) => "Kc = 1.357/K·r^(−0.947), Ti = τ/0.842·r^0.738, Td = 0.381·τ·r^0.995",
        ("itae_setpoint", Pi) => "Kc = 0.586/K·r^(−0.916), Ti = τ/(1.03 − 0.165·r)",
        ("itae_setpoint", Pid) => "Kc = 0.965/K·r^(−0.855), Ti = τ/(0.796 − 0.147·r), Td = 0.308·τ·r^0.929",
        ("amigo", Pi) => {
            "Kc = 0.15/K + (0.35 − θ·τ/(θ + τ)^2)·a, Ti = 0.35·θ + 13·θ·τ^2/(τ^2 + 12·θ·τ + 7·θ^2)"
        }
        ("amigo", Pid) => {
            "Kc = (0.2 + 0.45·τ/θ)/K, Ti = θ·(0.4·θ + 0.8·τ)/(θ + 0.1·τ), Td = 0.5·θ·τ/(0.3·θ + τ)"
        }
        ("direct_synthesis" | "lambda", Pi) => "Kc = τ/(K·(λ + θ)), Ti = τ",
        ("imc", Pi) => "Kc = (2·τ + θ)/(2·K·λ), Ti = τ + θ/2",
        ("imc", Pid) => "Kc = (2·τ + θ)/(K·(2·λ + θ)), Ti = τ + θ/2, Td = τ·θ/(2·τ + θ)",
        ("simc", Pi) => "Kc = τ/(K·(λ + θ)), Ti = min(τ, 4·(λ + θ))",
        ("isimc_pi", Pi) => "Kc = (τ + θ/3)/(K·(λ + θ)), Ti = min(τ + θ/3, 4·(λ + θ))",
        ("isimc_pid", Pid) => "series form: Kc = τ/(K·(λ + θ)), Ti = min(τ, 4·(λ + θ)), Td = θ/3",
        ("tyreus_luyben", Pi) => "Kc = Ku/3.2, Ti = 2.2·Pu",
        ("tyreus_luyben", Pid) => "Kc = Ku/2.2, Ti = 2.2·Pu, Td = Pu/6.3",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use crate::model::{Fopdt, ProcessModel};
    use crate::tune::{RuleError, RuleOptions, Ultimate, registry};

    /// Value of a printed formula; products, quotients and powers as they are printed.
    struct Reader<'a> {
        text: Vec<char>,
        at: usize,
        known: &'a [(&'a str, f64)],
    }

    impl Reader<'_> {
        fn peek(&mut self) -> Option<char> {
            while self.text.get(self.at) == Some(&' ') {
                self.at += 1;
            }
            self.text.get(self.at).copied()
        }

        fn take(&mut self, c: char) -> bool {
            let found = self.peek() == Some(c);
            self.at += usize::from(found);
            found
        }

        fn sum(&mut self) -> f64 {
            let negative = self.take('−');
            let mut value = self.product() * if negative { -1.0 } else { 1.0 };
            loop {
                if self.take('+') {
                    value += self.product();
                } else if self.take('−') {
                    value -= self.product();
                } else {
                    return value;
                }
            }
        }

        fn product(&mut self) -> f64 {
            let mut value = self.power();
            loop {
                if self.take('·') {
                    value *= self.power();
                } else if self.take('/') {
                    value /= self.power();
                } else {
                    return value;
                }
            }
        }

        fn power(&mut self) -> f64 {
            let base = self.atom();
            if self.take('^') { base.powf(self.atom()) } else { base }
        }

        fn atom(&mut self) -> f64 {
            if self.take('(') {
                let value = self.sum();
                assert!(self.take(')'));
                return value;
            }
            self.peek();
            let start = self.at;
            while self.text.get(self.at).is_some_and(|c| c.is_alphanumeric() || *c == '.') {
                self.at += 1;
            }
            let word: String = self.text[start..self.at].iter().collect();
            if word == "min" {
                assert!(self.take('('));
                let a = self.sum();
                assert!(self.take(','));
                let b = self.sum();
                assert!(self.take(')'));
                return a.min(b);
            }
            let known = self.known.iter().find(|(name, _)| *name == word).map(|k| k.1);
            known.unwrap_or_else(|| word.parse().unwrap_or_else(|_| panic!("'{word}' is unknown")))
        }
    }

    fn read(text: &str, symbol: &str, known: &[(&str, f64)]) -> Option<f64> {
        let start = text.find(&format!("{symbol} = "))? + symbol.len() + 3;
        Some(Reader { text: text[start..].chars().collect(), at: 0, known }.sum())
    }

    #[test]
    fn every_formula_says_what_its_code_does() {
        let (k, tau, theta) = (1.7, 40.0, 11.0);
        let model = ProcessModel::Fopdt(Fopdt::new(k, tau, theta).expect("a model"));
        let (lambda, ku, pu) = (13.0, 3.1, 52.0);
        let r = theta / tau;
        let known = [
            ("K", k),
            ("τ", tau),
            ("θ", theta),
            ("r", r),
            ("a", tau / (k * theta)),
            ("λ", lambda),
            ("Ku", ku),
            ("Pu", pu),
        ];
        let options = RuleOptions {
            tau_c_s: Some(lambda),
            ultimate: Some(Ultimate { ku, pu_s: pu }),
            ..RuleOptions::default()
        };
        for rule in registry() {
            for &kind in rule.controllers {
                let tuned = rule.tune(&model, kind, &options);
                let Some(text) = rule.formula_text(kind) else {
                    assert!(matches!(tuned, Err(RuleError::NeedsSecondOrder { .. })), "{} {kind}", rule.id);
                    continue;
                };
                let gains = tuned.expect("gains").gains;
                let of = |symbol: &str| read(text, symbol, &known);
                let (mut kc, mut ti_s, mut td_s) =
                    (of("Kc").expect("Kc"), of("Ti").unwrap_or(f64::INFINITY), of("Td").unwrap_or(0.0));
                if text.starts_with("series") {
                    let factor = 1.0 + td_s / ti_s;
                    (kc, ti_s, td_s) = (kc * factor, ti_s * factor, td_s / factor);
                }
                let near = |a: f64, b: f64| a == b || (a / b - 1.0).abs() < 1e-12;
                let same = near(kc, gains.kc) && near(ti_s, gains.ti_s) && near(td_s, gains.td_s);
                assert!(same, "{} {kind}: {text}: {kc} {ti_s} {td_s} {gains:?}", rule.id);
            }
        }
    }
}
