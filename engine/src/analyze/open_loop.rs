//! The open loop L = G·C of a process model and a PID controller, dead time exact.

use num_complex::Complex64;

use super::grid::features;
use crate::control::{ParallelGains, PidGains};
use crate::model::ProcessModel;
use crate::model::roots::{at_j_omega, product, push_roots};

/// `L(s) = G(s) C(s)` with G's dead time exact and `C = Kp + Ki/s + Kd s/(1 + s Tf)`.
///
/// Any controller of the ideal form is one of these; a pure integrator (Kp = 0) is one too. Built once per pair of model and gains; evaluating it allocates nothing. Gains that are not finite make every
/// value NaN, which the stability test reads as unstable.
#[derive(Debug, Clone)]
pub struct OpenLoop {
    controller: ParallelGains,
    pub(super) process_num: Vec<f64>,
    pub(super) process_den: Vec<f64>,
    pub(super) dead_time_s: f64,
    pub(super) num: Vec<f64>,
    pub(super) den: Vec<f64>,
    pub(super) zeros: Vec<Complex64>,
    pub(super) poles: Vec<Complex64>,
}

/// First term of a function of s at one end of the imaginary axis: `coefficient · s^power`.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        let filter_s = if gains.td_s == 0.0 { 0.0 } else { gains.td_s / gains.n };
        Self::of_parallel(
            model,
            &ParallelGains { kp: gains.kc, ki: gains.ki(), kd: gains.kd(), tf_s: filter_s },
        )
    }

    /// Joins a model and gains of the parallel form; without derivative action Tf does not matter.
    #[must_use]
    pub fn of_parallel(model: &ProcessModel, gains: &ParallelGains) -> Self {
        let process = model.transfer_function();
        let controller = if gains.kd == 0.0 { ParallelGains { tf_s: 0.0, ..*gains } } else { *gains };
        let (controller_num, controller_den) = polynomials(&controller);
        let degree = process.den.len() + controller_den.len();
        let (mut zeros, mut poles) = (Vec::with_capacity(degree), Vec::with_capacity(degree));
        push_roots(&process.num, &mut zeros);
        push_roots(&process.den, &mut poles);
        if controller_num[0] != 0.0 {
            push_roots(&controller_num, &mut zeros);
        }
        push_roots(&controller_den, &mut poles);
        Self {
            controller,
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
        let ParallelGains { kp, ki, kd, tf_s } = self.controller;
        let filter = omega_rad_s * tf_s;
        let derivative = omega_rad_s * kd / (1.0 + filter * filter);
        Complex64::new(kp + derivative * filter, derivative - ki / omega_rad_s)
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

    /// Poles of the rational part in rad/s: of the process and of the controller.
    #[must_use]
    pub fn poles(&self) -> &[Complex64] {
        &self.poles
    }

    /// Zeros likewise.
    #[must_use]
    pub fn zeros(&self) -> &[Complex64] {
        &self.zeros
    }

    /// The controller's gains.
    #[must_use]
    pub fn gains(&self) -> &ParallelGains {
        &self.controller
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
        if self.controller.ki == 0.0 {
            Asymptote { coefficient: self.controller.kp, power: 0 }
        } else {
            Asymptote { coefficient: self.controller.ki, power: -1 }
        }
    }

    /// C(∞): Kp, with derivative action Kp + Kd/Tf.
    pub(super) fn controller_high(&self) -> f64 {
        let ParallelGains { kp, kd, tf_s, .. } = self.controller;
        if kd == 0.0 { kp } else { kp + kd / tf_s }
    }

    /// G(∞) without its dead time: not zero only for as many zeros as poles.
    pub(crate) fn process_high(&self) -> f64 {
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
fn polynomials(gains: &ParallelGains) -> (Vec<f64>, Vec<f64>) {
    let ParallelGains { kp, ki, kd, tf_s } = *gains;
    match (ki != 0.0, kd != 0.0) {
        (false, false) => (vec![kp], vec![1.0]),
        (false, true) => (vec![kp * tf_s + kd, kp], vec![tf_s, 1.0]),
        (true, false) if kp == 0.0 => (vec![ki], vec![1.0, 0.0]),
        (true, false) => (vec![kp, ki], vec![1.0, 0.0]),
        (true, true) => (vec![kp * tf_s + kd, kp + ki * tf_s, ki], vec![tf_s, 1.0, 0.0]),
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
