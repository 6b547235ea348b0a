//! Simulation at the sample time: the rig with its loops, scenarios, and models side by side.

mod active_loop;
mod closed_loop;
mod compare;
mod ensemble;
mod excite;
mod figures;
mod flock;
mod flock_loop;
mod real_rig;
mod scenario;
mod scenario_event;
mod start;
mod trial;
mod watch;

pub use active_loop::{ActiveLoop, LoopTarget};
pub use closed_loop::ClosedLoop;
pub use compare::{CompareError, Comparison, InputSeries, ModelKind, ModelTrace, agreement};
pub use ensemble::{EnsembleRun, MOST_MEMBERS, MemberFigures, Spread, quantile, run_ensemble, vary};
pub use excite::ExcitationNow;
pub use figures::LoopFigures;
pub use real_rig::{LevelResistance, record_real_rig};
pub use scenario::{
    Run, Scenario, ScenarioError, Start, run_excitation, run_scenario, run_scenario_while, scenario_loop,
    scenario_start,
};
pub use scenario_event::ScenarioEvent;
pub use start::{StartError, check_starts};
pub use trial::{Trial, TrialRun, run_trial};
