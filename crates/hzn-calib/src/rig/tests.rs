use hzn_core::frames::{Cam, Cov3, UnitVec3};
use hzn_core::report::Free;
use nalgebra::{Matrix3, Rotation3, UnitVector3, Vector3};

use super::*;
use crate::draws::Draws;

/// Half-angle of the limb from 500 km, and its distance from the centre of the Earth.
const HALF_ANGLE_RAD: f64 = 1.19;
const RADIUS_KM: f64 = 6396.0;
/// Half of the azimuth that a head of 60 degrees sees of the limb.
const HALF_ARC_RAD: f64 = 0.55;
/// 1-sigma of the edge, for parts of the arc that do not depend on each other: 0.02 degrees.
const EDGE_RAD: f64 = 3.5e-4;

fn settings(told: Vec<Rotation3<f64>>) -> Settings {
    let own_sigma_km = vec![1.5; told.len()];
    Settings { told, prior_rad: 5f64.to_radians(), own_sigma_km, radius_km: RADIUS_KM, independent: 1.0 }
}

/// Heads around the vehicle's z axis, of which each looks at the limb.
fn ring(heads: usize) -> Vec<Rotation3<f64>> {
    let mount = |k: usize| {
        let azimuth = std::f64::consts::TAU * k as f64 / heads as f64;
        Rotation3::from_axis_angle(&Vector3::z_axis(), azimuth)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), HALF_ANGLE_RAD)
    };
    (0..heads).map(mount).collect()
}

fn rotation(rng: &mut Draws, sigma_rad: f64) -> Rotation3<f64> {
    Rotation3::new(Vector3::from_fn(|_, _| sigma_rad * rng.normal()))
}

/// Draws what a head with this mount sees of a body in the direction `e`, whose half-angle has the cosine `cos`.
fn see(rng: &mut Draws, mount: &Rotation3<f64>, e: &Vector3<f64>, cos: f64) -> Free<f64> {
    let e = mount.inverse() * e;
    let [b1, b2] = epoch::tangent(&e);
    // The middle of the arc is the part of the limb that is nearest to the optical axis.
    let middle = b2.z.atan2(b1.z);
    let sin = HALF_ANGLE_RAD.sin();
    let (mut information, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for n in -12..=12 {
        let psi = middle + f64::from(n) / 12.0 * HALF_ARC_RAD;
        let h = Vector3::new(sin * psi.cos(), sin * psi.sin(), -1.0) / (EDGE_RAD * sin);
        information += h * h.transpose();
        right += h * rng.normal();
    }
    let covariance = information.try_inverse().unwrap();
    let error = covariance * right;
    let axis = (e + b1 * error.x + b2 * error.y).normalize();
    let b = [b1, b2];
    let mut upper = Matrix3::zeros();
    for (i, bi) in b.iter().enumerate() {
        for (j, bj) in b.iter().enumerate() {
            upper += bi * bj.transpose() * covariance[(i, j)];
        }
    }
    let with_cos = b1 * covariance.m13 + b2 * covariance.m23;
    Free {
        axis: UnitVec3::<Cam, f64>::try_new(axis.into()).unwrap(),
        covariance: Cov3::from_upper([upper.m11, upper.m12, upper.m13, upper.m22, upper.m23, upper.m33]),
        cos: cos + error.z,
        var_cos: covariance.m33,
        axis_with_cos: Some(with_cos.into()),
        cos_per_px: 1e-3,
        common: None,
    }
}

/// Draws a flight: the vehicle tilts by up to `tilt_rad` about changing axes, and the limb height changes.
fn flight(rng: &mut Draws, mounts: &[Rotation3<f64>], epochs: usize, tilt_rad: f64) -> Vec<Epoch> {
    let mut epoch = |i: usize| -> Epoch {
        let azimuth = 2.4 * i as f64;
        let axis = UnitVector3::new_normalize(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0));
        let e = Rotation3::from_axis_angle(&axis, tilt_rad * (i as f64 / epochs as f64).sqrt()) * Vector3::z();
        let cos = HALF_ANGLE_RAD.cos() + 2e-3 * rng.normal();
        mounts.iter().map(|mount| Sighting::new(&see(rng, mount, &e, cos), Rotation3::identity())).collect()
    };
    (0..epochs).map(&mut epoch).collect()
}

/// Returns the error of the mount of head `k` relative to head `to`, as a turn of the told mounts.
fn error(adjusted: &Adjusted, told: &[Rotation3<f64>], truth: &[Rotation3<f64>], k: usize, to: usize) -> Vector3<f64> {
    let turn = |k: usize| (truth[k] * told[k].inverse()).scaled_axis();
    adjusted.relative(k, to).0 - (turn(k) - turn(to))
}

