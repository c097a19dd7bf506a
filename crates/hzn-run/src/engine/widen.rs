//! Conversion of reports to f64.

use hzn_core::frames::{Cov3, UnitVec3};
use hzn_core::real::Real;
use hzn_core::report::{Candidate, Free, FreeCommon, Position};
use hzn_core::{Report, Solution};

/// Converts a report to f64.
pub fn widen_report<T: Real + Into<f64>>(r: &Report<T>) -> Report<f64> {
    Report {
        status: r.status,
        stage: r.stage,
        level: r.level,
        next_level: r.next_level,
        counters: r.counters,
        candidates: r.candidates.iter().map(widen_candidate).collect(),
        solution: r.solution.as_ref().map(widen_solution),
        is_suspect: r.is_suspect,
    }
}

pub(super) fn widen_candidate<T: Real + Into<f64>>(c: &Candidate<T>) -> Candidate<f64> {
    Candidate {
        number: c.number,
        length_px: c.length_px,
        points: c.points,
        inliers: c.inliers,
        rms_px: c.rms_px.into(),
        verdict: c.verdict,
    }
}

/// Converts a solution to f64.
pub fn widen_solution<T: Real + Into<f64>>(s: &Solution<T>) -> Solution<f64> {
    Solution {
        axis: s.axis.to_f64(),
        covariance: Cov3::from_upper(s.covariance.upper_rad2.map(Into::into)),
        common: s.common.map(|c| Cov3::from_upper(c.upper_rad2.map(Into::into))),
        axis_fixed: s.axis_fixed.as_ref().map(UnitVec3::to_f64),
        axis_vehicle: s.axis_vehicle.as_ref().map(UnitVec3::to_f64),
        half_angle_rad: s.half_angle_rad.into(),
        fused_half_angle_rad: s.fused_half_angle_rad.into(),
        altitude_m: s.altitude_m.map(|(h, sigma)| (h.into(), sigma.into())),
        free: s.free.as_ref().map(widen_free),
        axis_by_cos: s.axis_by_cos.map(|by| by.map(Into::into)),
        position: s.position.as_ref().map(Position::to_f64),
        p_limb: s.p_limb.map(Into::into),
        is_airglow: s.is_airglow,
        rms_px: s.rms_px.into(),
        inliers: s.inliers,
        arc_px: s.arc_px.into(),
        candidate: s.candidate,
    }
}

fn widen_free<T: Real + Into<f64>>(f: &Free<T>) -> Free<f64> {
    Free {
        axis: f.axis.to_f64(),
        covariance: Cov3::from_upper(f.covariance.upper_rad2.map(Into::into)),
        cos: f.cos.into(),
        var_cos: f.var_cos.into(),
        axis_with_cos: f.axis_with_cos.map(|p| p.map(Into::into)),
        cos_per_px: f.cos_per_px.into(),
        common: f.common.map(|common| FreeCommon {
            covariance: Cov3::from_upper(common.covariance.upper_rad2.map(Into::into)),
            var_cos: common.var_cos.into(),
            axis_with_cos: common.axis_with_cos.map(Into::into),
        }),
    }
}
