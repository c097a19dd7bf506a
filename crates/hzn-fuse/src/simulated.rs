//! Recordings of simulated flights without pictures: true directions with drawn errors.
//!
//! Studies fly many flights. Rendering takes a second a picture; a drawn error takes none.

use std::path::Path;

use hzn_core::body::Kind;
use hzn_core::status::Status;
use hzn_mcap::{Row, RowMeta};
use hzn_nav::ephemeris;
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector};
use hzn_sim::{FlightFrame, Scenario, ScenarioError};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::error::Error;
use crate::input::{Body, Fix, FreeCone, Inputs, Recording, Sample, Seen};
use crate::reference::limb_axis;

/// Half-angle of the discs of Sun and Moon, rad.
const DISC_RAD: f64 = 0.00465;

/// A source of random numbers and errors.
pub trait Errors {
    /// Returns the error of a direction and the covariance that the sensor would tell. `axis` is the true direction.
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>);
    /// Returns the part of this covariance whose error is the same in the next picture; `None` if the sensor would not
    /// tell it.
    fn common(&mut self, _at: &Moment, _axis: &Vector<Cam>) -> Option<Covariance<Cam>> {
        None
    }
    /// Returns the derivative of the measured axis by the limb height, 1/km.
    fn by_limb_height(&mut self, at: &Moment, axis: &Vector<Cam>) -> Vector<Cam>;
    /// Returns the freely fitted cone of a limb, for a limb that is higher than the told one; `None` if the sensor has
    /// none.
    fn cone(&mut self, _at: &Moment, _axis: &Vector<Cam>, _higher_km: f64) -> Option<FreeCone> {
        None
    }
    /// Returns whether there is enough light for the body that is in view.
    fn has_light(&mut self, _at: &Moment) -> bool {
        true
    }
}

/// What is known about a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Number of the camera.
    pub camera: usize,
    /// The body.
    pub body: Body,
    /// True time, s.
    pub time_s: f64,
    /// Altitude of the vehicle above the ellipsoid, km.
    pub altitude_km: f64,
    /// Position of the vehicle, m.
    pub position_m: Vector<Fixed>,
    /// Attitude of the camera.
    pub fixed_from_camera: Rotation<Cam, Fixed>,
}

/// Returns the inputs of a simulated flight: inertial unit and receiver as `hzn simulate` writes them, and a recording
/// for each camera. `limb_height_km` is the error of the limb height that all cameras are told.
///
/// # Errors
/// The scene is refused.
pub fn inputs(scenario: &Scenario, errors: &mut dyn Errors, limb_height_km: f64) -> Result<Inputs, ScenarioError> {
    let mut inputs = instruments(scenario)?;
    for (number, one) in scenario.by_camera().iter().enumerate() {
        inputs.recordings.push(recording(one, number, errors, limb_height_km)?);
    }
    Ok(inputs)
}

/// Returns the samples of the inertial unit and the fixes of the receiver.
///
/// # Errors
/// The scene is refused.
pub fn instruments(scenario: &Scenario) -> Result<Inputs, ScenarioError> {
    let path = scenario.path()?;
    let [from_s, to_s] = [scenario.capture.from_s, scenario.capture.to_s];
    let mut inputs = Inputs::default();
    if let Some(imu) = &scenario.imu {
        inputs.imu = imu.rows(&path, [from_s, to_s], scenario.seed).map(|row| sample(&row)).collect();
    }
    if let Some(gnss) = &scenario.gnss {
        inputs.gnss = gnss.rows(&path, [from_s, to_s], scenario.seed).map(|row| fix(&row)).collect();
    }
    Ok(inputs)
}

fn sample(row: &hzn_sim::trajectory::instruments::ImuRow) -> Sample {
    let imu = hzn_nav::strapdown::Imu {
        time_s: row.time_s,
        gyro_rad_s: Vector::new(row.gyro_x_radps, row.gyro_y_radps, row.gyro_z_radps),
        accel_m_s2: Vector::new(row.accel_x_mps2, row.accel_y_mps2, row.accel_z_mps2),
    };
    Sample { imu, saturated: row.saturated > 0 }
}

