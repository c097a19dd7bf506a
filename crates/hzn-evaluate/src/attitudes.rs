//! Attitudes and positions of a frames.csv in another convention than the expected one.
//!
//! A picture shows the limb's axis without any attitude. If the axis is far from the given attitude in most pictures,
//! [`find_attitude_convention`] looks for the mistake that explains all of them.

use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
use hzn_files::rotations::Written;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::convention::{LARGE_SIGMAS, MIN_ANSWERS, SMALLER, angle, axis_and_angle, median, rotation_between};

/// Rate of the Earth, rad/s.
const EARTH_RATE_RAD_S: f64 = 7.292_115e-5;

/// The limb of a picture with the attitude and the position that were given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Axis of the limb in the camera frame, a unit vector, found without the attitude.
    pub axis: [f64; 3],
    /// 1-sigma of the axis and of the attitude together, rad.
    pub sigma_rad: f64,
    /// Time, s; 0 if it is not known.
    pub time_s: f64,
    /// Attitude as it was read: from the camera to the fixed frame of the body, scalar first.
    pub q_fixed_from_camera_wxyz: [f64; 4],
    /// Position as it was read, in the fixed frame, km.
    pub position_km: [f64; 3],
}

/// What may be wrong with the frames of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Frame {
    AsExpected,
    NegatedPosition,
    /// The attitude is relative to local axes, with z down or up.
    Local {
        is_down: bool,
    },
    /// The attitude is that of the vehicle, with the mount of sensor.toml.
    Vehicle(UnitQuaternion<f64>),
    /// One of attitude and position is relative to inertial axes.
    Inertial,
    /// The attitude is that of other axes on the vehicle.
    Turned,
}

/// Returns the convention that explains the attitudes of pictures whose limb is not where the attitude says, as a
/// sentence; `None` if the limb is there, or if nothing simple explains it. `mount` is that of sensor.toml, from the
/// camera to the vehicle, scalar first. `is_earth` says that the body is the Earth, whose limb has another axis than
/// its centre.
///
/// ```
/// use hzn_evaluate::{Sighting, find_attitude_convention};
///
/// // The camera turns about its x axis; the file has its quaternions as x, y, z, w.
/// let sighting = |i: i32| {
///     let half = 0.1 * f64::from(i);
///     Sighting {
///         axis: [0.0, -(2.0 * half).sin(), -(2.0 * half).cos()],
///         sigma_rad: 0.01,
///         time_s: f64::from(i),
///         q_fixed_from_camera_wxyz: [half.sin(), 0.0, 0.0, half.cos()],
///         position_km: [0.0, 0.0, 7000.0],
///     }
/// };
/// let all: Vec<Sighting> = (0..8).map(sighting).collect();
/// assert!(find_attitude_convention(&all, None, false).unwrap().contains("scalar last"));
/// ```
pub fn find_attitude_convention(all: &[Sighting], mount: Option<[f64; 4]>, is_earth: bool) -> Option<String> {
    if all.len() < MIN_ANSWERS {
        return None;
    }
    let misses = |written: Written, frame: Frame| misses(all, written, frame, is_earth);
    let before = median(misses(Written::AsRead, Frame::AsExpected)?.0.into_iter());
    let sigma = median(all.iter().map(|s| s.sigma_rad));
    if before <= LARGE_SIGMAS * sigma {
        return None;
    }
    let explains = |after: f64| after * SMALLER < before && after <= (LARGE_SIGMAS * sigma).max(before / 20.0);
    let mut fixed = vec![
        Frame::AsExpected,
        Frame::NegatedPosition,
        Frame::Local { is_down: true },
        Frame::Local { is_down: false },
    ];
    fixed.extend(mount.and_then(rotation).map(Frame::Vehicle));
    let pairs = |frames: Vec<Frame>| {
        let each = frames.into_iter().flat_map(|frame| Written::ALL.map(|written| (written, frame)));
        let mut pairs: Vec<(Written, Frame)> = each.collect();
        // One mistake is likelier than two.
        pairs.sort_by_key(|(written, frame)| {
            u8::from(*written != Written::AsRead) + u8::from(*frame != Frame::AsExpected)
        });
        pairs
    };
    // What fits an angle of its own comes after what fits nothing.
    let in_order = [pairs(fixed), pairs(vec![Frame::Inertial]), pairs(vec![Frame::Turned])].concat();
    in_order.into_iter().find_map(|(written, frame)| {
        let (after, turn) = misses(written, frame)?;
        let after = median(after.into_iter());
        let what = describe(written, frame, &turn)?;
        explains(after).then(|| {
            let [before, after] = [before, after].map(f64::to_degrees);
            format!(
                "{what}: then the median distance of the limb from the attitude is {after:.2} deg instead of \
                     {before:.1} deg"
            )
        })
    })
}

/// The axis by the picture, the axis by attitude and position, both in the camera frame, the attitude, the axis from
/// outside, and the time.
type Pair = (Vector3<f64>, Vector3<f64>, UnitQuaternion<f64>, Vector3<f64>, f64);

