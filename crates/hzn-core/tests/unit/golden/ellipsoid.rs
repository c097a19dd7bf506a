//! Compares the limb of the ellipsoid with SPICE.

use super::*;

/// Compares with `limb_ellipsoid.json`, which comes from SPICE.
fn limb_cone<T: Real>(tolerance_deg: f64) {
    for case in load(include_str!("../../golden/limb_ellipsoid.json")) {
        let d = num(&case["atmosphere_d_m"]);
        let (mut a, mut b) = (num(&case["a_m"]), num(&case["b_m"]));
        // The semi-axes must include the atmosphere; it is added if the case has them without it.
        if a < crate::geometry::ellipsoid::WGS84_A_M + d - 1.0 {
            (a, b) = (a + d, b + d);
        }
        let position = triple(&case["r_ecef_m"]);
        let cone = LimbCone::<T>::try_new(position.map(T::from_f64), T::from_f64(a), T::from_f64(b)).unwrap();
        let want = UnitVec3::<Fixed, T>::try_new(triple(&case["limb_axis_ecef"]).map(T::from_f64)).unwrap();
        let off = cone.axis.angle_rad(&want).to_f64().to_degrees();
        assert!(off < tolerance_deg, "{}: axis {off:e}", case["id"]);
        let (east, meridian) = cone.half_angles_rad();
        for (got, want) in
            [(east, &case["cone_half_angle_east_deg"]), (meridian, &case["cone_half_angle_meridian_deg"])]
        {
            let off = (got.to_f64().to_degrees() - num(want)).abs();
            assert!(off < tolerance_deg, "{}: half-angle {off:e}", case["id"]);
        }
    }
}

#[test]
fn limb_axis_equals_spice() {
    limb_cone::<f64>(1e-10);
    // At low altitude the position is rounded by half a metre, which changes the half-angle by 3e-4°.
    limb_cone::<f32>(1e-3);
}

/// With position and attitude the limb points of an ellipsoid fit without bias.
#[test]
fn azimuth_correction_removes_the_ellipsoid_bias() {
    let mut worst = (0.0f64, 0.0f64);
    for case in load(include_str!("../../golden/limb_ellipsoid.json")) {
        let camera = Camera::<f64>::try_new(&CameraConfig {
            theta_max_deg: Some(170.0),
            ..CameraConfig::ideal(Model::Equidistant, 4001, 4001, 500.0)
        })
        .unwrap();
        let r = rows(&case["R_ec"]);
        let q = quaternion(&r);
        let position = triple(&case["r_ecef_m"]);
        // SPICE's rays are straight. For a camera below 60 km the air raises the expected limb.
        if position.iter().map(|x| x * x).sum::<f64>().sqrt() < 6.371e6 + 70e3 {
            continue;
        }
        let frame = Prior {
            position_m: Some(position),
            fixed_from_camera: Rotation::assume_from_quaternion(q),
            ..Prior::default()
        };
        let body = body::Config { limb_height_km: num(&case["atmosphere_d_m"]) / 1e3, ..body::Config::default() };
        let axis = direction::<f64>(triple(&case["limb_axis_c"]));
        let points: Vec<(f64, f64)> = case["rays_c"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(|ray| camera.project(&direction(triple(ray))))
            .map(|p| (p.u, p.v))
            .collect();
        if points.len() < 12 {
            continue;
        }
        for (with, worst) in [(true, &mut worst.0), (false, &mut worst.1)] {
            let mut frame = frame;
            if !with {
                frame.fixed_from_camera = None;
            }
            let expected = Expected::new(&body, &frame).unwrap();
            // Only half of the limb is used: over a full circle the correction would cancel.
            let half = &points[..points.len() / 2];
            let answer = solve(&camera, half, &axis, &expected, HalfAngle::Known, 1.0, 0.0).unwrap();
            *worst = worst.max(answer.axis.angle_rad(&axis).to_degrees());
        }
    }
    assert!(worst.0 < 1e-4, "with attitude {worst:?}");
    assert!(worst.1 > 10.0 * worst.0, "without it the bias must show: {worst:?}");
}
