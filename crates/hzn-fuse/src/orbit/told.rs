//! Whether the orbit agrees with the altitudes that were told.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};

use super::case::{Case, Solution};
use crate::finding::{Cause, Finding, Level, Source};
use crate::results::Epoch;

/// A difference of so many sigmas contradicts what was told. One right flight of 16 000 reaches it.
const SIGMAS: f64 = 4.0;

/// Compares the altitudes that the answers were made with with those of the orbit, whose height comes from its period.
///
/// The told altitudes of a camera may all have the same error, so they count as one: the median picture decides.
pub(super) fn altitudes(case: &Case<'_>, solution: &Solution, epochs: &[Epoch]) -> Vec<Finding> {
    let of_camera = |(camera, recording): (usize, &crate::input::Recording)| {
        let told_sigma_km = recording.altitude_sigma_km?;
        let off = |sight: &super::sights::Sight| {
            let epoch = epochs.get(epochs.partition_point(|e| e.state.time_s < sight.time_s))?;
            let position_m = epoch.state.position_m.into_inner();
            let (height_m, _) = geodetic(position_m.into(), WGS84_A_M, WGS84_B_M);
            let up = position_m.normalize();
            let own_m2 = (epoch.position_covariance_m2.as_inner() * up).dot(&up).max(0.0);
            let off_km = sight.altitude_km? - height_m * 1e-3;
            Some((off_km, off_km.abs() / told_sigma_km.hypot(own_m2.sqrt() * 1e-3)))
        };
        let mut all: Vec<(f64, f64)> =
            solution.sights.iter().filter(|sight| sight.camera == camera).filter_map(off).collect();
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (off_km, sigmas) = *all.get(all.len() / 2)?;
        if sigmas <= SIGMAS {
            return None;
        }
        let above = if off_km > 0.0 { "above" } else { "below" };
        let what = format!(
            "the altitudes that {} was processed with are {:.1} km {above} the orbit that limbs and attitudes give, \
             {sigmas:.1} sigmas of the told {told_sigma_km} km; correct altitude_km or body.altitude_sigma_km, and \
             process the pictures again",
            recording.name,
            off_km.abs()
        );
        let source = Source::Camera(recording.name.clone());
        Some(Finding { level: Level::Contradicts, cause: Cause::Altitude, source, what })
    };
    case.inputs.recordings.iter().enumerate().filter_map(of_camera).collect()
}
