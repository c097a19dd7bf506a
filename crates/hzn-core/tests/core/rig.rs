//! Several heads: the joint cone, its covariance, and the check, on drawn errors.

use hzn_core::frames::{Cam, Cov3, Rotation, UnitVec3, Vehicle};
use hzn_core::report::Free;
use hzn_core::rig::{Config, Head, Joint, NoJoint, Rig};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::dice::Dice;

mod groups;
mod shared;

/// Half-angle of the Earth's limb from 500 km.
const HALF_ANGLE_RAD: f64 = 1.19;
/// Half of the arc that a head of 60 degrees sees, in azimuth about the direction to the body.
const HALF_ARC_RAD: f64 = 0.55;
/// 1-sigma of a cone's edge, for arcs that do not depend on each other: 0.02 degrees.
const EDGE_RAD: f64 = 3.5e-4;

/// A head and what it can see: the rotation of its mount, and the covariance of its cone on (δ₁, δ₂, δc).
struct Camera {
    vehicle_from_camera: UnitQuaternion<f64>,
    covariance: Matrix3<f64>,
}

fn unit<F>(v: Vector3<f64>) -> UnitVec3<F, f64> {
    UnitVec3::try_new(v.into()).expect("not of length zero")
}

fn rotation<A, B>(q: &UnitQuaternion<f64>) -> Rotation<A, B, f64> {
    Rotation::assume_from_quaternion([q.w, q.i, q.j, q.k]).expect("a rotation")
}

/// Returns the tangent basis at `e`, for which any rotation about `e` will do.
fn tangent(e: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let b1 = e.cross(&Vector3::new(0.31, -0.62, 0.72)).normalize();
    [b1, e.cross(&b1)]
}

/// Returns a head that looks at the limb at an azimuth (degrees) about the vehicle's z axis, at which the body is.
fn camera(azimuth_deg: f64) -> Camera {
    let azimuth = Rotation3::from_axis_angle(&Vector3::z_axis(), azimuth_deg.to_radians());
    let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), HALF_ANGLE_RAD);
    let vehicle_from_camera = UnitQuaternion::from_rotation_matrix(&(azimuth * tilt));
    let e = vehicle_from_camera.inverse() * Vector3::z();
    let [b1, b2] = tangent(&e);
    let mut information = Matrix3::zeros();
    const ARCS: i32 = 12;
    for n in -ARCS..=ARCS {
        let along = azimuth_deg.to_radians() + f64::from(n) / f64::from(ARCS) * HALF_ARC_RAD;
        let (sin, cos) = HALF_ANGLE_RAD.sin_cos();
        let ray = vehicle_from_camera.inverse() * Vector3::new(sin * along.cos(), sin * along.sin(), cos);
        let h = Vector3::new(ray.dot(&b1), ray.dot(&b2), -1.0) / (EDGE_RAD * sin);
        information += h * h.transpose();
    }
    Camera { vehicle_from_camera, covariance: information.try_inverse().expect("an arc determines a cone") }
}

impl Camera {
    /// Draws what the head sees of a body in the direction z whose half-angle has the cosine `cos`. The mount is turned
    /// by `turned_rad` about the vehicle's axes, which nobody is told.
    fn see(&self, dice: &mut Dice, cos: f64, turned_rad: Vector3<f64>) -> Free<f64> {
        let true_e = self.vehicle_from_camera.inverse() * (Rotation3::new(-turned_rad) * Vector3::z());
        let basis = tangent(&(self.vehicle_from_camera.inverse() * Vector3::z()));
        let root = self.covariance.cholesky().expect("positive definite").l();
        let error = root * Vector3::new(dice.normal(), dice.normal(), dice.normal());
        let p = &self.covariance;
        let mut covariance = Matrix3::zeros();
        for (i, a) in basis.iter().enumerate() {
            for (j, b) in basis.iter().enumerate() {
                covariance += a * b.transpose() * p[(i, j)];
            }
        }
        let at = |i: usize, j: usize| covariance[(i, j)];
        Free {
            axis: unit::<Cam>(true_e + basis[0] * error.x + basis[1] * error.y),
            covariance: Cov3::from_upper([at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)]),
            cos: cos + error.z,
            var_cos: p.m33,
            axis_with_cos: Some((basis[0] * p.m13 + basis[1] * p.m23).into()),
            cos_per_px: 1e-3,
            common: None,
        }
    }

    fn head(&self, free: &Free<f64>, mount_sigma_rad: f64) -> Option<Head<f64>> {
        let var = mount_sigma_rad * mount_sigma_rad;
        Head::new(free, &rotation(&self.vehicle_from_camera), &[var, 0.0, 0.0, var, 0.0, var], 0.0)
    }
}

