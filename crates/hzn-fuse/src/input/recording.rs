//! The results of `hzn run` of one camera.

use std::collections::HashSet;
use std::path::Path;

use hzn_core::status::Status;
use hzn_core::{Config, Sensor, camera};
use hzn_files::rig::JOINT;
use hzn_mcap::Row;
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_run::results::Results;
use nalgebra::Matrix3;

use super::cone::{FreeCone, symmetric};
use super::mount;
use crate::error::Error;

/// Largest excess of the common part over the whole covariance, as a fraction: both may be written with few digits.
const MAX_EXCESS: f64 = 1e-3;

/// A body that a camera sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Body {
    /// The axis of the Earth's limb.
    Limb,
    /// The Sun.
    Sun,
    /// The Moon.
    Moon,
    /// What another sensor measures: the magnetic field, a beacon, or the Sun.
    Other,
}

impl Body {
    /// Returns the word for messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Limb => "limb",
            Self::Sun => "sun",
            Self::Moon => "moon",
            Self::Other => "direction",
        }
    }
}

/// The position of a body's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centre {
    /// Position, m.
    pub position_m: Vector<Cam>,
    /// Its covariance, m².
    pub covariance_m2: Covariance<Cam>,
}

/// A direction that a camera measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Time by the clock of the recording, s.
    pub time_s: f64,
    /// The body.
    pub body: Body,
    /// Unit vector.
    pub axis: Vector<Cam>,
    /// Its covariance without the error of the limb height, rad².
    pub covariance_rad2: Covariance<Cam>,
    /// The part of this covariance whose error is the same in the next picture, rad²; `None` if the recording does not
    /// have it.
    pub common_rad2: Option<Covariance<Cam>>,
    /// The same direction from outside, if the recording has it.
    pub reference: Option<Vector<Fixed>>,
    /// Altitude of the vehicle above the ellipsoid that the sensor was told, km.
    pub altitude_km: Option<f64>,
    /// Derivative of the axis by the error of the limb height, 1/km.
    pub by_limb_height: Vector<Cam>,
    /// The position of the body's centre, if the recording has it.
    pub centre: Option<Centre>,
    /// The freely fitted cone of a limb, if the recording has it and the sensor is known.
    pub cone: Option<FreeCone>,
    /// Index of the row in the recording.
    pub row: usize,
}

/// A recording.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// Name of the camera: that of the file without its ending.
    pub name: String,
    /// Whether it is a table of directions in the vehicle's axes, and not of a camera.
    pub is_table: bool,
    /// The mount; `None` if the recording does not have it.
    pub mount: Option<Rotation<Cam, Vehicle>>,
    /// The lens, if the recording has a sensor.toml. The joint answers of a rig have no lens of their own.
    pub camera: Option<camera::Config>,
    /// 1-sigma of the limb height that the sensor was told, km.
    pub limb_sigma_km: Option<f64>,
    /// 1-sigma of the altitude that the sensor was told, km; `None` if no sensor.toml tells another than the default.
    pub altitude_sigma_km: Option<f64>,
    /// Seconds that are added to the times of the recording to get those of the inertial unit.
    pub clock_offset_s: f64,
    /// The directions, in the order of the recording.
    pub seen: Vec<Seen>,
    /// All rows, for frames.csv.
    pub rows: Vec<Row>,
    /// Rows with an answer that are not used, because they have no time.
    pub without_time: usize,
    /// The damage of the file in words; `None` if it was read as a whole.
    pub lost: Option<String>,
    /// Rows with an answer that are not used, because nobody knows where their body is.
    pub other_bodies: usize,
    /// Rows with an answer that are not used, because a number of the axis, the position or a covariance is missing.
    pub incomplete: usize,
    /// Rows with an answer that are not used, because an earlier row has the same body and time.
    pub duplicate: usize,
    /// Rows with an answer that are not used, because no answer has such numbers; with what is wrong with the first.
    pub impossible: Option<(usize, String)>,
}

/// Reads a recording of `hzn run`: .mcap, .csv or .jsonl. Of a rig's results, the joint answers are taken. `told` is
/// the sensor.toml that the pictures were processed with, for a recording that does not contain it.
///
/// # Errors
/// The file is not a recording, or its mount is not a rotation.
pub fn recording(path: &Path, told: Option<&Path>) -> Result<Recording, Error> {
    let Results { rows, sensor_toml, lost, .. } = hzn_run::results::read(path)?;
    let config = match &sensor_toml {
        None => told.map(hzn_files::sensor::load).transpose().map_err(Error::unusable)?.map(|sensor| sensor.config),
        Some(text) => Some(hzn_files::sensor::parse(text, Path::new("sensor.toml")).map_err(Error::unusable)?.config),
    };
    let name = name_of(path);
    let shown = path.display();
    let recording =
        Recording::new(name, rows, config.as_ref()).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
    let recording = Recording { lost, ..recording };
    if recording.seen.is_empty() && recording.without_time > 0 {
        let what = "no picture has a time; a filter needs one: give the sequence a frames.csv with times";
        return Err(Error::unusable(format!("{shown}: {what}")));
    }
    Ok(recording)
}

