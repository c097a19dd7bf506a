//! The calibration from pictures of a board.

use hzn_core::camera::Model;

use super::fit::{Fitted, MIN_VIEWS, fit, residuals_px};
use super::layout::{Board, PlanarView, View};
use crate::adjust::{Block, Free, adjust, adjust_pose};
use crate::calibrated::{Calibrated, Refusal};
use crate::finish::{add_held_out, finish};
use crate::other_model;

/// Number of parts into which the pictures are divided for the held-out error.
const FOLDS: usize = 5;

/// Calibrates a camera from the corners of a board in several pictures, without a first guess.
///
/// All pictures have `size_px` (width, height). The corners of a picture may be a part of those of the board. The
/// residuals are minimised in the picture, with a robust loss at first; then observations that are no longer plausible
/// are removed and all others count alike. If the corners show a bow of the target, it is estimated as well. The
/// covariance is that of least squares, or that between the pictures where this is larger.
///
/// # Errors
/// The pictures do not determine the lens: see [`Refusal`].
///
/// # Example
///
/// ```
/// use hzn_calib::board::{Board, Corner, View, calibrate};
/// use hzn_core::camera::Model;
///
/// let board = Board { columns: 9, rows: 6, square_mm: 30.0 };
/// let view = View { name: "only one".into(), corners: vec![Corner { column: 0, row: 0, at_px: [10.0, 20.0] }] };
/// let refused = calibrate(Model::KannalaBrandt, [1280, 960], &board, &[view]).unwrap_err();
/// assert!(refused.to_string().starts_with("0 of 1 pictures can be used, but a calibration needs at least 3"));
/// ```
pub fn calibrate(model: Model, size_px: [u16; 2], board: &Board, views: &[View]) -> Result<Calibrated, Refusal> {
    for view in views {
        if let Some(c) = view.corners.iter().find(|c| c.column >= board.columns || c.row >= board.rows) {
            return Err(Refusal::WrongCorner {
                view: view.name.clone(),
                corner: [c.column, c.row],
                board: [board.columns, board.rows],
            });
        }
    }
    let planar: Vec<_> = views.iter().map(|view| view.to_planar(board)).collect();
    let mut calibrated = calibrate_planar(model, size_px, &planar)?;
    for (result, view) in calibrated.views.iter_mut().zip(views) {
        // A picture with a pose has the residuals in the order of its corners.
        for (residual, corner) in result.residuals.iter_mut().zip(&view.corners) {
            residual.corner = Some([corner.column, corner.row]);
        }
    }
    Ok(calibrated)
}

/// Does the same as [`calibrate`] for any flat target: chessboards, circles, tags.
///
/// # Errors
/// The pictures do not determine the lens: see [`Refusal`].
pub fn calibrate_planar(model: Model, size_px: [u16; 2], views: &[PlanarView]) -> Result<Calibrated, Refusal> {
    let mut fitted = fit(model, size_px, views)?;
    let bow = super::bow::bend(&mut fitted.adjusted);
    let named =
        |fitted: &Fitted| views.iter().map(|v| v.name.clone()).zip(fitted.places.iter().copied()).collect::<Vec<_>>();
    let mut calibrated = finish(&fitted.adjusted, &named(&fitted))?;
    calibrated.bow = bow;
    add_held_out(&mut calibrated, held_out_rms_px(&fitted, bow.is_some()));
    other_model::compare(model, &mut calibrated, |other| {
        let mut fitted = fit(other, size_px, views).ok()?;
        super::bow::bend(&mut fitted.adjusted);
        finish(&fitted.adjusted, &named(&fitted)).ok()
    })?;
    Ok(calibrated)
}

/// Returns the RMS distance in pictures that did not take part in the fit of the lens. Each of them has its pose fitted
/// to the lens of the others.
fn held_out_rms_px(fitted: &Fitted, is_bent: bool) -> Option<f64> {
    let adjusted = &fitted.adjusted;
    let free = Free::all(adjusted.config.model);
    let free = if is_bent { free.with_bow() } else { free };
    let folds = FOLDS.min(adjusted.blocks.len());
    let (mut squares, mut count) = (0.0, 0);
    for fold in 0..folds {
        let part = |inside: bool| -> Vec<Block> {
            let each = adjusted.blocks.iter().enumerate();
            each.filter(|(n, _)| (n % folds == fold) == inside).map(|(_, block)| block.clone()).collect()
        };
        let others = part(false);
        if others.len() < MIN_VIEWS {
            return None;
        }
        let others = adjust(&adjusted.config, &others, &free)?;
        let lens = others.config;
        for block in part(true) {
            let block = adjust_pose(&lens, &block.bent(others.bow_mm))?;
            let (_, rms) = residuals_px(&lens, &block);
            let counting = block.observations.iter().filter(|o| o.weight > 0.0).count();
            squares += rms * rms * counting as f64;
            count += counting;
        }
    }
    let rms = (squares / count as f64).sqrt();
    rms.is_finite().then_some(rms)
}
