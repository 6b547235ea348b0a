//! Loop analysis.
