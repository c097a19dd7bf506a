//! Reads OpenCV's files, ROS's camera_info and Foxglove's CameraCalibration.

use serde_json::{Map, Value};

use super::camera_matrix::camera_matrix;
use super::lens::{Coefficients, Lens};
use super::loaded::Loaded;
use super::reader::Reader;
use super::values::{matrix, number, numbers};
use crate::Problem;

/// Names of the camera matrix, in the form of [`plain`].
pub(super) const MATRIX: &[&str] = &["cameramatrix", "k", "mtx", "intrinsicmatrix"];
const DISTORTION: &[&str] = &["distortioncoefficients", "d", "distcoeffs", "distcoefs", "dist"];
const WIDTH: &[&str] = &["imagewidth", "width"];
const HEIGHT: &[&str] = &["imageheight", "height"];
const SIZE: &[&str] = &["imagesize", "size", "resolution"];
const MODEL: &[&str] = &["distortionmodel"];
const FISHEYE: &[&str] = &["fisheyemodel"];
/// Names of the RMS distance of the corners from where the calibration expects them, in pixels.
const ERROR: &[&str] =
    &["avgreprojectionerror", "reprojectionerror", "rmsreprojectionerror", "meanreprojectionerror", "rms", "rmserror"];
/// The names of all values that are read.
pub(super) const VALUES: &[&[&str]] = &[MATRIX, DISTORTION, WIDTH, HEIGHT, SIZE, MODEL, FISHEYE, ERROR];
/// Reprojection error above which a calibration is doubtful. Corners are found to a tenth of a pixel, and even a
/// blurred board or a lens with a coefficient too few rarely leaves a pixel; 2 px is a calibration that failed.
const DOUBTFUL_ERROR_PX: f64 = 2.0;

/// Reads a file with a camera matrix.
pub(super) fn read(reader: &Reader<'_>, top: &Map<String, Value>) -> Result<Loaded, Problem> {
    let (key, value) = find(reader, top, MATRIX)?.unwrap_or(("camera_matrix", &Value::Null));
    let intrinsics = read_matrix(reader, value, key)?;
    let (key, value) = find(reader, top, DISTORTION)?.unwrap_or(("distortion_coefficients", &Value::Null));
    let coefficients = Coefficients { values: reader.coefficients(Some(value), key)?, field: key.to_owned() };
    let size = read_size(reader, top)?;
    let word = find(reader, top, MODEL)?;
    let stated = reader.lens(word.map(|(_, value)| value), "distortion_model")?;
    let flag = find(reader, top, FISHEYE)?.map(|(_, value)| read_flag(reader, value)).transpose()?;
    let lens = match (stated, flag) {
        (Some(lens), Some(flag)) if flag != (lens == Lens::Fisheye) => {
            let what = "contradicts distortion_model; remove the wrong one of the two";
            return Err(reader.problem("fisheye_model", what));
        }
        (Some(lens), _) => lens,
        (None, Some(true)) => Lens::Fisheye,
        (None, Some(false)) => Lens::PlumbBob,
        (None, None) => lens_of_shape(reader, value, &coefficients)?,
    };
    let (size, intrinsics) = read_window(reader, top, size, intrinsics)?;
    reader.loaded(lens, &coefficients, size, intrinsics)
}

