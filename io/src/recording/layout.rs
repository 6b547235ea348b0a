//! Which channel goes to which entity, under which name and colour, and how a viewer lays them out.

use rerun::blueprint::{
    Blueprint, BlueprintPanel, ComponentSourceKind, ContainerLike, Horizontal, SelectionPanel, Spatial2DView,
    Tabs, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical, VisualizableArchetype,
    Visualizer, VisualizerComponentMapping,
};
use rerun::external::re_sdk_types::blueprint::components::{PanelState, PlayState};
use rerun::{Color, ComponentDescriptor, ComponentIdentifier, Scalars, SeriesLines};
use vasos_engine::plant::Network;
use vasos_engine::signal::{ChannelKind, ChannelSet};

/// Timeline in seconds of the run.
pub const TIME: &str = "time";
/// Timeline of the computer's clock.
pub const WALL_CLOCK: &str = "wall_clock";
/// Entity of all that is sampled; one chunk a batch, because an entity of its own costs some 1 kB a batch.
pub const SIGNALS: &str = "signals";
/// Component of the levels.
pub const LEVELS: &str = "levels";
/// Component of flows, pump inputs, valve angles and spills.
pub const FLOWS: &str = "flows";
/// Entity of the events.
pub const EVENTS: &str = "events";
/// Component of [`EVENTS`] with what a replay carries out.
pub(super) const TOLD: &str = "told";
/// Entity of the models that came into use.
pub const MODELS: &str = "models";
/// Entity above the fits of models: measured and modelled PV.
pub const FITS: &str = "fits";
/// Entity above the Nyquist curve of the loop in view.
pub const NYQUIST: &str = "nyquist";
/// Entity above the drawing of the tanks.
pub const RIG: &str = "rig";

const SETPOINT: [u8; 3] = [240, 170, 50];
const PV: [u8; 3] = [80, 170, 240];
const MV: [u8; 3] = [110, 205, 130];
const SERIES: [[u8; 3]; 8] = [
    [80, 170, 240],
    [110, 205, 130],
    [240, 170, 50],
    [190, 140, 240],
    [240, 120, 130],
    [90, 205, 205],
    [200, 200, 120],
    [170, 170, 180],
];

/// Channels that share a component.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    /// Component of [`SIGNALS`].
    pub component: String,
    /// Title of its view.
    pub title: String,
    /// Columns of the run.
    pub columns: Vec<usize>,
    /// Names with units, as shown.
    pub names: Vec<String>,
    /// Red, green, blue.
    pub colors: Vec<[u8; 3]>,
    /// Drawn from the start; the others can be switched on in the legend.
    pub shown: Vec<bool>,
    /// Columns of the group that are levels in cm, drawn apart from outputs.
    is_loop: bool,
}

impl Group {
    fn new(component: String, title: String, is_loop: bool) -> Self {
        let none = || Vec::new();
        Self { component, title, columns: none(), names: vec![], colors: vec![], shown: vec![], is_loop }
    }

    fn push(&mut self, column: usize, channels: &ChannelSet, color: [u8; 3], shown: bool) {
        let channel = &channels.channels[column];
        self.columns.push(column);
        self.names.push(format!("{} ({})", short(&channel.name), channel.unit));
        self.colors.push(color);
        self.shown.push(shown);
    }

    /// What the viewer is told of the component: numbers to draw.
    ///
    /// # Errors
    /// When the component has no name.
    pub fn descriptor(&self) -> Result<ComponentDescriptor, Box<dyn std::error::Error>> {
        let component = ComponentIdentifier::try_new(&self.component)?;
        let component_type = Scalars::descriptor_scalars().component_type;
        Ok(ComponentDescriptor { archetype: None, component, component_type })
    }

    /// Lines of this component in a view.
    fn visualizer(&self, shown: &[bool]) -> Visualizer {
        let mapping = VisualizerComponentMapping {
            target: Scalars::descriptor_scalars().component.as_str().into(),
            source_kind: ComponentSourceKind::SourceComponent,
            source_component: Some(self.component.as_str().into()),
            selector: None,
        };
        self.series(shown).visualizer().with_mappings([mapping.into()])
    }

    /// Names, colours and visibility for the viewer.
    fn series(&self, shown: &[bool]) -> SeriesLines {
        let colors = self.colors.iter().map(|c| Color::from_rgb(c[0], c[1], c[2]));
        SeriesLines::new()
            .with_names(self.names.iter().map(String::as_str))
            .with_colors(colors)
            .with_widths(self.colors.iter().map(|_| 1.8_f32))
            .with_visible_series(shown.iter().copied())
    }
}

/// A channel's name without the unit at its end, which is shown in brackets.
fn short(name: &str) -> &str {
    ["_cm3_s", "_cm", "_deg", "_percent", "_v"]
        .iter()
        .find_map(|unit| name.strip_suffix(unit))
        .unwrap_or(name)
}

