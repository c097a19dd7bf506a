//! Lenses of other tools that hzn does not have. A fit turns them into one of hzn's.

use hzn_core::camera::Model;

use super::omni::Omni;
use super::rational::Rational;
use super::scaramuzza::Scaramuzza;

/// A lens that hzn does not have.
#[derive(Debug, Clone, PartialEq)]
pub enum Foreign {
    /// Kalibr's `omni` with distortion.
    Omni(Omni),
    /// OpenCV's lens with 8 or 12 coefficients.
    Rational(Rational),
    /// OCamCalib's polynomial.
    Scaramuzza(Scaramuzza),
}

impl Foreign {
    /// Returns the lens in words.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Omni(_) => "omni with distortion",
            Self::Rational(_) => "OpenCV's lens with more than five coefficients",
            Self::Scaramuzza(_) => "OCamCalib's polynomial",
        }
    }

    /// Returns the model of hzn that is usually closest.
    pub fn closest(&self) -> Model {
        match self {
            Self::Omni(_) | Self::Scaramuzza(_) => Model::KannalaBrandt,
            Self::Rational(_) => Model::BrownConrady,
        }
    }

    /// Returns width and height of the picture in pixels.
    pub fn size_px(&self) -> [u16; 2] {
        match self {
            Self::Omni(lens) => lens.size_px,
            Self::Rational(lens) => lens.size_px,
            Self::Scaramuzza(lens) => lens.size_px,
        }
    }

    /// Returns the focal lengths at the centre along x and y, in pixels.
    pub fn focal_px(&self) -> [f64; 2] {
        match self {
            Self::Omni(lens) => [0, 1].map(|i| lens.intrinsics_px[i] / (1.0 + lens.xi)),
            Self::Rational(lens) => [0, 1].map(|i| lens.intrinsics_px[i]),
            Self::Scaramuzza(lens) => [lens.affine[1][1], lens.affine[0][0]].map(|part| part * lens.focal_px()),
        }
    }

    /// Returns the image point of the axis in pixels.
    pub fn centre_px(&self) -> [f64; 2] {
        match self {
            Self::Omni(lens) => [lens.intrinsics_px[2], lens.intrinsics_px[3]],
            Self::Rational(lens) => [lens.intrinsics_px[2], lens.intrinsics_px[3]],
            Self::Scaramuzza(lens) => lens.centre_px,
        }
    }

    /// Projects a direction (camera frame). `None` if nothing is projected from there.
    pub fn project(&self, direction: [f64; 3]) -> Option<[f64; 2]> {
        match self {
            Self::Omni(lens) => lens.project(direction),
            Self::Rational(lens) => lens.project(direction),
            Self::Scaramuzza(lens) => lens.project(direction),
        }
    }
}