/// Returns the name of the camera whose results are in a file: that of the file without its ending.
pub fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

impl Recording {
    /// Makes a recording from the rows of a camera, with the sensor.toml that they were made with, if it is known. Of
    /// the rows of a rig, the joint answers are taken: a sensor whose axes are those of the vehicle.
    ///
    /// # Errors
    /// The mount is not a rotation, or the rows of a rig have no joint answer.
    pub fn new(name: String, mut rows: Vec<Row>, config: Option<&Config>) -> Result<Self, Error> {
        let is_rig = rows.iter().any(|row| row.head.is_some());
        // The heads' answers are parts of the joint one.
        rows.retain(|row| !is_rig || row.head.as_deref() == Some(JOINT));
        if is_rig && rows.is_empty() {
            return Err(Error::unusable("these are heads of a rig without its joint answers"));
        }
        let told = config.and_then(|c| c.mount).map(mount::of_config).transpose();
        let told = told.map_err(|e| Error::unusable(format!("sensor.toml: [mount] {e}")))?;
        let largest = |of: fn(&hzn_core::body::Config) -> f64| {
            config.map(|c| c.each_body().iter().filter(|b| is_earth(b.kind.name())).map(of).fold(0.0, f64::max))
        };
        let limb_sigma_km = largest(|b| b.limb_height_sigma_km);
        let not_told_km = hzn_core::body::Config::default().altitude_sigma_km;
        let mut recording = Self {
            name,
            mount: if is_rig { Some(Rotation::identity()) } else { told },
            camera: config.filter(|_| !is_rig).map(|c| c.camera.clone()),
            limb_sigma_km,
            // The default stands for a position from a receiver; with a told altitude nobody has said it.
            altitude_sigma_km: largest(|b| b.altitude_sigma_km).filter(|sigma_km| *sigma_km != not_told_km),
            ..Self::default()
        };
        let (sensor, mut known) = (config.and_then(|config| Sensor::new(config).ok()), HashSet::new());
        for (index, row) in rows.iter().enumerate().filter(|(_, row)| row.status == Status::Ok) {
            let body = match row.body.as_str() {
                "sun" => Body::Sun,
                "moon" => Body::Moon,
                name if is_earth(name) => Body::Limb,
                _ => {
                    recording.other_bodies += 1;
                    continue;
                }
            };
            let Some(time_s) = row.time_s else {
                recording.without_time += 1;
                continue;
            };
            if let Some(what) = hzn_run::results::find_impossible(row) {
                recording.add_impossible(row, what);
                continue;
            }
            let Some(seen) = seen(row, index, time_s, body, limb_sigma_km, sensor.as_ref()) else {
                recording.incomplete += 1;
                continue;
            };
            if let Some(what) = seen.find_impossible() {
                recording.add_impossible(row, what.to_owned());
                continue;
            }
            // The same error twice is no second measurement.
            if known.insert((row.body.as_str(), time_s.to_bits())) {
                recording.seen.push(seen);
            } else {
                recording.duplicate += 1;
            }
        }
        recording.rows = rows;
        Ok(recording)
    }

    fn add_impossible(&mut self, row: &Row, what: String) {
        let (count, _) = self.impossible.get_or_insert_with(|| (0, format!("{}: {what}", row.file)));
        *count += 1;
    }

    /// Returns the bodies that the camera saw.
    pub fn bodies(&self) -> Vec<Body> {
        let mut bodies: Vec<Body> = self.seen.iter().map(|seen| seen.body).collect();
        bodies.sort_unstable();
        bodies.dedup();
        bodies
    }
}

fn is_earth(name: &str) -> bool {
    name.starts_with("earth")
}

/// Returns the direction of a row; `None` if a number is missing.
fn seen(
    row: &Row,
    index: usize,
    time_s: f64,
    body: Body,
    limb_sigma_km: Option<f64>,
    sensor: Option<&Sensor<f64>>,
) -> Option<Seen> {
    let axis = Vector::from(row.axis()?);
    let three = |x: [Option<f64>; 3]| Some(Vector::new(x[0]?, x[1]?, x[2]?));
    let mut seen = Seen {
        time_s,
        body,
        axis,
        covariance_rad2: symmetric(row.covariance()?).into(),
        common_rad2: row.common_covariance().map(|common| symmetric(common).into()),
        reference: three([row.axis_e_x, row.axis_e_y, row.axis_e_z]),
        altitude_km: row.altitude_km,
        by_limb_height: Vector::zeros(),
        centre: None,
        cone: None,
        row: index,
    };
    if body == Body::Limb {
        seen.separate_limb_height(row, limb_sigma_km);
        seen.cone = FreeCone::of_row(row, sensor);
        if let Some(position_km) = row.position_km().map(Vector::from) {
            let covariance_km2 = symmetric(row.position_covariance_km2()?);
            seen.centre = Some(Centre { position_m: position_km * 1e3, covariance_m2: (covariance_km2 * 1e6).into() });
        }
    }
    Some(seen)
}

