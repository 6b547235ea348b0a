//! Rims, empty tanks and dry pumps: what a step would take that is not there, or bring that does not fit, is mended
//! in volumes, so that no water is made or lost.

use super::motion::{Motion, NO_TIME_S};
use super::network::Network;
use super::pipe::Pipe;
use super::streams::Resolution;

/// Longest step near a rim or an empty tank, in seconds.
const CAREFUL_STEP_S: f64 = 0.1;

/// What the classical Runge–Kutta method of such a step resolves.
const CAREFUL: Resolution = Resolution { curvature: 0.15, rate: 0.4, error_cm: 1e-4 };
/// Most pieces such a step is cut into: what empties does so in a moment anyway.
const CAREFUL_PIECES: f64 = 8.0;

/// Volumes of a step in cm³ while they are mended.
#[derive(Debug, Clone)]
struct Volumes<const N: usize, const S: usize> {
    streams: [f64; S],
    pumped: [f64; N],
    arriving: [f64; N],
    spilled: [f64; N],
    /// What every node holds after the step.
    after: [f64; N],
}

impl<const N: usize, const S: usize> Motion<N, S, f64> {
    /// Lets `duration_s` pass in short steps that end with it, minding rims and empty tanks. `fed` pumps have had
    /// their water; `dry` tells which of the others found none.
    #[inline(never)]
    pub fn advance_carefully(&mut self, network: &Network, duration_s: f64, fed: bool, dry: &mut [bool]) {
        self.cut();
        let mut left_s = duration_s;
        while left_s > NO_TIME_S {
            let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(left_s, f64::min);
            left_s -= self.careful_step(network, change_s, fed, dry);
        }
        self.now = self.end;
    }

    fn careful_step(&mut self, network: &Network, most_s: f64, fed: bool, dry: &mut [bool]) -> f64 {
        self.prepare_step();
        let mut slope = self.inflow;
        self.streams.bring(&self.start_flow, &mut slope);
        // A tank held at its rim does not hurry.
        self.hold_at_rims(&self.start, &mut slope);
        let head_slope = self.streams.heads(&slope);
        let step_s = self.length_for(&head_slope, most_s.min(CAREFUL_STEP_S), CAREFUL_PIECES, CAREFUL);
        self.guarded_runge_kutta(slope, step_s);
        self.mend(network, step_s, fed, dry);
        self.evaluate_end();
        self.no_step();
        self.steps += 1;
        step_s
    }

    /// One step of the classical method from `start`, whose flows are there and where the levels have this slope; gives the volume of every
    /// stream.
    fn guarded_runge_kutta(&mut self, mut slope: [f64; N], h: f64) {
        let mut sum = self.start_flow;
        for (share, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            let mut stage = self.start;
            for (level, slope) in stage.iter_mut().zip(&slope) {
                *level += slope * (share * h);
            }
            let flows = self.streams.guarded_flows(&stage);
            slope = self.inflow;
            self.streams.bring(&flows, &mut slope);
            self.hold_at_rims(&stage, &mut slope);
            for (sum, flow) in sum.iter_mut().zip(&flows) {
                *sum += flow * weight;
            }
        }
        self.volume = sum.map(|sum| sum * (h / 6.0));
    }

    /// A tank at its rim stays there while more comes in than leaves; the rest is handed on to where it spills to,
    /// which may be at its rim as well.
    fn hold_at_rims(&self, levels: &[f64; N], slope: &mut [f64; N]) {
        for _ in 0..self.tanks {
            let mut handed = false;
            for i in 0..self.tanks {
                if levels[i] >= self.heights[i] && slope[i] > 0.0 {
                    let to = self.spills_to[i];
                    let spill = slope[i] * self.areas[i] * self.spill_shares[i];
                    slope[to] += spill * self.streams.per_area[to];
                    slope[i] = 0.0;
                    handed = true;
                }
            }
            if !handed {
                return;
            }
        }
    }