#[test]
fn relative_mounts_are_within_three_sigmas_over_flights_that_turn() {
    let mut rng = Draws(11);
    let told = ring(4);
    let (mut within, mut all, mut squares, mut largest) = (0, 0, 0.0, 0f64);
    for _ in 0..300 {
        let truth: Vec<_> = told.iter().map(|mount| rotation(&mut rng, 0.004) * mount).collect();
        let epochs = flight(&mut rng, &truth, 40, 0.4);
        let adjusted = adjust(&settings(told.clone()), &epochs).unwrap();
        for k in 1..4 {
            let (_, covariance) = adjusted.relative(k, 0);
            let error = error(&adjusted, &told, &truth, k, 0);
            squares += error.dot(&(covariance.try_inverse().unwrap() * error));
            for (axis, sigma_rad, is_determined) in adjusted.axes(k) {
                assert!(is_determined);
                largest = largest.max(sigma_rad.to_degrees());
                all += 1;
                within += u32::from(error.dot(&axis).abs() <= 3.0 * sigma_rad);
            }
        }
    }
    let nees = squares / 900.0;
    assert!(within * 1000 >= all * 990, "{within} of {all} within 3 sigma");
    assert!((2.0..4.0).contains(&nees) && largest < 0.02, "NEES {nees}, largest sigma {largest} degrees");
}

#[test]
fn a_turn_about_the_direction_to_the_earth_is_not_determined_while_the_vehicle_keeps_it() {
    let mut rng = Draws(5);
    let told = ring(3);
    let epochs = flight(&mut rng, &told, 30, 0.0);
    let adjusted = adjust(&settings(told.clone()), &epochs).unwrap();
    let axes = adjusted.axes(1);
    let lost: Vec<_> = axes.iter().filter(|(_, _, is_determined)| !is_determined).collect();
    assert_eq!(lost.len(), 1, "{axes:?}");
    assert!(lost[0].0.z.abs() > 0.99, "{axes:?}");
    // The file says so: a block has the whole sigma of the prior about this axis, and little about the others.
    let block = adjusted.block(1);
    assert!(block.m33.sqrt() > 3f64.to_radians() && block.m11.sqrt() < 0.2f64.to_radians(), "{block}");
}

#[test]
fn mounts_that_are_wrong_by_ten_degrees_are_found_and_wrong_answers_do_not_count() {
    let mut rng = Draws(3);
    let told = ring(2);
    let turned = Rotation3::new(Vector3::new(0.1, -0.12, 0.08));
    let truth = vec![told[0], turned * told[1]];
    let mut epochs = flight(&mut rng, &truth, 60, 0.5);
    // In a tenth of the epochs, a head has taken another edge for the limb.
    for epoch in epochs.iter_mut().step_by(10) {
        let edge = Rotation3::new(Vector3::new(0.3, 0.2, 0.0)) * Vector3::z();
        let ghost = see(&mut rng, &truth[1], &edge, 0.37);
        epoch[1] = Sighting::new(&ghost, Rotation3::identity());
    }
    let wide = Settings { prior_rad: 20f64.to_radians(), ..settings(told.clone()) };
    let adjusted = adjust(&wide, &epochs).unwrap();
    assert_eq!(adjusted.epochs, [54, 6]);
    let relative = |mounts: &[Rotation3<f64>]| mounts[0].inverse() * mounts[1];
    let error = (relative(&adjusted.mounts).inverse() * relative(&truth)).angle().to_degrees();
    assert!(error < 0.3, "{error}");
}

#[test]
fn a_head_that_has_turned_is_named_by_the_others() {
    let mut rng = Draws(9);
    let told = ring(4);
    let told_rad2 = vec![Matrix3::identity() * 0.02f64.to_radians().powi(2); 4];
    let (mut held, mut named) = (0, 0);
    for flight_number in 0..20 {
        let real: Vec<_> = told.iter().map(|mount| rotation(&mut rng, 0.02f64.to_radians()) * mount).collect();
        let good = adjust(&settings(told.clone()), &flight(&mut rng, &real, 40, 0.3)).unwrap();
        held += u32::from(matches!(check(&good, &told_rad2), Check::Holds(_)));
        let which = flight_number % 4;
        let mut turned = real.clone();
        turned[which] = Rotation3::new(Vector3::new(0.0, 0.6f64.to_radians(), 0.0)) * real[which];
        let bad = adjust(&settings(told.clone()), &flight(&mut rng, &turned, 40, 0.3)).unwrap();
        let angle_fits = |angle: f64, sigma: f64| (angle - 0.6f64.to_radians()).abs() < 4.0 * sigma;
        named += u32::from(matches!(check(&bad, &told_rad2), Check::Turned(k, a, s) if k == which && angle_fits(a, s)));
    }
    assert!(held >= 19 && named >= 18, "{held} held, {named} named");
}

