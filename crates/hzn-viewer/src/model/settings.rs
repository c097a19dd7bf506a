//! What is remembered from one run to the next.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// Files that are offered again.
const RECENT: usize = 8;

/// How the picture is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Look {
    /// As the camera saw it.
    #[default]
    Colour,
    /// The brightness that is compared with the level.
    Grey,
    /// Lit or dark.
    Level,
}

impl Look {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Colour, Self::Grey, Self::Level];
    /// Its name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Colour => "Colour",
            Self::Grey => "Grey",
            Self::Level => "Level",
        }
    }
}

/// What is drawn over the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// Pixels that were read: search lines and edges.
    Touched,
    /// All candidate edges, each in its colour.
    Edges,
    /// Points that do not belong to the limb.
    Rejected,
    /// Points that carry the answer.
    Inliers,
    /// The fitted limb.
    Limb,
    /// The axis with its 3-sigma ellipse.
    Axis,
    /// Sun and Moon where they should be.
    Sky,
    /// Masked parts.
    Mask,
    /// The image circle.
    Circle,
    /// The true limb.
    Truth,
}

impl Layer {
    /// All of them, in the order in which they are listed.
    pub const ALL: [Self; 10] = [
        Self::Touched,
        Self::Edges,
        Self::Rejected,
        Self::Inliers,
        Self::Limb,
        Self::Axis,
        Self::Sky,
        Self::Mask,
        Self::Circle,
        Self::Truth,
    ];
    /// Its name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Touched => "Touched pixels",
            Self::Edges => "Candidate edges",
            Self::Rejected => "Rejected points",
            Self::Inliers => "Inliers",
            Self::Limb => "Fitted limb",
            Self::Axis => "Axis and 3σ",
            Self::Sky => "Sun and Moon",
            Self::Mask => "Mask",
            Self::Circle => "Image circle",
            Self::Truth => "True limb",
        }
    }
}

/// What is remembered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Dark colours.
    pub dark: bool,
    /// How the picture is shown.
    pub look: Look,
    /// Without the lens's distortion.
    pub undistorted: bool,
    /// What is drawn over the picture.
    pub layers: Vec<Layer>,
    /// The panel of stages is shown.
    pub stages: bool,
    /// The panel of plots is shown.
    pub plots: bool,
    /// Names of the quantities that are plotted.
    pub plotted: Vec<String>,
    /// What was opened last, the newest first.
    pub recent: Vec<PathBuf>,
    /// Width and height of the window.
    pub window: [f32; 2],
    /// Width of the column with the answer.
    pub side_width: f32,
    /// Width of the column of stages.
    pub stages_width: f32,
    /// Height of the plots.
    pub plots_height: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            dark: true,
            look: Look::Colour,
            undistorted: false,
            layers: vec![
                Layer::Edges,
                Layer::Rejected,
                Layer::Inliers,
                Layer::Limb,
                Layer::Axis,
                Layer::Sky,
                Layer::Mask,
                Layer::Circle,
            ],
            stages: true,
            plots: true,
            plotted: ["3 sigma", "RMS"].map(str::to_owned).to_vec(),
            recent: Vec::new(),
            window: [1440.0, 900.0],
            side_width: 208.0,
            stages_width: 364.0,
            plots_height: 206.0,
        }
    }
}

impl Settings {
    /// Is this drawn?
    pub fn shows(&self, layer: Layer) -> bool {
        self.layers.contains(&layer)
    }
    /// Draws it, or not.
    pub fn show(&mut self, layer: Layer, on: bool) {
        self.layers.retain(|l| *l != layer);
        if on {
            self.layers.push(layer);
        }
    }
    /// Puts a file first among those opened last.
    pub fn opened(&mut self, path: &Path) {
        // Relative names mean something else in another folder.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(RECENT);
    }

    /// Where they are kept; `None` where the system names no place.
    pub fn place() -> Option<PathBuf> {
        let config = std::env::var_os("XDG_CONFIG_HOME").map(PathBuf::from).filter(|p| p.is_absolute());
        let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".config"));
        Some(config.or_else(home)?.join("hzn").join("viewer.json"))
    }
    /// Reads them. What is missing or cannot be read is as at first.
    pub fn load(place: &Path) -> Self {
        std::fs::read_to_string(place).ok().and_then(|t| serde_json::from_str(&t).ok()).unwrap_or_default()
    }
    /// Writes them.
    ///
    /// # Errors
    /// What the disk says.
    pub fn store(&self, place: &Path) -> std::io::Result<()> {
        if let Some(folder) = place.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(place, serde_json::to_string_pretty(self)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("hzn").join("viewer.json");
        let mut settings = Settings { dark: false, look: Look::Level, ..Settings::default() };
        settings.show(Layer::Touched, true);
        settings.show(Layer::Limb, false);
        settings.opened(Path::new("/a/b.mcap"));
        settings.store(&place).unwrap();
        assert_eq!(Settings::load(&place), settings);
        std::fs::write(&place, "{\"dark\": false, \"unknown\": 3}").unwrap();
        assert_eq!(Settings::load(&place), Settings { dark: false, ..Settings::default() });
        std::fs::write(&place, "no json").unwrap();
        assert_eq!(Settings::load(&place), Settings::default());
    }

    #[test]
    fn files_opened_last_come_first_and_once() {
        let mut settings = Settings::default();
        for n in 0..12 {
            settings.opened(Path::new(&format!("/{n}")));
        }
        settings.opened(Path::new("/9"));
        assert_eq!(settings.recent.len(), RECENT);
        assert_eq!(settings.recent[..3], ["/9", "/11", "/10"].map(PathBuf::from));
    }
}
