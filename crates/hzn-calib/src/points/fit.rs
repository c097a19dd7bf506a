//! The fit of a lens to points with known directions.

use std::fmt;

use hzn_core::camera::{Config, Model};
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::table::{Point, Points};
use crate::adjust::{BOW, Block, Observation};
use crate::calibrated::{Calibrated, Dropped, Refusal};
use crate::finish::finish;
use crate::ideal;
use crate::other_model;
use crate::staged::{adjust_in_stages, remove_outliers};

/// Smallest number of points of a picture: two determine the rotation, the third shows whether it fits.
const MIN_POINTS: usize = 3;
/// Ratio of the RMS of the table to that of a changed table above which the change is believed. A mirrored table does
/// not fit at all, so that the ratio is far larger.
const MUCH_BETTER: f64 = 3.0;
/// Largest angle off axis for a lens of the plane, degrees.
const MAX_PLANAR_DEG: f64 = 85.0;

/// A change of the table that makes it fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    Mirrored,
    PixelsExchanged,
    AnglesExchanged,
}

/// The reason why a table of points gives no calibration.
#[derive(Debug, Clone, PartialEq)]
pub enum PointsRefusal {
    /// The calibration itself is refused.
    Lens(Refusal),
    /// There are fewer equations than unknowns.
    TooFew {
        /// Number of points.
        points: usize,
        /// Smallest number for the model and the number of pictures.
        min: usize,
    },
    /// The table fits far better after a change.
    Changed {
        /// The change in words.
        change: &'static str,
        /// RMS of the table, px; infinite if it does not fit at all.
        rms_px: f64,
        /// RMS after the change, px.
        changed_rms_px: f64,
    },
    /// Points lie farther off axis than the model reaches.
    BehindPlane {
        /// Largest angle off axis, degrees.
        off_axis_deg: f64,
        /// The model.
        model: Model,
    },
}

impl fmt::Display for PointsRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lens(refusal) => refusal.fmt(f),
            Self::TooFew { points, min } => {
                write!(f, "there are {points} points, but this model needs at least {min}; measure more points")
            }
            Self::Changed { change, rms_px, changed_rms_px } => write!(
                f,
                "the points fit with an RMS of {changed_rms_px:.3} px if {change}, but {} as they are; \
                 correct the table",
                if rms_px.is_finite() { format!("with {rms_px:.3} px") } else { "not at all".into() }
            ),
            Self::BehindPlane { off_axis_deg, model } => write!(
                f,
                "points lie up to {off_axis_deg:.0} deg off axis, but {} ends before 90 deg; choose --model \
                 kannala-brandt",
                model.name()
            ),
        }
    }
}

impl std::error::Error for PointsRefusal {}

/// Calibrates a camera from points with known directions. `size_px` is width and height of the pictures. Each element
/// of `pictures` has a rotation of its own.
///
/// # Errors
/// The points do not determine the lens, or they fit only after a change of the table: see [`PointsRefusal`].
pub fn calibrate(model: Model, size_px: [u16; 2], pictures: &[Points]) -> Result<Calibrated, PointsRefusal> {
    check(model, size_px, pictures)?;
    let found = fit(model, size_px, pictures);
    // One pixel is far above the error of any centroid.
    let rms_px = found.as_ref().map_or(f64::INFINITY, |c| c.rms_px);
    if rms_px > 1.0 {
        for change in [Change::Mirrored, Change::PixelsExchanged, Change::AnglesExchanged] {
            let changed: Vec<Points> = pictures.iter().map(|p| change.apply(p)).collect();
            let size = if change == Change::PixelsExchanged { [size_px[1], size_px[0]] } else { size_px };
            if let Ok(better) = fit(model, size, &changed)
                && better.rms_px * MUCH_BETTER < rms_px
            {
                let change = change.describe();
                return Err(PointsRefusal::Changed { change, rms_px, changed_rms_px: better.rms_px });
            }
        }
    }
    let mut calibrated = found.map_err(PointsRefusal::Lens)?;
    let calibrated_with = |other| {
        check(other, size_px, pictures).ok()?;
        fit(other, size_px, pictures).ok()
    };
    other_model::compare(model, &mut calibrated, calibrated_with).map_err(PointsRefusal::Lens)?;
    Ok(calibrated)
}