/// Returns a warning for a calibration whose reprojection error is too large.
pub(super) fn doubt(reader: &Reader<'_>, top: &Map<String, Value>) -> Option<Problem> {
    let errors = top.iter().filter(|(key, _)| ERROR.contains(&plain(key).as_str()));
    let (key, px) = errors.filter_map(|(key, value)| Some((key, number(value)?))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let what = format!(
        "the reprojection error is {px:.3} px, so this calibration has probably failed; a good one is below 1 px. \
         Calibrate again, and look at each picture's error"
    );
    (px > DOUBTFUL_ERROR_PX).then(|| reader.problem(key, what))
}

/// Returns size and intrinsic parameters of the pictures that a ROS camera sends: `roi` cuts a window out of the full
/// picture, and `binning_x` and `binning_y` reduce it. The formula is that of ROS's image_geometry.
fn read_window(
    reader: &Reader<'_>,
    top: &Map<String, Value>,
    size: [f64; 2],
    [fx, fy, cx, cy]: [f64; 4],
) -> Result<([f64; 2], [f64; 4]), Problem> {
    let whole = |value: Option<&Value>, field: &str| {
        let number = value.map_or(Some(0.0), number).filter(|x| *x >= 0.0 && x.fract() == 0.0);
        number.ok_or_else(|| reader.problem(field, "a whole number of pixels is expected"))
    };
    let roi = |key: &str| whole(top.get("roi").and_then(|roi| roi.get(key)), &format!("roi.{key}"));
    let offset = [roi("x_offset")?, roi("y_offset")?];
    let window = [roi("width")?, roi("height")?];
    // A window of 0 pixels is the full picture, and a binning of 0 is none.
    let binning =
        [whole(top.get("binning_x"), "binning_x")?.max(1.0), whole(top.get("binning_y"), "binning_y")?.max(1.0)];
    let cut = |k: usize| if window[k] > 0.0 { window[k] } else { size[k] };
    for (k, (field, lines)) in [("roi.x_offset", "columns"), ("roi.y_offset", "rows")].into_iter().enumerate() {
        if offset[k] + cut(k) > size[k] {
            let (from, n, all) = (offset[k], cut(k), size[k]);
            let what = format!("{n} {lines} from {from} on do not lie in the whole picture, which has {all} {lines}");
            return Err(reader.problem(field, what));
        }
    }
    let side = |k: usize| (cut(k) / binning[k]).floor();
    let centre = |k: usize, c: f64| (c - offset[k]) / binning[k];
    Ok(([side(0), side(1)], [fx / binning[0], fy / binning[1], centre(0, cx), centre(1, cy)]))
}

/// Returns the lens that the shape of the coefficients tells. `cv2.fisheye.calibrate` returns a column of four.
/// `cv2.calibrateCamera` returns at least five. A row or a plain list of four may be either.
fn lens_of_shape(reader: &Reader<'_>, value: &Value, coefficients: &Coefficients) -> Result<Lens, Problem> {
    if coefficients.values.as_ref().is_none_or(|k| k.len() != 4) {
        return Ok(Lens::PlumbBob);
    }
    let side = |key: &str| value.get(key).and_then(Value::as_u64);
    let column_of_rows = value.as_array().is_some_and(|rows| rows.len() == 4 && rows.iter().all(Value::is_array));
    if (side("rows") == Some(4) && side("cols") == Some(1)) || column_of_rows {
        return Ok(Lens::Fisheye);
    }
    let what = "four coefficients are k1 to k4 of a fisheye lens (cv2.fisheye) or k1, k2, p1, p2 of Brown-Conrady \
                (cv2.calibrateCamera): add `fisheye_model: 1` or `fisheye_model: 0` to the file";
    Err(reader.problem(&coefficients.field, what))
}

/// Finds the value whose name is one of these.
fn find<'a>(
    reader: &Reader<'_>,
    top: &'a Map<String, Value>,
    names: &[&str],
) -> Result<Option<(&'a str, &'a Value)>, Problem> {
    let mut found = top.iter().filter(|(key, _)| names.contains(&plain(key).as_str()));
    let first = found.next().map(|(key, value)| (key.as_str(), value));
    match (first, found.next()) {
        (Some((one, _)), Some((other, _))) => {
            Err(reader.problem(other, format!("means the same as {one}; remove the wrong one of the two")))
        }
        (first, _) => Ok(first),
    }
}

/// Returns a name in small letters without `_` and `-`: OpenCV's samples changed `Camera_Matrix` to `camera_matrix`,
/// and programs write `cameraMatrix`.
pub(super) fn plain(name: &str) -> String {
    name.chars().filter(|c| !matches!(c, '_' | '-')).map(|c| c.to_ascii_lowercase()).collect()
}

/// Returns width and height.
fn read_size(reader: &Reader<'_>, top: &Map<String, Value>) -> Result<[f64; 2], Problem> {
    if let Some((key, value)) = find(reader, top, SIZE)? {
        let pair = numbers(value).and_then(|v| <[f64; 2]>::try_from(v).ok());
        return pair.ok_or_else(|| reader.problem(key, "two numbers, width and height, are expected"));
    }
    let side = |names: &[&str], name: &str| match find(reader, top, names)? {
        Some((key, value)) => number(value).ok_or_else(|| reader.problem(key, "a number of pixels is expected")),
        None => Err(reader.problem(
            name,
            "missing: add the picture's size in pixels to the file (image_width, image_height), or pass --size \
             WIDTHxHEIGHT to hzn camera convert",
        )),
    };
    let in_file = find(reader, top, WIDTH)?.or(find(reader, top, HEIGHT)?).is_some();
    match reader.size_px.filter(|_| !in_file) {
        Some(size_px) => Ok(size_px.map(f64::from)),
        None => Ok([side(WIDTH, "image_width")?, side(HEIGHT, "image_height")?]),
    }
}

/// Returns whether `fisheye_model` is 1.
fn read_flag(reader: &Reader<'_>, value: &Value) -> Result<bool, Problem> {
    match (value.as_bool(), number(value)) {
        (Some(flag), _) => Ok(flag),
        (_, Some(x)) if x == 0.0 || x == 1.0 => Ok(x == 1.0),
        _ => Err(reader.problem("fisheye_model", format!("is {value}; 1 or 0 is expected"))),
    }
}

/// Returns fx, fy, cx, cy of a camera matrix, in pixels.
fn read_matrix(reader: &Reader<'_>, value: &Value, key: &str) -> Result<[f64; 4], Problem> {
    let Some(Ok(m)) = matrix(value).map(<[f64; 9]>::try_from) else {
        return Err(reader.problem(key, "a 3x3 matrix of finite numbers is expected"));
    };
    camera_matrix(m).map_err(|what| reader.problem(key, what))
}
