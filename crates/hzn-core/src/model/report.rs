//! The report that `process` returns.

use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Cov3, Fixed, UnitVec3, Vehicle};
use crate::geometry::scaling::ScaledCone;
use crate::model::status::{Stage, Status};
use crate::model::verdict::Verdict;

/// Maximum number of bodies in one picture.
// Three are Earth, Sun and Moon in one picture. Every body adds a configuration and a report to the static memory.
pub const MAX_BODIES: usize = 3;

/// Maximum number of candidates that a report lists. Further candidates are only counted, except for the chosen one.
// The list is bounded because a report has a fixed size and a cloudy picture may have hundreds of edges.
pub const MAX_LISTED: usize = 16;

/// Reports of several bodies, in the order of the search.
pub type Reports<T> = heapless::Vec<Report<T>, MAX_BODIES>;

/// The report on one picture. Every picture gets a report.
///
/// # What to look at
///
/// Check [`Self::status`] first. With [`Status::Ok`] there is a [`Self::solution`]; with any other status there is
/// none, and [`Self::stage`], [`Self::counters`] and the verdicts of [`Self::candidates`] say how far the picture came
/// and why it was refused.
///
/// # Example
///
/// ```
/// # use hzn_core::camera::{self, Model};
/// # use hzn_core::image::{Grey, Layout};
/// # use hzn_core::{Config, FlightHorizon, Prior};
/// # let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// # config.body.altitude_km = Some(230.0);
/// # let data: Vec<u8> = (0..64 * 48).map(|i| if i / 64 < 20 { 5 } else { 200 }).collect();
/// # let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
/// # let mut horizon = FlightHorizon::boxed(&config)?;
/// # let expected = horizon.expect(&Prior::default())?;
/// let report = horizon.process(&picture, &expected);
/// match &report.solution {
///     Some(solution) => println!("axis {:?} in the camera", solution.axis.xyz()),
///     None => {
///         println!("{} at stage {}", report.status, report.stage.name());
///         for edge in &report.candidates {
///             println!("edge of {} px: {}", edge.length_px, edge.verdict.name());
///         }
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Report<T> {
    /// Outcome of the picture.
    pub status: Status,
    /// The furthest stage that was entered.
    pub stage: Stage,
    /// Threshold in the picture's own counts; 0 when there is none.
    pub level: u16,
    /// Threshold for the next picture, in counts. With `track`, only a picture with an answer has one; a picture that
    /// arrives row by row always has one.
    pub next_level: Option<u16>,
    /// Counts of the processing.
    pub counters: Counters,
    /// The candidates that were examined, in the order in which they were followed. The chosen one is always listed: in
    /// the last place, if it came after the list was full.
    pub candidates: heapless::Vec<Candidate<T>, MAX_LISTED>,
    /// The direction. It is present if and only if the status is `ok`.
    pub solution: Option<Solution<T>>,
    /// Whether the edge of the answer stays in the picture while the vehicle turns, with `gates.fixed_edge = "warn"`.
    /// Only a sequence shows it, see [`Sequence`](crate::Sequence).
    pub is_suspect: bool,
}

