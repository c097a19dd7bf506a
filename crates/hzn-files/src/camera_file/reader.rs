//! What the readers of all formats share: problems with the file's name, coefficients, and the checks of a lens.

use std::path::Path;

use hzn_core::camera::{Config, Model};
use serde_json::Value;

use super::foreign::Foreign;
use super::lens::{Coefficients, Lens};
use super::loaded::Loaded;
use super::rational::Rational;
use super::values::matrix;
use crate::Problem;

/// The file that is read.
pub(super) struct Reader<'a> {
    pub(super) path: &'a Path,
    /// Width and height of the picture, if the user tells them.
    pub(super) size_px: Option<[u16; 2]>,
}

impl Reader<'_> {
    pub(super) fn problem(&self, field: &str, what: impl Into<String>) -> Problem {
        Problem::new(self.path, what).in_field(field)
    }

    /// Returns the coefficients, which must be a single row or column. The result is `None` if the file has none.
    pub(super) fn coefficients(&self, value: Option<&Value>, field: &str) -> Result<Option<Vec<f64>>, Problem> {
        let Some(value) = value.filter(|v| !v.is_null()) else { return Ok(None) };
        let Some(values) = matrix(value) else {
            return Err(self.problem(field, "a list of finite numbers is expected"));
        };
        let side = |key: &str| value.get(key).and_then(Value::as_u64);
        if let (Some(rows), Some(cols)) = (side("rows"), side("cols")) {
            if rows.saturating_mul(cols) != values.len() as u64 {
                let what = format!("has {} numbers, but rows and cols say {rows} x {cols}", values.len());
                return Err(self.problem(field, what));
            }
            if rows.min(cols) > 1 {
                return Err(
                    self.problem(field, format!("is a matrix of {rows} x {cols}; one row or column is expected"))
                );
            }
        }
        Ok(Some(values))
    }

    /// Returns the lens that `distortion_model` names; `None` if the word is missing or empty.
    pub(super) fn lens(&self, word: Option<&Value>, field: &str) -> Result<Option<Lens>, Problem> {
        let Some(word) = word.and_then(Value::as_str).map(str::trim).filter(|word| !word.is_empty()) else {
            return Ok(None);
        };
        Lens::find(word).map(Some).map_err(|what| self.problem(field, what))
    }

    /// Returns hzn's model for the lens. The number of coefficients must fit that model.
    pub(super) fn model(&self, lens: Lens, coefficients: &Coefficients) -> Result<Model, Problem> {
        lens.to_model(coefficients).map_err(|what| self.problem(&coefficients.field, what))
    }

    /// Builds the lens of a camera whose projection is that of a pinhole.
    pub(super) fn loaded(
        &self,
        lens: Lens,
        coefficients: &Coefficients,
        size: [f64; 2],
        intrinsics_px: [f64; 4],
    ) -> Result<Loaded, Problem> {
        if let Some(distortion) = lens.rational(coefficients) {
            return Ok(Loaded::Foreign(Foreign::Rational(Rational {
                size_px: self.size(size)?,
                intrinsics_px,
                distortion,
            })));
        }
        let model = self.model(lens, coefficients)?;
        let k = coefficients.values.as_deref().unwrap_or_default();
        Ok(Loaded::Lens(self.config(model, size, intrinsics_px, k)?))
    }

    /// Returns width and height as whole numbers.
    pub(super) fn size(&self, size: [f64; 2]) -> Result<[u16; 2], Problem> {
        let to_whole = |x: f64| (x.fract() == 0.0 && (2.0..=65535.0).contains(&x)).then_some(x as u16);
        let [Some(width), Some(height)] = size.map(to_whole) else {
            return Err(self.problem("resolution", "width and height must be whole numbers from 2 to 65535"));
        };
        Ok([width, height])
    }

    /// Builds the configuration; `size` is width and height.
    pub(super) fn config(
        &self,
        model: Model,
        size: [f64; 2],
        [fx, fy, cx, cy]: [f64; 4],
        coefficients: &[f64],
    ) -> Result<Config, Problem> {
        let [width, height] = self.size(size)?;
        let k = coefficients.iter().copied().take(model.coefficients().len()).collect();
        let ideal = Config::ideal(model, width, height, fx);
        Ok(Config { fx_px: fx, fy_px: fy, cx_px: cx, cy_px: cy, k, ..ideal })
    }
}
