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

use super::lanes::Number;
use super::network::{Network, Pump};
use super::pipe::Pipe;
use super::streams::Streams;

/// Largest λ·h of a step, well inside the stability region of the method (2.78).
pub(super) const STEP_RATE: f64 = 0.4;
/// Largest change of a head within a step, as a share of √(δ² + head²). It resolves the kink of the √ law at equal
/// levels, and fast transients with it.
pub(super) const STEP_CURVATURE: f64 = 0.15;
/// Largest (λ·h)⁴ times the change of a head within a step, in cm: what the method's error is a small share of.
pub(super) const STEP_ERROR_CM: f64 = 1e-4;
/// Most pieces a step is cut into where δ = 0 makes the slope infinite.
const MOST_PIECES: f64 = 64.0;
/// Time below which nothing is left to do, in seconds.
pub(super) const NO_TIME_S: f64 = 1e-10;
/// Water a tank has to hold beyond a sample's pumping, so that the pump is sure of it without a look at the step.
const SURE_CM3: f64 = 1.0;

/// A pump by the nodes it draws from and feeds.
#[derive(Debug, Clone)]
pub(super) struct Feed {
    pub source: usize,
    pub outlets: Vec<(usize, f64)>,
}

/// Levels, streams and what is in the air; `N` is the length of every array (see [`super::streams`]).
#[derive(Debug, Clone)]
pub(crate) struct Motion<const N: usize, V> {
    pub streams: Streams<N, V>,
    pub pipes: Vec<Pipe<V>>,
    pub(super) feeds: Vec<Feed>,
    /// Flow each pump draws, in cm³/s.
    pub commanded: [V; N],
    /// Steps may reach beyond the present: all that arrives until then is in the air already.
    pub(super) look_ahead: bool,
    tanks: usize,
    heights: [V; N],
    areas: [V; N],
    /// Node that takes each tank's spill.
    spills_to: Vec<usize>,
    /// Levels of the nodes where the step began, and where it ends: the state of the integrator.
    pub(super) start: [V; N],
    pub end: [V; N],
    /// dh/dt at both ends, in cm/s.
    pub(super) start_slope: [V; N],
    end_slope: [V; N],
    /// Length of the step and how much of it has passed, in seconds.
    pub(super) length_s: f64,
    pub(super) passed_s: f64,
    /// Flow of every stream at both ends in cm³/s, and its volume in cm³.
    pub(super) start_flow: [V; N],
    pub(super) end_flow: [V; N],
    pub(super) volume: [V; N],
    /// dh/dt that the streams bring each node at the end, and pumps in the step, in cm/s.
    pub(super) end_net: [V; N],
    pub(super) inflow: [V; N],
    /// What arrives from each pump in the step, in cm³/s.
    pub(super) arriving: [V; N],
    /// What of the present step's volumes earlier spans have counted.
    counted: [V; N],
    counted_s: f64,
    /// Volumes of the span that [`Self::advance`] covered: of streams, from pumps, of what arrived, over rims.
    pub span_volume: [V; N],
    pub span_pumped: [V; N],
    pub span_arriving: [V; N],
    pub span_spills: [V; N],
    /// Tanks that a careful step leaves empty, and the equations of their outflows: scratch of [`super::rims`].
    pub(super) emptied: Vec<usize>,
    pub(super) system: Vec<f64>,
    /// Steps taken.
    pub steps: u64,
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
    #[inline(always)]
    fn at(share: f64, length_s: f64) -> Self {
        let left = 1.0 - share;
        Self {
            rise: share * share * (3.0 - 2.0 * share),
            start: length_s * share * left * left,
            end: -length_s * share * share * left,
        }
    }
}

/// An array over nodes. A plain loop: `array::from_fn` is not always taken apart into vector instructions.
#[inline(always)]
fn nodes<const N: usize, V: Number>(node: impl Fn(usize) -> V) -> [V; N] {
    let mut made = [V::of(0.0); N];
    for (i, made) in made.iter_mut().enumerate() {
        *made = node(i);
    }
    made
}

