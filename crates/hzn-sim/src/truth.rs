//! The truth about a scene: a row of truth.csv, and the file.

use std::path::{Path, PathBuf};

use hzn_core::body::{AU_KM, Kind, MOON_RADIUS_KM, SUN_RADIUS_KM};
use hzn_core::camera::Camera;
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::{Cam, Ecef, UnitVec3};
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::error::SceneError;
use crate::globe::{Globe, View};
use crate::scene::{Light, Scene};

/// Smallest length of visible limb with which a picture counts as showing a limb, in pixels.
pub const LIMB_IN_VIEW_PX: f64 = 50.0;

/// The truth about one picture; the fields are the columns of truth.csv, in their order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Truth {
    /// Name of the picture's file, without its folder.
    pub file: String,
    /// Time in seconds.
    pub time_s: f64,
    /// The body's kind as in sensor.toml.
    pub body: String,
    /// 1 when at least 50 px of lit limb are in view and not behind the vehicle, else 0.
    pub limb: u8,
    /// Limb axis in the camera frame, first component of the unit vector. For spheres it is the direction to the
    /// centre.
    pub axis_x: f64,
    /// Second component of the axis.
    pub axis_y: f64,
    /// Third component of the axis.
    pub axis_z: f64,
    /// Half-angle of the limb's cone in degrees. For an ellipsoid, its cot² is the mean of the cot² of the two
    /// principal half-angles.
    pub half_angle_deg: f64,
    /// Altitude of the camera above the surface in kilometres (geodetic for `earth`).
    pub altitude_km: f64,
    /// Direction to the Sun in the camera frame, first component of the unit vector; empty if the scene has no Sun.
    pub sun_x: Option<f64>,
    /// Second component of the direction to the Sun.
    pub sun_y: Option<f64>,
    /// Third component of the direction to the Sun.
    pub sun_z: Option<f64>,
    /// Direction to the Moon in the camera frame, first component of the unit vector; empty if the scene has no Moon.
    pub moon_x: Option<f64>,
    /// Second component of the direction to the Moon.
    pub moon_y: Option<f64>,
    /// Third component of the direction to the Moon.
    pub moon_z: Option<f64>,
    /// Attitude as a quaternion from camera to ECEF: scalar part.
    pub qw: f64,
    /// First vector component of the attitude.
    pub qx: f64,
    /// Second vector component of the attitude.
    pub qy: f64,
    /// Third vector component of the attitude.
    pub qz: f64,
}

impl Truth {
    /// Returns the limb axis in the camera frame; `None` if the row holds no direction.
    pub fn axis(&self) -> Option<UnitVec3<Cam, f64>> {
        UnitVec3::try_new([self.axis_x, self.axis_y, self.axis_z])
    }
    /// Returns true if the picture shows enough limb for an answer.
    pub fn has_limb(&self) -> bool {
        self.limb != 0
    }
}

/// The reason why a truth.csv cannot be used, displayed as `truth.csv:3: axis_x: …`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TruthError {
    /// The file.
    pub path: PathBuf,
    /// Line number, from 1.
    pub line: Option<u64>,
    /// The column.
    pub column: Option<String>,
    /// Description of the error, and how to correct it.
    pub what: String,
}

impl core::fmt::Display for TruthError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(column) = &self.column {
            write!(f, ": {column}")?;
        }
        write!(f, ": {}", self.what)
    }
}

impl core::error::Error for TruthError {}

/// Reads a truth.csv. Columns are found by name. The columns of Sun and Moon may be missing; unknown columns are
/// ignored.
///
/// # Errors
/// Fails if the file cannot be read or has no rows, if a column is missing, or if a cell is not a finite number. Also
/// fails if an axis or a quaternion does not have unit length, or if a half-angle is not above 0° and below 90°.
pub fn load(path: &Path) -> Result<Vec<Truth>, TruthError> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        let what = match e.kind() {
            std::io::ErrorKind::NotFound => "no such file".to_owned(),
            _ => format!("cannot be read: {e}"),
        };
        TruthError { path: path.to_owned(), line: None, column: None, what }
    })?;
    parse(&text, path)
}