fn cameras(azimuths_deg: &[f64]) -> Vec<Camera> {
    azimuths_deg.iter().map(|&a| camera(a)).collect()
}

/// Draws one epoch, in which head 0 is turned by `turned_rad`. The half-angle is drawn from a wide range.
fn epoch(cameras: &[Camera], dice: &mut Dice, turned_rad: Vector3<f64>) -> Vec<Option<Head<f64>>> {
    let cos = HALF_ANGLE_RAD.cos() + 0.01 * dice.normal();
    let turn = |k: usize| if k == 0 { turned_rad } else { Vector3::zeros() };
    cameras.iter().enumerate().map(|(k, c)| c.head(&c.see(dice, cos, turn(k)), 0.0)).collect()
}

fn rig(false_alarm: f64, misleading: f64) -> Rig<f64> {
    Rig::new(&Config { false_alarm, misleading }).expect("probabilities")
}

fn error_rad(joint: &Joint<f64>) -> f64 {
    joint.axis.angle_rad(&unit::<Vehicle>(Vector3::z()))
}

fn nees(joint: &Joint<f64>) -> f64 {
    let [x, y, _] = joint.axis.xyz();
    let [xx, xy, _, yy, ..] = joint.covariance.upper_rad2;
    (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
}

#[test]
fn opposite_heads_need_no_altitude_and_have_an_honest_covariance() {
    let rig = rig(1e-9, 1e-4);
    for (azimuths_deg, most_deg) in [(&[0.0, 180.0][..], 0.02), (&[0.0, 90.0, 180.0, 270.0][..], 0.012)] {
        let (cameras, mut dice) = (cameras(azimuths_deg), Dice::new(11));
        let (mut sum_nees, mut sum_rad2, trials) = (0.0, 0.0, 4000);
        for _ in 0..trials {
            let joint = rig.join(&epoch(&cameras, &mut dice, Vector3::zeros()), 0.0).unwrap();
            sum_nees += nees(&joint);
            sum_rad2 += error_rad(&joint).powi(2);
        }
        let (nees, rms_deg) = (sum_nees / f64::from(trials), (sum_rad2 / f64::from(trials)).sqrt().to_degrees());
        assert!((nees - 2.0).abs() < 0.1, "{azimuths_deg:?}: NEES {nees}");
        assert!(rms_deg < most_deg, "{azimuths_deg:?}: {rms_deg} deg");
    }
}

#[test]
fn good_heads_alarm_as_often_as_allowed() {
    let rig = rig(1e-2, 1e-4);
    for (azimuths_deg, least) in [(&[0.0, 180.0][..], 0.002), (&[0.0, 90.0, 180.0, 270.0][..], 0.004)] {
        let (cameras, mut dice, trials) = (cameras(azimuths_deg), Dice::new(5), 8000);
        let is_alarm = |heads: &[Option<Head<f64>>]| !rig.join(heads, 0.0).is_ok_and(|j| j.heads_excluded == 0);
        let alarms = (0..trials).filter(|_| is_alarm(&epoch(&cameras, &mut dice, Vector3::zeros()))).count();
        let share = alarms as f64 / f64::from(trials);
        assert!(share > least && share < 0.0125, "{azimuths_deg:?}: {share}");
    }
}

#[test]
fn a_turned_head_of_four_is_noticed_and_no_other_one_is_excluded() {
    let rig = rig(1e-3, 1e-4);
    let (cameras, mut dice, trials) = (cameras(&[0.0, 90.0, 180.0, 270.0]), Dice::new(7), 1000);
    let (mut noticed, mut right, mut wrong) = (0, 0, 0);
    for _ in 0..trials {
        // The turn about y moves the edge of head 0 across the limb.
        let heads = epoch(&cameras, &mut dice, Vector3::new(0.0, 0.4f64.to_radians(), 0.0));
        match rig.join(&heads, 0.0) {
            Ok(joint) if joint.heads_excluded == 0 => {}
            Ok(joint) => {
                noticed += 1;
                right += u32::from(joint.heads_excluded == 0b0001);
                wrong += u32::from(joint.heads_excluded != 0b0001);
            }
            Err(reason) => {
                assert_eq!(reason, NoJoint::Inconsistent);
                noticed += 1;
            }
        }
    }
    assert!(noticed >= 990, "noticed {noticed}");
    assert!(right >= 950, "right {right}");
    assert!(wrong <= 5, "wrong {wrong}");
}

#[test]
fn errors_stay_within_the_protection_level_whatever_one_head_does() {
    let rig = rig(1e-3, 1e-2);
    for azimuths_deg in [&[0.0, 120.0, 240.0][..], &[0.0, 90.0, 180.0, 270.0][..]] {
        let (cameras, mut dice) = (cameras(azimuths_deg), Dice::new(3));
        let (mut answers, mut beyond) = (0, 0);
        for trial in 0..6000 {
            let size = 0.05 * 40f64.powf(f64::from(trial % 20) / 19.0);
            let axis = Vector3::new(dice.normal(), dice.normal(), dice.normal()).normalize();
            let heads = epoch(&cameras, &mut dice, axis * size.to_radians());
            let Ok(joint) = rig.join(&heads, 0.0) else { continue };
            answers += 1;
            beyond += u32::from(error_rad(&joint) > joint.protection_rad.expect("several heads"));
        }
        assert!(answers > 1000, "{answers} answers");
        assert!(f64::from(beyond) <= 0.01 * f64::from(answers), "{azimuths_deg:?}: {beyond} of {answers}");
    }
}

#[test]
fn two_heads_notice_a_fault_and_do_not_name_it() {
    let cameras = cameras(&[0.0, 180.0]);
    let heads = epoch(&cameras, &mut Dice::new(1), Vector3::new(0.05, 0.0, 0.0));
    assert_eq!(rig(1e-3, 1e-4).join(&heads, 0.0).unwrap_err(), NoJoint::Inconsistent);
}

#[test]
fn one_head_gives_its_own_cone() {
    let (cameras, mut dice) = (cameras(&[40.0, 220.0]), Dice::new(2));
    let mut heads = epoch(&cameras, &mut dice, Vector3::zeros());
    heads[0] = None;
    let joint = rig(1e-3, 1e-4).join(&heads, 0.0).unwrap();
    assert!(joint.axis.angle_rad(&heads[1].unwrap().axis()) < 1e-15);
    assert_eq!((joint.heads_used, joint.heads_excluded), (0b10, 0));
    assert!(joint.separation_rad.is_none() && joint.protection_rad.is_none());
    assert_eq!(rig(1e-3, 1e-4).join(&[None::<Head<f64>>; 4], 0.0).unwrap_err(), NoJoint::NoHead);
}

#[test]
fn errors_of_the_mounts_are_in_the_covariance() {
    let (cameras, mut dice, trials) = (cameras(&[0.0, 180.0]), Dice::new(8), 3000);
    let (rig, sigma_rad) = (rig(1e-9, 1e-4), 0.05f64.to_radians());
    let mut sum = 0.0;
    for _ in 0..trials {
        let cos = HALF_ANGLE_RAD.cos() + 0.01 * dice.normal();
        let mut turn = || Vector3::new(dice.normal(), dice.normal(), dice.normal()) * sigma_rad;
        let turns = [turn(), turn()];
        let heads: Vec<_> =
            cameras.iter().zip(turns).map(|(c, t)| c.head(&c.see(&mut dice, cos, t), sigma_rad)).collect();
        sum += nees(&rig.join(&heads, 0.0).unwrap());
    }
    let nees = sum / f64::from(trials);
    assert!((nees - 2.0).abs() < 0.12, "NEES {nees}");
}

#[test]
fn a_tilt_that_all_heads_share_widens_the_answer() {
    let cameras = cameras(&[0.0, 90.0, 180.0, 270.0]);
    let heads = epoch(&cameras, &mut Dice::new(4), Vector3::zeros());
    let rig = rig(1e-3, 1e-4);
    let (exact, tilted) = (rig.join(&heads, 0.0).unwrap(), rig.join(&heads, 4e-4).unwrap());
    assert_eq!(exact.axis, tilted.axis);
    let grown = tilted.covariance.sigma_max_rad().powi(2) - exact.covariance.sigma_max_rad().powi(2);
    assert!((grown - 1.6e-7).abs() < 1e-12);
    assert!(tilted.protection_rad > exact.protection_rad);
}

#[test]
fn probabilities_outside_of_their_range_are_refused_by_name() {
    for bad in [0.0, 1.0, f64::NAN] {
        let error = Rig::<f64>::new(&Config { misleading: bad, ..Config::default() }).unwrap_err();
        assert_eq!(error.field, "rig.misleading");
    }
}