impl<const N: usize, V: Number> Motion<N, V> {
    /// A rig at rest with everything empty; `areas_cm2` of the tanks, `coefficients` of the valves.
    pub fn new(network: &Network, areas_cm2: &[V], coefficients: &[V], pipes: Vec<Pipe<V>>) -> Self {
        let tanks = network.tanks.len();
        let zero = [V::of(0.0); N];
        let streams = Streams::new(network, areas_cm2, coefficients, &vec![V::of(0.0); tanks]);
        let outside = streams.outside();
        let feed = |p: &Pump| Feed { source: p.from.unwrap_or(outside), outlets: p.outlets.clone() };
        let (mut heights, mut areas) = (zero, [V::of(1.0); N]);
        for (i, tank) in network.tanks.iter().enumerate() {
            (heights[i], areas[i]) = (V::of(tank.height_cm), areas_cm2[i]);
        }
        let mut made = Self {
            feeds: network.pumps.iter().map(feed).collect(),
            streams,
            pipes,
            commanded: zero,
            look_ahead: false,
            tanks,
            heights,
            areas,
            spills_to: network.tanks.iter().map(|t| t.spills_to.unwrap_or(outside)).collect(),
            start: zero,
            end: zero,
            start_slope: zero,
            end_slope: zero,
            length_s: 0.0,
            passed_s: 0.0,
            start_flow: zero,
            end_flow: zero,
            volume: zero,
            end_net: zero,
            inflow: zero,
            arriving: zero,
            counted: zero,
            counted_s: 0.0,
            span_volume: zero,
            span_pumped: zero,
            span_arriving: zero,
            span_spills: zero,
            emptied: vec![],
            system: vec![],
            steps: 0,
        };
        made.restart();
        made
    }

    /// Looks at streams, pipes and levels anew, at the present.
    pub fn restart(&mut self) {
        let early = |feed: &Feed| feed.source >= self.tanks || !self.streams.drives(feed.source);
        self.look_ahead = self.feeds.iter().all(early) && self.pipes.iter().all(|p| p.delay_s() > 0.0);
        self.no_step();
        self.evaluate_end();
    }

    /// Lets `duration_s` pass with constant inputs while no tank gets to its rim or empty. Gives the time that is left
    /// where one does, and whether the pumps have had their water for it.
    pub fn advance(&mut self, duration_s: f64) -> (f64, bool) {
        let fed = self.look_ahead && self.pumps_are_sure(duration_s);
        if self.look_ahead && !fed {
            self.cut();
        }
        self.begin_span();
        if fed {
            self.feed(duration_s);
        } else if self.look_ahead {
            return (duration_s, false);
        }
        let left_s = self.glide(duration_s);
        (left_s, fed)
    }

    /// Whether every tank that pumps draw from has water for them without a look at the step.
    fn pumps_are_sure(&self, duration_s: f64) -> bool {
        // More than one pump may draw from a tank: as many times the flow is on the safe side.
        let sure_s = 2.0 * duration_s * self.feeds.len() as f64;
        self.feeds.iter().zip(&self.commanded).all(|(feed, &flow)| {
            feed.source >= self.tanks
                || (self.present(feed.source) * self.areas[feed.source] - flow * sure_s).smallest() > SURE_CM3
        })
    }

    /// Takes what the pumps draw in a sample out of its source and lets it into the air.
    fn feed(&mut self, duration_s: f64) {
        for (i, feed) in self.feeds.iter().enumerate() {
            let flow = self.commanded[i];
            self.pipes[i].feed(duration_s, flow);
            let drop = flow * self.streams.per_area[feed.source] * duration_s;
            self.start[feed.source] -= drop;
            self.end[feed.source] -= drop;
            self.span_pumped[i] = flow * duration_s;
        }
    }

    /// Goes on in whole steps until `duration_s` lies in one; gives the time left when a tank stands in the way.
    fn glide(&mut self, duration_s: f64) -> f64 {
        let mut left_s = duration_s;
        loop {
            let rest_s = self.length_s - self.passed_s;
            if rest_s >= left_s - NO_TIME_S {
                self.passed_s = (self.passed_s + left_s).min(self.length_s);
                return 0.0;
            }
            left_s -= rest_s;
            self.passed_s = self.length_s;
            if !self.begin_step(duration_s, left_s) {
                return left_s;
            }
        }
    }

