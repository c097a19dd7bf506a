//! `hzn.nav`: the navigation filter, and the replay of a flight. The module `nav.py` has the documentation.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_fuse::finding::Finding;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{self, Inputs, Map};
use hzn_fuse::results::{Determined, Lowered, Solved};
use hzn_fuse::sink::Utc;
use hzn_fuse::{Settings, sink};
use hzn_nav::ephemeris::{self, Place};
use hzn_nav::filter::{DirectionMeasurement, Innovation, Step};
use hzn_nav::frames::{Fixed, Rotation, Vehicle};
use hzn_nav::layout::MAX_CAMERAS;
use hzn_nav::options::StartSigmas;
use hzn_nav::strapdown::{Imu, Nominal};
use hzn_nav::vectors::{Direction, davenport, triad};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use pyo3::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use crate::{errors, parameters};

/// Memory of the filter: 28 numbers for the vehicle and 7 for each camera.
const STATES: usize = 28 + 7 * MAX_CAMERAS;

type Three = [f64; 3];
type Rows = [[f64; 3]; 3];

fn to_exception(error: hzn_fuse::Error) -> PyErr {
    match error {
        hzn_fuse::Error::Unusable(what) => errors::config(what),
        contradiction @ hzn_fuse::Error::Contradicts { .. } => errors::config(contradiction),
        hzn_fuse::Error::Failed(what) => errors::other(what),
    }
}

/// Returns a rotation from its matrix.
fn rotation<A, B>(name: &str, rows: &Rows) -> PyResult<Rotation<A, B>> {
    let m = Matrix3::from_fn(|i, j| rows[i][j]);
    if !((m * m.transpose() - Matrix3::identity()).amax() < 1e-6 && m.determinant() > 0.0) {
        return Err(errors::config(format!(
            "{name}: a rotation matrix is expected (perpendicular unit rows, no mirror)"
        )));
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(m)).into())
}

fn matrix<A, B>(rotation: &Rotation<A, B>) -> Rows {
    rows(&rotation.to_matrix())
}

fn rows(m: &Matrix3<f64>) -> Rows {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)]))
}

fn settings(given: &Bound<'_, PyAny>) -> PyResult<Settings> {
    let text = toml::to_string(&parameters::from_python(given)?).map_err(errors::config)?;
    hzn_files::document::parse(&text, Path::new("settings"), Settings::check).map_err(errors::unseen)
}

/// Attitude (vehicle to reference) of two directions; None if they are too close.
#[pyfunction]
#[pyo3(name = "_triad")]
pub(crate) fn triad_of(first: [Three; 2], second: [Three; 2]) -> Option<Rows> {
    let direction = |[vehicle, reference]: [Three; 2]| Direction::<Vehicle, Fixed> {
        vehicle: vehicle.into(),
        reference: reference.into(),
        sigma_rad: 1.0,
    };
    triad(&direction(first), &direction(second)).map(|q| matrix(&q))
}

/// Attitude (vehicle to reference), covariance and misfit of directions; None if they do not determine it.
#[pyfunction]
#[pyo3(name = "_wahba")]
pub(crate) fn wahba_of(directions: Vec<(Three, Three, f64)>) -> Option<(Rows, Rows, f64)> {
    let each = directions.iter().map(|(vehicle, reference, sigma_rad)| Direction::<Vehicle, Fixed> {
        vehicle: (*vehicle).into(),
        reference: (*reference).into(),
        sigma_rad: *sigma_rad,
    });
    let found = davenport(&each.collect::<Vec<_>>())?;
    Some((matrix(&found.attitude), rows(found.covariance_rad2.as_inner()), found.chi2))
}

/// Position of Sun or Moon in ECEF, metres.
#[pyfunction]
#[pyo3(name = "_celestial")]
pub(crate) fn celestial(moon: bool, unix_s: f64) -> Three {
    let place: Place = if moon { ephemeris::moon(unix_s) } else { ephemeris::sun(unix_s) };
    place.position_m().xyz()
}

