//! The lenses of other tools, and the models of hzn for them.

use hzn_core::camera::Model;

use crate::nearest::suggestion;

/// A lens in the terms of other tools.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lens {
    /// No distortion.
    None,
    /// k1 to k4, coefficients of the angle off axis.
    Fisheye,
    /// k1, k2, p1, p2. Kalibr always writes them.
    Radtan,
    /// k1, k2, p1, p2, k3. OpenCV writes no coefficients for a lens without distortion.
    PlumbBob,
    /// Three more coefficients in the denominator. Hzn's lens does not have them; a fit replaces it.
    Rational,
}

/// The names of the lenses in the files.
const LENSES: &[(&str, Lens)] = &[
    ("equidistant", Lens::Fisheye),
    ("fisheye", Lens::Fisheye),
    ("kannala_brandt", Lens::Fisheye),
    ("radtan", Lens::Radtan),
    ("radial-tangential", Lens::Radtan),
    ("plumb_bob", Lens::PlumbBob),
    ("rational_polynomial", Lens::Rational),
    ("none", Lens::None),
];

impl Lens {
    /// Returns the lens with this name, in any case.
    ///
    /// # Errors
    /// Hzn does not have the lens.
    pub(super) fn find(name: &str) -> Result<Self, String> {
        let known = LENSES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
        let names: Vec<&str> = LENSES.iter().map(|(name, _)| *name).collect();
        known
            .map(|(_, lens)| *lens)
            .ok_or_else(|| format!("{name:?} is a lens that hzn does not have{}", suggestion(name, &names)))
    }

    /// Returns hzn's model for the lens. The number of coefficients must fit that model.
    ///
    /// # Errors
    /// Hzn does not have the lens, or the number of coefficients is wrong.
    pub(super) fn to_model(self, coefficients: &Coefficients) -> Result<Model, String> {
        let count = coefficients.values.as_ref().map(Vec::len);
        match (self, count, coefficients.significant_len()) {
            (Self::None, _, 0) => Ok(Model::Pinhole),
            (Self::None, _, n) => {
                Err(format!("there are {n} coefficients, but distortion_model does not name the lens"))
            }
            (Self::Fisheye, None, _) => Err("missing: a fisheye lens has four, k1 to k4".into()),
            (Self::PlumbBob, None | Some(0), _) => Ok(Model::Pinhole),
            (Self::PlumbBob, Some(n), 0) if n >= 4 => Ok(Model::Pinhole),
            (Self::Radtan, None, _) => Err("missing: this lens has k1, k2, p1, p2".into()),
            (Self::Fisheye, Some(n), significant) if n < 4 || significant > 4 => {
                Err(format!("there are {n} coefficients, but a fisheye lens has four, k1 to k4; is it another lens?"))
            }
            (Self::Fisheye, ..) => Ok(Model::KannalaBrandt),
            (Self::Radtan | Self::PlumbBob, Some(n), _) if n < 4 => Err(format!(
                "there are {n} coefficients, but this lens has five: k1, k2, p1, p2, k3; write 0 for the unused ones"
            )),
            (Self::Radtan | Self::PlumbBob | Self::Rational, Some(n), significant) if significant > 5 => Err(format!(
                "there are {n} coefficients, but hzn supports five of this lens, k1, k2, p1, p2, k3, and eight or \
                 twelve through a fit (hzn camera convert --model); calibrate without the others"
            )),
            (Self::Rational, None, _) => Err("missing: this lens has k1, k2, p1, p2, k3, k4, k5, k6".into()),
            (Self::Rational, Some(n), _) if n < 8 => {
                Err(format!("there are {n} coefficients, but rational_polynomial has eight; is it plumb_bob?"))
            }
            (Self::Radtan | Self::PlumbBob | Self::Rational, ..) => Ok(Model::BrownConrady),
        }
    }
}

impl Lens {
    /// Returns the coefficients of a lens of OpenCV with 8 or 12 of them, of which more than five are not 0. The two of
    /// a tilted sensor, which make 14, must be 0.
    pub(super) fn rational(self, coefficients: &Coefficients) -> Option<[f64; 12]> {
        let values = coefficients.values.as_deref().filter(|k| matches!(k.len(), 8 | 12 | 14))?;
        let used = (6..=12).contains(&coefficients.significant_len());
        let at = |i: usize| values.get(i).copied().unwrap_or(0.0);
        (used && matches!(self, Self::PlumbBob | Self::Rational)).then(|| core::array::from_fn(at))
    }
}

/// Coefficients of a lens, and the field that they come from.
pub(super) struct Coefficients {
    pub(super) values: Option<Vec<f64>>,
    pub(super) field: String,
}

impl Coefficients {
    /// Returns the number of coefficients up to the last one that is not 0.
    pub(super) fn significant_len(&self) -> usize {
        self.values.iter().flatten().enumerate().filter(|(_, k)| **k != 0.0).map(|(i, _)| i + 1).max().unwrap_or(0)
    }
}
