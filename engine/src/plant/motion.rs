//! The integrator: Runge–Kutta with two derivatives in flux form, from one change of a delayed stream to the next.
//!
//! The slope of a flow comes with the flow almost for nothing (`dq/dt = dq/dh · dh/dt`), so that two stages give the fourth
//! order and three the fifth (R. P. K. Chan, A. Y. J. Tsai, "On explicit two-derivative Runge–Kutta methods", Numer.
//! Algorithms 53, 2010, pp. 171–194). Far from the bends of the √ laws a step takes two stages; near them it takes three
//! and is cut where it would still be too long.
//!
//! A step sums the volume of every stream and moves exactly that volume, so that what leaves one tank arrives in
//! the other. A sample that falls into a step is read from the quintic of every stream's volume through both its ends
//! (Hermite), for which flows and their slopes are there anyway; levels follow from those volumes, so that the water adds
//! up there too. Where all pumps have a transport delay, a step may so reach beyond the present sample; anything that is
//! changed by hand cuts it there.
//!
//! That holds while no tank is at its rim or empty; there the steps end at the samples and [`super::rims`] mends
//! the volumes.

use super::lanes::Number;
use super::network::{Network, Pump};
use super::pipe::Pipe;
use super::roots::Roots;
use super::streams::{Resolution, Streams};

/// What two stages resolve.
const TWO_STAGES: Resolution = Resolution { curvature: 0.1, rate: 0.4, error_cm: 1e-4 };
/// What three stages resolve: the kink of the √ law at equal levels, and fast transients with it.
const THREE_STAGES: Resolution = Resolution { curvature: 0.4, rate: 0.4, error_cm: 3e-4 };
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

/// Levels, streams and what is in the air; `N` and `S` are the lengths of arrays (see [`super::streams`]).
#[derive(Debug, Clone)]
pub(crate) struct Motion<const N: usize, const S: usize, V> {
    pub streams: Streams<N, S, V>,
    pub pipes: Vec<Pipe<V>>,
    pub(super) feeds: Vec<Feed>,
    /// Flow each pump draws, in cm³/s.
    pub commanded: [V; N],
    /// Steps may reach beyond the present: all that arrives until then is in the air already.
    pub(super) look_ahead: bool,
    pub(super) tanks: usize,
    pub(super) heights: [V; N],
    pub(super) areas: [V; N],
    /// Node that takes each tank's spill.
    pub(super) spills_to: Vec<usize>,
    /// Share of each tank's spill that gets there.
    pub(super) spill_shares: Vec<f64>,
    /// Levels of the nodes where the step began, and where it ends: the state of the integrator.
    pub(super) start: [V; N],
    pub end: [V; N],
    /// Levels of the nodes now, in cm; of outside and floor, the volume in cm³.
    pub now: [V; N],
    /// Length of the step and how much of it has passed, in seconds.
    pub(super) length_s: f64,
    pub(super) passed_s: f64,
    /// Flow of every stream at both ends in cm³/s, and its volume in cm³.
    pub(super) start_flow: [V; S],
    pub(super) end_flow: [V; S],
    pub(super) volume: [V; S],
    /// Slope of every flow at both ends of the step, in cm³/s².
    start_bend: [V; S],
    end_bend: [V; S],
    /// Head of every stream at the end in cm, and the slope that the streams bring it, in cm/s.
    heads: [V; S],
    net: [V; S],
    /// dq/dh of every stream at the end, in cm²/s.
    steepness: [V; S],
    /// What the flows at the end came from: those of the next step are near.
    roots: Roots<S, V>,
    /// dh/dt that pumps bring each node in the step, and each head, in cm/s.
    pub(super) inflow: [V; N],
    head_inflow: [V; S],
    /// What arrives from each pump in the step, in cm³/s.
    pub(super) arriving: [V; N],
    /// What of the present step's volumes earlier spans have counted.
    counted: [V; S],
    counted_s: f64,
    /// Whether spans are counted.
    pub counts: bool,
    /// Volumes of the span that [`Self::advance`] covered: of streams, from pumps, of what arrived, over rims.
    pub span_volume: [V; S],
    pub span_pumped: [V; N],
    pub span_arriving: [V; N],
    pub span_spills: [V; N],
    /// Tanks that a careful step leaves empty, and the equations of their outflows: scratch of [`super::rims`].
    pub(super) emptied: Vec<usize>,
    pub(super) system: Vec<f64>,
    /// Steps taken.
    pub steps: u64,
}

/// Weights of both ends' volumes, flows and slopes of flows in the quintic through a step, at a share of it.
#[derive(Debug, Clone, Copy)]
struct Hermite {
    /// Of the volume.
    rise: f64,
    /// Of the flows at start and end.
    start: f64,
    end: f64,
    /// Of the slopes of the flows at start and end.
    start_bend: f64,
    end_bend: f64,
}

