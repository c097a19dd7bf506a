//! `hzn.Report`.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_mcap::{Annotations, CandidateEdge, FrameRecord, Row};
use hzn_run::nadir::Nadir;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::camera::Camera;
use crate::cells::{candidate, symmetric, table, vector};
use crate::mask::Seen;
use crate::pickled::{Detail, Pickled};
use crate::read::Shown;
use crate::{drawing, errors, mask, notebook, parameters};

/// Return type of `__reduce__` for pickle: a function and its arguments.
type Reduced = (Py<PyAny>, (Py<PyBytes>, Vec<Py<Report>>));

#[doc = doc!("Report")]
#[pyclass(frozen, module = "hzn", weakref)]
pub(crate) struct Report {
    pub(crate) row: Row,
    pub(crate) candidates: Vec<CandidateEdge>,
    pub(crate) camera: Option<Arc<Camera>>,
    /// Half-angle of the limb that was fitted, in radians.
    pub(crate) half_angle_rad: Option<f64>,
    /// The answer, if it has a position: its limb is not that of a cone.
    pub(crate) placed: Option<Box<hzn_core::Solution<f64>>>,
    /// Edges and points, if they were requested or recorded.
    pub(crate) detail: Option<Detail>,
    /// Annotations, computed on first use, because tracing the limb takes longer than processing the picture.
    pub(crate) drawing: OnceLock<Annotations>,
    pub(crate) stage: Cow<'static, str>,
    pub(crate) others: Vec<Py<Self>>,
    /// The direction to the centre of the body.
    pub(crate) nadir: Option<Nadir>,
    pub(crate) shown: Option<Shown>,
    pub(crate) bits: Option<u8>,
    /// What a mask needs, of a picture that was processed here.
    pub(crate) seen: Option<Arc<Seen>>,
}

impl Report {
    /// Returns true if the body was found.
    pub(crate) fn is_answer(&self) -> bool {
        self.row.status == Status::Ok
    }

    /// Makes the report of the first body and attaches the reports of the others.
    pub(crate) fn from_bodies(py: Python<'_>, reports: impl IntoIterator<Item = Self>) -> PyResult<Self> {
        let mut reports = reports.into_iter();
        let first = reports.next().ok_or_else(|| errors::config("bodies: is empty"))?;
        Ok(Self { others: reports.map(|r| Py::new(py, r)).collect::<PyResult<_>>()?, ..first })
    }

    /// Remembers the picture, so that the report can be shown with it.
    pub(crate) fn with_picture(self, shown: Option<Shown>, bits: Option<u8>) -> Self {
        Self { shown, bits, ..self }
    }

    fn picture<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.shown.as_ref().map_or(Ok(None), |shown| shown.picture(py))
    }

    /// Returns the status, of several bodies with their names.
    pub(crate) fn title(&self) -> String {
        if self.others.is_empty() {
            return self.row.status.name().to_owned();
        }
        let each: Vec<String> = self.each().map(|r| format!("{} {}", r.row.body, r.row.status.name())).collect();
        each.join(", ")
    }

    /// Returns this report and those of the other bodies.
    pub(crate) fn each(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.others.iter().map(Py::get))
    }

    /// Returns the record for a recording.
    pub(crate) fn record(&self) -> FrameRecord {
        FrameRecord {
            candidates: self.candidates.clone(),
            annotations: self.drawing().clone(),
            ..FrameRecord::new(self.row.clone())
        }
    }

    fn require_detail(&self, what: &str) -> PyResult<&Detail> {
        self.detail
            .as_ref()
            .ok_or_else(|| errors::other(format!("{what} are kept only by process(image, detail=True)")))
    }
}

