//! The result of a camera calibration.

use std::fmt;

use hzn_core::camera::{Config, Model};

/// A calibrated lens, with everything that a report shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The lens, with `covariance` for all of its parameters.
    pub camera: Config,
    /// RMS distance of the corners that count from their projections, px: the root mean square of the length of the
    /// residuals, as OpenCV reports it.
    pub rms_px: f64,
    /// 1-sigma of a measured coordinate, px, from the residuals and their degrees of freedom.
    pub sigma_px: f64,
    /// RMS distance in pictures that did not take part in the fit of the lens, px: only their pose is fitted. `None`
    /// if there are too few pictures.
    pub held_out_rms_px: Option<f64>,
    /// 1-sigma of the lens within the angles off axis that the observations cover, px: RMS over the picture, with a
    /// rotation of the camera left out.
    pub lens_sigma_px: f64,
    /// The same from the corners alone, as if the errors of all corners were independent, px.
    pub alone_sigma_px: f64,
    /// The same from the scatter between pictures, px: it also holds errors that the corners of a picture share. `None`
    /// with fewer than three pictures.
    pub between_sigma_px: Option<f64>,
    /// The bow of the board; `None` if the board counts as flat.
    pub bow: Option<Bow>,
    /// 1-sigma of the lens in the worst corner of the picture (or on the image circle), px.
    pub corner_sigma_px: f64,
    /// Largest angle off axis of an observation, degrees.
    pub covered_deg: f64,
    /// Angle off axis of the farthest pixel of the picture, degrees.
    pub corner_deg: f64,
    /// The pictures, in the order in which they were given.
    pub views: Vec<ViewResult>,
    /// Doubts about the result.
    pub warnings: Vec<Warning>,
}

/// The bow of a board, which was estimated together with the lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bow {
    /// Depth of the ends of a row and of a column behind their middle, mm. Above 0, it bulges towards the camera.
    pub depth_mm: [f64; 2],
    /// 1-sigma of both, mm.
    pub sigma_mm: [f64; 2],
}

/// A picture in a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewResult {
    /// Name of the picture.
    pub name: String,
    /// RMS distance of its observations that count, px; NaN without a pose.
    pub rms_px: f64,
    /// Angle between the board's normal and the line of sight to its middle, degrees; `None` without a board or a pose.
    pub tilt_deg: Option<f64>,
    /// Its observations, in the order in which they were given; empty without a pose.
    pub residuals: Vec<Residual>,
    /// The reason why the picture does not count.
    pub dropped: Option<Dropped>,
}

/// An observation in a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Measured image point (u, v), px.
    pub at_px: [f64; 2],
    /// Measured minus projected image point, px.
    pub error_px: [f64; 2],
    /// Whether the observation counts; an outlier does not.
    pub counts: bool,
    /// Column and row of the corner on a chessboard, from 0; `None` for other points.
    pub corner: Option<[u16; 2]>,
}

/// The reason why a picture does not count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dropped {
    /// It has too few observations.
    TooFew {
        /// Number of observations.
        found: usize,
        /// Smallest number that determines a pose with some redundancy.
        min: usize,
    },
    /// No pose of the board explains the corners.
    NoPose,
    /// The board is seen as a mirror image.
    Mirrored,
    /// Too many of its observations disagree with the lens that fits the other pictures.
    Outliers {
        /// Number of observations that disagree.
        outliers: usize,
        /// Number of all observations.
        of: usize,
    },
}

impl fmt::Display for Dropped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { found, min } => write!(f, "it has {found} points, but a pose needs {min}"),
            Self::NoPose => write!(f, "no pose explains its points"),
            Self::Mirrored => write!(f, "the board is seen as a mirror image; flip the picture or the numbering"),
            Self::Outliers { outliers, of } => {
                write!(f, "{outliers} of its {of} points disagree with the other pictures")
            }
        }
    }
}