fn fix(row: &hzn_sim::trajectory::instruments::GnssRow) -> Fix {
    Fix {
        time_s: row.time_s,
        position_m: Vector::new(row.x_m, row.y_m, row.z_m),
        velocity_m_s: Vector::new(row.vx_mps, row.vy_mps, row.vz_mps),
        position_sigma_m: row.position_sigma_m,
        velocity_sigma_m_s: row.velocity_sigma_mps,
    }
}

/// Returns the recording of one camera.
fn recording(
    one: &Scenario,
    number: usize,
    errors: &mut dyn Errors,
    limb_height_km: f64,
) -> Result<Recording, ScenarioError> {
    let mut seen = Vec::new();
    for (row, frame) in one.flight()?.frames.iter().enumerate() {
        let known = one.frame_row(frame);
        let pose = &frame.scene.pose;
        let fixed_from_camera = rotation(pose.q_fixed_from_camera_wxyz);
        for &kind in &one.bodies {
            let seen_from_here = is_in_view(one, frame, kind)?.then(|| true_direction(one, frame, kind));
            let Some((body, reference)) = seen_from_here.flatten() else { continue };
            let moment = Moment {
                camera: number,
                body,
                time_s: frame.time_s,
                altitude_km: known.altitude_km,
                position_m: pose.position_m.into(),
                fixed_from_camera,
            };
            if !errors.has_light(&moment) {
                continue;
            }
            let axis = fixed_from_camera.inverse() * reference;
            // The sensor knows the position at the time of the stamp.
            let told_m = Vector::new(known.x_km, known.y_km, known.z_km) * 1e3;
            let told = limb_axis(body, &told_m).unwrap_or(reference);
            let (error, covariance_rad2) = errors.draw(&moment, &axis);
            let by_limb_height =
                if body == Body::Limb { errors.by_limb_height(&moment, &axis) } else { Vector::zeros() };
            let cone = errors.cone(&moment, &axis, limb_height_km).filter(|_| body == Body::Limb);
            seen.push(Seen {
                time_s: known.time_s,
                body,
                axis: (axis + error + by_limb_height * limb_height_km).normalize(),
                covariance_rad2,
                common_rad2: errors.common(&moment, &axis),
                reference: Some(told),
                altitude_km: Some(known.altitude_km),
                by_limb_height,
                centre: None,
                cone,
                row,
            });
        }
    }
    Ok(Recording {
        name: one.name.clone(),
        mount: Some(rotation(one.mount.map_or([1.0, 0.0, 0.0, 0.0], |m| m.q_vehicle_from_camera_wxyz))),
        camera: Some(one.camera.clone()),
        seen,
        ..Recording::default()
    })
}

/// Returns whether a picture has a tenth of its height of limb, or most of the disc of Sun or Moon.
fn is_in_view(one: &Scenario, frame: &FlightFrame, kind: Kind) -> Result<bool, ScenarioError> {
    let disc_px = core::f64::consts::TAU * DISC_RAD * one.camera.fx_px;
    let enough_px = if kind == Kind::Earth { f64::from(one.camera.height) / 10.0 } else { 0.8 * disc_px };
    let visible_px =
        frame.scene.visible_px(kind).map_err(|e| ScenarioError { field: "[[cameras]]".into(), what: e.to_string() })?;
    Ok(visible_px >= enough_px)
}

