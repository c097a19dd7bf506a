//! Settings that are kept from one run to the next.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::atomic_file;

/// Number of recent files that are offered.
const MAX_RECENT: usize = 8;
/// Titles of plots in settings of older versions, and their titles now.
const OLD_PLOTS: [(&str, &str); 3] = [("Level", "Threshold"), ("Error", "Error (truth)"), ("Time", "Processing")];

/// Display of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Look {
    /// Colours as in the camera's picture.
    #[default]
    Colour,
    /// Brightness, which is compared with the threshold.
    Grey,
    /// Lit or dark pixels.
    Level,
    /// Brightness as colours, for infrared pictures and for small differences.
    FalseColour,
}

/// Range of brightness that is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contrast {
    /// Pictures with more than 8 bits are stretched, because they use a small part of their range.
    #[default]
    ByDepth,
    /// Every picture is stretched to the range of its pixels.
    Stretched,
    /// Every picture is shown from 0 to full scale.
    Full,
}

impl Contrast {
    /// Returns true if a picture with this number of bits is stretched.
    pub const fn stretches(self, bits: u8) -> bool {
        match self {
            Self::ByDepth => bits > 8,
            Self::Stretched => true,
            Self::Full => false,
        }
    }
}

impl Look {
    /// All looks.
    pub const ALL: [Self; 4] = [Self::Colour, Self::Grey, Self::Level, Self::FalseColour];
    /// Returns the name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Colour => "Colour",
            Self::Grey => "Grey",
            Self::Level => "Threshold",
            Self::FalseColour => "False colour",
        }
    }
}

/// Something that is drawn over the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// Pixels that were read: search lines and edges.
    Touched,
    /// All candidate edges, each in a different colour.
    Edges,
    /// Edge points that do not belong to the limb.
    Rejected,
    /// Edge points that the answer is computed from.
    Inliers,
    /// The fitted limb.
    Limb,
    /// The axis with its 3-sigma ellipse.
    Axis,
    /// Expected places of the Sun and the Moon.
    Sky,
    /// Latitudes and longitudes on the body.
    Grid,
    /// The local vertical: nadir, and lines of one elevation.
    Vertical,
    /// Masked parts.
    Mask,
    /// The image circle.
    Circle,
    /// The true limb.
    Truth,
    /// The residuals of a lens calibration as arrows.
    Lens,
}

impl Layer {
    /// All layers, in the order in which they are listed.
    pub const ALL: [Self; 13] = [
        Self::Touched,
        Self::Edges,
        Self::Rejected,
        Self::Inliers,
        Self::Limb,
        Self::Axis,
        Self::Sky,
        Self::Grid,
        Self::Vertical,
        Self::Mask,
        Self::Circle,
        Self::Truth,
        Self::Lens,
    ];
    /// Returns the name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Touched => "Touched pixels",
            Self::Edges => "Candidate edges",
            Self::Rejected => "Outliers",
            Self::Inliers => "Inliers",
            Self::Limb => "Fitted limb",
            Self::Axis => "Axis and 3σ",
            Self::Sky => "Sun and Moon",
            Self::Grid => "Latitude, longitude",
            Self::Vertical => "Local vertical",
            Self::Mask => "Mask",
            Self::Circle => "Image circle",
            Self::Truth => "True limb",
            Self::Lens => "Lens residuals",
        }
    }
}

/// The settings that are kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Dark colours.
    pub dark: bool,
    /// Display of the picture.
    pub look: Look,
    /// Range of brightness that is shown.
    pub contrast: Contrast,
    /// Exponent of the display: above 1, dark parts are brighter.
    pub gamma: f32,
    /// The picture is shown without the distortion of the lens.
    pub undistorted: bool,
    /// Layers that are drawn over the picture.
    pub layers: Vec<Layer>,
    /// The column with the answer is shown.
    pub answer: bool,
    /// The panel of stages is shown.
    pub stages: bool,
    /// The panel of plots is shown.
    pub plots: bool,
    /// Names of the quantities that are plotted.
    pub plotted: Vec<String>,
    /// Quantities whose values are all above zero are plotted on a logarithmic scale.
    pub log_plots: bool,
    /// Files and folders that were opened last, the newest first.
    pub recent: Vec<PathBuf>,
    /// Width and height of the window, in points.
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
            contrast: Contrast::ByDepth,
            gamma: 1.0,
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
                Layer::Lens,
            ],
            answer: true,
            stages: true,
            plots: true,
            plotted: ["3 sigma", "RMS"].map(str::to_owned).to_vec(),
            log_plots: false,
            recent: Vec::new(),
            window: [1440.0, 900.0],
            side_width: 208.0,
            stages_width: 364.0,
            plots_height: 262.0,
        }
    }
}