    /// Takes the next step; false when a tank would pass its rim or its floor, and then nothing has changed.
    fn begin_step(&mut self, longest_s: f64, left_s: f64) -> bool {
        self.count_whole();
        let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(longest_s, f64::min);
        let most_s = if self.look_ahead { change_s } else { change_s.min(left_s) };
        self.prepare_step();
        let step_s = self.length_for(most_s, MOST_PIECES);
        self.runge_kutta::<false>(step_s);
        let inside = self
            .end
            .iter()
            .zip(&self.heights)
            .take(self.tanks)
            .all(|(&level, &height)| level.smallest() >= 0.0 && (height - level).smallest() >= 0.0);
        if !inside {
            (self.end, self.end_flow) = (self.start, self.start_flow);
            self.evaluate_end();
            self.no_step();
            return false;
        }
        self.evaluate_end();
        self.end_slope = nodes(|i| self.end_net[i] + self.inflow[i]);
        self.no_step();
        self.length_s = step_s;
        for (i, pipe) in self.pipes.iter_mut().enumerate() {
            if !self.look_ahead {
                pipe.feed(step_s, self.commanded[i]);
            }
            pipe.take(step_s);
        }
        self.steps += 1;
        true
    }

    /// Starts a step at the present end.
    pub(super) fn prepare_step(&mut self) {
        self.set_inflow();
        (self.start, self.start_flow) = (self.end, self.end_flow);
        self.start_slope = nodes(|i| self.end_net[i] + self.inflow[i]);
    }

    /// Length of a step of at most `most_s` that resolves every stream from `start`.
    pub(super) fn length_for(&self, most_s: f64, most_pieces: f64) -> f64 {
        let pieces = self.streams.pieces(&self.start, &self.start_slope, most_s);
        if pieces > 1.0 { most_s / (pieces - 1e-9).ceil().min(most_pieces) } else { most_s }
    }

    /// What pumps bring each node from now to the next change in the air.
    fn set_inflow(&mut self) {
        self.inflow = [V::of(0.0); N];
        for (i, feed) in self.feeds.iter().enumerate() {
            let arriving = self.pipes[i].arriving_cm3_s().unwrap_or(self.commanded[i]);
            self.arriving[i] = arriving;
            for &(to, share) in &feed.outlets {
                self.inflow[to] += arriving * self.streams.per_area[to] * share;
            }
            if !self.look_ahead {
                self.inflow[feed.source] -= self.commanded[i] * self.streams.per_area[feed.source];
            }
        }
    }

    /// One step from `start`, whose slope and flows are there; gives `end` and the volume of every stream.
    #[inline(always)]
    pub(super) fn runge_kutta<const GUARD: bool>(&mut self, h: f64) {
        self.volume = self.start_flow;
        let mut slope = self.start_slope;
        for (share, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            let stage: [V; N] = nodes(|i| self.start[i] + slope[i] * (share * h));
            slope = self.streams.evaluate::<GUARD>(&stage, &self.inflow, weight, &mut self.volume);
            if GUARD {
                self.hold_at_rims(&stage, &mut slope);
            }
        }
        let volume = self.volume;
        self.volume = nodes(|i| volume[i] * (h / 6.0));
        self.end = nodes(|i| self.start[i] + self.inflow[i] * h);
        self.streams.move_volumes(&self.volume, &mut self.end);
    }

    /// A tank at its rim stays there while more comes in than leaves; the rest is handed on to where it spills to,
    /// which may be at its rim as well.
    pub(super) fn hold_at_rims(&self, levels: &[V; N], slope: &mut [V; N]) {
        for _ in 0..self.tanks {
            let mut handed = false;
            for i in 0..self.tanks {
                if (levels[i] - self.heights[i]).largest() >= 0.0 && slope[i].largest() > 0.0 {
                    let to = self.spills_to[i];
                    slope[to] += slope[i] * self.areas[i] * self.streams.per_area[to];
                    slope[i] = V::of(0.0);
                    handed = true;
                }
            }
            if !handed {
                return;
            }
        }
    }