/// Returns the true direction of a body; `None` if the picture has none.
fn true_direction(one: &Scenario, frame: &FlightFrame, kind: Kind) -> Option<(Body, Vector<Fixed>)> {
    let position_m = frame.scene.pose.position_m.into();
    let unix_s = one.start_unix_s() + frame.time_s;
    Some(match kind {
        Kind::Sun => (Body::Sun, ephemeris::sun(unix_s).seen_from(position_m).direction),
        Kind::Moon => (Body::Moon, ephemeris::moon(unix_s).seen_from(position_m).direction),
        _ => {
            let truth = frame.scene.body_truth(kind, "", frame.time_s).ok()?;
            let axis = Vector::<Cam>::new(truth.axis_x, truth.axis_y, truth.axis_z);
            (Body::Limb, rotation(frame.scene.pose.q_fixed_from_camera_wxyz) * axis)
        }
    })
}

fn rotation<A, B>([w, x, y, z]: [f64; 4]) -> Rotation<A, B> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).into()
}

/// Writes the inputs of a simulated flight as files: imu.csv, gnss.csv, vehicle.csv with the truth, and for each camera
/// NAME.csv as `hzn run` writes it and NAME.toml with its mount.
///
/// # Errors
/// The folder cannot be written to.
pub fn write(scenario: &Scenario, inputs: &Inputs, folder: &Path) -> Result<(), Error> {
    let path = scenario.path().map_err(Error::unusable)?;
    let span_s = scenario.span_s();
    let table = |name: &str| csv::Writer::from_path(folder.join(name)).map_err(Error::failed);
    if let Some(imu) = &scenario.imu {
        let mut out = table("imu.csv")?;
        imu.rows(&path, span_s, scenario.seed).try_for_each(|row| out.serialize(row)).map_err(Error::failed)?;
        let mut out = table("vehicle.csv")?;
        let span_s = [imu.from_s.unwrap_or(span_s[0]), span_s[1]];
        path.vehicle_rows(span_s, imu.rate_hz).try_for_each(|row| out.serialize(row)).map_err(Error::failed)?;
    }
    if let Some(gnss) = &scenario.gnss {
        let mut out = table("gnss.csv")?;
        gnss.rows(&path, span_s, scenario.seed).try_for_each(|row| out.serialize(row)).map_err(Error::failed)?;
    }
    for recording in &inputs.recordings {
        let mut out = table(&format!("{}.csv", recording.name))?;
        for seen in &recording.seen {
            out.serialize(row(seen)).map_err(Error::failed)?;
        }
        if let Some(q) = recording.mount {
            let [w, x, y, z] = q.wxyz();
            let text = format!("[mount]\nq_vehicle_from_camera_wxyz = [{w}, {x}, {y}, {z}]\n");
            std::fs::write(folder.join(format!("{}.toml", recording.name)), text).map_err(Error::failed)?;
        }
    }
    Ok(())
}

/// Returns a direction as a row of results.
fn row(seen: &Seen) -> Row {
    let meta = RowMeta {
        index: seen.row as u64,
        file: format!("{:05}.png", seen.row),
        time_s: Some(seen.time_s),
        body: if seen.body == Body::Limb { "earth" } else { seen.body.name() }.into(),
        altitude_km: seen.altitude_km,
    };
    let mut row = Row::unprocessed(&meta, Status::Ok, "");
    let p = seen.covariance_rad2.as_inner();
    [row.axis_x, row.axis_y, row.axis_z] = seen.axis.xyz().map(Some);
    [row.cov_xx, row.cov_xy, row.cov_xz] = [p.m11, p.m12, p.m13].map(Some);
    [row.cov_yy, row.cov_yz, row.cov_zz] = [p.m22, p.m23, p.m33].map(Some);
    if let Some(c) = seen.common_rad2.map(Covariance::into_inner) {
        [row.cov_common_xx, row.cov_common_xy, row.cov_common_xz] = [c.m11, c.m12, c.m13].map(Some);
        [row.cov_common_yy, row.cov_common_yz, row.cov_common_zz] = [c.m22, c.m23, c.m33].map(Some);
    }
    if let Some(e) = seen.reference {
        [row.axis_e_x, row.axis_e_y, row.axis_e_z] = e.xyz().map(Some);
    }
    row
}
