//! Reads the calibration files of other tools.

use std::path::Path;

use hzn_core::camera::Config;
use serde_json::Value;

use super::foreign::Foreign;
use super::loaded::{CameraFile, Choice, Loaded};
use super::reader::Reader;
use super::{camchain, document, kalibr, opencv, scaramuzza, several};
use crate::nearest::suggestion;
use crate::{Problem, limited};

/// Reads a camera file. `name` selects one camera of a camchain, for example `cam1`; without it the first is used.
///
/// # Errors
/// The file cannot be read, has an unknown format, or has a lens that hzn does not have.
pub fn load(path: &Path, name: Option<&str>) -> Result<Config, Problem> {
    Ok(load_any(path, Choice { camera: name, size_px: None })?.exact(path)?.0)
}

/// Reads a camera file as [`load`] does, but from text; `path` is only used in messages.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(text: &str, path: &Path, name: Option<&str>) -> Result<Config, Problem> {
    Ok(parse_any(text, path, Choice { camera: name, size_px: None })?.exact(path)?.0)
}

/// Reads a camera file whose lens may be one that only a fit turns into one of hzn's, with the doubts about it.
///
/// # Errors
/// The errors are those of [`load`]; a file of OpenCV with several cameras needs the choice of one.
pub fn load_any(path: &Path, choice: Choice<'_>) -> Result<CameraFile, Problem> {
    let bytes = limited::read(path, limited::CAMERA_FILE_BYTES)
        .map_err(|e| Problem::new(path, format!("cannot be read: {e}")))?;
    let text =
        String::from_utf8(bytes).map_err(|_| Problem::new(path, "is not a text in UTF-8, so it is no camera file"))?;
    parse_any(&text, path, choice)
}

/// Reads a camera file as [`load_any`] does, but from text.
///
/// # Errors
/// The errors are those of [`load_any`].
pub fn parse_any(text: &str, path: &Path, choice: Choice<'_>) -> Result<CameraFile, Problem> {
    if let Some(lens) = scaramuzza::of_text(text, path) {
        let lens = lens?;
        let turned = Problem::new(
            path,
            format!(
                "the axes of OCamCalib are turned by {:.3} deg about the optical axis against those of the picture, \
             which the lens here has; a mount that was measured with OCamCalib's axes needs this turn",
                lens.turn_rad.to_degrees()
            ),
        );
        let side_px = f64::from(lens.size_px[0].max(lens.size_px[1]));
        let warnings = if lens.turn_rad.abs() * side_px > 1.0 { vec![turned] } else { Vec::new() };
        return Ok(CameraFile { lens: Loaded::Foreign(Foreign::Scaramuzza(lens)), warnings });
    }
    let mut value = match camchain::of_colmap(text, path) {
        Some(chain) => chain?,
        None => document::parse(text, path)?,
    };
    if let Some(chain) = value.as_object().and_then(|top| camchain::of_document(top, path)) {
        value = chain?;
    }
    let reader = Reader { path, size_px: choice.size_px };
    let Value::Object(top) = &value else { return Err(unknown_format(path)) };
    let lens = |lens: Loaded| CameraFile { lens, warnings: opencv::doubt(&reader, top).into_iter().collect() };
    let numbered =
        |k: &str| k.strip_prefix("cam").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let of_opencv = several::find(top);
    if !of_opencv.is_empty() {
        let (name, camera) = choose(&of_opencv, choice.camera, path)?;
        let reader = Reader { path, ..reader };
        let doubt = opencv::doubt(&reader, camera).or_else(|| opencv::doubt(&reader, top));
        let lens = opencv::read(&reader, camera).map_err(|p| in_camera(p, name))?;
        return Ok(CameraFile { lens, warnings: doubt.into_iter().collect() });
    }
    let cameras: Vec<&str> = top.keys().map(String::as_str).filter(|k| numbered(k)).collect();
    match (choice.camera, cameras.first()) {
        (Some(name), _) if !cameras.contains(&name) => {
            Err(Problem::new(path, format!("has no camera {name:?}{}", suggestion(name, &cameras))))
        }
        (Some(name), _) => kalibr::read(&reader, &top[name], name).map(lens),
        (None, Some(first)) => kalibr::read(&reader, &top[*first], first).map(lens),
        (None, None) if top.contains_key("intrinsics") => kalibr::read(&reader, &value, "").map(lens),
        (None, None) if top.keys().any(|key| opencv::MATRIX.contains(&opencv::plain(key).as_str())) => {
            opencv::read(&reader, top).map(lens)
        }
        _ => Err(unknown_format(path)),
    }
}

