//! The structures of the interface.

use hzn_core::Prior;
use hzn_core::body::{Kind, Last};
use hzn_core::frames::{Cam, Cov3, UnitVec3};
use hzn_flight::answer::{Edge, PictureAnswer};
use hzn_flight::attitude::AttitudeAndSun;
use hzn_flight::integrity::Integrity;

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

/// The prior of a picture. NaN means that a value is not known; of a vector all numbers are known, or none.
/// `hzn_nothing_known` fills it with NaN.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznKnown {
    /// Altitude in metres: geodetic for the Earth, above the radius for other bodies.
    pub altitude_m: f32,
    /// Position of the camera in the fixed frame of the body (for the Earth ECEF), metres. If it is known, the altitude
    /// is not used.
    pub position_m: [f32; 3],
    /// Rate of rotation of the camera in the camera frame, rad/s: for a rolling shutter, and to move the attitude and
    /// the Sun to the exposure.
    pub rate_rad_s: [f32; 3],
    /// Attitude: unit quaternion, scalar first, from the camera frame to the fixed frame of the body (for the Earth
    /// ECEF). With a position, an answer that contradicts it is refused (parameter 130).
    pub attitude_wxyz: [f32; 4],
    /// 1-sigma of the attitude about the worst axis, rad; NaN: 5 degrees.
    pub attitude_sigma_rad: f32,
    /// Direction to the Sun in the camera frame, of any length. A limb that it does not light is refused (parameter
    /// 131).
    pub sun: [f32; 3],
    /// Time from the attitude and the Sun to the exposure, s; NaN: 0. Both are moved by the rate, if it is known.
    pub attitude_age_s: f32,
    /// The attitude and the Sun are not used if they are further from the exposure than this, s; NaN: they do not
    /// expire. 0, less than 0 and infinity are refused.
    pub attitude_expires_s: f32,
    /// `axis` of the last answer. With parameter 132, an answer that is too far from it is refused.
    pub last_axis: [f32; 3],
    /// `cov_rad2` of that answer. Both are given, or none.
    pub last_cov_rad2: [f32; 6],
    /// Time from the exposure of that answer to this one, s.
    pub last_age_s: f32,
    /// Temperature of the camera, °C, for a lens that changes with it (parameters 24 to 28).
    pub camera_temperature_c: f32,
}

impl HznKnown {
    /// Nothing is known.
    pub(crate) const NOTHING: Self = Self {
        altitude_m: f32::NAN,
        position_m: [f32::NAN; 3],
        rate_rad_s: [f32::NAN; 3],
        attitude_wxyz: [f32::NAN; 4],
        attitude_sigma_rad: f32::NAN,
        sun: [f32::NAN; 3],
        attitude_age_s: f32::NAN,
        attitude_expires_s: f32::NAN,
        last_axis: [f32::NAN; 3],
        last_cov_rad2: [f32::NAN; 6],
        last_age_s: f32::NAN,
        camera_temperature_c: f32::NAN,
    };
}

/// Attitude and Sun: not given.
pub(crate) const NOT_GIVEN: u8 = 0;
/// Attitude and Sun: used.
const USED: u8 = 1;
/// Attitude and Sun: expired, and not used.
const EXPIRED: u8 = 2;

/// The answer to a picture. Without a direction (status not 0) the values from `axis` to `rms_px` and those from
/// `p_limb` on are NaN, and `inliers` is 0. After a call that returns an error, `status` is 255 and every other number
/// is NaN or 0.
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
    /// Attitude and Sun of `HznKnown`: 0 not given, 1 used, 2 expired and not used.
    pub attitude: u8,
    /// The first candidates, and the chosen one.
    pub edges: [HznEdge; 16],
    /// Probability that the edge of the answer is the limb, which parameter 135 is compared with; NaN for bodies
    /// without air.
    pub p_limb: f32,
    /// Angle that the error of `axis` exceeds with the probability of parameter 105 if the edge is the limb, rad; NaN
    /// without `p_limb`.
    pub protection_rad: f32,
    /// The part of `cov_rad2` whose error is the same in the next picture while the geometry stays. A mean of n answers
    /// has the covariance `cov_common_rad2 + (cov_rad2 - cov_common_rad2) / n`.
    pub cov_common_rad2: [f32; 6],
}

/// What the heads of a rig share, and their mounts. `hzn_rig_usual` fills it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznRigSetup {
    /// Probability of a false alarm of the check of each head by the others, for each epoch.
    pub false_alarm: f64,
    /// Probability that the error exceeds `protection_rad`, if at most one head is wrong.
    pub misleading: f64,
    /// 1-sigma of a tilt of the limb that all heads share, km; NaN: it follows from the half-angle.
    pub limb_tilt_sigma_km: f32,
    /// 1-sigma of the limb height that each head has for itself, km.
    pub limb_own_sigma_km: f32,
    /// Distance along the limb at which the correlation of that height has fallen to exp(-1/2), km.
    pub limb_own_length_km: f32,
    /// 1-sigma of the attitude of the rig on the vehicle about each axis, rad.
    pub sigma_rad: f32,
    /// Quaternion from each camera to the vehicle, scalar first; NaN: there is no such head.
    pub q_vehicle_from_camera_wxyz: [[f32; 4]; 4],
    /// Covariance of each mount: xx, xy, xz, yy, yz, zz of a small rotation about the axes of the vehicle, rad².
    pub mount_cov_rad2: [[f32; 6]; 4],
    /// Number of the limb that each head sees, 0 to 3: heads of different bands see limbs of different heights.
    pub limb_groups: [u32; 4],
}

