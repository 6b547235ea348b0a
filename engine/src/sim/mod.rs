//! Simulation at the sample time: the rig with its loops, scenarios, and models side by side.

mod closed_loop;
mod compare;
mod real_rig;
mod scenario;
mod start;

pub use closed_loop::{ActiveLoop, ClosedLoop};
pub use compare::{CompareError, Comparison, InputSeries, ModelKind, ModelTrace, agreement};
pub use real_rig::{LevelResistance, record_real_rig};
pub use scenario::{Run, Scenario, ScenarioError, ScenarioEvent, Start, run_scenario, scenario_start};
pub use start::{StartError, check_starts};
