//! The integrator: classical Runge–Kutta in flux form, from one change of a delayed stream to the next.
//!
//! A step sums the volume of every stream and moves exactly that volume, so that what leaves one tank arrives in
//! the other. A sample that falls into a step is read from the cubic through both its ends (Hermite), for which the
//! slopes are there anyway: the flows of the valves do not jump when a stream in the air changes, only what arrives
//! does. The cubic keeps every balance that both ends keep. Where all pumps have a transport delay, a step may so
//! reach beyond the present sample; anything that is changed by hand cuts it there.
//!
//! That holds while no tank is at its rim or empty; there the steps end at the samples and [`super::rims`] mends
//! the volumes.

use super::network::Tank;
use super::pipe::Pipe;
use super::state::Plant;
use super::streams::Origin;

/// Largest λ·h of a step, well inside the stability region of the method (2.78).
const STEP_RATE: f64 = 0.4;
/// Largest change of a head within a step, as a share of √(δ² + head²). It resolves the kink of the √ law at equal
/// levels, and fast transients with it.
const STEP_CURVATURE: f64 = 0.1;
/// Most pieces a step is cut into where δ = 0 makes the slope infinite.
const MOST_PIECES: f64 = 64.0;
/// Longest step near a rim or an empty tank, in seconds.
const CAREFUL_STEP_S: f64 = 0.1;
/// Time below which nothing is left to do, in seconds.
const NO_TIME_S: f64 = 1e-10;
/// Share of a tank that the pump needs to be sure of its water for a sample.
const SURE_CM3: f64 = 1.0;

/// The step the present lies in, and scratch; sized once, so that a step allocates nothing.
#[derive(Debug, Clone)]
pub(super) struct Work {
    /// Levels of the nodes where the step began.
    pub start: Vec<f64>,
    /// Levels where it ends: the state of the integrator.
    pub end: Vec<f64>,
    /// dh/dt at its ends, in cm/s.
    pub start_slope: Vec<f64>,
    pub end_slope: Vec<f64>,
    /// Length of the step and how much of it has passed, in seconds.
    pub length_s: f64,
    pub passed_s: f64,
    /// Flow of every stream at its ends in cm³/s, and its volume in cm³.
    pub start_flow: Vec<f64>,
    pub end_flow: Vec<f64>,
    pub volume: Vec<f64>,
    /// What the streams bring each node at the end, in cm³/s.
    pub end_net: Vec<f64>,
    /// What pumps bring each node in the step, in cm³/s.
    pub inflow: Vec<f64>,
    /// What arrives from each pump in the step, in cm³/s.
    pub arriving: Vec<f64>,
    present: Vec<f64>,
    /// Volumes since the last sample: of streams, from pumps, of what arrived, over rims.
    pub span_volume: Vec<f64>,
    pub span_pumped: Vec<f64>,
    pub span_arriving: Vec<f64>,
    pub span_spills: Vec<f64>,
    /// Scratch of [`super::rims`].
    pub pumped_volume: Vec<f64>,
    pub arriving_volume: Vec<f64>,
    pub spill_volume: Vec<f64>,
    pub after: Vec<f64>,
}

impl Work {
    pub fn new(nodes: usize, tanks: usize, pumps: usize, streams: usize) -> Self {
        let zeros = |n: usize| vec![0.0; n];
        Self {
            start: zeros(nodes),
            end: zeros(nodes),
            start_slope: zeros(nodes),
            end_slope: zeros(nodes),
            length_s: 0.0,
            passed_s: 0.0,
            start_flow: zeros(streams),
            end_flow: zeros(streams),
            volume: zeros(streams),
            end_net: zeros(nodes),
            inflow: zeros(nodes),
            arriving: zeros(pumps),
            present: zeros(nodes),
            span_volume: zeros(streams),
            span_pumped: zeros(pumps),
            span_arriving: zeros(pumps),
            span_spills: zeros(tanks),
            pumped_volume: zeros(pumps),
            arriving_volume: zeros(pumps),
            spill_volume: zeros(tanks),
            after: zeros(nodes),
        }
    }
}

/// Weights of both ends' values and slopes in the cubic through a step, at a share of it.
#[derive(Debug, Clone, Copy)]
struct Hermite {
    /// Of the difference of the values.
    rise: f64,
    /// Of the slope at the start times the length.
    start: f64,
    /// Of the slope at the end times the length.
    end: f64,
}

impl Hermite {
    #[inline]
    fn at(share: f64, length_s: f64) -> Self {
        let left = 1.0 - share;
        Self {
            rise: share * share * (3.0 - 2.0 * share),
            start: length_s * share * left * left,
            end: -length_s * share * share * left,
        }
    }
}