/// Returns the angles between the limbs and what the attitudes say if a mistake is mended, with the rotation that the
/// mistake leaves open and the pictures show.
fn misses(all: &[Sighting], written: Written, frame: Frame, is_earth: bool) -> Option<(Vec<f64>, Matrix3<f64>)> {
    let mut both: Vec<Pair> = Vec::with_capacity(all.len());
    let mut between = (0.0, 0.0);
    for sighting in all {
        let told = rotation(written.meant(sighting.q_fixed_from_camera_wxyz))?;
        let position_km = Vector3::from(sighting.position_km);
        let down = down(if frame == Frame::NegatedPosition { -position_km } else { position_km }, is_earth)?;
        let seen = Vector3::from(sighting.axis).try_normalize(0.0)?;
        let expected = match frame {
            Frame::AsExpected | Frame::NegatedPosition | Frame::Turned => told.inverse() * down,
            Frame::Local { is_down } => told.inverse() * (Vector3::z() * if is_down { 1.0 } else { -1.0 }),
            Frame::Vehicle(mount) => (told * mount).inverse() * down,
            Frame::Inertial => {
                let turned = about_pole(-EARTH_RATE_RAD_S * sighting.time_s) * (told * seen);
                between.0 += turned.x * down.y - turned.y * down.x;
                between.1 += turned.x * down.x + turned.y * down.y;
                told.inverse() * (about_pole(EARTH_RATE_RAD_S * sighting.time_s) * down)
            }
        };
        both.push((seen, expected, told, down, sighting.time_s));
    }
    let turn = match frame {
        Frame::Inertial => about_pole(between.0.atan2(between.1)).into_inner(),
        Frame::Turned => rotation_between(both.iter().map(|(seen, expected, ..)| (*seen, *expected)))?,
        _ => Matrix3::identity(),
    };
    let miss = |(seen, expected, told, down, time_s): &Pair| match frame {
        Frame::Inertial => {
            let back = about_pole(EARTH_RATE_RAD_S * time_s) * (turn.transpose() * down);
            angle(seen, &(told.inverse() * back))
        }
        Frame::Turned => angle(seen, &(turn * expected)),
        _ => angle(seen, expected),
    };
    Some((both.iter().map(miss).collect(), turn))
}

/// Says what the mistake is; `None` if there is none.
fn describe(written: Written, frame: Frame, turn: &Matrix3<f64>) -> Option<String> {
    let quaternion = match written {
        Written::AsRead => None,
        Written::ScalarLast => Some("the quaternions have the scalar last (x, y, z, w): qw, qx, qy, qz is the order"),
        Written::Inverted => Some("the quaternions are inverted: from the camera to the fixed frame is expected"),
        Written::InvertedScalarLast => Some(
            "the quaternions are inverted and have the scalar last: from the camera to the fixed frame, as qw, qx, \
             qy, qz, is expected",
        ),
    };
    let frame = match frame {
        Frame::AsExpected => None,
        Frame::NegatedPosition => {
            Some("the positions have the opposite sign: from the body's centre to the camera is expected".to_owned())
        }
        Frame::Local { is_down } => {
            let axes = if is_down { "down, as north, east, down have it" } else { "up, as east, north, up have it" };
            Some(format!(
                "the attitudes are relative to local axes with z {axes}: relative to the body-fixed frame (ECEF) is \
                 expected"
            ))
        }
        Frame::Vehicle(_) => Some(
            "the attitudes are those of the vehicle: the camera's are expected, q_fixed_from_vehicle * \
             q_vehicle_from_camera"
                .to_owned(),
        ),
        Frame::Inertial => Some(format!(
            "one of attitude and position is relative to inertial axes (ECI), {:.0} deg away about the Earth's axis: \
             both are expected in the body-fixed frame (ECEF)",
            axis_and_angle(turn)?.1.abs().to_degrees()
        )),
        Frame::Turned => {
            let (axis, angle_rad) = axis_and_angle(turn)?;
            let [x, y, z]: [f64; 3] = axis.map(|x| (100.0 * x).round() / 100.0 + 0.0).into();
            Some(format!(
                "the attitudes are those of other axes on the vehicle, turned by {:.1} deg about the camera's axis \
                 ({x:.2}, {y:.2}, {z:.2}) in all pictures alike: are they those of the vehicle? The camera's are \
                 expected",
                angle_rad.to_degrees()
            ))
        }
    };
    let both: Vec<String> = quaternion.map(str::to_owned).into_iter().chain(frame).collect();
    (!both.is_empty()).then(|| both.join("; and "))
}

/// Returns the direction of the limb's axis from a position.
fn down(position_km: Vector3<f64>, is_earth: bool) -> Option<Vector3<f64>> {
    let from_cone = || LimbCone::try_new((position_km * 1e3).into(), WGS84_A_M, WGS84_B_M).map(|c| c.axis.xyz().into());
    if is_earth { from_cone() } else { (-position_km).try_normalize(0.0) }
}