impl Hermite {
    #[inline(always)]
    fn at(share: f64, length_s: f64) -> Self {
        let (x, y) = (share, 1.0 - share);
        let (x2, y2, half2_s) = (x * x, y * y, 0.5 * length_s * length_s);
        Self {
            rise: x2 * x * (1.0 + 3.0 * y * (1.0 + 2.0 * y)),
            start: length_s * x * y2 * y * (1.0 + 3.0 * x),
            end: -length_s * x2 * x * y * (1.0 + 3.0 * y),
            start_bend: half2_s * x2 * y2 * y,
            end_bend: half2_s * x2 * x * y2,
        }
    }
}

impl<const N: usize, const S: usize, V: Number> Motion<N, S, V> {
    /// A rig at rest with everything empty; `areas_cm2` of the tanks, `coefficients` of the valves.
    pub fn new(network: &Network, areas_cm2: &[V], coefficients: &[V], pipes: Vec<Pipe<V>>) -> Self {
        let tanks = network.tanks.len();
        let (zero, none) = ([V::of(0.0); N], [V::of(0.0); S]);
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
            spill_shares: network.tanks.iter().map(|t| t.spill_share).collect(),
            start: zero,
            end: zero,
            now: zero,
            length_s: 0.0,
            passed_s: 0.0,
            start_flow: none,
            end_flow: none,
            volume: none,
            start_bend: none,
            end_bend: none,
            heads: none,
            net: none,
            steepness: none,
            roots: Roots::none(),
            inflow: zero,
            head_inflow: none,
            arriving: zero,
            counted: none,
            counted_s: 0.0,
            counts: true,
            span_volume: none,
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
        self.now = self.end;
        self.evaluate_end();
    }

