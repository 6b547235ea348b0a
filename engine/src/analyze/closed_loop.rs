//! The linear closed loop stepped in time, dead time exact.
//!
//! With dead time the loop is open within one step: the process sees inputs that are already known, as cubics that
//! match value and slope at both ends of every step, so the error falls with the fourth power of the step. Without
//! dead time the whole loop is one linear system and its step is exact.

use nalgebra::{DMatrix, DVector};

use super::OpenLoop;
use crate::control::ParallelGains;
use crate::model::realization::{Hermite, Realization, Step};

/// What acts on the loop from t = 0: setpoint r with its weights b and c, and a load at the process input.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inputs {
    pub r: f64,
    pub b: f64,
    pub c: f64,
    pub load: f64,
}

/// A loop that gives y and u at the start of a step and moves on by it.
pub(super) enum Stepper {
    Delayed(Box<Delayed>),
    Direct(Box<Direct>),
}

impl Stepper {
    /// With dead time the step becomes the nearest shorter divisor of it.
    pub(super) fn new(open: &OpenLoop, inputs: Inputs, h: f64) -> Self {
        if open.dead_time_s > 0.0 {
            Self::Delayed(Box::new(Delayed::new(open, inputs, h)))
        } else {
            Self::Direct(Box::new(Direct::new(open, inputs, h)))
        }
    }

    pub(super) fn h(&self) -> f64 {
        match self {
            Self::Delayed(l) => l.h,
            Self::Direct(l) => l.h,
        }
    }

    /// y over the step, and u where it starts.
    pub(super) fn step(&mut self) -> (Hermite, f64) {
        match self {
            Self::Delayed(l) => l.step(),
            Self::Direct(l) => l.step(),
        }
    }
}

/// u = Kp (b r − y) + Ki xᵢ + (Kd/Tf) ((c r − y) − x_f), ẋᵢ = r − y, ẋ_f = ((c r − y) − x_f)/Tf.
struct Controller {
    gains: ParallelGains,
    inputs: Inputs,
    integral: f64,
    filtered: DVector<f64>,
    filter: Option<Step>,
}

impl Controller {
    fn new(open: &OpenLoop, inputs: Inputs, h: f64) -> Self {
        let gains = *open.gains();
        let rate = 1.0 / gains.tf_s;
        let filter = (gains.tf_s > 0.0).then(|| Step::new(&DMatrix::from_element(1, 1, -rate), rate, h));
        Self { gains, inputs, integral: 0.0, filtered: DVector::zeros(1), filter }
    }

    /// u and its slope for the present state, y and ẏ.
    fn output(&self, y: f64, y_slope: f64) -> (f64, f64) {
        let Inputs { r, b, c, .. } = self.inputs;
        let ParallelGains { kp, ki, kd, tf_s } = self.gains;
        let mut u = kp * (b * r - y) + ki * self.integral;
        let mut slope = ki * (r - y) - kp * y_slope;
        if tf_s > 0.0 {
            let remainder = (c * r - y) - self.filtered[0];
            u += kd / tf_s * remainder;
            slope -= kd / tf_s * (y_slope + remainder / tf_s);
        }
        (u, slope)
    }

    fn advance(&mut self, y: Hermite, h: f64) {
        self.integral += self.inputs.r * h - y.integral(h);
        if let Some(filter) = &mut self.filter {
            let target = self.inputs.c * self.inputs.r;
            let error = Hermite {
                start: target - y.start,
                end: target - y.end,
                start_slope: -y.start_slope,
                end_slope: -y.end_slope,
            };
            filter.advance(&mut self.filtered, error);
        }
    }
}

pub(super) struct Delayed {
    h: f64,
    realization: Realization,
    process: Step,
    x: DVector<f64>,
    controller: Controller,
    /// Process inputs of the last dead time, one cubic per step.
    on_the_way: Vec<Hermite>,
    oldest: usize,
}

impl Delayed {
    fn new(open: &OpenLoop, inputs: Inputs, h: f64) -> Self {
        let steps = (open.dead_time_s / h).ceil().max(1.0);
        let h = open.dead_time_s / steps;
        let realization = Realization::new(&open.process_num, &open.process_den);
        Self {
            h,
            process: Step::new(&realization.a, 1.0, h),
            x: DVector::zeros(realization.order()),
            realization,
            controller: Controller::new(open, inputs, h),
            on_the_way: vec![Hermite::default(); steps as usize],
            oldest: 0,
        }
    }

    pub(super) fn dead_time_s(&self) -> f64 {
        self.h * self.on_the_way.len() as f64
    }

