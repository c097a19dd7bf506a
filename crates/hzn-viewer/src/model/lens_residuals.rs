//! The residuals of a lens calibration, as arrows over the picture.

use std::collections::HashMap;
use std::path::Path;

use super::view::Point;

/// A residual of a lens calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrow {
    /// Measured place, px.
    pub at: Point,
    /// Measured minus projected place, px.
    pub error: Point,
    /// False for an outlier.
    pub counts: bool,
}

/// The residuals of a lens calibration by picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LensResiduals {
    /// Name of the file.
    pub file: String,
    by_picture: HashMap<String, Vec<Arrow>>,
    all: Vec<Arrow>,
    /// Root mean square of the length of all residuals that count, px.
    pub rms_px: f64,
}

impl LensResiduals {
    /// Sorts residuals by their picture.
    pub fn new(path: &Path, rows: impl IntoIterator<Item = (String, Arrow)>) -> Self {
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let mut out = Self { file, ..Self::default() };
        for (picture, arrow) in rows {
            out.all.push(arrow);
            out.by_picture.entry(picture).or_default().push(arrow);
        }
        let squares = || out.all.iter().filter(|a| a.counts).map(|a| a.error[0].powi(2) + a.error[1].powi(2));
        out.rms_px = (squares().sum::<f64>() / squares().count().max(1) as f64).sqrt();
        out
    }

    /// Returns the residuals of a picture. A picture of a sequence that has none of the calibrated pictures, for
    /// example of a flight, gets those of all pictures together.
    pub fn of_picture<'a>(&self, picture: &str, mut sequence: impl Iterator<Item = &'a str>) -> &[Arrow] {
        match self.by_picture.get(picture) {
            Some(own) => own,
            None if sequence.any(|name| self.by_picture.contains_key(name)) => &[],
            None => &self.all,
        }
    }

    /// Returns the factor that draws the RMS about `length_px` long: 1, 2 or 5 times a power of ten.
    pub fn enlargement(&self, length_px: f64) -> f64 {
        let wanted = length_px / self.rms_px.max(1e-9);
        let power = 10f64.powf(wanted.max(1e-9).log10().floor());
        [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|x| *x <= wanted * 1.000_001).unwrap_or(power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrow(error: Point, counts: bool) -> Arrow {
        Arrow { at: [10.0, 20.0], error, counts }
    }

    #[test]
    fn a_board_shows_its_own_residuals_and_a_flight_those_of_all_boards() {
        let rows = [("a.png", [0.3, 0.4], true), ("b.png", [0.0, 0.5], true), ("b.png", [9.0, 9.0], false)];
        let rows = rows.map(|(name, error, counts)| (name.to_owned(), arrow(error, counts)));
        let residuals = LensResiduals::new(Path::new("x/residuals.csv"), rows);
        assert!((residuals.rms_px - 0.5).abs() < 1e-12, "outliers do not count");
        let count = |picture: &str, sequence: &[&str]| residuals.of_picture(picture, sequence.iter().copied()).len();
        assert_eq!((count("b.png", &["a.png", "b.png"]), count("c.png", &["a.png", "c.png"])), (2, 0));
        assert_eq!(count("0001.jpg", &["0001.jpg"]), 3);
        assert_eq!([residuals.enlargement(30.0), residuals.enlargement(9.0)], [50.0, 10.0]);
        assert!(LensResiduals::default().enlargement(30.0).is_finite());
    }
}