impl Seen {
    /// Returns why the covariances cannot be those of a measurement.
    fn find_impossible(&self) -> Option<&'static str> {
        let whole = self.covariance_rad2.into_inner();
        let mut variances: [f64; 3] = whole.symmetric_eigenvalues().into();
        variances.sort_by(f64::total_cmp);
        // The smallest is that along the axis. An axis of unit length is rounded to this variance.
        if !(variances[1] > f64::EPSILON * f64::EPSILON) {
            return Some("cov_xx to cov_zz are smaller than the rounding of the axis");
        }
        let rest = self.common_rad2.map(|common| (whole - common.into_inner()).symmetric_eigenvalues().min());
        let is_larger = rest.is_some_and(|rest| !(rest > -MAX_EXCESS * whole.trace()));
        is_larger.then_some("cov_common_xx to cov_common_zz are larger than the whole, cov_xx to cov_zz")
    }

    /// Returns the largest variance of the slow error and that of the white noise, rad².
    pub fn largest_variances_rad2(&self) -> [f64; 2] {
        let largest = |c: Matrix3<f64>| c.symmetric_eigenvalues().max().max(0.0);
        let whole = self.covariance_rad2.into_inner();
        let slow = self.common_rad2.map_or(whole, Covariance::into_inner);
        [largest(slow), largest(whole - slow)]
    }

    /// Returns the share of the covariance whose error is the same in the next picture: 1 if the recording does not
    /// have it.
    pub(crate) fn slow_share(&self) -> f64 {
        let common = self.common_rad2.map(|common| common.as_inner().trace() / self.covariance_rad2.as_inner().trace());
        common.filter(|share| share.is_finite()).map_or(1.0, |share| share.clamp(0.0, 1.0))
    }

    /// Takes the error of the limb height out of the covariance, because the filter holds it as one error that all
    /// pictures share. With the derivative k of the axis by the expected cos α, a limb that is higher by δ than the
    /// told one moves the axis by k tan α / (R + H) δ.
    fn separate_limb_height(&mut self, row: &Row, limb_sigma_km: Option<f64>) {
        let by_cos = [row.axis_by_cos_x, row.axis_by_cos_y, row.axis_by_cos_z];
        let (Some(free), Some(x), Some(y), Some(z), Some(half_angle_deg), Some(altitude_km)) =
            (row.axis_free_x, by_cos[0], by_cos[1], by_cos[2], row.half_angle_deg, row.altitude_km)
        else {
            return;
        };
        let k = Vector::new(x, y, z);
        if !(k.norm_squared() > 0.0) {
            return;
        }
        // axis = unit(axis_free + k (c₀ − ĉ)) gives the expected cosine c₀.
        let axis_free = Vector::new(free, row.axis_free_y.unwrap_or(0.0), row.axis_free_z.unwrap_or(0.0));
        let moved = self.axis / self.axis.dot(&axis_free) - axis_free;
        let cos = half_angle_deg.to_radians().cos() + moved.dot(&k) / k.norm_squared();
        if !(cos > 0.0 && cos < 1.0) {
            return;
        }
        let tan = (1.0 - cos * cos).sqrt() / cos;
        let by_limb_height = k * (tan / (hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M / 1e3 + altitude_km));
        let height = by_limb_height.as_inner();
        let own = height * height.transpose() * limb_sigma_km.unwrap_or(0.0).powi(2);
        let without_own = |covariance: Covariance<Cam>| -> Option<Covariance<Cam>> {
            let mut rest = (covariance.into_inner() - own).symmetric_eigen();
            let is_covariance = rest.eigenvalues.min() > -1e-3 * own.trace();
            rest.eigenvalues.apply(|v| *v = v.max(0.0));
            is_covariance.then(|| rest.recompose().into())
        };
        // A sensor that was told less would make the rest negative; its covariance then stays whole.
        if let Some(rest) = without_own(self.covariance_rad2) {
            self.covariance_rad2 = rest;
            // The limb height is common, too. If the common part is smaller, it is of another sensor.
            self.common_rad2 = self.common_rad2.and_then(without_own);
        }
        self.by_limb_height = by_limb_height;
    }
}