/// Replays a flight. Returns the results as plain data.
#[pyfunction]
#[pyo3(name = "_fuse_flight")]
pub(crate) fn fuse<'py>(
    py: Python<'py>,
    recordings: Vec<PathBuf>,
    imu: Option<PathBuf>,
    gnss: Option<PathBuf>,
    attitude: Option<PathBuf>,
    mounts: BTreeMap<String, Rows>,
    clocks: BTreeMap<String, f64>,
    tables: (Vec<String>, Option<String>),
    directions: Vec<PathBuf>,
    given: &Bound<'py, PyAny>,
    wanted: (bool, bool, bool),
    rate_hz: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let settings = settings(given)?;
    let mut inputs = Inputs::default();
    for path in &recordings {
        let recording = input::recording(path, None).map_err(to_exception)?;
        recording.lost.as_ref().map_or(Ok(()), |lost| errors::warn(py, lost))?;
        inputs.recordings.push(recording);
    }
    let map = Map::parse(tables.0.iter().map(String::as_str)).map_err(to_exception)?;
    for path in &directions {
        inputs.recordings.push(input::directions(path, &map).map_err(to_exception)?);
    }
    for (name, rows) in &mounts {
        let found = inputs.recordings.iter_mut().find(|r| r.name == *name);
        let recording = found.ok_or_else(|| errors::config(format!("mounts: there is no camera {name:?}")))?;
        recording.mount = Some(rotation(&format!("mounts[{name:?}]"), rows)?);
    }
    for (name, offset_s) in &clocks {
        let found = inputs.recordings.iter_mut().find(|r| r.name == *name);
        let recording = found.ok_or_else(|| errors::config(format!("clocks: there is no camera {name:?}")))?;
        recording.clock_offset_s = *offset_s;
    }
    let read = read_tables(&mut inputs, [imu.as_ref(), gnss.as_ref(), attitude.as_ref()], (&map, tables.1.as_deref()))?;
    let (smoothed, solved, points) = wanted;
    let wanted = Wanted { smoothed, solved, points, rate_hz: Some(rate_hz) };
    let fused = errors::detached(py, || hzn_fuse::fuse(&inputs, &settings, wanted))?.map_err(to_exception)?;
    let states: Vec<Value> = sink::states(&fused).map(|s| to_json(&s)).collect();
    let innovations: Vec<Value> = sink::innovations(&fused).map(|i| to_json(&i)).collect();
    let finding = |f: &Finding| json!({ "level": f.level.name(), "source": f.source.name(), "what": f.what });
    let findings: Vec<Value> = fused.verdict.findings.iter().map(finding).collect();
    let result = json!({
        "verdict": fused.verdict.level().name(),
        "findings": findings,
        "cameras": fused.cameras,
        "states": states,
        "innovations": innovations,
        "notes": read.iter().chain(&fused.notes).collect::<Vec<_>>(),
        "restarts": fused.counts.restarts,
        "start_s": fused.begin.map(|b| b.time_s),
        "solved": fused.solved.as_ref().map(|solved| solution(solved, &fused.cameras)),
    });
    parameters::to_python(py, &result)
}

/// Reads the tables of inertial unit, receiver and star tracker, with the columns of the map and the UTC of time 0.
/// Returns what the receiver's file says besides.
fn read_tables(
    inputs: &mut Inputs,
    [imu, gnss, attitude]: [Option<&PathBuf>; 3],
    (map, utc): (&Map, Option<&str>),
) -> PyResult<Vec<String>> {
    let utc = utc.map(Utc::parse).transpose().map_err(to_exception)?;
    if let Some(path) = imu {
        inputs.imu = input::imu(path, map).map_err(to_exception)?;
    }
    if let Some(path) = attitude {
        inputs.attitudes = input::attitudes(path, map).map_err(to_exception)?;
    }
    let Some(path) = gnss else { return Ok(Vec::new()) };
    let receiver = input::gnss(path, map, utc.map(|utc| utc.unix_s)).map_err(to_exception)?;
    inputs.gnss = receiver.fixes;
    Ok(receiver.notes)
}

/// Returns what the solve of the whole flight found out.
fn solution(solved: &Solved, cameras: &[String]) -> Value {
    let determined = |d: &Determined| {
        json!({
            "name": d.name, "unit": d.unit, "estimate": d.estimate, "sigma": d.sigma, "before": d.before,
        })
    };
    let source = |camera: Option<usize>| camera.and_then(|which| cameras.get(which));
    let lowered = |l: &Lowered| {
        json!({
            "time_s": l.time_s, "camera": source(l.camera), "kind": l.kind.name(), "sigmas": l.sigmas,
            "weight": l.weight,
        })
    };
    json!({
        "unknowns": solved.unknowns,
        "knots": solved.knots,
        "steps": solved.steps,
        "is_converged": solved.is_converged,
        "cost": solved.cost,
        "limb_share": solved.limb_share,
        "determined": solved.determined.iter().map(determined).collect::<Vec<_>>(),
        "lowered": solved.lowered.iter().map(lowered).collect::<Vec<_>>(),
        "orbit": solved.orbit.map(|orbit| json!({
            "semi_axis_m": orbit.semi_axis_m, "eccentricity": orbit.eccentricity,
            "inclination_rad": orbit.inclination_rad, "sigma_m": orbit.sigma_m, "bound_m": orbit.bound_m,
        })),
    })
}

