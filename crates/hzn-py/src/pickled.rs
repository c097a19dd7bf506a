//! The parts of a report that pickle keeps.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use hzn_core::camera;
use hzn_mcap::{Annotations, CandidateEdge, Row};
use hzn_run::nadir::Nadir;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::report::Report;

/// Data of a report that `detail=True` adds.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(crate) struct Detail {
    pub(crate) stages_us: Vec<(Cow<'static, str>, f64)>,
    pub(crate) drawing: Annotations,
}

/// Contents of a report for pickle: everything except the picture and the other bodies.
#[derive(Serialize, Deserialize)]
pub(crate) struct Pickled {
    pub(crate) row: Row,
    pub(crate) candidates: Vec<CandidateEdge>,
    pub(crate) camera: Option<camera::Config>,
    pub(crate) half_angle_rad: Option<f64>,
    /// The limb of an answer with a position.
    pub(crate) drawing: Option<Annotations>,
    pub(crate) detail: Option<Detail>,
    pub(crate) stage: Cow<'static, str>,
    pub(crate) bits: Option<u8>,
    /// Direction to the centre, and its error.
    pub(crate) nadir: Option<([f64; 3], f64)>,
}

impl Pickled {
    /// Returns the contents of a report.
    pub(crate) fn new(report: &Report) -> Self {
        Self {
            row: report.row.clone(),
            candidates: report.candidates.clone(),
            camera: report.camera.as_ref().map(|c| c.config.clone()),
            half_angle_rad: report.half_angle_rad,
            drawing: report.placed.as_ref().map(|_| report.drawing().clone()),
            detail: report.detail.clone(),
            stage: report.stage.clone(),
            bits: report.bits,
            nadir: report.nadir.map(|nadir| (nadir.direction, nadir.error_deg)),
        }
    }

    /// Makes the report again, with those of the other bodies.
    pub(crate) fn into_report(self, others: Vec<Py<Report>>) -> PyResult<Report> {
        Ok(Report {
            candidates: self.candidates,
            camera: self.camera.map(Camera::from_config).transpose()?.map(Arc::new),
            half_angle_rad: self.half_angle_rad,
            drawing: self.drawing.map(OnceLock::from).unwrap_or_default(),
            detail: self.detail,
            stage: self.stage,
            others,
            bits: self.bits,
            nadir: self.nadir.map(|(direction, error_deg)| Nadir { direction, error_deg }),
            ..Report::from_row(self.row)
        })
    }
}