/// A doubt about a calibration that is otherwise good.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Warning {
    /// The observations end far from the farthest corner of the picture: the lens is extrapolated there.
    Extrapolated {
        /// Largest angle off axis of an observation, degrees.
        covered_deg: f64,
        /// Angle off axis of the farthest pixel, degrees.
        corner_deg: f64,
        /// 1-sigma of the lens in that corner, px.
        corner_sigma_px: f64,
    },
    /// No board is tilted: focal length and distance are then hard to separate.
    Frontal {
        /// Largest tilt of a board, degrees.
        max_tilt_deg: f64,
    },
    /// The lens would not be monotone up to the picture's corner, so that the image circle was set.
    CircleSet {
        /// The image circle, `theta_max_deg`.
        theta_max_deg: f64,
    },
    /// The observations leave the lens uncertain by more than their own noise.
    Uncertain {
        /// 1-sigma of the lens where observations are, px.
        lens_sigma_px: f64,
        /// 1-sigma of an observation, px.
        sigma_px: f64,
    },
    /// The pictures disagree about the lens by more than the noise of their corners explains.
    Between {
        /// 1-sigma of the lens between pictures, px.
        between_px: f64,
        /// 1-sigma of the lens from the corners alone, px.
        alone_px: f64,
    },
    /// The two focal lengths differ, as those of a camera with square pixels do not: a print that is longer in one
    /// direction looks the same.
    Aspect {
        /// fy over fx.
        ratio: f64,
        /// 1-sigma of the ratio.
        sigma: f64,
    },
    /// Another lens model explains the same points better.
    OtherModel {
        /// The model of the calibration.
        model: Model,
        /// RMS distance of the points from their projections, px.
        rms_px: f64,
        /// The other model.
        other: Model,
        /// RMS distance with the other model, px.
        other_rms_px: f64,
    },
    /// Pictures that were left out predict worse than those that were fitted: the lens model does not fit the lens, or
    /// the board is not flat.
    Overfitted {
        /// RMS distance in pictures that were left out, px.
        held_out_rms_px: f64,
        /// RMS distance of the fit, px.
        rms_px: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Extrapolated { covered_deg, corner_deg, corner_sigma_px } => write!(
                f,
                "the points reach {covered_deg:.1} deg off axis, but the picture's corner lies at {corner_deg:.1} deg; \
                 the lens is extrapolated there (1 sigma {corner_sigma_px:.2} px, if the model holds): add points near \
                 the corners"
            ),
            Self::Frontal { max_tilt_deg } => write!(
                f,
                "no board is tilted by more than {max_tilt_deg:.1} deg, so that focal length and distance are hard to \
                 separate: add pictures with boards tilted by 30 to 45 deg"
            ),
            Self::CircleSet { theta_max_deg } => write!(
                f,
                "the lens is not monotone up to the picture's corner; theta_max_deg = {theta_max_deg:.2} limits it to \
                 the angles that the points cover"
            ),
            Self::Uncertain { lens_sigma_px, sigma_px } => write!(
                f,
                "the points determine the lens to {lens_sigma_px:.2} px, worse than a point is measured \
                 ({sigma_px:.2} px): add pictures, or choose a model with fewer coefficients"
            ),
            Self::Between { between_px, alone_px } => write!(
                f,
                "the pictures disagree about the lens: 1 sigma is {between_px:.3} px between pictures, but \
                 {alone_px:.3} px from the noise of the corners; the camera has the larger one. Usual causes: a board \
                 that is not flat, a lens that focuses or zooms, cut or stabilised pictures, another lens model"
            ),
            Self::Aspect { ratio, sigma } => write!(
                f,
                "fy is {ratio:.4} ± {sigma:.4} of fx, but the pixels of most cameras are square, with a ratio of 1. A \
                 board whose squares are longer in one direction looks the same, and printers make such boards: \
                 measure its rows and its columns with a ruler. If they differ, fx and fy are both wrong"
            ),
            Self::OtherModel { model, rms_px, other, other_rms_px } => write!(
                f,
                "{other} explains the same points with an RMS of {other_rms_px:.3} px, {model} with {rms_px:.3} px, \
                 which is no chance; the sigmas of the lens are at least the difference of the two. Calibrate with the \
                 model {other}",
                model = model.name(),
                other = other.name()
            ),
            Self::Overfitted { held_out_rms_px, rms_px } => write!(
                f,
                "pictures that were left out of the fit have an RMS of {held_out_rms_px:.3} px, those in it \
                 {rms_px:.3} px: add pictures, choose another model, or check that the board is flat"
            ),
        }
    }
}

