//! The open streams of a rig, flat: what the integrator evaluates a few times a sample.
//!
//! Nodes are numbered: the tanks in the order of the file, then the outside, then the floor (where leaks go),
//! then a level of 0 cm that a free fall drives against. Arrays over nodes and pumps have the length `N`, arrays over
//! streams the length `S`, powers of two with room for all of them, so that the compiler knows them.
//!
//! Between the ends of a step only heads and flows are looked at: a stream's flow follows from its head, and what the
//! flows do to every head is one small matrix.

use super::lanes::Number;
use super::network::Network;
use super::roots::{Bends, Roots};
use super::spec::{ValveDrive, ValveLaw};

/// δ² in cm² where δ = 0, so that a head of 0 has flow 0, not 0/0.
const TINY_CM2: f64 = 1e-300;
/// Nodes that are not tanks: the outside, the floor, the level of 0 cm.
const EXTRA: usize = 3;

/// Up to this length a whole column is quicker than single nodes.
const SHORT: usize = 16;
/// So few streams are worked through one after the other without a count.
const FEW: usize = 4;

/// How many nodes or pumps a rig has, whichever are more.
pub(crate) fn widest(network: &Network) -> usize {
    (network.tanks.len() + EXTRA).max(network.pumps.len())
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
    /// Lowest head that drives it: 0 for a free fall, −∞ between two tanks.
    least: f64,
}

impl Stream {
    /// Difference of a number of its nodes: of levels, or of their slopes.
    #[inline(always)]
    fn head<const N: usize, V: Number>(&self, nodes: &[V; N]) -> V {
        // Nodes are below N; the mask says so to the compiler.
        nodes[self.from & (N - 1)] - nodes[self.against & (N - 1)]
    }
}

/// What a step may change so that a method resolves it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resolution {
    /// Largest change of a head, as a share of √(δ² + head²): what is left of the way to the singularity of the √ law.
    pub curvature: f64,
    /// Largest λ·h.
    pub rate: f64,
    /// Largest (λ·h)⁴ times the change of a head, in cm: what the method's error is a small share of.
    pub error_cm: f64,
}

/// What streams do at some heads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flowing<const S: usize, V> {
    /// q in cm³/s.
    pub flow: [V; S],
    /// dq/dh in cm²/s.
    pub steepness: [V; S],
    /// x^(−¼).
    roots: [V; S],
}

/// Every stream that is not shut.
#[derive(Debug, Clone)]
pub(crate) struct Streams<const N: usize, const S: usize, V> {
    /// Square roots first.
    streams: Vec<Stream>,
    /// Nodes of each stream's head: `from` and `against`; twice the same beyond the streams.
    heads_of: [(u16, u16); S],
    /// How many of them are square roots.
    square_roots: usize,
    k: [V; S],
    /// x of a stream is `bend·h² + round`, its flow `k·h·x^(−¼)`: 1 and δ² for a square root, 0 and 1 otherwise.
    bends: Bends<S, V>,
    /// Fourth power of k times the sum of 1/A over the nodes of the head.
    steepness4: [V; S],
    /// dh/dt that a flow of 1 cm³/s of each stream brings every node, in cm⁻². Multiplying by whole columns is
    /// quicker than adding to single nodes, as long as they are short.
    columns: Vec<[V; N]>,
    /// The same for every head; none of them where they would be long.
    couplings: Vec<[V; S]>,
    /// What each stream belongs to.
    pub(super) origins: Vec<Origin>,
    delta2: f64,
    /// 1/A of each node in cm⁻²; 1 for outside and floor, whose "level" is then a volume in cm³; 0 beyond.
    pub(super) per_area: [V; N],
    tanks: usize,
}

impl<const N: usize, const S: usize, V: Number> Streams<N, S, V> {
    /// The streams of a network with their coefficients: k(α) of every valve, k of every tank's leak.
    pub fn new(network: &Network, areas_cm2: &[V], coefficients: &[V], leaks: &[V]) -> Self {
        let tanks = network.tanks.len();
        let mut per_area = [V::of(0.0); N];
        for (per_area, &area) in per_area.iter_mut().zip(areas_cm2) {
            *per_area = V::of(1.0) / area;
        }
        per_area[tanks..tanks + 2].fill(V::of(1.0));
        let zero = [V::of(0.0); S];
        let mut made = Self {
            streams: Vec::with_capacity(S),
            heads_of: [(0, 0); S],
            square_roots: 0,
            k: zero,
            bends: Bends { bend: zero, round: [V::of(1.0); S] },
            steepness4: zero,
            columns: Vec::with_capacity(S),
            couplings: vec![zero; if S <= SHORT { S } else { 0 }],
            origins: Vec::with_capacity(S),
            delta2: (network.delta_cm * network.delta_cm).max(TINY_CM2),
            per_area,
            tanks,
        };
        made.collect(network, coefficients, leaks);
        made
    }

