//! The parts of a report that pickle keeps.

use std::borrow::Cow;

use hzn_core::camera;
use hzn_mcap::{Annotations, CandidateEdge, Row};
use serde::{Deserialize, Serialize};

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
