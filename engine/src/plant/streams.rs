//! The open streams of a rig, flat: what the integrator evaluates a few times a sample.
//!
//! Nodes are numbered: the tanks in the order of the file, then the outside, then the floor (where leaks go),
//! then a level of 0 cm that a free fall drives against.

use super::network::Network;
use super::spec::{ValveDrive, ValveLaw};

/// Below this r² in cm², √r is taken of it instead: with δ = 0 a head of 0 has flow 0, not 0/0.
const TINY_CM2: f64 = 1e-300;

/// Lengths that arrays over the nodes are padded to, so that the compiler knows them: powers of two.
pub(super) const LENGTHS: [usize; 4] = [8, 16, 64, 1024];

/// Most tanks of a rig: there are three nodes more.
pub(super) const MOST_TANKS: usize = LENGTHS[3] - 3;

fn padded(nodes: usize) -> usize {
    LENGTHS.into_iter().find(|&length| length >= nodes).unwrap_or(nodes)
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
struct Stream {
    from: usize,
    /// Node whose level works against that of `from`.
    against: usize,
    to: usize,
    k: f64,
    /// Lowest head that drives it: 0 for a free fall, −∞ between two tanks.
    least: f64,
    /// 1/A of `from` plus that of `against`, in cm⁻².
    conductance: f64,
}

/// Every stream that is not shut.
#[derive(Debug, Clone)]
pub(super) struct Streams {
    /// Square roots first.
    streams: Vec<Stream>,
    roots: usize,
    /// What each stream belongs to.
    pub origins: Vec<Origin>,
    delta2: f64,
    /// 1/A of each node in cm⁻²; 1 for outside and floor, whose "level" is then a volume in cm³; 0 beyond.
    pub per_area: Vec<f64>,
    tanks: usize,
}

impl Streams {
    /// The streams of a network with their coefficients: k(α) of every valve, k of every tank's leak.
    pub fn new(network: &Network, coefficients: &[f64], leaks: &[f64]) -> Self {
        let tanks = network.tanks.len();
        let mut per_area: Vec<f64> = network.tanks.iter().map(|t| 1.0 / t.area_cm2).collect();
        per_area.extend([1.0, 1.0, 0.0]);
        per_area.resize(padded(per_area.len()), 0.0);
        let mut made = Self {
            streams: Vec::with_capacity(network.valves.len() + tanks),
            roots: 0,
            origins: Vec::with_capacity(network.valves.len() + tanks),
            delta2: (network.delta_cm * network.delta_cm).max(TINY_CM2),
            per_area,
            tanks,
        };
        made.collect(network, coefficients, leaks);
        made
    }

    /// Takes new coefficients over; allocates nothing.
    pub fn collect(&mut self, network: &Network, coefficients: &[f64], leaks: &[f64]) {
        self.streams.clear();
        self.origins.clear();
        self.valves(network, coefficients, ValveLaw::SquareRoot);
        for (tank, &k) in leaks.iter().enumerate() {
            if k > 0.0 {
                self.push(tank, self.zero(), self.floor(), k, Origin::Leak(tank));
            }
        }
        self.roots = self.streams.len();
        self.valves(network, coefficients, ValveLaw::Laminar);
    }

    fn valves(&mut self, network: &Network, coefficients: &[f64], law: ValveLaw) {
        for (i, (valve, &k)) in network.valves.iter().zip(coefficients).enumerate() {
            if k > 0.0 && valve.law == law {
                let against = match (valve.drive, valve.to) {
                    (ValveDrive::Between, Some(to)) => to,
                    _ => self.zero(),
                };
                self.push(valve.from, against, valve.to.unwrap_or(self.outside()), k, Origin::Valve(i));
            }
        }
    }

    fn push(&mut self, from: usize, against: usize, to: usize, k: f64, origin: Origin) {
        let conductance = self.per_area[from] + self.per_area[against];
        let least = if against == self.zero() { 0.0 } else { f64::NEG_INFINITY };
        self.streams.push(Stream { from, against, to, k, least, conductance });
        self.origins.push(origin);
    }

    /// Number of open streams.
    pub fn len(&self) -> usize {
        self.streams.len()
    }

    /// Length of every array over the nodes: their number, padded.
    pub fn nodes(&self) -> usize {
        self.per_area.len()
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
    pub fn ends(&self, stream: usize) -> (usize, usize) {
        (self.streams[stream].from, self.streams[stream].to)
    }

    /// Whether a stream depends on a tank's level.
    pub fn is_driven_by(&self, stream: usize, tank: usize) -> bool {
        let s = &self.streams[stream];
        s.from == tank || s.against == tank
    }

    /// Flow of every stream in cm³/s, handed to `each` with its number; gives what they bring each node in cm³/s.
    ///
    /// `N`, a power of two, is the length of the padded levels. With `GUARD` nothing falls out of a tank that a
    /// stage of a step has taken below its floor.
    #[inline(always)]
    pub fn evaluate<const N: usize, const GUARD: bool>(
        &self,
        levels: &[f64; N],
        mut each: impl FnMut(usize, f64),
    ) -> [f64; N] {
        let mut net = [0.0; N];
        for (i, stream) in self.streams.iter().enumerate() {
            // Nodes are below N; the mask says so to the compiler.
            let (from, against, to) = (stream.from & (N - 1), stream.against & (N - 1), stream.to & (N - 1));
            let head = levels[from] - levels[against];
            let head = if GUARD { head.max(stream.least) } else { head };
            let flow = if i < self.roots {
                stream.k * head / (head * head + self.delta2).sqrt().sqrt()
            } else {
                stream.k * head
            };
            each(i, flow);
            net[from] -= flow;
            net[to] += flow;
        }
        net
    }

    /// How many pieces a step of `step_s` must be cut into, so that no head changes by more than `curvature` of
    /// √(δ² + head²) and no rate times the step is above `rate`; 1 when it needs no cut.
    #[inline]
    pub fn pieces(&self, levels: &[f64], slope: &[f64], step_s: f64, rate: f64, curvature: f64) -> f64 {
        let mut worst = 1.0_f64;
        for (i, stream) in self.streams.iter().enumerate() {
            let head = levels[stream.from] - levels[stream.against];
            let change = (slope[stream.from] - slope[stream.against]).abs() * step_s;
            if head == 0.0 && change == 0.0 {
                continue;
            }
            let r2 = head * head + self.delta2;
            if change * change > curvature * curvature * r2 {
                worst = worst.max(change / (curvature * r2.sqrt()));
            }
            // dq/dh is at most q/h = k/√r.
            let steepest = stream.k * stream.conductance * step_s;
            if i < self.roots {
                if (steepest * steepest) * (steepest * steepest) > rate.powi(4) * r2 {
                    worst = worst.max(steepest / (rate * r2.sqrt().sqrt()));
                }
            } else {
                worst = worst.max(steepest / rate);
            }
        }
        worst
    }
}
