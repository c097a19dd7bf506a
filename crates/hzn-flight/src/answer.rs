//! A report as records for telemetry, with every bit of its numbers.

use hzn_core::frames::{Cov3, UnitVec3};
use hzn_core::report::{Candidate, Counters, Free, MAX_LISTED};
use hzn_core::status::{Stage, Status};
use hzn_core::verdict::Verdict;
use hzn_core::{Config, Report, Solution};

use crate::bytes::{Reader, Writer};
use crate::integrity::Integrity;
use crate::record::record;

type Candidates = heapless::Vec<Candidate<f64>, MAX_LISTED>;

record! {
    /// The outcome of a picture.
    Outcome {
        /// [`hzn_core::status::Status`] as a number.
        status: u8,
        /// [`hzn_core::status::Stage`] as a number: the last stage that was entered.
        stage: u8,
        /// Number of looks at the picture, each at another threshold. 0 with a direction: the limb was tracked, which
        /// is found where the picture before has it.
        looks: u8,
        /// Threshold between dark and lit in counts; 0: not reached.
        level: u16,
        /// Border pixels that were followed.
        followed: u32,
        /// Number of edges that were examined as candidates, listed or not.
        candidates: u32,
        /// Border pixels that were dropped.
        dropped: u32,
        /// Points at the threshold of the whole picture, because their local mid-level was not found.
        fallback_points: u32,
        /// Edge points of the chosen edge.
        edge_points: u32,
        /// Draws of the consensus.
        draws: u32,
        /// Work of the picture, in the unit of `limits.max_work`.
        work: u32,
        /// Number of candidates whose packets came before this one.
        listed: u8,
        /// 1: there is a direction. 0: there is none, and the numbers that follow are NaN or 0.
        solved: u8,
    }
}

record! {
    /// A direction; see [`hzn_core::Solution`].
    Direction {
        /// Unit vector to the body, in the camera frame.
        axis: [f32; 3],
        /// Covariance of `axis`, rad².
        cov: [f32; 6],
        /// The same direction in the fixed frame of the body (for the Earth ECEF); NaN without a position.
        axis_fixed: [f32; 3],
        /// The same direction in the vehicle's frame; NaN without a mounting.
        axis_vehicle: [f32; 3],
        /// Half-angle of the free fit, rad.
        half_angle_rad: f32,
        /// Half-angle of the answer, rad.
        fused_half_angle_rad: f32,
        /// Altitude from the free fit, m; NaN where the half-angle does not give one.
        altitude_est_m: f32,
        /// 1-sigma of that altitude, m.
        altitude_est_sigma_m: f32,
        /// RMS distance of the inliers, px.
        rms_px: f32,
        /// Length of the edge that the inliers cover, px.
        arc_px: f32,
        /// Number of edge points that carry the answer.
        inliers: u32,
        /// Number of the chosen candidate.
        candidate: u32,
    }
}

record! {
    /// The fit with a free half-angle, and the position of the body's centre. What is not known is NaN.
    Position {
        /// Axis of the fit with a free half-angle, in the camera frame.
        axis_free: [f32; 3],
        /// Covariance of `axis_free`, rad²: all terms except that of the expected half-angle.
        cov_free: [f32; 6],
        /// Cosine of the free half-angle.
        cos_free: f32,
        /// Variance of `cos_free`.
        cos_free_variance: f32,
        /// Change of `cos_free` when every edge point moves by one pixel across the limb, 1/px.
        cos_free_per_px: f32,
        /// Derivative of the axis by the cosine of the expected half-angle, in the camera frame.
        axis_by_cos: [f32; 3],
        /// Position of the body's centre from the camera, in the camera frame, m; only with `fit.position`.
        position_m: [f32; 3],
        /// Covariance of `position_m`, m².
        pos_cov_m2: [f32; 6],
        /// Distance of the centre before the known distance was fused, m.
        range_m: f32,
        /// 1-sigma of that distance, m.
        range_sigma_m: f32,
        /// Position of the camera in the axes of the body, m.
        body_fixed_m: [f32; 3],
    }
}

record! {
    /// A candidate edge.
    Edge {
        /// Number of the candidate, from 0.
        number: u32,
        /// Number of border pixels.
        length_px: u32,
        /// Number of sub-pixel points.
        points: u32,
        /// Number of points that fit the limb.
        inliers: u32,
        /// RMS distance of the inliers from the limb in pixels; NaN without a fit.
        rms_px: f32,
        /// [`hzn_core::verdict::Verdict`] as a number.
        verdict: u8,
    }
}

const NAN: f32 = f32::NAN;

impl Direction {
    /// Returns the estimated altitude and its 1-sigma in metres, if they are known.
    fn altitude_est_and_sigma_m(&self) -> Option<(f64, f64)> {
        (!self.altitude_est_m.is_nan()).then(|| (self.altitude_est_m.into(), self.altitude_est_sigma_m.into()))
    }

