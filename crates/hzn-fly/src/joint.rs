//! The joint answer of a rig, as a row like that of `hzn run rig.toml`.

use hzn_core::frames::{Cov3, UnitVec3, Vehicle};
use hzn_core::status::Status;
use hzn_flight::joint::{Outcome, RigAnswer};
use hzn_mcap::{Row, RowMeta, roll_pitch_deg};

/// The column `head` of the joint answer.
const JOINT: &str = "rig";

/// Returns the row of an epoch. `name` returns the name of a head by its number. Numbers that are no directions leave
/// the row without an answer.
pub fn joint_row(answer: &RigAnswer, name: impl Fn(u8) -> String) -> Row {
    let names = |set: u8| {
        let heads: Vec<String> = (0..8).filter(|k| set >> k & 1 == 1).map(&name).collect();
        (!heads.is_empty()).then(|| heads.join(" "))
    };
    let status = Status::ALL.iter().copied().find(|status| *status as u8 == answer.status).unwrap_or(Status::Rejected);
    let missing = answer.heads_expected & !answer.heads_seen;
    let without = answer.heads_seen & !answer.heads_answered & !answer.heads_repeated;
    let parts = [
        (answer.outcome != Outcome::Answer as u8)
            .then(|| Outcome::from_number(answer.outcome).map_or("?", Outcome::name).to_owned()),
        names(missing).map(|heads| format!("{heads}: no picture")),
        names(without).map(|heads| format!("{heads}: no answer")),
        names(answer.heads_repeated).map(|heads| format!("{heads}: the picture of another time or head")),
    ];
    let detail = parts.into_iter().flatten().collect::<Vec<_>>().join("; ");
    let meta = RowMeta {
        index: u64::from(answer.epoch).saturating_sub(1),
        file: format!("epoch-{:06}", answer.epoch),
        time_s: Some(answer.exposure_us as f64 * 1e-6),
        body: String::new(),
        altitude_km: None,
    };
    let mut row = Row { head: Some(JOINT.to_owned()), ..Row::unprocessed(&meta, status, &detail) };
    row.heads_used = names(answer.heads_used);
    row.heads_excluded = names(answer.heads_excluded);
    let known = |x: f32| x.is_finite().then(|| f64::from(x));
    row.separation_deg = known(answer.separation_rad).map(f64::to_degrees);
    row.separation_limit_deg = known(answer.separation_limit_rad).map(f64::to_degrees);
    row.protection_deg = known(answer.protection_rad).map(f64::to_degrees);
    row.half_angle_deg = known(answer.half_angle_rad).map(f64::to_degrees);
    if let Some(axis) = UnitVec3::<Vehicle, f64>::try_new(answer.axis.map(f64::from)) {
        [row.axis_x, row.axis_y, row.axis_z] = axis.xyz().map(Some);
        [row.axis_v_x, row.axis_v_y, row.axis_v_z] = axis.xyz().map(Some);
        let upper_rad2 = answer.cov.map(f64::from);
        [row.cov_xx, row.cov_xy, row.cov_xz, row.cov_yy, row.cov_yz, row.cov_zz] = upper_rad2.map(Some);
        row.sigma_max_deg = Some(Cov3::<Vehicle, f64>::from_upper(upper_rad2).sigma_max_rad().to_degrees());
        let [roll, pitch] = roll_pitch_deg(&axis);
        (row.roll_deg, row.pitch_deg) = (Some(roll), Some(pitch));
    }
    if answer.cov_common.iter().all(|x| x.is_finite()) {
        [
            row.cov_common_xx,
            row.cov_common_xy,
            row.cov_common_xz,
            row.cov_common_yy,
            row.cov_common_yz,
            row.cov_common_zz,
        ] = answer.cov_common.map(|x| Some(f64::from(x)));
    }
    row
}
