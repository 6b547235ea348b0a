//! The integrator in the length that a rig needs.

use super::motion::Motion;
use super::network::Network;
use super::pipe::Pipe;
use super::streams::{Origin, widest};

/// [`Motion`] of a plant, its arrays as long as the rig asks for.
#[derive(Debug, Clone)]
pub(crate) enum Motions {
    Tiny(Box<Motion<8, 4, f64>>),
    Small(Box<Motion<8, 8, f64>>),
    Medium(Box<Motion<16, 16, f64>>),
    Large(Box<Motion<64, 64, f64>>),
    Huge(Box<Motion<512, 512, f64>>),
}

/// Most nodes, streams or pumps that a rig may have.
pub(super) const MOST_PARTS: usize = 512;

/// Does the same with the motion of whatever length.
macro_rules! each {
    ($of:expr, $motion:ident => $what:expr) => {
        match $of {
            Motions::Tiny($motion) => $what,
            Motions::Small($motion) => $what,
            Motions::Medium($motion) => $what,
            Motions::Large($motion) => $what,
            Motions::Huge($motion) => $what,
        }
    };
}

/// What a span came to: volumes in cm³.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span<'a> {
    pub streams: &'a [f64],
    pub pumped: &'a [f64],
    pub arriving: &'a [f64],
    pub spills: &'a [f64],
    pub origins: &'a [Origin],
}

/// A span in the widest vector registers there are; the results are the same in all of them.
struct Advance<'a, const N: usize, const S: usize> {
    motion: &'a mut Motion<N, S, f64>,
    duration_s: f64,
}

impl<const N: usize, const S: usize> pulp::NullaryFnOnce for Advance<'_, N, S> {
    type Output = (f64, bool);

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.motion.advance(self.duration_s)
    }
}

/// [`Motions::advance`] of one length. Apart, so that a small rig does not set aside what the largest one needs of the
/// stack.
#[inline(never)]
fn advance<const N: usize, const S: usize>(
    motion: &mut Motion<N, S, f64>,
    arch: pulp::Arch,
    network: &Network,
    duration_s: f64,
    levels_cm: &mut [f64],
    dry: &mut [bool],
) -> bool {
    let (left_s, fed) = arch.dispatch(Advance { motion, duration_s });
    let careful = left_s > 0.0;
    if careful {
        motion.advance_carefully(network, left_s, fed, dry);
    }
    copy_few(levels_cm, &motion.now);
    careful
}

/// Copies numbers four at a time: for a handful, a call of the library's copy takes longer.
#[inline(always)]
pub(crate) fn copy_few(to: &mut [f64], from: &[f64]) {
    let count = to.len().min(from.len());
    let (to, to_rest) = to[..count].as_chunks_mut::<4>();
    let (from, from_rest) = from[..count].as_chunks::<4>();
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
    for (to, from) in to_rest.iter_mut().zip(from_rest) {
        *to = *from;
    }
}

impl Motions {
    pub fn new(network: &Network, coefficients: &[f64], pipes: Vec<Pipe<f64>>) -> Self {
        Self::with_room(network.valves.len(), network, coefficients, pipes)
    }

    /// With room for so many streams.
    fn with_room(streams: usize, network: &Network, coefficients: &[f64], pipes: Vec<Pipe<f64>>) -> Self {
        let areas: Vec<f64> = network.tanks.iter().map(|t| t.area_cm2).collect();
        match (widest(network), streams) {
            (0..=8, 0..=4) => Self::Tiny(Box::new(Motion::new(network, &areas, coefficients, pipes))),
            (0..=8, 0..=8) => Self::Small(Box::new(Motion::new(network, &areas, coefficients, pipes))),
            (0..=16, 0..=16) => Self::Medium(Box::new(Motion::new(network, &areas, coefficients, pipes))),
            (0..=64, 0..=64) => Self::Large(Box::new(Motion::new(network, &areas, coefficients, pipes))),
            _ => Self::Huge(Box::new(Motion::new(network, &areas, coefficients, pipes))),
        }
    }

