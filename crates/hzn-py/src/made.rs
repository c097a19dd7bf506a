//! How a report is made: from a processed picture, a row, or a record of a recording.

use std::sync::{Arc, OnceLock};

use hzn_files::FrameData;
use hzn_mcap::{CandidateEdge, FrameRecord, Row};
use hzn_run::engine::Trace;
use hzn_run::nadir::Nadir;

use crate::camera::Camera;
use crate::mask::Seen;
use crate::pickled::Detail;
use crate::report::Report;

impl Report {
    /// Makes the report of a picture that was processed.
    pub(crate) fn new(row: Row, report: &hzn_core::Report<f64>, trace: Option<&Trace>, camera: &Arc<Camera>) -> Self {
        let detail = trace.map(|trace| Detail {
            stages_us: trace.times().into_iter().map(|(s, t)| (s.name().into(), t.as_nanos() as f64 / 1e3)).collect(),
            drawing: hzn_run::engine::annotate(trace, report.solution.as_ref(), &camera.lens),
        });
        Self {
            candidates: CandidateEdge::from_report(report),
            camera: Some(Arc::clone(camera)),
            half_angle_rad: report.solution.as_ref().map(|s| s.fused_half_angle_rad),
            placed: report.solution.filter(|s| s.position.is_some()).map(Box::new),
            detail,
            stage: report.stage.name().into(),
            ..Self::from_row(row)
        }
    }

    /// Corrects the direction to the centre with what was given with the picture.
    pub(crate) fn with_nadir(self, known: Option<&FrameData>) -> Self {
        Self { nadir: Nadir::from_answer(&self.row, known), ..self }
    }

    /// Keeps what its mask needs.
    pub(crate) fn with_seen(self, seen: Seen) -> Self {
        Self { seen: Some(Arc::new(seen)), ..self }
    }

    /// Makes a report from a row alone, for example of a picture that could not be read.
    pub(crate) fn from_row(row: Row) -> Self {
        Self {
            candidates: Vec::new(),
            camera: None,
            half_angle_rad: None,
            placed: None,
            detail: None,
            drawing: OnceLock::new(),
            stage: "".into(),
            others: Vec::new(),
            nadir: Nadir::from_answer(&row, None),
            row,
            shown: None,
            bits: None,
            seen: None,
        }
    }

    /// Makes the report of a record in a recording.
    pub(crate) fn from_record(record: FrameRecord, camera: Option<Arc<Camera>>) -> Self {
        let drawing = record.annotations;
        Self {
            candidates: record.candidates,
            camera,
            detail: (!drawing.is_empty()).then(|| Detail { drawing, ..Detail::default() }),
            ..Self::from_row(record.row)
        }
    }
}
