//! How a lens changes with the temperature of its camera.
//!
//! Focal lengths and principal point change in proportion to the difference from the reference temperature. The
//! projection and its coefficients stay, because they count in focal lengths.

use super::intrinsic::INTRINSICS;
use crate::base::error::{ConfigError, between};
use crate::base::keys::{Form, Value};
use crate::base::parts::packed;
use crate::base::real::Real;

/// Largest change of the focal lengths, and of the principal point in focal lengths.
// Glass and aluminium change by some ten millionths per kelvin, so a larger change is an error of a unit. The lens is
// prepared up to this far beyond the corner of the picture.
pub(super) const MAX_CHANGE: f64 = 0.01;

/// `[camera.temperature]`: how the lens changes with the temperature of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Temperature {
    /// Temperature for which the other keys of `[camera]` hold, °C: that of the calibration.
    pub reference_c: f64,
    /// Relative change of both focal lengths, millionths per kelvin.
    #[cfg_attr(feature = "serde", serde(default))]
    pub focal_ppm_per_k: f64,
    /// Motion of the principal point along x, px per kelvin.
    #[cfg_attr(feature = "serde", serde(default))]
    pub cx_px_per_k: f64,
    /// Motion of the principal point along y, px per kelvin.
    #[cfg_attr(feature = "serde", serde(default))]
    pub cy_px_per_k: f64,
    /// 1σ of the temperature around the reference in a picture that comes without a temperature, K; 0 leaves the
    /// covariance of such a picture as it is.
    #[cfg_attr(feature = "serde", serde(default))]
    pub untold_sigma_k: f64,
}

impl Value for Temperature {
    const FORM: Form = Form::Table;
    const NUMBERS: u16 = 5;
    fn number(&self, place: u16) -> f64 {
        let mut copy = *self;
        copy.slot(place).map_or(f64::NAN, |slot| *slot)
    }
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        *self.slot(place)? = Some(number).filter(|x| x.is_finite())?;
        Some(())
    }
    fn empty() -> Option<Self> {
        Some(Self::default())
    }
}

impl Temperature {
    /// Returns the number at `place` in flight.
    fn slot(&mut self, place: u16) -> Option<&mut f64> {
        match place {
            0 => Some(&mut self.reference_c),
            1 => Some(&mut self.focal_ppm_per_k),
            2 => Some(&mut self.cx_px_per_k),
            3 => Some(&mut self.cy_px_per_k),
            4 => Some(&mut self.untold_sigma_k),
            _ => None,
        }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        between("camera.temperature.reference_c", self.reference_c, -273.15, 1000.0)?;
        between("camera.temperature.focal_ppm_per_k", self.focal_ppm_per_k, -1000.0, 1000.0)?;
        between("camera.temperature.cx_px_per_k", self.cx_px_per_k, -100.0, 100.0)?;
        between("camera.temperature.cy_px_per_k", self.cy_px_per_k, -100.0, 100.0)?;
        between("camera.temperature.untold_sigma_k", self.untold_sigma_k, 0.0, 1000.0)
    }

    /// Returns the factor of the focal lengths, and the motion of the principal point in pixels.
    pub(super) fn change(&self, temperature_c: f64) -> (f64, [f64; 2]) {
        let by_k = temperature_c - self.reference_c;
        (1.0 + self.focal_ppm_per_k * 1e-6 * by_k, [self.cx_px_per_k * by_k, self.cy_px_per_k * by_k])
    }
}

/// Returns the farthest corner that a lens is prepared for, in focal lengths: the corner at any temperature.
pub(super) fn farthest_corner(lens: Option<Temperature>, rho_corner: f64) -> f64 {
    match lens {
        None => rho_corner,
        // The principal point moves by `MAX_CHANGE` along x and along y.
        Some(_) => rho_corner / (1.0 - MAX_CHANGE) + 1.5 * MAX_CHANGE,
    }
}

/// Returns the change of a lens with these focal lengths in pixels by one sigma of an unknown temperature, in the
/// relative units of a mode; `None` if no sigma is stated.
pub(super) fn mode<T: Real>(lens: Option<Temperature>, [fx, fy]: [f64; 2]) -> Option<[T; INTRINSICS]> {
    let lens = lens.filter(|lens| lens.untold_sigma_k > 0.0)?;
    let (factor, [cx, cy]) = lens.change(lens.reference_c + lens.untold_sigma_k);
    let mut mode = [T::ZERO; INTRINSICS];
    let of_lens = [factor - 1.0, factor - 1.0, cx / fx, cy / fy];
    mode.iter_mut().zip(of_lens).for_each(|(slot, value)| *slot = T::from_f64(value));
    Some(mode)
}

packed!(Temperature { reference_c, focal_ppm_per_k, cx_px_per_k, cy_px_per_k, untold_sigma_k });