/// The components of a run: one a loop, one for the levels, one for flows and what drives them.
pub(super) fn groups(channels: &ChannelSet, network: &Network) -> Vec<Group> {
    let mut loops: Vec<Group> = (0..channels.slots)
        .map(|slot| Group::new(format!("loop_{}", slot + 1), loop_title(network, slot), true))
        .collect();
    let mut levels = Group::new(LEVELS.to_owned(), "Levels (cm)".to_owned(), false);
    let mut flows = Group::new(FLOWS.to_owned(), "Flows (cm³/s)".to_owned(), false);
    for (column, channel) in channels.channels.iter().enumerate() {
        let (group, color, shown) = match channel.kind {
            ChannelKind::Setpoint(slot) => (loops.get_mut(slot), Some(SETPOINT), true),
            ChannelKind::Pv(slot) => (loops.get_mut(slot), Some(PV), true),
            ChannelKind::Mv(slot) => (loops.get_mut(slot), Some(MV), true),
            ChannelKind::Level(_) => (Some(&mut levels), None, true),
            ChannelKind::Arriving(_) | ChannelKind::ValveFlow(_) => (Some(&mut flows), None, true),
            ChannelKind::Input(_) | ChannelKind::Angle(_) | ChannelKind::Spill(_) => {
                (Some(&mut flows), None, false)
            }
        };
        if let Some(group) = group {
            let color = color.unwrap_or(SERIES[group.columns.len() % SERIES.len()]);
            group.push(column, channels, color, shown);
        }
    }
    loops.extend([levels, flows]);
    loops.retain(|group| !group.columns.is_empty());
    loops
}

/// Tags of the loops that use a slot, in any configuration.
fn loop_title(network: &Network, slot: usize) -> String {
    let mut tags: Vec<&str> = Vec::new();
    for configuration in &network.spec.configurations {
        if let Some(l) = configuration.loops.get(slot)
            && !tags.contains(&l.id.as_str())
        {
            tags.push(&l.id);
        }
    }
    tags.join(" / ")
}

/// How a viewer opens: trends on the left, the tanks on the right, and below them tabs with events, Nyquist curve,
/// model and fits. With it, the paths of the trends
/// in the blueprint.
pub(super) fn blueprint(groups: &[Group]) -> (Blueprint, Vec<String>) {
    let mut trends: Vec<ContainerLike> = Vec::new();
    let mut shares: Vec<f32> = Vec::new();
    for group in groups {
        if group.is_loop {
            let cm: Vec<bool> = group.colors.iter().map(|c| *c != MV).collect();
            let mv: Vec<bool> = cm.iter().map(|cm| !cm).collect();
            trends.push(trend(group, &format!("{}: PV and SP (cm)", group.title), &cm));
            let unit = group.names.last().and_then(|n| n.split_once(' ')).map_or("", |n| n.1);
            trends.push(trend(group, &format!("{}: MV {unit}", group.title), &mv));
            shares.extend([2.0, 1.2]);
        } else {
            trends.push(trend(group, &group.title, &group.shown));
            shares.push(1.4);
        }
    }
    let tanks = Spatial2DView::new("Tanks").with_origin(RIG).with_contents([format!("/{RIG}/**")]);
    let events = TextLogView::new("Events").with_origin(EVENTS).with_contents([format!("/{EVENTS}")]);
    let models = TextDocumentView::new("Model").with_origin(MODELS).with_contents([format!("/{MODELS}")]);
    let fits: ContainerLike =
        TimeSeriesView::new("Fits").with_origin(FITS).with_contents([format!("/{FITS}/**")]).into();
    let nyquist =
        Spatial2DView::new("Nyquist, −Im up").with_origin(NYQUIST).with_contents([format!("/{NYQUIST}/**")]);
    let view_path = |c: &ContainerLike| match c {
        ContainerLike::View(view) => Some(view.blueprint_path().to_string()),
        _ => None,
    };
    let paths = trends.iter().chain([&fits]).filter_map(view_path).collect();
    let study = Tabs::new([events.into(), nyquist.into(), models.into(), fits]);
    let right = Vertical::new([tanks.into(), study.into()]).with_row_shares([3.0, 2.0]);
    let left = Vertical::new(trends).with_row_shares(shares);
    let root = Horizontal::new([left.into(), right.into()]).with_column_shares([3.0, 2.0]);
    let time = TimePanel::new().with_timeline(TIME).with_play_state(PlayState::Following);
    let blueprint = Blueprint::new(root)
        .with_auto_layout(false)
        .with_auto_views(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(time.with_state(PanelState::Collapsed));
    (blueprint, paths)
}

fn trend(group: &Group, title: &str, shown: &[bool]) -> ContainerLike {
    TimeSeriesView::new(title)
        .with_origin(SIGNALS)
        .with_contents([format!("/{SIGNALS}")])
        .with_override(SIGNALS, group.visualizer(shown))
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_of_every_preset_has_one_place() {
        for preset in crate::rig::PRESETS {
            let network = crate::rig::preset(preset.id).expect("preset");
            let channels = ChannelSet::of(&network);
            let mut columns: Vec<usize> =
                groups(&channels, &network).iter().flat_map(|g| g.columns.clone()).collect();
            columns.sort_unstable();
            assert_eq!(columns, (0..channels.len()).collect::<Vec<_>>(), "{}", preset.id);
        }
    }
}
