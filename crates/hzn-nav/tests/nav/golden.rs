//! Attitude from directions and the Jacobians of the filter against reference data (tests/data/README.md).

use hzn_nav::filter::predict_direction;
use hzn_nav::vectors::{Direction, davenport, triad};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;

fn load(text: &str) -> Vec<Value> {
    let all: Value = serde_json::from_str(text).unwrap();
    all["cases"].as_array().unwrap().clone()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_iterator(value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()))
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_row_iterator(
        value.as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap()).map(|x| x.as_f64().unwrap()),
    )
}

fn rotation(value: &Value) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix(value)))
}

#[test]
fn triad_and_wahba_equal_the_reference() {
    let cases = load(include_str!("../data/triad.json"));
    assert!(cases.len() > 5);
    for case in cases {
        let pair = |n: &str, sigma_rad| Direction {
            body: vector(&case[format!("b{n}")]),
            reference: vector(&case[format!("e{n}")]),
            sigma_rad,
        };
        let (first, second) = (pair("1", 1e-3), pair("2", 1e-3));
        if case["separation_deg"].as_f64().unwrap() < 2.0 {
            assert!(triad(&first, &second).is_none() && davenport(&[first, second]).is_none(), "{}", case["id"]);
            continue;
        }
        let found = triad(&first, &second).unwrap().to_rotation_matrix().into_inner();
        let error = (found - matrix(&case["R_eb_triad_primary_1"])).norm();
        assert!(error < 1e-12, "{}: {error}", case["id"]);
        let found = davenport(&[first, second]).unwrap().attitude.to_rotation_matrix().into_inner();
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
        let (x, sun) = (vector(&case["x_ecef_m"]), vector(&case["sun_ecef_m"]));
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
    let at = |body: [f64; 3], reference: [f64; 3]| Direction {
        body: Vector3::from(body),
        reference: Vector3::from(reference),
        sigma_rad: 1e-3,
    };
    let one = at([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let near = at([1.0, 0.01, 0.0], [0.0, 1.0, 0.01]);
    let opposite = at([-1.0, 0.01, 0.0], [0.0, -1.0, 0.01]);
    for other in [one, near, opposite, at([0.0; 3], [1.0, 0.0, 0.0]), at([f64::NAN, 0.0, 1.0], [1.0, 0.0, 0.0])] {
        assert!(triad(&one, &other).is_none(), "{other:?}");
        assert!(davenport(&[one, other]).is_none(), "{other:?}");
    }
    assert!(davenport(&[one]).is_none() && davenport(&[]).is_none());
    assert!(triad(&one, &at([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])).is_some());
}

/// The covariance of Wahba's problem is that of the errors.
#[test]
fn wahba_is_honest() {
    let truth = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
    let references = [
        Vector3::new(0.0, 0.0, 1.0),
        Vector3::new(0.8, 0.1, 0.5).normalize(),
        Vector3::new(-0.3, 0.9, 0.2).normalize(),
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
                let noise = Vector3::from_fn(|_, _| sigma_rad * draws.normal());
                let seen = UnitQuaternion::from_scaled_axis(noise) * reference;
                Direction { body: truth.inverse() * seen, reference: *reference, sigma_rad }
            })
            .collect();
        let found = davenport(&directions).unwrap();
        let error = (truth * found.attitude.inverse()).scaled_axis();
        nees += (error.transpose() * found.covariance_rad2.try_inverse().unwrap() * error)[(0, 0)] / f64::from(runs);
        chi2 += found.chi2 / f64::from(runs);
    }
    assert!((2.8..3.2).contains(&nees), "{nees}");
    // Three directions have six numbers, less three of the attitude.
    assert!((2.8..3.2).contains(&chi2), "{chi2}");
}
