//! Reads lenses that hzn does not have, and files with several cameras; compares them with the tools' formulas.

use std::path::Path;

use hzn_core::camera::Model;
use hzn_files::camera_file::{self, CameraFile, Choice, Foreign, Loaded};

fn any(text: &str, camera: Option<&str>, size_px: Option<[u16; 2]>) -> Result<CameraFile, String> {
    camera_file::parse_any(text, Path::new("camera"), Choice { camera, size_px }).map_err(|e| e.to_string())
}

fn foreign(text: &str) -> Foreign {
    match any(text, None, None).unwrap().lens {
        Loaded::Foreign(lens) => lens,
        Loaded::Lens(config) => panic!("a lens of hzn: {config:?}"),
    }
}

const OCAM: &str = "#polynomial coefficients for the DIRECT mapping function (ocam_model.ss in MATLAB).\n\n5 -2.5e+02 \
                    0.0 1.5e-03 -3.0e-06 9.0e-09 \n\n#polynomial coefficients for the inverse mapping function\n\n2 \
                    400.0 200.0 \n\n#center: \"row\" and \"column\", starting from 0 (C convention)\n\n241.75 \
                    318.5\n\n#affine parameters \"c\", \"d\", \"e\"\n\n0.9990 0.0004 -0.0003\n\n#image size: \
                    \"height\" and \"width\"\n\n480 640\n";

/// `cam2world` of OCamCalib's C code: (row, column) to a ray (down, right, backward).
fn cam2world(row: f64, column: f64) -> [f64; 3] {
    let (c, d, e) = (0.9990, 0.0004, -0.0003);
    let inverse = 1.0 / (c - d * e);
    let xp = inverse * ((row - 241.75) - d * (column - 318.5));
    let yp = inverse * (-e * (row - 241.75) + c * (column - 318.5));
    let r = xp.hypot(yp);
    [xp, yp, -2.5e2 + 1.5e-3 * r * r - 3.0e-6 * r.powi(3) + 9.0e-9 * r.powi(4)]
}

#[test]
fn ocamcalib() {
    let lens = foreign(OCAM);
    assert_eq!((lens.size_px(), lens.centre_px()), ([640, 480], [318.5, 241.75]));
    assert!((lens.focal_px()[0] / 250.0 - 1.0).abs() < 1e-6 && (lens.focal_px()[1] / 249.75 - 1.0).abs() < 1e-6);
    let Foreign::Scaramuzza(ocam) = &lens else { panic!() };
    // The part of the affine parameters that turns the picture is not in the lens.
    let (sin, cos) = ocam.turn_rad.sin_cos();
    assert!((ocam.turn_rad + 0.0007 / 1.999).abs() < 1e-8 && (ocam.affine[0][1] - ocam.affine[1][0]).abs() < 1e-12);
    for (u, v) in [(318.5, 241.75), (400.0, 100.0), (20.0, 300.0), (639.0, 479.0)] {
        let [down, right, back] = cam2world(v, u);
        let [down, right] = [down * cos - right * sin, down * sin + right * cos];
        let [at_u, at_v] = lens.project([right, down, -back]).unwrap();
        assert!((at_u - u).abs() < 1e-9 && (at_v - v).abs() < 1e-9, "{u} {v}: {at_u} {at_v}");
    }
    let refused = |text: String| any(&text, None, None).unwrap_err();
    let exact = any(OCAM, None, None).unwrap().exact(Path::new("camera")).unwrap_err().to_string();
    assert!(exact.contains("hzn camera convert FILE --model kannala-brandt"), "{exact}");
    assert!(refused(OCAM.replace("5 -2.5e+02", "6 -2.5e+02")).starts_with("camera:3: the direct polynomial is"));
    assert!(refused(OCAM.replace("-2.5e+02", "2.5e+02")).contains("must be below 0"));
    assert!(refused(OCAM.replace("480 640", "480")).starts_with("camera:19: height and width"));
    assert!(refused(OCAM.replace("480 640\n", "")).contains("has five lines of them"));
    assert!(refused(OCAM.replace("0.9990", "-0.9990")).contains("c − d·e above 0"));
}

