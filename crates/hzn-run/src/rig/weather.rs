//! The limb height that a head has for itself: its error in the free fit of the head.

use std::f64::consts::TAU;

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::report::Free;
use hzn_files::rig::Common;

/// Number of azimuths around the limb at which the height is taken. They are 5 degrees apart, which is 250 km or less
/// for a low orbit and finer than the weather.
const AZIMUTHS: usize = 72;

/// Returns the free fit with the error of the limb's weather: a random height with the 1-sigma and the length of the
/// configuration, at the part of the limb that the camera sees. `limb_km` is the radius of the limb.
///
/// A height h(ψ) moves the edge at the azimuth ψ outward by h ∂α/∂d. Least squares over the arc takes it for errors of
/// the axis and of the cosine: with the rows g = (sin α cos ψ, sin α sin ψ, −1), the error is
/// (GᵀG)⁻¹ Gᵀ sin α ∂α/∂d h. On a short arc, a height that changes along the arc moves the free fit far more than a
/// constant one.
pub(super) fn with_weather(free: &Free<f64>, camera: &Camera<f64>, limb_km: f64, common: &Common) -> Free<f64> {
    let (sigma_km, length_km) = (common.limb_own_sigma_km, common.limb_own_length_km);
    let cos = free.cos;
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    if !(sigma_km > 0.0 && cos > 0.0 && sin > 0.0 && limb_km > 0.0) {
        return *free;
    }
    // sin α ∂α/∂d, for each kilometre.
    let by_km = sin * sin / (cos * limb_km);
    let [b1, b2] = tangent(free.axis.xyz());
    let seen: Vec<f64> = (0..AZIMUTHS)
        .map(|i| i as f64 * TAU / AZIMUTHS as f64)
        .filter(|psi| is_in_view(camera, free.axis.xyz(), [b1, b2], [cos, sin], *psi))
        .collect();
    let rows: Vec<[f64; 3]> = seen.iter().map(|psi| [sin * psi.cos(), sin * psi.sin(), -1.0]).collect();
    let mut own = *free;
    let Some(gain) = least_squares(&rows) else {
        // Without an arc the height is taken as a constant.
        own.var_cos += (sigma_km * by_km).powi(2);
        return own;
    };
    let mut p = [[0.0; 3]; 3];
    for (i, (a, gi)) in seen.iter().zip(&gain).enumerate() {
        for (b, gj) in seen.iter().zip(&gain).take(i + 1) {
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

/// Returns whether the picture has the edge at this azimuth of a cone.
fn is_in_view(camera: &Camera<f64>, e: [f64; 3], [b1, b2]: [[f64; 3]; 2], [cos, sin]: [f64; 2], psi: f64) -> bool {
    let (s, c) = psi.sin_cos();
    let ray: [f64; 3] = std::array::from_fn(|i| cos * e[i] + sin * (c * b1[i] + s * b2[i]));
    let point = UnitVec3::try_new(ray).and_then(|ray| camera.project(&ray));
    let inside = |x: f64, size: u16| x >= -0.5 && x <= f64::from(size) - 0.5;
    point.is_some_and(|p| inside(p.u, camera.width()) && inside(p.v, camera.height()))
}

/// Returns two unit vectors across `e` and across each other.
fn tangent([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let helper = if x.abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let b1 = cross([x, y, z], helper);
    let length = b1.iter().map(|x| x * x).sum::<f64>().sqrt();
    let b1 = b1.map(|x| x / length);
    [b1, cross([x, y, z], b1)]
}

/// Returns (GᵀG)⁻¹ g for each row g of G; `None` if the rows do not determine three unknowns.
fn least_squares(rows: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
    let sum = |i: usize, j: usize| rows.iter().map(|g| g[i] * g[j]).sum::<f64>();
    let [a, b, c, d, e, f] = [sum(0, 0), sum(0, 1), sum(0, 2), sum(1, 1), sum(1, 2), sum(2, 2)];
    let minors = [d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b];
    let determinant = a * minors[0] + b * minors[1] + c * minors[2];
    // Three points of a short arc are nearly on a line.
    if rows.len() < 4 || determinant <= 1e-12 * a * d * f {
        return None;
    }
    let [xx, xy, xz, yy, yz, zz] = minors.map(|m| m / determinant);
    let solve = |g: &[f64; 3]| {
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| row.iter().zip(g).map(|(r, g)| r * g).sum())
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
        let camera = Camera::try_new(&Config::ideal(Model::Pinhole, 640, 480, fx_px)).unwrap();
        let alpha = 68.6f64.to_radians();
        let free = Free {
            axis: UnitVec3::<Cam, f64>::try_new([0.0, alpha.sin(), alpha.cos()]).unwrap(),
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
}