impl Plant {
    /// Lets `duration_s` pass with constant inputs. Flows afterwards are the means over `duration_s`.
    pub fn advance(&mut self, duration_s: f64) {
        let fed = self.look_ahead && self.pumps_are_sure(duration_s);
        if self.look_ahead && !fed {
            self.cut();
        }
        self.begin_span();
        if fed {
            self.feed(duration_s);
        }
        if fed || !self.look_ahead {
            let left_s = self.glide(duration_s);
            if left_s > NO_TIME_S {
                self.cut();
                self.advance_carefully(left_s, fed);
            }
        } else {
            self.advance_carefully(duration_s, false);
        }
        self.read_out();
        self.end_span(duration_s);
    }

    /// Whether every tank that pumps draw from has water for them without a look at the step.
    fn pumps_are_sure(&self, duration_s: f64) -> bool {
        self.network.pumps.iter().zip(&self.commanded).all(|(pump, flow)| {
            pump.from.is_none_or(|tank| {
                // More than one pump may draw: twice their sum is on the safe side.
                let held = self.levels_cm[tank] * self.network.tanks[tank].area_cm2;
                held > SURE_CM3 + 2.0 * duration_s * flow * self.network.pumps.len() as f64
            })
        })
    }

    /// Takes what the pumps draw in a sample out of its source and lets it into the air.
    fn feed(&mut self, duration_s: f64) {
        for (i, pump) in self.network.pumps.iter().enumerate() {
            let flow = self.commanded[i];
            self.pipes[i].feed(duration_s, flow);
            let node = pump.from.unwrap_or(self.streams.outside());
            let drop = duration_s * flow * self.streams.per_area[node];
            self.work.start[node] -= drop;
            self.work.end[node] -= drop;
            self.work.span_pumped[i] = duration_s * flow;
        }
    }

    /// Goes on in whole steps until `duration_s` lies in one; gives the time left when a tank stands in the way.
    fn glide(&mut self, duration_s: f64) -> f64 {
        let mut left_s = duration_s;
        loop {
            let rest_s = self.work.length_s - self.work.passed_s;
            if rest_s >= left_s - NO_TIME_S {
                self.work.passed_s = (self.work.passed_s + left_s).min(self.work.length_s);
                return 0.0;
            }
            left_s -= rest_s;
            self.work.passed_s = self.work.length_s;
            if !self.begin_step(duration_s, left_s) {
                return left_s;
            }
        }
    }

    /// Takes the next step; false when a tank would pass its rim or its floor, and then nothing has changed.
    fn begin_step(&mut self, longest_s: f64, left_s: f64) -> bool {
        self.count_span(1.0);
        let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(longest_s, f64::min);
        let most_s = if self.look_ahead { change_s } else { change_s.min(left_s) };
        self.set_inflow();
        let work = &mut self.work;
        std::mem::swap(&mut work.start, &mut work.end);
        std::mem::swap(&mut work.start_flow, &mut work.end_flow);
        for (i, slope) in work.start_slope.iter_mut().enumerate() {
            *slope = (work.end_net[i] + work.inflow[i]) * self.streams.per_area[i];
        }
        let pieces = self.streams.pieces(&work.start, &work.start_slope, most_s, STEP_RATE, STEP_CURVATURE);
        let step_s = most_s / (pieces - 1e-9).ceil().clamp(1.0, MOST_PIECES);
        self.runge_kutta::<false>(step_s);
        let work = &mut self.work;
        let tanks = &self.network.tanks;
        let inside = work.end.iter().zip(tanks).all(|(&h, tank)| (0.0..=tank.height_cm).contains(&h));
        if !inside {
            std::mem::swap(&mut work.start, &mut work.end);
            std::mem::swap(&mut work.start_flow, &mut work.end_flow);
            self.evaluate_end();
            (self.work.length_s, self.work.passed_s) = (0.0, 0.0);
            return false;
        }
        self.evaluate_end();
        let work = &mut self.work;
        for (i, slope) in work.end_slope.iter_mut().enumerate() {
            *slope = (work.end_net[i] + work.inflow[i]) * self.streams.per_area[i];
        }
        (work.length_s, work.passed_s) = (step_s, 0.0);
        for (pipe, &flow) in self.pipes.iter_mut().zip(&self.commanded) {
            if !self.look_ahead {
                pipe.feed(step_s, flow);
            }
            pipe.take(step_s);
        }
        self.steps += 1;
        true
    }

    /// What pumps bring each node from now to the next change in the air.
    pub(super) fn set_inflow(&mut self) {
        let work = &mut self.work;
        work.inflow.fill(0.0);
        for (i, pump) in self.network.pumps.iter().enumerate() {
            let arriving = self.pipes[i].arriving_cm3_s().unwrap_or(self.commanded[i]);
            work.arriving[i] = arriving;
            for &(to, share) in &pump.outlets {
                work.inflow[to] += share * arriving;
            }
            if !self.look_ahead {
                work.inflow[pump.from.unwrap_or(self.streams.outside())] -= self.commanded[i];
            }
        }
    }

