//! The open loop L = G·C of a process model and a PID controller, dead time exact.

use num_complex::Complex64;

use super::grid::features;
use crate::control::PidGains;
use crate::model::ProcessModel;
use crate::model::roots::{at_j_omega, product, push_roots};

/// `L(s) = G(s) C(s)` with G's dead time exact and `C = Kc (1 + 1/(Ti s) + Td s/(1 + s Td/N))`.
///
/// Built once per pair of model and gains; evaluating it allocates nothing. Gains that are not finite make every
/// value NaN, which the stability test reads as unstable.
#[derive(Debug, Clone)]
pub struct OpenLoop {
    kc: f64,
    inverse_ti: f64,
    td_s: f64,
    filter_s: f64,
    pub(super) process_num: Vec<f64>,
    pub(super) process_den: Vec<f64>,
    pub(super) dead_time_s: f64,
    pub(super) num: Vec<f64>,
    pub(super) den: Vec<f64>,
    pub(super) zeros: Vec<Complex64>,
    pub(super) poles: Vec<Complex64>,
}

/// First term of a function of s at one end of the imaginary axis: `coefficient · s^power`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asymptote {
    pub coefficient: f64,
    pub power: i32,
}

/// |1 + L|², |L|², |G|² and |C|² at one frequency, with L itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct LoopPoint {
    pub l: Complex64,
    pub one_plus_l_sqr: f64,
    pub g_sqr: f64,
    pub c_sqr: f64,
}

impl OpenLoop {
    /// Joins a model (K in PV units per MV unit) and gains (Kc in MV units per PV unit).
    #[must_use]
    pub fn new(model: &ProcessModel, gains: &PidGains) -> Self {
        let process = model.transfer_function();
        let inverse_ti = if gains.ti_s.is_infinite() || gains.kc == 0.0 { 0.0 } else { 1.0 / gains.ti_s };
        let filter_s = if gains.td_s == 0.0 { 0.0 } else { gains.td_s / gains.n };
        let (controller_num, controller_den) = controller(gains.kc, inverse_ti, gains.td_s, filter_s);
        let degree = process.den.len() + controller_den.len();
        let (mut zeros, mut poles) = (Vec::with_capacity(degree), Vec::with_capacity(degree));
        push_roots(&process.num, &mut zeros);
        push_roots(&process.den, &mut poles);
        if gains.kc != 0.0 {
            push_roots(&controller_num, &mut zeros);
        }
        push_roots(&controller_den, &mut poles);
        Self {
            kc: gains.kc,
            inverse_ti,
            td_s: gains.td_s,
            filter_s,
            num: product(&process.num, &controller_num),
            den: product(&process.den, &controller_den),
            process_num: process.num,
            process_den: process.den,
            dead_time_s: process.dead_time_s,
            zeros,
            poles,
        }
    }

    /// `L(jω)`, ω > 0 in rad/s.
    #[must_use]
    pub fn at_omega(&self, omega_rad_s: f64) -> Complex64 {
        self.point(omega_rad_s).l
    }

    /// `G(jω)`, ω > 0 in rad/s.
    #[must_use]
    pub fn process_at_omega(&self, omega_rad_s: f64) -> Complex64 {
        let n = at_j_omega(&self.process_num, omega_rad_s);
        let d = at_j_omega(&self.process_den, omega_rad_s);
        Complex64::new(n.0, n.1) / Complex64::new(d.0, d.1)
            * Complex64::from_polar(1.0, -omega_rad_s * self.dead_time_s)
    }

    /// `C(jω)`, ω > 0 in rad/s.
    #[must_use]
    pub fn controller_at_omega(&self, omega_rad_s: f64) -> Complex64 {
        let filter = omega_rad_s * self.filter_s;
        let derivative = omega_rad_s * self.td_s / (1.0 + filter * filter);
        Complex64::new(
            self.kc * (1.0 + derivative * filter),
            self.kc * (derivative - self.inverse_ti / omega_rad_s),
        )
    }

    #[inline]
    pub(super) fn point(&self, omega: f64) -> LoopPoint {
        let c = self.controller_at_omega(omega);
        let (n_re, n_im) = at_j_omega(&self.process_num, omega);
        let (d_re, d_im) = at_j_omega(&self.process_den, omega);
        let inverse_d_sqr = 1.0 / (d_re * d_re + d_im * d_im);
        let g = Complex64::new(
            (n_re * d_re + n_im * d_im) * inverse_d_sqr,
            (n_im * d_re - n_re * d_im) * inverse_d_sqr,
        );
        let mut l = g * c;
        if self.dead_time_s > 0.0 {
            let (sin, cos) = (omega * self.dead_time_s).sin_cos();
            l *= Complex64::new(cos, -sin);
        }
        let real = 1.0 + l.re;
        LoopPoint {
            l,
            one_plus_l_sqr: real * real + l.im * l.im,
            g_sqr: (n_re * n_re + n_im * n_im) * inverse_d_sqr,
            c_sqr: c.norm_sqr(),
        }
    }