impl<T> Report<T> {
    /// Makes the report on a picture that is not processed yet.
    pub(crate) fn empty() -> Self {
        Self {
            // A report that is never finished must not look like an answer.
            status: Status::Rejected,
            stage: Stage::Threshold,
            level: 0,
            next_level: None,
            counters: Counters::default(),
            candidates: heapless::Vec::new(),
            solution: None,
            is_suspect: false,
        }
    }
    /// Returns whether the limb was found where the answer to the picture before put it, without a search of the
    /// picture; see [`Tracker`](crate::Tracker).
    pub fn is_tracked(&self) -> bool {
        self.solution.is_some() && self.counters.looks == 0
    }
    /// Returns whether a candidate won that is an edge in a glow, see [`Verdict::Glow`].
    pub(crate) fn glows(&self) -> bool {
        self.candidates.iter().any(|c| c.verdict == Verdict::Glow)
    }
    /// Takes the answer back: the candidate that won gets this verdict.
    pub(crate) fn reject(&mut self, verdict: Verdict) {
        self.solution = None;
        self.status = Status::Rejected;
        if let Some(chosen) = self.candidates.iter_mut().find(|c| c.verdict == Verdict::Chosen) {
            chosen.verdict = verdict;
        }
    }
    /// Lists the candidate that won, in the last place if the list has no room for it. Its verdict is `Chosen`, or the
    /// reason why the picture has no answer all the same.
    pub(crate) fn choose(&mut self, mut chosen: Candidate<T>, verdict: Verdict) {
        self.counters.edge_points = chosen.points;
        chosen.verdict = verdict;
        let place = self.candidates.iter().position(|c| c.number == chosen.number);
        // The last place is given up, so that the others keep the order of following.
        let place = place.unwrap_or(self.candidates.len().saturating_sub(1));
        if let Some(listed) = self.candidates.get_mut(place) {
            *listed = chosen;
        }
    }
}

/// Counts of one picture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Border pixels of the edges that were followed, without those next to a mask.
    pub followed: u32,
    /// Edges with enough points to be candidates.
    pub candidates: u32,
    /// Border pixels that were dropped because a list was full: edges were thinned, or short edges left out.
    pub dropped: u32,
    /// Edge points without a local mid-level, which are located at the picture's threshold instead.
    pub fallback_points: u32,
    /// Sub-pixel points of the chosen candidate (of all candidates, when none was chosen).
    pub edge_points: u32,
    /// Places of the picture that were read for the threshold, where none of them is bright; otherwise 0.
    pub sampled: u32,
    /// For a picture that arrives row by row: edge points of the candidates with a plateau that is not within the rows
    /// in memory.
    pub cut_points: u32,
    /// Draws of the consensus stage, for the candidates that reached a consensus.
    pub draws: u32,
    /// Cost of the picture, in the unit of `limits.max_work`.
    pub work: u32,
    /// Number of looks at the whole picture: 1, or more if the first look gives no answer (`[retry]`). 0 if the limb
    /// was found where the last answer put it ([`Report::is_tracked`]).
    pub looks: u32,
}

/// One candidate edge and its verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate<T> {
    /// Number in the order of following, from 0.
    pub number: u32,
    /// Border pixels of the edge.
    pub length_px: u32,
    /// Number of its sub-pixel points.
    pub points: u32,
    /// Number of points that agree with the fitted limb.
    pub inliers: u32,
    /// Weighted RMS distance of the inliers from the fitted limb in pixels; NaN when there was no fit.
    pub rms_px: T,
    /// The verdict.
    pub verdict: Verdict,
}

/// The fit with a free half-angle, before the expected half-angle is fused.
#[derive(Debug, Clone, Copy)]
pub struct Free<T> {
    /// Axis of the freely fitted cone in the camera frame.
    pub axis: UnitVec3<Cam, T>,
    /// Covariance of `axis`, rad²: all terms except that of the expected half-angle.
    pub covariance: Cov3<Cam, T>,
    /// cos of the half-angle.
    pub cos: T,
    /// Variance of `cos`: all terms of the covariance except that of the expected half-angle.
    pub var_cos: T,
    /// Covariance of `axis` with `cos` in the camera frame, rad. On a short arc both are known only together. `None`
    /// when the answer came by telemetry.
    pub axis_with_cos: Option<[T; 3]>,
    /// Change of `cos` when every edge point moves by one pixel across the limb, 1/px: the weighted RMS of
    /// |∂(s·e)/∂(u, v)| over the points with a weight in the fit.
    pub cos_per_px: T,
    /// The part of this covariance whose error is the same in the next picture, as [`Solution::common`] is that of the
    /// answer. `None` if the method does not know the part (`braun-barf`), or when the answer came by telemetry.
    pub common: Option<FreeCommon<T>>,
}