/// A polynomial that bends back ends where the angle off axis does.
#[test]
fn ocamcalib_ends_where_it_turns_back() {
    // z = −250 + 0.004 r²: seen from the side the lens is a parabola, and every radius is a larger angle.
    let opens = foreign(&OCAM.replace("1.5e-03 -3.0e-06 9.0e-09", "4.0e-03 0.0 0.0"));
    assert!(opens.project([1.0, 0.0, -0.2]).is_some());
    // z = −250 − 0.004 r²: tan θ = r/(250 + 0.004 r²) is largest at r = 250 px, where it is 1/2.
    let closes = foreign(&OCAM.replace("1.5e-03 -3.0e-06 9.0e-09", "-4.0e-03 0.0 0.0"));
    assert!(closes.project([0.4995, 0.0, 1.0]).is_some() && closes.project([0.5005, 0.0, 1.0]).is_none());
}

fn opencv(coefficients: &str, n: usize) -> String {
    format!(
        "%YAML:1.0\n---\nimage_width: 1280\nimage_height: 720\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: \
         3\n   dt: d\n   data: [ 610.5, 0., 638.25, 0., 611.25, 365.5, 0., 0., 1. ]\ndistortion_coefficients: \
         !!opencv-matrix\n   rows: 1\n   cols: {n}\n   dt: d\n   data: [ {coefficients} ]\n"
    )
}

#[test]
fn eight_and_twelve_coefficients() {
    let (k, p, s) = ([0.52, -2.6, 1.51, 0.4, -2.43, 1.44], [4e-4, -2e-4], [1e-3, -2e-4, 5e-4, 1e-4]);
    let eight = "0.52, -2.6, 4e-4, -2e-4, 1.51, 0.4, -2.43, 1.44";
    let twelve = format!("{eight}, 1e-3, -2e-4, 5e-4, 1e-4");
    for (text, s) in [(opencv(eight, 8), [0.0; 4]), (opencv(&twelve, 12), s)] {
        let lens = foreign(&text);
        assert_eq!((lens.size_px(), lens.closest()), ([1280, 720], Model::BrownConrady));
        for (x, y) in [(0.0, 0.0), (0.3f64, -0.2f64), (-0.9, 0.4)] {
            let r2 = x * x + y * y;
            let ratio = (1.0 + k[0] * r2 + k[1] * r2.powi(2) + k[2] * r2.powi(3))
                / (1.0 + k[3] * r2 + k[4] * r2.powi(2) + k[5] * r2.powi(3));
            let u = x * ratio + 2.0 * p[0] * x * y + p[1] * (r2 + 2.0 * x * x) + s[0] * r2 + s[1] * r2 * r2;
            let v = y * ratio + p[0] * (r2 + 2.0 * y * y) + 2.0 * p[1] * x * y + s[2] * r2 + s[3] * r2 * r2;
            let at = lens.project([2.0 * x, 2.0 * y, 2.0]).unwrap();
            let expected = [610.5 * u + 638.25, 611.25 * v + 365.5];
            assert!((at[0] - expected[0]).abs() < 1e-9 && (at[1] - expected[1]).abs() < 1e-9, "{at:?} {expected:?}");
        }
        assert!(lens.project([0.0, 0.0, -1.0]).is_none());
    }
    // COLMAP's FULL_OPENCV has the same lens, half a pixel further.
    let colmap = format!("1 FULL_OPENCV 1280 720 610.5 611.25 638.75 366.0 {}\n", eight.replace(',', ""));
    assert_eq!(foreign(&colmap), foreign(&opencv(eight, 8)));
    // A tilted sensor is another lens.
    let tilted = any(&opencv(&format!("{twelve}, 0.01, 0"), 14), None, None).unwrap_err();
    assert!(tilted.contains("eight or twelve through a fit"), "{tilted}");
    assert_eq!(foreign(&opencv(&format!("{twelve}, 0, 0"), 14)), foreign(&opencv(&twelve, 12)));
}

/// The files of OpenCV's stereo_calib.cpp have no size.
const STEREO: &str = "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 534.5, 0., \
                      341.25, 0., 534.25, 232.5, 0., 0., 1. ]\nD1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: \
                      d\n   data: [ -0.28, 0.04, 1e-3, -2e-4, 0.11 ]\nM2: !!opencv-matrix\n   rows: 3\n   cols: 3\n   \
                      dt: d\n   data: [ 537.5, 0., 327.25, 0., 537.25, 249.5, 0., 0., 1. ]\nD2: !!opencv-matrix\n   \
                      rows: 1\n   cols: 5\n   dt: d\n   data: [ -0.27, 0.03, 0., 0., 0.07 ]\nR: !!opencv-matrix\n   \
                      rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]\n";