    /// What a picture without a direction has.
    // NaN, because the packet has a fixed size and 0 could be taken for a value.
    pub const NONE: Self = Self {
        axis: [NAN; 3],
        cov: [NAN; 6],
        axis_fixed: [NAN; 3],
        axis_vehicle: [NAN; 3],
        half_angle_rad: NAN,
        fused_half_angle_rad: NAN,
        altitude_est_m: NAN,
        altitude_est_sigma_m: NAN,
        rms_px: NAN,
        arc_px: NAN,
        inliers: 0,
        candidate: 0,
    };

    fn from_solution(s: &Solution<f32>) -> Self {
        let (altitude_est_m, altitude_est_sigma_m) = s.altitude_m.unwrap_or((NAN, NAN));
        Self {
            axis: s.axis.xyz(),
            cov: s.covariance.upper_rad2,
            axis_fixed: s.axis_fixed.map_or([NAN; 3], |a| a.xyz()),
            axis_vehicle: s.axis_vehicle.map_or([NAN; 3], |a| a.xyz()),
            half_angle_rad: s.half_angle_rad,
            fused_half_angle_rad: s.fused_half_angle_rad,
            altitude_est_m,
            altitude_est_sigma_m,
            rms_px: s.rms_px,
            arc_px: s.arc_px,
            inliers: s.inliers,
            candidate: s.candidate,
        }
    }
}

impl Position {
    /// What a picture without a position and without a free fit has.
    pub const NONE: Self = Self {
        axis_free: [NAN; 3],
        cov_free: [NAN; 6],
        cos_free: NAN,
        cos_free_variance: NAN,
        cos_free_per_px: NAN,
        axis_by_cos: [NAN; 3],
        position_m: [NAN; 3],
        pos_cov_m2: [NAN; 6],
        range_m: NAN,
        range_sigma_m: NAN,
        body_fixed_m: [NAN; 3],
    };

    fn from_solution(s: &Solution<f32>) -> Option<Self> {
        // Without both there is no packet, because its 140 bytes would say nothing.
        if s.free.is_none() && s.position.is_none() {
            return None;
        }
        let mut p = Self { axis_by_cos: s.axis_by_cos.unwrap_or([NAN; 3]), ..Self::NONE };
        if let Some(free) = &s.free {
            (p.axis_free, p.cov_free) = (free.axis.xyz(), free.covariance.upper_rad2);
            (p.cos_free, p.cos_free_variance, p.cos_free_per_px) = (free.cos, free.var_cos, free.cos_per_px);
        }
        if let Some(position) = &s.position {
            (p.position_m, p.pos_cov_m2) = (position.centre_m, position.covariance_m2);
            (p.range_m, p.range_sigma_m) = position.free_range_m;
            p.body_fixed_m = position.body_fixed_m.unwrap_or([NAN; 3]);
        }
        Some(p)
    }

    fn free(&self) -> Option<Free<f64>> {
        Some(Free {
            axis: unit(self.axis_free.map(f64::from))?,
            covariance: Cov3::from_upper(self.cov_free.map(f64::from)),
            cos: self.cos_free.into(),
            var_cos: self.cos_free_variance.into(),
            axis_with_cos: None,
            cos_per_px: self.cos_free_per_px.into(),
            common: None,
        })
    }
}

/// Returns a candidate in double precision; `None` if its verdict has no meaning.
fn to_candidate(e: &Edge) -> Option<Candidate<f64>> {
    Some(Candidate {
        number: e.number,
        length_px: e.length_px,
        points: e.points,
        inliers: e.inliers,
        rms_px: f64::from(e.rms_px),
        verdict: *Verdict::ALL.get(usize::from(e.verdict))?,
    })
}

/// Returns a direction as it was sent. Only if another program sent it with another length, it is normalised.
fn unit<F>(xyz: [f64; 3]) -> Option<UnitVec3<F, f64>> {
    UnitVec3::from_unit(xyz).or_else(|| UnitVec3::try_new(xyz))
}

/// The answer to one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureAnswer {
    /// The outcome, with its counts.
    pub outcome: Outcome,
    /// The direction; only with status `ok`.
    pub direction: Option<Direction>,
    /// The free fit and the position, if there is one of them.
    pub position: Option<Position>,
    /// How far the direction can be trusted.
    pub integrity: Option<Integrity>,
    /// The first candidates, including the chosen one.
    pub edges: [Option<Edge>; MAX_LISTED],
}

impl core::ops::Deref for PictureAnswer {
    type Target = Outcome;
    fn deref(&self) -> &Outcome {
        &self.outcome
    }
}