/// Parses the text of a truth.csv, like [`load`]; messages name `path`.
///
/// # Errors
/// Fails like [`load`].
pub fn parse(text: &str, path: &Path) -> Result<Vec<Truth>, TruthError> {
    let wrong = |line: Option<u64>, column: Option<&str>, what: String| TruthError {
        path: path.to_owned(),
        line,
        column: column.map(str::to_owned),
        what,
    };
    // Spreadsheets begin the file with a byte-order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| wrong(Some(1), None, format!("not valid CSV: {e}")))?.clone();
    const NEEDED: [&str; 13] = [
        "file",
        "time_s",
        "body",
        "limb",
        "axis_x",
        "axis_y",
        "axis_z",
        "half_angle_deg",
        "altitude_km",
        "qw",
        "qx",
        "qy",
        "qz",
    ];
    if let Some(missing) = NEEDED.into_iter().find(|name| !header.iter().any(|h| h == *name)) {
        return Err(wrong(Some(1), Some(missing), "this column is missing; is it a truth.csv?".into()));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map(csv::Position::line);
            wrong(line, None, format!("not valid CSV: {e}"))
        })?;
        let line = record.position().map(csv::Position::line);
        let row: Truth = record.deserialize(Some(&header)).map_err(|e| match e.kind() {
            csv::ErrorKind::Deserialize { err, .. } => {
                let column = err.field().and_then(|i| header.get(i as usize));
                wrong(line, column, err.kind().to_string())
            }
            _ => wrong(line, None, e.to_string()),
        })?;
        let numbers = NEEDED.iter().zip([
            0.0,
            row.time_s,
            0.0,
            0.0,
            row.axis_x,
            row.axis_y,
            row.axis_z,
            row.half_angle_deg,
            row.altitude_km,
            row.qw,
            row.qx,
            row.qy,
            row.qz,
        ]);
        for (name, x) in numbers {
            if !x.is_finite() {
                return Err(wrong(line, Some(name), format!("{x} is not a finite number")));
            }
        }
        let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let unit = |v: &[f64]| (length(v) - 1.0).abs() < 1e-3;
        if !unit(&[row.axis_x, row.axis_y, row.axis_z]) {
            return Err(wrong(line, Some("axis_x, axis_y, axis_z"), "must have length 1".into()));
        }
        if !unit(&[row.qw, row.qx, row.qy, row.qz]) {
            return Err(wrong(line, Some("qw, qx, qy, qz"), "must have length 1".into()));
        }
        if !(row.half_angle_deg > 0.0 && row.half_angle_deg < 90.0) {
            let what = format!("{} is not a half-angle: it must be above 0 and below 90", row.half_angle_deg);
            return Err(wrong(line, Some("half_angle_deg"), what));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(wrong(None, None, "has no rows".into()));
    }
    Ok(rows)
}

impl Scene {
    /// Returns the truth of the scene, for the name and time of a picture.
    ///
    /// # Errors
    /// Fails if the camera, the position or the light is invalid.
    pub fn truth(&self, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        let globe = Globe::new(&self.body);
        let raised = globe.raised(self.body.limb_height_km * 1e3);
        let cone = LimbCone::try_new(self.pose.position_m, raised.a_m, raised.b_m).ok_or(SceneError::Pose)?;
        let ecef_to_cam = self.pose.cam_to_ecef().ok_or(SceneError::Pose)?.inverse();
        let moon = self.moon_ecef_m.and_then(|moon| {
            let to = [0, 1, 2].map(|i| moon[i] - self.pose.position_m[i]);
            Some(ecef_to_cam.apply(&UnitVec3::<Ecef, f64>::try_new(to)?).xyz())
        });
        let [axis_x, axis_y, axis_z] = ecef_to_cam.apply(&cone.axis).xyz();
        let sun = match self.light {
            Light::Sun { direction, .. } => {
                let direction = UnitVec3::<Ecef, f64>::try_new(direction).ok_or(SceneError::Sun)?;
                Some(ecef_to_cam.apply(&direction).xyz())
            }
            Light::Full | Light::Sector { .. } => None,
        };
        let [qw, qx, qy, qz] = self.pose.unit_quaternion_wxyz();
        Ok(Truth {
            file: file.to_owned(),
            time_s,
            body: self.body.kind.name().to_owned(),
            limb: u8::from(self.visible_limb_px()? >= LIMB_IN_VIEW_PX),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: cone.mean_half_angle_rad().to_degrees(),
            altitude_km: globe.altitude_m(self.pose.position_m) * 1e-3,
            sun_x: sun.map(|s| s[0]),
            sun_y: sun.map(|s| s[1]),
            sun_z: sun.map(|s| s[2]),
            moon_x: moon.map(|m| m[0]),
            moon_y: moon.map(|m| m[1]),
            moon_z: moon.map(|m| m[2]),
            qw,
            qx,
            qy,
            qz,
        })
    }

