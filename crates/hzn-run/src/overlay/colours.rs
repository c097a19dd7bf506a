//! Colours that only overlays have; the others are those of a recording's annotations.

use hzn_mcap::palette::EDGE;

use super::canvas::Colour;

/// The true limb.
pub(super) const TRUTH: Colour = [230, 159, 0];

/// Candidate edges, in turn. None of the colours is that of another part of a drawing.
const EDGES: [Colour; 6] = [EDGE, [150, 130, 220], [196, 164, 132], [160, 176, 70], [100, 214, 204], [120, 140, 196]];

/// Returns the colour of a candidate edge, by its number.
pub fn edge_colour(candidate: usize) -> Colour {
    EDGES.get(candidate % EDGES.len()).copied().unwrap_or(EDGE)
}
