//! The bow of a board.
//!
//! A board on paper or cardboard is rarely flat. Its depth behind a plane is b₁ ξ² + b₂ η², with ξ and η from −1 to 1
//! along its rows and columns: two unknowns that all pictures share. A constant depth and a slope are part of the pose.

use nalgebra::DVector;

use crate::adjust::{Adjusted, BOW, Block, Free, adjust};
use crate::between::between_pictures;
use crate::calibrated::Bow;
use crate::finish::least_squares;

/// Squared size of a bow in units of its covariance above which it is real: χ² with two degrees of freedom exceeds it
/// for one in a thousand flat boards.
const MIN_SIZE: f64 = 13.8;

/// Also estimates the bow. A bow that is not larger than its error leaves the adjustment as it is: it would add two
/// unknowns to the lens for nothing.
pub(super) fn bend(flat: &mut Adjusted) -> Option<Bow> {
    set_shape(&mut flat.blocks);
    let bent = adjust(&flat.config, &flat.blocks, &Free::all(flat.config.model).with_bow())?;
    let (sigma_px, alone) = least_squares(&bent)?;
    let covariance = between_pictures(&bent, &alone, sigma_px * sigma_px).map_or(alone, |b| b.covariance);
    let first = covariance.nrows() - BOW;
    let covariance = covariance.view((first, first), (BOW, BOW)).into_owned();
    let depth = DVector::from_row_slice(&bent.bow_mm);
    let size = depth.dot(&covariance.clone().cholesky()?.solve(&depth));
    let bow = Bow { depth_mm: bent.bow_mm, sigma_mm: core::array::from_fn(|k| covariance[(k, k)].sqrt()) };
    (size > MIN_SIZE).then(|| {
        *flat = bent;
        bow
    })
}

/// Sets the shape of the bow at every corner, from the extent of all corners.
fn set_shape(blocks: &mut [Block]) {
    let places = || blocks.iter().flat_map(|b| &b.observations).map(|o| o.place);
    let sides: [(f64, f64); BOW] = core::array::from_fn(|k| {
        let (first, last) = places().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[k]), b.max(p[k])));
        (0.5 * (first + last), 0.5 * (last - first))
    });
    for o in blocks.iter_mut().flat_map(|b| &mut b.observations) {
        o.by_bow = core::array::from_fn(|k| ((o.place[k] - sides[k].0) / sides[k].1).powi(2));
    }
}