/// The part of the covariance of a freely fitted cone ([`Free`]) whose error is the same in the next picture.
#[derive(Debug, Clone, Copy)]
pub struct FreeCommon<T> {
    /// Covariance of the axis in the camera frame, rad².
    pub covariance: Cov3<Cam, T>,
    /// Variance of the cosine of the half-angle.
    pub var_cos: T,
    /// Covariance of the axis with the cosine in the camera frame, rad.
    pub axis_with_cos: [T; 3],
}

/// The position of a body's centre, from the limb alone or with a known distance.
///
/// Position and axis of one picture hold the same information: a filter must use only one of them.
///
/// # Frames and units
///
/// The position goes from the camera to the centre of the body, in the camera frame, metres. Its covariance is a full
/// 3×3 matrix: on a short arc, direction and distance are known only together, along a straight ridge. A filter must
/// not split them.
#[derive(Debug, Clone, Copy)]
pub struct Position<T> {
    /// From the camera to the centre of the body in the camera frame, metres.
    pub centre_m: [T; 3],
    /// Covariance of `centre_m`: the upper triangle xx, xy, xz, yy, yz, zz, in m².
    pub covariance_m2: [T; 6],
    /// Distance from the centre before the known distance was fused, and its 1-sigma, metres.
    pub free_range_m: (T, T),
    /// Position of the camera in the axes of the body, metres; `None` without an attitude. Its error contains the whole
    /// error of the attitude.
    pub body_fixed_m: Option<[T; 3]>,
    /// Rotation of the body about the line to it, relative to the given orientation, and its 1-sigma, radians:
    /// right-handed about the direction from the camera to the body. `None` if the 1-sigma is above
    /// `fit.yaw_limit_deg`. The third axis of an attitude, from the shape of the limb.
    pub yaw_rad: Option<(T, T)>,
    /// The limb of the body in its scaled space.
    pub(crate) limb: ScaledCone<T>,
}

impl<T: Real> Position<T> {
    /// Converts the position to double precision.
    pub fn to_f64(&self) -> Position<f64> {
        Position {
            centre_m: self.centre_m.map(Real::to_f64),
            covariance_m2: self.covariance_m2.map(Real::to_f64),
            free_range_m: (self.free_range_m.0.to_f64(), self.free_range_m.1.to_f64()),
            body_fixed_m: self.body_fixed_m.map(|x| x.map(Real::to_f64)),
            yaw_rad: self.yaw_rad.map(|(yaw, sigma)| (yaw.to_f64(), sigma.to_f64())),
            limb: self.limb.to_f64(),
        }
    }

    /// Returns a direction along the limb of the body, for an angle about its axis, in radians.
    pub fn limb_direction(&self, angle_rad: T) -> UnitVec3<Cam, T> {
        let ScaledCone { e, c, scaling } = &self.limb;
        let (b1, b2) = basis(e);
        let sin_half_angle = (T::one() - *c * *c).max(T::ZERO).sqrt();
        let (sin, cos) = angle_rad.sin_cos();
        let ray = e * *c + (b1 * cos + b2 * sin) * sin_half_angle;
        UnitVec3::assume_unit(scaling.as_ref().map_or(ray, |scaling| scaling.unscale(&ray)))
    }
}

impl<T: Real> Solution<T> {
    /// Returns the unit vector (right, down) in the picture from the principal point towards the body, and the standard
    /// deviation of its direction in radians. This is HORACE's two-dimensional answer (Barf 2014, (2.37)). `None` for a
    /// body straight ahead or straight behind, which is in no direction.
    pub fn picture_direction(&self) -> Option<([T; 2], T)> {
        let [x, y, _] = self.axis.xyz();
        let [right, down] = self.axis.to_picture_direction()?;
        let across = UnitVec3::assume_unit(V3::new(-down, right, T::ZERO));
        let variance = self.covariance.variance_along(&across).max(T::ZERO);
        Some(([right, down], (variance / (x * x + y * y)).sqrt()))
    }