    /// y over the step, and u where it starts.
    fn step(&mut self) -> (Hermite, f64) {
        let v = self.on_the_way[self.oldest];
        let output = |x: &DVector<f64>, value: f64, slope: f64, of: &Realization| {
            (of.output(x, value), of.output_slope(x, value, slope))
        };
        let (start, start_slope) = output(&self.x, v.start, v.start_slope, &self.realization);
        self.process.advance(&mut self.x, v);
        let (end, end_slope) = output(&self.x, v.end, v.end_slope, &self.realization);
        let y = Hermite { start, end, start_slope, end_slope };
        let (u_start, u_start_slope) = self.controller.output(start, start_slope);
        self.controller.advance(y, self.h);
        let (u_end, u_end_slope) = self.controller.output(end, end_slope);
        let u = Hermite { start: u_start, end: u_end, start_slope: u_start_slope, end_slope: u_end_slope };
        self.on_the_way[self.oldest] = u.plus(self.controller.inputs.load);
        self.oldest = (self.oldest + 1) % self.on_the_way.len();
        (y, u_start)
    }
}

pub(super) struct Direct {
    h: f64,
    step: Step,
    /// Process states, ∫e, the derivative filter, and last the forcing.
    z: DVector<f64>,
    y_row: DVector<f64>,
    u_row: DVector<f64>,
    /// ẏ of the states.
    slope_row: DVector<f64>,
}

impl Direct {
    fn new(open: &OpenLoop, inputs: Inputs, h: f64) -> Self {
        let realization = Realization::new(&open.process_num, &open.process_den);
        let ParallelGains { kp, ki, kd, tf_s } = *open.gains();
        let high = if tf_s > 0.0 { kd / tf_s } else { 0.0 };
        let order = realization.order();
        let size = order + 3;
        let (integral, filtered, one) = (order, order + 1, order + 2);
        // y = C x + D (u + load) and u = α − κ y solved for both: α collects all of u that is not y.
        let kappa = kp + high;
        let mut alpha = DVector::zeros(size);
        alpha[integral] = ki;
        alpha[filtered] = -high;
        alpha[one] = (kp * inputs.b + high * inputs.c) * inputs.r;
        let mut y_row = &alpha * realization.d;
        y_row[one] += realization.d * inputs.load;
        for i in 0..order {
            y_row[i] += realization.c[i];
        }
        y_row /= 1.0 + realization.d * kappa;
        let u_row = &alpha - &y_row * kappa;
        let mut system = DMatrix::zeros(size, size);
        system.view_mut((0, 0), (order, order)).copy_from(&realization.a);
        for j in 0..size {
            let own = if j == one { 1.0 } else { 0.0 };
            if order > 0 {
                system[(order - 1, j)] += u_row[j] + own * inputs.load;
            }
            system[(integral, j)] = own * inputs.r - y_row[j];
            if tf_s > 0.0 {
                let old = if j == filtered { 1.0 } else { 0.0 };
                system[(filtered, j)] = (own * inputs.c * inputs.r - y_row[j] - old) / tf_s;
            }
        }
        let mut z = DVector::zeros(size);
        z[one] = 1.0;
        let slope_row = system.tr_mul(&y_row);
        Self { h, step: Step::new(&system, 0.0, h), z, y_row, u_row, slope_row }
    }

    fn step(&mut self) -> (Hermite, f64) {
        let at = |of: &Self| (of.y_row.dot(&of.z), of.slope_row.dot(&of.z));
        let (start, start_slope) = at(self);
        let u = self.u_row.dot(&self.z);
        self.step.advance(&mut self.z, Hermite::default());
        let (end, end_slope) = at(self);
        (Hermite { start, end, start_slope, end_slope }, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::PidGains;
    use crate::model::ProcessModel;

    /// y after 24 s of a second-order process under PID, load step, with steps of h.
    fn late_value(h: f64) -> f64 {
        let model = ProcessModel::rational(&[2.0], &[12.0, 7.0, 1.0], 1.5).expect("a model");
        let open = OpenLoop::new(&model, &PidGains::pid(0.9, 7.0, 1.2));
        let inputs = Inputs { r: 0.0, b: 1.0, c: 0.0, load: 1.0 };
        let mut stepper = Stepper::new(&open, inputs, h);
        let steps = (24.0 / stepper.h()).round() as usize;
        (0..steps).for_each(|_| {
            stepper.step();
        });
        stepper.step().0.start
    }

    #[test]
    fn halving_the_step_cuts_the_error_sixteenfold() {
        let best = late_value(0.001_171_875);
        let errors = [0.075, 0.0375, 0.018_75].map(|h| (late_value(h) - best).abs());
        assert!(errors[0] < 1e-4, "{errors:?}");
        for pair in errors.windows(2) {
            assert!(pair[0] / pair[1] > 12.0, "{errors:?}");
        }
    }
}
