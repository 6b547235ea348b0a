//! Reports: one HTML file with its figures as inline SVG, nothing from outside, readable on paper.
//!
//! A [`Report`] is a title and [`Block`]s in their order; a [`Chart`] is curves, bands and points over two axes.
//! [`Report::html`] writes them. Every text is escaped here and nowhere else: what a log calls its columns may be
//! anything. Same report, same bytes.

mod chart;
mod curve;
mod document;
mod draw;
mod escape;
mod html;
mod palette;
mod ticks;

pub use chart::{Axis, Chart, Mark, Scale};
pub use document::{Block, Cell, Report, Table, Tone};
pub use palette::Ink;
