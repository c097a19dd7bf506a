//! The guessed lens: an ideal projection, and a covariance that has the lenses which the camera may really have.

use hzn_core::camera::{Config, Covariance, Intrinsic, Model};

use super::focal::{Focal, SQRT_3};

/// 1-sigma of the principal point, as a fraction of the width.
const CENTRE_FRACTION: f64 = 0.015;

/// A guessed lens with the sigmas of what is not known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Guess {
    /// The calibration. Its model has the coefficient k1, which is 0 with a sigma.
    pub(super) camera: Config,
    /// 1-sigma of k1.
    pub(super) k1_sigma: f64,
    /// 1-sigma of the focal length, in percent, with the part that k1 explains.
    pub(super) focal_sigma_percent: f64,
    /// 1-sigma of each coordinate of the principal point, in pixels.
    pub(super) centre_sigma_px: f64,
}

impl Guess {
    /// Makes the guess for an ideal lens ([`Model::Pinhole`] or [`Model::Equidistant`]) and its focal length.
    pub(super) fn new(ideal: Model, size_px: [u32; 2], focal: &Focal) -> Self {
        let [width, height] = size_px.map(|n| u16::try_from(n).unwrap_or(u16::MAX));
        let model = if ideal == Model::Pinhole { Model::BrownConrady } else { Model::KannalaBrandt };
        let mut camera = Config::ideal(model, width, height, focal.px);
        camera.set_intrinsic(Intrinsic::K1, 0.0);
        let edge = 0.5 * f64::from(size_px[0]) / focal.px;
        let k1_sigma = k1_sigma(ideal, edge);
        // A field of view fixes the angle at the edge, where r = f (ρ + k1 ρ³). A k1 then changes the focal length by
        // −k1 ρ², so that the edge stays. A focal length from EXIF is that of the middle and has nothing to do with k1.
        let focal_by_k1 = if focal.is_at_edge { -edge * edge } else { 0.0 };
        let centre_sigma_px = (CENTRE_FRACTION * f64::from(size_px[0])).ceil();
        let focal_sigma = (0.01 * focal.percent).hypot(focal_by_k1 * k1_sigma);
        let f = focal.px;
        let (ff, fk) = ((focal_sigma * f).powi(2), focal_by_k1 * f * k1_sigma.powi(2));
        let (cc, kk) = (centre_sigma_px.powi(2), k1_sigma.powi(2));
        let rows = [
            [ff, ff, 0.0, 0.0, fk],
            [ff, ff, 0.0, 0.0, fk],
            [0.0, 0.0, cc, 0.0, 0.0],
            [0.0, 0.0, 0.0, cc, 0.0],
            [fk, fk, 0.0, 0.0, kk],
        ];
        camera.covariance = Some(Covariance {
            order: [Intrinsic::FxPx, Intrinsic::FyPx, Intrinsic::CxPx, Intrinsic::CyPx, Intrinsic::K1]
                .into_iter()
                .collect(),
            rows: rows.iter().map(|row| row.iter().copied().collect()).collect(),
        });
        Self { camera, k1_sigma, focal_sigma_percent: 100.0 * focal_sigma, centre_sigma_px }
    }
}

/// Returns the 1-sigma of k1 of a lens that is taken for ideal. `edge` is the radius of the picture's edge in focal
/// lengths.
///
/// Each lens that the camera may have gives a k1: the ideal lens with this k1 equals it at the edge and at edge/√3,
/// where the difference of two lenses with the same edge is largest.
///
/// - A fisheye is equidistant, equisolid (2 sin θ/2) or stereographic (2 tan θ/2). The 1-sigma is their root mean
///   square, 0.054 for narrow fields of view. The orthographic lens, sin θ, lies at 3 sigma; it is rare.
/// - A lens that is sold as rectilinear has more or less of the barrel distortion that makes it equidistant; the part
///   is uniform from 0 to 1. The calibrations of EuRoC, KITTI and TUM RGB-D have 0.7, 0.8 and 0.3 of it, if their
///   coefficients are added up at the edge of the picture.
fn k1_sigma(ideal: Model, edge: f64) -> f64 {
    let inner = edge / SQRT_3;
    let angle = |radius: f64| if ideal == Model::Pinhole { radius.atan() } else { radius };
    let k1 = |radius_of: fn(f64) -> f64| {
        let ratio = radius_of(angle(inner)) / radius_of(angle(edge)) * SQRT_3;
        (ratio - 1.0) / (inner * inner - edge * edge)
    };
    if ideal == Model::Pinhole {
        k1(|theta| theta).abs() / SQRT_3
    } else {
        k1(|theta| (0.5 * theta).sin()).hypot(k1(|theta| (0.5 * theta).tan())) / SQRT_3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_lens_has_the_coefficients_of_the_series() {
        // Equisolid: θ − θ³/24; stereographic: θ + θ³/12. Equidistant from tan θ = θ + θ³/3: k1 = −1/3.
        let fisheye = ((1.0f64 / 24.0).powi(2) + (1.0f64 / 12.0).powi(2)).sqrt() / SQRT_3;
        assert!((k1_sigma(Model::Equidistant, 0.02) - fisheye).abs() < 1e-4);
        assert!((k1_sigma(Model::Pinhole, 0.02) - 1.0 / 3.0 / SQRT_3).abs() < 1e-3);
    }

    /// The guess with its 1-sigma modes contains the other lenses of the family.
    #[test]
    fn the_other_lenses_of_the_family_are_within_two_sigmas_everywhere() {
        for fov_deg in [40.0f64, 92.0, 150.0] {
            let edge = (0.5 * fov_deg).to_radians();
            let sigma = k1_sigma(Model::Equidistant, edge);
            let lenses: [fn(f64) -> f64; 2] = [|theta| (0.5 * theta).sin(), |theta| (0.5 * theta).tan()];
            for lens in lenses {
                for part in [0.2, 0.4, 0.6, 0.8] {
                    let radius = part * edge;
                    let off = lens(radius) / lens(edge) * edge - radius;
                    let one = sigma * radius * (radius * radius - edge * edge);
                    assert!((off / one).abs() < 2.0, "{fov_deg} {part}: {}", off / one);
                }
            }
        }
    }
}
