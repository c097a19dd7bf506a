//! `hzn.Report`.

use std::time::Duration;

use hzn_calib::FrameData;
use hzn_cli::engine::Trace;
use hzn_core::{body, camera};
use hzn_mcap::{Annotations, CandidateEdge, Row, RowMeta};
use numpy::ndarray::{Array2, arr1, arr2};
use numpy::{PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// What was found in one picture.
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Report {
    row: Row,
    candidates: Vec<CandidateEdge>,
    pub(crate) drawing: Annotations,
    detail: bool,
    stage: &'static str,
    stages_us: Vec<(&'static str, f64)>,
}

impl Report {
    pub(crate) fn new(
        report: &hzn_core::Report<f64>,
        trace: Option<Trace>,
        lens: &camera::Camera<f64>,
        body: &body::Config,
        data: &FrameData,
        elapsed: Duration,
    ) -> Self {
        let at = |p| hzn_calib::frames::altitude_at_km(p, body.kind, body.mean_radius_km());
        let altitude = data.position_km.and_then(at);
        let meta = RowMeta {
            time_s: data.time_s.unwrap_or(0.0),
            body: hzn_mcap::body_name(body.kind).to_owned(),
            altitude_km: altitude.or(data.altitude_km).or(body.altitude_km),
            ..RowMeta::default()
        };
        let detail = trace.is_some();
        let trace = trace.unwrap_or_default();
        let us = |d: Duration| d.as_nanos() as f64 / 1e3;
        Self {
            row: Row::from_report(&meta, report, Some(us(elapsed))),
            candidates: CandidateEdge::from_report(report),
            drawing: hzn_cli::output::annotations(&trace, report.solution.as_ref(), lens),
            detail,
            stage: report.stage.name(),
            stages_us: trace.times().into_iter().map(|(stage, t)| (stage.name(), us(t))).collect(),
        }
    }

    /// The first line of an overlay's legend.
    pub(crate) fn title(&self) -> &'static str {
        self.row.status.name()
    }

    fn need_detail(&self, what: &str) -> PyResult<()> {
        if self.detail {
            return Ok(());
        }
        Err(errors::HznError::new_err(format!("{what} are kept by process(image, detail=True) only")))
    }
}

fn vector<'py>(py: Python<'py>, xyz: [Option<f64>; 3]) -> Option<Bound<'py, PyArray1<f64>>> {
    let [Some(x), Some(y), Some(z)] = xyz else { return None };
    Some(arr1(&[x, y, z]).to_pyarray(py))
}

fn points<'py>(py: Python<'py>, points: &[[f64; 2]]) -> Bound<'py, PyArray2<f64>> {
    Array2::from_shape_fn((points.len(), 2), |(i, j)| points[i][j]).to_pyarray(py)
}

#[pymethods]
impl Report {
    #[getter]
    fn status(&self) -> &'static str {
        self.row.status.name()
    }
    #[getter]
    fn ok(&self) -> bool {
        self.row.axis().is_some()
    }
    #[getter]
    fn stage(&self) -> &'static str {
        self.stage
    }
    #[getter]
    fn detail(&self) -> &str {
        &self.row.detail
    }
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_x, self.row.axis_y, self.row.axis_z])
    }
    #[getter]
    fn axis_ecef<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_e_x, self.row.axis_e_y, self.row.axis_e_z])
    }
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let r = &self.row;
        let (xx, xy, xz) = (r.cov_xx?, r.cov_xy?, r.cov_xz?);
        let (yy, yz, zz) = (r.cov_yy?, r.cov_yz?, r.cov_zz?);
        Some(arr2(&[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).to_pyarray(py))
    }
    #[getter]
    fn sigma_max_deg(&self) -> Option<f64> {
        self.row.sigma_max_deg
    }
    #[getter]
    fn half_angle_deg(&self) -> Option<f64> {
        self.row.half_angle_deg
    }
    #[getter]
    fn altitude_km(&self) -> Option<f64> {
        self.row.altitude_km
    }
    #[getter]
    fn altitude_est_km(&self) -> Option<f64> {
        self.row.altitude_est_km
    }
    #[getter]
    fn altitude_est_sigma_km(&self) -> Option<f64> {
        self.row.altitude_est_sigma_km
    }
    #[getter]
    fn rms_px(&self) -> Option<f64> {
        self.row.rms_px
    }
    #[getter]
    fn edge_points(&self) -> Option<u32> {
        self.row.edge_points
    }
    #[getter]
    fn dropped(&self) -> Option<u32> {
        self.row.dropped
    }
    #[getter]
    fn level(&self) -> Option<u16> {
        self.row.level
    }
    #[getter]
    fn elapsed_us(&self) -> Option<f64> {
        self.row.elapsed_us
    }
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let edge = |c: &CandidateEdge| {
            let dict = PyDict::new(py);
            dict.set_item("length_px", c.length_px)?;
            dict.set_item("points", c.points)?;
            dict.set_item("inliers", c.inliers)?;
            dict.set_item("rms_px", c.rms_px)?;
            dict.set_item("verdict", &c.verdict)?;
            Ok(dict)
        };
        self.candidates.iter().map(edge).collect()
    }
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
        self.need_detail("edges")?;
        Ok(self.drawing.edges.iter().map(|e| points(py, e)).collect())
    }
    #[getter]
    fn inliers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.need_detail("inliers")?;
        Ok(points(py, &self.drawing.inliers))
    }
    #[getter]
    fn rejected<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.need_detail("rejected points")?;
        Ok(points(py, &self.drawing.rejected))
    }
    #[getter]
    fn limb<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray2<f64>>> {
        self.drawing.limb.iter().map(|l| points(py, l)).collect()
    }
    #[getter]
    fn stages_us<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.need_detail("times of the stages")?;
        let dict = PyDict::new(py);
        for (name, us) in &self.stages_us {
            dict.set_item(name, us)?;
        }
        Ok(dict)
    }

    /// The row of a table of results.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.row).map_err(errors::config)?;
        let dict = py.import("json")?.call_method1("loads", (text,))?;
        for key in ["index", "file"] {
            dict.call_method1("pop", (key,))?;
        }
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let r = &self.row;
        match (r.axis(), r.sigma_max_deg, r.inliers) {
            (Some([x, y, z]), Some(sigma), Some(inliers)) => format!(
                "Report(ok, axis [{x:.6}, {y:.6}, {z:.6}], sigma {sigma:.4} deg, {inliers} inliers, rms {:.2} px)",
                r.rms_px.unwrap_or(f64::NAN)
            ),
            _ => format!("Report({}, {})", r.status.name(), r.detail),
        }
    }
}