    /// Flows of the streams at the end of the step, and what they bring.
    #[inline(always)]
    pub(super) fn evaluate_end(&mut self) {
        self.end_flow = [V::of(0.0); N];
        self.end_net = self.streams.evaluate::<true>(&self.end, &[V::of(0.0); N], 1.0, &mut self.end_flow);
    }

    fn begin_span(&mut self) {
        let zero = [V::of(0.0); N];
        (self.span_volume, self.span_spills) = (zero, zero);
        (self.span_pumped, self.span_arriving) = (zero, zero);
    }

    /// Ends the span at the present.
    pub fn end_span(&mut self) {
        if self.passed_s >= self.length_s {
            self.count_whole();
            return;
        }
        let w = Hermite::at(self.passed_s / self.length_s, self.length_s);
        let volume: [V; N] =
            nodes(|i| self.volume[i] * w.rise + self.start_flow[i] * w.start + self.end_flow[i] * w.end);
        self.count(volume, self.passed_s);
    }

    /// Adds what has passed of the present step, all of it, to the volumes of the span.
    fn count_whole(&mut self) {
        self.count(self.volume, self.length_s);
    }

    /// Adds what the present step has moved so far, less what earlier spans have counted of it.
    #[inline(always)]
    fn count(&mut self, volume: [V; N], passed_s: f64) {
        let new_s = passed_s - self.counted_s;
        if new_s <= 0.0 {
            return;
        }
        for i in 0..self.streams.len() {
            self.span_volume[i & (N - 1)] += volume[i & (N - 1)] - self.counted[i & (N - 1)];
        }
        for i in 0..self.feeds.len() {
            self.span_arriving[i & (N - 1)] += self.arriving[i & (N - 1)] * new_s;
            if !self.look_ahead {
                self.span_pumped[i & (N - 1)] += self.commanded[i & (N - 1)] * new_s;
            }
        }
        (self.counted, self.counted_s) = (volume, passed_s);
    }

    /// The present step is over, or not begun: nothing of it has been counted.
    pub(super) fn no_step(&mut self) {
        (self.length_s, self.passed_s) = (0.0, 0.0);
        (self.counted, self.counted_s) = ([V::of(0.0); N], 0.0);
    }

    /// Level of a node now, in cm; of outside and floor, the volume in cm³.
    #[inline(always)]
    pub fn present(&self, node: usize) -> V {
        if self.passed_s >= self.length_s {
            return self.end[node];
        }
        self.between(Hermite::at(self.passed_s / self.length_s, self.length_s), node)
    }

    /// Levels of all nodes now.
    #[inline(always)]
    pub fn presents(&self) -> [V; N] {
        if self.passed_s >= self.length_s {
            return self.end;
        }
        let w = Hermite::at(self.passed_s / self.length_s, self.length_s);
        nodes(|i| self.between(w, i))
    }

    #[inline(always)]
    fn between(&self, w: Hermite, i: usize) -> V {
        let rise = self.end[i] - self.start[i];
        self.start[i] + rise * w.rise + self.start_slope[i] * w.start + self.end_slope[i] * w.end
    }

    /// Water in the air now, in cm³: what the present step has taken out of it beyond the present is still there.
    pub fn in_flight(&self) -> V {
        let ahead_s = self.length_s - self.passed_s;
        let delayed = self.pipes.iter().zip(&self.arriving).filter(|(pipe, _)| pipe.delay_s() > 0.0);
        delayed.fold(V::of(0.0), |sum, (pipe, &arriving)| sum + pipe.volume_cm3() + arriving * ahead_s)
    }

    /// Ends the present step now: what is changed from here on acts from here on.
    pub fn cut(&mut self) {
        let rest_s = self.length_s - self.passed_s;
        if rest_s > 0.0 {
            self.end = self.presents();
            for (pipe, &arriving) in self.pipes.iter_mut().zip(&self.arriving) {
                if pipe.delay_s() > 0.0 {
                    pipe.give_back(rest_s, arriving);
                }
            }
            self.evaluate_end();
        }
        self.no_step();
    }
}
