//! The coarse direction of an epoch without an answer, for its row.

use std::f64::consts::FRAC_PI_2;

use hzn_core::frames::{Cam, UnitVec3, Vehicle};
use hzn_core::rig::{GlimpsedHead, Light, Mount, coarse};
use hzn_core::status::Status;
use hzn_core::{Expected, Prior, Sensor, threshold};
use hzn_mcap::Row;

use super::seen::Seen;
use crate::engine;
use crate::record::altitude_km;

/// The part of full scale from which on a place is lit, if no picture of the head had a limb yet. The sky with the
/// camera's own level is usually below a tenth, and an exposure for the body gives it a third or more.
const LIT: f64 = 0.125;

/// Returns the level of a picture from which on it is lit: the one of the sensor, the one that was seen, or a part of
/// full scale.
fn level_of(config: &threshold::Config, seen: Option<u16>, full_scale: u16) -> u16 {
    let full_scale = f64::from(full_scale);
    let fixed = || {
        let unit = if config.level < 1.0 { full_scale } else { 1.0 };
        (config.method == threshold::Method::Fixed).then_some(config.level * unit)
    };
    fixed().unwrap_or_else(|| seen.map_or(LIT * full_scale, f64::from)).clamp(1.0, 65535.0) as u16
}

/// Writes the coarse direction into the row of an epoch without an answer.
pub(super) fn set(row: &mut Row, sensors: &[Sensor<f64>], mounts: &[Mount<f64>], heads: &[Seen<'_>]) {
    let Some(body) = sensors.first().and_then(|sensor| sensor.config().each_body().first()) else { return };
    // The Sun and the Moon are nowhere near as large as a picture.
    if row.status == Status::Ok || body.half_angle_is_free() {
        return;
    }
    let all = || sensors.iter().zip(mounts).zip(heads);
    // Heads of another band see the body in another light, so they have no part.
    let light = if body.is_seen_in_sunlight() { Light::Sun(sun(sensors, mounts, heads)) } else { Light::Own };
    let is_of_band = |sensor: &Sensor<f64>| is_sunlit(sensor) == body.is_seen_in_sunlight();
    let glimpsed = all().filter(|((sensor, _), _)| is_of_band(sensor)).filter_map(|((sensor, mount), head)| {
        let glimpse = head.frame.filter(|_| head.repeats.is_none())?.glimpse.as_ref()?;
        let level = level_of(sensor.config().threshold_of(0), head.level, glimpse.full_scale());
        Some(GlimpsedHead { glimpse, level, camera: sensor.camera(), mount })
    });
    let half_angle = all().find_map(|((sensor, _), head)| half_angles(sensor, head));
    if let Some(coarse) = coarse(glimpsed, half_angle, &light) {
        [row.coarse_x, row.coarse_y, row.coarse_z] = coarse.axis.xyz().map(Some);
        row.coarse_sigma_deg = Some(coarse.sigma_rad.to_degrees());
    }
}

/// Returns whether a head sees its first body in sunlight.
pub(super) fn is_sunlit(sensor: &Sensor<f64>) -> bool {
    sensor.config().each_body().first().is_some_and(|body| body.is_seen_in_sunlight())
}

/// Returns the direction to the Sun in the axes of the vehicle, if a head knows it.
pub(super) fn sun(
    sensors: &[Sensor<f64>],
    mounts: &[Mount<f64>],
    heads: &[Seen<'_>],
) -> Option<UnitVec3<Vehicle, f64>> {
    sensors.iter().zip(mounts).zip(heads).find_map(|((sensor, mount), head)| {
        let body = sensor.config().each_body().first()?;
        let sun: UnitVec3<Cam, f64> = engine::prior(head.frame?.data.as_ref(), 0, body).ok()?.sun?;
        Some(mount.after(0.0, None)?.apply(&sun))
    })
}

/// Returns the limits of the half-angle of the first body in the picture of a head, radians; `None` if nothing is known
/// of the altitude.
fn half_angles(sensor: &Sensor<f64>, head: &Seen<'_>) -> Option<[f64; 2]> {
    let (own, body) = (expected(sensor, head)?, sensor.config().each_body().first()?);
    let data = head.frame?.data.as_ref();
    let limits_km = sensor.config().gates.altitude_limits_km.filter(|_| altitude_km(data, body).is_none());
    let Some([low, high]) = limits_km else { return Some([own.half_angle_rad(); 2]) };
    let prior = engine::prior(data, 0, body).ok()?;
    let seen_from =
        |km: f64| Some(sensor.expect(&Prior { altitude_m: Some(km * 1e3), ..prior }).ok()?.half_angle_rad());
    // Below the limb height, the body is half of all directions.
    Some([seen_from(high)?, seen_from(low).unwrap_or(FRAC_PI_2)])
}

/// Returns what is expected of the first body in the picture of a head.
pub(super) fn expected(sensor: &Sensor<f64>, head: &Seen<'_>) -> Option<Expected<f64>> {
    let body = sensor.config().each_body().first()?;
    sensor.expect(&engine::prior(head.frame?.data.as_ref(), 0, body).ok()?).ok()
}
