//! What `process` answers.

use crate::geometry::frames::{Body, Cam, Cov3, Ecef, UnitVec3};
use crate::model::status::{Stage, Status};
use crate::model::verdict::Verdict;

/// Most bodies in one picture.
pub const MAX_BODIES: usize = 3;

/// Most candidates that a report lists; further ones are only counted, but for the chosen one.
pub const MAX_LISTED: usize = 16;

/// Reports of several bodies, in the order in which they were looked for.
pub type Reports<T> = heapless::Vec<Report<T>, MAX_BODIES>;

/// The answer to one picture. There is always one, whatever the picture.
#[derive(Debug, Clone)]
pub struct Report<T> {
    /// Outcome.
    pub status: Status,
    /// The last stage that was entered.
    pub stage: Stage,
    /// Level between dark and lit in the picture's own counts; 0 when it was not reached.
    pub level: u16,
    /// The level for the next picture, in counts: for `track`, with an answer only; of a picture that came row by row,
    /// always.
    pub next_level: Option<u16>,
    /// What was seen on the way.
    pub counters: Counters,
    /// The candidates that were looked at, in the order in which they were followed. The chosen one is always among
    /// them: in the last place, where it came after those that there is room for.
    pub candidates: heapless::Vec<Candidate<T>, MAX_LISTED>,
    /// The direction: with status `ok`, and never without.
    pub solution: Option<Solution<T>>,
}

impl<T> Report<T> {
    /// Of a picture that was not looked at.
    pub(crate) fn of_nothing() -> Self {
        Self {
            status: Status::Rejected,
            stage: Stage::Binarize,
            level: 0,
            next_level: None,
            counters: Counters::default(),
            candidates: heapless::Vec::new(),
            solution: None,
        }
    }
    /// Lists a candidate as the chosen one, in the last place where there was no room for it.
    pub(crate) fn choose(&mut self, mut chosen: Candidate<T>) {
        self.counters.edge_points = chosen.points;
        chosen.verdict = Verdict::Chosen;
        let place = self.candidates.iter().position(|c| c.number == chosen.number);
        let place = place.unwrap_or(self.candidates.len().saturating_sub(1));
        if let Some(listed) = self.candidates.get_mut(place) {
            *listed = chosen;
        }
    }
}

/// Counts of one picture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Border pixels of the edges that were followed, those beside a mask left out.
    pub followed: u32,
    /// Edges with enough points to be candidates.
    pub candidates: u32,
    /// Border pixels dropped because a list was full, by thinning or by leaving short edges out.
    pub dropped: u32,
    /// Edge points whose local mid-level was not found and that stand at the global level.
    pub fallback_points: u32,
    /// Sub-pixel points of the chosen candidate (of all candidates, when none was chosen).
    pub edge_points: u32,
    /// Of a picture that came row by row: edge points of candidates with a plateau that was not within the rows
    /// held.
    pub cut_points: u32,
    /// RANSAC draws that came to a consensus.
    pub draws: u32,
    /// What the picture cost, in the unit of `limits.max_work`.
    pub work: u32,
    /// How often its edges were looked for: 1, and more where the first look gave no answer (`[recover]`).
    pub looks: u32,
}

/// One candidate edge and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate<T> {
    /// Its place in the order of following, from 0.
    pub number: u32,
    /// Border pixels of the edge.
    pub length_px: u32,
    /// Sub-pixel points taken from it.
    pub points: u32,
    /// Points that fit the limb.
    pub inliers: u32,
    /// Weighted RMS distance of the inliers from the fitted limb in pixels; NaN when there was no fit.
    pub rms_px: T,
    /// What became of it.
    pub verdict: Verdict,
}

/// The half-angle that the limb itself shows: what the fit finds before the expected one is fused.
#[derive(Debug, Clone, Copy)]
pub struct Free<T> {
    /// Axis of the freely fitted cone in the camera frame.
    pub axis: UnitVec3<Cam, T>,
    /// cos of the half-angle.
    pub cos: T,
    /// Variance of `cos`: every term of the covariance except the expected half-angle's own.
    pub var_cos: T,
    /// Change of `cos` when every edge point moves by one pixel across the limb, 1/px: the weighted RMS of |∂(s·e)/∂(u,
    /// v)| over the points that carry the fit.
    pub cos_per_px: T,
}

/// A direction with its covariance.
#[derive(Debug, Clone, Copy)]
pub struct Solution<T> {
    /// Unit vector to the body in the camera frame: the limb axis for `earth`, the centre for spheres.
    pub axis: UnitVec3<Cam, T>,
    /// Covariance of `axis`, rad², rank 2.
    pub covariance: Cov3<Cam, T>,
    /// The same direction in ECEF, from the position: give both to a filter. Only for `earth` with a position.
    pub axis_ecef: Option<UnitVec3<Ecef, T>>,
    /// The same direction in the vehicle's frame, when there is a mounting.
    pub axis_body: Option<UnitVec3<Body, T>>,
    /// Half-angle of the half-angle-free fit in radians, before the expected one is fused.
    pub half_angle_rad: T,
    /// Half-angle of the answer (after fusing) in radians; the fitted limb is drawn with it.
    pub fused_half_angle_rad: T,
    /// Altitude estimate of the half-angle-free fit and its 1-sigma, metres; `None` for Sun and Moon.
    pub altitude_m: Option<(T, T)>,
    /// The half-angle-free fit in cosines; `None` when the half-angle was not fitted, and of an answer that came by
    /// telemetry.
    pub free: Option<Free<T>>,
    /// Weighted RMS distance of the inliers from the limb in pixels.
    pub rms_px: T,
    /// Edge points that carry the answer.
    pub inliers: u32,
    /// Length of edge that the inliers cover, in pixels.
    pub arc_px: T,
    /// Which candidate it is: its number.
    pub candidate: u32,
}