impl PictureAnswer {
    /// Makes the answer from a report about the first body of this configuration.
    pub fn from_report(report: &Report<f32>, config: &Config) -> Self {
        let c = &report.counters;
        let mut edges = [None; MAX_LISTED];
        for (edge, c) in edges.iter_mut().zip(&report.candidates) {
            *edge = Some(Edge {
                number: c.number,
                length_px: c.length_px,
                points: c.points,
                inliers: c.inliers,
                rms_px: c.rms_px,
                verdict: c.verdict as u8,
            });
        }
        let direction = report.solution.as_ref().map(Direction::from_solution);
        let outcome = Outcome {
            status: report.status as u8,
            stage: report.stage as u8,
            looks: c.looks.min(255) as u8,
            level: report.level,
            followed: c.followed,
            candidates: c.candidates,
            dropped: c.dropped,
            fallback_points: c.fallback_points,
            edge_points: c.edge_points,
            draws: c.draws,
            work: c.work,
            listed: report.candidates.len() as u8,
            solved: u8::from(direction.is_some()),
        };
        let position = report.solution.as_ref().and_then(Position::from_solution);
        let integrity = report.solution.as_ref().map(|s| Integrity::from_solution(s, config));
        Self { outcome, direction, position, integrity, edges }
    }

    /// Returns the report in double precision, as on a workstation; `None` if a number in it has no meaning. The
    /// position is in [`Self::position`] alone.
    pub fn to_report(&self) -> Option<Report<f64>> {
        let mut candidates = Candidates::default();
        for e in self.edges.iter().flatten() {
            candidates.push(to_candidate(e)?).ok()?;
        }
        // Double precision, so that the rows of `hzn telemetry` have the columns and the type of those of `hzn run`.
        let widen = |v: [f32; 3]| v.map(f64::from);
        let solution = match &self.direction {
            None => None,
            Some(d) => Some(Solution {
                axis: unit(widen(d.axis))?,
                covariance: Cov3::from_upper(d.cov.map(f64::from)),
                common: self.integrity.and_then(|i| i.common()),
                axis_fixed: unit(widen(d.axis_fixed)),
                axis_vehicle: unit(widen(d.axis_vehicle)),
                half_angle_rad: d.half_angle_rad.into(),
                fused_half_angle_rad: d.fused_half_angle_rad.into(),
                altitude_m: d.altitude_est_and_sigma_m(),
                free: self.position.and_then(|p| p.free()),
                axis_by_cos: self.position.map(|p| widen(p.axis_by_cos)).filter(|v| !v.iter().any(|x| x.is_nan())),
                position: None,
                p_limb: self.integrity.and_then(|i| i.p_limb()),
                is_airglow: false,
                rms_px: d.rms_px.into(),
                inliers: d.inliers,
                arc_px: d.arc_px.into(),
                candidate: d.candidate,
            }),
        };
        let o = &self.outcome;
        Some(Report {
            status: *Status::ALL.get(usize::from(o.status))?,
            stage: *Stage::ALL.get(usize::from(o.stage))?,
            level: o.level,
            // Telemetry does not have it: the next picture was exposed long before.
            next_level: None,
            counters: Counters {
                followed: o.followed,
                candidates: o.candidates,
                dropped: o.dropped,
                fallback_points: o.fallback_points,
                edge_points: o.edge_points,
                draws: o.draws,
                work: o.work,
                // Telemetry has neither; the first is missing for a picture that came row by row.
                cut_points: 0,
                sampled: 0,
                looks: o.looks.into(),
            },
            candidates,
            solution,
            // The computer sends an event instead.
            is_suspect: false,
        })
    }

    /// Appends outcome and direction, as in a science packet.
    pub fn write_science(&self, out: &mut Writer<'_>) {
        self.outcome.write(out);
        self.direction.unwrap_or(Direction::NONE).write(out);
    }

    /// Reads outcome and direction; `None` if they are cut off.
    pub fn read_science(from: &mut Reader<'_>) -> Option<Self> {
        let (outcome, direction) = (Outcome::read(from)?, Direction::read(from)?);
        let direction = (outcome.solved != 0).then_some(direction);
        Some(Self { outcome, direction, position: None, integrity: None, edges: [None; MAX_LISTED] })
    }

    /// Appends the whole answer: outcome, direction, position, integrity, and the listed candidates.
    pub fn write(&self, out: &mut Writer<'_>) {
        self.write_science(out);
        self.position.unwrap_or(Position::NONE).write(out);
        self.integrity.unwrap_or(Integrity::NONE).write(out);
        for e in self.edges.iter().flatten() {
            e.write(out);
        }
    }

    /// Reads a whole answer; `None` if it is cut off.
    pub fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut answer = Self::read_science(from)?;
        let (position, integrity) = (Position::read(from)?, Integrity::read(from)?);
        answer.position = position.values().any(|x| !x.is_nan()).then_some(position);
        answer.integrity = answer.direction.map(|_| integrity);
        for edge in answer.edges.iter_mut().take(usize::from(answer.outcome.listed)) {
            *edge = Some(Edge::read(from)?);
        }
        Some(answer)
    }
}

#[cfg(test)]
mod tests;