    /// Takes new coefficients over; allocates nothing.
    pub fn collect(&mut self, network: &Network, coefficients: &[V], leaks: &[V]) {
        self.streams.clear();
        self.columns.clear();
        self.origins.clear();
        (self.k, self.steepness4) = ([V::of(0.0); S], [V::of(0.0); S]);
        self.bends = Bends { bend: [V::of(0.0); S], round: [V::of(1.0); S] };
        self.valves(network, coefficients, ValveLaw::SquareRoot);
        for (tank, &k) in leaks.iter().enumerate() {
            if k.largest() > 0.0 {
                self.push(tank, self.zero(), self.floor(), k, Origin::Leak(tank));
            }
        }
        self.square_roots = self.streams.len();
        self.bends.bend[..self.square_roots].fill(V::of(1.0));
        self.bends.round[..self.square_roots].fill(V::of(self.delta2));
        self.valves(network, coefficients, ValveLaw::Laminar);
        self.heads_of = [(0, 0); S];
        for (nodes, stream) in self.heads_of.iter_mut().zip(&self.streams) {
            // There are at most `N` of them.
            *nodes = (stream.from as u16, stream.against as u16);
        }
        self.couple();
        if S <= FEW {
            self.columns.resize(S, [V::of(0.0); N]);
        }
    }