#[pymethods]
impl Report {
    #[doc = doc!("Report.index")]
    #[getter]
    fn index(&self) -> u64 {
        self.row.index
    }
    #[doc = doc!("Report.file")]
    #[getter]
    fn file(&self) -> &str {
        &self.row.file
    }
    #[doc = doc!("Report.time_s")]
    #[getter]
    fn time_s(&self) -> Option<f64> {
        self.row.time_s
    }
    #[doc = doc!("Report.body")]
    #[getter]
    fn body(&self) -> &str {
        &self.row.body
    }
    #[doc = doc!("Report.status")]
    #[getter]
    fn status(&self) -> &'static str {
        self.row.status.name()
    }
    #[doc = doc!("Report.ok")]
    #[getter]
    fn ok(&self) -> bool {
        self.row.axis().is_some()
    }
    #[doc = doc!("Report.stage")]
    #[getter]
    fn stage(&self) -> &str {
        &self.stage
    }
    #[doc = doc!("Report.tracked")]
    #[getter]
    fn tracked(&self) -> bool {
        self.row.tracked == Some(true)
    }
    #[doc = doc!("Report.detail")]
    #[getter]
    fn detail(&self) -> &str {
        &self.row.detail
    }
    #[doc = doc!("Report.axis")]
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_x, self.row.axis_y, self.row.axis_z])
    }
    #[doc = doc!("Report.axis_fixed")]
    #[getter]
    fn axis_fixed<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_e_x, self.row.axis_e_y, self.row.axis_e_z])
    }
    #[doc = doc!("Report.axis_vehicle")]
    #[getter]
    fn axis_vehicle<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_v_x, self.row.axis_v_y, self.row.axis_v_z])
    }
    #[doc = doc!("Report.nadir")]
    #[getter]
    fn nadir<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.nadir.map(|nadir| PyArray1::from_slice(py, &nadir.direction))
    }
    #[doc = doc!("Report.nadir_error_deg")]
    #[getter]
    fn nadir_error_deg(&self) -> Option<f64> {
        self.nadir.map(|nadir| nadir.error_deg)
    }
    #[doc = doc!("Report.covariance")]
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        symmetric(py, self.row.covariance()?.map(Some))
    }
    #[doc = doc!("Report.sigma_max_deg")]
    #[getter]
    fn sigma_max_deg(&self) -> Option<f64> {
        self.row.sigma_max_deg
    }
    #[doc = doc!("Report.half_angle_deg")]
    #[getter]
    fn half_angle_deg(&self) -> Option<f64> {
        self.row.half_angle_deg
    }
    #[doc = doc!("Report.axis_free")]
    #[getter]
    fn axis_free<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_free_x, self.row.axis_free_y, self.row.axis_free_z])
    }
    #[doc = doc!("Report.covariance_free")]
    #[getter]
    fn covariance_free<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let r = &self.row;
        symmetric(py, [r.cov_free_xx, r.cov_free_xy, r.cov_free_xz, r.cov_free_yy, r.cov_free_yz, r.cov_free_zz])
    }
    #[doc = doc!("Report.covariance_common")]
    #[getter]
    fn covariance_common<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        symmetric(py, self.row.common_covariance()?.map(Some))
    }
    #[doc = doc!("Report.axis_by_cos")]
    #[getter]
    fn axis_by_cos<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.axis_by_cos_x, self.row.axis_by_cos_y, self.row.axis_by_cos_z])
    }
    #[doc = doc!("Report.position_km")]
    #[getter]
    fn position_km<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.position_x_km, self.row.position_y_km, self.row.position_z_km])
    }
    #[doc = doc!("Report.position_covariance_km2")]
    #[getter]
    fn position_covariance_km2<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        symmetric(py, self.row.position_covariance_km2()?.map(Some))
    }
    #[doc = doc!("Report.body_fixed_km")]
    #[getter]
    fn body_fixed_km<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        vector(py, [self.row.body_fixed_x_km, self.row.body_fixed_y_km, self.row.body_fixed_z_km])
    }
    #[doc = doc!("Report.yaw_deg")]
    #[getter]
    fn yaw_deg(&self) -> Option<f64> {
        self.row.yaw_deg
    }
    #[doc = doc!("Report.yaw_sigma_deg")]
    #[getter]
    fn yaw_sigma_deg(&self) -> Option<f64> {
        self.row.yaw_sigma_deg
    }
    #[doc = doc!("Report.altitude_km")]
    #[getter]
    fn altitude_km(&self) -> Option<f64> {
        self.row.altitude_km
    }
    #[doc = doc!("Report.altitude_est_km")]
    #[getter]
    fn altitude_est_km(&self) -> Option<f64> {
        self.row.altitude_est_km
    }
    #[doc = doc!("Report.altitude_est_sigma_km")]
    #[getter]
    fn altitude_est_sigma_km(&self) -> Option<f64> {
        self.row.altitude_est_sigma_km
    }
    #[doc = doc!("Report.rms_px")]
    #[getter]
    fn rms_px(&self) -> Option<f64> {
        self.row.rms_px
    }
    #[doc = doc!("Report.picture_direction")]
    #[getter]
    fn picture_direction<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.row.picture_direction().map(|(direction, _)| PyArray1::from_slice(py, &direction))
    }
    #[doc = doc!("Report.picture_sigma")]
    #[getter]
    fn picture_sigma(&self) -> Option<f64> {
        self.row.picture_sigma
    }
    #[doc = doc!("Report.p_limb")]
    #[getter]
    fn p_limb(&self) -> Option<f64> {
        self.row.p_limb
    }
    #[doc = doc!("Report.protection_deg")]
    #[getter]
    fn protection_deg(&self) -> Option<f64> {
        self.row.protection_deg
    }
    #[doc = doc!("Report.roll_deg")]
    #[getter]
    fn roll_deg(&self) -> Option<f64> {
        self.row.roll_deg
    }
    #[doc = doc!("Report.pitch_deg")]
    #[getter]
    fn pitch_deg(&self) -> Option<f64> {
        self.row.pitch_deg
    }
    #[doc = doc!("Report.edge_points")]
    #[getter]
    fn edge_points(&self) -> Option<u32> {
        self.row.edge_points
    }
    #[doc = doc!("Report.dropped")]
    #[getter]
    fn dropped(&self) -> Option<u32> {
        self.row.dropped
    }
    #[doc = doc!("Report.level")]
    #[getter]
    fn level(&self) -> Option<u16> {
        self.row.level
    }
    #[doc = doc!("Report.elapsed_us")]
    #[getter]
    fn elapsed_us(&self) -> Option<f64> {
        self.row.elapsed_us
    }
    #[doc = doc!("Report.others")]
    #[getter]
    fn others(&self, py: Python<'_>) -> Vec<Py<Self>> {
        self.others.iter().map(|r| r.clone_ref(py)).collect()
    }
    #[doc = doc!("Report.candidates")]
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.candidates.iter().map(|edge| candidate(py, edge)).collect()
    }
    #[doc = doc!("Report.limb")]
    #[getter]
    fn limb<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray2<f64>>> {
        self.drawing().limb.iter().map(|l| table(py, l)).collect()
    }
    #[doc = doc!("Report.edges")]
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
        Ok(self.require_detail("edges")?.drawing.edges.iter().map(|e| table(py, e)).collect())
    }
    #[doc = doc!("Report.inliers")]
    #[getter]
    fn inliers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(table(py, &self.require_detail("inliers")?.drawing.inliers))
    }
    #[doc = doc!("Report.rejected")]
    #[getter]
    fn rejected<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(table(py, &self.require_detail("rejected points")?.drawing.rejected))
    }
    #[doc = doc!("Report.rays")]
    #[getter]
    fn rays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inliers = &self.require_detail("rays")?.drawing.inliers;
        let missing = || errors::other("rays: the recording does not contain its camera");
        let lens = &self.camera.as_ref().ok_or_else(missing)?.lens;
        let ray = |p: &[f64; 2]| lens.unproject(ImagePoint { u: p[0], v: p[1] }).map_or([f64::NAN; 3], |ray| ray.xyz());
        Ok(table(py, &inliers.iter().map(ray).collect::<Vec<_>>()))
    }
    #[doc = doc!("Report.stages_us")]
    #[getter]
    fn stages_us<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, us) in &self.require_detail("times of the stages")?.stages_us {
            dict.set_item(name, us)?;
        }
        Ok(dict)
    }

    #[doc = doc!("Report.plot")]
    #[pyo3(signature = (image = None, *, ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        image: Option<&Bound<'py, PyAny>>,
        ax: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let picture = image.map_or_else(|| this.picture(py), |image| Ok(Some(image.clone())))?;
        let rgb = picture.map(|p| drawing::draw_bare(py, &p, this.bits, this.camera.as_deref())).transpose()?;
        let size = this.camera.as_ref().map(|camera| (camera.config.width, camera.config.height));
        py.import("hzn._plot")?.getattr("plot")?.call1((slf, rgb, size, ax))
    }

    #[doc = doc!("Report.mask")]
    #[pyo3(signature = (margin_deg = 0.0))]
    fn mask<'py>(&self, py: Python<'py>, margin_deg: f64) -> PyResult<Option<Bound<'py, PyArray2<u8>>>> {
        mask::check_margin(margin_deg)?;
        let seen = || self.seen.as_ref().ok_or_else(mask::lost);
        self.is_answer().then(|| seen()?.draw(py, margin_deg)).transpose()
    }

    #[doc = doc!("Report.to_dict")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parameters::to_python(py, &self.row)
    }

    /// Pickles the report without its picture.
    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<Reduced> {
        let (py, this) = (slf.py(), slf.get());
        let pickled = Pickled {
            row: this.row.clone(),
            candidates: this.candidates.clone(),
            camera: this.camera.as_ref().map(|c| c.config.clone()),
            half_angle_rad: this.half_angle_rad,
            drawing: this.placed.as_ref().map(|_| this.drawing().clone()),
            detail: this.detail.clone(),
            stage: this.stage.clone(),
            bits: this.bits,
            nadir: this.nadir.map(|nadir| (nadir.direction, nadir.error_deg)),
        };
        let bytes = serde_json::to_vec(&pickled).map_err(errors::other)?;
        Ok((slf.get_type().getattr("_of")?.unbind(), (PyBytes::new(py, &bytes).unbind(), this.others(py))))
    }
    #[staticmethod]
    fn _of(pickled: &[u8], others: Vec<Py<Self>>) -> PyResult<Self> {
        let pickled: Pickled = serde_json::from_slice(pickled).map_err(errors::other)?;
        Ok(Self {
            candidates: pickled.candidates,
            camera: pickled.camera.map(Camera::from_config).transpose()?.map(Arc::new),
            half_angle_rad: pickled.half_angle_rad,
            drawing: pickled.drawing.map(OnceLock::from).unwrap_or_default(),
            detail: pickled.detail,
            stage: pickled.stage,
            others,
            bits: pickled.bits,
            nadir: pickled.nadir.map(|(direction, error_deg)| Nadir { direction, error_deg }),
            ..Self::from_row(pickled.row)
        })
    }
    fn __bool__(&self) -> bool {
        self.ok()
    }
    /// Returns the report itself, because it never changes.
    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }
    #[pyo3(signature = (_memo, /))]
    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }
    fn __repr__(&self) -> String {
        notebook::to_text(&self.title(), &self.row)
    }
    /// Shows the numbers in a notebook, next to the picture with all annotations.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        // A file that is gone leaves the numbers, which are worth showing.
        let image = self.picture(py).unwrap_or_default();
        let jpeg = image.map(|image| {
            let rgb = drawing::draw(py, &image, &self.drawing_of_all(), self.bits, self.camera.as_deref())?;
            errors::detached(py, || notebook::to_jpeg(&rgb))?
        });
        Ok(notebook::to_html(jpeg.transpose()?, self.each().map(|report| &report.row)))
    }
}
