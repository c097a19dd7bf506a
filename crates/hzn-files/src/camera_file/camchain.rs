//! Turns the files of further tools into a Kalibr camchain, which [`kalibr`](super::kalibr) reads.
//!
//! Their lenses have the same equations and other names. Metashape and COLMAP count pixels from the corner of the first
//! pixel, and hzn from its centre, so that their principal point is smaller by 0.5 px here.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::values::{matrix, number};
use crate::Problem;

/// The models of COLMAP that are lenses of hzn: name, number of focal lengths, and the words of Kalibr.
const COLMAP: &[(&str, usize, usize, &str)] = &[
    ("SIMPLE_PINHOLE", 1, 0, "none"),
    ("PINHOLE", 2, 0, "none"),
    ("SIMPLE_RADIAL", 1, 1, "radtan"),
    ("RADIAL", 1, 2, "radtan"),
    ("OPENCV", 2, 4, "radtan"),
    ("FULL_OPENCV", 2, 8, "rational_polynomial"),
    ("SIMPLE_FISHEYE", 1, 0, "equidistant"),
    ("FISHEYE", 2, 0, "equidistant"),
    ("SIMPLE_RADIAL_FISHEYE", 1, 1, "equidistant"),
    ("RADIAL_FISHEYE", 1, 2, "equidistant"),
    ("OPENCV_FISHEYE", 2, 4, "equidistant"),
];
/// The distance of the centre of a pixel from its corner, px.
const CORNER_PX: f64 = 0.5;

/// Returns the camchain of COLMAP's `cameras.txt`; `None` for another text. Its cameras are `cam` and their number.
pub(super) fn of_colmap(text: &str, path: &Path) -> Option<Result<Value, Problem>> {
    let lines = || text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let is_camera = |line: &str| {
        let words = words(line);
        words.len() > 4 && words[0].parse::<u32>().is_ok() && words[2..].iter().all(|w| w.parse::<f64>().is_ok())
    };
    if lines().next().is_none_or(|(_, first)| !is_camera(first)) {
        return None;
    }
    let mut chain = Map::new();
    for (n, line) in lines() {
        match colmap_camera(&words(line)) {
            Ok(camera) => {
                let number = line.split_whitespace().next().unwrap_or_default();
                chain.insert(format!("cam{number}"), camera);
            }
            Err(what) => return Some(Err(Problem::new(path, what).at_line(n + 1))),
        }
    }
    Some(Ok(Value::Object(chain)))
}

/// Returns a camera of COLMAP: CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[].
fn colmap_camera(words: &[String]) -> Result<Value, String> {
    let name = words.get(1).map_or("", String::as_str);
    let Some((_, focals, coefficients, lens)) = COLMAP.iter().find(|(known, ..)| *known == name) else {
        let known: Vec<&str> = COLMAP.iter().map(|(known, ..)| *known).collect();
        return Err(format!("{name:?} is no lens that hzn has; the models are {}", known.join(", ")));
    };
    let numbers: Vec<f64> = words.iter().skip(2).filter_map(|w| w.parse().ok()).collect();
    if numbers.len() != 2 + focals + 2 + coefficients {
        return Err(format!(
            "{name} has {} parameters, but {} are expected",
            numbers.len() - 2,
            focals + 2 + coefficients
        ));
    }
    let (size, rest) = numbers.split_at(2);
    let (focal, rest) = rest.split_at(*focals);
    let (centre, k) = rest.split_at(2);
    let mut k = k.to_vec();
    if *lens != "none" {
        k.resize(k.len().max(4), 0.0);
    }
    let [fx, fy] = [focal[0], focal[focals - 1]];
    Ok(json!({
        "camera_model": "pinhole", "distortion_model": lens, "distortion_coeffs": k, "resolution": size,
        "intrinsics": [fx, fy, centre[0] - CORNER_PX, centre[1] - CORNER_PX],
    }))
}

/// Returns the camchain of a file of camodocal (VINS), ORB-SLAM3, Basalt or Metashape; `None` for another file.
pub(super) fn of_document(top: &Map<String, Value>, path: &Path) -> Option<Result<Value, Problem>> {
    let file = Tree { top, path };
    let one = |camera: Result<Value, Problem>| camera.map(|camera| json!({ "cam0": camera }));
    if top.contains_key("model_type") {
        return Some(one(file.camodocal()));
    }
    if top.contains_key("Camera.type") {
        return Some(file.orb_slam());
    }
    if top.contains_key("projection") && top.contains_key("f") {
        return Some(one(file.metashape()));
    }
    let basalt = top.get("value0").and_then(Value::as_object).unwrap_or(top);
    let is_basalt = basalt.get("intrinsics").and_then(|i| i.get(0)).is_some_and(|i| i.get("camera_type").is_some());
    is_basalt.then(|| Tree { top: basalt, path }.basalt())
}

