//! OCamCalib's lens (Scaramuzza, Martinelli & Siegwart 2006) in `calib_results.txt`.
//!
//! The file has two polynomials. The first one, from the image to the ray, is the calibrated one; the second one is a
//! fit to it. Only the first one is used here. The toolbox counts rows first, and its z axis points away from the
//! scene: a ray of it is (down, right, backward).
//!
//! The affine parameters turn the picture a little against the toolbox's axes. A lens of hzn has the axes of the
//! picture, so the turn is taken out of the lens, and [`Scaramuzza::turn_rad`] tells it.

use std::path::Path;

use crate::Problem;

/// The step in which the end of the lens is looked for, px.
const STEP_PX: f64 = 0.25;
/// The number of halvings until the image radius of a ray is exact.
const HALVINGS: usize = 60;

/// A lens of OCamCalib.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaramuzza {
    /// Width and height of the picture in pixels.
    pub size_px: [u16; 2],
    /// Column and row of the centre in pixels, pixel centres at integers.
    pub centre_px: [f64; 2],
    /// The affine parameters without the turn, row by row: from (down, right) to (row, column).
    pub affine: [[f64; 2]; 2],
    /// How far the axes of the picture are turned against those of the toolbox, from down to the right, in radians.
    pub turn_rad: f64,
    /// Coefficients a0, a1, … of the toolbox's z = a0 + a1 r + a2 r² + … in pixels.
    polynomial: Vec<f64>,
    /// The radius in pixels up to which the angle off axis grows.
    end_px: f64,
}

impl Scaramuzza {
    /// Creates the lens.
    ///
    /// # Errors
    /// The polynomial or the affine parameters are those of no lens; the text says why.
    pub fn new(
        size_px: [u16; 2],
        centre_px: [f64; 2],
        affine: [f64; 3],
        polynomial: Vec<f64>,
    ) -> Result<Self, &'static str> {
        let [c, d, e] = affine;
        if !(c - d * e > 0.0) {
            return Err("the affine parameters must have c − d·e above 0");
        }
        if !polynomial.first().is_some_and(|a0| *a0 < 0.0) {
            return Err("the first coefficient of the direct polynomial, minus the focal length, must be below 0");
        }
        // The polar decomposition: (c d; e 1) = S R, with the rotation R and a symmetric S.
        let turn_rad = (e - d).atan2(c + 1.0);
        let (sin, cos) = turn_rad.sin_cos();
        let affine = [[c * cos - d * sin, c * sin + d * cos], [e * cos - sin, e * sin + cos]];
        let mut lens = Self { size_px, centre_px, affine, turn_rad, polynomial, end_px: 0.0 };
        let side = |k: usize| centre_px[k].max(f64::from(size_px[k]) - centre_px[k]);
        let farthest_px = side(0).hypot(side(1)) / (c - d * e).min(1.0);
        while lens.end_px < farthest_px && lens.angle_rad(lens.end_px + STEP_PX) > lens.angle_rad(lens.end_px) {
            lens.end_px += STEP_PX;
        }
        Ok(lens)
    }

    /// Returns the focal length at the centre in pixels.
    pub fn focal_px(&self) -> f64 {
        -self.polynomial.first().copied().unwrap_or(-1.0)
    }

    /// Returns the angle off axis of the ray at a distance from the centre.
    fn angle_rad(&self, radius_px: f64) -> f64 {
        let z = self.polynomial.iter().rev().fold(0.0, |sum, a| sum * radius_px + a);
        radius_px.atan2(-z)
    }

    /// Projects a direction (camera frame). `None` if nothing is projected from there.
    pub fn project(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        let across = x.hypot(y);
        let angle = across.atan2(z);
        if angle > self.angle_rad(self.end_px) {
            return None;
        }
        let (mut below, mut above) = (0.0, self.end_px);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (below + above);
            *(if self.angle_rad(middle) < angle { &mut below } else { &mut above }) = middle;
        }
        let scale = if across > 0.0 { 0.5 * (below + above) / across } else { 0.0 };
        let (down, right, [row, column]) = (y * scale, x * scale, self.affine);
        Some([
            column[0] * down + column[1] * right + self.centre_px[0],
            row[0] * down + row[1] * right + self.centre_px[1],
        ])
    }
}

/// Reads `calib_results.txt`; `None` for another text. It has lines of numbers between comments: the direct and the
/// inverse polynomial, each after its length; row and column of the centre; c, d, e; height and width.
pub(super) fn of_text(text: &str, path: &Path) -> Option<Result<Scaramuzza, Problem>> {
    let lines = || text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.trim_start().starts_with('#'));
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    for (n, line) in lines() {
        let numbers: Option<Vec<f64>> = line.split_whitespace().map(|w| w.parse().ok()).collect();
        rows.push((n + 1, numbers?));
    }
    (!rows.is_empty()).then(|| read(&rows, path))
}

fn read(rows: &[(usize, Vec<f64>)], path: &Path) -> Result<Scaramuzza, Problem> {
    let [direct, _inverse, centre, affine, size, ..] = rows else {
        let what = "is a list of numbers; OCamCalib's calib_results.txt has five lines of them: direct polynomial, \
                    inverse polynomial, centre, affine parameters, image size";
        return Err(Problem::new(path, what));
    };
    let at = |(line, _): &(usize, Vec<f64>), what: &str| Problem::new(path, what).at_line(*line);
    if let Some(row) = rows.iter().find(|(_, numbers)| numbers.iter().any(|x| !x.is_finite())) {
        return Err(at(row, "finite numbers are expected"));
    }
    let Some((count, polynomial)) = direct.1.split_first().filter(|(n, rest)| **n == rest.len() as f64) else {
        return Err(at(direct, "the direct polynomial is expected: its length, then as many coefficients"));
    };
    if *count < 1.0 {
        return Err(at(direct, "the direct polynomial has no coefficient"));
    }
    let [row, column] = centre.1[..] else { return Err(at(centre, "row and column of the centre are expected")) };
    let [c, d, e] = affine.1[..] else { return Err(at(affine, "the affine parameters c, d, e are expected")) };
    let whole = |x: f64| (x.fract() == 0.0 && (2.0..=65535.0).contains(&x)).then_some(x as u16);
    let size_px = match size.1[..] {
        [height, width] => whole(width).zip(whole(height)),
        _ => None,
    };
    let Some((width, height)) = size_px else { return Err(at(size, "height and width in pixels are expected")) };
    Scaramuzza::new([width, height], [column, row], [c, d, e], polynomial.to_vec()).map_err(|what| at(direct, what))
}