    /// Most streams there is room for.
    fn room(&self) -> usize {
        each!(self, m => m.volume.len())
    }

    /// The same at the present, with room for more streams.
    fn roomier(&mut self, streams: usize, network: &Network, coefficients: &[f64]) -> Self {
        let pipes = each!(self, m => std::mem::take(&mut m.pipes));
        let mut made = Self::with_room(streams, network, coefficients, pipes);
        each!(&*self, old => each!(&mut made, new => {
            let nodes = network.tanks.len() + 2;
            new.end[..nodes].copy_from_slice(&old.now[..nodes]);
            let pumps = network.pumps.len();
            new.commanded[..pumps].copy_from_slice(&old.commanded[..pumps]);
            new.steps = old.steps;
        }));
        made
    }

    /// Lets `duration_s` pass in the vector registers of `arch`; `levels_cm` gets the levels then. Tells whether a
    /// tank was at its rim or empty.
    pub fn advance(
        &mut self,
        arch: pulp::Arch,
        network: &Network,
        duration_s: f64,
        levels_cm: &mut [f64],
        dry: &mut [bool],
    ) -> bool {
        each!(self, m => advance(m, arch, network, duration_s, levels_cm, dry))
    }

    pub fn span(&self) -> Span<'_> {
        each!(self, m => Span {
            streams: &m.span_volume,
            pumped: &m.span_pumped,
            arriving: &m.span_arriving,
            spills: &m.span_spills,
            origins: &m.streams.origins,
        })
    }

    /// Flows through the open streams now, in cm³/s.
    pub fn flows(&self) -> (&[f64], &[Origin]) {
        each!(self, m => (&m.end_flow, &m.streams.origins))
    }

    /// Sets the flow a pump draws, in cm³/s, from now on.
    #[inline]
    pub fn command(&mut self, pump: usize, flow_cm3_s: f64) {
        each!(self, m => {
            if m.commanded[pump] != flow_cm3_s {
                if !m.look_ahead {
                    m.cut();
                }
                m.commanded[pump] = flow_cm3_s;
            }
        });
    }

    pub fn commanded(&self) -> &[f64] {
        each!(self, m => &m.commanded)
    }

    pub fn pipes(&self) -> &[Pipe<f64>] {
        each!(self, m => &m.pipes)
    }

    /// Changes pipes at the present.
    pub fn change_pipes<T>(&mut self, change: impl FnOnce(&mut [Pipe<f64>]) -> T) -> T {
        each!(self, m => {
            m.cut();
            let outcome = change(&mut m.pipes);
            m.restart();
            outcome
        })
    }

    /// Takes new coefficients of valves and leaks at the present.
    pub fn collect(&mut self, network: &Network, coefficients: &[f64], leaks: &[f64]) {
        each!(self, m => m.cut());
        let streams = network.valves.len() + leaks.iter().filter(|&&k| k > 0.0).count();
        if streams > self.room() {
            *self = self.roomier(streams, network, coefficients);
        }
        each!(self, m => {
            m.streams.collect(network, coefficients, leaks);
            m.restart();
        });
    }

    /// Goes on from these levels in cm.
    pub fn set_levels(&mut self, levels_cm: &[f64]) {
        each!(self, m => {
            m.cut();
            m.end[..levels_cm.len()].copy_from_slice(levels_cm);
            m.restart();
        });
    }

    /// Volumes outside and on the floor, in cm³.
    pub fn lost_cm3(&self) -> (f64, f64) {
        each!(self, m => (m.now[m.streams.outside()], m.now[m.streams.floor()]))
    }

    pub fn set_lost_cm3(&mut self, outside: f64, floor: f64) {
        each!(self, m => {
            m.cut();
            m.end[m.streams.outside()] = outside;
            m.end[m.streams.floor()] = floor;
            m.now = m.end;
        });
    }

    pub fn in_flight_cm3(&self) -> f64 {
        each!(self, m => m.in_flight())
    }

    pub fn steps(&self) -> u64 {
        each!(self, m => m.steps)
    }
}
