//! The limb height that a head has for itself: its error in the free fit of the head.

use std::f64::consts::TAU;

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::report::Free;
use hzn_files::rig::Common;

use crate::tangent;

/// Largest distance of two azimuths at which the height is taken: 5 degrees, which is 250 km or less for a low orbit
/// and finer than the weather.
const STEP_RAD: f64 = TAU / 72.0;

/// Smallest number of azimuths on an arc. The discrete sums then differ by less than 1% from the integrals.
const FEWEST: usize = 24;

/// Step of the search for arcs in view. A shorter arc has too few edge points for an answer.
const SCAN: usize = 720;

/// Shortest arc, one degree. A fit to a shorter arc takes up the same part of the weather, the height with its first
/// and second derivative, so that the error has a limit; but the equations would be singular.
const SHORTEST_RAD: f64 = TAU / 360.0;

/// Returns the free fit with the error of the limb's weather: a random height with the 1-sigma and the length of the
/// configuration, at the part of the limb that the camera sees. `limb_km` is the radius of the limb.
///
/// A height h(ψ) moves the edge at the azimuth ψ outward by h ∂α/∂d. Least squares over the arc takes it for errors of
/// the axis and of the cosine: with the rows g = (sin α cos ψ, sin α sin ψ, −1) and the widths of the parts of the arc
/// as weights W, the error is (GᵀWG)⁻¹ GᵀW sin α ∂α/∂d h. On a short arc, a height that changes along the arc moves the
/// free fit far more than a constant one.
pub(super) fn with_weather(free: &Free<f64>, camera: &Camera<f64>, limb_km: f64, common: &Common) -> Free<f64> {
    let (sigma_km, length_km) = (common.limb_own_sigma_km, common.limb_own_length_km);
    let cos = free.cos;
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    if !(sigma_km > 0.0 && cos > 0.0 && sin > 0.0 && limb_km > 0.0) {
        return *free;
    }
    // sin α ∂α/∂d, for each kilometre.
    let by_km = sin * sin / (cos * limb_km);
    let (b1, b2) = tangent::basis(free.axis.xyz());
    let edge = Edge { camera, e: free.axis.xyz(), b: [b1, b2], cos, sin };
    let seen: Vec<(f64, f64)> = edge.arcs().into_iter().flat_map(azimuths).collect();
    let rows: Vec<([f64; 3], f64)> =
        seen.iter().map(|(psi, width)| ([sin * psi.cos(), sin * psi.sin(), -1.0], *width)).collect();
    let mut own = *free;
    let Some(gain) = least_squares(&rows) else {
        // Without an arc the height is taken as a constant.
        own.var_cos += (sigma_km * by_km).powi(2);
        return own;
    };
    let mut p = [[0.0; 3]; 3];
    for (i, ((a, _), gi)) in seen.iter().zip(&gain).enumerate() {
        for ((b, _), gj) in seen.iter().zip(&gain).take(i + 1) {
            let chord_km = 2.0 * limb_km * cos * (0.5 * (a - b)).sin().abs();
            let both = (sigma_km * by_km).powi(2) * (-0.5 * (chord_km / length_km).powi(2)).exp();
            for (row, x) in p.iter_mut().zip(gi) {
                row.iter_mut().zip(gj).for_each(|(cell, y)| *cell += x * both * y);
            }
            if a != b {
                for (row, x) in p.iter_mut().zip(gj) {
                    row.iter_mut().zip(gi).for_each(|(cell, y)| *cell += x * both * y);
                }
            }
        }
    }
    let [[p11, p12, p13], [_, p22, p23], [.., p33]] = p;
    let at = |i: usize, j: usize| b1[i] * b1[j] * p11 + (b1[i] * b2[j] + b2[i] * b1[j]) * p12 + b2[i] * b2[j] * p22;
    let added = [at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)];
    own.covariance.upper_rad2.iter_mut().zip(added).for_each(|(x, more)| *x += more);
    if let Some(with_cos) = &mut own.axis_with_cos {
        with_cos.iter_mut().zip(b1.iter().zip(b2)).for_each(|(x, (b1, b2))| *x += b1 * p13 + b2 * p23);
    }
    own.var_cos += p33;
    own
}

