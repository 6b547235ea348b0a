//! SimTank's three tanks under loops of one's own.

use std::sync::Arc;

use vasos_engine::plant::Network;
use vasos_io::rig::{FileError, PRESETS, parse_rig};

/// SimTank with three tanks and other loops.
///
/// # Errors
/// [`FileError`] of the loops.
///
/// # Panics
/// When the preset is missing.
pub fn three_tanks(loops: &str) -> Result<Arc<Network>, FileError> {
    let text = PRESETS.iter().find(|p| p.id == "simtank3").expect("preset").text;
    let head = text.split("[[configuration.loop]]").next().expect("a head");
    parse_rig("loops.toml", &format!("{head}start_steady = true\n{loops}"))
}

/// The level of the third tank over that of the first.
pub const CASCADE: &str = r#"
[[configuration.loop]]
id = "LIC-01"
sensor = "LT01"
pump = "BA01"
setpoint_cm = 10.0
mode = "cascade"
kc = 20.0
ti_s = 30.0

[[configuration.loop]]
id = "LIC-03"
sensor = "LT03"
cascade_to = "LIC-01"
setpoint_cm = 2.0
mode = "automatic"
kc = 2.0
ti_s = 120.0
"#;
