//! Tuning rules.