    /// Returns the larger standard deviation of the errors that the next picture does not share, radians; that of the
    /// whole error if the common part is not known.
    pub fn noise_rad(&self) -> T {
        let common = self.common.map_or([T::zero(); 6], |common| common.upper_rad2);
        let mut noise = self.covariance;
        noise.upper_rad2.iter_mut().zip(common).for_each(|(all, common)| *all -= common);
        noise.sigma_max_rad()
    }
}

/// A direction with its covariance.
///
/// # Frames and units
///
/// The axis is a unit vector in the camera frame (x right, y down, z forward). Its covariance is in rad², 3×3 and of
/// rank 2: a direction has no error along itself. A filter uses it with any two axes perpendicular to the direction.
///
/// # Example
///
/// A filter tests an answer against its own prediction before it uses the answer:
///
/// ```
/// use hzn_core::Solution;
/// use hzn_core::frames::{Cam, UnitVec3};
///
/// /// Whether the answer lies within three standard deviations of the predicted direction.
/// fn is_plausible(solution: &Solution<f64>, predicted: &UnitVec3<Cam, f64>) -> bool {
///     solution.axis.angle_rad(predicted) < 3.0 * solution.covariance.sigma_max_rad()
/// }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Solution<T> {
    /// Unit vector to the body in the camera frame: the limb axis for `earth`, the centre for spheres.
    pub axis: UnitVec3<Cam, T>,
    /// Covariance of `axis`, rad², rank 2.
    pub covariance: Cov3<Cam, T>,
    /// The part of `covariance` whose error is the same in the next picture while the geometry stays, rad², rank 2. A
    /// mean of n such answers has the covariance common + (covariance − common)/n. `None` if the method does not know
    /// the part (`braun-barf`), or when the answer came by telemetry without the integrity packet.
    ///
    /// All terms of the [`ErrorBudget`](crate::error_budget::ErrorBudget) are common except the errors of the edge
    /// points: the noise of the detector is new in every picture, and the vehicle moves past clouds. The part includes
    /// the gain of the fusion with the expected half-angle.
    pub common: Option<Cov3<Cam, T>>,
    /// The same direction in the fixed frame, computed from the position; only for `earth` with a position. A filter
    /// needs both directions.
    pub axis_fixed: Option<UnitVec3<Fixed, T>>,
    /// The same direction in the vehicle's body frame, when there is a mounting.
    pub axis_vehicle: Option<UnitVec3<Vehicle, T>>,
    /// Half-angle of the fit with a free half-angle in radians, before the expected one is fused.
    pub half_angle_rad: T,
    /// Half-angle of the answer (after the fusion) in radians. The fitted limb is drawn with it.
    pub fused_half_angle_rad: T,
    /// Altitude from the fit with a free half-angle and its 1-sigma, metres; `None` for Sun and Moon.
    pub altitude_m: Option<(T, T)>,
    /// The fit with a free half-angle in cosines; `None` when the half-angle was not fitted, or when the answer came by
    /// telemetry.
    pub free: Option<Free<T>>,
    /// Derivative of `axis` by the cosine of the expected half-angle (camera frame); zero if the axis does not depend
    /// on it. A wrong limb height moves the cosines of all pictures alike, so that a filter needs this derivative.
    /// `None` when the answer came by telemetry.
    pub axis_by_cos: Option<[T; 3]>,
    /// The position of the body's centre, with `fit.position`; `None` if the arc is too short for a position.
    pub position: Option<Position<T>>,
    /// Probability that the edge of the answer is the limb, from all [evidence](crate::evidence). It is only known for
    /// bodies with air. `None` when the half-angle was not fitted, or when the answer came by telemetry without the
    /// integrity packet.
    pub p_limb: Option<T>,
    /// Whether the limb is the outer edge of the layer of airglow (`body.night`). `false` when the answer came by
    /// telemetry.
    pub is_airglow: bool,
    /// Weighted RMS distance of the inliers from the limb in pixels.
    pub rms_px: T,
    /// Number of inliers: edge points with a weight above 0 in the fit.
    pub inliers: u32,
    /// Length of the edge that the inliers cover, in pixels.
    pub arc_px: T,
    /// The number of the candidate that is the answer.
    pub candidate: u32,
}
