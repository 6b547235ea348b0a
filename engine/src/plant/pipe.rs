//! Transport delay as a falling stream whose water is counted.

use std::collections::VecDeque;

use super::lanes::Number;

/// Shorter pieces of stream are merged with their neighbour, in seconds.
const SHORTEST_S: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece<V> {
    duration_s: f64,
    flow_cm3_s: V,
}

/// A stream in the air: pieces of constant flow whose durations add up to the delay θ.
///
/// Delivered volume equals entered volume to rounding, whatever the flow and the delay do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pipe<V> {
    delay_s: f64,
    pieces: VecDeque<Piece<V>>,
}

impl<V: Number> Pipe<V> {
    /// A pipe of delay θ in seconds, filled with a constant flow in cm³/s.
    #[must_use]
    pub fn filled(delay_s: f64, flow_cm3_s: V) -> Self {
        let mut pieces = VecDeque::with_capacity(64);
        if delay_s > SHORTEST_S {
            pieces.push_back(Piece { duration_s: delay_s, flow_cm3_s });
        }
        Self { delay_s, pieces }
    }

    /// θ in seconds.
    #[must_use]
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Flow that arrives now, in cm³/s; `None` without a delay.
    #[must_use]
    pub fn arriving_cm3_s(&self) -> Option<V> {
        self.pieces.front().map(|p| p.flow_cm3_s)
    }

    /// Time until the arriving flow changes, in seconds; ∞ without a delay.
    #[must_use]
    pub fn time_to_change_s(&self) -> f64 {
        self.pieces.front().map_or(f64::INFINITY, |p| p.duration_s)
    }

    /// Water in the air, in cm³.
    #[must_use]
    pub fn volume_cm3(&self) -> V {
        self.pieces.iter().fold(V::of(0.0), |sum, p| sum + p.flow_cm3_s * p.duration_s)
    }

    /// Takes `duration_s` of stream off the front, at most [`Self::time_to_change_s`].
    #[inline(always)]
    pub fn take(&mut self, duration_s: f64) {
        let Some(front) = self.pieces.front_mut() else { return };
        front.duration_s -= duration_s;
        if front.duration_s >= SHORTEST_S || self.pieces.len() == 1 {
            return;
        }
        // What is left is rounding; its water goes with the next piece.
        if let Some(rest) = self.pieces.pop_front()
            && rest.duration_s != 0.0
            && let Some(next) = self.pieces.front_mut()
        {
            let volume = rest.flow_cm3_s * rest.duration_s + next.flow_cm3_s * next.duration_s;
            next.duration_s += rest.duration_s;
            next.flow_cm3_s = volume * (1.0 / next.duration_s);
        }
    }

    /// Gives `duration_s` of stream back to the front.
    pub fn give_back(&mut self, duration_s: f64, flow_cm3_s: V) {
        match self.pieces.front_mut() {
            Some(front) if front.flow_cm3_s == flow_cm3_s => front.duration_s += duration_s,
            _ => self.pieces.push_front(Piece { duration_s, flow_cm3_s }),
        }
    }

    /// Lets a flow in at the back for `duration_s`.
    #[inline(always)]
    pub fn feed(&mut self, duration_s: f64, flow_cm3_s: V) {
        if self.delay_s <= SHORTEST_S {
            return;
        }
        match self.pieces.back_mut() {
            Some(back) if back.flow_cm3_s == flow_cm3_s => back.duration_s += duration_s,
            // A last piece whose time is spent holds no more than rounding.
            Some(back) if back.duration_s < SHORTEST_S => {
                let volume = back.flow_cm3_s * back.duration_s + flow_cm3_s * duration_s;
                back.duration_s += duration_s;
                back.flow_cm3_s = volume * (1.0 / back.duration_s);
            }
            _ => self.pieces.push_back(Piece { duration_s, flow_cm3_s }),
        }
    }

    /// Changes θ; the water in the air is kept and arrives within the new delay.
    ///
    /// Returns the volume in cm³ that has no place in a pipe without delay and must be delivered at once.
    #[must_use]
    pub fn set_delay(&mut self, delay_s: f64) -> V {
        if (delay_s - self.delay_s).abs() < SHORTEST_S {
            return V::of(0.0);
        }
        let homeless = if delay_s <= SHORTEST_S {
            let volume = self.volume_cm3();
            self.pieces.clear();
            volume
        } else if self.pieces.is_empty() {
            self.pieces.push_back(Piece { duration_s: delay_s, flow_cm3_s: V::of(0.0) });
            V::of(0.0)
        } else {
            let ratio = delay_s / self.delay_s;
            for piece in &mut self.pieces {
                piece.duration_s *= ratio;
                piece.flow_cm3_s = piece.flow_cm3_s * (1.0 / ratio);
            }
            V::of(0.0)
        };
        self.delay_s = delay_s.max(0.0);
        homeless
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_arrives_after_the_delay_and_no_water_is_lost() {
        let mut pipe = Pipe::filled(1.7, 10.0);
        let (mut entered, mut delivered, mut time_s) = (0.0, 0.0, 0.0);
        let before = pipe.volume_cm3();
        let mut arrival_s = None;
        while time_s < 5.0 {
            let dt = pipe.time_to_change_s().min(0.2);
            let arriving = pipe.arriving_cm3_s().expect("a delay of 1.7 s");
            if arriving > 15.0 && arrival_s.is_none() {
                arrival_s = Some(time_s);
            }
            delivered += arriving * dt;
            entered += 20.0 * dt;
            pipe.feed(dt, 20.0);
            pipe.take(dt);
            time_s += dt;
        }
        assert!((arrival_s.expect("the step arrives") - 1.7).abs() < 1e-9);
        assert!((before + entered - delivered - pipe.volume_cm3()).abs() < 1e-9);
    }

    #[test]
    fn a_new_delay_keeps_the_water() {
        let mut pipe = Pipe::filled(1.7, 10.0);
        pipe.feed(0.4, 5.0);
        pipe.take(0.4);
        let before = pipe.volume_cm3();
        assert!(pipe.set_delay(1.3).abs() < 1e-12);
        assert!((pipe.volume_cm3() - before).abs() < 1e-12);
        assert!((pipe.set_delay(0.0) - before).abs() < 1e-12);
        assert!(pipe.arriving_cm3_s().is_none());
    }

    #[test]
    fn what_is_given_back_is_there_again() {
        let mut pipe = Pipe::filled(1.7, 10.0);
        pipe.feed(0.2, 20.0);
        let before = pipe.volume_cm3();
        pipe.take(1.7);
        pipe.take(0.1);
        pipe.give_back(0.1, 20.0);
        pipe.give_back(0.3, 10.0);
        assert!((before - pipe.volume_cm3() - 14.0).abs() < 1e-12);
        assert!((pipe.time_to_change_s() - 0.3).abs() < 1e-12);
    }
}
