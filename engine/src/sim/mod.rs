//! Simulation at the sample time: the rig with its loops, and scenarios.

mod closed_loop;
mod scenario;
mod start;

pub use closed_loop::{ActiveLoop, ClosedLoop};
pub use scenario::{Run, Scenario, ScenarioError, ScenarioEvent, Start, run_scenario};
pub use start::{StartError, check_starts};