    /// |L(jω)|², |G(jω)|² and |C(jω)|², which the dead time does not touch.
    #[inline]
    pub(super) fn magnitudes_sqr(&self, omega: f64) -> (f64, f64, f64) {
        let (n_re, n_im) = at_j_omega(&self.process_num, omega);
        let (d_re, d_im) = at_j_omega(&self.process_den, omega);
        let g_sqr = (n_re * n_re + n_im * n_im) / (d_re * d_re + d_im * d_im);
        let c_sqr = self.controller_at_omega(omega).norm_sqr();
        (g_sqr * c_sqr, g_sqr, c_sqr)
    }

    /// Kc, 1/Ti in 1/s, N of the filter (0 without derivative) and the filter's time constant Td/N in seconds.
    pub(super) fn controller_terms(&self) -> (f64, f64, f64, f64) {
        let n = if self.filter_s > 0.0 { self.td_s / self.filter_s } else { 0.0 };
        (self.kc, self.inverse_ti, n, self.filter_s)
    }

    /// The lowest of the loop's own frequencies in rad/s: poles, zeros and 1/θ.
    pub(crate) fn lowest_frequency(&self) -> f64 {
        features(self, &[])[0]
    }

    /// G for s → 0.
    pub(crate) fn process_low(&self) -> Asymptote {
        low_asymptote(&self.process_num, &self.process_den)
    }

    pub(super) fn controller_low(&self) -> Asymptote {
        if self.inverse_ti == 0.0 {
            Asymptote { coefficient: self.kc, power: 0 }
        } else {
            Asymptote { coefficient: self.kc * self.inverse_ti, power: -1 }
        }
    }

    /// C(∞): Kc, or Kc (1 + N) with derivative action.
    pub(super) fn controller_high(&self) -> f64 {
        self.kc * (1.0 + self.controller_terms().2)
    }

    /// G(∞) without its dead time: not zero only for as many zeros as poles.
    pub(super) fn process_high(&self) -> f64 {
        if self.process_num.len() == self.process_den.len() {
            self.process_num[0] / self.process_den[0]
        } else {
            0.0
        }
    }
}

fn low_asymptote(num: &[f64], den: &[f64]) -> Asymptote {
    let lowest = |c: &[f64]| c.iter().rev().position(|&v| v != 0.0).unwrap_or(0);
    let (in_num, in_den) = (lowest(num), lowest(den));
    Asymptote {
        coefficient: num[num.len() - 1 - in_num] / den[den.len() - 1 - in_den],
        power: in_num as i32 - in_den as i32,
    }
}

/// Numerator and denominator of C in falling powers of s.
fn controller(kc: f64, inverse_ti: f64, td: f64, filter: f64) -> (Vec<f64>, Vec<f64>) {
    match (inverse_ti != 0.0, td != 0.0) {
        (false, false) => (vec![kc], vec![1.0]),
        (false, true) => (vec![kc * (filter + td), kc], vec![filter, 1.0]),
        (true, false) => (vec![kc, kc * inverse_ti], vec![1.0, 0.0]),
        (true, true) => (
            vec![kc * (filter + td), kc * (1.0 + filter * inverse_ti), kc * inverse_ti],
            vec![filter, 1.0, 0.0],
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_is_the_product_of_model_and_gains() {
        let model = ProcessModel::rational(&[2.0, -1.0], &[1.0, 3.0, 0.5, 0.0], 1.5).expect("a model");
        for gains in [
            PidGains::p(2.0),
            PidGains::pi(-2.0, 3.0),
            PidGains::pid(2.0, 3.0, 0.4),
            PidGains { ti_s: f64::INFINITY, ..PidGains::pid(2.0, 1.0, 0.4) },
        ] {
            let open = OpenLoop::new(&model, &gains);
            for omega in [1e-3, 0.3, 2.0, 50.0] {
                let expected = model.transfer_function().at_omega(omega) * gains.at_omega(omega);
                assert!((open.at_omega(omega) - expected).norm() < 1e-12 * expected.norm());
                let polynomials = {
                    let (n, d) = (at_j_omega(&open.num, omega), at_j_omega(&open.den, omega));
                    Complex64::new(n.0, n.1) / Complex64::new(d.0, d.1)
                        * Complex64::from_polar(1.0, -1.5 * omega)
                };
                assert!((polynomials - expected).norm() < 1e-12 * expected.norm());
                assert!(
                    (open.process_at_omega(omega) * gains.at_omega(omega) - expected).norm()
                        < 1e-12 * expected.norm()
                );
            }
        }
    }
}
