//! What other tools write.

use std::path::Path;

use hzn_core::camera::{Config, Model};
use serde_json::Value;

use crate::Problem;
use crate::nearest::suggestion;

/// Reads a camera file. `name` picks one camera of a camchain, such as `cam1`; without it the first is taken.
///
/// # Errors
/// A file that cannot be read, is no known format, or has a lens that hzn does not have.
pub fn load(path: &Path, name: Option<&str>) -> Result<Config, Problem> {
    let text = std::fs::read_to_string(path).map_err(|e| Problem::new(path, format!("cannot be read: {e}")))?;
    parse(&text, path, name)
}

/// As [`load`], from text; `path` is named in messages.
///
/// # Errors
/// As [`load`].
pub fn parse(text: &str, path: &Path, name: Option<&str>) -> Result<Config, Problem> {
    // OpenCV writes `%YAML:1.0`, which is not the directive's right form.
    let body = match text.split_once('\n') {
        Some((first, rest)) if first.starts_with("%YAML:") => format!("#\n{rest}"),
        _ => text.to_owned(),
    };
    // The tag says nothing that its mapping does not.
    let body = body.replace("!!opencv-matrix", "");
    let value: Value = serde_saphyr::from_str(&body).map_err(|e| {
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
    let Value::Object(top) = &value else { return Err(file.unknown()) };
    let numbered =
        |k: &str| k.strip_prefix("cam").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let cameras: Vec<&str> = top.keys().map(String::as_str).filter(|k| numbered(k)).collect();
    match (name, cameras.first()) {
        (Some(name), _) if !cameras.contains(&name) => {
            Err(Problem::new(path, format!("has no camera {name:?}{}", suggestion(name, &cameras))))
        }
        (Some(name), _) => file.kalibr(&top[name], name),
        (None, Some(first)) => file.kalibr(&top[*first], first),
        (None, None) if top.contains_key("intrinsics") => file.kalibr(&value, ""),
        (None, None) if top.contains_key("camera_matrix") || top.contains_key("K") => file.opencv(&value),
        _ => Err(file.unknown()),
    }
}

struct File<'a> {
    path: &'a Path,
}

impl File<'_> {
    fn problem(&self, field: &str, what: impl Into<String>) -> Problem {
        Problem::new(self.path, what).in_field(field)
    }

    fn unknown(&self) -> Problem {
        Problem::new(
            self.path,
            "is no camera file that is known here: a Kalibr camchain (cam0: ...), a EuRoC sensor.yaml (intrinsics, \
             resolution) or an OpenCV calibration (camera_matrix or K, image_width, image_height) is expected",
        )
    }

    fn kalibr(&self, camera: &Value, name: &str) -> Result<Config, Problem> {
        let field = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
        let list = |key: &str| numbers(&camera[key]);
        let projection = camera["camera_model"].as_str().unwrap_or("pinhole");
        if projection != "pinhole" {
            let what = format!("{projection:?} is a projection that hzn does not have; calibrate with pinhole");
            return Err(self.problem(&field("camera_model"), what));
        }
        let intrinsics = list("intrinsics").filter(|v| v.len() == 4);
        let Some([fx, fy, cx, cy]) = intrinsics.and_then(|v| <[f64; 4]>::try_from(v).ok()) else {
            return Err(self.problem(&field("intrinsics"), "four numbers fx, fy, cx, cy are expected"));
        };
        let size = list("resolution").filter(|v| v.len() == 2);
        let Some([width, height]) = size.and_then(|v| <[f64; 2]>::try_from(v).ok()) else {
            return Err(self.problem(&field("resolution"), "two numbers, width and height, are expected"));
        };
        let coefficients = list("distortion_coeffs").or_else(|| list("distortion_coefficients")).unwrap_or_default();
        const KNOWN: &[&str] = &["equidistant", "radtan", "radial-tangential", "plumb_bob", "none"];
        let distortion = camera["distortion_model"].as_str().unwrap_or("none");
        let model = match distortion {
            "equidistant" => Model::KannalaBrandt,
            "radtan" | "radial-tangential" | "plumb_bob" => Model::BrownConrady,
            "none" => Model::Pinhole,
            other => {
                let what = format!("{other:?} is a lens that hzn does not have{}", suggestion(other, KNOWN));
                return Err(self.problem(&field("distortion_model"), what));
            }
        };
        self.camera(model, [width, height], [fx, fy, cx, cy], &coefficients, &field("distortion_coeffs"))
    }

    fn opencv(&self, top: &Value) -> Result<Config, Problem> {
        let either = |a: &str, b: &str| top.get(a).or_else(|| top.get(b)).cloned().unwrap_or(Value::Null);
        let matrix = matrix(&either("camera_matrix", "K"));
        let Some([fx, skew, cx, _, fy, cy, ..]) = matrix.as_deref().filter(|m| m.len() == 9) else {
            return Err(self.problem("camera_matrix", "a 3x3 matrix is expected"));
        };
        if *skew != 0.0 {
            return Err(
                self.problem("camera_matrix", "has a skew, which hzn's lenses do not have; calibrate without it")
            );
        }
        let size = |key: &str| {
            top[key].as_f64().ok_or_else(|| self.problem(key, "missing: add the picture's size in pixels to the file"))
        };
        let coefficients = self::matrix(&either("distortion_coefficients", "D")).unwrap_or_default();
        let named = self.path.file_name().is_some_and(|n| n.to_string_lossy().to_lowercase().contains("fisheye"));
        let fisheye = top.get("fisheye_model").map_or(named, |f| f.as_f64() == Some(1.0) || f.as_bool() == Some(true));
        let model = match (fisheye, coefficients.iter().any(|k| *k != 0.0)) {
            (true, _) => Model::KannalaBrandt,
            (false, true) => Model::BrownConrady,
            (false, false) => Model::Pinhole,
        };
        let size = [size("image_width")?, size("image_height")?];
        self.camera(model, size, [*fx, *fy, *cx, *cy], &coefficients, "distortion_coefficients")
    }

    fn camera(
        &self,
        model: Model,
        size: [f64; 2],
        [fx, fy, cx, cy]: [f64; 4],
        k: &[f64],
        field: &str,
    ) -> Result<Config, Problem> {
        let whole = |x: f64| (x.fract() == 0.0 && (2.0..=65535.0).contains(&x)).then_some(x as u16);
        let [Some(width), Some(height)] = size.map(whole) else {
            return Err(self.problem("resolution", "width and height must be whole numbers from 2 to 65535"));
        };
        let most = match model {
            Model::KannalaBrandt => 4,
            Model::BrownConrady => 5,
            Model::Equidistant | Model::Pinhole => 0,
        };
        if k.iter().skip(most).any(|k| *k != 0.0) {
            let what =
                format!("{} coefficients, but this lens has {most} in hzn; calibrate without the higher ones", k.len());
            return Err(self.problem(field, what));
        }
        let k = k.iter().copied().take(most).collect();
        let ideal = Config::ideal(model, width, height, fx);
        Ok(Config { fx_px: fx, fy_px: fy, cx_px: cx, cy_px: cy, k, ..ideal })
    }
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(number).collect()
}