fn to_json(record: &impl Serialize) -> Value {
    serde_json::to_value(record).unwrap_or_default()
}

/// The filter; `hzn.nav.Filter` wraps it.
#[pyclass(module = "hzn", name = "_Filter")]
pub(crate) struct Filter {
    filter: hzn_nav::filter::Filter<STATES>,
}

/// An innovation: value, covariance by rows, NIS, whether it was taken.
type Taken = (Vec<f64>, Vec<Vec<f64>>, f64, bool);

fn taken<const M: usize>(i: Innovation<M>) -> Taken {
    let covariance = (0..M).map(|r| (0..M).map(|c| i.covariance[(r, c)]).collect()).collect();
    (i.value.iter().copied().collect(), covariance, i.nis, i.taken)
}

#[pymethods]
impl Filter {
    #[new]
    fn new(
        time_s: f64,
        attitude: Rows,
        velocity: Three,
        position: Three,
        sigmas: Three,
        mounts: Vec<Rows>,
        given: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let settings = settings(given)?;
        let start = Nominal {
            time_s,
            attitude: rotation("attitude", &attitude)?,
            velocity_m_s: velocity.into(),
            position_m: position.into(),
        };
        let [attitude_rad, velocity_m_s, position_m] = sigmas;
        let options = settings.options(None, StartSigmas { attitude_rad, velocity_m_s, position_m });
        let mount = |(i, rows): (usize, &Rows)| {
            Ok(settings.camera_options(&i.to_string(), rotation(&format!("mounts[{i}]"), rows)?, 1))
        };
        let cameras = mounts.iter().enumerate().map(mount).collect::<PyResult<Vec<_>>>()?;
        let filter = hzn_nav::filter::Filter::new(start, &options, &cameras).map_err(errors::config)?;
        Ok(Self { filter })
    }

    fn predict(&mut self, time_s: f64, gyro: Three, accel: Three, saturated: bool) -> &'static str {
        let imu = Imu { time_s, gyro_rad_s: gyro.into(), accel_m_s2: accel.into() };
        match self.filter.predict(&imu, saturated) {
            Step::First => "first",
            Step::Taken => "taken",
            Step::TakenWithGap => "gap",
            Step::Duplicate => "duplicate",
            Step::OutOfOrder => "out-of-order",
            Step::NotFinite => "not-finite",
        }
    }
    fn update_direction(
        &mut self,
        camera: usize,
        measured: Three,
        reference: Three,
        covariance: Rows,
        by_limb_height: Three,
        is_limb: bool,
        common: Option<Rows>,
    ) -> Option<Taken> {
        let matrix = |rows: Rows| Matrix3::from_fn(|i, j| rows[i][j]);
        let measurement = DirectionMeasurement {
            camera,
            body: 0,
            measured: measured.into(),
            reference: reference.into(),
            covariance_rad2: matrix(covariance).into(),
            common_rad2: common.map(|rows| matrix(rows).into()),
            by_limb_height: by_limb_height.into(),
            is_limb,
        };
        self.filter.update_direction(&measurement).ok().map(taken)
    }
    fn update_position(&mut self, position: Three, sigma: f64) -> Option<Taken> {
        self.filter.update_position(&position.into(), sigma).ok().map(taken)
    }
    fn update_velocity(&mut self, velocity: Three, sigma: f64) -> Option<Taken> {
        self.filter.update_velocity(&velocity.into(), sigma).ok().map(taken)
    }
    fn update_attitude(&mut self, attitude: Rows, sigma: f64) -> PyResult<Option<Taken>> {
        Ok(self.filter.update_attitude(&rotation("attitude", &attitude)?, sigma).ok().map(taken))
    }
    /// Time, attitude, velocity, position.
    fn state(&self) -> (f64, Rows, Three, Three) {
        let s = self.filter.nominal();
        (s.time_s, matrix(&s.attitude), s.velocity_m_s.xyz(), s.position_m.xyz())
    }
    fn covariance(&self) -> Vec<Vec<f64>> {
        let n = self.filter.layout().len;
        let p = self.filter.covariance();
        (0..n).map(|i| (0..n).map(|j| p[(i, j)]).collect()).collect()
    }
    fn mount(&self, camera: usize) -> Option<Rows> {
        self.filter.camera(camera).map(|c| matrix(&c.mount))
    }
    /// Biases of gyros and accelerometers.
    fn biases(&self) -> (Three, Three) {
        let c = self.filter.corrections();
        (c.gyro_bias.xyz(), c.accel_bias.xyz())
    }
}