/// What a check could have seen is a part of its answer. A turn of 1.5 times that is found in nearly all cases, and a
/// direction that the flight does not determine does not hide it.
#[test]
fn the_turns_that_are_said_to_be_noticed_are_noticed() {
    let mut rng = Draws(23);
    for heads in [2, 3] {
        let told = ring(heads);
        let told_rad2 = vec![Matrix3::identity() * 0.1f64.to_radians().powi(2); heads];
        let mut found = 0;
        for number in 0..20 {
            let good = adjust(&settings(told.clone()), &flight(&mut rng, &told, 15, 0.3)).unwrap();
            assert_eq!(check(&good, &told_rad2), Check::Holds(true), "a right rig");
            // The axis of the camera about which the flight says most, and the next one.
            let mut axes: Vec<(f64, Vector3<f64>)> =
                noticed(&good, &told_rad2)[1].into_iter().zip([Vector3::x(), Vector3::y(), Vector3::z()]).collect();
            axes.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (noticed_rad, axis) = axes[number % 2];
            assert!(noticed_rad > 0.2f64.to_radians() && noticed_rad < 0.2, "{axes:?}");
            let mut turned = told.clone();
            turned[1] = told[1] * Rotation3::new(axis * (1.5 * noticed_rad));
            let bad = adjust(&settings(told.clone()), &flight(&mut rng, &turned, 15, 0.3));
            found += u32::from(!bad.is_ok_and(|bad| matches!(check(&bad, &told_rad2), Check::Holds(_))));
        }
        assert!(found >= 19, "{found} of 20 with {heads} heads");
    }
}

#[test]
fn two_heads_do_not_say_which_of_them_has_turned() {
    let mut rng = Draws(2);
    let told = ring(2);
    let truth = vec![told[0], Rotation3::new(Vector3::new(0.0, 0.02, 0.0)) * told[1]];
    let adjusted = adjust(&settings(told.clone()), &flight(&mut rng, &truth, 40, 0.3)).unwrap();
    let told_rad2 = vec![Matrix3::identity() * 1e-8; 2];
    assert_eq!(check(&adjusted, &told_rad2), Check::Contradict);
}

/// The worse a mount is, the fewer epochs agree with any mount near it: this is no sign that it holds.
#[test]
fn mounts_far_from_the_told_ones_are_found_or_refused() {
    let mut rng = Draws(12);
    let relative = |mounts: &[Rotation3<f64>]| mounts[0].inverse() * mounts[1];
    for degrees in [25.0, 40.0, 90.0, 120.0, 180.0] {
        for heads in [2, 3, 4] {
            let told = ring(heads);
            let mut truth = told.clone();
            truth[1] = Rotation3::new(Vector3::new(0.0, f64::to_radians(degrees), 0.0)) * told[1];
            match adjust(&settings(told), &flight(&mut rng, &truth, 40, 0.3)) {
                Ok(found) => {
                    let error = (relative(&found.mounts).inverse() * relative(&truth)).angle().to_degrees();
                    assert!(error < 0.5, "{degrees} degrees, {heads} heads: {error}");
                }
                Err(Refused::Contradict { head, .. }) => assert!(head.is_none_or(|k| k == 1 && heads > 2)),
                Err(Refused::NoConvergence) => {}
                Err(other) => panic!("{degrees} degrees, {heads} heads: {other}"),
            }
        }
    }
}

/// A head with the pictures of another flight.
#[test]
fn epochs_that_contradict_each_other_are_refused() {
    let mut rng = Draws(13);
    let told = ring(3);
    let mut epochs = flight(&mut rng, &told, 40, 0.4);
    for (epoch, other) in epochs.iter_mut().zip(flight(&mut rng, &told, 40, 0.4)) {
        epoch[2] = other[2].clone();
    }
    let why = adjust(&settings(told), &epochs).unwrap_err();
    assert!(matches!(why, Refused::Contradict { head: Some(2), .. }), "{why:?}");
    assert!(why.to_string().contains("without head 3 the others agree"), "{why}");
}

#[test]
fn flights_that_tell_nothing_are_refused() {
    let mut rng = Draws(4);
    let told = ring(3);
    let refused = |epochs: &[Epoch]| adjust(&settings(told.clone()), epochs).unwrap_err();
    let mut epochs = flight(&mut rng, &told, 10, 0.3);
    assert_eq!(refused(&epochs[..3]), Refused::TooFew(3));
    epochs.iter_mut().for_each(|epoch| epoch[2] = None);
    assert_eq!(refused(&epochs), Refused::Alone(2));
}

#[test]
fn a_late_head_is_turned_to_the_epoch() {
    let mut rng = Draws(6);
    let told = ring(2);
    let late = Rotation3::new(Vector3::new(0.0, 0.03, 0.01));
    let mut epochs = flight(&mut rng, &told, 30, 0.3);
    for (i, epoch) in epochs.iter_mut().enumerate() {
        let azimuth = 2.4 * i as f64;
        let axis = UnitVector3::new_normalize(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0));
        let e = Rotation3::from_axis_angle(&axis, 0.3) * Vector3::z();
        // In the axes that the rig had when the picture was taken, the direction was another one.
        let before = late.inverse() * e;
        epoch[0] = Sighting::new(&see(&mut rng, &told[0], &e, 0.37), Rotation3::identity());
        epoch[1] = Sighting::new(&see(&mut rng, &told[1], &before, 0.37), late);
    }
    let adjusted = adjust(&settings(told.clone()), &epochs).unwrap();
    let (turn, covariance) = adjusted.relative(1, 0);
    assert!(turn.dot(&(covariance.try_inverse().unwrap() * turn)) < 16.0, "{turn}");
}
