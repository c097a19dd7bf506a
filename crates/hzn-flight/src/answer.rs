//! A report as bytes for science telemetry, with every bit of its numbers.

use hzn_core::frames::{Cov3, UnitVec3};
use hzn_core::status::{Stage, Status};
use hzn_core::{Report, Solution};
use hzn_core::{
    report::{Candidate, Counters, MAX_LISTED},
    verdict::Verdict,
};

use crate::bytes::{Reader, Writer};

type Candidates = heapless::Vec<Candidate<f64>, MAX_LISTED>;

/// A candidate edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Number of border pixels.
    pub length_px: u32,
    /// Number of sub-pixel points.
    pub points: u32,
    /// Number of points that fit the limb.
    pub inliers: u32,
    /// RMS distance of the inliers from the limb in pixels; NaN without a fit.
    pub rms_px: f32,
    /// [`hzn_core::verdict::Verdict`] as a number.
    pub verdict: u8,
}

/// A direction; see [`hzn_core::Solution`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Unit vector to the body, in the camera frame.
    pub axis: [f32; 3],
    /// Covariance of `axis` (xx, xy, xz, yy, yz, zz), rad².
    pub cov: [f32; 6],
    /// The same direction in ECEF; NaN without a position.
    pub axis_ecef: [f32; 3],
    /// The same direction in the vehicle's frame; NaN without a mounting.
    pub axis_body: [f32; 3],
    /// Half-angle of the free fit, rad.
    pub half_angle_rad: f32,
    /// Half-angle of the answer, rad.
    pub fused_half_angle_rad: f32,
    /// Altitude from the free fit, m; NaN where the half-angle does not give one.
    pub altitude_m: f32,
    /// 1-sigma of the altitude, m.
    pub altitude_sigma_m: f32,
    /// RMS distance of the inliers, px.
    pub rms_px: f32,
    /// Length of the edge that the inliers cover, px.
    pub arc_px: f32,
    /// Number of edge points that carry the answer.
    pub inliers: u32,
    /// Number of the chosen candidate.
    pub candidate: u32,
}

/// The answer to one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureAnswer {
    /// [`hzn_core::status::Status`] as a number.
    pub status: u8,
    /// [`hzn_core::status::Stage`] as a number: the last stage that was entered.
    pub stage: u8,
    /// Number of looks at the picture, each at another threshold: 1 to 16.
    pub looks: u8,
    /// Threshold between dark and lit in counts.
    pub level: u16,
    /// Border pixels that were followed.
    pub followed: u32,
    /// Number of edges that were examined as candidates, listed or not.
    pub candidates: u32,
    /// Border pixels that were dropped.
    pub dropped: u32,
    /// Points at the threshold of the whole picture, because their local mid-level was not found.
    pub fallback_points: u32,
    /// Edge points of the chosen edge.
    pub edge_points: u32,
    /// Draws of the consensus.
    pub draws: u32,
    /// Work of the picture, in the unit of `limits.max_work`.
    pub work: u32,
    /// The direction; only with status `ok`.
    pub direction: Option<Direction>,
    /// The first candidates, including the chosen one.
    pub edges: [Option<Edge>; MAX_LISTED],
}

/// Most looks that the packet can show.
const MAX_LOOKS: u32 = 16;

