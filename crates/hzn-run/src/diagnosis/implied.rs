//! What the fit of an edge says about altitude, focal length and limb height.

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_core::{Report, Solution};

use super::any_cone::{longest_edge, longest_of_other_size};
use super::facts::{FitFacts, Implied};
use crate::engine::trace::{Edge, Fitted};
use crate::tangent;

/// A point of the picture (u, v), in pixels.
type Point = [f64; 2];

/// Largest number of points that a cone is fitted to here; more change the factor by less than its sigma.
const MOST_POINTS: usize = 300;
/// Factors of the focal length that are searched.
const FACTORS: [f64; 2] = [0.3, 3.0];

/// Returns what the edge of the answer says, with its fit. Without an answer, `trial` returns an edge with a cone of
/// any half-angle: the sensor's own fit uses only points near a limb with the expected half-angle, so that it misses
/// most of the limb if the expected one is wrong. It counts only if the trial finds nothing: that of the longest edge
/// whose half-angle alone is wrong, or else of the longest edge.
pub fn find_fit(
    edges: &[Edge],
    report: &Report<f64>,
    altitude_km: Option<f64>,
    camera: &Camera<f64>,
    trial: impl FnOnce() -> Option<Edge>,
) -> Option<(FitFacts, Solution<f64>)> {
    let facts = |edge: &Edge, is_trial: bool| {
        let fitted = edge.fitted.as_ref()?;
        Some((fit_facts(edge, fitted, camera, altitude_km, is_trial)?, fitted.solution))
    };
    if let Some(solution) = &report.solution {
        return facts(edges.iter().find(|e| e.candidate == solution.candidate)?, false);
    }
    let of_other_size = || longest_of_other_size(edges).and_then(|edge| facts(edge, false));
    trial().and_then(|edge| facts(&edge, true)).or_else(of_other_size).or_else(|| facts(longest_edge(edges)?, false))
}

/// Returns what a fit says; `None` for a body whose half-angle says nothing about its distance, as that of Sun and
/// Moon. `given_altitude_km` is the altitude that the picture was processed with. `is_trial` is true for a fit without
/// the expected half-angle.
pub fn fit_facts(
    edge: &Edge,
    fitted: &Fitted,
    camera: &Camera<f64>,
    given_altitude_km: Option<f64>,
    is_trial: bool,
) -> Option<FitFacts> {
    let free = fitted.solution.free?;
    let (difference, sigma) = fitted.difference()?;
    let edge_sigma = free.var_cos.max(0.0).sqrt();
    let sin = |cos: f64| (1.0 - cos * cos).max(1e-12).sqrt();
    let sin_fitted = sin(free.cos);
    // ∂d/∂cos α = −D cot α, where D is the distance from the centre of the body; ∂H/∂cos α = (R + d) cos α/sin³α with
    // R + d = D sin α₀.
    // The half-angle of Sun and Moon says nothing about the altitude, and they have no limb height.
    let limb = Some(fitted.limb_height_m?);
    let by_limb = limb.map(|(_, slope)| slope.abs());
    let by_altitude = by_limb.map(|slope| slope * sin(fitted.expected_cos) / (sin_fitted * sin_fitted));
    let implied = |value: f64, slope: f64| Implied { value, sigma: slope / 1e3 * edge_sigma };
    let altitude = fitted.solution.altitude_m.map(|(metres, _)| metres / 1e3);
    Some(FitFacts {
        expected_deg: fitted.expected_cos.clamp(-1.0, 1.0).acos().to_degrees(),
        fitted_deg: free.cos.clamp(-1.0, 1.0).acos().to_degrees(),
        fitted_sigma_deg: (edge_sigma / sin_fitted).to_degrees(),
        expected_sigma_deg: (fitted.expected_sigma_cos / sin(fitted.expected_cos)).to_degrees(),
        // A smaller cosine is a larger half-angle.
        sigmas: -difference / sigma.max(f64::MIN_POSITIVE),
        is_trial,
        given_altitude_km,
        altitude_km: altitude.zip(by_altitude).map(|(km, slope)| implied(km, slope)),
        focal_factor: focal_factor(edge, free.axis.xyz(), fitted.expected_cos, free.cos, edge_sigma, camera),
        limb_height_km: limb.map(|(metres, slope)| implied(metres / 1e3, slope.abs())),
    })
}

/// Returns the change of the cosine of the half-angle of a cone through the inliers if `other` replaces the camera.
pub(super) fn cos_change(edge: &Edge, axis: [f64; 3], camera: &Camera<f64>, other: &Camera<f64>) -> Option<f64> {
    let points = thinned_inliers(edge);
    Some(cone_cos(&points, axis, 1.0, other)? - cone_cos(&points, axis, 1.0, camera)?)
}

/// Returns at most [`MOST_POINTS`] inliers, evenly spread over the edge.
fn thinned_inliers(edge: &Edge) -> Vec<Point> {
    let inliers: Vec<Point> =
        edge.points.iter().zip(&edge.weights).filter(|(_, w)| **w > 0.0).map(|(p, _)| *p).collect();
    let step = inliers.len().div_ceil(MOST_POINTS).max(1);
    inliers.into_iter().step_by(step).collect()
}

