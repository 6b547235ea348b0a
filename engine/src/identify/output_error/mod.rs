//! Output error for every structure: several inputs, drift, rows left out, free states between gaps.
//!
//! y(t) = bias + drift · t + Σ channels + free modes. What enters linearly (bias, drift, gains, zeros, free states) is
//! solved and projected out of every pass; Gauss–Newton works on the dynamics alone. One pass over the rows gives
//! residual, gradient and matrix at once as inner products of columns.

mod columns;
mod descend;
mod fill;
mod kernel;
mod load;
mod matrix2;
mod profile;
mod project;
mod search;
mod shape;

pub(super) use columns::dot;
pub(super) use descend::{Found, evaluate, refine};
pub(super) use fill::blocks;
pub(super) use profile::{Around, dead_time_interval, is_wide};
pub(super) use project::{Symmetric, derivatives};
pub(super) use search::{Near, Work, again, search};
pub(super) use shape::{Linear, Order, Point, Shape};
