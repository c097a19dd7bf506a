//! The guessed lens: an ideal projection, and a covariance that has the lenses which the camera may really have.

use hzn_core::camera::{Config, Covariance, Intrinsic, Model};

use super::facts::CameraFacts;
use super::focal::{Focal, SQRT_3};

/// 1-sigma of the principal point, as a fraction of the width.
const CENTRE_FRACTION: f64 = 0.015;

/// 1-sigma of the second mode of the shape, k2 ρ⁴ at the edge ρ of the picture, and its growth with ρ² in narrow fields
/// of view. The mode is k2 ρ (ρ² − edge²)(ρ² − edge²/3): it leaves the two places alone that fix k1.
///
/// Of 943 calibrated cameras in Gyroflow's public lens profiles (CC0), it is 0.030 for fisheyes and 0.023 for lenses
/// that are nearer to a pinhole, RMS without the farthest 3 %; of the latter 0.016 below 50 degrees, 0.019 to 70
/// degrees, and 0.029 above. In wide fields of view it hardly depends on k1. `tests/python/lens_shapes.py` measures it.
const SECOND_SHAPE: f64 = 0.025;
const SECOND_SHAPE_BY_RHO2: f64 = 0.13;
/// 1-sigma of p1 and p2. The calibrations of 17 cameras in the public settings of OpenVINS, VINS-Fusion, Kimera-VIO and
/// ORB-SLAM2 (TUM RGB-D fr1 and fr2) have an RMS of 0.0017, with 0.0054 as the largest.
const DECENTRING: f64 = 0.002;

/// A guessed lens with the sigmas of what is not known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Guess {
    /// The calibration. The coefficients of its model are 0. Those with a sigma are k1, k2 and, if the model has them,
    /// p1 and p2.
    pub(super) camera: Config,
    /// 1-sigma of the first mode of the shape, k1 with k2 = 0.
    pub(super) k1_sigma: f64,
    /// 1-sigma of k2.
    pub(super) k2_sigma: f64,
    /// 1-sigma of p1 and p2, if the model has them.
    pub(super) p_sigma: Option<f64>,
    /// 1-sigma of the focal length, in percent, with the part that the shape explains.
    pub(super) focal_sigma_percent: f64,
    /// 1-sigma of each coordinate of the principal point, in pixels.
    pub(super) centre_sigma_px: f64,
}

impl Guess {
    /// Makes the guess for an ideal lens ([`Model::Pinhole`] or [`Model::Equidistant`]) and its focal length in
    /// columns.
    pub(super) fn new(facts: &CameraFacts, ideal: Model, focal: &Focal) -> Self {
        use Intrinsic::{CxPx, CyPx, FxPx, FyPx, K1, K2, P1, P2};
        let CameraFacts { size_px, pixel_aspect, .. } = *facts;
        let [width, height] = size_px.map(|n| u16::try_from(n).unwrap_or(u16::MAX));
        let model = if ideal == Model::Pinhole { Model::BrownConrady } else { Model::KannalaBrandt };
        let mut camera = Config::ideal(model, width, height, focal.px);
        camera.fy_px *= pixel_aspect;
        camera.set_intrinsic(K1, 0.0);
        let edge2 = (0.5 * f64::from(size_px[0]) / focal.px).powi(2);
        let k1_sigma = k1_sigma(ideal, edge2.sqrt());
        let k2_sigma = (SECOND_SHAPE / edge2).min(SECOND_SHAPE_BY_RHO2) / edge2;
        let p_sigma = model.intrinsics().contains(&P1).then_some(DECENTRING);
        let centre_sigma_px = (CENTRE_FRACTION * f64::from(size_px[0])).ceil();
        // A field of view fixes the angle at the edge, where r = f (ρ + k1 ρ³ + k2 ρ⁵). A change of the shape then
        // changes the focal length, so that the edge stays. A focal length from EXIF is that of the middle and has
        // nothing to do with the shape.
        let at_edge = |part: f64| if focal.is_at_edge { part * focal.px } else { 0.0 };
        let focal_mode = |px: f64| [(FxPx, px), (FyPx, px * pixel_aspect)];
        let mut modes = vec![
            focal_mode(0.01 * focal.percent * focal.px).to_vec(),
            vec![(CxPx, centre_sigma_px)],
            vec![(CyPx, centre_sigma_px)],
            [&focal_mode(at_edge(-edge2 * k1_sigma))[..], &[(K1, k1_sigma)]].concat(),
            [
                &focal_mode(at_edge(edge2 * edge2 / 3.0 * k2_sigma))[..],
                &[(K1, -4.0 / 3.0 * edge2 * k2_sigma), (K2, k2_sigma)],
            ]
            .concat(),
        ];
        modes.extend(p_sigma.iter().flat_map(|sigma| [vec![(P1, *sigma)], vec![(P2, *sigma)]]));
        let covariance = of_modes(model, &modes);
        let focal_sigma = covariance.rows.first().and_then(|row| row.first()).map_or(0.0, |v| v.sqrt());
        camera.covariance = Some(covariance);
        let focal_sigma_percent = 100.0 * focal_sigma / focal.px;
        Self { camera, k1_sigma, k2_sigma, p_sigma, focal_sigma_percent, centre_sigma_px }
    }
}

/// Returns the covariance of independent errors, each with the 1-sigma changes of the parameters that it moves.
fn of_modes(model: Model, modes: &[Vec<(Intrinsic, f64)>]) -> Covariance {
    let is_moved = |which: &Intrinsic| modes.iter().flatten().any(|(i, _)| i == which);
    let order: Vec<Intrinsic> = model.intrinsics().iter().copied().filter(is_moved).collect();
    let change = |mode: &[(Intrinsic, f64)], which| mode.iter().find(|(i, _)| *i == which).map_or(0.0, |(_, by)| *by);
    let at = |a, b| modes.iter().map(|mode| change(mode, a) * change(mode, b)).sum::<f64>();
    let rows = order.iter().map(|a| order.iter().map(|b| at(*a, *b)).collect()).collect();
    Covariance { order: order.iter().copied().collect(), rows }
}

/// Returns the 1-sigma of k1 of a lens that is taken for ideal. `edge` is the radius of the picture's edge in focal
/// lengths.
///
/// With k2 = 0, each lens that the camera may have gives a k1: the ideal lens with this k1 equals it at the edge and at
/// edge/√3, where the difference of two lenses with the same edge is largest.
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

    /// A narrow field of view makes k2 very uncertain, and correlated with k1; the file has six digits.
    #[test]
    fn the_written_covariance_is_positive_definite_at_every_field_of_view() {
        for fov_deg in [0.5, 2.0, 10.0, 40.0, 92.0, 140.0, 220.0] {
            for ideal in [Model::Pinhole, Model::Equidistant] {
                if ideal == Model::Pinhole && fov_deg > 150.0 {
                    continue;
                }
                let focal = Focal::from_stated(ideal, 640.0, fov_deg).unwrap();
                let mut camera = Guess::new(&CameraFacts::of_size([640, 480]), ideal, &focal).camera;
                let covariance = camera.covariance.as_mut().unwrap();
                for value in covariance.rows.iter_mut().flatten() {
                    *value = format!("{value:.6e}").parse().unwrap();
                }
                // A covariance that is not positive semidefinite is refused.
                let made = hzn_core::camera::Camera::<f64>::try_new(&camera);
                assert!(made.is_ok(), "{fov_deg}: {made:?}");
            }
        }
    }
}