/// The values of a file.
struct Tree<'a> {
    top: &'a Map<String, Value>,
    path: &'a Path,
}

impl Tree<'_> {
    fn problem(&self, field: &str, what: impl Into<String>) -> Problem {
        Problem::new(self.path, what).in_field(field)
    }

    /// Returns the number at a place, `group/name` or `name`.
    fn number(&self, place: &str) -> Result<f64, Problem> {
        self.optional(place)?.ok_or_else(|| self.problem(place, "missing: a number is expected"))
    }

    /// Returns a number that may be missing.
    fn optional(&self, place: &str) -> Result<Option<f64>, Problem> {
        let (first, rest) = place.split_once('/').map_or((place, None), |(first, rest)| (first, Some(rest)));
        let value = self.top.get(first);
        let value = rest.map_or(value, |name| value.and_then(|group| group.get(name)));
        value.map(|v| number(v).ok_or_else(|| self.problem(place, "a number is expected"))).transpose()
    }

    /// Returns the numbers of a group.
    fn numbers(&self, group: &str, names: &[&str]) -> Result<Vec<f64>, Problem> {
        names.iter().map(|name| self.number(&format!("{group}{name}"))).collect()
    }

    /// Reads a camera of camodocal, which VINS uses as well.
    fn camodocal(&self) -> Result<Value, Problem> {
        let size = self.numbers("", &["image_width", "image_height"])?;
        let plane = || self.numbers("distortion_parameters/", &["k1", "k2", "p1", "p2"]);
        let (projection, lens, intrinsics, k) = match self.top["model_type"].as_str().unwrap_or_default() {
            "KANNALA_BRANDT" => {
                // Some writers put the coefficients next to the other ones.
                let in_distortion = self.optional("distortion_parameters/k2")?.is_some();
                let group = if in_distortion { "distortion_parameters/" } else { "projection_parameters/" };
                let k = self.numbers(group, &["k2", "k3", "k4", "k5"])?;
                let intrinsics = self.numbers("projection_parameters/", &["mu", "mv", "u0", "v0"])?;
                ("pinhole", "equidistant", intrinsics, k)
            }
            "PINHOLE" => {
                ("pinhole", "radtan", self.numbers("projection_parameters/", &["fx", "fy", "cx", "cy"])?, plane()?)
            }
            "MEI" => {
                let mut intrinsics = vec![self.number("mirror_parameters/xi")?];
                intrinsics.extend(self.numbers("projection_parameters/", &["gamma1", "gamma2", "u0", "v0"])?);
                ("omni", "radtan", intrinsics, plane()?)
            }
            other => {
                let what = format!("{other:?} is no lens that hzn has; the models are KANNALA_BRANDT, PINHOLE, MEI");
                return Err(self.problem("model_type", what));
            }
        };
        Ok(json!({
            "camera_model": projection, "distortion_model": lens, "distortion_coeffs": k, "intrinsics": intrinsics,
            "resolution": size,
        }))
    }

    /// Reads the cameras of ORB-SLAM3: `Camera1` and `Camera2`, or `Camera` in older files.
    fn orb_slam(&self) -> Result<Value, Problem> {
        let size = self.numbers("", &["Camera.width", "Camera.height"])?;
        let lens = match self.top["Camera.type"].as_str().unwrap_or_default() {
            "PinHole" => "plumb_bob",
            "KannalaBrandt8" => "equidistant",
            "Rectified" => "none",
            other => {
                let what =
                    format!("{other:?} is no lens that hzn has; the types are PinHole, KannalaBrandt8, Rectified");
                return Err(self.problem("Camera.type", what));
            }
        };
        let mut chain = Map::new();
        for (name, group) in [("cam0", "Camera."), ("cam0", "Camera1."), ("cam1", "Camera2.")] {
            if !self.top.contains_key(&format!("{group}fx")) {
                continue;
            }
            let k = match lens {
                "equidistant" => self.numbers(group, &["k1", "k2", "k3", "k4"])?,
                "plumb_bob" => {
                    let at = |name: &str| Ok(self.optional(&format!("{group}{name}"))?.unwrap_or(0.0));
                    ["k1", "k2", "p1", "p2", "k3"].into_iter().map(at).collect::<Result<_, Problem>>()?
                }
                _ => Vec::new(),
            };
            let camera = json!({
                "camera_model": "pinhole", "distortion_model": lens, "distortion_coeffs": k, "resolution": size,
                "intrinsics": self.numbers(group, &["fx", "fy", "cx", "cy"])?,
            });
            chain.insert(name.to_owned(), camera);
        }
        if chain.is_empty() {
            Err(self.problem("Camera1.fx", "missing: a number is expected"))
        } else {
            Ok(chain.into())
        }
    }

    /// Reads the cameras of Basalt: `cam0` is the first in its list.
    fn basalt(&self) -> Result<Value, Problem> {
        let cameras = self.top.get("intrinsics").and_then(Value::as_array).cloned().unwrap_or_default();
        let mut chain = Map::new();
        for (n, camera) in cameras.iter().enumerate() {
            let field = format!("intrinsics[{n}]");
            let size = self.top.get("resolution").and_then(|all| matrix(all.get(n)?));
            let size =
                size.ok_or_else(|| self.problem(&format!("resolution[{n}]"), "width and height are expected"))?;
            let at = |name: &&str| camera["intrinsics"].get(*name).and_then(number);
            let get = |names: &[&str]| {
                let values: Option<Vec<f64>> = names.iter().map(at).collect();
                values.ok_or_else(|| self.problem(&field, format!("the numbers {} are expected", names.join(", "))))
            };
            let plane = get(&["fx", "fy", "cx", "cy"])?;
            let own = |mut own: Vec<f64>| {
                own.extend(&plane);
                own
            };
            let (projection, lens, intrinsics, k) = match camera["camera_type"].as_str().unwrap_or_default() {
                "ds" => ("ds", "none", own(get(&["xi", "alpha"])?), Vec::new()),
                "eucm" => ("eucm", "none", own(get(&["alpha", "beta"])?), Vec::new()),
                "kb4" => ("pinhole", "equidistant", plane, get(&["k1", "k2", "k3", "k4"])?),
                "pinhole" => ("pinhole", "none", plane, Vec::new()),
                "pinhole-radtan8" => {
                    let k = get(&["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"])?;
                    ("pinhole", "rational_polynomial", plane, k)
                }
                other => {
                    let what = format!(
                        "{other:?} is no lens that hzn has; the types are ds, eucm, kb4, pinhole, pinhole-radtan8"
                    );
                    return Err(self.problem(&field, what));
                }
            };
            let camera = json!({
                "camera_model": projection, "distortion_model": lens, "distortion_coeffs": k, "resolution": size,
                "intrinsics": intrinsics,
            });
            chain.insert(format!("cam{n}"), camera);
        }
        Ok(chain.into())
    }

    /// Reads a calibration of Metashape (PhotoScan). Its principal point counts from the middle of the picture, its p1
    /// and p2 are OpenCV's p2 and p1, and b1 is fx − fy.
    fn metashape(&self) -> Result<Value, Problem> {
        let size = self.numbers("", &["width", "height"])?;
        let f = self.number("f")?;
        let at = |name: &str| Ok::<f64, Problem>(self.optional(name)?.unwrap_or(0.0));
        let unknown = |name: &str, what: &str| match at(name)? {
            0.0 => Ok(()),
            value => Err(self.problem(name, format!("is {value}, but {what}; calibrate without it"))),
        };
        unknown("b2", "hzn's lenses have no skew")?;
        let [k1, k2, k3, k4, p1, p2] = [at("k1")?, at("k2")?, at("k3")?, at("k4")?, at("p1")?, at("p2")?];
        let (lens, k) = match self.top["projection"].as_str().unwrap_or_default() {
            "frame" => {
                unknown("k4", "brown-conrady ends at k3")?;
                ("plumb_bob", vec![k1, k2, p2, p1, k3])
            }
            "fisheye" => {
                unknown("p1", "hzn's fisheye lens has no tangential part")?;
                unknown("p2", "hzn's fisheye lens has no tangential part")?;
                ("equidistant", vec![k1, k2, k3, k4])
            }
            other => {
                let what = format!("{other:?} is no lens that hzn has; the projections are frame and fisheye");
                return Err(self.problem("projection", what));
            }
        };
        let centre = |side: usize, offset: f64| 0.5 * size[side] + offset - CORNER_PX;
        Ok(json!({
            "camera_model": "pinhole", "distortion_model": lens, "distortion_coeffs": k, "resolution": size,
            "intrinsics": [f + at("b1")?, f, centre(0, at("cx")?), centre(1, at("cy")?)],
        }))
    }
}
