//! What is fitted: channels from inputs to the output, what else shifts it, and which column is which.

use crate::identify::problem::Stretch;

/// Dynamics from one input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) enum Order {
    /// K/(T s + 1); unknowns ln T and L/T.
    First,
    /// Kv/s; unknown L/scale.
    Integrator,
    /// K (1 + Tz s)/(τ² s² + 2 ζ τ s + 1); unknowns ln τ, ln ζ and L/τ.
    Second {
        /// Whether Tz is free; 0 otherwise.
        zero: bool,
    },
    /// A load that is there at once; its row is searched, not descended to.
    Jump,
}

impl Order {
    /// Number of unknowns that enter non-linearly.
    pub fn unknowns(self) -> usize {
        match self {
            Self::First => 2,
            Self::Integrator => 1,
            Self::Second { .. } => 3,
            Self::Jump => 0,
        }
    }

    /// Basis functions: the response, with a zero also its slope.
    fn basis(self) -> usize {
        match self {
            Self::Second { zero: true } => 2,
            _ => 1,
        }
    }

    /// Modes of a state away from rest that are no constant.
    fn modes(self) -> usize {
        match self {
            Self::First => 1,
            Self::Integrator | Self::Jump => 0,
            Self::Second { .. } => 2,
        }
    }
}

/// Dynamics of a channel at a point of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::identify) struct Point {
    /// T, τ, or the scale of an integrator's dead time, in seconds.
    pub time_s: f64,
    /// ζ; 1 where there is none.
    pub zeta: f64,
    /// L in seconds; of a load its time, counted from the first row of the problem.
    pub dead_time_s: f64,
}

/// One term that enters linearly: its column and the columns of its derivatives.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Term {
    pub column: usize,
    /// (unknown of the whole problem, column).
    pub derivatives: Vec<(usize, usize)>,
}

/// Where a channel writes.
#[derive(Debug, Clone)]
pub(in crate::identify) struct ChannelColumns {
    /// First column of the response: every basis function followed by its derivatives.
    pub first: usize,
    /// First column of the free modes: every mode followed by its derivatives.
    pub free: usize,
}

/// Channels, drift, and the columns they take.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Shape {
    /// Of the MV, of each disturbance, of each load.
    pub channels: Vec<Order>,
    /// How many of them, the last, answer a unit step that nobody measured.
    pub loads: usize,
    pub drift: bool,
    /// Whether the state of each segment is free.
    pub free: bool,
    /// Terms of the whole record.
    pub shared: Vec<Term>,
    /// Terms of each segment.
    pub local: Vec<Term>,
    /// For each channel, its place among `shared`.
    pub gains: Vec<usize>,
    pub places: Vec<ChannelColumns>,
    /// Column of the drift.
    pub drift_column: Option<usize>,
    /// Column of the residual; the last.
    pub residual: usize,
    /// Number of unknowns that enter non-linearly.
    pub unknowns: usize,
    /// Whether derivatives are wanted.
    pub differentiable: bool,
}

/// Column of ones.
pub(in crate::identify) const ONE: usize = 0;

impl Shape {
    pub fn new(channels: Vec<Order>, drift: bool, free: bool) -> Self {
        Self::with_loads(channels, &[], drift, free)
    }

    /// The shape with loads besides the inputs.
    pub fn with_loads(mut channels: Vec<Order>, loads: &[Order], drift: bool, free: bool) -> Self {
        let inputs = channels.len();
        channels.extend(loads);
        let integrating = channels.contains(&Order::Integrator);
        let one = Term { column: ONE, derivatives: vec![] };
        let (mut shared, mut local) = (vec![], vec![]);
        // An integrator's level after a gap is anyone's guess: its constant belongs to the segment.
        if integrating {
            local.push(one)
        } else {
            shared.push(one)
        }
        let mut next = 1;
        let drift_column = (drift || integrating).then(|| {
            shared.push(Term { column: next, derivatives: vec![] });
            next += 1;
            next - 1
        });
        let (mut gains, mut places) = (vec![], vec![]);
        let mut first_unknown = 0;
        for (i, order) in channels.iter().enumerate() {
            gains.push(shared.len());
            let unknowns = order.unknowns();
            let first = next;
            for _ in 0..order.basis() {
                let derivatives = (0..unknowns).map(|k| (first_unknown + k, next + 1 + k)).collect();
                shared.push(Term { column: next, derivatives });
                next += 1 + unknowns;
            }
            let modes_start = next;
            for _ in 0..if free && i < inputs { order.modes() } else { 0 } {
                // Modes don't depend on the dead time.
                let derivatives = (0..unknowns - 1).map(|k| (first_unknown + k, next + 1 + k)).collect();
                local.push(Term { column: next, derivatives });
                next += unknowns;
            }
            places.push(ChannelColumns { first, free: modes_start });
            first_unknown += unknowns;
        }
        Self {
            channels,
            loads: loads.len(),
            drift,
            free,
            shared,
            local,
            gains,
            places,
            drift_column,
            residual: next,
            unknowns: first_unknown,
            differentiable: true,
        }
    }

    /// The same shape for passes that only need the residual.
    pub fn without_derivatives(&self) -> Self {
        Self { differentiable: false, ..self.clone() }
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.residual + 1
    }

    /// Number of all unknowns on a stretch.
    pub fn parameters(&self, stretch: &Stretch) -> usize {
        let modes = self.local.iter().filter(|t| t.column != ONE).count();
        let at_rest = if stretch.at_rest { modes } else { 0 };
        let jumps = self.channels.iter().filter(|order| **order == Order::Jump).count();
        self.unknowns + jumps + self.shared.len() + self.local.len() * stretch.live_segments() - at_rest
    }

    /// Channels of what was measured.
    pub fn inputs(&self) -> usize {
        self.channels.len() - self.loads
    }

    /// First unknown of a channel.
    pub fn first_unknown(&self, channel: usize) -> usize {
        self.channels[..channel].iter().map(|o| o.unknowns()).sum()
    }

    /// Place of the drift among the shared terms.
    pub fn drift_term(&self) -> Option<usize> {
        let column = self.drift_column?;
        self.shared.iter().position(|t| t.column == column)
    }

    /// Whether a channel integrates.
    pub fn integrating(&self) -> bool {
        self.channels.contains(&Order::Integrator)
    }
}

/// Linear unknowns: of the whole record, and of each segment; on centred data.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Linear {
    pub shared: Vec<f64>,
    pub local: Vec<Vec<f64>>,
}

impl Linear {
    pub fn zero(shape: &Shape, stretch: &Stretch) -> Self {
        Self {
            shared: vec![0.0; shape.shared.len()],
            local: vec![vec![0.0; shape.local.len()]; stretch.segments.len()],
        }
    }
}
