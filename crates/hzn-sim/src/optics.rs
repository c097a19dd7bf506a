//! Effects of the lens besides its projection: fall-off of light, and stray light of the Sun.

use serde::{Deserialize, Serialize};

/// Imperfections of the lens; a perfect lens has only zeros. Stray light is drawn only in worlds with a visible Sun.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Optics {
    /// Share of the light that is lost in the corner farthest from the principal point, 0 to 1. Between the principal
    /// point and that corner the loss grows with the square of the distance.
    pub vignetting: f64,
    /// Stray light around the Sun, as its value at the rim of the disc. It falls with the square of the distance.
    pub bloom: f64,
    /// Stray light over the whole picture while the Sun is in the middle. It falls with the square of the cosine of the
    /// Sun's angle from the optical axis.
    pub veil: f64,
    /// Light of the brightest reflection between the lens's surfaces.
    pub ghosts: f64,
}

/// A reflection: a disc on the line from the Sun through the principal point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ghost {
    /// Position on that line: 1 at the Sun, 0 at the principal point, −1 at the Sun's distance on the other side.
    pub(crate) along: f64,
    /// Radius as a fraction of the picture's diagonal.
    pub(crate) radius: f32,
    /// Light as a fraction of the light of the brightest reflection.
    pub(crate) strength: f32,
    /// Colour, as factors of red, green and blue.
    pub(crate) colour: [f32; 3],
}

/// Reflections of a lens with a few elements.
pub(crate) const GHOSTS: [Ghost; 6] = [
    Ghost { along: -0.42, radius: 0.022, strength: 1.0, colour: [0.55, 1.0, 0.75] },
    Ghost { along: -0.95, radius: 0.060, strength: 0.35, colour: [0.80, 0.75, 1.0] },
    Ghost { along: 0.38, radius: 0.012, strength: 0.8, colour: [1.0, 0.80, 0.55] },
    Ghost { along: -0.18, radius: 0.009, strength: 0.9, colour: [0.6, 0.9, 1.0] },
    Ghost { along: 0.62, radius: 0.030, strength: 0.30, colour: [1.0, 0.70, 0.70] },
    Ghost { along: -1.55, radius: 0.090, strength: 0.20, colour: [0.7, 1.0, 0.7] },
];
