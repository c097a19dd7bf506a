//! The direction to the centre of the body. An answer has the limb axis, which is another direction if the body is an
//! ellipsoid: at the Earth the two differ by up to 0.19 degrees.

use hzn_core::body::Kind;
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, from_geodetic};
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_files::FrameData;
use hzn_mcap::Row;

/// 1-sigma of an attitude that is given without one, in degrees; that of the sensor.
const ATTITUDE_SIGMA_DEG: f64 = 5.0;
/// Latitude, in degrees, at which axis and centre differ most. The difference is in proportion to the sine of twice the
/// latitude, apart from terms of the flattening squared.
const WORST_LATITUDE_DEG: f64 = 45.0;

/// The direction to the centre of a body, and how far it can be off because the orientation of the ellipsoid is not
/// known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nadir {
    /// Unit vector in the camera frame.
    pub direction: [f64; 3],
    /// Angle that the direction differs from that to the centre, at most, in degrees, apart from the error of the axis;
    /// 0 if the position of the centre was fitted, or if the body is round. For a given attitude it is the effect of
    /// three of its sigmas.
    pub error_deg: f64,
}

impl Nadir {
    /// Returns the direction to the centre for an answer, with what was given with its picture. `None` without an
    /// answer, and for an ellipsoid other than the Earth whose position was not fitted.
    ///
    /// - With a fitted position (`fit.position`), or at a round body, it is exact.
    /// - With position and attitude, the limb axis is turned by the angle between axis and centre, which the position
    ///   determines. The attitude gives the direction of this turn, so its error hardly matters.
    /// - Without an attitude this direction is unknown, so the limb axis is returned. The error is then the whole
    ///   angle, at the given position or for the latitude at which it is largest.
    pub fn from_answer(row: &Row, known: Option<&FrameData>) -> Option<Self> {
        let exact = |direction: UnitVec3<Cam, f64>| Some(Self { direction: direction.xyz(), error_deg: 0.0 });
        let axis = UnitVec3::<Cam, f64>::from_unit(row.axis()?)?;
        if let (Some(x), Some(y), Some(z)) = (row.position_x_km, row.position_y_km, row.position_z_km) {
            return exact(UnitVec3::try_new([x, y, z])?);
        }
        let is_kind = |kind: &Kind| row.body == kind.name();
        if [Kind::EarthSphere, Kind::Sphere, Kind::Sun, Kind::Moon].iter().any(is_kind) {
            return exact(axis);
        }
        if !is_kind(&Kind::Earth) {
            return None;
        }
        let Some((axis_fixed, centre_fixed)) = fixed_directions(row, known) else {
            let altitude_m = row.altitude_km.or(row.altitude_est_km).unwrap_or(0.0).max(0.0) * 1e3;
            return Some(Self { direction: axis.xyz(), error_deg: largest_rad(altitude_m)?.to_degrees() });
        };
        let angle_rad = axis_fixed.angle_rad(&centre_fixed);
        let attitude = known.and_then(|k| Some((k.q_fixed_from_camera_wxyz?, k.attitude_sigma_deg)));
        let turned = attitude.and_then(|(q, sigma_deg)| {
            let camera = Rotation::<Cam, Fixed, f64>::assume_from_quaternion(q)?.inverse();
            let direction = carry(&camera.apply(&axis_fixed), &axis, &camera.apply(&centre_fixed))?;
            let off_rad = 3.0 * sigma_deg.unwrap_or(ATTITUDE_SIGMA_DEG).to_radians();
            Some(Self { direction: direction.xyz(), error_deg: (angle_rad * off_rad.min(2.0)).to_degrees() })
        });
        Some(turned.unwrap_or(Self { direction: axis.xyz(), error_deg: angle_rad.to_degrees() }))
    }
}

/// Returns the limb axis and the direction to the centre in the fixed frame, if the position is known.
fn fixed_directions(row: &Row, known: Option<&FrameData>) -> Option<(UnitVec3<Fixed, f64>, UnitVec3<Fixed, f64>)> {
    let axis = UnitVec3::try_new([row.axis_e_x?, row.axis_e_y?, row.axis_e_z?])?;
    Some((axis, UnitVec3::try_new(known?.position_km?.map(|km| -km))?))
}

/// Returns the largest angle between limb axis and centre at an altitude above WGS-84.
fn largest_rad(altitude_m: f64) -> Option<f64> {
    // On the ground there is no cone; one metre above it the axis is the vertical.
    let position = from_geodetic(WORST_LATITUDE_DEG.to_radians(), 0.0, altitude_m.max(1.0), WGS84_A_M, WGS84_B_M);
    let cone = LimbCone::<f64>::try_new(position, WGS84_A_M, WGS84_B_M)?;
    Some(cone.axis.angle_rad(&UnitVec3::try_new(position.map(|m| -m))?))
}

