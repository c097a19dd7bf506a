//! The limb height that one picture measures.
//!
//! With the camera at the height H above the ground of radius R, a limb of the height d has the half-angle
//! sin α = (R + d)/(R + H). A free half-angle therefore measures d = d₀ + (R + H)(sin α̂ − sin α₀), with the expected
//! values (d₀, α₀) and ∂d/∂cos α = −(R + H) cot α.

use hzn_core::body::{self, Kind};
use hzn_core::camera::{Camera, INTRINSICS};
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, from_geodetic, geodetic};
use hzn_core::{Prior, Solution};
use nalgebra::Vector3;

use super::bend::{self, SHAPES};
use super::cone::{Azimuth, Cone, Row, basis};
use super::edge::{self, Scores};
use super::lag::Lags;
use super::slow;

/// Attitudes with a larger sigma, in radians (30 degrees), are not used: they do not show which part of the limb is
/// visible.
pub(crate) const USELESS_ATTITUDE_RAD: f64 = core::f64::consts::FRAC_PI_6;
/// 1-sigma of an attitude without a sigma, radians (5 degrees); the sensor uses the same value.
pub(crate) const ATTITUDE_SIGMA_RAD: f64 = core::f64::consts::PI / 36.0;
/// Number of points on the limb at which latitudes are computed if the visible part is unknown.
const RING: usize = 24;
/// Number of latitudes, evenly from pole to pole, over which an unknown position is averaged.
const LATITUDES: usize = 19;

/// Limb height and noise of one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// Name of the picture.
    pub name: String,
    /// Limb height from the fit with a free half-angle, in kilometres.
    pub limb_height_km: f64,
    /// 1-sigma of the limb height from edge noise (and from the unknown direction of north), in kilometres.
    pub sigma_km: f64,
    /// 1-sigma of the limb height from the unknown local radius, in kilometres; pictures from one latitude have it in
    /// common. It is 0 for a sphere and for a known position.
    pub radius_sigma_km: f64,
    /// Change of the limb height if all points move across the limb by one pixel, in kilometres. In a wide picture it
    /// is larger than the size of a pixel at the limb. Pixels away from the middle are finer, so the shift looks like
    /// a bend.
    pub km_per_px: f64,
    /// Change of the limb height by a bend of the whole edge with an RMS of one pixel, in kilometres.
    pub km_per_bend_px: f64,
    /// Change of the limb height per relative change of the focal length, in kilometres, for a limb of the height that
    /// the sensor expects. The noise of the picture is not in it.
    pub km_per_focal: f64,
    /// Change of the limb height by each 1-sigma mode of the lens in sensor.toml, in kilometres, for the same limb; 0
    /// beyond their number.
    pub(super) km_by_lens: [f64; INTRINSICS],
    /// Weighted RMS distance of the edge points from the limb, in pixels.
    pub rms_px: f64,
    /// Length of the edge that the points cover, in pixels.
    pub arc_px: f64,
    /// Correlation length, in pixels, at which edge errors of this RMS explain the edge noise part of `sigma_km`.
    pub correlation_px: f64,
    /// Part of the edge points whose lit side is clipped at full scale, from 0 to 1.
    pub(super) clipped: f64,
    /// Geodetic latitudes of the visible limb in degrees, each with its share of the height; empty without a position.
    pub latitudes: Vec<(f64, f64)>,
    /// Amplitude of each next shape in the residuals, in pixels.
    pub(super) shapes_px: [f64; SHAPES],
    /// Variance of the slow part of the residuals, in px²; only its mean over many pictures is an estimate.
    pub(super) slow_px2: f64,
    /// Scores of the edge noise models for the residuals.
    pub(super) scores: Scores,
    /// Products of residuals by their distance along the edge.
    pub(super) lags: Lags,
}

