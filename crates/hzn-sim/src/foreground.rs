//! Parts of the vehicle in front of the scene.

use serde::{Deserialize, Serialize};

/// A polygon of uniform brightness in front of the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foreground {
    /// Corners (x, y) in pixels; the last corner is joined to the first.
    pub polygon_px: Vec<[f64; 2]>,
    /// Brightness as a fraction of full scale.
    pub brightness: f64,
}

/// Number of sub-rows in a pixel row. Along a row the coverage is exact.
const SUB_ROWS: u32 = 8;

impl Foreground {
    /// Returns true if a point in pixels is inside the polygon (even-odd rule).
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        self.crossings(y).iter().filter(|&&c| c <= x).count() % 2 == 1
    }

    /// Returns the sorted x positions at which the outline crosses the row `y`.
    fn crossings(&self, y: f64) -> Vec<f64> {
        let corners = &self.polygon_px;
        let mut xs: Vec<f64> = corners
            .iter()
            .zip(corners.iter().cycle().skip(1))
            .filter(|(a, b)| (a[1] <= y) != (b[1] <= y))
            .map(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
            .collect();
        xs.sort_by(f64::total_cmp);
        xs
    }

    /// Blends the polygon over row `y` of a picture.
    pub(crate) fn draw_row(&self, y: usize, row: &mut [f32]) {
        let reach =
            self.polygon_px.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| (lo.min(c[1]), hi.max(c[1])));
        if (y as f64) + 0.5 < reach.0 || (y as f64) - 0.5 > reach.1 {
            return;
        }
        let mut cover = vec![0.0f32; row.len()];
        for sub in 0..SUB_ROWS {
            let v = y as f64 - 0.5 + (f64::from(sub) + 0.5) / f64::from(SUB_ROWS);
            for span in self.crossings(v).chunks_exact(2) {
                // Pixel i covers i − ½ to i + ½.
                let (from, to) = (span[0] + 0.5, span[1] + 0.5);
                let first = from.floor().clamp(0.0, row.len() as f64) as usize;
                let last = to.ceil().clamp(0.0, row.len() as f64) as usize;
                for (i, c) in cover.iter_mut().enumerate().take(last).skip(first) {
                    *c += (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0) as f32 / SUB_ROWS as f32;
                }
            }
        }
        for (p, c) in row.iter_mut().zip(cover) {
            *p += c * (self.brightness as f32 - *p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_of_a_square_between_pixels() {
        let square = Foreground { polygon_px: vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]], brightness: 1.0 };
        let rows: Vec<Vec<f32>> = (0..4)
            .map(|y| {
                let mut row = vec![0.0; 4];
                square.draw_row(y, &mut row);
                row
            })
            .collect();
        assert_eq!(rows, [[0.25, 0.5, 0.25, 0.0], [0.5, 1.0, 0.5, 0.0], [0.25, 0.5, 0.25, 0.0], [0.0; 4]]);
        assert!(square.contains([1.0, 1.0]) && !square.contains([2.5, 1.0]) && !square.contains([1.0, -0.5]));
    }
}
