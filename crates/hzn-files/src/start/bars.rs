//! Black bars along the sides of the pictures, as letterboxing writes them, and white frames of scans and screenshots.
//!
//! The principal point stays in the middle of the whole picture: letterboxing adds equal bars on two sides, and a bar
//! beside a sky that is as black in all pictures is not seen.

use super::focal::{focal_px, fov_deg};
use hzn_core::camera::Model;

/// Rows and columns of the content next to a bar that are masked with it: scaling mixes them with the bar.
const BLENDED_PX: f64 = 1.0;

/// The widths of the bars along the four sides of the pictures, in pixels; 0 where there is none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Bars {
    /// Columns at the left side.
    pub left_px: u32,
    /// Columns at the right side.
    pub right_px: u32,
    /// Rows at the upper side.
    pub top_px: u32,
    /// Rows at the lower side.
    pub bottom_px: u32,
    /// Whether they are brighter than the content, as a white frame is.
    pub bright: bool,
}

impl Bars {
    /// Returns the bars in words, as `black bars, 60 rows above and 60 rows below`.
    pub fn describe(&self) -> String {
        let kind = if self.bright { "a bright frame" } else { "black bars" };
        let sides = [
            (self.top_px, "row", "above"),
            (self.bottom_px, "row", "below"),
            (self.left_px, "column", "at the left"),
            (self.right_px, "column", "at the right"),
        ];
        let there = sides.iter().filter(|(px, ..)| *px > 0);
        let words = there.map(|(px, line, place)| format!("{px} {line}{} {place}", if *px == 1 { "" } else { "s" }));
        format!("{kind}, {}", words.collect::<Vec<_>>().join(" and "))
    }

    /// Returns `mask.polygons_px` that covers the bars, as a TOML array, for pictures of this size.
    pub fn polygons_px(&self, [width, height]: [u32; 2]) -> String {
        let (w, h) = (f64::from(width), f64::from(height));
        // From half a pixel outside of the picture to the middle between a masked and a free pixel.
        let far = |px: u32| f64::from(px) + BLENDED_PX - 0.5;
        let boxes = [
            (self.top_px, [-0.5, -0.5, w - 0.5, far(self.top_px)]),
            (self.bottom_px, [-0.5, h - 1.0 - far(self.bottom_px), w - 0.5, h - 0.5]),
            (self.left_px, [-0.5, -0.5, far(self.left_px), h - 0.5]),
            (self.right_px, [w - 1.0 - far(self.right_px), -0.5, w - 0.5, h - 0.5]),
        ];
        let there = boxes.iter().filter(|(px, _)| *px > 0);
        let corners = there.map(|(_, [x0, y0, x1, y1])| {
            format!("[[{x0:.1}, {y0:.1}], [{x1:.1}, {y0:.1}], [{x1:.1}, {y1:.1}], [{x0:.1}, {y1:.1}]]")
        });
        format!("[{}]", corners.collect::<Vec<_>>().join(", "))
    }

    /// Returns the field of view over the whole width of a camera whose content, between the bars, is `fov` wide;
    /// `None` if no bar is at the left or right, or if the lens cannot have it.
    pub fn whole_width_deg(&self, lens: Model, width: u32, fov: f64) -> Option<f64> {
        let content = f64::from(width.checked_sub(self.left_px + self.right_px)?);
        let is_beside = self.left_px + self.right_px > 0;
        focal_px(lens, content, fov).filter(|_| is_beside).map(|px| fov_deg(lens, f64::from(width), px))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_have_words_and_polygons() {
        let bars = Bars { top_px: 60, bottom_px: 1, ..Bars::default() };
        assert_eq!(bars.describe(), "black bars, 60 rows above and 1 row below");
        let polygons = "[[[-0.5, -0.5], [99.5, -0.5], [99.5, 60.5], [-0.5, 60.5]], \
                        [[-0.5, 197.5], [99.5, 197.5], [99.5, 199.5], [-0.5, 199.5]]]";
        assert_eq!(bars.polygons_px([100, 200]), polygons);
        assert_eq!(bars.whole_width_deg(Model::Pinhole, 100, 60.0), None);
        let beside = Bars { left_px: 25, right_px: 25, ..Bars::default() };
        assert!((beside.whole_width_deg(Model::Equidistant, 100, 60.0).unwrap() - 120.0).abs() < 1e-9);
    }
}
