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

#[cfg(test)]
mod tests {
    use hzn_mcap::palette::{AXIS, INLIER, LIMB, REJECTED};

    use super::*;

    /// Returns how far two colours are apart, as a distance of red, green and blue.
    fn apart(a: Colour, b: Colour) -> f64 {
        a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(b)).powi(2)).sum::<f64>().sqrt()
    }

    /// The eye tells lines side by side apart whose colours differ by this much.
    const SEEN: f64 = 30.0;

    /// 22 edges that were refused are not all alike: six neighbours differ, and none looks like another part.
    #[test]
    fn neighbouring_edges_have_different_colours() {
        let edges: Vec<Colour> = (0..22).map(edge_colour).collect();
        for (i, edge) in edges.iter().enumerate() {
            for other in edges.iter().skip(i + 1).take(EDGES.len() - 1) {
                assert!(apart(*edge, *other) > SEEN, "{i}: {edge:?} {other:?}");
            }
            for (part, colour) in
                [("limb", LIMB), ("inlier", INLIER), ("rejected", REJECTED), ("axis", AXIS), ("truth", TRUTH)]
            {
                assert!(apart(*edge, colour) > SEEN, "{part}: {edge:?}");
            }
        }
    }
}