/// The edge of a cone in a picture.
struct Edge<'a> {
    camera: &'a Camera<f64>,
    e: [f64; 3],
    b: [[f64; 3]; 2],
    cos: f64,
    sin: f64,
}

impl Edge<'_> {
    /// Returns whether the picture has the edge at this azimuth.
    fn is_in_view(&self, psi: f64) -> bool {
        let (s, c) = psi.sin_cos();
        let [b1, b2] = self.b;
        let ray: [f64; 3] = std::array::from_fn(|i| self.cos * self.e[i] + self.sin * (c * b1[i] + s * b2[i]));
        let point = UnitVec3::try_new(ray).and_then(|ray| self.camera.project(&ray));
        let inside = |x: f64, size: u16| x >= -0.5 && x <= f64::from(size) - 0.5;
        point.is_some_and(|p| inside(p.u, self.camera.width()) && inside(p.v, self.camera.height()))
    }

    /// Returns the arcs in view as pairs of azimuths, in rising order. The scan begins at the side of the optical axis,
    /// so that nothing depends on the choice of the tangent vectors.
    fn arcs(&self) -> Vec<[f64; 2]> {
        let [b1, b2] = self.b;
        let middle = b2[2].atan2(b1[2]);
        let at = |i: usize| middle + i as f64 * TAU / SCAN as f64;
        let are_seen: Vec<bool> = (0..SCAN).map(|i| self.is_in_view(at(i))).collect();
        let is_seen = |i: usize| are_seen.get(i % SCAN).copied().unwrap_or_default();
        if are_seen.iter().all(|is| *is) {
            return vec![[middle, middle + TAU]];
        }
        let is_start = |i: &usize| is_seen(*i) && !is_seen(i + SCAN - 1);
        let arc = |start: usize| {
            let after = (start..start + SCAN).find(|i| !is_seen(*i)).unwrap_or(start + 1);
            let [from, to] = [self.end(at(start), at(start) - TAU / SCAN as f64), self.end(at(after - 1), at(after))];
            let short = (0.5 * (SHORTEST_RAD - (to - from))).max(0.0);
            [from - short, to + short]
        };
        let arcs: Vec<[f64; 2]> = (0..SCAN).filter(is_start).map(arc).collect();
        if arcs.is_empty() { vec![[middle - 0.5 * SHORTEST_RAD, middle + 0.5 * SHORTEST_RAD]] } else { arcs }
    }

    /// Returns the end of an arc by bisection, between an azimuth in view and one that is not.
    fn end(&self, mut seen: f64, mut unseen: f64) -> f64 {
        for _ in 0..30 {
            let half = 0.5 * (seen + unseen);
            *if self.is_in_view(half) { &mut seen } else { &mut unseen } = half;
        }
        seen
    }
}

/// Returns the middles and the widths of equal parts of an arc.
fn azimuths([from, to]: [f64; 2]) -> impl Iterator<Item = (f64, f64)> {
    let count = (((to - from) / STEP_RAD).ceil() as usize).max(FEWEST);
    let width = (to - from) / count as f64;
    (0..count).map(move |i| (from + (i as f64 + 0.5) * width, width))
}

/// Returns (GᵀWG)⁻¹ g w for each row g of G with its weight w; `None` if the rows do not determine three unknowns.
fn least_squares(rows: &[([f64; 3], f64)]) -> Option<Vec<[f64; 3]>> {
    let sum = |i: usize, j: usize| rows.iter().map(|(g, w)| g[i] * g[j] * w).sum::<f64>();
    let [a, b, c, d, e, f] = [sum(0, 0), sum(0, 1), sum(0, 2), sum(1, 1), sum(1, 2), sum(2, 2)];
    let minors = [d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b];
    let determinant = a * minors[0] + b * minors[1] + c * minors[2];
    if !(determinant > 1e-14 * a * d * f) {
        return None;
    }
    let [xx, xy, xz, yy, yz, zz] = minors.map(|m| m / determinant);
    let solve = |(g, w): &([f64; 3], f64)| {
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| w * row.iter().zip(g).map(|(r, g)| r * g).sum::<f64>())
    };
    Some(rows.iter().map(solve).collect())
}

#[cfg(test)]
mod tests {
    use hzn_core::camera::{Config, Model};
    use hzn_core::frames::{Cam, Cov3};

