//! Reads the calibration files of other tools.

use std::path::Path;

use hzn_core::camera::{Config, Model};
use serde_json::Value;

use super::lens::{Coefficients, Lens};
use super::values::{matrix, number, numbers};
use crate::Problem;
use crate::nearest::suggestion;

/// Reads a camera file. `name` selects one camera of a camchain, for example `cam1`; without it the first is used.
///
/// # Errors
/// The file cannot be read, has an unknown format, or has a lens that hzn does not have.
pub fn load(path: &Path, name: Option<&str>) -> Result<Config, Problem> {
    let text = std::fs::read_to_string(path).map_err(|e| Problem::new(path, format!("cannot be read: {e}")))?;
    parse(&text, path, name)
}

/// Reads a camera file as [`load`] does, but from text; `path` is only used in messages.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(text: &str, path: &Path, name: Option<&str>) -> Result<Config, Problem> {
    // OpenCV writes `%YAML:1.0`, which is not a valid YAML directive.
    let body = match text.split_once('\n') {
        Some((first, rest)) if first.starts_with("%YAML:") => format!("#\n{rest}"),
        _ => text.to_owned(),
    };
    // The tag adds nothing to its mapping.
    let body = body.replace("!!opencv-matrix", "");
    // `ros2 topic echo` ends every message with this line.
    let body = body.trim_end().strip_suffix("\n---").unwrap_or(&body);
    let value: Value = serde_saphyr::from_str(body).map_err(|e| {
        let location = e.location();
        let shown = e.to_string();
        let what = format!("not valid YAML: {}", shown.lines().next().unwrap_or_default());
        let mut problem = Problem::new(path, what);
        if let Some(at) = location {
            problem.line = usize::try_from(at.line()).ok();
            problem.column = usize::try_from(at.column()).ok();
        }
        problem
    })?;
    let file = File { path };
    let Value::Object(top) = &value else { return Err(file.unknown_format()) };
    let numbered =
        |k: &str| k.strip_prefix("cam").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let cameras: Vec<&str> = top.keys().map(String::as_str).filter(|k| numbered(k)).collect();
    match (name, cameras.first()) {
        (Some(name), _) if !cameras.contains(&name) => {
            Err(Problem::new(path, format!("has no camera {name:?}{}", suggestion(name, &cameras))))
        }
        (Some(name), _) => file.read_kalibr(&top[name], name),
        (None, Some(first)) => file.read_kalibr(&top[*first], first),
        (None, None) if top.contains_key("intrinsics") => file.read_kalibr(&value, ""),
        (None, None) if ["camera_matrix", "K", "k"].iter().any(|key| top.contains_key(*key)) => {
            file.read_opencv(&value)
        }
        _ => Err(file.unknown_format()),
    }
}

struct File<'a> {
    path: &'a Path,
}