impl Change {
    fn describe(self) -> &'static str {
        match self {
            Self::Mirrored => "the azimuth counts to the other side",
            Self::PixelsExchanged => "u_px and v_px are exchanged",
            Self::AnglesExchanged => "azimuth and elevation are exchanged",
        }
    }

    fn apply(self, picture: &Points) -> Points {
        let point = |p: &Point| {
            let [x, y, z] = p.direction;
            match self {
                Self::Mirrored => Point { direction: [-x, y, z], ..*p },
                Self::PixelsExchanged => Point { at_px: [p.at_px[1], p.at_px[0]], ..*p },
                Self::AnglesExchanged => {
                    let (azimuth, elevation) = (x.atan2(z), (-y).clamp(-1.0, 1.0).asin());
                    let direction = super::table::from_angles(elevation.to_degrees(), azimuth.to_degrees());
                    Point { direction, ..*p }
                }
            }
        };
        Points { name: picture.name.clone(), points: picture.points.iter().map(point).collect() }
    }
}

fn check(model: Model, size_px: [u16; 2], pictures: &[Points]) -> Result<(), PointsRefusal> {
    let points = pictures.iter().map(|p| p.points.len()).sum::<usize>();
    let unknowns = model.intrinsics().len() + 3 * pictures.len();
    // Two equations a point, and some redundancy.
    let min = (unknowns + 4).div_ceil(2);
    if points < min {
        return Err(PointsRefusal::TooFew { points, min });
    }
    // An equidistant lens shows how far off axis the points are, whatever the lens is.
    if model.is_planar()
        && let Some((_, blocks)) = guess(Model::Equidistant, size_px, pictures)
    {
        let angle = |d: Vector3<f64>| d.xy().norm().atan2(d.z).to_degrees();
        let each = blocks.iter().flat_map(|b| b.observations.iter().map(|o| angle(b.direction(&o.place))));
        let off_axis_deg = each.fold(0.0, f64::max);
        if off_axis_deg > MAX_PLANAR_DEG {
            return Err(PointsRefusal::BehindPlane { off_axis_deg, model });
        }
    }
    Ok(())
}

fn fit(model: Model, size_px: [u16; 2], pictures: &[Points]) -> Result<Calibrated, Refusal> {
    let few = |p: &Points| (p.points.len() < MIN_POINTS).then_some(p.points.len());
    let usable: Vec<Points> = pictures.iter().filter(|p| few(p).is_none()).cloned().collect();
    let (config, blocks) = guess(model, size_px, &usable).ok_or(Refusal::NoLens)?;
    let rough = adjust_in_stages(&config, &blocks).ok_or(Refusal::NoLens)?;
    let mut next = 0..;
    let mut places: Vec<Result<usize, Dropped>> = pictures
        .iter()
        .map(|p| match few(p) {
            Some(found) => Err(Dropped::TooFew { found, min: MIN_POINTS }),
            None => next.next().ok_or(Dropped::NoPose),
        })
        .collect();
    let adjusted = remove_outliers(rough, &mut places, 1).ok_or(Refusal::NoLens)?;
    if adjusted.blocks.is_empty() {
        return Err(Refusal::NoLens);
    }
    let named: Vec<_> = pictures.iter().map(|p| p.name.clone()).zip(places).collect();
    finish(&adjusted, &named)
}

/// Guesses the lens and the rotation of each picture.
fn guess(model: Model, size_px: [u16; 2], pictures: &[Points]) -> Option<(Config, Vec<Block>)> {
    let blocks = |config: &Config| pictures.iter().map(|p| rotate(config, p)).collect();
    ideal::guess(model, size_px, blocks, |block| Some(block))
}

/// Returns the rotation that takes the directions to the rays of an ideal lens: the solution of Wahba's problem by the
/// singular value decomposition (Markley 1988).
fn rotate(config: &Config, picture: &Points) -> Block {
    let mut profile = Matrix3::zeros();
    for p in &picture.points {
        profile += Vector3::from(ideal::unproject(config, p.at_px)) * Vector3::from(p.direction).transpose();
    }
    let svd = profile.svd(true, true);
    let rotation = match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => {
            let sign = (u.determinant() * v_t.determinant()).signum();
            u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t
        }
        _ => Matrix3::identity(),
    };
    let observation =
        |p: &Point| Observation { place: Vector3::from(p.direction), at_px: p.at_px, weight: 1.0, by_bow: [0.0; BOW] };
    Block {
        rotation: Rotation3::from_matrix_unchecked(rotation),
        translation: None,
        observations: picture.points.iter().map(observation).collect(),
    }
}