#[test]
fn stereo() {
    let both = any(STEREO, None, Some([640, 480])).unwrap_err();
    assert!(both.starts_with("camera: has the cameras 1, 2; choose one with --camera 1"), "{both}");
    let wrong = any(STEREO, Some("3"), None).unwrap_err();
    assert!(wrong.starts_with("camera: has no camera \"3\"") && wrong.ends_with("its cameras are 1, 2"), "{wrong}");
    let without = any(STEREO, Some("2"), None).unwrap_err();
    assert!(without.starts_with("camera: 2.image_width: missing") && without.contains("--size"), "{without}");
    let read =
        |text: &str, name: &str| any(text, Some(name), Some([640, 480])).unwrap().exact(Path::new("c")).unwrap().0;
    let second = read(STEREO, "2");
    assert_eq!((second.model, second.width, second.height), (Model::BrownConrady, 640, 480));
    assert_eq!([second.fx_px, second.fy_px, second.cx_px, second.cy_px], [537.5, 537.25, 327.25, 249.5]);
    assert_eq!(second.k.as_slice(), [-0.27, 0.03, 0.0, 0.0, 0.07]);
    let sized = STEREO.replace("M1:", "image_width: 640\nimage_height: 480\nM1:");
    assert_eq!(any(&sized, Some("2"), None).unwrap().exact(Path::new("c")).unwrap().0, second);
    for (one, d, two, e, name) in [
        ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "2"),
        ("K_left", "D_left", "K_right", "D_right", "right"),
        ("left_camera_matrix", "left_distortion_coefficients", "right_K", "right_D", "right"),
    ] {
        let text = STEREO.replace("M1:", &format!("{one}:")).replace("D1:", &format!("{d}:"));
        let text = text.replace("M2:", &format!("{two}:")).replace("D2:", &format!("{e}:"));
        assert_eq!(read(&text, name), second, "{text}");
    }
}

#[test]
fn several_cameras_in_a_list() {
    let camera = |fx: f64| {
        format!(
            "{{\"image_size\": [640, 480], \"K\": [[{fx}, 0, 320], [0, {fx}, 240], [0, 0, 1]], \"dist\": [[-0.1, 0, 0, \
             0, 0]]}}"
        )
    };
    let (left, right) = (camera(500.0), camera(510.0));
    let by_name = format!("{{\"cameras\": {{\"left\": {left}, \"front\": {right}}}, \"camera_poses\": {{}}}}");
    let direct = format!("{{\"left\": {left}, \"front\": {right}}}");
    let list = format!("{{\"cameras\": [{left}, {}]}}", right.replacen('{', "{\"name\": \"front\", ", 1));
    for text in [&by_name, &direct, &list] {
        let lens = any(text, Some("front"), None).unwrap().exact(Path::new("c")).unwrap().0;
        assert_eq!((lens.fx_px, lens.width, lens.coefficient(0)), (510.0, 640, -0.1));
        assert!(any(text, None, None).unwrap_err().contains("has the cameras "), "{text}");
    }
    assert!(any(&list, None, None).unwrap_err().contains("has the cameras 0, front;"));
}

/// OpenCV's sample writes the RMS of the corners; 190 px was a calibration that failed.
#[test]
fn a_failed_calibration_is_doubtful() {
    let with = |px: f64| opencv("-0.1, 0., 0., 0., 0.", 5) + &format!("avg_reprojection_error: {px}\n");
    assert!(any(&with(1.9), None, None).unwrap().warnings.is_empty());
    let warnings = any(&with(190.5), None, None).unwrap().warnings;
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].to_string().starts_with("camera: avg_reprojection_error: the reprojection error is 190.500 px")
    );
    let stereo = STEREO.replace("M1:", "rms: 3.5\nM1:");
    assert_eq!(any(&stereo, Some("1"), Some([640, 480])).unwrap().warnings.len(), 1);
}