impl PictureAnswer {
    /// Makes the answer from a report.
    pub fn from_report(report: &Report<f32>) -> Self {
        let c = &report.counters;
        let mut edges = [None; MAX_LISTED];
        for (edge, c) in edges.iter_mut().zip(&report.candidates) {
            *edge = Some(Edge {
                length_px: c.length_px,
                points: c.points,
                inliers: c.inliers,
                rms_px: c.rms_px,
                verdict: c.verdict as u8,
            });
        }
        let direction = report.solution.as_ref().map(|s| {
            let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = s.covariance.rows();
            let (altitude_m, altitude_sigma_m) = s.altitude_m.unwrap_or((f32::NAN, f32::NAN));
            Direction {
                axis: s.axis.xyz(),
                cov: [xx, xy, xz, yy, yz, zz],
                axis_ecef: s.axis_ecef.map_or([f32::NAN; 3], |a| a.xyz()),
                axis_body: s.axis_body.map_or([f32::NAN; 3], |a| a.xyz()),
                half_angle_rad: s.half_angle_rad,
                fused_half_angle_rad: s.fused_half_angle_rad,
                altitude_m,
                altitude_sigma_m,
                rms_px: s.rms_px,
                arc_px: s.arc_px,
                inliers: s.inliers,
                candidate: s.candidate,
            }
        });
        Self {
            status: report.status as u8,
            stage: report.stage as u8,
            looks: c.looks.clamp(1, MAX_LOOKS) as u8,
            level: report.level,
            followed: c.followed,
            candidates: c.candidates,
            dropped: c.dropped,
            fallback_points: c.fallback_points,
            edge_points: c.edge_points,
            draws: c.draws,
            work: c.work,
            direction,
            edges,
        }
    }

    /// Returns the report in double precision, as on a workstation; `None` if a number in it has no meaning.
    pub fn to_report(&self) -> Option<Report<f64>> {
        let mut candidates = Candidates::default();
        for (place, e) in (0..).zip(self.edges.iter().flatten()) {
            let verdict = *Verdict::ALL.get(usize::from(e.verdict))?;
            // Telemetry has no candidate numbers. Only the chosen candidate can be at a place other than its number.
            let chosen = self.direction.filter(|_| verdict == Verdict::Chosen).map(|d| d.candidate);
            let candidate = Candidate {
                number: chosen.unwrap_or(place),
                length_px: e.length_px,
                points: e.points,
                inliers: e.inliers,
                rms_px: f64::from(e.rms_px),
                verdict,
            };
            candidates.push(candidate).ok()?;
        }
        let widen = |v: [f32; 3]| v.map(f64::from);
        let solution = match &self.direction {
            None => None,
            Some(d) => Some(Solution {
                axis: UnitVec3::try_new(widen(d.axis))?,
                covariance: Cov3::from_upper(d.cov.map(f64::from)),
                axis_ecef: UnitVec3::try_new(widen(d.axis_ecef)),
                axis_body: UnitVec3::try_new(widen(d.axis_body)),
                half_angle_rad: d.half_angle_rad.into(),
                fused_half_angle_rad: d.fused_half_angle_rad.into(),
                altitude_m: (!d.altitude_m.is_nan()).then(|| (d.altitude_m.into(), d.altitude_sigma_m.into())),
                free: None,
                axis_by_cos: None,
                position: None,
                rms_px: d.rms_px.into(),
                inliers: d.inliers,
                arc_px: d.arc_px.into(),
                candidate: d.candidate,
            }),
        };
        Some(Report {
            status: *Status::ALL.get(usize::from(self.status))?,
            stage: *Stage::ALL.get(usize::from(self.stage))?,
            level: self.level,
            // Telemetry does not have it: the next picture was exposed long before.
            next_level: None,
            counters: Counters {
                followed: self.followed,
                candidates: self.candidates,
                dropped: self.dropped,
                fallback_points: self.fallback_points,
                edge_points: self.edge_points,
                draws: self.draws,
                work: self.work,
                // Pictures of the flight software do not come row by row.
                cut_points: 0,
                looks: self.looks.into(),
            },
            candidates,
            solution,
        })
    }

