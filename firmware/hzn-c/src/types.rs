//! The structures of the interface.

use hzn_core::Prior;
use hzn_flight::answer::{Edge, PictureAnswer};

/// A picture: one byte per pixel, row by row.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznPicture {
    /// The first pixel of the first row.
    pub pixels: *const u8,
    /// Readable bytes from `pixels` on.
    pub bytes: usize,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from the start of a row to the start of the next.
    pub stride: usize,
}

/// The prior of a picture. NaN means that a value is not known.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznKnown {
    /// Altitude in metres: geodetic for the Earth, above the radius for other bodies.
    pub altitude_m: f32,
    /// Position of the camera in the fixed frame of the body (for the Earth ECEF), metres. If it is known, the altitude
    /// is not used.
    pub position_m: [f32; 3],
    /// Rate of rotation of the camera in the camera frame, rad/s; it has an effect only with a rolling shutter.
    pub rate_rad_s: [f32; 3],
}

/// The answer to a picture. Without a direction (status not 0) the values from `axis` to `rms_px` are NaN and `inliers`
/// is 0. After a call that returns an error, `status` is 255 and every other number is NaN or 0.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznAnswer {
    /// Unit vector to the body, camera frame (x right, y down, z forward).
    pub axis: [f32; 3],
    /// Covariance of `axis`: xx, xy, xz, yy, yz, zz, rad².
    pub cov_rad2: [f32; 6],
    /// The same direction in the fixed frame of the body (for the Earth ECEF); NaN without a position.
    pub axis_fixed: [f32; 3],
    /// The same direction in the vehicle's frame; NaN without a mounting.
    pub axis_vehicle: [f32; 3],
    /// Half-angle of the free fit, rad.
    pub half_angle_rad: f32,
    /// Altitude from the free fit, m; NaN for Sun and Moon.
    pub altitude_m: f32,
    /// 1-sigma of the altitude, m.
    pub altitude_sigma_m: f32,
    /// RMS distance of the inliers from the limb, px.
    pub rms_px: f32,
    /// Number of edge points that carry the answer.
    pub inliers: u32,
    /// Number of edge points of the chosen edge.
    pub edge_points: u32,
    /// Number of edges that were candidates.
    pub candidates: u32,
    /// Number of border pixels left out because lists were full.
    pub dropped: u32,
    /// Threshold between dark and lit, counts.
    pub level: u16,
    /// Status: the value that `hzn_process` returned.
    pub status: u8,
    /// The last stage that was entered.
    pub stage: u8,
    /// Number of candidates in `edges`.
    pub listed: u8,
    /// The first candidates, and the chosen one.
    pub edges: [HznEdge; 16],
}

/// A candidate edge.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct HznEdge {
    /// Number of the candidate, from 0.
    pub number: u32,
    /// Border pixels.
    pub length_px: u32,
    /// Edge points.
    pub points: u32,
    /// Edge points that fit the limb.
    pub inliers: u32,
    /// RMS distance of the inliers from the limb, px; NaN without a fit.
    pub rms_px: f32,
    /// Verdict: a number of `hzn_verdicts.h`.
    pub verdict: u8,
}

/// Returns the values as the sensor takes them; `None` if a part of a vector is NaN.
pub(crate) fn to_prior(values: &HznKnown) -> Option<Prior<f32>> {
    let known = |v: [f32; 3]| match v.iter().filter(|x| x.is_nan()).count() {
        0 => Some(Some(v)),
        3 => Some(None),
        _ => None,
    };
    Some(Prior {
        altitude_m: (!values.altitude_m.is_nan()).then_some(values.altitude_m),
        position_m: known(values.position_m)?,
        rate_rad_s: known(values.rate_rad_s)?,
        ..Prior::default()
    })
}

pub(crate) fn to_answer(a: &PictureAnswer) -> HznAnswer {
    let nan = f32::NAN;
    let d = a.direction.as_ref();
    HznAnswer {
        axis: d.map_or([nan; 3], |d| d.axis),
        cov_rad2: d.map_or([nan; 6], |d| d.cov),
        axis_fixed: d.map_or([nan; 3], |d| d.axis_fixed),
        axis_vehicle: d.map_or([nan; 3], |d| d.axis_vehicle),
        half_angle_rad: d.map_or(nan, |d| d.half_angle_rad),
        altitude_m: d.map_or(nan, |d| d.altitude_est_m),
        altitude_sigma_m: d.map_or(nan, |d| d.altitude_est_sigma_m),
        rms_px: d.map_or(nan, |d| d.rms_px),
        inliers: d.map_or(0, |d| d.inliers),
        edge_points: a.edge_points,
        candidates: a.candidates,
        dropped: a.dropped,
        level: a.level,
        status: a.status,
        stage: a.stage,
        listed: a.listed,
        edges: a.edges.map(|edge| edge.map_or(HznEdge::default(), to_edge)),
    }
}

fn to_edge(e: Edge) -> HznEdge {
    HznEdge {
        number: e.number,
        length_px: e.length_px,
        points: e.points,
        inliers: e.inliers,
        rms_px: e.rms_px,
        verdict: e.verdict,
    }
}

/// What is in place of an answer when a call is refused.
pub(crate) const NO_ANSWER: HznAnswer = HznAnswer {
    axis: [f32::NAN; 3],
    cov_rad2: [f32::NAN; 6],
    axis_fixed: [f32::NAN; 3],
    axis_vehicle: [f32::NAN; 3],
    half_angle_rad: f32::NAN,
    altitude_m: f32::NAN,
    altitude_sigma_m: f32::NAN,
    rms_px: f32::NAN,
    inliers: 0,
    edge_points: 0,
    candidates: 0,
    dropped: 0,
    level: 0,
    status: u8::MAX,
    stage: 0,
    listed: 0,
    edges: [HznEdge { number: 0, length_px: 0, points: 0, inliers: 0, rms_px: f32::NAN, verdict: 0 }; 16],
};