/// Returns the camera of a file that the user means.
fn choose<'a>(
    cameras: &'a several::Cameras,
    name: Option<&str>,
    path: &Path,
) -> Result<(&'a str, &'a serde_json::Map<String, Value>), Problem> {
    let names: Vec<&str> = cameras.iter().map(|(name, _)| name.as_str()).collect();
    let found = match (name, &cameras[..]) {
        (Some(name), _) => cameras.iter().find(|(known, _)| known == name).ok_or_else(|| {
            format!("has no camera {name:?}{}; its cameras are {}", suggestion(name, &names), names.join(", "))
        }),
        (None, [only]) => Ok(only),
        (None, _) => Err(format!(
            "has the cameras {}; choose one with --camera {} (hzn camera convert or show), or in a sensor.toml with \
             camera = {1:?} next to file",
            names.join(", "),
            names.first().copied().unwrap_or_default()
        )),
    };
    found.map(|(name, camera)| (name.as_str(), camera)).map_err(|what| Problem::new(path, what))
}

/// Returns the problem with the camera's name before the field.
fn in_camera(problem: Problem, name: &str) -> Problem {
    let field = problem.field.as_deref().map_or_else(|| name.to_owned(), |field| format!("{name}.{field}"));
    problem.in_field(field)
}

fn unknown_format(path: &Path) -> Problem {
    Problem::new(
        path,
        "is not a known camera file; expected is a Kalibr camchain (cam0: ...), a EuRoC sensor.yaml (intrinsics, \
         resolution), an OpenCV calibration (camera_matrix or K, image_width, image_height; YAML, XML or JSON), ROS's \
         camera_info, Foxglove's CameraCalibration (JSON), or a file of camodocal (model_type), ORB-SLAM3 \
         (Camera.type), Basalt, COLMAP (cameras.txt), Metashape (XML) or OCamCalib (calib_results.txt)",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::Model;

    fn read(text: &str) -> Result<Config, String> {
        parse(text, Path::new("cam.yaml"), None).map_err(|e| e.to_string())
    }

    #[test]
    fn kalibr_camchain() {
        let text = "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [-0.05, 0.01, -3.5e-03, \
                    0]\n  distortion_model: equidistant\n  intrinsics: [1235.0, 1231.0, 963.2, 536.7]\n  \
                    resolution: [1920, 1080]\n  rostopic: /cam0/image_raw\n";
        let c = read(text).unwrap();
        assert_eq!((c.model, c.width, c.height), (Model::KannalaBrandt, 1920, 1080));
        assert_eq!((c.fx_px, c.fy_px, c.cx_px, c.cy_px), (1235.0, 1231.0, 963.2, 536.7));
        assert_eq!(c.k.as_slice(), [-0.05, 0.01, -0.0035, 0.0]);
        assert_eq!(
            parse(text, Path::new("cam.yaml"), Some("cam1")).unwrap_err().to_string(),
            "cam.yaml: has no camera \"cam1\"; did you mean cam0?"
        );
        assert_eq!(
            read(&text.replace("equidistant", "equidistent")).unwrap_err(),
            "cam.yaml: cam0.distortion_model: \"equidistent\" is a lens that hzn does not have; did you mean \
                equidistant?"
        );
    }

    #[test]
    fn projections_of_kalibr() {
        let text = "cam0:\n  camera_model: ds\n  intrinsics: [-0.18, 0.59, 157.0, 157.1, 254.2, 256.3]\n  \
                    distortion_model: none\n  distortion_coeffs: []\n  resolution: [512, 512]\n";
        let c = read(text).unwrap();
        assert_eq!((c.model, c.k.as_slice()), (Model::DoubleSphere, &[-0.18, 0.59][..]));
        assert_eq!((c.fx_px, c.fy_px, c.cx_px, c.cy_px), (157.0, 157.1, 254.2, 256.3));
        let back = super::super::write(&c, super::super::Format::Kalibr).unwrap();
        assert_eq!(read(&back).unwrap(), c, "{back}");
        let eucm = read(&text.replace("ds", "eucm").replace("-0.18, 0.59", "0.63, 1.04")).unwrap();
        assert_eq!((eucm.model, eucm.k.as_slice()), (Model::Eucm, &[0.63, 1.04][..]));
        let short = read(&text.replace("-0.18, ", "")).unwrap_err();
        assert_eq!(short, "cam.yaml: cam0.intrinsics: six numbers xi, alpha, fx, fy, cx, cy are expected");
        let scara = read(&text.replace("ds", "scaramuzza")).unwrap_err();
        assert!(scara.contains("calibrate with pinhole, ds, eucm or omni"), "{scara}");
    }

    #[test]
    fn euroc_sensor_yaml() {
        let text = "#Default sensor yaml\nsensor_type: camera\ncomment: VI-Sensor cam0\nT_BS:\n  cols: 4\n  rows: 4\n  \
                    data: [1.0, 0.0, 0.0, 0.0,\n         0.0, 1.0, 0.0, 0.0,\n         0.0, 0.0, 1.0, 0.0,\n         \
                    0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\n\
                    intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv\n\
                    distortion_model: radial-tangential\n\
                    distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";
        let c = read(text).unwrap();
        assert_eq!((c.model, c.width, c.k.len()), (Model::BrownConrady, 752, 4));
    }

    #[test]
    fn opencv_calibration() {
        let text = "%YAML:1.0\n---\ncalibration_time: \"Fri 20 Nov 2020\"\nimage_width: 640\nimage_height: 480\n\
                    fisheye_model: 1\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   \
                    data: [ 300., 0., 319.5, 0., 301.,\n       239.5, 0., 0., 1. ]\n\
                    distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   \
                    data: [ 1e-02, 2e-3, -1.0000000000000001e-03, 0. ]\n";
        let c = read(text).unwrap();
        assert_eq!((c.model, c.fx_px, c.fy_px, c.cy_px), (Model::KannalaBrandt, 300.0, 301.0, 239.5));
        assert_eq!(c.k.as_slice(), [0.01, 0.002, -0.001, 0.0]);
        let brown = read(&text.replace("fisheye_model: 1", "fisheye_model: 0")).unwrap();
        assert_eq!(brown.model, Model::BrownConrady);
        assert!(read(&text.replace("image_width", "columns")).unwrap_err().contains("image_width: missing"));
        let short = "K: [[300, 0, 320], [0, 300, 240], [0, 0, 1]]\nD: [0, 0, 0, 0, 0]\nimage_size: [640, 480]\n";
        assert_eq!(read(short).unwrap().model, Model::Pinhole);
    }

    #[test]
    fn ros_camera_info() {
        // ROS's calibrator writes the file in this form.
        let written = |model: &str, k: &str, cols: usize| {
            format!(
                "image_width: 640\nimage_height: 480\ncamera_name: narrow\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
                 data: [300, 0, 319.5, 0, 301, 239.5, 0, 0, 1]\ndistortion_model: {model}\n\
                 distortion_coefficients:\n  rows: 1\n  cols: {cols}\n  data: [{k}]\nrectification_matrix:\n  \
                 rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
            )
        };
        let four = "-0.05, 0.01, -0.0035, 0.0002";
        let c = read(&written("equidistant", four, 4)).unwrap();
        assert_eq!((c.model, c.k.as_slice()), (Model::KannalaBrandt, [-0.05, 0.01, -0.0035, 0.0002].as_slice()));
        assert_eq!(read(&written("fisheye", four, 4)).unwrap(), c);
        assert_eq!(read(&written("plumb_bob", &format!("{four}, 0.1"), 5)).unwrap().model, Model::BrownConrady);
        assert_eq!(read(&written("plumb_bob", "0, 0, 0, 0, 0", 5)).unwrap().model, Model::Pinhole);
        let eight = |last: &str| read(&written("rational_polynomial", &format!("{four}, 0.1, 0, 0, {last}"), 8));
        // With a denominator of 1 it is the same lens.
        assert_eq!(eight("0").unwrap().k.as_slice(), [-0.05, 0.01, -0.0035, 0.0002, 0.1]);
        let error = |text: String| read(&text).unwrap_err();
        assert_eq!(
            eight("0.2").unwrap_err(),
            "cam.yaml: OpenCV's lens with more than five coefficients is a lens that hzn does not have. Fit one of \
             hzn's to it:  hzn camera convert FILE --model brown-conrady -o sensor.toml  states the error"
        );
        let seven = written("rational_polynomial", &format!("{four}, 0.1, 0, 0.2"), 7);
        assert!(read(&seven).unwrap_err().contains("7 coefficients, but hzn supports five of this lens"));
        assert_eq!(
            error(written("thin_prism", four, 4)),
            "cam.yaml: distortion_model: \"thin_prism\" is a lens that hzn does not have; valid here: equidistant, \
                                                       fisheye, kannala_brandt, radtan, radial-tangential, plumb_bob, \
                                                       rational_polynomial, none"
        );
        assert!(error(written("plumbob", four, 4)).contains("did you mean plumb_bob?"));
        // The shape of D is checked.
        assert_eq!(
            error(written("equidistant", &format!("{four}, 0.1"), 5)),
            "cam.yaml: distortion_coefficients: there are 5 coefficients, but a fisheye lens has four, k1 to k4; is \
             it another lens?"
        );
        assert!(
            error(written("plumb_bob", "-0.05, 0.01", 2)).contains("2 coefficients, but this lens has five: k1, k2,")
        );
        assert!(error(written("rational_polynomial", four, 4)).contains("is it plumb_bob?"));
        assert!(error(written("plumb_bob", four, 5)).contains("has 4 numbers, but rows and cols say 1 x 5"));
        assert!(error(written("plumb_bob", "\"a\"", 1)).contains("a list of finite numbers is expected"));
        // `ros2 topic echo` and ROS 1 show the message in this form.
        let echoed = "header:\n  frame_id: cam\nheight: 480\nwidth: 640\ndistortion_model: equidistant\nd:\n- -0.05\n- \
                      0.01\n\
                      - -0.0035\n- 0.0002\nk:\n- 300.0\n- 0.0\n- 319.5\n- 0.0\n- 301.0\n- 239.5\n- 0.0\n- 0.0\n- 1.0\n\
                      binning_x: 0\n---\n";
        assert_eq!(read(echoed).unwrap(), c);
        assert_eq!(read(&echoed.replace("\nd:", "\nD:").replace("\nk:", "\nK:")).unwrap(), c);
        let none = "height: 480\nwidth: 640\ndistortion_model: ''\nD: []\nK: [0, 0, 0, 0, 0, 0, 0, 0, 0]\n";
        assert!(read(none).unwrap_err().contains("K: is all zeros: the camera is not calibrated"));
    }

    #[test]
    fn what_would_be_misread_is_refused() {
        let text = "K: [[300, 0, 320], [0, 300, 240], [0, 0, 1]]\nD: [-0.05, 0.01, -0.0035, 0.0002]\nimage_width: 640\n\
                    image_height: 480\n";
        assert!(read(text).unwrap_err().starts_with("cam.yaml: D: four coefficients are k1 to k4 of a fisheye"));
        assert_eq!(read(&format!("{text}fisheye_model: 0\n")).unwrap().model, Model::BrownConrady);
        // The name of the file says nothing.
        assert!(parse(text, Path::new("fisheye.yaml"), None).is_err());
        // cv2.fisheye returns a column.
        let column = text.replace("[-0.05, 0.01, -0.0035, 0.0002]", "[[-0.05], [0.01], [-0.0035], [0.0002]]");
        assert_eq!(read(&column).unwrap().model, Model::KannalaBrandt);
        assert!(
            read(&text.replace("[300, 0, 320]", "[300, 0.5, 320]")).unwrap_err().contains("K: has a skew of 0.5 px")
        );
        assert!(read(&format!("{text}width: 640\n")).unwrap_err().contains("means the same as"));
        assert!(read(&text.replace("-0.05", ".nan")).unwrap_err().contains("non-finite float"));
        let both = format!("{text}fisheye_model: 1\ndistortion_model: plumb_bob\n");
        assert!(read(&both).unwrap_err().contains("fisheye_model: contradicts distortion_model"));
        let turned =
            text.replace("[[300, 0, 320], [0, 300, 240], [0, 0, 1]]", "[[300, 0, 0], [0, 300, 0], [320, 240, 1]]");
        assert!(read(&turned).unwrap_err().contains("it is transposed, as MATLAB keeps it"));
        // Coefficients under an unknown name would otherwise give a lens without distortion.
        let chain = "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 301.0, 320.0, 240.0]\n  resolution: [640, \
                     480]\n  distortion_model: radtan\n  distortion_coefs: [0.01, 0.0, 0.0, 0.0]\n";
        assert_eq!(read(chain).unwrap_err(), "cam.yaml: cam0.distortion_coeffs: missing: this lens has k1, k2, p1, p2");
        assert!(
            read(&chain.replace("coefs", "coeffs").replace("  distortion_model: radtan\n", ""))
                .unwrap_err()
                .contains("distortion_model does not name the lens")
        );
    }

    #[test]
    fn what_is_no_camera_file_says_so() {
        assert!(read("a: 1\n").unwrap_err().contains("Kalibr camchain"));
        assert!(read("a: [1\n").unwrap_err().contains("not valid YAML"));
        assert!(read("").is_err());
    }
}