    /// One step from `start`, whose slope and flows are there; gives `end` and the volume of every stream.
    fn runge_kutta<const GUARD: bool>(&mut self, h: f64) {
        match self.streams.nodes() {
            8 => self.runge_kutta_of::<8, GUARD>(h),
            16 => self.runge_kutta_of::<16, GUARD>(h),
            // A function of its own: its large arrays must not make the small ones' frame large.
            _ => self.large_runge_kutta::<GUARD>(h),
        }
    }

    #[inline(never)]
    fn large_runge_kutta<const GUARD: bool>(&mut self, h: f64) {
        if self.streams.nodes() == 64 {
            self.runge_kutta_of::<64, GUARD>(h);
        } else {
            self.runge_kutta_of::<1024, GUARD>(h);
        }
    }

    #[inline(always)]
    fn runge_kutta_of<const N: usize, const GUARD: bool>(&mut self, h: f64) {
        let (work, streams) = (&mut self.work, &self.streams);
        let chunks = (
            work.start.first_chunk::<N>(),
            work.start_slope.first_chunk::<N>(),
            work.inflow.first_chunk::<N>(),
            streams.per_area.first_chunk::<N>(),
            work.end.first_chunk_mut::<N>(),
        );
        let (Some(start), Some(first), Some(inflow), Some(per_area), Some(end)) = chunks else { return };
        let volumes = &mut work.volume[..streams.len()];
        volumes.copy_from_slice(&work.start_flow[..streams.len()]);
        let mut slope = *first;
        for (share, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            let stage: [f64; N] = std::array::from_fn(|i| start[i] + share * h * slope[i]);
            let net = streams.evaluate::<N, GUARD>(&stage, |i, flow| {
                if let Some(volume) = volumes.get_mut(i) {
                    *volume += weight * flow;
                }
            });
            slope = std::array::from_fn(|i| (net[i] + inflow[i]) * per_area[i]);
            if GUARD {
                hold_at_rims(&stage, &mut slope, &self.network.tanks);
            }
        }
        let mut moved: [f64; N] = std::array::from_fn(|i| h * inflow[i]);
        for (i, volume) in volumes.iter_mut().enumerate() {
            *volume *= h / 6.0;
            let (from, to) = streams.ends(i);
            moved[from & (N - 1)] -= *volume;
            moved[to & (N - 1)] += *volume;
        }
        *end = std::array::from_fn(|i| start[i] + moved[i] * per_area[i]);
    }

    /// Flows of the streams at the end of the step, and what they bring.
    pub(super) fn evaluate_end(&mut self) {
        match self.streams.nodes() {
            8 => self.evaluate_end_of::<8>(),
            16 => self.evaluate_end_of::<16>(),
            _ => self.evaluate_large_end(),
        }
    }

    #[inline(never)]
    fn evaluate_large_end(&mut self) {
        if self.streams.nodes() == 64 {
            self.evaluate_end_of::<64>();
        } else {
            self.evaluate_end_of::<1024>();
        }
    }

    #[inline(always)]
    fn evaluate_end_of<const N: usize>(&mut self) {
        let work = &mut self.work;
        let (Some(end), Some(net)) = (work.end.first_chunk::<N>(), work.end_net.first_chunk_mut::<N>())
        else {
            return;
        };
        let flows = &mut work.end_flow[..self.streams.len()];
        *net = self.streams.evaluate::<N, true>(end, |i, flow| {
            if let Some(end_flow) = flows.get_mut(i) {
                *end_flow = flow;
            }
        });
    }

    fn begin_span(&mut self) {
        let work = &mut self.work;
        work.span_volume.fill(0.0);
        work.span_spills.fill(0.0);
        work.span_pumped.fill(0.0);
        work.span_arriving.fill(0.0);
        self.dry.copy_from_slice(&self.airlocked);
        // What of the present step lies before this span does not count.
        self.count_span(-1.0);
    }

    /// Adds `sign` times what has passed of the present step to the volumes of the span.
    pub(super) fn count_span(&mut self, sign: f64) {
        let work = &mut self.work;
        if work.passed_s == 0.0 {
            return;
        }
        let count = self.streams.len();
        let whole = work.passed_s >= work.length_s;
        let w = Hermite::at(work.passed_s / work.length_s, work.length_s);
        for i in 0..count {
            let volume = if whole {
                work.volume[i]
            } else {
                w.rise * work.volume[i] + w.start * work.start_flow[i] + w.end * work.end_flow[i]
            };
            work.span_volume[i] += sign * volume;
        }
        for (span, arriving) in work.span_arriving.iter_mut().zip(&work.arriving) {
            *span += sign * arriving * work.passed_s;
        }
        if !self.look_ahead {
            for (span, pumped) in work.span_pumped.iter_mut().zip(&self.commanded) {
                *span += sign * pumped * work.passed_s;
            }
        }
    }