impl Settings {
    /// Returns true if the layer is drawn.
    pub fn shows(&self, layer: Layer) -> bool {
        self.layers.contains(&layer)
    }
    /// Switches the layer on or off.
    pub fn show(&mut self, layer: Layer, on: bool) {
        self.layers.retain(|l| *l != layer);
        if on {
            self.layers.push(layer);
        }
    }
    /// Puts a file first in the list of recent files.
    pub fn add_recent(&mut self, path: &Path) {
        // A relative path names another file in another folder.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(MAX_RECENT);
    }

    /// Follows the new name of a file that was opened.
    pub fn rename_recent(&mut self, old: &Path, new: &Path) {
        let [old, new] = [old, new].map(|path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
        if old != new && self.recent.contains(&old) {
            self.recent.retain(|p| *p != new);
            self.recent.iter_mut().filter(|p| **p == old).for_each(|p| p.clone_from(&new));
        }
    }

    /// Returns the path of the settings file; `None` if the system names no place for it.
    pub fn default_path() -> Option<PathBuf> {
        let config = std::env::var_os("XDG_CONFIG_HOME").map(PathBuf::from).filter(|p| p.is_absolute());
        let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".config"));
        Some(config.or_else(home)?.join("hzn").join("viewer.json"))
    }
    /// Reads the settings. A missing setting has its default. If the file cannot be read, all settings have their
    /// defaults. A plot that was stored under an old title has its new title.
    pub fn load(path: &Path) -> Self {
        let mut settings: Self =
            std::fs::read_to_string(path).ok().and_then(|t| serde_json::from_str(&t).ok()).unwrap_or_default();
        for title in &mut settings.plotted {
            if let Some((_, now)) = OLD_PLOTS.iter().find(|(old, _)| old == title) {
                *title = (*now).to_owned();
            }
        }
        settings
    }
    /// Writes the settings, completely or not at all.
    ///
    /// # Errors
    /// The file cannot be written; the message says why and what to do.
    pub fn store(&self, path: &Path) -> Result<(), String> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| hzn_run::disk::advice(folder, &e))?;
        }
        let text = serde_json::to_string_pretty(self).map_err(|e| e.to_string())?;
        atomic_file::write(path, text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("hzn").join("viewer.json");
        let mut settings = Settings { dark: false, look: Look::Level, ..Settings::default() };
        settings.show(Layer::Touched, true);
        settings.show(Layer::Limb, false);
        settings.add_recent(Path::new("/a/b.mcap"));
        settings.store(&path).unwrap();
        assert_eq!(Settings::load(&path), settings);
        std::fs::write(&path, "{\"dark\": false, \"unknown\": 3}").unwrap();
        assert_eq!(Settings::load(&path), Settings { dark: false, ..Settings::default() });
        std::fs::write(&path, "{\"look\": \"level\", \"plotted\": [\"Level\", \"RMS\"]}").unwrap();
        let old = Settings::load(&path);
        assert_eq!((old.look, old.plotted), (Look::Level, vec!["Threshold".to_owned(), "RMS".to_owned()]));
        for (_, now) in OLD_PLOTS {
            assert!(crate::model::quantity::QUANTITIES.iter().any(|q| q.name == now), "{now}");
        }
        std::fs::write(&path, "no json").unwrap();
        assert_eq!(Settings::load(&path), Settings::default());
    }

    #[test]
    fn files_opened_last_come_first_and_once() {
        let mut settings = Settings::default();
        for n in 0..12 {
            settings.add_recent(Path::new(&format!("/{n}")));
        }
        settings.add_recent(Path::new("/9"));
        assert_eq!(settings.recent.len(), MAX_RECENT);
        assert_eq!(settings.recent[..3], ["/9", "/11", "/10"].map(PathBuf::from));
    }
}
