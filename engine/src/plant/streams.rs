//! The open streams of a rig, flat: what the integrator evaluates a few times a sample.
//!
//! Nodes are numbered: the tanks in the order of the file, then the outside, then the floor (where leaks go),
//! then a level of 0 cm that a free fall drives against. Every array over nodes, streams or pumps has the same
//! length `N`, a power of two with room for each of them, so that the compiler knows it.

use super::lanes::Number;
use super::motion::{STEP_CURVATURE, STEP_ERROR_CM, STEP_RATE};
use super::network::Network;
use super::spec::{ValveDrive, ValveLaw};

/// δ² in cm² where δ = 0, so that a head of 0 has flow 0, not 0/0.
const TINY_CM2: f64 = 1e-300;
/// Nodes that are not tanks: the outside, the floor, the level of 0 cm.
const EXTRA: usize = 3;

/// Up to this length a whole column is quicker than single nodes.
const SHORT: usize = 16;

/// How many nodes, streams or pumps a rig has at most, whichever are more.
pub(crate) fn widest(network: &Network) -> usize {
    let tanks = network.tanks.len();
    (tanks + EXTRA).max(network.valves.len() + tanks + 1).max(network.pumps.len())
}

/// Where a stream comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Origin {
    /// A valve of the network.
    Valve(usize),
    /// A hole in a tank.
    Leak(usize),
}

#[derive(Debug, Clone, Copy)]
struct Stream<V> {
    from: usize,
    /// Node whose level works against that of `from`.
    against: usize,
    to: usize,
    k: V,
    /// Lowest head that drives it: 0 for a free fall, −∞ between two tanks.
    least: f64,
    /// 1/A of `from` plus that of `against`, in cm⁻².
    conductance: V,
    /// Laminar; these come last.
    linear: bool,
    /// Its place in arrays over streams.
    slot: usize,
}

impl<V: Number> Stream<V> {
    #[inline(always)]
    fn head<const N: usize, const GUARD: bool>(&self, levels: &[V; N]) -> V {
        // Nodes and streams are below N; the mask says so to the compiler.
        let head = levels[self.from & (N - 1)] - levels[self.against & (N - 1)];
        if GUARD { head.at_least(self.least) } else { head }
    }
}

/// Every stream that is not shut.
#[derive(Debug, Clone)]
pub(crate) struct Streams<const N: usize, V> {
    /// Square roots first; an odd number is filled up with one that never flows.
    streams: Vec<Stream<V>>,
    laminar: bool,
    /// dh/dt that a flow of 1 cm³/s of each stream brings every node, in cm⁻². Multiplying by whole columns is
    /// quicker than adding to single nodes, as long as they are short.
    columns: Vec<[V; N]>,
    /// What each stream belongs to.
    pub(super) origins: Vec<Origin>,
    delta2: f64,
    /// 1/A of each node in cm⁻²; 1 for outside and floor, whose "level" is then a volume in cm³; 0 beyond.
    pub(super) per_area: [V; N],
    tanks: usize,
}

impl<const N: usize, V: Number> Streams<N, V> {
    /// The streams of a network with their coefficients: k(α) of every valve, k of every tank's leak.
    pub fn new(network: &Network, areas_cm2: &[V], coefficients: &[V], leaks: &[V]) -> Self {
        let tanks = network.tanks.len();
        let mut per_area = [V::of(0.0); N];
        for (per_area, &area) in per_area.iter_mut().zip(areas_cm2) {
            *per_area = V::of(1.0) / area;
        }
        per_area[tanks..tanks + 2].fill(V::of(1.0));
        let mut made = Self {
            streams: Vec::with_capacity(network.valves.len() + tanks + 1),
            laminar: false,
            columns: Vec::with_capacity(network.valves.len() + tanks + 1),
            origins: Vec::with_capacity(network.valves.len() + tanks + 1),
            delta2: (network.delta_cm * network.delta_cm).max(TINY_CM2),
            per_area,
            tanks,
        };
        made.collect(network, coefficients, leaks);
        made
    }