    /// Returns the truth about Sun or Moon in a scene whose camera flies around the Earth. For every other kind it is
    /// [`Scene::truth`].
    ///
    /// # Errors
    /// Fails like [`Scene::truth`], and if the scene does not have the body.
    pub fn body_truth(&self, kind: Kind, file: &str, time_s: f64) -> Result<Truth, SceneError> {
        let truth = self.truth(file, time_s)?;
        let Some(disc) = self.sky_disc(kind)? else { return Ok(truth) };
        let ecef_to_cam = self.pose.cam_to_ecef().ok_or(SceneError::Pose)?.inverse();
        let direction = UnitVec3::<Ecef, f64>::try_new(disc.direction).ok_or(SceneError::Sun)?;
        let [axis_x, axis_y, axis_z] = ecef_to_cam.apply(&direction).xyz();
        Ok(Truth {
            body: kind.name().to_owned(),
            limb: u8::from(self.visible_px(kind)? >= LIMB_IN_VIEW_PX),
            axis_x,
            axis_y,
            axis_z,
            half_angle_deg: disc.half_angle_rad.to_degrees(),
            altitude_km: disc.distance_m * 1e-3 - disc.radius_km,
            ..truth
        })
    }

    /// Returns the length in pixels of the limb that is in the picture, lit and not hidden. `kind` selects the scene's
    /// own body, or Sun or Moon next to it.
    ///
    /// # Errors
    /// Fails like [`Scene::body_truth`].
    pub fn visible_px(&self, kind: Kind) -> Result<f64, SceneError> {
        let Some(disc) = self.sky_disc(kind)? else { return self.visible_limb_px() };
        let camera = Camera::<f64>::try_new(&self.camera)?;
        let ecef_to_cam = self.pose.cam_to_ecef().ok_or(SceneError::Pose)?.inverse();
        let view = View::try_new(Globe::new(&self.body), &self.pose).ok_or(SceneError::Pose)?;
        let centre = Vector3::from(disc.direction);
        let helper = if centre.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let a = centre.cross(&helper).normalize();
        let b = centre.cross(&a);
        let sun = match (kind, self.light) {
            (Kind::Moon, Light::Sun { direction, .. }) => Some(Vector3::from(direction)),
            _ => None,
        };
        let (w, h) = (f64::from(self.camera.width), f64::from(self.camera.height));
        const STEPS: i32 = 720;
        let mut visible_px = 0.0;
        let mut last = None;
        for i in 0..=STEPS {
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(i) / f64::from(STEPS));
            let outward = a * cos + b * sin;
            let ray = (centre + outward * libm::tan(disc.half_angle_rad)).normalize();
            let point = UnitVec3::<Ecef, f64>::try_new(ray.into()).and_then(|r| {
                let cam = ecef_to_cam.apply(&r);
                let p = camera.project(&cam)?;
                let inside = p.u >= -0.5 && p.v >= -0.5 && p.u <= w - 0.5 && p.v <= h - 0.5;
                let behind = view.intersect(cam.xyz()).miss <= 0.0;
                let lit = sun.is_none_or(|s| s.dot(&outward) > 0.05);
                let hidden = self.foreground.iter().any(|f| f.contains([p.u, p.v]));
                (inside && !behind && lit && !hidden).then_some(p)
            });
            if let (Some(p), Some(q)) = (point, last) {
                let q: ImagePoint<f64> = q;
                visible_px += libm::hypot(p.u - q.u, p.v - q.v);
            }
            last = point;
        }
        Ok(visible_px)
    }

    /// Returns Sun or Moon as a disc in the sky; `None` for other kinds, and if `kind` is the scene's own body.
    fn sky_disc(&self, kind: Kind) -> Result<Option<SkyDisc>, SceneError> {
        if self.body.kind == kind {
            return Ok(None);
        }
        match kind {
            Kind::Sun => match self.light {
                Light::Sun { direction, .. } => {
                    let direction = Vector3::from(direction).try_normalize(1e-12).ok_or(SceneError::Sun)?;
                    let distance_m = AU_KM * 1e3;
                    Ok(Some(SkyDisc::new(direction * distance_m, SUN_RADIUS_KM)))
                }
                Light::Full | Light::Sector { .. } => Err(SceneError::Sun),
            },
            Kind::Moon => {
                let moon = Vector3::from(self.moon_ecef_m.ok_or(SceneError::Moon)?);
                Ok(Some(SkyDisc::new(moon - Vector3::from(self.pose.position_m), MOON_RADIUS_KM)))
            }
            _ => Ok(None),
        }
    }
}