fn rotation([w, x, y, z]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6)
}

fn about_pole(angle_rad: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), angle_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera that spins and looks at the limb of an orbit, with attitudes that are right to half a degree.
    fn flight() -> Vec<(UnitQuaternion<f64>, Vector3<f64>, Vector3<f64>)> {
        let one = |i: u32| {
            let t = 6.0 * f64::from(i);
            let orbit = Rotation3::from_euler_angles(0.9, 0.4, 1.3);
            let position = orbit * (Vector3::new((1.1e-3 * t).cos(), (1.1e-3 * t).sin(), 0.0) * 6780.0);
            let error =
                UnitQuaternion::from_scaled_axis(Vector3::new(t.sin(), (2.0 * t).cos(), (3.0 * t).sin()) * 5e-3);
            let attitude = UnitQuaternion::from_euler_angles(0.02 * t, 0.3 + 0.01 * t, -0.7 + 0.005 * t);
            let seen = attitude.inverse() * down(position, true).unwrap();
            (attitude * error, position, seen)
        };
        (0..20).map(one).collect()
    }

    /// Makes the quaternion and the position of a table from time, attitude and position.
    type Change<'a> = &'a dyn Fn(f64, UnitQuaternion<f64>, Vector3<f64>) -> ([f64; 4], Vector3<f64>);

    fn said(change: Change<'_>, mount: Option<[f64; 4]>) -> Option<String> {
        type Place = (UnitQuaternion<f64>, Vector3<f64>, Vector3<f64>);
        let sighting = |(i, (attitude, position, seen)): (u32, Place)| {
            let time_s = 6.0 * f64::from(i);
            let (q_fixed_from_camera_wxyz, position) = change(time_s, attitude, position);
            let (axis, position_km) = (seen.into(), position.into());
            Sighting { axis, sigma_rad: 0.01, time_s, q_fixed_from_camera_wxyz, position_km }
        };
        let all: Vec<Sighting> = (0..).zip(flight()).map(sighting).collect();
        find_attitude_convention(&all, mount, true)
    }

    fn wxyz(q: UnitQuaternion<f64>) -> [f64; 4] {
        [q.w, q.i, q.j, q.k]
    }

    #[test]
    fn common_conventions_are_named() {
        assert_eq!(said(&|_, q, p| (wxyz(q), p), None), None);
        let found = |change: Change<'_>| said(change, None).unwrap_or_default();
        assert!(found(&|_, q, p| ([q.i, q.j, q.k, q.w], p)).starts_with("the quaternions have the scalar last"));
        assert!(found(&|_, q, p| (wxyz(q.inverse()), p)).starts_with("the quaternions are inverted:"));
        assert!(found(&|_, q, p| (wxyz(q), -p)).starts_with("the positions have the opposite sign"));
        let both = found(&|_, q, p| {
            let q = q.inverse();
            ([q.i, q.j, q.k, q.w], p)
        });
        assert!(both.starts_with("the quaternions are inverted and have the scalar last"), "{both}");
        let turn = |t: f64| about_pole(1.1 + EARTH_RATE_RAD_S * t);
        let inertial = found(&|t, q, p| (wxyz(UnitQuaternion::from(turn(t)) * q), p));
        assert!(inertial.contains("inertial axes (ECI), 63 deg away"), "{inertial}");
        let inertial = found(&|t, q, p| (wxyz(q), turn(t) * p));
        assert!(inertial.contains("inertial axes (ECI)"), "{inertial}");
        let local = found(&|_, q, p| {
            let down = -p.normalize();
            let east = Vector3::z().cross(&p).normalize();
            let to_local = Matrix3::from_rows(&[east.cross(&down).transpose(), east.transpose(), down.transpose()]);
            (wxyz(UnitQuaternion::from_matrix(&to_local) * q), p)
        });
        assert!(local.contains("north, east, down"), "{local}");
    }

    #[test]
    fn the_vehicles_attitudes_are_named_with_and_without_the_mount() {
        let mount = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
        let vehicle = |_: f64, q: UnitQuaternion<f64>, p: Vector3<f64>| (wxyz(q * mount.inverse()), p);
        let known = said(&vehicle, Some(wxyz(mount))).unwrap();
        assert!(known.starts_with("the attitudes are those of the vehicle"), "{known}");
        let unknown = said(&vehicle, None).unwrap();
        // The told attitudes are half a degree off.
        let turn_deg: f64 = unknown.split("turned by ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((turn_deg - mount.angle().to_degrees()).abs() < 0.5, "{unknown}");
    }

    #[test]
    fn errors_without_a_simple_cause_are_not_explained() {
        let other = |t: f64, q: UnitQuaternion<f64>, p: Vector3<f64>| {
            (wxyz(q * UnitQuaternion::from_euler_angles(t * t, 0.7 * t, (t + 0.3).powi(3))), p)
        };
        assert_eq!(said(&other, None), None);
    }
}
