//! A bend of the edge that all pictures of a flight have in common.
//!
//! The visible limb differs from a cone by about a tenth of a pixel: it is higher where the Sun is higher, and a veil
//! of light is brighter on one side. The fit absorbs the parts of this shape that a cone can follow: a shift, a tilt,
//! and a bend, which it takes for another half-angle. Edge noise averages out over many pictures. A common shape does
//! not, and the scatter between pictures does not show it. The rest of the shape is visible in the mean of the
//! residuals over all pictures, as the next shapes along the edge (Legendre polynomials of the degrees 3 to 5, each of
//! RMS 1). The bend is assumed to be as strong as the strongest of these.
//!
//! Causes that are smooth and symmetric have almost nothing of these shapes: a lens that is darker away from its axis,
//! and blur where the scale of the picture changes along the edge. Both bend a limb of air by a few hundredths of a
//! pixel, which is kilometres of limb height in a small picture. The floor stands for them.

use super::cone::Cone;

/// Number of shapes that are examined in the mean residuals.
pub(crate) const SHAPES: usize = 3;

/// Returns the Legendre polynomials of the degrees 3 to 5 at x from −1 to 1, scaled to an RMS of 1.
pub(crate) fn next_shapes(x: f64) -> [f64; SHAPES] {
    let x2 = x * x;
    [
        7.0f64.sqrt() * 0.5 * x * (5.0 * x2 - 3.0),
        3.0 / 8.0 * (x2 * (35.0 * x2 - 30.0) + 3.0),
        11.0f64.sqrt() / 8.0 * x * (x2 * (63.0 * x2 - 70.0) + 15.0),
    ]
}

/// Returns the Legendre polynomial of degree 2 at x from −1 to 1, scaled to an RMS of 1.
pub(crate) fn bend_shape(x: f64) -> f64 {
    5.0f64.sqrt() * 0.5 * (3.0 * x * x - 1.0)
}

/// Returns the amplitude of each next shape in the residuals, in pixels.
pub(crate) fn shapes_px(cone: &Cone) -> [f64; SHAPES] {
    let mut sums = [0.0; SHAPES];
    for row in &cone.rows {
        for (sum, shape) in sums.iter_mut().zip(next_shapes(row.along)) {
            *sum += row.weight * row.r_px * shape / cone.weight;
        }
    }
    sums
}

/// Returns the RMS in pixels of the bend that all edges may have in common: the amplitude of the strongest next shape
/// in the mean of their residuals, or its standard error if that is larger, but at least `min_px`. `edges` has the
/// amplitudes of each edge ([`shapes_px`]).
pub(crate) fn common_bend_px<'a>(edges: impl ExactSizeIterator<Item = &'a [f64; SHAPES]> + Clone, min_px: f64) -> f64 {
    let n = edges.len().max(1) as f64;
    let amplitude = |k: usize| {
        let values = || edges.clone().filter_map(move |shapes| shapes.get(k));
        let mean = values().sum::<f64>() / n;
        let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0).max(1.0));
        mean.abs().max(variance.sqrt())
    };
    (0..SHAPES).map(amplitude).fold(min_px, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_have_an_rms_of_one_and_are_independent() {
        let at = |i: i32| f64::from(i) / 5000.0 - 1.0 + 1e-4;
        let all = |x: f64| {
            let [a, b, c] = next_shapes(x);
            [1.0, 3.0f64.sqrt() * x, bend_shape(x), a, b, c]
        };
        for i in 0..6 {
            for j in 0..6 {
                let mean = (0..10_000).map(|k| all(at(k))[i] * all(at(k))[j]).sum::<f64>() / 1e4;
                assert!((mean - f64::from(u8::from(i == j))).abs() < 1e-3, "{i} {j}: {mean}");
            }
        }
    }
}
