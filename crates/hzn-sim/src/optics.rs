//! What the lens does besides projecting: falling off, and stray light of the Sun.

use serde::{Deserialize, Serialize};

/// Imperfections of the lens. Zero is a perfect one. Stray light is drawn in worlds that have a Sun to be seen.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Optics {
    /// Share of the light that is lost in the corner farthest from the principal point, 0 to 1; between, it grows with
    /// the square of the distance.
    pub vignetting: f64,
    /// Light around the Sun: this much at the rim of its disc, falling with the square of the distance.
    pub bloom: f64,
    /// Light the Sun spreads over the whole picture when it stands in the middle; aside, with the square of the cosine.
    pub veil: f64,
    /// Light of the brightest reflection between the lens's surfaces.
    pub ghosts: f64,
}

/// A reflection: a disc on the line from the Sun through the principal point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ghost {
    /// Its place on that line: 1 at the Sun, 0 at the principal point, −1 as far on the other side.
    pub(crate) along: f64,
    /// Radius over the picture's diagonal.
    pub(crate) radius: f32,
    /// Light over that of the brightest.
    pub(crate) strength: f32,
    /// Tint.
    pub(crate) colour: [f32; 3],
}

/// Those of a lens with a handful of elements.
pub(crate) const GHOSTS: [Ghost; 6] = [
    Ghost { along: -0.42, radius: 0.022, strength: 1.0, colour: [0.55, 1.0, 0.75] },
    Ghost { along: -0.95, radius: 0.060, strength: 0.35, colour: [0.80, 0.75, 1.0] },
    Ghost { along: 0.38, radius: 0.012, strength: 0.8, colour: [1.0, 0.80, 0.55] },
    Ghost { along: -0.18, radius: 0.009, strength: 0.9, colour: [0.6, 0.9, 1.0] },
    Ghost { along: 0.62, radius: 0.030, strength: 0.30, colour: [1.0, 0.70, 0.70] },
    Ghost { along: -1.55, radius: 0.090, strength: 0.20, colour: [0.7, 1.0, 0.7] },
];
