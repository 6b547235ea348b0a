//! Simulation at the sample time: the rig with its loops, and scenarios.

mod active_loop;
mod closed_loop;
mod figures;
mod scenario;
mod start;

pub use active_loop::{ActiveLoop, LoopTarget};
pub use closed_loop::ClosedLoop;
pub use figures::LoopFigures;
pub use scenario::{Run, Scenario, ScenarioError, ScenarioEvent, Start, run_scenario};
pub use start::{StartError, check_starts};