impl File<'_> {
    fn problem(&self, field: &str, what: impl Into<String>) -> Problem {
        Problem::new(self.path, what).in_field(field)
    }

    fn unknown_format(&self) -> Problem {
        Problem::new(
            self.path,
            "is not a known camera file; expected is a Kalibr camchain (cam0: ...), a EuRoC sensor.yaml (intrinsics, \
             resolution), an OpenCV calibration (camera_matrix or K, image_width, image_height) or ROS's camera_info",
        )
    }

    /// Reads one camera of a Kalibr camchain, or EuRoC's sensor.yaml, which has no `name`.
    fn read_kalibr(&self, camera: &Value, name: &str) -> Result<Config, Problem> {
        let field = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
        let list = |key: &str| numbers(&camera[key]);
        let projection = camera["camera_model"].as_str().unwrap_or("pinhole");
        let special = match projection {
            "pinhole" => None,
            "ds" => Some((Model::DoubleSphere, "xi, alpha")),
            "eucm" => Some((Model::Eucm, "alpha, beta")),
            _ => {
                let what = format!(
                    "{projection:?} is a projection that hzn does not have; calibrate with pinhole, ds or eucm"
                );
                return Err(self.problem(&field("camera_model"), what));
            }
        };
        // The projections with coefficients of their own have them before the focal lengths.
        let (names, count) =
            special.map_or(("four numbers ".to_owned(), 0), |(_, k)| (format!("six numbers {k}, "), 2));
        let intrinsics = list("intrinsics").filter(|v| v.len() == 4 + count);
        let Some((k, [fx, fy, cx, cy])) = intrinsics.and_then(|v| {
            let (k, rest) = v.split_at(count);
            Some((k.to_vec(), <[f64; 4]>::try_from(rest).ok()?))
        }) else {
            return Err(self.problem(&field("intrinsics"), format!("{names}fx, fy, cx, cy are expected")));
        };
        let size = list("resolution").filter(|v| v.len() == 2);
        let Some([width, height]) = size.and_then(|v| <[f64; 2]>::try_from(v).ok()) else {
            return Err(self.problem(&field("resolution"), "two numbers, width and height, are expected"));
        };
        let key = if camera.get("distortion_coefficients").is_some() {
            "distortion_coefficients"
        } else {
            "distortion_coeffs"
        };
        let coefficients =
            Coefficients { values: self.read_coefficients(camera.get(key), &field(key))?, field: field(key) };
        let lens = self.read_lens(camera.get("distortion_model"), &field("distortion_model"))?.unwrap_or(Lens::None);
        if let Some((model, _)) = special {
            if coefficients.significant_len() > 0 {
                return Err(
                    self.problem(&field(key), format!("{projection} has no further distortion; calibrate with none"))
                );
            }
            let coefficients = Coefficients { values: Some(k), field: field("intrinsics") };
            return self.build_config(model, [width, height], [fx, fy, cx, cy], &coefficients);
        }
        let model = self.choose_model(lens, &coefficients)?;
        self.build_config(model, [width, height], [fx, fy, cx, cy], &coefficients)
    }

    /// Reads OpenCV's files, and ROS's camera_info as its calibrator writes it or as its topic shows it.
    fn read_opencv(&self, top: &Value) -> Result<Config, Problem> {
        let find_first = |names: &[&'static str]| {
            let found = names.iter().find_map(|name| top.get(*name).map(|value| (*name, value)));
            found.unwrap_or((names.first().copied().unwrap_or_default(), &Value::Null))
        };
        let (key, value) = find_first(&["camera_matrix", "K", "k"]);
        let [fx, fy, cx, cy] = self.read_intrinsics(value, key)?;
        let (key, value) = find_first(&["distortion_coefficients", "D", "d"]);
        let coefficients = Coefficients { values: self.read_coefficients(Some(value), key)?, field: key.to_owned() };
        let size = |names: &[&'static str]| {
            let (key, value) = find_first(names);
            number(value).ok_or_else(|| self.problem(key, "missing: add the picture's size in pixels to the file"))
        };
        let size = [size(&["image_width", "width"])?, size(&["image_height", "height"])?];
        let stated = self.read_lens(top.get("distortion_model"), "distortion_model")?;
        let flag = top.get("fisheye_model").map(|f| f.as_f64() == Some(1.0) || f.as_bool() == Some(true));
        let named = self.path.file_name().is_some_and(|n| n.to_string_lossy().to_lowercase().contains("fisheye"));
        let lens = match (stated, flag) {
            (Some(lens), Some(flag)) if flag != (lens == Lens::Fisheye) => {
                let what = "contradicts distortion_model; remove the wrong one of the two";
                return Err(self.problem("fisheye_model", what));
            }
            (Some(lens), _) => lens,
            (None, Some(true)) => Lens::Fisheye,
            (None, None) if named => Lens::Fisheye,
            (None, None) if coefficients.significant_len() == 4 => {
                let what = "four coefficients are k1 to k4 of a fisheye lens (cv2.fisheye) or k1, k2, p1, p2 of \
                            Brown-Conrady (cv2.calibrateCamera): add `fisheye_model: 1` or `fisheye_model: 0` to the \
                            file";
                return Err(self.problem(&coefficients.field, what));
            }
            (None, _) => Lens::PlumbBob,
        };
        let model = self.choose_model(lens, &coefficients)?;
        self.build_config(model, size, [fx, fy, cx, cy], &coefficients)
    }

    /// Returns fx, fy, cx, cy of a camera matrix, in pixels.
    fn read_intrinsics(&self, value: &Value, key: &str) -> Result<[f64; 4], Problem> {
        let Some(Ok([fx, skew, cx, below, fy, cy, last @ ..])) = matrix(value).map(<[f64; 9]>::try_from) else {
            return Err(self.problem(key, "a 3x3 matrix is expected"));
        };
        if [fx, fy, cx, cy] == [0.0; 4] {
            return Err(self.problem(key, "is all zeros: the camera is not calibrated; calibrate it first"));
        }
        if below != 0.0 || last != [0.0, 0.0, 1.0] {
            let what = "must be [fx, 0, cx; 0, fy, cy; 0, 0, 1]";
            let transposed = skew == 0.0 && cx == 0.0 && cy == 0.0 && last[2] == 1.0;
            let hint = if transposed { "; it is transposed, as MATLAB keeps it: swap rows and columns" } else { "" };
            return Err(self.problem(key, format!("{what}{hint}")));
        }
        if skew != 0.0 {
            return Err(self.problem(key, "has a skew, which hzn's lenses do not have; calibrate without it"));
        }
        Ok([fx, fy, cx, cy])
    }

    /// Returns the coefficients, which must be a single row or column. The result is `None` if the file has none.
    fn read_coefficients(&self, value: Option<&Value>, field: &str) -> Result<Option<Vec<f64>>, Problem> {
        let Some(value) = value.filter(|v| !v.is_null()) else { return Ok(None) };
        let Some(values) = matrix(value) else {
            return Err(self.problem(field, "a list of numbers is expected"));
        };
        let side = |key: &str| value.get(key).and_then(Value::as_u64);
        if let (Some(rows), Some(cols)) = (side("rows"), side("cols")) {
            if rows.saturating_mul(cols) != values.len() as u64 {
                let what = format!("has {} numbers, but rows and cols say {rows} x {cols}", values.len());
                return Err(self.problem(field, what));
            }
            if rows.min(cols) > 1 {
                return Err(
                    self.problem(field, format!("is a matrix of {rows} x {cols}; one row or column is expected"))
                );
            }
        }
        Ok(Some(values))
    }

    /// Returns the lens that `distortion_model` names; `None` if the word is missing or empty.
    fn read_lens(&self, word: Option<&Value>, field: &str) -> Result<Option<Lens>, Problem> {
        let Some(word) = word.and_then(Value::as_str).map(str::trim).filter(|word| !word.is_empty()) else {
            return Ok(None);
        };
        Lens::find(word).map(Some).map_err(|what| self.problem(field, what))
    }

    /// Returns hzn's model for the lens. The number of coefficients must fit that model.
    fn choose_model(&self, lens: Lens, coefficients: &Coefficients) -> Result<Model, Problem> {
        lens.to_model(coefficients).map_err(|what| self.problem(&coefficients.field, what))
    }

    /// Builds the configuration; `size` is width and height.
    fn build_config(
        &self,
        model: Model,
        size: [f64; 2],
        [fx, fy, cx, cy]: [f64; 4],
        coefficients: &Coefficients,
    ) -> Result<Config, Problem> {
        let to_whole = |x: f64| (x.fract() == 0.0 && (2.0..=65535.0).contains(&x)).then_some(x as u16);
        let [Some(width), Some(height)] = size.map(to_whole) else {
            return Err(self.problem("resolution", "width and height must be whole numbers from 2 to 65535"));
        };
        let k = coefficients.values.iter().flatten().copied().take(model.coefficients().len()).collect();
        let ideal = Config::ideal(model, width, height, fx);
        Ok(Config { fx_px: fx, fy_px: fy, cx_px: cx, cy_px: cy, k, ..ideal })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let omni = read(&text.replace("ds", "omni")).unwrap_err();
        assert!(omni.contains("calibrate with pinhole, ds or eucm"), "{omni}");
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
        let short =
            "K: [[300, 0, 320], [0, 300, 240], [0, 0, 1]]\nD: [0, 0, 0, 0]\nimage_width: 640\nimage_height: 480\n";
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
            "cam.yaml: distortion_coefficients: there are 8 coefficients, but hzn supports five of this lens: k1, k2, \
             p1, p2, k3; calibrate without the higher ones (plumb_bob, or a fisheye lens)"
        );
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
        assert!(error(written("plumb_bob", "\"a\"", 1)).contains("a list of numbers is expected"));
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
        assert_eq!(parse(text, Path::new("fisheye.yaml"), None).unwrap().model, Model::KannalaBrandt);
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