    /// Takes new coefficients over; allocates nothing.
    pub fn collect(&mut self, network: &Network, coefficients: &[V], leaks: &[V]) {
        self.laminar = false;
        self.streams.clear();
        self.columns.clear();
        self.origins.clear();
        self.valves(network, coefficients, ValveLaw::SquareRoot);
        for (tank, &k) in leaks.iter().enumerate() {
            if k.largest() > 0.0 {
                self.push(tank, self.zero(), self.floor(), k, Origin::Leak(tank));
            }
        }
        self.laminar = true;
        self.valves(network, coefficients, ValveLaw::Laminar);
        if !self.streams.len().is_multiple_of(2) {
            self.push_stream(self.zero(), self.zero(), self.zero(), V::of(0.0));
        }
    }

    fn valves(&mut self, network: &Network, coefficients: &[V], law: ValveLaw) {
        for (i, (valve, &k)) in network.valves.iter().zip(coefficients).enumerate() {
            if k.largest() > 0.0 && valve.law == law {
                let against = match (valve.drive, valve.to) {
                    (ValveDrive::Between, Some(to)) => to,
                    _ => self.zero(),
                };
                self.push(valve.from, against, valve.to.unwrap_or(self.outside()), k, Origin::Valve(i));
            }
        }
    }

    fn push(&mut self, from: usize, against: usize, to: usize, k: V, origin: Origin) {
        self.origins.push(origin);
        self.push_stream(from, against, to, k);
    }

    fn push_stream(&mut self, from: usize, against: usize, to: usize, k: V) {
        let conductance = self.per_area[from] + self.per_area[against];
        let least = if against == self.zero() { 0.0 } else { f64::NEG_INFINITY };
        let mut column = [V::of(0.0); N];
        column[from] -= self.per_area[from];
        column[to] += self.per_area[to];
        self.columns.push(column);
        let (linear, slot) = (self.laminar, self.streams.len());
        self.streams.push(Stream { from, against, to, k, least, conductance, linear, slot });
    }

    /// Number of open streams.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Node of everything outside the rig.
    pub fn outside(&self) -> usize {
        self.tanks
    }

    /// Node of what has leaked.
    pub fn floor(&self) -> usize {
        self.tanks + 1
    }

    fn zero(&self) -> usize {
        self.tanks + 2
    }

    /// Ends of a stream.
    #[inline(always)]
    pub fn ends(&self, stream: usize) -> (usize, usize) {
        (self.streams[stream].from, self.streams[stream].to)
    }

    /// Whether any stream depends on a tank's level.
    pub fn drives(&self, tank: usize) -> bool {
        self.streams.iter().any(|s| s.from == tank || s.against == tank)
    }

    /// Adds `weight` times the flow of every stream in cm³/s to `sum`; gives `base`, a dh/dt in cm/s, with what they
    /// bring every node.
    ///
    /// With `GUARD` nothing falls out of a tank that a stage of a step has taken below its floor.
    #[inline(always)]
    pub fn evaluate<const GUARD: bool>(
        &self,
        levels: &[V; N],
        base: &[V; N],
        weight: f64,
        sum: &mut [V; N],
    ) -> [V; N] {
        let mut slope = *base;
        // Two at a time: half as many vector roots. Padding closes an odd number.
        for (pair, columns) in self.streams.as_chunks::<2>().0.iter().zip(self.columns.as_chunks::<2>().0) {
            let [one, two] = pair;
            let (h1, h2) = (one.head::<N, GUARD>(levels), two.head::<N, GUARD>(levels));
            let delta2 = V::of(self.delta2);
            let (r1, r2) = ((h1 * h1 + delta2).sqrt().sqrt(), (h2 * h2 + delta2).sqrt().sqrt());
            let (q1, q2) = (one.k * h1, two.k * h2);
            let (mut f1, mut f2) = (q1 / r1, q2 / r2);
            if two.linear {
                f2 = q2;
                f1 = if one.linear { q1 } else { f1 };
            } else if one.linear {
                f1 = q1;
            }
            sum[one.slot & (N - 1)] += f1 * weight;
            sum[two.slot & (N - 1)] += f2 * weight;
            self.add(one, &columns[0], f1, &mut slope);
            if two.slot < self.origins.len() {
                self.add(two, &columns[1], f2, &mut slope);
            }
        }
        slope
    }