/// A distant body as the camera sees it.
struct SkyDisc {
    direction: [f64; 3],
    distance_m: f64,
    half_angle_rad: f64,
    radius_km: f64,
}

impl SkyDisc {
    fn new(to_m: Vector3<f64>, radius_km: f64) -> Self {
        let distance_m = to_m.norm();
        let half_angle_rad = libm::asin((radius_km * 1e3 / distance_m).min(1.0));
        Self { direction: (to_m / distance_m).into(), distance_m, half_angle_rad, radius_km }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::{Look, Pose, position_m};
    use hzn_core::camera::{Config, Model};

    fn scene(look: Look) -> Scene {
        Scene::new(Config::ideal(Model::Pinhole, 640, 480, 400.0), Pose::looking(position_m(0.0, 0.0, 200.0), look))
    }

    #[test]
    fn a_table_is_read_back_and_wrong_cells_are_named() {
        let rows = [scene(Look::default()).truth("a.png", 1.5).unwrap()];
        let mut table = csv::Writer::from_writer(Vec::new());
        rows.iter().for_each(|r| table.serialize(r).unwrap());
        let text = String::from_utf8(table.into_inner().unwrap()).unwrap();
        let path = Path::new("truth.csv");
        let read = parse(&text, path).unwrap();
        assert_eq!((read[0].file.as_str(), read[0].sun_x, read[0].axis_y), ("a.png", None, rows[0].axis_y));
        let says = |text: &str| parse(text, path).unwrap_err().to_string();
        assert_eq!(says(&text.replace(",1.5,", ",soon,")), "truth.csv:2: time_s: invalid float literal");
        assert_eq!(says(&text.replace(",1.5,", ",nan,")), "truth.csv:2: time_s: NaN is not a finite number");
        assert_eq!(
            says(&text.replace("axis_x", "x")),
            "truth.csv:1: axis_x: this column is missing; is it a truth.csv?"
        );
        assert_eq!(says(text.lines().next().unwrap()), "truth.csv: has no rows");
        let shown = rows[0].half_angle_deg.to_string();
        assert!(says(&text.replace(&shown, "97")).contains("half_angle_deg: 97 is not a half-angle"));
        assert!(load(Path::new("/nowhere/truth.csv")).unwrap_err().to_string().ends_with("no such file"));
    }

    #[test]
    fn straight_down_at_the_equator() {
        let t = scene(Look::off_nadir(0.0, 0.0, 0.0)).truth("a.png", 1.5).unwrap();
        assert!((t.axis_z - 1.0).abs() < 1e-12 && (t.altitude_km - 200.0).abs() < 1e-6);
        assert_eq!((t.limb, t.body.as_str(), t.file.as_str(), t.time_s), (0, "earth", "a.png", 1.5));
        // sin α = (R + 17 km)/(R + 200 km). The radius R lies between the two radii of curvature of the ellipsoid.
        let alpha = |r: f64| ((r + 17.0) / (r + 200.0)).asin().to_degrees();
        assert!(t.half_angle_deg > alpha(6330.0) && t.half_angle_deg < alpha(6380.0));
    }

    #[test]
    fn level_camera_sees_the_limb_and_the_axis_below() {
        let t = scene(Look { depression_rad: 0.2, ..Look::default() }).truth("", 0.0).unwrap();
        assert!(t.has_limb() && t.axis_y > 0.97 && t.axis_z > 0.19 && t.sun_x.is_none());
        // A camera that looks up sees no limb.
        assert!(!scene(Look { depression_rad: -0.8, ..Look::default() }).truth("", 0.0).unwrap().has_limb());
    }

    #[test]
    fn an_unlit_limb_does_not_count() {
        let mut s = scene(Look { depression_rad: 0.2, ..Look::default() });
        s.light = Light::Sun { direction: [-1.0, 0.0, 0.0], twilight_rad: 0.1 };
        let t = s.truth("", 0.0).unwrap();
        assert!(!t.has_limb() && t.sun_y.is_some_and(|y| y > 0.97));
    }
}
