//! Attitude from directions and the Jacobians of the filter against reference data (tests/data/README.md).

use hzn_nav::filter::predict_direction;
use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use hzn_nav::vectors::{Direction, davenport, triad};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use serde_json::Value;

fn load(text: &str) -> Vec<Value> {
    let all: Value = serde_json::from_str(text).unwrap();
    all["cases"].as_array().unwrap().clone()
}

fn vector<F>(value: &Value) -> Vector<F> {
    core::array::from_fn(|i| value[i].as_f64().unwrap()).into()
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_row_iterator(
        value.as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap()).map(|x| x.as_f64().unwrap()),
    )
}

fn rotation<A, B>(value: &Value) -> Rotation<A, B> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix(value))).into()
}

#[test]
fn triad_and_wahba_equal_the_reference() {
    let cases = load(include_str!("../data/triad.json"));
    assert!(cases.len() > 5);
    for case in cases {
        let pair = |n: &str, sigma_rad| Direction::<Vehicle, Fixed> {
            vehicle: vector(&case[format!("b{n}")]),
            reference: vector(&case[format!("e{n}")]),
            sigma_rad,
        };
        let (first, second) = (pair("1", 1e-3), pair("2", 1e-3));
        if case["separation_deg"].as_f64().unwrap() < 2.0 {
            assert!(triad(&first, &second).is_none() && davenport(&[first, second]).is_none(), "{}", case["id"]);
            continue;
        }
        let found = triad(&first, &second).unwrap().to_matrix();
        let error = (found - matrix(&case["R_eb_triad_primary_1"])).norm();
        assert!(error < 1e-12, "{}: {error}", case["id"]);
        let found = davenport(&[first, second]).unwrap().attitude.to_matrix();
        let error = (found - matrix(&case["R_eb_wahba_equal"])).norm();
        assert!(error < 1e-11, "{}: {error}", case["id"]);
    }
}

#[test]
fn jacobians_equal_the_reference() {
    let cases = load(include_str!("../data/nav_jacobians.json"));
    assert_eq!(cases.len(), 6);
    for case in cases {
        let (mount, attitude) = (rotation(&case["R_bc"]), rotation(&case["R_eb"]));
        let (x, sun): (Vector<Fixed>, Vector<Fixed>) = (vector(&case["x_ecef_m"]), vector(&case["sun_ecef_m"]));
        for (name, reference) in [("hor", -x.normalize()), ("sun", (sun - x).normalize())] {
            let (predicted, by_attitude, by_mount) = predict_direction(&attitude, &mount, &reference);
            let close = |a: f64, what: &str| assert!(a < 1e-8, "{name} {what}: {a}");
            close((predicted - vector(&case[format!("e_c_{name}")])).norm(), "direction");
            close((by_attitude - matrix(&case[format!("J_{name}_att")])).amax(), "attitude");
            close((by_mount - matrix(&case[format!("J_{name}_misalign_c")])).amax(), "misalignment");
        }
    }
}

#[test]
fn what_does_not_determine_an_attitude_is_refused() {
    let at = |vehicle: [f64; 3], reference: [f64; 3]| Direction::<Vehicle, Fixed> {
        vehicle: vehicle.into(),
        reference: reference.into(),
        sigma_rad: 1e-3,
    };
    let one = at([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let near = at([1.0, 0.01, 0.0], [0.0, 1.0, 0.01]);
    let opposite = at([-1.0, 0.01, 0.0], [0.0, -1.0, 0.01]);
    for other in [one, near, opposite, at([0.0; 3], [1.0, 0.0, 0.0]), at([f64::NAN, 0.0, 1.0], [1.0, 0.0, 0.0])] {
        assert!(triad(&one, &other).is_none(), "{other:?}");
        assert!(davenport(&[one, other]).is_none(), "{other:?}");
    }
    assert!(davenport(&[one]).is_none() && davenport::<Vehicle, Fixed>(&[]).is_none());
    assert!(triad(&one, &at([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])).is_some());
}

/// The covariance of Wahba's problem is that of the errors.
#[test]
fn wahba_is_honest() {
    let truth = Rotation::<Vehicle, Fixed>::from(UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0));
    let references = [
        Vector::<Fixed>::new(0.0, 0.0, 1.0),
        Vector::new(0.8, 0.1, 0.5).normalize(),
        Vector::new(-0.3, 0.9, 0.2).normalize(),
    ];
    let sigmas = [1e-3, 4e-3, 2e-3];
    let mut draws = crate::common::Draws(7);
    let (mut nees, mut chi2) = (0.0, 0.0);
    let runs = 2000;
    for _ in 0..runs {
        let directions: Vec<Direction> = references
            .iter()
            .zip(sigmas)
            .map(|(reference, sigma_rad)| {
                let noise = draws.vector(sigma_rad);
                let seen = Rotation::from_scaled_axis(noise) * *reference;
                Direction { vehicle: truth.inverse() * seen, reference: *reference, sigma_rad }
            })
            .collect();
        let found = davenport(&directions).unwrap();
        let error = (truth * found.attitude.inverse()).scaled_axis().into_inner();
        let information = found.covariance_rad2.as_inner().try_inverse().unwrap();
        nees += (error.transpose() * information * error)[(0, 0)] / f64::from(runs);
        chi2 += found.chi2 / f64::from(runs);
    }
    assert!((2.8..3.2).contains(&nees), "{nees}");
    // Three directions have six numbers, less three of the attitude.
    assert!((2.8..3.2).contains(&chi2), "{chi2}");
}
