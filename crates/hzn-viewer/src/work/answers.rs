//! Answers for tests, which no picture was needed for.

use std::time::Duration;

use hzn_core::body::Kind;
use hzn_core::frames::{Cov3, UnitVec3};
use hzn_core::status::{Stage, Status};
use hzn_core::{Report, Solution};
use hzn_mcap::{Row, RowMeta};

use super::frame_view::BodyResult;

/// Returns the answer to a picture: its axis in the camera, its half-angle, and the altitude of the camera. 1 sigma is
/// 1 mrad.
pub(super) fn answer(kind: Kind, axis: [f64; 3], half_angle_rad: f64, altitude_km: f64) -> BodyResult {
    let axis = UnitVec3::try_new(axis).unwrap();
    let [x, y, z] = axis.xyz();
    let p = |a: f64, b: f64, same: f64| 1e-6 * (same - a * b);
    let covariance =
        Cov3::from_upper([p(x, x, 1.0), p(x, y, 0.0), p(x, z, 0.0), p(y, y, 1.0), p(y, z, 0.0), p(z, z, 1.0)]);
    let solution = Solution {
        axis,
        covariance,
        common: None,
        axis_fixed: None,
        axis_vehicle: None,
        half_angle_rad,
        fused_half_angle_rad: half_angle_rad,
        altitude_m: None,
        free: None,
        axis_by_cos: None,
        position: None,
        p_limb: None,
        is_airglow: false,
        rms_px: 0.1,
        inliers: 100,
        arc_px: 300.0,
        candidate: 0,
    };
    let report = Report {
        status: Status::Ok,
        stage: Stage::Gates,
        level: 9,
        next_level: None,
        counters: Default::default(),
        candidates: Default::default(),
        solution: Some(solution),
        is_suspect: false,
    };
    let meta = RowMeta { altitude_km: Some(altitude_km), ..RowMeta::default() };
    BodyResult {
        kind,
        row: Row::unprocessed(&meta, Status::Ok, ""),
        report: Ok(report),
        edges: Vec::new(),
        sample: None,
        times: Vec::new(),
        elapsed: Duration::ZERO,
        expected_rad: None,
        limb: Vec::new(),
        axis: None,
        ellipse: Vec::new(),
        residuals: Vec::new(),
        cause: None,
        otsu: None,
        fit: None,
        candidate_limbs: Vec::new(),
        trial_limb: Vec::new(),
        expected_limb: Vec::new(),
    }
}