    /// Levels of the present, from the step it lies in.
    pub(super) fn read_out(&mut self) {
        let work = &self.work;
        let tanks = self.levels_cm.len();
        if work.passed_s >= work.length_s {
            self.levels_cm.copy_from_slice(&work.end[..tanks]);
            return;
        }
        let w = Hermite::at(work.passed_s / work.length_s, work.length_s);
        for (i, level) in self.levels_cm.iter_mut().enumerate() {
            *level = self.work.between(w, i);
        }
    }

    /// Ends the present step now: what is changed from here on acts from here on.
    pub(super) fn cut(&mut self) {
        let rest_s = self.work.length_s - self.work.passed_s;
        if rest_s > 0.0 && self.work.length_s > 0.0 {
            let w = Hermite::at(self.work.passed_s / self.work.length_s, self.work.length_s);
            for i in 0..self.streams.nodes() {
                self.work.present[i] = self.work.between(w, i);
            }
            let work = &mut self.work;
            work.end.copy_from_slice(&work.present);
            for (pipe, &arriving) in self.pipes.iter_mut().zip(&work.arriving) {
                if pipe.delay_s() > 0.0 {
                    pipe.give_back(rest_s, arriving);
                }
            }
            self.evaluate_end();
        }
        (self.work.length_s, self.work.passed_s) = (0.0, 0.0);
    }

    fn end_span(&mut self, duration_s: f64) {
        self.count_span(1.0);
        let work = &self.work;
        let per_s = 1.0 / duration_s;
        for (i, origin) in self.streams.origins.iter().enumerate() {
            match *origin {
                Origin::Valve(valve) => self.valve_flows[valve] = work.span_volume[i] * per_s,
                Origin::Leak(tank) => self.leak_flows[tank] = work.span_volume[i] * per_s,
            }
        }
        for (i, flow) in self.pumped_flows.iter_mut().enumerate() {
            *flow = work.span_pumped[i] * per_s;
            self.arriving_flows[i] = work.span_arriving[i] * per_s;
        }
        for (flow, volume) in self.spill_flows.iter_mut().zip(&work.span_spills) {
            *flow = volume * per_s;
        }
    }

    /// Steps near a rim or an empty tank: short, ending at the sample. `fed` pumps have had their water.
    fn advance_carefully(&mut self, duration_s: f64, fed: bool) {
        let mut left_s = duration_s;
        while left_s > NO_TIME_S {
            let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(left_s, f64::min);
            let step_s = self.careful_step(change_s, fed);
            left_s -= step_s;
        }
    }

    fn careful_step(&mut self, most_s: f64, fed: bool) -> f64 {
        let most_s = most_s.min(CAREFUL_STEP_S);
        self.set_inflow();
        self.evaluate_end();
        let work = &mut self.work;
        std::mem::swap(&mut work.start, &mut work.end);
        std::mem::swap(&mut work.start_flow, &mut work.end_flow);
        for (i, slope) in work.start_slope.iter_mut().enumerate() {
            *slope = (work.end_net[i] + work.inflow[i]) * self.streams.per_area[i];
        }
        hold_at_rims(&work.start, &mut work.start_slope, &self.network.tanks);
        let pieces = self.streams.pieces(&work.start, &work.start_slope, most_s, STEP_RATE, STEP_CURVATURE);
        let step_s = most_s / (pieces - 1e-9).ceil().clamp(1.0, MOST_PIECES);
        self.runge_kutta::<true>(step_s);
        self.mend(step_s, fed);
        self.evaluate_end();
        (self.work.length_s, self.work.passed_s) = (0.0, 0.0);
        self.steps += 1;
        step_s
    }
}

/// A tank at its rim stays there while more comes in than leaves.
fn hold_at_rims(levels: &[f64], slope: &mut [f64], tanks: &[Tank]) {
    for ((level, slope), tank) in levels.iter().zip(slope).zip(tanks) {
        if *level >= tank.height_cm {
            *slope = slope.min(0.0);
        }
    }
}

impl Work {
    /// Level of a node now.
    pub fn present(&self, node: usize) -> f64 {
        if self.passed_s >= self.length_s {
            return self.end[node];
        }
        self.between(Hermite::at(self.passed_s / self.length_s, self.length_s), node)
    }

    #[inline]
    fn between(&self, w: Hermite, i: usize) -> f64 {
        let (start, end) = (self.start[i], self.end[i]);
        start + w.rise * (end - start) + w.start * self.start_slope[i] + w.end * self.end_slope[i]
    }
}
