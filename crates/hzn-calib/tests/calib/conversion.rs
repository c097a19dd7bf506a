//! Converts the lens of a camera file into another model.

use std::path::Path;

use hzn_calib::conversion;
use hzn_core::camera::{Camera, Model};
use hzn_files::camera_file::{self, Choice, Loaded};

#[test]
fn kalibrs_omni_lens_becomes_one_of_hzn() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/camera_files/kalibr.yaml");
    let omni = camera_file::load_any(&path, Choice { camera: Some("cam1"), size_px: None }).unwrap().lens;
    let fitted = conversion::convert(&omni, Model::KannalaBrandt).unwrap();
    assert!(fitted.max_px < 1.0, "{fitted:?}");
    assert_eq!(fitted.camera.model, Model::KannalaBrandt);
    Camera::<f64>::try_new(&fitted.camera).unwrap();
}

/// OCamCalib's polynomial of a fisheye lens of 190°: r = f θ within a few pixels.
#[test]
fn ocamcalibs_polynomial_is_fitted_with_its_error() {
    let text = "5 -3.001e+02 0.0 1.401e-03 -1.612e-06 4.171e-09\n2 1 1\n459.5 657.75\n0.9999 -0.0001 -0.0001\n960 \
                1280\n";
    let read = camera_file::parse_any(text, Path::new("calib_results.txt"), Choice::default()).unwrap().lens;
    let whole = conversion::convert(&read, Model::KannalaBrandt).unwrap();
    let centre = conversion::convert_up_to(&read, Model::KannalaBrandt, 60.0).unwrap();
    // The corner of the picture is 153° off axis, where four coefficients do not follow the polynomial.
    assert!(whole.rms_px < 0.5 && whole.off_axis_deg > 150.0, "{whole:?}");
    assert!(centre.max_px < 0.2 && centre.max_px < whole.max_px, "{centre:?}");
    assert!(centre.camera.theta_max_deg.is_some_and(|deg| (59.0..=60.0).contains(&deg)), "{centre:?}");
    let Loaded::Foreign(lens) = &read else { panic!() };
    // The error that is stated is that of other directions as well.
    let fitted = hzn_core::camera::Equation::new(&whole.camera);
    for (x, y) in [(0.31, 0.17), (-0.9, 0.4), (0.2, -1.4)] {
        let [u, v] = lens.project([x, y, 1.0]).unwrap();
        let p = fitted.project([x, y, 1.0]).unwrap().point;
        assert!((p.u - u).hypot(p.v - v) < 1.2 * whole.max_px, "{p:?} {u} {v}");
    }
}

/// OpenCV's lens with eight coefficients becomes brown-conrady, whose error says whether that is enough.
#[test]
fn eight_coefficients_are_fitted_with_their_error() {
    let with = |k: &str| {
        let text = format!(
            "K: [[610.5, 0, 638.25], [0, 611.25, 365.5], [0, 0, 1]]\nD: [{k}]\nimage_width: 1280\nimage_height: 720\n"
        );
        camera_file::parse_any(&text, Path::new("c.yaml"), Choice::default()).unwrap().lens
    };
    let fitted = conversion::convert(&with("0.52, -2.6, 4e-4, -2e-4, 1.51, 0.4, -2.43, 1.44"), Model::BrownConrady);
    let fitted = fitted.unwrap();
    assert!(fitted.max_px < 1.0 && (fitted.camera.cx_px - 638.25).abs() < 0.5, "{fitted:?}");
    // Nearly five coefficients: nearly no error.
    let close = conversion::convert(&with("-0.2, 0.05, 4e-4, -2e-4, 0.01, 0, 0, 1e-6"), Model::BrownConrady).unwrap();
    assert!(close.max_px < 0.01, "{close:?}");
}
