//! Discs as a weather satellite in a geostationary orbit sees them: 5424 px wide, with a limb that is exactly that of
//! the ellipsoid, whole or cut by the border of the picture.

use hzn_core::camera::{self, Model};
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, HostHorizon, Prior, Report, body};
use hzn_host::Compiled;
use hzn_sim::{Look, Pose};

/// Distance from the centre of the Earth, above the equator, and the semi-axes of WGS-84; km.
const DISTANCE_KM: f64 = 42_164.0;
const AXES_KM: [f64; 3] = [6378.137, 6378.137, 6_356.752_314];
/// Angle of a pixel in the full disc of such a satellite, radians.
const PIXEL_RAD: f64 = 56e-6;
const WIDTH: u16 = 5424;

/// A picture of the disc, its lens and the attitude of the camera.
struct Disc {
    lens: camera::Config,
    fixed_from_camera: Rotation<Cam, Fixed, f64>,
    data: Vec<u8>,
}

/// Draws the disc `scale` times as large as that of the satellite, about the centre of the picture plus `shift_px`.
fn draw(scale: f64, shift_px: [f64; 2]) -> Disc {
    let mut lens = camera::Config::ideal(Model::Equidistant, WIDTH, WIDTH, scale / PIXEL_RAD);
    (lens.cx_px, lens.cy_px) = (lens.cx_px + shift_px[0], lens.cy_px + shift_px[1]);
    let look_to = Look { azimuth_rad: 0.3, depression_rad: 89.999f64.to_radians(), roll_rad: 0.2 };
    let pose = Pose::looking([DISTANCE_KM * 1e3, 0.0, 0.0], look_to);
    let fixed_from_camera = pose.fixed_from_camera().unwrap();
    let p = [DISTANCE_KM / AXES_KM[0], 0.0, 0.0];
    // Positive where the line of sight meets the ellipsoid: the discriminant of their intersection.
    let inside = |u: f64, v: f64| {
        let (x, y) = ((u - lens.cx_px) / lens.fx_px, (v - lens.cy_px) / lens.fy_px);
        let theta = x.hypot(y).max(1e-12);
        let ray = UnitVec3::<Cam, f64>::try_new([x * theta.sin() / theta, y * theta.sin() / theta, theta.cos()]);
        let d = fixed_from_camera.apply(&ray.unwrap()).xyz();
        let q = [d[0] / AXES_KM[0], d[1] / AXES_KM[1], d[2] / AXES_KM[2]];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let b = dot(p, q);
        b * b - dot(q, q) * (dot(p, p) - 1.0)
    };
    let radius_px = (AXES_KM[0] / DISTANCE_KM).asin() * lens.fx_px;
    let mut data = Vec::with_capacity(usize::from(WIDTH) * usize::from(WIDTH));
    for y in 0..WIDTH {
        for x in 0..WIDTH {
            let (u, v) = (f64::from(x), f64::from(y));
            let off = (u - lens.cx_px).hypot(v - lens.cy_px) - radius_px;
            // The disc is a third of a percent flat, and its centre is a pixel from the principal point.
            let light = if off.abs() < 0.005 * radius_px {
                let here = inside(u, v);
                let slope = (inside(u + 0.5, v) - inside(u - 0.5, v)).hypot(inside(u, v + 0.5) - inside(u, v - 0.5));
                (0.5 + here / slope).clamp(0.0, 1.0)
            } else {
                f64::from(u8::from(off < 0.0))
            };
            data.push((light * 200.0).round() as u8);
        }
    }
    Disc { lens, fixed_from_camera, data }
}

impl Disc {
    /// Returns the report of a sensor that knows the position, and the error of its answer in degrees.
    fn process(&self, knows_attitude: bool) -> (Report<f64>, f64) {
        let mut config = Config::new(self.lens.clone());
        config.body =
            body::Config { altitude_sigma_km: 1.0, limb_height_km: 0.0, limb_height_sigma_km: 0.5, ..config.body };
        let mut horizon = HostHorizon::boxed(&config).unwrap();
        let prior = Prior {
            position_m: Some([DISTANCE_KM * 1e3, 0.0, 0.0]),
            fixed_from_camera: knows_attitude.then_some(self.fixed_from_camera),
            attitude_sigma_rad: Some(0.5f64.to_radians()),
            ..Prior::default()
        };
        let picture = Grey::try_new(&self.data, Layout::packed(WIDTH.into(), WIDTH.into(), 1, 8)).unwrap();
        let report = horizon.find(&picture, &horizon.expect(&prior).unwrap());
        // Above the equator the axis of the limb points to the centre of the Earth.
        let down = UnitVec3::<Fixed, f64>::try_new([-1.0, 0.0, 0.0]).unwrap();
        let axis = self.fixed_from_camera.inverse().apply(&down);
        let solution = report.solution.as_ref().unwrap_or_else(|| panic!("{}: {:?}", report.status, report.candidates));
        let error_deg = solution.axis.angle_rad(&axis).to_degrees();
        println!("error {error_deg:.5}°, sigma {:.5}°", solution.covariance.sigma_max_rad().to_degrees());
        (report, error_deg)
    }
}

/// Without an attitude, the direction of the flattening is unknown, which moves the limb by 5 px from its mean cone.
#[test]
fn a_whole_disc_needs_no_attitude() {
    let disc = draw(0.99, [0.0; 2]);
    for knows_attitude in [true, false] {
        let (_, error_deg) = disc.process(knows_attitude);
        assert!(error_deg < 0.005, "{knows_attitude}: {error_deg}°");
    }
}

/// The border leaves four pieces of the limb. One of them alone gives an error of 0.02° without an attitude, because
/// the direction of the flattening is unknown.
#[test]
fn the_pieces_of_a_limb_that_the_border_cuts_are_joined() {
    let disc = draw(1.01, [0.0; 2]);
    for knows_attitude in [true, false] {
        let (report, error_deg) = disc.process(knows_attitude);
        assert!(error_deg < 0.003, "{knows_attitude}: {error_deg}°");
        let [first, joined] = report.candidates.as_slice() else { panic!("{:?}", report.candidates) };
        assert!(joined.length_px > 3 * first.length_px, "{first:?}, {joined:?}");
    }
}

/// The border cuts the disc on two sides that lie next to each other.
#[test]
fn a_disc_that_the_border_cuts_unevenly_is_exact_with_an_attitude() {
    let (_, error_deg) = draw(1.003, [31.0, -9.0]).process(true);
    assert!(error_deg < 0.003, "{error_deg}°");
}
