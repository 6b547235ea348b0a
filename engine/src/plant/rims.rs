//! Rims, empty tanks and dry pumps: what a step would take that is not there, or bring that does not fit, is mended
//! in volumes, so that no water is made or lost.

use super::motion::{Motion, NO_TIME_S};
use super::network::Network;
use super::pipe::Pipe;
use super::streams::Streams;

/// Longest step near a rim or an empty tank, in seconds.
const CAREFUL_STEP_S: f64 = 0.1;
/// Share of a tank by which rounding may leave it below empty.
const EMPTY_SHARE: f64 = 1e-12;

/// Volumes of a step in cm³ while they are mended.
#[derive(Debug)]
struct Volumes<const N: usize> {
    pumped: [f64; N],
    arriving: [f64; N],
    spilled: [f64; N],
    /// What every node holds after the step.
    after: [f64; N],
}

impl<const N: usize> Motion<N, f64> {
    /// Lets `duration_s` pass in short steps that end with it, minding rims and empty tanks. `fed` pumps have had
    /// their water; `dry` tells which of the others found none.
    pub fn advance_carefully(&mut self, network: &Network, duration_s: f64, fed: bool, dry: &mut [bool]) {
        self.cut();
        let mut left_s = duration_s;
        while left_s > NO_TIME_S {
            let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(left_s, f64::min);
            left_s -= self.careful_step(network, change_s, fed, dry);
        }
    }

    fn careful_step(&mut self, network: &Network, most_s: f64, fed: bool, dry: &mut [bool]) -> f64 {
        let mut step_s = self.prepare_step(most_s.min(CAREFUL_STEP_S));
        let (start, mut slope) = (self.start, self.start_slope);
        self.hold_at_rims(&start, &mut slope);
        if slope != self.start_slope {
            // A tank held at its rim does not hurry.
            self.start_slope = slope;
            let most_s = most_s.min(CAREFUL_STEP_S);
            step_s = self.length_for(most_s);
        }
        self.runge_kutta::<true>(step_s);
        self.mend(network, step_s, fed, dry);
        self.evaluate_end();
        (self.length_s, self.passed_s) = (0.0, 0.0);
        self.steps += 1;
        step_s
    }

    /// Moves the volumes of a step from start to end, mended until every tank can hold and give them.
    fn mend(&mut self, network: &Network, step_s: f64, fed: bool, dry: &mut [bool]) {
        let mut volumes =
            Volumes { pumped: [0.0; N], arriving: [0.0; N], spilled: [0.0; N], after: [0.0; N] };
        for i in 0..network.pumps.len() {
            volumes.pumped[i] = if fed { 0.0 } else { step_s * self.commanded[i] };
            volumes.arriving[i] = step_s * self.arriving[i];
        }
        for _ in 0..=2 * network.tanks.len() {
            self.sum(network, &mut volumes);
            let mut mended = false;
            for (i, tank) in network.tanks.iter().enumerate() {
                let (most, volume) = (tank.height_cm * tank.area_cm2, volumes.after[i]);
                if volume < -EMPTY_SHARE * most {
                    self.scale_outflows(network, &mut volumes, i, dry);
                    mended = true;
                    break;
                }
                if volume > most * (1.0 + 1e-15) {
                    volumes.spilled[i] += volume - most;
                    mended = true;
                    break;
                }
            }
            if !mended {
                break;
            }
        }
        self.book(network, &volumes, step_s, fed);
    }

    fn sum(&self, network: &Network, volumes: &mut Volumes<N>) {
        let outside = self.streams.outside();
        volumes.after = self.start;
        for (i, tank) in network.tanks.iter().enumerate() {
            volumes.after[i] *= tank.area_cm2;
        }
        for (i, tank) in network.tanks.iter().enumerate() {
            volumes.after[i] -= volumes.spilled[i];
            volumes.after[tank.spills_to.unwrap_or(outside)] += volumes.spilled[i];
        }
        for (i, feed) in self.feeds.iter().enumerate() {
            volumes.after[feed.source] -= volumes.pumped[i];
            for &(to, share) in &feed.outlets {
                volumes.after[to] += share * volumes.arriving[i];
            }
        }
        for i in 0..self.streams.len() {
            let (from, to) = self.streams.ends(i);
            volumes.after[from] -= self.volume[i];
            volumes.after[to] += self.volume[i];
        }
    }

    /// Shrinks everything that leaves an over-drawn tank so that it ends the step empty.
    fn scale_outflows(&mut self, network: &Network, volumes: &mut Volumes<N>, tank: usize, dry: &mut [bool]) {
        let leaves = |streams: &Streams<N, f64>, i: usize, volume: f64| {
            let (from, to) = streams.ends(i);
            (from == tank && volume > 0.0) || (to == tank && volume < 0.0)
        };
        let mut out = volumes.spilled[tank];
        for (i, pump) in network.pumps.iter().enumerate() {
            if pump.from == Some(tank) {
                out += volumes.pumped[i];
            }
        }
        for i in 0..self.streams.len() {
            if leaves(&self.streams, i, self.volume[i]) {
                out += self.volume[i].abs();
            }
        }
        let keep = ((out + volumes.after[tank]) / out).max(0.0);
        volumes.spilled[tank] *= keep;
        for (i, pump) in network.pumps.iter().enumerate() {
            if pump.from == Some(tank) && self.commanded[i] > 0.0 {
                volumes.pumped[i] *= keep;
                dry[i] = true;
                if self.pipes[i].arriving_cm3_s().is_none() {
                    volumes.arriving[i] *= keep;
                }
            }
        }
        for i in 0..self.streams.len() {
            if leaves(&self.streams, i, self.volume[i]) {
                self.volume[i] *= keep;
            }
        }
    }

    fn book(&mut self, network: &Network, volumes: &Volumes<N>, step_s: f64, fed: bool) {
        self.end = volumes.after;
        for (level, tank) in self.end.iter_mut().zip(&network.tanks) {
            *level = (*level / tank.area_cm2).clamp(0.0, tank.height_cm);
        }
        for (i, pipe) in self.pipes.iter_mut().enumerate() {
            if !fed {
                let whole = step_s * self.commanded[i];
                let pumped = volumes.pumped[i];
                pipe.feed(step_s, if pumped == whole { self.commanded[i] } else { pumped / step_s });
                self.span_pumped[i] += pumped;
            }
            pipe.take(step_s);
            self.span_arriving[i] += volumes.arriving[i];
        }
        for i in 0..N {
            self.span_volume[i] += self.volume[i];
            self.span_spills[i] += volumes.spilled[i];
        }
    }
}