    /// Adds what a stream's flow, or volume, brings every node.
    #[inline(always)]
    fn add(&self, stream: &Stream<V>, column: &[V; N], flow: V, nodes: &mut [V; N]) {
        if N <= SHORT && V::PLANTS == 1 {
            for (node, &share) in nodes.iter_mut().zip(column) {
                *node += share * flow;
            }
        } else {
            let (from, to) = (stream.from & (N - 1), stream.to & (N - 1));
            nodes[from] += column[from] * flow;
            if to != from {
                nodes[to] += column[to] * flow;
            }
        }
    }

    /// Adds what the streams' volumes bring every node, in cm.
    #[inline(always)]
    pub fn move_volumes(&self, volumes: &[V; N], levels: &mut [V; N]) {
        for (stream, column) in self.streams.iter().zip(&self.columns) {
            self.add(stream, column, volumes[stream.slot & (N - 1)], levels);
        }
    }

    /// How many pieces a step of `step_s` must be cut into so that every stream is resolved; 1 when it needs no cut.
    ///
    /// No head changes by more than [`STEP_CURVATURE`] of √(δ² + head²), no rate times the step is above [`STEP_RATE`],
    /// and where both are within their bounds, their product stays below [`STEP_ERROR_CM`].
    #[inline(always)]
    pub fn pieces(&self, levels: &[V; N], slope: &[V; N], step_s: f64) -> f64 {
        let mut worst = 1.0_f64;
        let bend2 = V::of(STEP_CURVATURE * STEP_CURVATURE);
        let (rate4, error2) = (V::of(STEP_RATE.powi(4)), V::of(STEP_ERROR_CM * STEP_ERROR_CM));
        for stream in &self.streams {
            let (from, against) = (stream.from & (N - 1), stream.against & (N - 1));
            let head = levels[from] - levels[against];
            let change = (slope[from] - slope[against]) * step_s;
            let r2 = head * head + V::of(self.delta2);
            let change2 = change * change;
            let steepest = stream.k * stream.conductance * step_s;
            let steepest2 = steepest * steepest;
            let steepest4 = steepest2 * steepest2;
            if (change2 - bend2 * r2).largest() > 0.0 {
                worst = worst.max((change2 / r2).largest().sqrt() / STEP_CURVATURE);
            }
            // (λh)⁴ of a √ law, whose dq/dh is at most q/h = k/√r, times r².
            let (rated4, scale) = if stream.linear { (steepest4, V::of(1.0)) } else { (steepest4, r2) };
            if (rated4 * rated4 * change2 - error2 * scale * scale).largest() > 0.0 {
                let error_cm = ((rated4 * rated4 * change2) / (scale * scale)).largest().sqrt();
                worst = worst.max((error_cm / STEP_ERROR_CM).powf(0.2));
            }
            if stream.linear {
                worst = worst.max(steepest.largest() / STEP_RATE);
                continue;
            }
            // An empty tank with δ = 0 that stays empty needs no steps for its slope.
            let steep = (steepest4 - rate4 * r2).largest() > 0.0;
            if steep && (self.delta2 > TINY_CM2 || change2.largest() > 0.0) {
                worst = worst.max((steepest2 / r2.sqrt()).largest().sqrt() / STEP_RATE);
            }
        }
        worst
    }
}