/// The camera's position relative to the body; distances in metres.
#[derive(Debug, Clone)]
pub(crate) struct Geometry {
    /// R + H of the sphere that replaces the body.
    pub(crate) distance_m: f64,
    /// Altitude of the camera.
    pub(crate) altitude_m: f64,
    pub(crate) kind: Kind,
    /// Sine of the half-angle for a limb of the height `limb_m`.
    pub(crate) sin_expected: f64,
    /// Limb height of the sensor's configuration.
    pub(crate) limb_m: f64,
    /// Limb cone of the ellipsoid, with a position.
    pub(crate) cone: Option<LimbCone<f64>>,
    position_m: Option<[f64; 3]>,
    /// 1-sigma of the limb height from the unknown radius, in metres.
    pub(crate) radius_sigma_m: f64,
    /// Half the difference of the cosines of the half-angles along the meridian and east.
    pub(crate) second_harmonic_cos: f64,
}

impl Sighting {
    /// Measures the limb height from a picture's answer. `points` are the answer's edge points (pixels) with their
    /// weights, `body` is the sensor's configuration of the body, and `prior` is the prior of the picture. The result
    /// is `None` for Sun and Moon, whose half-angle does not depend on a height. It is also `None` without an altitude,
    /// and if the points do not determine a cone.
    pub fn measure(
        name: &str,
        camera: &Camera<f64>,
        body: &body::Config,
        prior: &Prior<f64>,
        points: &[([f64; 2], f64)],
        solution: &Solution<f64>,
    ) -> Option<Self> {
        if body.half_angle_is_free() {
            return None;
        }
        let geometry = Geometry::new(body, prior)?;
        let camera = &camera.with_rate(prior.rate_rad_s).with_temperature(prior.camera_temperature_c);
        let attitude_sigma = prior.attitude_sigma_rad.unwrap_or(ATTITUDE_SIGMA_RAD);
        let known = with_useful_attitude(prior);
        let azimuth = geometry.cone.as_ref().and_then(|cone| Azimuth::new(cone, &known));
        let cone = Cone::fit(camera, points, solution.axis.xyz(), solution.half_angle_rad.cos(), azimuth.as_ref())?;
        let sin = (1.0 - cone.cos * cone.cos).sqrt();
        if !(sin > 0.0 && cone.cos > 0.0) {
            return None;
        }
        // The air in front of a balloon raises the limb: the height below it is the one to configure.
        let apparent_m = geometry.limb_m + geometry.distance_m * (sin - geometry.sin_expected);
        let (height_km, slope) = body.kind.height_below_air_km(apparent_m / 1e3, geometry.altitude_m / 1e3);
        let by_cos_m = -geometry.distance_m * cone.cos / sin * slope;
        let expected_cos = (1.0 - geometry.sin_expected * geometry.sin_expected).sqrt();
        let expected = Cone::of_known_limb(camera, points, solution.axis.xyz(), expected_cos, azimuth.as_ref())?;
        let by_expected_cos_m = -geometry.distance_m * expected_cos / geometry.sin_expected * slope;
        let by_lens_km = |signal: &dyn Fn(&Row) -> f64| by_expected_cos_m * expected.change_of_cos(signal) / 1e3;
        let scores = edge::score_models(&cone)?;
        let noise = edge::variance_of_cos(&cone, &scores);
        let variance_cos = noise + geometry.variance_of_harmonic(&cone, azimuth.as_ref().map(|_| attitude_sigma));
        Some(Self {
            name: name.to_owned(),
            limb_height_km: height_km,
            sigma_km: by_cos_m.abs() * variance_cos.sqrt() / 1e3,
            radius_sigma_km: geometry.radius_sigma_m / 1e3,
            km_per_px: by_cos_m.abs() * cone.cos_per_px().max(cone.change_of_cos(|_| 1.0).abs()) / 1e3,
            km_per_bend_px: by_cos_m.abs() * cone.change_of_cos(|row| bend::bend_shape(row.along)).abs() / 1e3,
            shapes_px: bend::shapes_px(&cone),
            slow_px2: slow::variance_px2(&cone),
            km_per_focal: by_lens_km(&|row| row.by_focal_px),
            km_by_lens: core::array::from_fn(|k| by_lens_km(&|row| row.by_lens_px[k])),
            rms_px: cone.rms_px(),
            arc_px: cone.arc_px(),
            clipped: 0.0,
            correlation_px: edge::equivalent_length_px(&cone, cone.rms_px(), noise),
            latitudes: latitudes(&geometry, &cone, &known, attitude_sigma),
            lags: Lags::new(&cone),
            scores,
        })
    }