    /// Works out what each flow does to every head.
    fn couple(&mut self) {
        let columns = self.columns.iter().map(Some).chain(std::iter::repeat(None));
        for (coupling, column) in self.couplings.iter_mut().zip(columns) {
            *coupling = [V::of(0.0); S];
            for (stream, share) in self.streams.iter().zip(coupling) {
                *share = column.map_or(V::of(0.0), |column| stream.head(column));
            }
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
        let slot = self.streams.len();
        let steepness = k * (self.per_area[from] + self.per_area[against]);
        let steepness2 = steepness * steepness;
        (self.k[slot], self.steepness4[slot]) = (k, steepness2 * steepness2);
        let mut column = [V::of(0.0); N];
        column[from] -= self.per_area[from];
        column[to] += self.per_area[to];
        self.columns.push(column);
        self.origins.push(origin);
        let least = if against == self.zero() { 0.0 } else { f64::NEG_INFINITY };
        self.streams.push(Stream { from, against, to, least });
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

    /// How much of an array over streams to work through: all of it where that is little, since the compiler knows its
    /// length.
    #[inline(always)]
    pub fn slots(&self) -> usize {
        if S * V::PLANTS <= SHORT || S <= FEW { S } else { self.streams.len().min(S) }
    }

    /// An array over streams.
    #[inline(always)]
    pub fn each(&self, stream: impl Fn(usize) -> V) -> [V; S] {
        let mut made = [V::of(0.0); S];
        for (i, made) in made.iter_mut().enumerate().take(self.slots()) {
            *made = stream(i);
        }
        made
    }

    /// Difference of a number of each stream's nodes: of levels its head, of slopes the head's slope.
    #[inline(always)]
    pub fn heads(&self, nodes: &[V; N]) -> [V; S] {
        self.each(|i| {
            let (from, against) = self.heads_of[i];
            // Nodes are below N; the mask says so to the compiler.
            nodes[usize::from(from) & (N - 1)] - nodes[usize::from(against) & (N - 1)]
        })
    }

    /// Flows at these heads, from the roots of heads near by.
    #[inline(always)]
    pub fn flowing(&self, heads: &[V; S], near: &Roots<S, V>) -> Flowing<S, V> {
        let roots = near.at(heads, &self.bends, self.slots());
        let (mut flow, mut steepness) = ([V::of(0.0); S], [V::of(0.0); S]);
        for i in 0..self.slots() {
            // dq/dh = k·x^(−¼)·(1 − h²/2x), and 1/x is the fourth power of the root.
            let (square, steepest) = (roots[i] * roots[i], self.k[i] * roots[i]);
            let bent = heads[i] * heads[i] * (square * square) * (self.bends.bend[i] * 0.5);
            (flow[i], steepness[i]) = (steepest * heads[i], steepest * (V::of(1.0) - bent));
        }
        Flowing { flow, steepness, roots }
    }

    /// Slope of every head that flows bring, added to `base`, in cm/s.
    #[inline(always)]
    pub fn drive(&self, flows: &[V; S], base: &[V; S]) -> [V; S] {
        let Ok(couplings) = <&[[V; S]; S]>::try_from(self.couplings.as_slice()) else {
            let mut net = [V::of(0.0); N];
            self.bring(flows, &mut net);
            return self.each(|i| base[i] + self.streams[i].head(&net));
        };
        // Two sums side by side, since an addition waits for the one before.
        let (mut even, mut odd) = (*base, [V::of(0.0); S]);
        for j in 0..self.slots() {
            let sum = if j % 2 == 0 { &mut even } else { &mut odd };
            for i in 0..self.slots() {
                sum[i] += couplings[j][i] * flows[j];
            }
        }
        self.each(|i| even[i] + odd[i])
    }

    /// Keeps the roots of these flows for others near by.
    #[inline(always)]
    pub fn keep(&self, flowing: &Flowing<S, V>, kept: &mut Roots<S, V>) {
        kept.keep(&flowing.roots, &self.bends, self.slots());
    }

    /// Flow of every stream in cm³/s where nothing falls out of a tank that a stage of a step has taken below its floor.
    pub fn guarded_flows(&self, levels: &[V; N]) -> [V; S] {
        let mut heads = self.heads(levels);
        for (head, stream) in heads.iter_mut().zip(&self.streams) {
            *head = head.at_least(stream.least);
        }
        self.flowing(&heads, &Roots::none()).flow
    }

    /// Adds what the streams' volumes, or flows, bring every node, in cm or cm/s.
    #[inline(always)]
    pub fn bring(&self, volumes: &[V; S], nodes: &mut [V; N]) {
        if N <= SHORT && V::PLANTS == 1 {
            // Summed apart from `nodes`, which for all the compiler knows the columns may overlap.
            let mut sum = *nodes;
            if let Ok(columns) = <&[[V; N]; S]>::try_from(self.columns.as_slice()) {
                for j in 0..S {
                    for i in 0..N {
                        sum[i] += columns[j][i] * volumes[j];
                    }
                }
            } else {
                for (column, &volume) in self.columns.iter().zip(volumes) {
                    for i in 0..N {
                        sum[i] += column[i] * volume;
                    }
                }
            }
            *nodes = sum;
            return;
        }
        for ((stream, column), &volume) in self.streams.iter().zip(&self.columns).zip(volumes) {
            let (from, to) = (stream.from & (N - 1), stream.to & (N - 1));
            nodes[from] += column[from] * volume;
            nodes[to] += column[to] * volume;
        }
    }

    /// Whether a step resolves every stream.
    #[inline(always)]
    pub fn resolves(&self, heads: &[V; S], slope: &[V; S], step_s: f64, most: Resolution) -> bool {
        let step2 = step_s * step_s;
        let step4 = step2 * step2;
        // Slot by slot and then the largest of all, so that the slots are worked out side by side.
        let mut worst = [V::of(0.0); S];
        for (i, worst) in worst.iter_mut().enumerate().take(self.slots()) {
            let (r2, change) = (heads[i] * heads[i] + V::of(self.delta2), slope[i] * step_s);
            let (change2, rate4) = (change * change, self.steepness4[i] * step4);
            // (λh)⁴ of a √ law, whose dq/dh is at most q/h = k/√r, times r².
            let scale = r2 * self.bends.bend[i] + (V::of(1.0) - self.bends.bend[i]);
            let error2 = scale * scale * (most.error_cm * most.error_cm);
            let curved = change2 - r2 * (most.curvature * most.curvature);
            let fast = rate4 - scale * most.rate.powi(4);
            *worst = curved.larger(fast).larger(rate4 * rate4 * change2 - error2);
        }
        let mut all = worst[0];
        for &worst in worst.iter().take(self.slots()).skip(1) {
            all = all.larger(worst);
        }
        all.is_at_most(V::of(0.0))
    }

    /// How many pieces, at most `most_pieces`, a step of `step_s` must be cut into so that every stream is resolved.
    #[inline(never)]
    pub fn pieces(
        &self,
        heads: &[V; S],
        slope: &[V; S],
        step_s: f64,
        most_pieces: f64,
        most: Resolution,
    ) -> f64 {
        let (mut bend2, mut rate4, mut error2) = (0.0_f64, 0.0_f64, 0.0_f64);
        let step4 = step_s * step_s * step_s * step_s;
        for i in 0..self.streams.len().min(S) {
            let (r2, change) = (heads[i] * heads[i] + V::of(self.delta2), slope[i] * step_s);
            let (change2, linear) = (change * change, i >= self.square_roots);
            bend2 = bend2.max((change2 / r2).largest());
            let steep4 = self.steepness4[i] * step4;
            let rated4 = if linear { steep4 } else { steep4 / r2 };
            error2 = error2.max((rated4 * rated4 * change2).largest());
            // An empty tank with δ = 0 that stays empty needs no steps for its slope.
            if linear || self.delta2 > TINY_CM2 || change2.largest() > 0.0 {
                rate4 = rate4.max(rated4.largest());
            }
        }
        // n pieces have an n-th of the change and of the rate. Counting up needs no roots, and a few are enough mostly.
        let mut pieces = 1.0;
        while pieces < most_pieces {
            let (n2, slack) = (pieces * pieces, 1.0 + 1e-9);
            let n4 = n2 * n2 * slack;
            let bent = bend2 > most.curvature * most.curvature * n2 * slack;
            let fast = rate4 > most.rate.powi(4) * n4;
            if !(bent || fast || error2 > most.error_cm * most.error_cm * n4 * n4 * n2) {
                break;
            }
            pieces += 1.0;
        }
        pieces
    }
}