    /// Moves the volumes of a step from start to end, mended until every tank can hold and give them.
    fn mend(&mut self, network: &Network, step_s: f64, fed: bool, dry: &mut [bool]) {
        let mut wanted = Volumes {
            streams: self.volume,
            pumped: [0.0; N],
            arriving: [0.0; N],
            spilled: [0.0; N],
            after: [0.0; N],
        };
        for i in 0..network.pumps.len() {
            wanted.pumped[i] = if fed { 0.0 } else { step_s * self.commanded[i] };
            wanted.arriving[i] = step_s * self.arriving[i];
        }
        let mut volumes = wanted.clone();
        self.sum(network, &mut volumes);
        self.empty(network, &wanted, &mut volumes, dry);
        self.spill(network, &mut volumes);
        self.book(network, &volumes, step_s, fed);
    }

    /// Shrinks everything that leaves tanks which have less than that, so that they end the step empty.
    ///
    /// What one tank gives less, the next may not give either, round the whole circuit: with the shares x of the
    /// empty tanks' outflows, `out_i x_i − Σ_j (from j to i) x_j = held_i`, a small linear system.
    fn empty(
        &mut self,
        network: &Network,
        wanted: &Volumes<N, S>,
        volumes: &mut Volumes<N, S>,
        dry: &mut [bool],
    ) {
        self.emptied.clear();
        loop {
            let before = self.emptied.len();
            for i in 0..network.tanks.len() {
                if volumes.after[i] < 0.0 && !self.emptied.contains(&i) {
                    self.emptied.push(i);
                }
            }
            if self.emptied.len() == before {
                return;
            }
            let mut share = [1.0; N];
            for &tank in &self.emptied {
                share[tank] = 0.0;
            }
            self.scale(wanted, volumes, &share);
            self.sum(network, volumes);
            self.build_system(wanted, volumes);
            self.solve_system(&mut share);
            self.scale(wanted, volumes, &share);
            self.sum(network, volumes);
            for (dry, (feed, &flow)) in dry.iter_mut().zip(self.feeds.iter().zip(&self.commanded)) {
                *dry |= flow > 0.0 && self.emptied.contains(&feed.source);
            }
        }
    }

    /// The tank a stream's volume leaves.
    fn left_by(&self, stream: usize, volume: f64) -> (usize, usize) {
        let (from, to) = self.streams.ends(stream);
        if volume >= 0.0 { (from, to) } else { (to, from) }
    }

    /// Volumes of which only a share leaves each tank.
    fn scale(&self, wanted: &Volumes<N, S>, volumes: &mut Volumes<N, S>, share: &[f64; N]) {
        for i in 0..self.streams.len() {
            volumes.streams[i] = wanted.streams[i] * share[self.left_by(i, wanted.streams[i]).0];
        }
        for (i, feed) in self.feeds.iter().enumerate() {
            volumes.pumped[i] = wanted.pumped[i] * share[feed.source];
            if self.pipes[i].arriving_cm3_s().is_none() {
                volumes.arriving[i] = wanted.arriving[i] * share[feed.source];
            }
        }
    }

    /// Rows of the system for the emptied tanks; `volumes` hold what comes to them when they give nothing.
    fn build_system(&mut self, wanted: &Volumes<N, S>, volumes: &Volumes<N, S>) {
        let n = self.emptied.len();
        let mut system = std::mem::take(&mut self.system);
        system.clear();
        system.resize(n * (n + 1), 0.0);
        let row = |tank: usize| self.emptied.iter().position(|&t| t == tank);
        let mut add = |from: usize, to: usize, volume: f64| {
            if let (Some(column), Some(row)) = (row(from), row(to)) {
                system[row * (n + 1) + column] -= volume;
            }
        };
        for i in 0..self.streams.len() {
            let (from, to) = self.left_by(i, wanted.streams[i]);
            add(from, to, wanted.streams[i].abs());
            add(from, from, -wanted.streams[i].abs());
        }
        for (i, feed) in self.feeds.iter().enumerate() {
            add(feed.source, feed.source, -wanted.pumped[i]);
            if self.pipes[i].arriving_cm3_s().is_none() {
                for &(to, part) in &feed.outlets {
                    add(feed.source, to, part * wanted.arriving[i]);
                }
            }
        }
        for (row, &tank) in self.emptied.iter().enumerate() {
            system[row * (n + 1) + n] = volumes.after[tank].max(0.0);
        }
        self.system = system;
    }

