//! Edges of the whole picture by Sobel's gradient (Wang et al. 2022, 2.1).
//!
//! The method reads the gradient of every pixel and puts all edge pixels of the picture into one list. The sampler of
//! the consensus rejects those that do not belong to the limb. An edge pixel has a gradient of more than twice the root
//! mean square of all gradients, as in the automatic threshold of common tools. It is also a maximum: neither neighbour
//! has a larger gradient, along the axis on which the gradient is larger. The method finds a limb even where one
//! threshold does not separate ground from sky.
//!
//! To give the pixels an order along the limb, they are sorted by their angle about the centre of the circle through
//! all of them. The order begins after the widest gap.

use super::BinaryPicture;
use super::order::sort_about_common_circle;
use super::thinned::Thinned;
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::work::{self, WorkBudget};

/// Smallest ratio of the gradient of an edge to the root mean square of all gradients, squared.
// The ratio is squared, so that no pixel needs a root.
const LEAST: u64 = 4;

/// Returns the edge pixels of the picture, sorted by their angle about the common circle. Pixels next to the end of the
/// region or to a mask are no edge pixels.
pub(crate) fn edges<'a, T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    buffer: &'a mut [Pixel],
    work: &mut WorkBudget,
) -> Thinned<'a> {
    let mut edge = Thinned::new(buffer);
    let (mut sum, mut count) = (0u64, 0u64);
    let look = work::gradient_cost(binary.mask_cost());
    each_pixel(binary, look, work, |x, y, _| {
        if let Some((gx, gy)) = gradient(binary, x, y) {
            // Squares of 16-bit gradients over a picture of 65535×65535 pixels exceed 64 bits.
            sum = sum.saturating_add(square(gx, gy));
            count += 1;
        }
    });
    // In a picture without any gradient no pixel is above this limit.
    let least = LEAST * (sum / count.max(1));
    // The gradients are computed a second time, because there is no memory for one number a pixel.
    each_pixel(binary, look, work, |x, y, work| {
        if let Some((gx, gy)) = gradient(binary, x, y)
            && square(gx, gy) > least
            && work.try_spend(2 * look)
            && is_largest(binary, x, y, gx, gy)
        {
            edge.push(Pixel { x, y });
        }
    });
    if work.try_spend(edge.pixels().len() as u32 * work::ORDER) {
        sort_about_common_circle::<T>(edge.pixels_mut());
    }
    edge
}

fn square(gx: i32, gy: i32) -> u64 {
    let (gx, gy) = (u64::from(gx.unsigned_abs()), u64::from(gy.unsigned_abs()));
    gx * gx + gy * gy
}

fn each_pixel<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    cost: u32,
    work: &mut WorkBudget,
    mut visit: impl FnMut(u16, u16, &mut WorkBudget),
) {
    for y in 0..binary.region.height() {
        let Some((x0, x1)) = binary.region.row_span(y) else { continue };
        if !work.try_spend((u32::from(x1 - x0) + 1).saturating_mul(cost)) {
            break;
        }
        for x in x0..=x1 {
            visit(x, y, work);
        }
    }
}

/// Returns eight times the brightness change per pixel, to the right and down; `None` next to the end of the region or
/// a mask.
fn gradient<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: u16,
    y: u16,
) -> Option<(i32, i32)> {
    if !binary.region.is_inside_by(x, y, 1) {
        return None;
    }
    let mut near = [[0i32; 3]; 3];
    for (row, v) in near.iter_mut().zip(y - 1..) {
        for (value, u) in row.iter_mut().zip(x - 1..) {
            if binary.region.masked(u, v) {
                return None;
            }
            binary.observer.pixel(u, v);
            *value = i32::from(binary.picture.at(u, v));
        }
    }
    let [[nw, n, ne], [w, _, e], [sw, s, se]] = near;
    Some(((ne + 2 * e + se) - (nw + 2 * w + sw), (sw + 2 * s + se) - (nw + 2 * n + ne)))
}

/// Returns whether the gradient is a maximum along the axis on which it is larger. Of two equal neighbours the first
/// counts.
fn is_largest<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: u16,
    y: u16,
    gx: i32,
    gy: i32,
) -> bool {
    let across = gx.abs() >= gy.abs();
    let along = |(gx, gy): (i32, i32)| if across { gx.abs() } else { gy.abs() };
    let here = along((gx, gy));
    let (before, after) = if across { ((x - 1, y), (x + 1, y)) } else { ((x, y - 1), (x, y + 1)) };
    let beside = |(x, y): (u16, u16)| gradient(binary, x, y).map(along);
    // Strict on one side only: otherwise a crest of two equal pixels would have two edge pixels, or none.
    beside(before).is_none_or(|g| g < here) && beside(after).is_none_or(|g| g <= here)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::region::Region;
    use crate::image::{Grey, Layout};
    use crate::model::observer::Unobserved;
    use std::vec;
    use std::vec::Vec;

    fn found(data: &[u8], w: u16, h: u16) -> Vec<(u16, u16)> {
        let picture = Grey::try_new(data, Layout::packed(w.into(), h.into(), 1, 8)).unwrap();
        let region = Region::<f64>::whole(w, h);
        // No threshold is needed: every pixel is lit.
        let binary = BinaryPicture::new(&picture, &region, 1, &Unobserved);
        let mut buffer = vec![Pixel::default(); 4096];
        edges(&binary, &mut buffer, &mut WorkBudget::unlimited()).pixels().iter().map(|p| (p.x, p.y)).collect()
    }

    #[test]
    fn an_edge_is_one_pixel_wide_and_needs_no_level() {
        // The step from 60 to 180 is blurred, with row 12 in its middle.
        let row = |y: i32| [60, 75, 100, 140, 165, 180][(y - 10).clamp(0, 5) as usize];
        let data: Vec<u8> = (0..30 * 30).map(|i| row(i / 30)).collect();
        let edge = found(&data, 30, 30);
        assert_eq!(edge.len(), 28, "{edge:?}");
        assert!(edge.iter().all(|p| p.1 == 12 || p.1 == 13) && edge.windows(2).all(|p| p[0].1 == p[1].1), "{edge:?}");
    }

    #[test]
    fn flat_pictures_have_no_edge() {
        assert!(found(&[90; 400], 20, 20).is_empty());
        assert!(found(&[90; 4], 2, 2).is_empty() && found(&[90], 1, 1).is_empty());
    }
}