/// Returns the factor of both focal lengths with which a cone through the inliers has the expected half-angle.
fn focal_factor(
    edge: &Edge,
    axis: [f64; 3],
    expected_cos: f64,
    fitted_cos: f64,
    sigma_cos: f64,
    camera: &Camera<f64>,
) -> Option<Implied> {
    let points = thinned_inliers(edge);
    // The sensor weights its points differently, so only the change of this fit with the factor is used.
    let offset = fitted_cos - cone_cos(&points, axis, 1.0, camera)?;
    let miss = |factor: f64| Some(cone_cos(&points, axis, factor, camera)? + offset - expected_cos);
    let (mut a, mut b) = (1.0, 1.02);
    let (mut at_a, mut at_b) = (miss(a)?, miss(b)?);
    for _ in 0..40 {
        let slope = (at_b - at_a) / (b - a);
        if !(slope.abs() > 1e-12) {
            return None;
        }
        let next = (b - at_b / slope).clamp(b * 0.8, b * 1.25);
        if !(FACTORS[0]..=FACTORS[1]).contains(&next) {
            return None;
        }
        if (next - b).abs() < 1e-9 {
            return Some(Implied { value: next, sigma: (sigma_cos / slope).abs() });
        }
        (a, at_a) = (b, at_b);
        (b, at_b) = (next, miss(next)?);
    }
    None
}

/// Fits a cone to points by least squares, from a first axis, and returns the cosine of its half-angle. The focal
/// lengths are multiplied by `factor`.
fn cone_cos(points: &[Point], axis: [f64; 3], factor: f64, camera: &Camera<f64>) -> Option<f64> {
    let centre = camera.principal_point();
    let ray = |p: &Point| {
        let at = ImagePoint { u: centre.u + (p[0] - centre.u) / factor, v: centre.v + (p[1] - centre.v) / factor };
        Some(camera.unproject(at)?.xyz())
    };
    let rays: Vec<[f64; 3]> = points.iter().filter_map(ray).collect();
    if rays.len() < 8 {
        return None;
    }
    let mut e = axis;
    let mut cos = 0.0;
    for _ in 0..6 {
        let (b1, b2) = tangent::basis(e);
        // Normal equations of x b1·r + y b2·r − c = −e·r.
        let mut n = [[0.0; 4]; 3];
        for r in &rays {
            let row = [dot(b1, *r), dot(b2, *r), -1.0];
            for i in 0..3 {
                for j in 0..3 {
                    n[i][j] += row[i] * row[j];
                }
                n[i][3] -= row[i] * dot(e, *r);
            }
        }
        let [x, y, c] = solve(n)?;
        let turned =
            UnitVec3::<hzn_core::frames::Cam, f64>::try_new(std::array::from_fn(|i| e[i] + x * b1[i] + y * b2[i]))?;
        cos = c / (1.0 + x * x + y * y).sqrt();
        e = turned.xyz();
    }
    (cos.abs() < 1.0).then_some(cos)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Solves three linear equations by elimination with pivots; `None` if they are singular.
fn solve(mut m: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    for column in 0..3 {
        let pivot = (column..3).max_by(|&a, &b| m[a][column].abs().total_cmp(&m[b][column].abs()))?;
        m.swap(column, pivot);
        if !(m[column][column].abs() > 1e-14) {
            return None;
        }
        for row in 0..3 {
            if row != column {
                let factor = m[row][column] / m[column][column];
                for k in column..4 {
                    m[row][k] -= factor * m[column][k];
                }
            }
        }
    }
    Some(std::array::from_fn(|i| m[i][3] / m[i][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::{Config, Model};

    #[test]
    fn a_wrong_focal_length_is_found_from_the_edge() {
        // The picture was taken with 500 px; the sensor says 400 px.
        let configs = [500.0, 400.0].map(|f| Config::ideal(Model::Pinhole, 640, 480, f));
        let [taken, told] = configs.map(|c| Camera::<f64>::try_new(&c).unwrap());
        let half_angle = 1.2f64;
        let axis = [0.0, (1.25f64).sin(), (1.25f64).cos()];
        let limb = crate::overlay::limb::lines(axis, half_angle, &taken).concat();
        let edge = Edge { weights: vec![1.0; limb.len()], points: limb, ..Edge::default() };
        let seen = cone_cos(&edge.points, axis, 1.0, &told).unwrap();
        assert!((seen - half_angle.cos()).abs() > 0.01, "with the wrong focal length the half-angle is another one");
        let factor = focal_factor(&edge, axis, half_angle.cos(), seen, 1e-4, &told).unwrap();
        assert!((factor.value - 1.25).abs() < 1e-4 && factor.sigma > 0.0, "{factor:?}");
        let right = cone_cos(&edge.points, axis, 1.0, &taken).unwrap();
        assert!((right - half_angle.cos()).abs() < 1e-9);
    }
}