    /// Lets `duration_s` pass with constant inputs while no tank gets to its rim or empty. Gives the time that is left
    /// where one does, and whether the pumps have had their water for it.
    #[inline(always)]
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
        self.arrive();
        (left_s, fed)
    }

    /// Whether every tank that pumps draw from has water for them without a look at the step.
    #[inline(always)]
    fn pumps_are_sure(&self, duration_s: f64) -> bool {
        // More than one pump may draw from a tank: as many times the flow is on the safe side.
        let sure_s = 2.0 * duration_s * self.feeds.len() as f64;
        let mut sure = true;
        for (feed, &flow) in self.feeds.iter().zip(&self.commanded) {
            let held = self.now[feed.source] * self.areas[feed.source];
            sure &= feed.source >= self.tanks || V::of(SURE_CM3).is_below(held - flow * sure_s);
        }
        sure
    }

    /// Takes what the pumps draw in a sample out of its source and lets it into the air.
    #[inline(always)]
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
    #[inline(always)]
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
    #[inline(always)]
    fn begin_step(&mut self, longest_s: f64, left_s: f64) -> bool {
        self.count_whole();
        let change_s = self.pipes.iter().map(Pipe::time_to_change_s).fold(longest_s, f64::min);
        let most_s = if self.look_ahead { change_s } else { change_s.min(left_s) };
        self.prepare_step();
        let slope = self.streams.each(|i| self.net[i] + self.head_inflow[i]);
        let two_stages = self.streams.resolves(&self.heads, &slope, most_s, TWO_STAGES);
        let step_s =
            if two_stages { most_s } else { self.length_for(&slope, most_s, MOST_PIECES, THREE_STAGES) };
        self.runge_kutta(&slope, step_s, two_stages);
        if !self.is_inside() {
            (self.end, self.end_flow) = (self.start, self.start_flow);
            self.no_step();
            return false;
        }
        self.evaluate_end();
        self.end_bend = self.streams.each(|i| self.steepness[i] * (self.net[i] + self.head_inflow[i]));
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

    /// Whether every tank can hold and give what the step moves.
    #[inline(always)]
    fn is_inside(&self) -> bool {
        let (mut room, mut sum) = (V::of(f64::INFINITY), V::of(0.0));
        for (&level, &height) in self.end.iter().zip(&self.heights).take(self.tanks) {
            room = room.smaller(level.smaller(height - level));
            sum += level;
        }
        // The sum finds a level that is no number.
        (sum * 0.0).is_at_most(room)
    }

    /// Starts a step at the present end.
    #[inline(always)]
    pub(super) fn prepare_step(&mut self) {
        self.set_inflow();
        (self.start, self.start_flow) = (self.end, self.end_flow);
    }

    /// Length of a step of at most `most_s` that resolves every stream from the present end, where the heads have this
    /// slope.
    #[inline(always)]
    pub(super) fn length_for(
        &self,
        slope: &[V; S],
        most_s: f64,
        most_pieces: f64,
        resolution: Resolution,
    ) -> f64 {
        most_s / self.streams.pieces(&self.heads, slope, most_s, most_pieces, resolution)
    }

    /// What pumps bring each node from now to the next change in the air.
    #[inline(always)]
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
        self.head_inflow = self.streams.heads(&self.inflow);
    }

    /// One step from `start`, whose flows are there and where the heads have this slope; gives `end` and the volume of
    /// every stream.
    ///
    /// ```text
    /// two stages:    h(c) at c = ½,      V = τq₀ + τ²(q̇₀/6 + q̇(c)/3)
    /// three stages:  h(c) at c = ⅖,      h(1) = h₀ + τḣ₀ + τ²(¾ḧ(c) − ¼ḧ₀),
    ///                V = τq₀ + τ²(q̇₀/8 + 25q̇(c)/72 + q̇(1)/36)          with h(c) = h₀ + cτḣ₀ + ½c²τ²ḧ₀
    /// ```
    #[inline(always)]
    fn runge_kutta(&mut self, slope: &[V; S], step_s: f64, two_stages: bool) {
        let none = [V::of(0.0); S];
        let step2 = step_s * step_s;
        self.start_bend = self.streams.each(|i| self.steepness[i] * slope[i]);
        let (flow, bend) = (&self.start_flow, &self.start_bend);
        let start_turn = self.streams.drive(bend, &none);
        let share_s = step_s * if two_stages { 0.5 } else { 0.4 };
        let middle = self
            .streams
            .each(|i| self.heads[i] + slope[i] * share_s + start_turn[i] * (0.5 * share_s * share_s));
        let middle_bend = self.bend_at(&middle);
        self.volume = if two_stages {
            self.streams.each(|i| flow[i] * step_s + (bend[i] + middle_bend[i] * 2.0) * (step2 / 6.0))
        } else {
            let middle_turn = self.streams.drive(&middle_bend, &none);
            let last = self.streams.each(|i| {
                self.heads[i] + slope[i] * step_s + (middle_turn[i] * 3.0 - start_turn[i]) * (0.25 * step2)
            });
            let last_bend = self.bend_at(&last);
            self.streams.each(|i| {
                let bends = bend[i] * 9.0 + middle_bend[i] * 25.0 + last_bend[i] * 2.0;
                flow[i] * step_s + bends * (step2 / 72.0)
            })
        };
        for i in 0..N {
            self.end[i] = self.start[i] + self.inflow[i] * step_s;
        }
        self.streams.bring(&self.volume, &mut self.end);
    }

    /// Slope of every flow at these heads, in cm³/s².
    #[inline(always)]
    fn bend_at(&self, heads: &[V; S]) -> [V; S] {
        let flowing = self.streams.flowing(heads, &self.roots);
        let slope = self.streams.drive(&flowing.flow, &self.head_inflow);
        self.streams.each(|i| flowing.steepness[i] * slope[i])
    }

    /// Flows of the streams at the end of the step, how they grow with the heads, and what they bring.
    #[inline(always)]
    pub(super) fn evaluate_end(&mut self) {
        self.heads = self.streams.heads(&self.end);
        let flowing = self.streams.flowing(&self.heads, &self.roots);
        self.streams.keep(&flowing, &mut self.roots);
        (self.end_flow, self.steepness) = (flowing.flow, flowing.steepness);
        self.net = self.streams.drive(&self.end_flow, &[V::of(0.0); S]);
    }

    #[inline(always)]
    fn begin_span(&mut self) {
        if self.counts {
            let zero = [V::of(0.0); N];
            self.span_volume = [V::of(0.0); S];
            (self.span_spills, self.span_pumped, self.span_arriving) = (zero, zero, zero);
        }
    }

    /// Works out what the present is like, where the span ends.
    #[inline(always)]
    fn arrive(&mut self) {
        if self.passed_s >= self.length_s {
            self.count_whole();
            self.now = self.end;
            return;
        }
        let w = Hermite::at(self.passed_s / self.length_s, self.length_s);
        // A plain loop: a closure of this size is called instead of taken into the loop.
        let mut volume = [V::of(0.0); S];
        for (i, volume) in volume.iter_mut().enumerate().take(self.streams.slots()) {
            let flows = self.start_flow[i] * w.start + self.end_flow[i] * w.end;
            let bends = self.start_bend[i] * w.start_bend + self.end_bend[i] * w.end_bend;
            *volume = self.volume[i] * w.rise + (flows + bends);
        }
        self.count(volume, self.passed_s);
        for i in 0..N {
            self.now[i] = self.start[i] + self.inflow[i] * self.passed_s;
        }
        self.streams.bring(&volume, &mut self.now);
    }

    /// Adds what has passed of the present step, all of it, to the volumes of the span.
    #[inline(always)]
    fn count_whole(&mut self) {
        self.count(self.volume, self.length_s);
    }

    /// Adds what the present step has moved so far, less what earlier spans have counted of it.
    #[inline(always)]
    fn count(&mut self, volume: [V; S], passed_s: f64) {
        let new_s = passed_s - self.counted_s;
        if new_s <= 0.0 || !self.counts {
            return;
        }
        for (sum, (&volume, &counted)) in self.span_volume.iter_mut().zip(volume.iter().zip(&self.counted)) {
            *sum += volume - counted;
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
    #[inline(always)]
    pub(super) fn no_step(&mut self) {
        (self.length_s, self.passed_s) = (0.0, 0.0);
        (self.counted, self.counted_s) = ([V::of(0.0); S], 0.0);
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
            self.end = self.now;
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
