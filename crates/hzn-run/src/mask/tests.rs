//! Masks of known outlines, and of Sun and Moon by the ephemeris.

use hzn_core::body;
use hzn_core::camera::{self, Model};

use super::*;

fn camera(model: Model, width: u16, height: u16, focal_px: f64) -> Camera<f64> {
    Camera::try_new(&camera::Config::ideal(model, width, height, focal_px)).unwrap()
}

fn unit(xyz: [f64; 3]) -> UnitVec3<Cam, f64> {
    UnitVec3::try_new(xyz).unwrap()
}

/// Draws without tiles.
fn draw_each(outlines: &[Outline], camera: &Camera<f64>) -> GrayImage {
    GrayImage::from_fn(camera.width().into(), camera.height().into(), |x, y| {
        let ray = camera.ray(ImagePoint { u: x.into(), v: y.into() });
        Luma([if ray.is_some_and(|ray| outlines.iter().any(|o| o.covers(&ray))) { COVERED } else { 0 }])
    })
}

#[test]
fn tiles_give_the_same_mask_as_single_pixels() {
    let lenses = [(Model::Pinhole, 300.0), (Model::Pinhole, 60.0), (Model::Equidistant, 90.0)];
    for (model, focal_px) in lenses {
        let camera = camera(model, 203, 151, focal_px);
        let outlines: Vec<Outline> = [
            ([0.0, 0.9, 0.5], 1.1, 0.02),
            ([0.3, -0.1, 1.0], 0.004, 0.0),
            ([-0.2, 0.1, 1.0], 0.2, 0.01),
            ([0.0, 0.0, -1.0], 0.3, 0.0),
        ]
        .map(|(axis, half_angle_rad, margin_rad)| Outline::disc(&unit(axis), half_angle_rad, margin_rad))
        .into();
        for outlines in outlines.chunks(1).chain([&outlines[..], &outlines[1..3]]) {
            assert!(draw(outlines, &camera) == draw_each(outlines, &camera), "{model:?} {focal_px} {outlines:?}");
        }
    }
}

#[test]
fn every_pixel_that_a_disc_touches_is_covered() {
    // The disc is smaller than a pixel, and its centre lies where four pixels meet.
    let camera = camera(Model::Pinhole, 64, 48, 100.0);
    let at = |u: f64, v: f64| camera.unproject(ImagePoint { u, v }).unwrap();
    let covered = |axis: &UnitVec3<Cam, f64>, half_angle_rad: f64| -> Vec<(u32, u32)> {
        let mask = draw(&[Outline::disc(axis, half_angle_rad, 0.0)], &camera);
        mask.enumerate_pixels().filter(|(_, _, p)| p.0 == [COVERED]).map(|(x, y, _)| (x, y)).collect()
    };
    assert_eq!(covered(&at(20.5, 30.5), 1e-4), [(20, 30), (21, 30), (20, 31), (21, 31)]);
    assert_eq!(covered(&at(20.0, 30.0), 1e-4), [(20, 30)]);
    // The sides of a pixel are half a pixel from its middle, its corners 0.7.
    assert_eq!([0.0065, 0.0075].map(|half_angle| covered(&at(20.0, 30.0), half_angle).len()), [5, 9]);
    // Pixels beyond the image circle show nothing.
    let round = camera::Config { theta_max_deg: Some(10.0), ..camera::Config::ideal(Model::Pinhole, 64, 48, 100.0) };
    let mask = draw(&[Outline::disc(&unit([0.0, 0.0, 1.0]), 1.0, 0.0)], &Camera::try_new(&round).unwrap());
    assert_eq!((mask.get_pixel(0, 0).0, mask.get_pixel(32, 24).0), ([0], [COVERED]));
}

fn earth_masker() -> Masker {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 500.0));
    config.body = body::Config { kind: Kind::Earth, ..body::Config::default() };
    Masker::new(&config).unwrap()
}

#[test]
fn a_picture_without_an_answer_has_no_mask() {
    let given = FrameData { sun_camera: Some([0.0, 0.0, 1.0]), ..FrameData::default() };
    assert_eq!(earth_masker().cover(&[None], Some(&given), 0.0).unwrap_err(), "no answer");
    assert_eq!(earth_masker().cover(&[], None, 0.0).unwrap_err(), "no answer");
}

#[test]
fn sun_and_moon_are_where_the_ephemeris_has_them() {
    let utc_s = 1_718_916_660.0;
    let position_km = [4000.0, 3000.0, 5000.0];
    let q = [0.5, -0.5, 0.5, 0.5];
    let known = FrameData {
        utc_s: Some(utc_s),
        position_km: Some(position_km),
        q_fixed_from_camera_wxyz: Some(q),
        attitude_sigma_deg: Some(1.0),
        ..FrameData::default()
    };
    let disc = |kind, data: &FrameData| Disc::known(kind, data, Kind::Earth);
    for (kind, half_angle_deg, error_deg) in [(Kind::Sun, 0.262, 3.01), (Kind::Moon, 0.257, 3.1)] {
        let found = disc(kind, &known).unwrap();
        let fixed = Rotation::<Cam, Fixed, f64>::assume_from_quaternion(q).unwrap().apply(&found.direction).xyz();
        let place = if kind == Kind::Sun { ephemeris::sun(utc_s) } else { ephemeris::moon(utc_s) };
        let to = [0, 1, 2].map(|i| place.position_m().xyz()[i] - position_km[i] * 1e3);
        let off = UnitVec3::<Fixed, f64>::try_new(to).unwrap().angle_rad(&UnitVec3::try_new(fixed).unwrap());
        assert!(off < 1e-9, "{kind:?} {off}");
        assert!((found.half_angle_rad.to_degrees() - half_angle_deg).abs() < 0.03, "{}", found.half_angle_rad);
        assert!((found.error_rad.to_degrees() - error_deg).abs() < 1e-9);
        // Without time or attitude, and with an attitude that says nothing, the direction is unknown.
        assert!(disc(kind, &FrameData { utc_s: None, ..known.clone() }).is_none());
        assert!(disc(kind, &FrameData { q_fixed_from_camera_wxyz: None, ..known.clone() }).is_none());
        assert!(disc(kind, &FrameData { attitude_sigma_deg: Some(40.0), ..known.clone() }).is_none());
        // The ephemeris is that of the Earth.
        assert!(Disc::known(kind, &known, Kind::Jupiter).is_none());
        let nowhere = disc(kind, &FrameData { position_km: None, ..known.clone() });
        assert_eq!(nowhere.is_some(), kind == Kind::Sun);
    }
    // A given direction to the Sun comes first, and counts at other planets.
    let given = FrameData { sun_camera: Some([0.0, 3.0, 4.0]), ..known };
    let direction = Disc::known(Kind::Sun, &given, Kind::Jupiter).unwrap().direction;
    assert!(direction.angle_rad(&unit([0.0, 0.6, 0.8])) < 1e-12);
}