/// Returns `d` after the shortest rotation that carries `from` to `to`; `None` if these are opposite.
fn carry(from: &UnitVec3<Cam, f64>, to: &UnitVec3<Cam, f64>, d: &UnitVec3<Cam, f64>) -> Option<UnitVec3<Cam, f64>> {
    let v = cross(from.xyz(), to.xyz());
    let scale = 1.0 / (1.0 + from.dot(to));
    let d = d.xyz();
    let once = cross(v, d);
    let twice = cross(v, once);
    UnitVec3::try_new([0, 1, 2].map(|i| d[i] + once[i] + scale * twice[i]))
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

#[cfg(test)]
mod tests {
    use hzn_core::status::Status;
    use hzn_mcap::RowMeta;

    use super::*;

    const Q: [f64; 4] = [0.5, -0.5, 0.5, 0.5];

    fn empty() -> Row {
        Row::unprocessed(&RowMeta::default(), Status::Ok, "")
    }

    /// Returns the row of an exact answer at this latitude and 500 km, and the true direction to the centre.
    fn answer(latitude_deg: f64) -> (Row, FrameData, [f64; 3]) {
        let position_m = from_geodetic(latitude_deg.to_radians(), 1.0, 500e3, WGS84_A_M, WGS84_B_M);
        let cone = LimbCone::<f64>::try_new(position_m, WGS84_A_M, WGS84_B_M).unwrap();
        let camera = Rotation::<Cam, Fixed, f64>::assume_from_quaternion(Q).unwrap().inverse();
        let [x, y, z] = camera.apply(&cone.axis).xyz();
        let [ex, ey, ez] = cone.axis.xyz();
        let row = Row {
            body: "earth".into(),
            altitude_km: Some(500.0),
            axis_x: Some(x),
            axis_y: Some(y),
            axis_z: Some(z),
            axis_e_x: Some(ex),
            axis_e_y: Some(ey),
            axis_e_z: Some(ez),
            ..empty()
        };
        let known = FrameData { position_km: Some(position_m.map(|m| m / 1e3)), ..FrameData::default() };
        (row, known, camera.apply(&UnitVec3::try_new(position_m.map(|m| -m)).unwrap()).xyz())
    }

    fn off_deg(nadir: &Nadir, truth: [f64; 3]) -> f64 {
        UnitVec3::<Cam, f64>::try_new(nadir.direction)
            .unwrap()
            .angle_rad(&UnitVec3::try_new(truth).unwrap())
            .to_degrees()
    }

    #[test]
    fn an_attitude_that_is_five_degrees_off_still_gives_the_centre() {
        let (row, known, truth) = answer(40.0);
        let axis = Nadir::from_answer(&row, Some(&known)).unwrap();
        assert_eq!(axis.direction, row.axis().unwrap());
        // The axis itself is 0.16 degrees off, and says so.
        assert!(off_deg(&axis, truth) > 0.15 && (axis.error_deg - off_deg(&axis, truth)).abs() < 1e-9, "{axis:?}");
        let half = 2.5_f64.to_radians();
        let [w, x, y, z] = Q;
        // Five degrees about the camera's x, y or z.
        let turns = [[half.sin(), 0.0, 0.0], [0.0, half.sin(), 0.0], [0.0, 0.0, half.sin()], [0.0; 3]];
        for [a, b, c] in turns {
            let s = if [a, b, c] == [0.0; 3] { 1.0 } else { half.cos() };
            let q = [
                w * s - x * a - y * b - z * c,
                w * a + x * s + y * c - z * b,
                w * b - x * c + y * s + z * a,
                w * c + x * b - y * a + z * s,
            ];
            let given = FrameData { q_fixed_from_camera_wxyz: Some(q), ..known.clone() };
            let nadir = Nadir::from_answer(&row, Some(&given)).unwrap();
            let off = off_deg(&nadir, truth);
            assert!(off <= nadir.error_deg && nadir.error_deg < 0.05, "{off} {nadir:?}");
            assert!(off < if s == 1.0 { 1e-9 } else { 0.016 }, "{off}");
        }
    }

    #[test]
    fn without_a_position_the_error_is_that_of_the_worst_latitude() {
        let (row, ..) = answer(40.0);
        let bare = Row { axis_e_x: None, ..row.clone() };
        let bound = Nadir::from_answer(&bare, None).unwrap().error_deg;
        for latitude in [0.0, 20.0, 44.0, 44.9, 45.0, 45.1, 60.0, -45.0] {
            let (row, known, truth) = answer(latitude);
            let off = off_deg(&Nadir::from_answer(&row, Some(&known)).unwrap(), truth);
            assert!(off <= bound * (1.0 + 1e-4), "{latitude} {off} {bound}");
        }
        assert!((bound - 0.165).abs() < 0.005, "{bound}");
    }

    #[test]
    fn round_bodies_and_fitted_positions_are_exact() {
        let (row, ..) = answer(40.0);
        let moon = Nadir::from_answer(&Row { body: "moon".into(), ..row.clone() }, None).unwrap();
        assert_eq!((moon.direction, moon.error_deg), (row.axis().unwrap(), 0.0));
        assert_eq!(Nadir::from_answer(&Row { body: "jupiter".into(), ..row.clone() }, None), None);
        let placed = Row {
            body: "jupiter".into(),
            position_x_km: Some(0.0),
            position_y_km: Some(3.0),
            position_z_km: Some(4.0),
            ..row
        };
        let nadir = Nadir::from_answer(&placed, None).unwrap();
        assert!(off_deg(&nadir, [0.0, 0.6, 0.8]) < 1e-12 && nadir.error_deg == 0.0, "{nadir:?}");
        assert_eq!(Nadir::from_answer(&empty(), None), None);
    }
}