    /// Gaussian elimination; columns dominate, so no pivoting. A circuit that keeps all its water gives none.
    fn solve_system(&mut self, share: &mut [f64; N]) {
        let (n, a) = (self.emptied.len(), &mut self.system);
        let width = n + 1;
        let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for p in 0..n {
            let pivot = a[p * width + p];
            if pivot <= 1e-14 * largest {
                continue;
            }
            for r in p + 1..n {
                let factor = a[r * width + p] / pivot;
                if factor != 0.0 {
                    for c in p..width {
                        a[r * width + c] -= factor * a[p * width + c];
                    }
                }
            }
        }
        for p in (0..n).rev() {
            let pivot = a[p * width + p];
            let known: f64 = (p + 1..n).map(|c| a[p * width + c] * share[self.emptied[c]]).sum();
            let x = if pivot <= 1e-14 * largest { 0.0 } else { (a[p * width + n] - known) / pivot };
            share[self.emptied[p]] = x.clamp(0.0, 1.0);
        }
    }

    /// Lets what no rim holds run over, from tank to tank.
    fn spill(&self, network: &Network, volumes: &mut Volumes<N, S>) {
        let outside = self.streams.outside();
        for _ in 0..=network.tanks.len() {
            let mut spills = false;
            for (i, tank) in network.tanks.iter().enumerate() {
                let excess = volumes.after[i] - tank.height_cm * tank.area_cm2;
                if excess > 1e-15 * tank.height_cm * tank.area_cm2 {
                    volumes.spilled[i] += excess;
                    volumes.after[i] -= excess;
                    let kept = excess * tank.spill_share;
                    volumes.after[tank.spills_to.unwrap_or(outside)] += kept;
                    volumes.after[outside] += excess - kept;
                    spills = true;
                }
            }
            if !spills {
                return;
            }
        }
        // Tanks that spill into each other round and round: what is left goes outside.
        for (i, tank) in network.tanks.iter().enumerate() {
            let excess = (volumes.after[i] - tank.height_cm * tank.area_cm2).max(0.0);
            volumes.spilled[i] += excess;
            volumes.after[i] -= excess;
            volumes.after[outside] += excess;
        }
    }

    /// What every node holds after the step.
    fn sum(&self, network: &Network, volumes: &mut Volumes<N, S>) {
        volumes.after = self.start;
        for (i, tank) in network.tanks.iter().enumerate() {
            volumes.after[i] *= tank.area_cm2;
        }
        for (i, feed) in self.feeds.iter().enumerate() {
            volumes.after[feed.source] -= volumes.pumped[i];
            for &(to, share) in &feed.outlets {
                volumes.after[to] += share * volumes.arriving[i];
            }
        }
        for i in 0..self.streams.len() {
            let (from, to) = self.streams.ends(i);
            volumes.after[from] -= volumes.streams[i];
            volumes.after[to] += volumes.streams[i];
        }
    }

    fn book(&mut self, network: &Network, volumes: &Volumes<N, S>, step_s: f64, fed: bool) {
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
        for (sum, volume) in self.span_volume.iter_mut().zip(&volumes.streams) {
            *sum += volume;
        }
        for (sum, spilled) in self.span_spills.iter_mut().zip(&volumes.spilled) {
            *sum += spilled;
        }
    }
}