    /// Returns the sighting of a picture in which this part of the edge points, 0 to 1, has a lit side that is clipped
    /// at full scale. There the limb appears higher.
    #[must_use]
    pub fn with_clipped(self, part: f64) -> Self {
        Self { clipped: part, ..self }
    }
}

/// Returns the prior without its attitude if that is too uncertain to show which part of the limb is visible.
pub(crate) fn with_useful_attitude(prior: &Prior<f64>) -> Prior<f64> {
    let sigma = prior.attitude_sigma_rad.unwrap_or(ATTITUDE_SIGMA_RAD);
    Prior { fixed_from_camera: prior.fixed_from_camera.filter(|_| sigma < USELESS_ATTITUDE_RAD), ..*prior }
}

/// Returns the rays of the edge points (camera frame), each with its share of the picture's limb height. The shares sum
/// to 1. On a short arc the height comes from the curvature. The shares of the ends and of the middle are then large
/// and have opposite signs, so that a height which varies along the limb has an enlarged effect. The arguments are
/// those of [`Sighting::measure`], without an attitude; for a rolling shutter, `camera` must be the turning one
/// (`Camera::turning`).
pub fn shares(
    camera: &Camera<f64>,
    points: &[([f64; 2], f64)],
    solution: &Solution<f64>,
) -> Option<Vec<([f64; 3], f64)>> {
    let cone = Cone::fit(camera, points, solution.axis.xyz(), solution.half_angle_rad.cos(), None)?;
    Some(cone.rays.iter().map(|ray| (*ray).into()).zip(cone.shares()).collect())
}

impl Geometry {
    /// Returns the geometry of a picture; `None` without an altitude and for a camera below the limb.
    pub(crate) fn new(body: &body::Config, prior: &Prior<f64>) -> Option<Self> {
        let limb_m = body.limb_height_km * 1e3;
        let altitude_m = prior.altitude_m.or(body.altitude_km.map(|km| km * 1e3));
        let radius_m = body.mean_radius_km() * 1e3;
        let sphere = |distance_m: f64| Self {
            distance_m,
            altitude_m: distance_m - radius_m,
            kind: body.kind,
            sin_expected: (radius_m + limb_m) / distance_m,
            limb_m,
            cone: None,
            position_m: None,
            radius_sigma_m: 0.0,
            second_harmonic_cos: 0.0,
        };
        let geometry = match (body.kind, prior.position_m) {
            (Kind::Earth, Some(position)) => {
                let cone = limb_cone(position, limb_m)?;
                let (altitude, _) = geodetic(position, WGS84_A_M, WGS84_B_M);
                let sin = cone.mean_half_angle_rad().sin();
                let radius = (sin * altitude - limb_m) / (1.0 - sin);
                Self {
                    cone: Some(cone),
                    position_m: Some(position),
                    second_harmonic_cos: second_harmonic_cos(&cone),
                    altitude_m: altitude,
                    ..Self { sin_expected: sin, ..sphere(radius + altitude) }
                }
            }
            (Kind::EarthSphere | Kind::Sphere, Some([x, y, z])) => sphere(x.hypot(y).hypot(z)),
            (Kind::Earth, None) => {
                let geometry = sphere(radius_m + altitude_m?);
                // The latitude is unknown: the mean squares of the effects of radius and shape are taken over all
                // latitudes.
                let (mut radius2, mut harmonic2) = (0.0, 0.0);
                for k in 0..LATITUDES {
                    let latitude = core::f64::consts::PI * (k as f64 / (LATITUDES - 1) as f64 - 0.5);
                    let cone = limb_cone(from_geodetic(latitude, 0.0, altitude_m?, WGS84_A_M, WGS84_B_M), limb_m)?;
                    let off_m = geometry.distance_m * (cone.mean_half_angle_rad().sin() - geometry.sin_expected);
                    radius2 += off_m * off_m / LATITUDES as f64;
                    harmonic2 += second_harmonic_cos(&cone).powi(2) / LATITUDES as f64;
                }
                Self { radius_sigma_m: radius2.sqrt(), second_harmonic_cos: harmonic2.sqrt(), ..geometry }
            }
            (_, None) => sphere(radius_m + altitude_m?),
            (_, Some(_)) => return None,
        };
        (geometry.sin_expected < 1.0 && geometry.sin_expected > 0.0).then_some(geometry)
    }