    use super::*;

    const LIMB_KM: f64 = 6396.0;

    fn added(fx_px: f64, length_km: f64) -> Free<f64> {
        turned(fx_px, length_km, 0.0)
    }

    /// `roll` turns the picture, so that the tangent vectors have another place on the arc.
    fn turned(fx_px: f64, length_km: f64, roll: f64) -> Free<f64> {
        let camera = Camera::try_new(&Config::ideal(Model::Pinhole, 640, 640, fx_px)).unwrap();
        let alpha = 68.6f64.to_radians();
        let free = Free {
            axis: UnitVec3::<Cam, f64>::try_new([alpha.sin() * roll.sin(), alpha.sin() * roll.cos(), alpha.cos()])
                .unwrap(),
            covariance: Cov3::from_upper([0.0; 6]),
            cos: alpha.cos(),
            var_cos: 0.0,
            axis_with_cos: Some([0.0; 3]),
            cos_per_px: 1e-3,
        };
        with_weather(&free, &camera, LIMB_KM, &Common { limb_own_length_km: length_km, ..Common::default() })
    }

    #[test]
    fn a_wide_field_is_a_constant_height_and_weather_tilts_the_cone() {
        // So long that the height hardly changes along the arc.
        let constant = added(554.0, 1e12);
        let alpha = constant.cos.acos();
        // A change of the half-angle by tan α/(R + d) for each of 1.5 km.
        let want = (alpha.sin() * alpha.tan() * 1.5 / LIMB_KM).powi(2);
        assert!((constant.var_cos / want - 1.0).abs() < 1e-3, "{} {want}", constant.var_cos);
        assert!(constant.covariance.sigma_max_rad() < 1e-3 * want.sqrt());
        // On an arc of 60 degrees, weather with a length of 1000 km tilts the cone far more than its height.
        let weather = added(554.0, 1000.0);
        let height_rad = want.sqrt() / alpha.sin();
        assert!(weather.covariance.sigma_max_rad() > 2.0 * height_rad && weather.var_cos > want);
        // A shorter arc is tilted more.
        assert!(added(1100.0, 1000.0).covariance.sigma_max_rad() > weather.covariance.sigma_max_rad());
    }

    #[test]
    fn a_short_arc_has_the_weather_of_a_dense_one() {
        let both = |free: &Free<f64>| [free.covariance.sigma_max_rad().to_degrees(), free.var_cos.sqrt()];
        // The limit for a short arc: with h = h0 + h1 ψ + h2 ψ²/2, the axis moves by k h2/sin α across the arc and the
        // cosine by k (h0 + h2). A height with the correlation exp(−(κψ)²/2) has the variances 1 and 3κ⁴ of h0 and h2,
        // and the covariance −κ².
        let (sin, cos) = 68.6f64.to_radians().sin_cos();
        let (k, square) = (1.5 * sin * sin / (cos * LIMB_KM), (LIMB_KM * cos / 1000.0).powi(2));
        let want =
            [(k * 3f64.sqrt() * square / sin).to_degrees(), k * (1.0 - 2.0 * square + 3.0 * square * square).sqrt()];
        // An arc of ten degrees.
        let ten = both(&added(3930.0, 1000.0));
        assert!(ten.iter().zip(want).all(|(ten, want)| (ten / want - 1.0).abs() < 0.03), "{ten:?} {want:?}");
        // The result has a limit for short arcs, and it changes slowly with the field of view.
        let mut last = ten;
        for step in 1..80 {
            let now = both(&added(3930.0 * 1.05f64.powi(step), 1000.0));
            let near = now.iter().zip(last).all(|(now, last)| (now / last - 1.0).abs() < 0.03);
            assert!(near, "{step}: {now:?} after {last:?}");
            last = now;
        }
        // Nothing depends on the place of the arc against the tangent vectors. A quarter of a turn leaves the picture,
        // but for half a pixel.
        for fx_px in [300.0, 1000.0, 4000.0, 30_000.0] {
            let [a, b] = [0.0, TAU / 4.0].map(|roll| both(&turned(fx_px, 1000.0, roll)));
            assert!(a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-4), "{a:?} {b:?}");
        }
    }
}
