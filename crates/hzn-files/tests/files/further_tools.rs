//! Reads camera files of further tools, and compares the lens with the published formula of each tool.

use std::path::Path;

use hzn_core::camera::{Config, Equation, Model};
use hzn_files::camera_file;

fn read(text: &str) -> Result<Config, String> {
    read_camera(text, None)
}

fn read_camera(text: &str, name: Option<&str>) -> Result<Config, String> {
    camera_file::parse(text, Path::new("camera"), name).map_err(|e| e.to_string())
}

/// Compares a lens with a formula of the tool: from x/z and y/z to pixels with centres at integers.
fn agrees(lens: &Config, formula: impl Fn(f64, f64) -> [f64; 2]) {
    let equation = Equation::new(lens);
    for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.5, 0.4), (0.1, 0.6)] {
        let p = equation.project([x, y, 1.0]).unwrap().point;
        let [u, v] = formula(x, y);
        assert!((p.u - u).abs() < 1e-9 && (p.v - v).abs() < 1e-9, "{lens:?}: {p:?} {u} {v}");
    }
}

/// Returns the image point of a fisheye lens r = θ + k₁θ³ + … in pixels.
fn fisheye(f: [f64; 2], c: [f64; 2], k: [f64; 4], x: f64, y: f64) -> [f64; 2] {
    let r = x.hypot(y);
    let theta = r.atan();
    let bent = theta + (0..4).map(|i| k[i] * theta.powi(2 * i as i32 + 3)).sum::<f64>();
    let scale = if r > 0.0 { bent / r } else { 1.0 };
    [f[0] * x * scale + c[0], f[1] * y * scale + c[1]]
}

const K: [f64; 4] = [-0.031, 0.012, -0.004, 0.0007];

#[test]
fn camodocal() {
    let text = "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\ncamera_name: own\nimage_width: 640\nimage_height: 512\n\
                projection_parameters:\n   k2: -0.031\n   k3: 0.012\n   k4: -0.004\n   k5: 0.0007\n   mu: 413.5\n   \
                mv: 414.25\n   u0: 305.75\n   v0: 259.5\n";
    let lens = read(text).unwrap();
    assert_eq!((lens.model, lens.width, lens.height), (Model::KannalaBrandt, 640, 512));
    agrees(&lens, |x, y| fisheye([413.5, 414.25], [305.75, 259.5], K, x, y));
    let moved = text.replace("projection_parameters:", "distortion_parameters:");
    let moved = moved.replace("   mu:", "projection_parameters:\n   mu:");
    assert_eq!(read(&moved).unwrap(), lens);
    let missing = read(&text.replace("   mv: 414.25\n", "")).unwrap_err();
    assert_eq!(missing, "camera: projection_parameters/mv: missing: a number is expected");
    let scaramuzza = read(&text.replace("KANNALA_BRANDT", "SCARAMUZZA")).unwrap_err();
    assert!(scaramuzza.contains("model_type: \"SCARAMUZZA\" is no lens that hzn has"), "{scaramuzza}");
    let mei = "%YAML:1.0\n---\nmodel_type: MEI\ncamera_name: own\nimage_width: 752\nimage_height: 480\n\
               mirror_parameters:\n   xi: 0.8\ndistortion_parameters:\n   k1: 0\n   k2: 0\n   p1: 0\n   p2: 0\n\
               projection_parameters:\n   gamma1: 833.0\n   gamma2: 830.0\n   u0: 373.5\n   v0: 253.5\n";
    agrees(&read(mei).unwrap(), |x, y| {
        let depth = 1.0 + 0.8 * (x * x + y * y + 1.0).sqrt();
        [833.0 * x / depth + 373.5, 830.0 * y / depth + 253.5]
    });
}

#[test]
fn orb_slam() {
    let text = "%YAML:1.0\n\nFile.version: \"1.0\"\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: 797.5\nCamera1.fy: \
                796.25\nCamera1.cx: 960.5\nCamera1.cy: 541.0\nCamera1.k1: -0.031\nCamera1.k2: 0.012\nCamera1.k3: \
                -0.004\nCamera1.k4: 0.0007\nCamera.width: 1920\nCamera.height: 1080\nCamera.fps: 30\n";
    agrees(&read(text).unwrap(), |x, y| fisheye([797.5, 796.25], [960.5, 541.0], K, x, y));
    let second = format!("{text}{}", text.split_once("Camera1.fx").map(|(_, t)| format!("Camera1.fx{t}")).unwrap());
    let second = second.replacen("Camera1", "Camera2", 8).replacen("Camera.width: 1920\nCamera.height: 1080\n", "", 1);
    let second = second.replacen("Camera.fps: 30\n", "", 1).replacen("Camera2.fx: 797.5", "Camera2.fx: 700.0", 1);
    assert_eq!(read(&second).unwrap().fx_px, 797.5);
    assert_eq!(read_camera(&second, Some("cam1")).unwrap().fx_px, 700.0);
    let without = read(&text.replace("Camera.width: 1920\n", "")).unwrap_err();
    assert_eq!(without, "camera: Camera.width: missing: a number is expected");
}

