//! The Earth in sunlight, as a camera for visible light sees it: ground, clouds, air, Sun, Moon and stars.
//!
//! The unit of light is the light that a white, matt surface reflects under the Sun at the zenith, before the exposure.
//! There are three channels (red 650 nm, green 550 nm, blue 450 nm). The equations are in book/theory/simulator.md.

pub(crate) mod air;
pub(crate) mod discs;
pub(crate) mod ground;
pub(crate) mod shade;

pub use air::Air;
pub use ground::{Ground, Texture};

use serde::{Deserialize, Serialize};

use crate::texture::Clouds;

/// The world that a camera for visible light sees. The scene's `light` sets the direction of the Sun. If it is not
/// `Light::Sun`, the Sun is at the camera's zenith.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Visible {
    /// Draws the Sun's disc with its bloom, glare and ghosts if it is in view.
    pub sun_in_view: bool,
    /// Land, sea, ice.
    pub ground: Ground,
    /// Clouds. For a clear sky, leave the table out and set `clear = true`.
    pub clouds: Clouds,
    /// Leaves out all clouds.
    pub clear: bool,
    /// The air.
    pub air: Air,
    /// Number of stars over the whole sphere.
    pub stars: u32,
    /// Light of the brightest star in one pixel at exposure 1; the faintest star has a hundredth of it.
    pub star_brightness: f64,
}

impl Default for Visible {
    fn default() -> Self {
        Self {
            sun_in_view: true,
            ground: Ground::default(),
            clouds: Clouds {
                cover: 0.45,
                largest_km: 900.0,
                smallest_km: 1.5,
                softness: 0.7,
                brightness: 0.85,
                seed: 1,
            },
            clear: false,
            air: Air::default(),
            stars: 4000,
            star_brightness: 0.5,
        }
    }
}
