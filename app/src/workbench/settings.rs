//! What the window remembers from one start to the next.

use std::path::PathBuf;

use eframe::egui::ThemePreference;
use egui_tiles::Tree;
use serde::{Deserialize, Serialize};
use vasos_io::settings::SettingsTrouble;

use super::tiles;
use crate::i18n::Language;
use crate::panes::PaneKind;

/// Name of the settings file, without its ending.
const NAME: &str = "window";
/// Files remembered.
const MOST_RECENT: usize = 8;
/// Smallest and largest size of everything on the screen.
pub const ZOOM: [f32; 2] = [0.8, 3.0];

/// The window's settings.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Language.
    pub language: Language,
    /// Dark (or light).
    pub dark: bool,
    /// Size of everything, 1 being normal.
    pub zoom: f32,
    /// Arrangement of the panes.
    pub layout: Option<Tree<PaneKind>>,
    /// Preset in use.
    pub rig: Option<String>,
    /// Files opened last, newest first.
    pub recent: Vec<PathBuf>,
    /// Record every run.
    pub record_always: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            language: Language::of_system(),
            dark: true,
            zoom: 1.0,
            layout: None,
            rig: None,
            recent: vec![],
            record_always: false,
        }
    }
}

impl Settings {
    /// Reads the settings; a damaged file is kept beside and the defaults are used.
    #[must_use]
    pub fn load() -> (Self, Option<SettingsTrouble>) {
        let (mut settings, trouble): (Self, _) = vasos_io::settings::load(NAME);
        if settings.layout.as_ref().is_some_and(|tree| !tiles::is_whole(tree)) {
            settings.layout = None;
        }
        (settings, trouble)
    }

    /// Writes the settings.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self) -> Result<(), SettingsTrouble> {
        vasos_io::settings::save(NAME, self)
    }

    /// The theme for egui.
    #[must_use]
    pub fn theme(&self) -> ThemePreference {
        if self.dark { ThemePreference::Dark } else { ThemePreference::Light }
    }

    /// The size of everything, within its limits.
    #[must_use]
    pub fn zoom(&self) -> f32 {
        if self.zoom.is_finite() { self.zoom.clamp(ZOOM[0], ZOOM[1]) } else { 1.0 }
    }

    /// Puts a file in front of the recent ones, by its whole path: the next start may be from another folder.
    pub fn remember(&mut self, path: PathBuf) {
        let path = std::path::absolute(&path).unwrap_or(path);
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(MOST_RECENT);
    }
}