#[test]
fn basalt() {
    let text = r#"{"value0": {"T_imu_cam": [], "intrinsics": [
        {"camera_type": "ds", "intrinsics": {"fx": 158.5, "fy": 158.25, "cx": 254.5, "cy": 256.75, "xi": -0.17,
         "alpha": 0.59}},
        {"camera_type": "kb4", "intrinsics": {"fx": 190.5, "fy": 190.25, "cx": 254.0, "cy": 256.0, "k1": -0.031,
         "k2": 0.012, "k3": -0.004, "k4": 0.0007}}],
        "resolution": [[512, 512], [512, 510]]}}"#;
    agrees(&read(text).unwrap(), |x, y| {
        let d1 = (x * x + y * y + 1.0).sqrt();
        let d2 = (x * x + y * y + (-0.17 * d1 + 1.0).powi(2)).sqrt();
        let depth = 0.59 * d2 + 0.41 * (-0.17 * d1 + 1.0);
        [158.5 * x / depth + 254.5, 158.25 * y / depth + 256.75]
    });
    let second = read_camera(text, Some("cam1")).unwrap();
    assert_eq!((second.width, second.height), (512, 510));
    agrees(&second, |x, y| fisheye([190.5, 190.25], [254.0, 256.0], K, x, y));
}

/// COLMAP counts pixels from the corner of the first pixel.
#[test]
fn colmap() {
    let text = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 \
                OPENCV_FISHEYE 1920 1080 797.5 796.25 961.0 541.5 -0.031 0.012 -0.004 0.0007\n2 SIMPLE_RADIAL 640 \
                480 500.5 320.25 240.75 -0.1\n";
    agrees(&read(text).unwrap(), |x, y| fisheye([797.5, 796.25], [960.5, 541.0], K, x, y));
    agrees(&read_camera(text, Some("cam2")).unwrap(), |x, y| {
        let radial = 1.0 - 0.1 * (x * x + y * y);
        [500.5 * x * radial + 319.75, 500.5 * y * radial + 240.25]
    });
    // An equidistant fisheye: the radius is the angle.
    for (words, [fx, fy]) in
        [("SIMPLE_FISHEYE 640 480 300.5", [300.5, 300.5]), ("FISHEYE 640 480 300.5 302", [300.5, 302.0])]
    {
        agrees(&read(&format!("1 {words} 320.25 240.75\n")).unwrap(), |x, y| {
            fisheye([fx, fy], [319.75, 240.25], [0.0; 4], x, y)
        });
    }
    let wrong = read("1 FOV 640 480 500 500 320 240 0.9\n").unwrap_err();
    assert!(wrong.starts_with("camera:1: \"FOV\" is no lens that hzn has; the models are SIMPLE_PINHOLE"), "{wrong}");
    let short = read("1 PINHOLE 640 480 500 320 240\n").unwrap_err();
    assert_eq!(short, "camera:1: PINHOLE has 3 parameters, but 4 are expected");
}

/// ROS's image_geometry: K' = K − roi, then both rows over the binning; the size is that of the sent pictures.
#[test]
fn ros_binning_and_window() {
    let text = "image_width: 1280\nimage_height: 960\ncamera_name: own\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: \
                [800.0, 0.0, 640.0, 0.0, 802.0, 480.0, 0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\n\
                distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.1, 0.0, 0.0, 0.0, 0.0]\n";
    let full = read(text).unwrap();
    let zero = "binning_x: 0\nbinning_y: 0\nroi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}\n";
    assert_eq!(read(&format!("{text}{zero}")).unwrap(), full);
    let cut = "binning_x: 2\nbinning_y: 4\nroi: {x_offset: 100, y_offset: 60, height: 800, width: 1000}\n";
    let lens = read(&format!("{text}{cut}")).unwrap();
    assert_eq!((lens.width, lens.height), (500, 200));
    agrees(&lens, |x, y| {
        let radial = 1.0 - 0.1 * (x * x + y * y);
        [(800.0 * x * radial + 640.0 - 100.0) / 2.0, (802.0 * y * radial + 480.0 - 60.0) / 4.0]
    });
    let wrong = read(&format!("{text}binning_x: 1.5\n")).unwrap_err();
    assert_eq!(wrong, "camera: binning_x: a whole number of pixels is expected");
    // A window lies in the picture. Without a size of its own it is the whole picture, which cannot begin elsewhere.
    for (roi, what) in [
        ("{x_offset: 300, width: 1000, height: 960}", "x_offset: 1000 columns from 300 on do not lie in the whole"),
        ("{y_offset: 1}", "y_offset: 960 rows from 1 on do not lie in the whole picture, which has 960 rows"),
    ] {
        let wrong = read(&format!("{text}roi: {roi}\n")).unwrap_err();
        assert!(wrong.starts_with(&format!("camera: roi.{what}")), "{wrong}");
    }
}

/// Metashape's manual, appendix "Camera models": p1 and p2 are OpenCV's p2 and p1.
#[test]
fn metashape() {
    let text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<calibration>\n  <projection>frame</projection>\n  \
                <width>1920</width>\n  <height>1080</height>\n  <f>1430.25</f>\n  <cx>-24.5</cx>\n  \
                <cy>17.25</cy>\n  <b1>0.5</b1>\n  <k1>-0.118</k1>\n  <k2>0.09</k2>\n  <k3>-0.02</k3>\n  \
                <p1>0.00033</p1>\n  <p2>0.0018</p2>\n  <date>2017-11-14T23:30:12Z</date>\n</calibration>\n";
    agrees(&read(text).unwrap(), |x, y| {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (-0.118 + r2 * (0.09 - 0.02 * r2));
        let (p1, p2) = (0.00033, 0.0018);
        let bent = [
            x * radial + p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y,
            y * radial + p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y,
        ];
        // Metashape counts from the corner of the first pixel.
        [960.0 - 24.5 + bent[0] * (1430.25 + 0.5) - 0.5, 540.0 + 17.25 + bent[1] * 1430.25 - 0.5]
    });
    let skew = read(&text.replace("<b1>0.5</b1>", "<b2>-4.25</b2>")).unwrap_err();
    assert_eq!(skew, "camera: b2: is -4.25, but hzn's lenses have no skew; calibrate without it");
}
