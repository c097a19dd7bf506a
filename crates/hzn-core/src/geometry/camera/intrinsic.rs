//! The intrinsic parameters of a lens, and their covariance.

use crate::base::keys::{Form, Value};

/// Maximum number of intrinsic parameters: two focal lengths, two coordinates of the principal point, five
/// coefficients.
pub const INTRINSICS: usize = 9;

/// An intrinsic parameter, with its name in sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[allow(missing_docs, reason = "the names are those of the keys")]
pub enum Intrinsic {
    FxPx,
    FyPx,
    CxPx,
    CyPx,
    K1,
    K2,
    K3,
    K4,
    P1,
    P2,
    Xi,
    Alpha,
    Beta,
}

/// `[camera.covariance]`: covariance of the intrinsic parameters, as a calibration program reports it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Covariance {
    /// The parameters of the rows and columns: `fx_px`, `fy_px`, `cx_px`, `cy_px`, and the coefficients by their names,
    /// `k1` to `k4` of `kannala-brandt`, `k1, k2, p1, p2, k3` of `brown-conrady`. Parameters that are left out count as
    /// exact.
    // The names are part of the key, because programs list the parameters in different orders.
    pub order: heapless::Vec<Intrinsic, INTRINSICS>,
    /// The matrix row by row, symmetric and positive semidefinite; in px² and the units of the coefficients.
    pub rows: heapless::Vec<heapless::Vec<f64, INTRINSICS>, INTRINSICS>,
}

impl Value for Covariance {
    const FORM: Form = Form::Table;
}

impl Intrinsic {
    /// All parameters.
    pub(super) const ALL: [Self; 13] = [
        Self::FxPx,
        Self::FyPx,
        Self::CxPx,
        Self::CyPx,
        Self::K1,
        Self::K2,
        Self::K3,
        Self::K4,
        Self::P1,
        Self::P2,
        Self::Xi,
        Self::Alpha,
        Self::Beta,
    ];

    /// Returns the parameter's name in sensor.toml.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FxPx => "fx_px",
            Self::FyPx => "fy_px",
            Self::CxPx => "cx_px",
            Self::CyPx => "cy_px",
            Self::K1 => "k1",
            Self::K2 => "k2",
            Self::K3 => "k3",
            Self::K4 => "k4",
            Self::P1 => "p1",
            Self::P2 => "p2",
            Self::Xi => "xi",
            Self::Alpha => "alpha",
            Self::Beta => "beta",
        }
    }
}