/// The reason why there is no calibration.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// Too few pictures can be used.
    TooFewViews {
        /// Number of pictures that can be used.
        usable: usize,
        /// Smallest number.
        min: usize,
        /// Number of all pictures.
        of: usize,
    },
    /// A corner is not on the board.
    WrongCorner {
        /// The picture.
        view: String,
        /// Column and row of the corner.
        corner: [u16; 2],
        /// Columns and rows of the board.
        board: [u16; 2],
    },
    /// A value is not finite.
    NotFinite {
        /// The picture.
        view: String,
    },
    /// No lens explains the points.
    NoLens,
    /// All boards are seen as mirror images.
    Mirrored,
    /// The data do not determine the lens.
    NotDetermined {
        /// 1-sigma of the focal length, percent; infinite if it is not determined at all.
        focal_sigma_percent: f64,
    },
    /// Another lens model explains the same points far better.
    OtherModel {
        /// The model of the calibration.
        model: Model,
        /// RMS distance of the points from their projections, px.
        rms_px: f64,
        /// The other model.
        other: Model,
        /// RMS distance with the other model, px.
        other_rms_px: f64,
    },
    /// The lens is not monotone where points are.
    NotMonotone {
        /// Largest angle off axis of a point, degrees.
        covered_deg: f64,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewViews { usable, min, of } => write!(
                f,
                "{usable} of {of} pictures can be used, but a calibration needs at least {min}; 10 to 20 with the \
                 board tilted and near the corners are good"
            ),
            Self::WrongCorner { view, corner: [column, row], board: [columns, rows] } => write!(
                f,
                "{view}: the corner ({column}, {row}) is not on a board with {columns} x {rows} inner corners, which \
                 are counted from 0"
            ),
            Self::NotFinite { view } => write!(f, "{view}: a coordinate is not a finite number"),
            Self::NoLens => write!(
                f,
                "no lens of this model explains the points; check the size of the board, the numbering of the corners, \
                 and the model"
            ),
            Self::Mirrored => write!(
                f,
                "the boards are seen as mirror images; flip the pictures (`input.orient`), or the numbering of the \
                 corners"
            ),
            Self::NotDetermined { focal_sigma_percent } if focal_sigma_percent.is_finite() => write!(
                f,
                "the pictures determine the focal length to {focal_sigma_percent:.1} % only (1 sigma); tilt the board \
                 by 30 to 45 deg in different directions"
            ),
            Self::NotDetermined { .. } => write!(
                f,
                "the pictures do not determine the lens; tilt the board by 30 to 45 deg in different directions, or \
                 choose a model with fewer coefficients"
            ),
            Self::OtherModel { model, rms_px, other, other_rms_px } => write!(
                f,
                "this lens is not of the model {model}: it leaves an RMS of {rms_px:.3} px, and {other} leaves \
                 {other_rms_px:.3} px of the same points; calibrate with the model {other}",
                model = model.name(),
                other = other.name()
            ),
            Self::NotMonotone { covered_deg } => write!(
                f,
                "the fitted lens is not monotone up to {covered_deg:.1} deg, where points are; choose a model with \
                 fewer coefficients, or another one"
            ),
        }
    }
}

impl std::error::Error for Refusal {}
