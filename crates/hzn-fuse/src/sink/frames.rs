//! frames.csv for a second run of the horizon sensor, with the attitude of the filter.
//!
//! The attitude serves for the azimuth of the limb's points. Its sigma widens the gate on the attitude, because the
//! same limbs made it.

use std::collections::BTreeSet;
use std::io::Write;

use hzn_nav::frames::{Cam, Fixed, Rotation, Vector};

use super::Utc;
use super::aem::{best, rising};
use crate::error::Error;
use crate::input::Recording;
use crate::results::{CameraState, Epoch, Fused};

/// Longest time between two solutions around a picture, s.
const GAP_S: f64 = 30.0;

/// Writes the frames.csv of a camera: every picture of its recording, with position and attitude where the solution has
/// one. Returns the number of pictures with an attitude.
///
/// # Errors
/// The recording is not one of the fused ones, or the output cannot be written.
pub fn write_frames(fused: &Fused, recording: &Recording, utc: Option<Utc>, out: impl Write) -> Result<usize, Error> {
    let Some(camera) = fused.cameras.iter().position(|name| *name == recording.name) else {
        return Err(Error::unusable(format!("{}: this recording was not fused", recording.name)));
    };
    let epochs = rising(best(fused));
    let mut table = csv::Writer::from_writer(out);
    let header = "file,time_s,utc,altitude_km,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg,rate_x,rate_y,rate_z";
    table.write_record(header.split(',')).map_err(Error::failed)?;
    let (mut files, mut count) = (BTreeSet::new(), 0);
    for row in recording.rows.iter().filter(|row| files.insert(row.file.clone())) {
        let number = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
        let mut cells = vec![row.file.clone(), number(row.time_s)];
        cells.push(utc.zip(row.time_s).map(|(utc, t)| utc.iso(t) + "Z").unwrap_or_default());
        let found = row.time_s.and_then(|t| at(&epochs, camera, t + recording.clock_offset_s));
        match found {
            Some(known) => {
                count += 1;
                cells.push(String::new());
                cells.extend(known.position_m.xyz().map(|x| (x * 1e-3).to_string()));
                cells.extend(known.attitude.wxyz().map(|x| x.to_string()));
                cells.push(known.sigma_rad.to_degrees().to_string());
                cells.extend(known.rate_rad_s.xyz().map(|x| x.to_string()));
            }
            None => {
                cells.push(number(row.altitude_km));
                cells.extend(std::iter::repeat_n(String::new(), 11));
            }
        }
        table.write_record(&cells).map_err(Error::failed)?;
    }
    table.flush().map_err(Error::failed)?;
    Ok(count)
}

/// The solution at the time of a picture.
struct Known {
    /// Position, m.
    position_m: Vector<Fixed>,
    /// Attitude of the camera.
    attitude: Rotation<Cam, Fixed>,
    /// Its largest 1-sigma, rad.
    sigma_rad: f64,
    /// Rate against the Earth, rad/s.
    rate_rad_s: Vector<Cam>,
}

/// Returns the solution at the time of a picture.
fn at(epochs: &[&Epoch], camera: usize, stamp_s: f64) -> Option<Known> {
    let late_s = |e: &Epoch| e.cameras.get(camera).map_or(0.0, |c| c.clock_s);
    let next = epochs.partition_point(|e| e.state.time_s < stamp_s + late_s(e));
    let (a, b) = (epochs.get(next.checked_sub(1)?)?, epochs.get(next)?);
    let time_s = stamp_s + late_s(a);
    let dt = b.state.time_s - a.state.time_s;
    if dt > GAP_S {
        return None;
    }
    let part = ((time_s - a.state.time_s) / dt).clamp(0.0, 1.0);
    let of = |e: &Epoch| -> Option<CameraState> { e.cameras.get(camera).copied() };
    let (ca, cb) = (of(a)?, of(b)?);
    let attitude = (a.state.attitude * ca.mount).slerp(&(b.state.attitude * cb.mount), part);
    let middle = a.state.position_m + a.state.velocity_m_s * (part * dt);
    let other = b.state.position_m - b.state.velocity_m_s * ((1.0 - part) * dt);
    let sigma_rad = ca.camera_sigma_rad.max(cb.camera_sigma_rad);
    let rate_rad_s = ca.mount.inverse() * (a.rate_rad_s * (1.0 - part) + b.rate_rad_s * part);
    Some(Known { position_m: middle * (1.0 - part) + other * part, attitude, sigma_rad, rate_rad_s })
}