    /// Returns the mean along the limb of sin φ and of (3 sin² φ − 1)/2, with the latitude φ of the limb; `None`
    /// without a position. At the azimuth ψ from north, sin φ = u + w cos ψ with u = s sin φ₀, w = √(1 − s²) cos φ₀, s
    /// = R/d and the latitude φ₀ of the position. A fit of axis and half-angle takes the part with cos ψ as a tilt,
    /// whatever part of the limb is visible, so that only the mean is left in the height.
    pub(crate) fn limb_by_latitude(&self) -> Option<[f64; 2]> {
        let [x, y, z] = self.position_m?;
        let distance_m = x.hypot(y).hypot(z);
        let s = f64::min(WGS84_A_M / distance_m, 1.0);
        let up_z = z / distance_m;
        let (u, w2) = (s * up_z, (1.0 - s * s) * (1.0 - up_z * up_z));
        Some([u, 0.5 * (3.0 * (u * u + 0.5 * w2) - 1.0)])
    }

    /// Returns the variance of the fitted cos α from the second harmonic of the limb. If north is unknown, the full
    /// harmonic is an error. With the sigma of an attitude (radians) only a part of it is.
    pub(crate) fn variance_of_harmonic(&self, cone: &Cone, attitude_sigma_rad: Option<f64>) -> f64 {
        let unknown = attitude_sigma_rad.map_or(1.0, |sigma| (2.0 * sigma).min(1.0));
        let harmonic_cos = unknown * self.second_harmonic_cos;
        let harmonic = |wave: fn(f64) -> f64| cone.change_of_cos(|row| wave(2.0 * row.azimuth_rad) / row.slope);
        let (c, s) = (harmonic(f64::cos), harmonic(f64::sin));
        0.5 * harmonic_cos * harmonic_cos * (c * c + s * s)
    }
}

/// Returns the limb cone of the Earth for a limb of the height `limb_m`.
fn limb_cone(position_m: [f64; 3], limb_m: f64) -> Option<LimbCone<f64>> {
    LimbCone::try_new(position_m, WGS84_A_M + limb_m, WGS84_B_M + limb_m)
}

/// Returns the amplitude of the second harmonic of cos α.
fn second_harmonic_cos(cone: &LimbCone<f64>) -> f64 {
    let (east, meridian) = cone.half_angles_rad();
    0.5 * (meridian.cos() - east.cos())
}

/// Returns latitudes of the limb, in degrees, with their shares: those of the points if the attitude is known, else
/// those of the whole ring.
fn latitudes(geometry: &Geometry, cone: &Cone, prior: &Prior<f64>, attitude_sigma_rad: f64) -> Vec<(f64, f64)> {
    let (Some(position), Some(limb)) = (geometry.position_m, &geometry.cone) else { return Vec::new() };
    let camera = Vector3::from(position);
    // The point of a ray that is nearest to the Earth's centre. Apart from the flattening, its latitude is that of the
    // limb.
    let latitude = |ray: Vector3<f64>| {
        let p = camera - ray * camera.dot(&ray);
        geodetic([p.x, p.y, p.z], WGS84_A_M, WGS84_B_M).1.to_degrees()
    };
    match prior.fixed_from_camera {
        Some(attitude) if attitude_sigma_rad < USELESS_ATTITUDE_RAD => {
            let visible = cone.rays.iter().zip(cone.shares()).filter_map(|(ray, share)| {
                let ray = hzn_core::frames::UnitVec3::try_new([ray.x, ray.y, ray.z])?;
                Some((latitude(Vector3::from(attitude.apply(&ray).xyz())), share))
            });
            visible.collect()
        }
        _ => {
            let axis = Vector3::from(limb.axis.xyz());
            let (b1, b2) = basis(&axis);
            let (sin, cos) = limb.mean_half_angle_rad().sin_cos();
            let ray = |k: usize| {
                let (s, c) = ((k as f64 + 0.5) * core::f64::consts::TAU / RING as f64).sin_cos();
                axis * cos + (b1 * c + b2 * s) * sin
            };
            (0..RING).map(|k| (latitude(ray(k)), 1.0 / RING as f64)).collect()
        }
    }
}