/// The joint answer of a rig. A set of heads has the bit 2^k for head k. Without a direction (status not 0) its numbers
/// are NaN. After a call that returns an error, `status` is 255.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznRigAnswer {
    /// Middle of the exposures that are used, s, from the instant of the heads' times; NaN: not known.
    pub time_s: f64,
    /// Unit vector to the body, vehicle's frame.
    pub axis_vehicle: [f32; 3],
    /// Covariance of `axis_vehicle`: xx, xy, xz, yy, yz, zz, rad².
    pub cov_rad2: [f32; 6],
    /// Half-angle of the limb, rad.
    pub half_angle_rad: f32,
    /// Angle by which the axis moves without the head that agrees least, rad; NaN with one head.
    pub separation_rad: f32,
    /// Largest such angle that the covariance allows, rad.
    pub separation_limit_rad: f32,
    /// Angle that the error exceeds with the probability `misleading`, if at most one head is wrong, rad; NaN with one
    /// head.
    pub protection_rad: f32,
    /// Status: the value that `hzn_rig_join` returned.
    pub status: u8,
    /// Heads that have a picture.
    pub heads_seen: u8,
    /// Heads that have an answer and a mount.
    pub heads_answered: u8,
    /// Heads that are in the joint answer.
    pub heads_used: u8,
    /// Heads that the check excluded.
    pub heads_excluded: u8,
}

/// What is in place of a joint answer when a call is refused.
pub(crate) const NO_RIG_ANSWER: HznRigAnswer = HznRigAnswer {
    time_s: f64::NAN,
    axis_vehicle: [f32::NAN; 3],
    cov_rad2: [f32::NAN; 6],
    half_angle_rad: f32::NAN,
    separation_rad: f32::NAN,
    separation_limit_rad: f32::NAN,
    protection_rad: f32::NAN,
    status: u8::MAX,
    heads_seen: 0,
    heads_answered: 0,
    heads_used: 0,
    heads_excluded: 0,
};

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

/// Returns a vector; `Some(None)` if it is not known, `None` if a part of it is NaN.
fn known<const N: usize>(v: [f32; N]) -> Option<Option<[f32; N]>> {
    match v.iter().filter(|x| x.is_nan()).count() {
        0 => Some(Some(v)),
        unknown if unknown == N => Some(None),
        _ => None,
    }
}

/// Returns the values as the sensor for this body takes them, and what became of the attitude and the Sun; `None` if a
/// part of a vector is NaN, or if the attitude, the Sun, a time or the last answer is impossible.
pub(crate) fn to_prior(values: &HznKnown, body: Kind) -> Option<(Prior<f32>, u8)> {
    let prior = Prior {
        altitude_m: (!values.altitude_m.is_nan()).then_some(values.altitude_m),
        position_m: known(values.position_m)?,
        rate_rad_s: known(values.rate_rad_s)?,
        last: to_last(values)?,
        camera_temperature_c: (!values.camera_temperature_c.is_nan()).then_some(values.camera_temperature_c),
        ..Prior::default()
    };
    let attitude = AttitudeAndSun::try_new(values.attitude_wxyz, values.attitude_sigma_rad, values.sun).ok()?;
    let age_s = if values.attitude_age_s.is_nan() { 0.0 } else { values.attitude_age_s };
    if attitude.is_empty() {
        Some((prior, NOT_GIVEN))
    } else if !age_s.is_finite() || values.attitude_expires_s <= 0.0 || values.attitude_expires_s.is_infinite() {
        None
    } else if age_s.abs() > values.attitude_expires_s {
        Some((prior, EXPIRED))
    } else {
        Some((attitude.moved(prior.rate_rad_s, age_s, body).added_to(prior), USED))
    }
}

/// Returns the last answer; `Some(None)` if there was none, `None` if it is impossible.
fn to_last(values: &HznKnown) -> Option<Option<Last<f32>>> {
    let (axis, covariance) = match (known(values.last_axis)?, known(values.last_cov_rad2)?) {
        (Some(axis), Some(covariance)) => (axis, covariance),
        (None, None) => return Some(None),
        // One of the two alone would switch the comparison off without a word.
        _ => return None,
    };
    let [xx, _, _, yy, _, zz] = covariance;
    if [xx, yy, zz].iter().any(|variance| *variance < 0.0) {
        return None;
    }
    let sigma_rad = Cov3::<Cam, f32>::from_upper(covariance).sigma_max_rad();
    let age_s = values.last_age_s;
    (sigma_rad.is_finite() && age_s.is_finite() && age_s >= 0.0)
        .then_some(Last { axis: UnitVec3::try_new(axis)?, sigma_rad, age_s })
        .map(Some)
}

pub(crate) fn to_answer(a: &PictureAnswer, attitude: u8) -> HznAnswer {
    let nan = f32::NAN;
    let d = a.direction.as_ref();
    let integrity = a.integrity.unwrap_or(Integrity::NONE);
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
        attitude,
        edges: a.edges.map(|edge| edge.map_or(HznEdge::default(), to_edge)),
        p_limb: integrity.p_limb,
        protection_rad: integrity.protection_rad,
        cov_common_rad2: integrity.cov_common,
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
    attitude: NOT_GIVEN,
    edges: [HznEdge { number: 0, length_px: 0, points: 0, inliers: 0, rms_px: f32::NAN, verdict: 0 }; 16],
    p_limb: f32::NAN,
    protection_rad: f32::NAN,
    cov_common_rad2: [f32::NAN; 6],
};
