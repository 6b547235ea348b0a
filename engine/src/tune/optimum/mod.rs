//! The best PI and PID gains under limits of robustness and control activity, certified.
//!
//! ```text
//! minimise Jv (or −Ki, IAE)   subject to   Ms ≤ C1, Mt ≤ C2, Ju ≤ C3, closed loop stable
//! ```
//!
//! For one process or for several, of which the worst counts; for models, dead time exact, and for measured frequency
//! responses. [`optimum`] solves the problem on points of frequency, has every loop analysed exactly, adds the
//! frequencies at which a limit is passed and solves again, until none is: what the points leave out is the gap of the
//! [`Certificate`]. What no controller can meet is answered with the floor.
//!
//! Sources: Kristiansson and Lennartson, J. Process Control 16, 2006; Åström, Panagopoulos and Hägglund, Automatica 34,
//! 1998; Hast, Åström, Bernhardsson and Boyd, PID design by convex-concave optimization, ECC 2013.

mod by_simulation;
mod certificate;
mod circles;
mod error;
mod family;
mod floor;
mod front;
mod gain_search;
mod lead_search;
mod points;
mod problem;
mod relax;
mod simplex;
mod slice;
mod slow;
mod solve;
mod stabilising;
mod valley;

pub use certificate::{Certificate, Limit, Optimum};
pub use error::OptimumError;
pub use front::{FrontPoint, TradeOff, front, on_front};
pub use problem::{DerivativeFilter, LoopLimits, Objective, OptimumProblem, Process, Wanted};
pub use solve::optimum;