/// A number, also where YAML 1.1 writers leave the point out of `1e-05` and a stricter reader sees a text.
fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.trim().parse().ok())
}

/// An OpenCV matrix (its `data`), a list, or a list of rows, flattened.
fn matrix(value: &Value) -> Option<Vec<f64>> {
    let list = value.get("data").unwrap_or(value).as_array()?;
    let mut out = Vec::new();
    for item in list {
        match item {
            Value::Array(row) => out.extend(row.iter().map(number).collect::<Option<Vec<_>>>()?),
            item => out.push(number(item)?),
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Config, String> {
        parse(text, Path::new("cam.yaml"), None).map_err(|e| e.to_string())
    }

    #[test]
    fn kalibr_camchain() {
        let text = "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [-0.05, 0.01, -3.5e-03, 0]\n  \
                    distortion_model: equidistant\n  intrinsics: [1235.0, 1231.0, 963.2, 536.7]\n  \
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
            "cam.yaml: cam0.distortion_model: \"equidistent\" is a lens that hzn does not have; did you mean equidistant?"
        );
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
        assert!(read(&text.replace("image_width", "width")).unwrap_err().contains("image_width: missing"));
        let short =
            "K: [[300, 0, 320], [0, 300, 240], [0, 0, 1]]\nD: [0, 0, 0, 0]\nimage_width: 640\nimage_height: 480\n";
        assert_eq!(read(short).unwrap().model, Model::Pinhole);
    }

    #[test]
    fn what_is_no_camera_file_says_so() {
        assert!(read("a: 1\n").unwrap_err().contains("Kalibr camchain"));
        assert!(read("a: [1\n").unwrap_err().contains("not valid YAML"));
        assert!(read("").is_err());
    }
}
