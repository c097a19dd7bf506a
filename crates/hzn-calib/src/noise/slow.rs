//! The slow part of the errors along an edge: what remains in a mean over a window of a twelfth of the edge.
//!
//! A fit averages out errors that are new at every point. It keeps errors that change slowly along the edge. The
//! likelihood of all residuals does not separate the two: it follows the short correlation of noise and blur, which has
//! most of the variance, and loses a slow part of a fifth of the RMS. Means over windows show the slow part. With the
//! variance s² of a Gauss-Markov process whose length is the window w, and with errors that are much shorter, the means
//! have the variances V(w) = m(1) s² + a/w and V(w/2) = m(½) s² + 2a/w, where m(x) = 2 (x − 1 + e⁻ˣ)/x². Thus
//! s² = (2 V(w) − V(w/2))/(2 m(1) − m(½)), whatever the short errors are.

use super::cone::Cone;

/// Number of windows w along an edge. A sensor that measures the noise in each picture assumes errors that are
/// correlated over this part of the edge.
const WINDOWS: usize = 12;
/// Number of parameters of the cone, which the fit takes from the means.
const PARAMETERS: f64 = 3.0;
/// 2 m(1) − m(½).
const SCALE: f64 = 0.619_272_5;

/// Returns the variance of the slow part of a picture's residuals, in px². It is negative where this picture has less
/// slow error than its short errors lead to expect, so that only the mean over many pictures is an estimate.
pub(crate) fn variance_px2(cone: &Cone) -> f64 {
    (2.0 * variance_of_means_px2(cone, WINDOWS) - variance_of_means_px2(cone, 2 * WINDOWS)) / SCALE
}

/// Returns the 1-sigma of the slow part of the edges of a flight, in pixels. `variances_px2` are those of
/// [`variance_px2`], `rms_px` is the RMS of all residuals.
pub(crate) fn sigma_px(variances_px2: impl ExactSizeIterator<Item = f64>, rms_px: f64) -> f64 {
    let n = variances_px2.len().max(1) as f64;
    (variances_px2.sum::<f64>() / n).clamp(0.0, rms_px * rms_px).sqrt()
}

/// Returns the variance of the means of the residuals over windows of equal length, in px².
fn variance_of_means_px2(cone: &Cone, windows: usize) -> f64 {
    let mut sums = vec![[0.0; 2]; windows];
    for row in &cone.rows {
        let window = (0.5 * (row.along + 1.0) * windows as f64) as usize;
        let [sum, weight] = &mut sums[window.min(windows - 1)];
        *sum += row.weight * row.r_px;
        *weight += row.weight;
    }
    let means = || sums.iter().filter(|[_, weight]| *weight > 0.0).map(|[sum, weight]| sum / weight);
    let freedom = means().count() as f64 - PARAMETERS;
    if freedom > 0.0 { means().map(|mean| mean * mean).sum::<f64>() / freedom } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use hzn_core::Prior;
    use hzn_core::camera::Camera;
    use nalgebra::Vector3;

    use crate::draws::Draws;
    use crate::noise::tests::{Noise, camera, earth, limb, solution};
    use crate::noise::{Calibration, Sighting, WeightedPoints};

    /// Stronger noise hides the slow part from a likelihood, but not from means over windows.
    #[test]
    fn a_slow_part_below_strong_noise_is_found() {
        let found = |slow_px: f64, seed: u64| {
            let config = camera(90.0);
            let camera = Camera::try_new(&config).unwrap();
            let mut draws = Draws(seed);
            let alpha = (earth().mean_radius_km() / (earth().mean_radius_km() + 200.0)).asin();
            let each = (0..40).filter_map(|k| {
                let below = alpha + (0.1 * f64::from(k)).sin() * 0.1;
                let axis = Vector3::new(0.3 * below.sin(), 0.954 * below.sin(), below.cos()).normalize();
                let mut slow = Draws(seed + 1000 + k as u64);
                let smooth = limb(&camera, axis, &|_| alpha.cos(), Noise(slow_px, 80.0, 0.0), &mut slow);
                let sharp = limb(&camera, axis, &|_| alpha.cos(), Noise(0.0, 2.5, 0.0), &mut Draws(1));
                let rough = limb(&camera, axis, &|_| alpha.cos(), Noise(0.6, 2.5, 0.0), &mut draws);
                // The sum of the two errors on the same points of the limb.
                let sum = smooth.iter().zip(&sharp).zip(rough);
                let points: WeightedPoints =
                    sum.map(|((a, b), (c, weight))| ([0, 1].map(|i| a.0[i] - b.0[i] + c[i]), weight)).collect();
                let prior = Prior { altitude_m: Some(200e3), ..Prior::default() };
                Sighting::measure("p", &camera, &earth(), &prior, &points, &solution(axis, alpha))
            });
            let sightings: Vec<Sighting> = each.collect();
            assert!(sightings.len() >= 38);
            let edge = Calibration::new(&earth(), &sightings).unwrap().edge;
            assert!((edge.white_px.hypot(edge.bias_px) / edge.sigma_px - 1.0).abs() < 1e-9, "{edge:?}");
            edge.bias_px
        };
        for seed in [31, 32, 33] {
            let [none, some, much] = [0.0, 0.2, 0.4].map(|slow_px| found(slow_px, seed));
            println!("{none} {some} {much}");
            assert!(none < 0.14 && (0.14..0.27).contains(&some) && (0.3..0.5).contains(&much), "{none} {some} {much}");
        }
    }
}
