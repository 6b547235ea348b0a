//! Small controls that several panes share.

mod icon;
mod segmented;

pub use icon::{Icon, icon_button};
pub use segmented::segmented;
