//! `vasos`: the workbench, or one of its commands.

use vasos_app::workbench::{self, Options};

fn main() -> anyhow::Result<()> {
    let file = std::env::args_os().nth(1).map(std::path::PathBuf::from);
    workbench::open(Options { file, ..Options::default() })
}
