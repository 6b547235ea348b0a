//! Simulation at the sample time: the rig with its loops, and scenarios.