    /// Appends the answer to `out`.
    pub fn write(&self, out: &mut Writer<'_>) {
        out.u8(self.status);
        // This byte has two numbers: the stage in its lower four bits, the number of further looks in its upper four.
        out.u8(self.stage | self.looks.saturating_sub(1).min(15) << 4);
        out.u16(self.level);
        let counts = [self.followed, self.candidates, self.dropped, self.fallback_points, self.edge_points, self.draws];
        for n in counts.into_iter().chain([self.work]) {
            out.u32(n);
        }
        out.u8(u8::from(self.direction.is_some()));
        out.u8(self.edges.iter().flatten().count() as u8);
        if let Some(d) = &self.direction {
            let numbers =
                [d.half_angle_rad, d.fused_half_angle_rad, d.altitude_m, d.altitude_sigma_m, d.rms_px, d.arc_px];
            for &x in d.axis.iter().chain(&d.cov).chain(&d.axis_ecef).chain(&d.axis_body).chain(&numbers) {
                out.f32(x);
            }
            out.u32(d.inliers);
            out.u32(d.candidate);
        }
        for e in self.edges.iter().flatten() {
            out.u32(e.length_px);
            out.u32(e.points);
            out.u32(e.inliers);
            out.f32(e.rms_px);
            out.u8(e.verdict);
        }
    }

    /// Reads an answer; `None` if it is cut off.
    pub fn read(from: &mut Reader<'_>) -> Option<Self> {
        let (status, stage) = (from.u8()?, from.u8()?);
        let mut answer = Self {
            status,
            stage: stage & 15,
            looks: (stage >> 4) + 1,
            level: from.u16()?,
            followed: from.u32()?,
            candidates: from.u32()?,
            dropped: from.u32()?,
            fallback_points: from.u32()?,
            edge_points: from.u32()?,
            draws: from.u32()?,
            work: from.u32()?,
            direction: None,
            edges: [None; MAX_LISTED],
        };
        let (solved, listed) = (from.u8()?, from.u8()?);
        if solved != 0 {
            answer.direction = Some(Direction {
                axis: from.floats()?,
                cov: from.floats()?,
                axis_ecef: from.floats()?,
                axis_body: from.floats()?,
                half_angle_rad: from.f32()?,
                fused_half_angle_rad: from.f32()?,
                altitude_m: from.f32()?,
                altitude_sigma_m: from.f32()?,
                rms_px: from.f32()?,
                arc_px: from.f32()?,
                inliers: from.u32()?,
                candidate: from.u32()?,
            });
        }
        for edge in answer.edges.iter_mut().take(usize::from(listed)) {
            *edge = Some(Edge {
                length_px: from.u32()?,
                points: from.u32()?,
                inliers: from.u32()?,
                rms_px: from.f32()?,
                verdict: from.u8()?,
            });
        }
        Some(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_survives_with_every_bit() {
        let edge = Edge { length_px: 1900, points: 600, inliers: 590, rms_px: 0.3, verdict: 0 };
        let direction = Direction {
            axis: [0.1, 0.2, 0.97],
            cov: [1e-8, 2e-9, 3e-9, 4e-8, 5e-9, 6e-9],
            axis_ecef: [0.0, 0.6, 0.8],
            axis_body: [1.0, 0.0, 0.0],
            half_angle_rad: 1.2,
            fused_half_angle_rad: 1.21,
            altitude_m: 230e3,
            altitude_sigma_m: 900.0,
            rms_px: 0.3,
            arc_px: 1888.0,
            inliers: 590,
            candidate: 1,
        };
        let mut edges = [None; MAX_LISTED];
        (edges[0], edges[1]) = (Some(Edge { verdict: 5, ..edge }), Some(edge));
        let solved = PictureAnswer {
            status: 0,
            stage: 7,
            looks: 3,
            level: 88,
            followed: 2000,
            candidates: 2,
            dropped: 3,
            fallback_points: 4,
            edge_points: 600,
            draws: 20,
            work: 25_000,
            direction: Some(direction),
            edges,
        };
        for answer in [solved, PictureAnswer { status: 1, direction: None, edges: [None; MAX_LISTED], ..solved }] {
            let mut bytes = [0; 512];
            let mut out = Writer::new(&mut bytes);
            answer.write(&mut out);
            let n = out.finish().unwrap();
            assert_eq!(PictureAnswer::read(&mut Reader::new(&bytes[..n])), Some(answer));
            for cut in 0..n {
                assert_eq!(PictureAnswer::read(&mut Reader::new(&bytes[..cut])), None);
            }
        }
    }
}
